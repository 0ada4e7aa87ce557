// Thermal models; what is accepted gives numbers, or says that it gives none.
#include "trunnion/thermal/predictor.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Diagnostics diagnostics;
  const auto model =
      thermal::parse_model({reinterpret_cast<const char*>(data), size}, "input.toml", diagnostics);
  if (!model) return 0;
  thermal::Predictor predictor(*model);
  for (int i = 0; i < 5; ++i) {
    const std::vector<double> degC(predictor.sensors().size(), 20.0 + i);
    static_cast<void>(predictor.read(600.0 * i, degC, 1000.0 * i, 10.0 * i));
    for (std::size_t c = 0; c < model->channels.size(); ++c) {
      static_cast<void>(predictor.estimate(c));
      predictor.measure(c, 0.001 * i);
    }
  }
  return 0;
}
