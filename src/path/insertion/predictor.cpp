#include "trunnion/path/predictor.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"

#include "path/bounds/closed_forms.hpp"
#include "path/bounds/expansion.hpp"

namespace trunnion::path {
namespace {

constexpr std::string_view kHarmonic = "harmonic";

// Interior samples of a prediction whose largest value is not known to be in the middle.
constexpr int kScan = 16;

}  // namespace

std::optional<Predictor> predictor_from_text(std::string_view text) {
  if (text == "parabola") return Predictor{Predictor::Kind::parabola, 1};
  if (text == "skew") return Predictor{Predictor::Kind::skew, 1};
  if (text == "quartic") return Predictor{Predictor::Kind::quartic, 1};
  if (text == "exact") return Predictor{Predictor::Kind::exact, 1};
  if (text.substr(0, kHarmonic.size()) != kHarmonic) return std::nullopt;
  const std::string_view order = text.substr(kHarmonic.size());
  if (order.empty()) return Predictor{};
  if (order.size() != 1 || order[0] < '1' || order[0] > '0' + kMaxHarmonicOrder) return std::nullopt;
  return Predictor{Predictor::Kind::harmonic, order[0] - '0'};
}

std::string predictor_text(const Predictor& predictor) {
  switch (predictor.kind) {
    case Predictor::Kind::harmonic:
      return std::string(kHarmonic) + (predictor.order == 1 ? "" : std::to_string(predictor.order));
    case Predictor::Kind::parabola:
      return "parabola";
    case Predictor::Kind::skew:
      return "skew";
    case Predictor::Kind::quartic:
      return "quartic";
    case Predictor::Kind::exact:
      return "exact";
  }
  return {};
}

ErrorModel::ErrorModel(const TableKinematics& kinematics, const Station& a, const Station& b,
                       const Predictor& predictor)
    : kinematics_(&kinematics),
      a_(&a),
      b_(&b),
      predictor_(predictor),
      midpoint_(middle_tip(kinematics, a, b) - 0.5 * (a.tip_P + b.tip_P)) {
  if (predictor.kind == Predictor::Kind::skew || predictor.kind == Predictor::Kind::quartic) {
    const Vec3 chord = b.tip_P - a.tip_P;
    const Vec3 slope0 = tip_slope(kinematics, a, a.q, b.q) - chord;
    const Vec3 slope1 = tip_slope(kinematics, b, a.q, b.q) - chord;
    odd_ = 0.5 * (slope0 + slope1);
    even_ = 0.5 * (slope0 - slope1);
  }
  if (predictor.kind != Predictor::Kind::harmonic) return;
  TRUNNION_EXPECTS(predictor.order >= 1 && predictor.order <= kMaxHarmonicOrder);
  // Sines 1..N through the N samples at j/(N+1): they are orthogonal there. N = 1 gives A = e(1/2), Eq. 3.3.
  const int n = predictor.order;
  sines_.fill(Vec3::Zero());
  for (int j = 1; j <= n; ++j) {
    const double k = static_cast<double>(j) / (n + 1);
    const Vec3 e = n == 1 ? midpoint_ : exact(k);
    for (int m = 1; m <= n; ++m) {
      sines_[static_cast<std::size_t>(m - 1)] += (2.0 / (n + 1) * std::sin(kPi * m * k)) * e;
    }
  }
}

Vec3 ErrorModel::exact(double k) const {
  const JointVector q = JointVector::interpolate(a_->q, b_->q, k);
  return kinematics_->tip_P(q, kinematics_->sines(q)) - ((1.0 - k) * a_->tip_P + k * b_->tip_P);
}

Vec3 ErrorModel::at(double k) const {
  const double bow = k * (1.0 - k);
  const double side = 1.0 - 2.0 * k;
  switch (predictor_.kind) {
    case Predictor::Kind::parabola:
      return (4.0 * bow) * midpoint_;
    case Predictor::Kind::skew:
      return bow * (4.0 * midpoint_ + side * odd_);
    case Predictor::Kind::quartic:
      return bow * (4.0 * midpoint_ + side * odd_ + (side * side) * (even_ - 4.0 * midpoint_));
    case Predictor::Kind::exact:
      return exact(k);
    case Predictor::Kind::harmonic:
      break;
  }
  Vec3 sum = Vec3::Zero();
  for (int m = 1; m <= predictor_.order; ++m) {
    sum += std::sin(kPi * m * k) * sines_[static_cast<std::size_t>(m - 1)];
  }
  return sum;
}

double ErrorModel::largest_distance() const {
  const auto distance = [&](double k, const Vec3& e) {
    return distance_to_segment((1.0 - k) * a_->tip_P + k * b_->tip_P + e, a_->tip_P, b_->tip_P);
  };
  double largest = distance(0.5, midpoint_);
  if (predictor_.middle_is_largest()) return largest;
  for (int i = 1; i < kScan; ++i) {
    const double k = static_cast<double>(i) / kScan;
    largest = std::max(largest, distance(k, at(k)));
  }
  return largest;
}

}  // namespace trunnion::path
