#include "thermal/follower.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/contract.hpp"

namespace trunnion::thermal {

using Eigen::VectorXd;

double next_bias(Anchor anchor, double bias_mm, int count, double difference_mm) {
  // Half is where the noise of a measurement is as large as what the model's error moves in 1.4 intervals.
  constexpr double kFollow = 0.5;
  const double share = anchor == Anchor::filter ? std::max(kFollow, 1.0 / count) : 1.0 / count;
  return bias_mm + share * (difference_mm - bias_mm);
}

Follower::Follower(const Candidate& candidate, Fitted fitted)
    : candidate_(candidate), fitted_(std::move(fitted)) {}

double Follower::trusted_level(const VectorXd& x) const {
  return fitted_.guard.weight(x) * fitted_.regressor->level_mm(x);
}

double Follower::unknown_effect_mm(const FeatureVector& x) const {
  const VectorXd from = memory_.anchor.values.size() > 0 && incremental() ? memory_.anchor.values
                                                                          : VectorXd::Zero(x.values.size());
  double squares = 0.0;
  const auto add = [&](const VectorXd& place, const VectorXd& share) {
    if (share.size() == 0 || share.isZero(0.0)) return;
    const VectorXd moved = place + fitted_.guard.spread_of(share);
    squares += std::pow(fitted_.regressor->change_mm(place, moved), 2);
  };
  add(x.values, x.unknown);
  if (incremental()) add(from, memory_.anchor.unknown);
  return std::hypot(std::sqrt(squares), memory_.silent_mm);
}

void Follower::measure(const FeatureVector& x, double value_mm, bool drifted) {
  before_ = memory_;
  if (drifted && fitted_.regressor) {
    if (memory_.anchor.values.size() == 0)
      memory_.anchor = {VectorXd::Zero(x.values.size()), VectorXd::Zero(x.values.size())};
    const VectorXd& from = memory_.anchor.values;
    // What was said without its inputs is no word that was kept or broken.
    if (unknown_effect_mm(x) <= fitted_.typical_change_mm) {
      memory_.record.add(fitted_.guard.scaled(x.values - from), fitted_.regressor->change_mm(from, x.values),
                         value_mm - memory_.last_mm);
    }
  }
  memory_.last_mm = value_mm;
  memory_.drifted = drifted;
  memory_.anchor = x;
  memory_.held = x.values;
  memory_.silent_mm = 0.0;
  if (!drifted) return;
  ++memory_.measurements;
  const double level_mm = fitted_.regressor ? trusted_level(x.values) : 0.0;
  memory_.bias_mm = next_bias(candidate_.anchor, memory_.bias_mm, memory_.measurements, value_mm - level_mm);
}

void Follower::measure_again(const VectorXd& values) {
  // How a sensor went while it was silent nobody knows: between not at all and all the way.
  constexpr double kShare = 0.5;
  const Memory last = std::exchange(memory_, before_);
  FeatureVector x = last.anchor;
  x.values = values;
  measure(x, last.last_mm, last.drifted);
  memory_.held = last.held;
  if (fitted_.regressor)
    memory_.silent_mm = kShare * std::abs(fitted_.regressor->change_mm(last.held, values));
}

Said Follower::say(const FeatureVector& x, bool stale) const {
  Said out;
  out.value_mm = memory_.last_mm;
  if (candidate_.method == Method::none && !stale) out.value_mm = 0.0;
  out.causes.held = stale;
  if (!fitted_.regressor || stale) return out;
  const VectorXd from =
      memory_.anchor.values.size() > 0 ? memory_.anchor.values : VectorXd::Zero(x.values.size());
  const VectorXd since = x.values - from;
  out.distance = fitted_.guard.distance(incremental() ? since : x.values);
  out.causes.unsettled = std::hypot(x.unsettled, memory_.anchor.unsettled);
  out.causes.swing_K = std::hypot(x.swing_K, memory_.anchor.swing_K);
  out.causes.unknown_mm = unknown_effect_mm(x);
  out.causes.held = out.causes.unknown_mm > fitted_.typical_change_mm;
  if (out.causes.held) return out;
  const double change_mm = fitted_.regressor->change_mm(from, x.values);
  out.causes.change_mm = change_mm;
  out.causes.moved = fitted_.guard.scaled(since).squaredNorm() /
                     static_cast<double>(std::max<Eigen::Index>(1, since.size()));
  switch (candidate_.anchor) {
    case Anchor::open:
      out.value_mm = trusted_level(x.values);
      return out;
    case Anchor::bias:
    case Anchor::filter:
      out.value_mm = trusted_level(x.values) + memory_.bias_mm;
      return out;
    case Anchor::update:
      out.value_mm += memory_.record.trust(fitted_.guard.scaled(since), fitted_.guard.weight(since),
                                           fitted_.typical_change_mm) *
                      change_mm;
      return out;
  }
  TRUNNION_EXPECTS(false);
  return out;
}

}  // namespace trunnion::thermal
