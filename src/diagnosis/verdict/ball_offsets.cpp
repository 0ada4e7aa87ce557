#include "diagnosis/verdict/ball_offsets.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"
#include "trunnion/machine/kinematics.hpp"

#include "diagnosis/verdict/ball_place.hpp"

namespace trunnion::diagnosis {
namespace {

// Less is left to the effects.
constexpr double kLeastOfZero_mm = 0.05, kLeastOfZero_rad = 0.01 * kRadPerDegree;
// Share of how far the offset that moves the ball most moves it: an offset that moves it less is not seen.
constexpr double kSeenByTheBall = 1e-3;
constexpr int kOffsetSteps = 30;
constexpr double kOffsetSettled = 1e-9;    // mm, rad
constexpr double kEquationsANumber = 4.0;  // poses that a few numbers would hold by chance prove nothing

// How the ball wanders when these axes, or the tool's length, are put right by some numbers.
class ZeroOffset {
 public:
  // Without axes the tool's length.
  ZeroOffset(const Machine& machine, const Dataset& data, std::vector<TurningRun> runs,
             std::vector<AxisId> axes)
      : machine_(machine), data_(data), runs_(std::move(runs)), axes_(std::move(axes)) {}

  // By Newton's method; what the ball does not show stays zero.
  std::optional<VectorXd> from(const VectorXd& start) const {
    VectorXd by = start;
    for (int step = 0; step < kOffsetSteps; ++step) {
      const VectorXd change = LeastSquares(slope(by), kSeenByTheBall).solve(wander(by));
      by -= change;
      if (!by.allFinite()) return {};
      if (change.norm() < kOffsetSettled) break;
    }
    const VectorXd left = wander(by);
    for (Eigen::Index i = 0; i < left.size(); i += 3)
      if (left.segment<3>(i).norm() > kBallStands_mm) return {};
    return by;
  }
  Eigen::Index size() const { return axes_.empty() ? 1 : static_cast<Eigen::Index>(axes_.size()); }
  bool has_equations() const {
    double equations = 0.0;
    for (const TurningRun& run : runs_) equations += 3.0 * (static_cast<double>(run.rows.size()) - 1.0);
    return equations >= kEquationsANumber * static_cast<double>(size());
  }

 private:
  Vec3 place_P(std::size_t row, const VectorXd& by) const {
    JointVector q = data_.track.state(row).q;
    Vec3 tool_mm = data_.rows[row].tool_mm;
    if (axes_.empty()) tool_mm.z() += by[0];
    for (std::size_t k = 0; k < axes_.size(); ++k) q[axes_[k]] += by[static_cast<Eigen::Index>(k)];
    return forward(machine_, q, tool_mm).p;
  }
  // Of every pose, from the middle of its run.
  VectorXd wander(const VectorXd& by) const {
    std::vector<Vec3> out;
    for (const TurningRun& run : runs_) {
      const std::size_t first = out.size();
      Vec3 middle = Vec3::Zero();
      for (const std::size_t row : run.rows) {
        out.push_back(place_P(row, by));
        middle += out.back() / static_cast<double>(run.rows.size());
      }
      for (std::size_t i = first; i < out.size(); ++i) out[i] -= middle;
    }
    VectorXd flat(3 * static_cast<Eigen::Index>(out.size()));
    for (std::size_t i = 0; i < out.size(); ++i) flat.segment<3>(3 * static_cast<Eigen::Index>(i)) = out[i];
    return flat;
  }
  MatrixXd slope(const VectorXd& by) const {
    constexpr double kStep = 1e-4;  // mm, rad: the places are smooth in both
    MatrixXd out;
    for (Eigen::Index k = 0; k < size(); ++k) {
      const VectorXd step = kStep * VectorXd::Unit(size(), k);
      const VectorXd column = (wander(by + step) - wander(by - step)) / (2.0 * kStep);
      if (k == 0) out.resize(column.size(), size());
      out.col(k) = column;
    }
    return out;
  }

  const Machine& machine_;
  const Dataset& data_;
  std::vector<TurningRun> runs_;
  std::vector<AxisId> axes_;
};

class OffsetSearch {
 public:
  OffsetSearch(const Machine& machine, const Dataset& data, std::vector<TurningRun> runs,
               std::optional<std::size_t> run)
      : machine_(machine), data_(data), runs_(std::move(runs)), run_(run) {}

  // Of one number before those of several.
  std::optional<Convention> found() const {
    for (const AxisId axis : machine_.rotary_axes())
      if (auto c = rotary(axis)) return c;
    if (auto c = tool_length()) return c;
    return linear();
  }

 private:
  std::optional<VectorXd> offset(std::vector<AxisId> axes, const std::vector<double>& starts) const {
    const ZeroOffset offset(machine_, data_, runs_, std::move(axes));
    if (!offset.has_equations()) return {};
    for (const double start : starts)
      if (auto by = offset.from(VectorXd::Constant(offset.size(), start))) return by;
    return {};
  }
  std::optional<Convention> rotary(AxisId axis) const {
    // From 0 an offset of less than 45 degrees is found. Larger ones are mostly a quarter or a half turn.
    const auto by = offset({axis}, {0.0, 0.5 * kPi, -0.5 * kPi, kPi});
    if (!by || std::abs((*by)[0]) < kLeastOfZero_rad) return {};
    return positions({axis}, {std::remainder((*by)[0], 2.0 * kPi)});
  }
  std::optional<Convention> tool_length() const {
    const auto by = offset({}, {0.0});
    if (!by || std::abs((*by)[0]) < kLeastOfZero_mm) return {};
    Convention out;
    out.kind = ConventionKind::tool_length;
    out.run = run_;
    out.by_mm.z() = (*by)[0];
    return out;
  }
  std::optional<Convention> linear() const {
    std::vector<AxisId> axes;
    for (AxisId a = 0; a < machine_.axes.size(); ++a)
      if (machine_.axes[a].kind == AxisKind::linear) axes.push_back(a);
    const auto by = offset(axes, {0.0});
    if (!by) return {};
    std::vector<AxisId> moved;
    std::vector<double> values;
    for (std::size_t k = 0; k < axes.size(); ++k)
      if (const double value = (*by)[static_cast<Eigen::Index>(k)]; std::abs(value) >= kLeastOfZero_mm) {
        moved.push_back(axes[k]);
        values.push_back(value);
      }
    if (moved.empty()) return {};
    return positions(std::move(moved), std::move(values));
  }
  Convention positions(std::vector<AxisId> axes, std::vector<double> by) const {
    Convention out;
    out.kind = ConventionKind::position_offset;
    out.run = run_;
    out.axes = std::move(axes);
    out.by_position = std::move(by);
    return out;
  }

  const Machine& machine_;
  const Dataset& data_;
  std::vector<TurningRun> runs_;
  std::optional<std::size_t> run_;
};

}  // namespace

std::vector<Convention> offsets_that_hold_the_ball(const Machine& machine, const Dataset& data) {
  std::vector<TurningRun> all = turning_runs(machine, data);
  std::erase_if(all, [](const TurningRun& run) { return !run.follows; });
  std::vector<TurningRun> wandering = all;
  std::erase_if(wandering, [](const TurningRun& run) { return run.wanders_mm <= kBallWanders_mm; });
  if (wandering.empty()) return {};
  if (wandering.size() == all.size())
    if (auto c = OffsetSearch(machine, data, wandering, {}).found()) return {std::move(*c)};
  std::vector<Convention> out;
  for (const TurningRun& run : wandering)
    if (auto c = OffsetSearch(machine, data, {run}, run.run).found()) out.push_back(std::move(*c));
  return out;
}

}  // namespace trunnion::diagnosis
