#include "trunnion/thermal/swapped.hpp"

#include <cmath>
#include <utility>

namespace trunnion::thermal {
namespace {

// As the model sees the run: changes over the interval between measurements, or all since the start.
double distance_of(const ChannelModel& channel, double every_s, const FeatureSpec& spec, const Log& log,
                   const LogRun& run) {
  const RunFeatures features = run_features(spec, log, run);
  const bool incremental = channel.candidate.anchor == Anchor::update;
  double sum = 0.0;
  double count = 0.0;
  Eigen::Index from = 0;
  for (std::size_t row = 1; row < run.rows(); ++row) {
    const auto to = static_cast<Eigen::Index>(row);
    if (run.time_s[row] - run.time_s[static_cast<std::size_t>(from)] < every_s) continue;
    const Eigen::VectorXd change =
        (features.values.row(to) - features.values.row(incremental ? from : 0)).transpose();
    sum += std::pow(channel.guard.distance(change), 2);
    count += 1.0;
    from = to;
  }
  return count > 0.0 ? std::sqrt(sum / count) : 0.0;
}

}  // namespace

std::optional<SwappedSensors> find_swapped(const ThermalModel& model, const Log& log, const LogRun& run) {
  for (const ChannelModel& channel : model.channels) {
    if (!channel.regressor) continue;
    const double every_s = model.measure_every_s;
    const double distance = distance_of(channel, every_s, channel.features, log, run);
    if (distance < 1.0) continue;  // within what was taught
    std::optional<SwappedSensors> best;
    const std::size_t sensors = channel.features.sensors.size();
    for (std::size_t i = 0; i < sensors; ++i) {
      for (std::size_t k = i + 1; k < sensors; ++k) {
        FeatureSpec spec = channel.features;
        std::swap(spec.sensors[i], spec.sensors[k]);
        const double exchanged = distance_of(channel, every_s, spec, log, run);
        if (!best || exchanged < best->exchanged)
          best = {channel.features.sensors[i], channel.features.sensors[k], distance, exchanged};
      }
    }
    if (best && best->exchanged < 0.5 * distance && best->exchanged < Guard::kMargin) return best;
  }
  return std::nullopt;
}

}  // namespace trunnion::thermal
