// Any CL text, posted with any options for any control: what was written and passed is numbers, and verify
// passes it again.
#include "../post/posting.hpp"
#include "fuzz/fuzz.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::string> controls = test::shipped_controllers();
  fuzz::Bytes bytes(data, size);
  const std::string& control = controls[bytes.choice(controls.size())];
  const std::size_t flags = bytes.byte();
  const std::size_t more = bytes.byte();
  post::PostOptions options;
  options.axis_tolerance = Angle::degrees(0.2);
  options.rtcp = (flags & 1U) != 0;
  options.tilted_plane = (flags & 2U) != 0;
  if ((flags & 4U) != 0) options.native_arcs = options.native_cycles = true;
  if ((flags & 8U) != 0) options.tools.flute_mm = 30.0;
  if ((flags & 16U) != 0) options.pole.tolerance = Angle::degrees(0.5);
  if ((flags & 32U) != 0) options.nonlinear.method = path::Method::reinsert;
  if ((flags & 64U) != 0) options.nonlinear.thin = true;
  if ((flags & 128U) != 0) options.choice = path::ChoiceMethod::combined;
  if ((more & 1U) != 0) options.cl.cutter_compensation = cl::ReaderOptions::CutterCompensation::wear;
  if ((more & 2U) != 0) options.cl.frames = cl::ReaderOptions::Frames::apply;
  if ((more & 4U) != 0) options.feed = post::FeedOutput::per_minute;
  if ((more & 8U) != 0) options.threads = 2;
  if ((more & 16U) != 0) options.work_offset = 2;
  const std::string cl = bytes.rest();
  const test::Posted posted = test::posted(cl, fuzz::machine(), options, control);
  if (!posted.report) return 0;
  fuzz::hold(posted.nc.find("nan") == std::string::npos || cl.find("nan") != std::string::npos,
             "words are numbers\n" + posted.nc);
  if (!posted.report->verification) fuzz::broken("a program is verified");
  fuzz::hold(!std::isnan(posted.report->verification->largest_tip_deviation_mm()), "a deviation is a number");
  return 0;
}
