#include "trunnion/thermal/features.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

namespace trunnion::thermal {
namespace {

constexpr double kPerThousand = 1e-3;  // rpm to 1000 rpm, mm/min to m/min: features of order one
// Readings that a median is made of, the latest: a logger that sends thousands a second costs no more.
constexpr std::size_t kMostInWindow = 1000;

std::string lag_name(const std::string& signal, double tau_s) {
  return tau_s == 0.0 ? signal : "lag(" + signal + ", " + shortest_text(tau_s) + ")";
}

}  // namespace

std::vector<std::string> FeatureSpec::names() const {
  std::vector<std::string> out;
  for (const double tau : temperature_taus_s) {
    for (const auto& sensor : sensors) out.push_back(lag_name("T_" + sensor, tau));
  }
  for (const double tau : speed_taus_s) {
    for (const double power : speed_powers)
      out.push_back(lag_name(power == 1.0 ? "rpm" : "rpm^" + shortest_text(power), tau));
  }
  for (const double tau : feed_taus_s) out.push_back(lag_name("feed", tau));
  return out;
}

FeatureState::FeatureState(const FeatureSpec& spec)
    : spec_(spec),
      window_(spec.sensors.size()),
      swing_(spec.sensors.size()),
      held_(spec.sensors.size() + spec.speed_powers.size() + 1, 0.0),
      read_at_s_(held_.size(), -std::numeric_limits<double>::infinity()),
      values_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(spec.size()))),
      unknown_(values_) {}

double FeatureState::age_s(std::size_t sensor) const {
  return time_s_ - read_at_s_[sensor];
}

double FeatureState::filtered(std::size_t sensor, double time_s, double value) {
  if (spec_.median_s == 0.0) return value;
  auto& window = window_[sensor];
  window.push_back({time_s, value});
  while (window.size() > 1 &&
         (window.front().time_s <= time_s - spec_.median_s || window.size() > kMostInWindow)) {
    window.pop_front();
  }
  std::vector<double> values;
  for (const TimedValue& v : window) values.push_back(v.value);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::optional<Eigen::VectorXd> FeatureState::changed_mark() {
  if (!mark_ || !std::exchange(mark_->changed, false)) return std::nullopt;
  return mark_->values;
}

// So far it was held at its last reading. What a lag gains by a signal that rises by s a second in place of
// that: s (d - tau (1 - exp(-d / tau))) after d seconds.
void FeatureState::go_evenly(std::size_t sensor, const TimedValue& to) {
  const double from_s = read_at_s_[sensor];
  if (!mark_ || !(mark_->time_s > from_s) || !(to.time_s > from_s)) return;
  const double rate = (to.value - held_[sensor]) / (to.time_s - from_s);
  const auto gained = [&](double tau, double d) {
    return tau > 0.0 ? rate * (d + tau * std::expm1(-d / tau)) : rate * d;
  };
  for (std::size_t t = 0; t < spec_.temperature_taus_s.size(); ++t) {
    const auto k = static_cast<Eigen::Index>(t * spec_.sensors.size() + sensor);
    const double tau = spec_.temperature_taus_s[t];
    mark_->values[k] += gained(tau, mark_->time_s - from_s);
    values_[k] += gained(tau, to.time_s - from_s);
  }
  mark_->changed = true;
}

void FeatureState::step(const Reading& reading) {
  TRUNNION_EXPECTS(!started_ || reading.time_s >= time_s_);
  TRUNNION_EXPECTS(reading.temperature_degC.size() == spec_.sensors.size());
  const double dt = started_ ? reading.time_s - time_s_ : 0.0;
  const std::size_t sensors = spec_.sensors.size();
  const std::size_t powers = spec_.speed_powers.size();
  // First the time since the last reading passes with the values held, ...
  Eigen::Index k = 0;
  const auto relax = [&](double tau, std::size_t signal) {
    if (tau > 0.0) {
      const double share = -std::expm1(-dt / tau);
      const bool read = signal < sensors || time_s_ - read_at_s_[signal] <= kDriveHeld_s;
      values_[k] += share * (held_[signal] - values_[k]);
      unknown_[k] += share * ((read ? 0.0 : 1.0) - unknown_[k]);
    }
    ++k;
  };
  for (const double tau : spec_.temperature_taus_s) {
    for (std::size_t i = 0; i < sensors; ++i) relax(tau, i);
  }
  for (const double tau : spec_.speed_taus_s) {
    for (std::size_t p = 0; p < powers; ++p) relax(tau, sensors + p);
  }
  for (const double tau : spec_.feed_taus_s) relax(tau, sensors + powers);
  // What lasts longer than this the features tell themselves.
  constexpr double kQuick_s = 120.0;
  constexpr double kRemembered_s = 600.0;
  for (std::size_t i = 0; i < sensors; ++i) {
    Swing& s = swing_[i];
    const double away_K = held_[i] - s.lag;
    const double share = -std::expm1(-dt / kRemembered_s);
    s.above_K2 += share * (std::pow(std::max(away_K, 0.0), 2) - s.above_K2);
    s.below_K2 += share * (std::pow(std::min(away_K, 0.0), 2) - s.below_K2);
    s.lag += -std::expm1(-dt / kQuick_s) * away_K;
  }
  // ... then the new ones take their place.
  for (std::size_t i = 0; i < sensors; ++i) {
    if (std::isnan(reading.temperature_degC[i])) continue;
    const double value = filtered(i, reading.time_s, reading.temperature_degC[i]);
    const bool first = !std::isfinite(read_at_s_[i]);
    if (!first) go_evenly(i, {reading.time_s, value});
    held_[i] = value;
    if (first) swing_[i].lag = value;
    read_at_s_[i] = reading.time_s;
    for (std::size_t t = 0; t < spec_.temperature_taus_s.size(); ++t) {
      if (first || spec_.temperature_taus_s[t] == 0.0)
        values_[static_cast<Eigen::Index>(t * sensors + i)] = value;
    }
  }
  if (!std::isnan(reading.spindle_rpm)) {
    for (std::size_t p = 0; p < powers; ++p) {
      held_[sensors + p] = std::pow(std::abs(reading.spindle_rpm) * kPerThousand, spec_.speed_powers[p]);
      read_at_s_[sensors + p] = reading.time_s;
    }
  }
  if (!std::isnan(reading.feed_mm_s)) {
    held_[sensors + powers] = reading.feed_mm_s * kSecondsPerMinute * kPerThousand;
    read_at_s_[sensors + powers] = reading.time_s;
  }
  time_s_ = reading.time_s;
  started_ = true;
}

double FeatureState::unsettled() const {
  if (spec_.speed_taus_s.empty() || spec_.speed_powers.empty() || spec_.speed_powers.front() != 1.0)
    return 0.0;
  const std::size_t sensors = spec_.sensors.size();
  const auto fastest = static_cast<Eigen::Index>(sensors * spec_.temperature_taus_s.size());
  return std::abs(held_[sensors] - values_[fastest]);
}

double FeatureState::swing_K() const {
  double K2 = 0.0;
  for (const Swing& s : swing_) {
    const double both = s.above_K2 + s.below_K2;
    // The whole mean square where both ways are alike, nothing where it went one way.
    if (both > 0.0) K2 = std::max(K2, 4.0 * s.above_K2 * s.below_K2 / both);
  }
  return std::sqrt(K2);
}

RunFeatures run_features(const FeatureSpec& spec, const Log& log, const LogRun& run) {
  std::vector<std::size_t> sensor;
  for (const auto& name : spec.sensors) {
    TRUNNION_EXPECTS(log.sensor(name).has_value());
    sensor.push_back(*log.sensor(name));
  }
  FeatureState state(spec);
  // A sensor whose first reading comes late was settled at it before: no jump from nothing.
  std::vector<double> first;
  for (const std::size_t i : sensor) {
    const auto& column = run.temperature_degC[i];
    const auto it = std::find_if(column.begin(), column.end(), [](double v) { return !std::isnan(v); });
    const bool late = it != column.begin() && it != column.end();
    first.push_back(late ? *it : std::numeric_limits<double>::quiet_NaN());
  }
  if (run.rows() > 0) {
    state.step({.time_s = run.time_s.front(),
                .temperature_degC = first,
                .spindle_rpm = kNotRead,
                .feed_mm_s = kNotRead});
  }
  RunFeatures out;
  out.values.resize(static_cast<Eigen::Index>(run.rows()), static_cast<Eigen::Index>(spec.size()));
  out.unknown.resizeLike(out.values);
  out.unsettled.resize(out.values.rows());
  out.swing_K.resize(out.values.rows());
  std::vector<double> temperature(sensor.size());
  for (std::size_t row = 0; row < run.rows(); ++row) {
    for (std::size_t i = 0; i < sensor.size(); ++i) temperature[i] = run.temperature_degC[sensor[i]][row];
    state.step({.time_s = run.time_s[row],
                .temperature_degC = temperature,
                .spindle_rpm = run.spindle_rpm.empty() ? kNotRead : run.spindle_rpm[row],
                .feed_mm_s = run.feed_mm_s.empty() ? kNotRead : run.feed_mm_s[row]});
    out.values.row(static_cast<Eigen::Index>(row)) = state.values().transpose();
    out.unknown.row(static_cast<Eigen::Index>(row)) = state.unknown().transpose();
    out.unsettled[static_cast<Eigen::Index>(row)] = state.unsettled();
    out.swing_K[static_cast<Eigen::Index>(row)] = state.swing_K();
  }
  return out;
}

}  // namespace trunnion::thermal
