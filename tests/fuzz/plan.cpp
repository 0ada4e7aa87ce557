// Measuring plans; what is accepted is laid out.
#include "trunnion/diagnosis/plan.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Diagnostics diagnostics;
  const auto plan = diagnosis::parse_plan({reinterpret_cast<const char*>(data), size}, "input.toml",
                                          fuzz::machine(), diagnostics);
  if (plan) static_cast<void>(diagnosis::expand(plan->runs, fuzz::machine()));
  return 0;
}
