#include "path/insertion/subtraction.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::path {
namespace {

// Depth to which `subtract` halves a segment whose prediction stays short.
constexpr int kSubtractHalvings = 12;

}  // namespace

// Intermediate points of the linear interpolation, linear axes moved by -R_MP e(t) (paper 001, Eq. 3.4),
// rotary axes left. Where the prediction stays short the segment is halved: the middle, whose error is known
// whatever predicts the rest, comes to stand on the chord.
bool Subtraction::halve(const Station& a, const Station& b, double t0, double t1, int halvings) {
  const ErrorModel model(kinematics(), a, b, judge_.options().predictor);
  const std::size_t before = nodes_.size();
  if (halvings > 0 && judge_.within(a, b)) return true;
  if (insert_evenly(a, b, t0, t1, model)) return true;
  nodes_.resize(before);
  if (halvings >= kSubtractHalvings || nodes_.size() >= kMostInserted) return false;
  const double t = 0.5 * (t0 + t1);
  const JointVector q = JointVector::interpolate(a.q, b.q, 0.5);
  const Vec3 tip = kinematics().tip_P(q, kinematics().sines(q));
  const Node middle = maker_.node_at(t, q, tip - model.midpoint(), true);
  const bool first = halve(a, middle.station, t0, t, halvings + 1);
  nodes_.push_back(middle);
  return halve(middle.station, b, t, t1, halvings + 1) && first;
}

bool Subtraction::insert_evenly(const Station& a, const Station& b, double t0, double t1,
                                const ErrorModel& model) {
  constexpr std::size_t kTries = 3;
  const std::size_t before = nodes_.size();
  const double ratio = std::sqrt(model.largest_distance() / judge_.tolerance().tip_mm);
  const auto least = static_cast<std::size_t>(std::max(2.0, std::ceil(ratio)));
  for (std::size_t pieces = least; pieces < least + kTries && pieces <= kMostInserted; ++pieces) {
    nodes_.resize(before);
    bool within = true;
    Station last = a;
    for (std::size_t j = 1; j <= pieces && within; ++j) {
      if (j == pieces) {
        within = judge_.within(last, b);
        break;
      }
      const double k = static_cast<double>(j) / static_cast<double>(pieces);
      const JointVector q = JointVector::interpolate(a.q, b.q, k);
      const Vec3 tip = kinematics().tip_P(q, kinematics().sines(q));
      nodes_.push_back(maker_.node_at(t0 + k * (t1 - t0), q, tip - model.at(k), true));
      within = judge_.within(last, nodes_.back().station);
      last = nodes_.back().station;
    }
    if (within) return true;
  }
  return false;
}

}  // namespace trunnion::path
