// Any NC text against a CL file (points, or arcs and holes), with each controller, with and without a flute.
#include "trunnion/post/verify.hpp"

#include "fuzz/controls_on_machine.hpp"
#include "support/folders.hpp"

using namespace trunnion;

namespace {

std::string golden_cl(const std::string& name) {
  std::ifstream file(test::source_folder() + "/tests/golden/" + name);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string points = golden_cl("part.cls");
  static const std::string shapes = golden_cl("shapes.cls");
  fuzz::Bytes bytes(data, size);
  const nc::Controller& control = fuzz::control_on_machine(bytes.byte());
  const std::size_t flags = bytes.byte();
  const std::string& cl = (flags & 1U) != 0 ? shapes : points;
  post::VerifyOptions options;
  if ((flags & 2U) != 0) options.tools.flute_mm = 50.0;
  Machine machine = fuzz::machine();
  machine.switchable_kinematics = (flags & 4U) != 0;
  options.tools.tool = 1;
  options.tools.length_mm = fuzz::machine().tool_length_mm;
  Diagnostics diagnostics;
  const auto report = post::verify({std::make_unique<test::TextOf>(cl), "part.cls"},
                                   {std::make_unique<test::TextOf>(bytes.rest()), "input"},
                                   {machine, control, options}, diagnostics);
  if (report) fuzz::hold(!std::isnan(report->largest_tip_deviation_mm()), "a deviation is a number");
  return 0;
}
