#pragma once
#include <memory>

#include "trunnion/thermal/model.hpp"

namespace trunnion::thermal {

/// A candidate fitted to some runs.
struct Fitted {
  std::shared_ptr<const Regressor> regressor;  // null for none and hold_last
  Guard guard;
  double typical_change_mm = 0.0;
};

/// What is said at one moment.
struct Said {
  double value_mm = 0.0;  // relative to the reference
  double distance = 0.0;  // of the state from the training, see Guard
  Causes causes;          // but for the age, which the caller knows
};

/// Follows one channel through a run, state by state and measurement by measurement: the validation and the
/// Predictor are both this. Features and values count from the run's reference state.
class Follower {
 public:
  Follower(const Candidate& candidate, Fitted fitted);

  /// A measurement at features `x`. @param drifted  false for the one that is the zero itself
  void measure(const FeatureVector& x, double value_mm, bool drifted);
  /// The last measurement once more, at these values: sensors that were silent then have been read since.
  void measure_again(const Eigen::VectorXd& values);
  /// @param stale  a sensor was silent for long: the last measurement is held
  Said say(const FeatureVector& x, bool stale) const;

 private:
  bool incremental() const { return candidate_.anchor == Anchor::update; }
  double trusted_level(const Eigen::VectorXd& x) const;
  // How far the change since the last measurement may be off because speed or feed were not read: what
  // the model would say had the unknown share of each feature moved by its spread in the training.
  double unknown_effect_mm(const FeatureVector& x) const;
  Candidate candidate_;
  Fitted fitted_;
  // What the measurements have left.
  struct Memory {
    FeatureVector anchor;    // at the last measurement; empty: at the reference
    Eigen::VectorXd held;    // its values as they were known then
    double silent_mm = 0.0;  // what sensors that were silent then may have done
    double last_mm = 0.0;
    bool drifted = false;  // it was not the zero itself
    double bias_mm = 0.0;
    TrackRecord record;
    int measurements = 0;  // after the reference
  };
  Memory memory_, before_;  // before the last measurement
};

/// The bias after measurement number `count` (from 1) that differs from f by `difference_mm`.
double next_bias(Anchor anchor, double bias_mm, int count, double difference_mm);

}  // namespace trunnion::thermal
