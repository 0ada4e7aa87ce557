#include "thermal/watch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trunnion::thermal {

namespace {
constexpr double kNoLimit = std::numeric_limits<double>::infinity();
}  // namespace

std::vector<double> usual_moves_K(const ThermalModel& model, const std::vector<std::string>& sensors) {
  std::vector<double> out(sensors.size(), kNoLimit);
  for (const ChannelModel& channel : model.channels) {
    const FeatureSpec& spec = channel.features;
    if (spec.temperature_taus_s.empty() || spec.temperature_taus_s.front() != 0.0) continue;
    const Eigen::VectorXd spread =
        channel.guard.spread_of(Eigen::VectorXd::Ones(static_cast<Eigen::Index>(spec.size())));
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      const auto it = std::find(spec.sensors.begin(), spec.sensors.end(), sensors[i]);
      if (it != spec.sensors.end()) out[i] = std::min(out[i], spread[it - spec.sensors.begin()]);
    }
  }
  return out;
}

SensorWatch::SensorWatch(std::vector<double> usual_move_K)
    : usual_move_K_(std::move(usual_move_K)), sensors_(usual_move_K_.size()) {}

std::vector<double> SensorWatch::believed(double time_s, std::span<const double> degC) {
  std::vector<double> out(degC.begin(), degC.end());
  time_s_ = time_s;
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    if (std::isnan(out[i])) continue;
    Sensor& s = sensors_[i];
    constexpr double kSlow_s = 60.0;  // as in whole logs
    const bool soon = s.away > 0 || time_s - s.good_s <= kSlow_s;
    if (soon && std::abs(out[i] - s.good_degC) > limits_.max_jump_K) {
      ++s.away;
      out[i] = kNotRead;
      continue;
    }
    follow(i, time_s, out[i]);
    s.good_degC = out[i];
    s.good_s = time_s;
    s.away = 0;
  }
  for (Sensor& s : sensors_) {
    for (std::size_t k = 0; k < s.least_degC.size(); ++k) {
      if (out[k] < s.least_degC[k]) s.least_degC[k] = out[k];
      if (out[k] > s.most_degC[k]) s.most_degC[k] = out[k];
    }
  }
  return out;
}

void SensorWatch::follow(std::size_t sensor, double time_s, double degC) {
  Sensor& s = sensors_[sensor];
  if (degC != s.good_degC) {
    if (!std::isnan(s.good_degC)) {
      const double now = degC > s.good_degC ? 1.0 : -1.0;
      if (now * s.direction < 0.0) ++s.turns;
      s.direction = now;
      s.moved = true;
    }
    s.readings_before += s.readings;
    s.readings = 0;
    s.since_s = time_s;
    s.least_degC.assign(sensors_.size(), kNoLimit);
    s.most_degC.assign(sensors_.size(), -kNoLimit);
  }
  ++s.readings;
}

bool SensorWatch::stuck(std::size_t sensor) const {
  const Sensor& s = sensors_[sensor];
  if (s.readings <= 2 || time_s_ - s.since_s < limits_.stuck_s) return false;
  double others_K = 0.0;
  for (std::size_t k = 0; k < sensors_.size(); ++k) {
    if (k != sensor) others_K = std::max(others_K, s.most_degC[k] - s.least_degC[k]);
  }
  if (others_K < limits_.stuck_while_other_K) return false;
  if (!s.moved) return usual_move_K_[sensor] >= limits_.stuck_least_K;
  constexpr double kSilentTurns = 20.0;  // as in whole logs
  const auto readings = static_cast<double>(s.readings);
  return static_cast<double>(s.turns) * readings > kSilentTurns * static_cast<double>(s.readings_before);
}

}  // namespace trunnion::thermal
