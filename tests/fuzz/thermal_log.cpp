// Temperature logs: faults out, means of 15 s, prediction by a model; offsets and tools, which are tables of
// the same kind.
#include "trunnion/thermal/condition.hpp"
#include "trunnion/thermal/predictor.hpp"

#include "fuzz/thermal_model.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const std::size_t which = bytes.choice(2);
  const std::string text = bytes.rest();
  Diagnostics diagnostics;
  if (which == 1) static_cast<void>(thermal::parse_offsets(text, "input.csv", diagnostics));
  if (which != 0) return 0;
  const auto log = thermal::parse_log(text, "input.csv", diagnostics);
  if (!log) return 0;
  std::vector<thermal::SensorFault> faults;
  const thermal::Log kept =
      thermal::resampled(thermal::without_faults(*log, {}, faults), thermal::kLogStep_s);
  for (std::size_t run = 0; run < kept.runs.size(); ++run) {
    const auto predicted = thermal::predict(fuzz::thermal_model(), kept, run, thermal::UseMeasurements::yes);
    if (!predicted) continue;
    for (const auto& channel : predicted->channel)
      for (const thermal::Estimate& e : channel) fuzz::hold(e.finite(), "an estimate is a number");
  }
  return 0;
}
