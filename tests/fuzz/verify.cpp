// Any NC text against a CL file, with each controller.
#include "trunnion/post/verify.hpp"

#include "trunnion/post/axes_of.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

namespace {

const nc::Controller& controller(std::size_t i) {
  static const std::vector<nc::Controller> all = [] {
    std::vector<nc::Controller> out;
    for (const std::string& name : test::shipped_controllers())
      out.push_back(post::with_axes_of(fuzz::machine(), test::shipped_controller(name)));
    return out;
  }();
  return all[i % all.size()];
}

std::string golden_cl() {
  std::ifstream file(std::string(TRUNNION_SOURCE_DIR) + "/tests/golden/part.cls");
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string cl = golden_cl();
  fuzz::Bytes bytes(data, size);
  const nc::Controller& control = controller(bytes.byte());
  post::VerifyOptions options;
  options.tools.tool = 1;
  options.tools.length_mm = fuzz::machine().tool_length_mm;
  Diagnostics diagnostics;
  const auto report = post::verify(std::make_unique<test::TextOf>(cl), "part.cls",
                                   std::make_unique<test::TextOf>(bytes.rest()), "input", fuzz::machine(),
                                   control, {}, options, diagnostics);
  if (report) fuzz::hold(!std::isnan(report->largest_tip_deviation_mm()), "a deviation is a number");
  return 0;
}
