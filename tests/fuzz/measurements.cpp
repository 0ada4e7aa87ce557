// Measurement files; what is accepted is evaluated against a model of nothing.
#include "trunnion/diagnosis/evaluate.hpp"
#include "trunnion/diagnosis/measurement.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Diagnostics diagnostics;
  const diagnosis::NamedText text{"input.csv", std::string(reinterpret_cast<const char*>(data), size)};
  const auto dataset = diagnosis::parse_measurements(std::span(&text, 1), fuzz::machine(), diagnostics);
  if (!dataset) return 0;
  try {
    if (dataset->readings.size() < 600)
      static_cast<void>(diagnosis::evaluate(fuzz::machine(), *dataset, {}, 10));
  } catch (const Failure&) {
  }
  return 0;
}
