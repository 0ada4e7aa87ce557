// Any NC text against a CL file, with each controller.
#include "trunnion/post/verify.hpp"

#include "fuzz/controls_on_machine.hpp"

using namespace trunnion;

namespace {

std::string golden_cl() {
  std::ifstream file(std::string(TRUNNION_SOURCE_DIR) + "/tests/golden/part.cls");
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string cl = golden_cl();
  fuzz::Bytes bytes(data, size);
  const nc::Controller& control = fuzz::control_on_machine(bytes.byte());
  post::VerifyOptions options;
  options.tools.tool = 1;
  options.tools.length_mm = fuzz::machine().tool_length_mm;
  Diagnostics diagnostics;
  const auto report = post::verify({std::make_unique<test::TextOf>(cl), "part.cls"},
                                   {std::make_unique<test::TextOf>(bytes.rest()), "input"}, fuzz::machine(),
                                   control, options, diagnostics);
  if (report) fuzz::hold(!std::isnan(report->largest_tip_deviation_mm()), "a deviation is a number");
  return 0;
}
