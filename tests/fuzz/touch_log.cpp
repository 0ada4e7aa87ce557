// Logs of a probing program: what is taken has a ball of the stated radius at every pose.
#include "trunnion/probe/program.hpp"
#include "trunnion/probe/reading.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

namespace {

constexpr double kBallRadius_mm = 12.7;
constexpr double kStylusRadius_mm = 3.0;

// Of the program that the log of the corpus (touch_log.txt) belongs to.
probe::Strokes strokes() {
  probe::ProgramOptions options;
  options.ball.place_P = {60.0, 40.0, 30.0};
  options.ball.radius_mm = kBallRadius_mm;
  options.ball.stylus_radius_mm = kStylusRadius_mm;
  options.ball.stylus_length_mm = fuzz::machine().tool_length_mm;
  options.ball.within_mm = 4.71;
  options.poses = 6;
  nc::Controller control = test::shipped_controller("linuxcnc");
  control.tcp.unknown_at_start = control.tcp.switches_kinematics && fuzz::machine().switchable_kinematics;
  const auto program = probe::make_program(fuzz::machine(), control, options);
  if (!program) fuzz::broken(program.error().text());
  Diagnostics diagnostics;
  const auto read = probe::read_strokes(fuzz::machine(), control, program->text, "probe.nc", diagnostics);
  if (!read) fuzz::broken(read.error().text());
  return *read;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const probe::Strokes program = strokes();
  const auto reading =
      probe::read_touches(fuzz::machine(), program, {reinterpret_cast<const char*>(data), size}, "input", {});
  if (!reading) return 0;
  fuzz::hold(reading->poses.size() == program.poses.size(), "every pose of the program was read");
  fuzz::hold(std::abs(reading->radius_mm - kBallRadius_mm - kStylusRadius_mm) <= 0.05,
             "the radius is that of the ball");
  for (const probe::PoseReading& pose : reading->poses)
    fuzz::hold(pose.deviation_M.allFinite() && pose.u_mm.allFinite(), "deviations are numbers");
  return 0;
}
