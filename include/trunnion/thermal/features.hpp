#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "trunnion/thermal/log.hpp"

namespace trunnion::thermal {

/// What a model sees of the machine at one moment: temperatures, their first-order lags, and lags of spindle
/// speed and feed. All are causal: a value holds until the next reading, lags of temperatures start settled,
/// lags of speed and feed at rest.
struct FeatureSpec {
  std::vector<std::string> sensors;
  /// A temperature is the median of its readings over so long (0: the reading). The door that opens for each
  /// measurement lets the sensors dip just when the model is taught and re-anchored; the median does not see
  /// it.
  double median_s = 0.0;
  std::vector<double> temperature_taus_s;  // one lag of each sensor for each; 0 is the temperature itself
  std::vector<double> speed_taus_s;        // lags of the spindle speed (in 1000 rpm) ...
  std::vector<double> speed_powers;  // ... to each of these powers: friction heat grows as speed^1 to ^2
  std::vector<double> feed_taus_s;   // lags of the feed (in m/min)

  std::size_t size() const {
    return sensors.size() * temperature_taus_s.size() + speed_taus_s.size() * speed_powers.size() +
           feed_taus_s.size();
  }
  /// `T_front`, `lag(T_front, 900)`, `lag(rpm^2, 600)`, `lag(feed, 600)`: in the order of the values.
  std::vector<std::string> names() const;
  bool operator==(const FeatureSpec&) const = default;
};

/// One reading of everything that features are made of; NaN: not read at this moment.
struct Reading {
  double time_s = 0.0;
  std::span<const double> temperature_degC;  // in the order of FeatureSpec::sensors
  double spindle_rpm = 0.0;
  double feed_mm_s = 0.0;
};

/// A speed or feed holds so long after it was read; then it is unknown, not 0.
inline constexpr double kDriveHeld_s = 300.0;

/// Feature values and how much of each is unknown (0 to 1: all of it), since its speed or feed was not read.
struct FeatureVector {
  Eigen::VectorXd values, unknown;
  double unsettled = 0.0;  // see FeatureState::unsettled
  double swing_K = 0.0;    // see FeatureState::swing_K
};

/// Follows a run reading by reading.
class FeatureState {
 public:
  explicit FeatureState(const FeatureSpec& spec);
  /// Takes the next reading (later than the one before). A temperature that was not read keeps its value;
  /// before its first reading it has none, and its features are zero-change from the moment it appears.
  void step(const Reading& reading);
  /// Feature values, degC, krpm^p, m/min: only differences within a run mean anything.
  const Eigen::VectorXd& values() const { return values_; }
  /// How much of each value comes from a speed or feed that was not read: its lag of the same time constant.
  const Eigen::VectorXd& unknown() const { return unknown_; }
  /// How far the spindle speed is from its fastest lag, 1000 rpm; 0 without lags of the speed. Bearings
  /// spread within seconds of a change, which no temperature shows.
  double unsettled() const;
  /// How far a temperature has swung of late, both up and down about its own lag of two minutes, K: the one
  /// that did most. A spindle that starts and stops within minutes does things that temperatures tell too
  /// late: its bearings spread within seconds, and the median and the sensors lag by minutes. A machine that
  /// only grows warm does not swing, however fast it does.
  double swing_K() const;
  /// Seconds since each sensor was read last; infinite before the first reading.
  double age_s(std::size_t sensor) const;
  /// Keeps the values of this moment. A sensor that is silent now is taken to have gone evenly from its last
  /// reading to its next one, in them and in its lags: `changed_mark` gives the values as they then are, once
  /// after each such reading.
  void mark() { mark_ = Mark{time_s_, values_, false}; }
  std::optional<Eigen::VectorXd> changed_mark();

 private:
  struct TimedValue {
    double time_s, value;
  };
  struct Swing {
    double lag = 0.0;
    double above_K2 = 0.0, below_K2 = 0.0;  // mean squares of late of what is above and below the lag
  };
  struct Mark {
    double time_s;
    Eigen::VectorXd values;
    bool changed;
  };
  double filtered(std::size_t sensor, double time_s, double value);
  void go_evenly(std::size_t sensor, const TimedValue& to);
  FeatureSpec spec_;
  std::vector<std::deque<TimedValue>> window_;  // readings of each sensor within median_s
  std::vector<Swing> swing_;                    // of the sensors
  std::vector<double> held_;                    // signals: sensors, speed powers, feed
  std::vector<double> read_at_s_;               // of the signals
  Eigen::VectorXd values_, unknown_;
  double time_s_ = 0.0;
  bool started_ = false;
  std::optional<Mark> mark_;
};

/// Features of all rows of a run (rows x features), and how much of each is unknown.
struct RunFeatures {
  Eigen::MatrixXd values, unknown;
  Eigen::VectorXd unsettled, swing_K;
  FeatureVector at(Eigen::Index row) const {
    return {values.row(row).transpose(), unknown.row(row).transpose(), unsettled[row], swing_K[row]};
  }
};
/// Sensors are looked up by name in `log`.
RunFeatures run_features(const FeatureSpec& spec, const Log& log, const LogRun& run);

}  // namespace trunnion::thermal
