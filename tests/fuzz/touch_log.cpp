// Logs of a probing program, any text or the right log with lines and numbers changed: what is taken has a
// ball of the stated radius at every pose, and a right log with a change or two its centres near the truth.
#include "trunnion/base/number_text.hpp"
#include "trunnion/probe/program.hpp"
#include "trunnion/probe/reading.hpp"

#include "../probe/given.hpp"
#include "fuzz/fuzz.hpp"

using namespace trunnion;

namespace {

struct Campaign {
  Campaign() : given("trunnion_offset") {
    probe::ProgramOptions options = given.options();
    options.poses = 6;
    const auto program = probe::make_program(given.machine, given.control, options);
    if (!program) fuzz::broken(program.error().text());
    Diagnostics diagnostics;
    auto read = probe::read_strokes(given.machine, given.control, program->text, "probe.nc", diagnostics);
    if (!read) fuzz::broken(read.error().text());
    strokes = std::move(*read);
    hidden = given.hidden(options.ball);
    hidden.a_point[1] += 0.3;
    hidden.c_point[0] -= 0.4;
    hidden.noise_mm = 0.001;
    constexpr std::uint64_t kSeed = 7;
    std::istringstream log(test::run_probing(program->text, hidden, kSeed).log);
    for (std::string line; std::getline(log, line);) lines.push_back(line + "\n");
  }

  test::Given given;
  probe::Strokes strokes;
  test::HiddenMachine hidden;
  std::vector<std::string> lines;  // of the right log
};

// One change a pair of bytes and more.
std::string changed(std::vector<std::string> lines, fuzz::Bytes& bytes) {
  while (!bytes.empty() && !lines.empty()) {
    const std::size_t from = bytes.choice(lines.size());
    const std::size_t to = bytes.choice(lines.size());
    const std::size_t how = bytes.choice(5);
    if (how == 0) lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(from));
    if (how == 1) std::swap(lines[from], lines[to]);
    if (how == 2) lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(to), std::string(lines[from]));
    if (how >= 3) {
      std::string& line = lines[from];
      const std::size_t begin = line.find_first_of("-0123456789", bytes.choice(line.size()));
      if (begin == std::string::npos) continue;
      const std::size_t end = std::min(line.find_first_not_of("-.0123456789", begin), line.size());
      const ParsedNumber number = parse_number(std::string_view(line).substr(begin, end - begin));
      if (number) line.replace(begin, end - begin, fixed_text(number.value + bytes.number(-2.0, 2.0), 6));
    }
  }
  std::string out;
  for (const std::string& line : lines) out += line;
  return out;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Campaign campaign;
  fuzz::Bytes bytes(data, size);
  // A byte that no text begins with.
  const bool right_before = bytes.byte() == 0x01;
  const std::string log =
      right_before ? changed(campaign.lines, bytes) : std::string(reinterpret_cast<const char*>(data), size);
  const auto reading = probe::read_touches(campaign.given.machine, campaign.strokes, log, "input", {});
  if (!reading) {
    fuzz::hold(!right_before || size > 1, "the right log is taken: " + reading.error().text());
    return 0;
  }
  fuzz::hold(reading->poses.size() == campaign.strokes.poses.size(), "every pose of the program was read");
  fuzz::hold(std::abs(reading->radius_mm - campaign.hidden.reach_mm) <= 0.05,
             "the radius is that of the ball");
  for (std::size_t i = 0; i < reading->poses.size(); ++i) {
    const probe::PoseReading& pose = reading->poses[i];
    fuzz::hold(pose.deviation_M.allFinite() && pose.u_mm.allFinite(), "deviations are numbers");
    if (!right_before) continue;
    const auto ball = campaign.hidden.ball_at(campaign.strokes.poses[i][3] * kDegreePerRad,
                                              campaign.strokes.poses[i][4] * kDegreePerRad);
    // A touch that is off by less than the log's other touches allow is taken.
    constexpr double kOff_mm = 0.5;
    for (int k = 0; k < 2; ++k)
      fuzz::hold(std::abs(pose.sphere.center_mm[k] - ball[static_cast<std::size_t>(k)]) <= kOff_mm,
                 "a changed log was taken, and a centre is off\n" + log);
  }
  return 0;
}
