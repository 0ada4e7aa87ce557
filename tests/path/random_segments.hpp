#pragma once
#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <random>

#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/certificate.hpp"

namespace trunnion::test {

/// What random segments have in common.
enum class Family {
  chord,      // tip moves 0.01 to 20 mm in any direction
  free,       // linear axes move up to 20 mm in any direction
  held,       // tip stands still, or moves up to 0.1 mm
  pole,       // outer axis within 5 degrees of the pole, inner one turns far
  cancelled,  // linear axes such that the midpoint error (nearly) vanishes: the error is S-shaped
};
inline constexpr std::array kFamilies{Family::chord, Family::free, Family::held, Family::pole,
                                      Family::cancelled};

/// Seeded random segments of one machine; rotary steps from 1e-4 degrees to `largest_step`, evenly in the
/// logarithm.
class RandomSegments {
 public:
  RandomSegments(const Machine& machine, unsigned seed)
      : kinematics_(machine, machine.tool_vector()), random_(seed) {
    for (const Axis& axis : machine.axes) rotary_.push_back(axis.kind == AxisKind::rotary);
  }
  const TableKinematics& kinematics() const { return kinematics_; }
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }

  struct Segment {
    path::Station a, b;
    path::Reference own() const { return {a.tip_P, b.tip_P, a.axis_P, b.axis_P}; }
  };

  Segment next(Family family, Angle largest_step) {
    JointVector q0;
    JointVector q1;
    for (AxisId id = 0; id < rotary_.size(); ++id) {
      q0[id] = rotary_[id] ? uniform(-3.2, 3.2) : uniform(-300.0, 300.0);
      q1[id] = q0[id];
    }
    if (family == Family::pole) q0[kinematics_.rotary(0)] = Angle::degrees(uniform(-5.0, 5.0)).rad();
    for (std::size_t k = 0; k < 2; ++k) {
      const AxisId id = kinematics_.rotary(k);
      const double least = std::log(1e-4);
      const double step = std::exp(uniform(least, std::log(largest_step.deg())));
      const bool small = family == Family::pole && k == 0;
      q1[id] = q0[id] +
               Angle::degrees(small ? uniform(-1.0, 1.0) : (uniform(-1.0, 1.0) < 0.0 ? -step : step)).rad();
    }
    return linear(family, q0, q1);
  }

 private:
  Vec3 direction() {
    std::normal_distribution<double> normal;
    return Vec3(normal(random_), normal(random_), normal(random_)).normalized();
  }

  Segment linear(Family family, JointVector q0, JointVector q1) {
    // A point of the part 1 to 400 mm from its zero.
    const Vec3 tip = direction() * std::exp(uniform(0.0, std::log(400.0)));
    kinematics_.solve_linear(tip, kinematics_.sines(q0), q0);
    double length = std::exp(uniform(std::log(0.01), std::log(20.0)));
    if (family == Family::held) length = uniform(-1.0, 1.0) < 0.0 ? 0.0 : uniform(0.0, 0.1);
    kinematics_.solve_linear(tip + length * direction(), kinematics_.sines(q1), q1);
    if (family == Family::free) {
      const Vec3 d = direction() * uniform(0.0, 20.0);
      Eigen::Index i = 0;
      for (AxisId id = 0; id < rotary_.size(); ++id) {
        if (!rotary_[id]) q1[id] = q0[id] + d[i++];
      }
    }
    if (family == Family::cancelled) cancel(q0, q1);
    return {path::station(kinematics_, q0), path::station(kinematics_, q1)};
  }

  // The midpoint error is affine in the linear axes' end positions: least squares.
  void cancel(const JointVector& q0, JointVector& q1) const {
    const auto error = [&](const JointVector& end) {
      const Vec3 middle = kinematics_.pose(JointVector::interpolate(q0, end, 0.5)).tip_P;
      return Vec3(middle - 0.5 * (kinematics_.pose(q0).tip_P + kinematics_.pose(end).tip_P));
    };
    const Vec3 e = error(q1);
    Mat3 slope;
    std::array<AxisId, 3> ids{};
    Eigen::Index column = 0;
    for (AxisId id = 0; id < rotary_.size(); ++id) {
      if (rotary_[id]) continue;
      JointVector moved = q1;
      moved[id] += 1.0;
      ids[static_cast<std::size_t>(column)] = id;
      slope.col(column++) = error(moved) - e;
    }
    const Eigen::JacobiSVD<Mat3, Eigen::FullPivHouseholderQRPreconditioner> svd(
        slope, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Vec3 step = Vec3::Zero();
    for (Eigen::Index k = 0; k < 2; ++k) {  // K is of rank two
      const double sigma = svd.singularValues()[k];
      if (sigma > 1e-9) step -= svd.matrixV().col(k) * (svd.matrixU().col(k).dot(e) / sigma);
    }
    if (step.norm() > 500.0) return;
    for (std::size_t k = 0; k < 3; ++k) q1[ids[k]] += step[static_cast<Eigen::Index>(k)];
  }

  TableKinematics kinematics_;
  std::vector<bool> rotary_;
  std::mt19937_64 random_;
};

}  // namespace trunnion::test
