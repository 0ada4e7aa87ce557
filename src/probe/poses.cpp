#include "trunnion/probe/poses.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/geom/linear_algebra.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/probe/axis_lines.hpp"

namespace trunnion::probe {
namespace {

using Matrix = Eigen::MatrixXd;

constexpr std::size_t kFewest = 4;
constexpr double kStep = 15.0 * kRadPerDegree;  // of the grid over the rotary axes
// That a pose stays within the travel of a rotary axis: the sums of a control may end a little beyond a word
// (LinuxCNC stops behind a touch at a limit of -30 deg, where it finds itself at -30.000000000000004).
constexpr double kInside = 0.01 * kRadPerDegree;
// Where one axis alone turns a part, one that turns for ever is taken from here to there.
constexpr double kTurn = kTwoPi;

// Multiples of the step within the limits, and the limits' ends a little inside.
std::vector<double> stations(const Axis& axis, double step) {
  const bool endless = !axis.has_limits() || axis.max - axis.min >= kTurn;
  const double low = endless ? -kPi : axis.min;
  const double high = endless ? kPi - 0.5 * step : axis.max;
  std::vector<double> out;
  for (double at = std::ceil(low / step - 1e-9) * step; at <= high + 1e-9; at += step)
    out.push_back(std::clamp(at, low, high));
  if (out.empty()) out.push_back(0.5 * (low + high));
  return out;
}

// How the ball's centre in M changes with the four numbers of each axis and with its place in P.
Matrix sensitivity(const Machine& machine, const AxisLines& lines, const Vec3& ball_P, const JointVector& q) {
  constexpr double kBy = 1e-5;  // mm, rad: the differences are central
  Matrix out(3, lines.count() + 3);
  Eigen::VectorXd by = Eigen::VectorXd::Zero(lines.count());
  for (Eigen::Index i = 0; i < lines.count(); ++i) {
    by[i] = kBy;
    const Vec3 ahead = part_in_machine(lines.moved(by), q) * ball_P;
    by[i] = -kBy;
    const Vec3 back = part_in_machine(lines.moved(by), q) * ball_P;
    by[i] = 0.0;
    out.col(i) = (ahead - back) / (2.0 * kBy);
  }
  out.rightCols<3>() = part_in_machine(machine, q).R;
  return out;
}

struct Candidate {
  JointVector q;
  Matrix rows;  // lengths as they are, angles by their arm
};

// All combinations of the rotary axes' stations.
std::vector<JointVector> grid_of(const Machine& machine, const std::vector<AxisId>& axes) {
  const auto outer = stations(machine.axes[axes.front()], kStep);
  const auto inner =
      axes.size() > 1 ? stations(machine.axes[axes.back()], 2.0 * kStep) : std::vector<double>{0.0};
  std::vector<JointVector> out;
  out.reserve(outer.size() * inner.size());
  for (const double a : outer) {
    for (const double c : inner) {
      JointVector q;
      q[axes.front()] = a;
      if (axes.size() > 1) q[axes.back()] = c;
      out.push_back(q);
    }
  }
  return out;
}

std::vector<Candidate> candidates_of(const Machine& machine, const PoseChoice& choice,
                                     const AxisLines& lines) {
  // Angles count by what they do 100 mm away, so that the determinant has one unit; it shifts no choice.
  constexpr double kArm_mm = 100.0;
  std::vector<Candidate> out;
  const auto& axes = lines.axes();
  for (const JointVector& asked : choice.planned.empty() ? grid_of(machine, axes) : choice.planned) {
    JointVector q;
    for (const AxisId id : axes) {
      const Axis& axis = machine.axes[id];
      const bool ends = axis.has_limits() && axis.max - axis.min > 2.0 * kInside;
      q[id] = choice.rounded(
          id, ends ? std::clamp(asked[id], axis.min + kInside, axis.max - kInside) : asked[id]);
    }
    const Vec3 up = part_in_machine(machine, q).R.col(2);
    if (angle_between(up, Vec3::UnitZ()) > choice.largest_tilt + Angle::degrees(1e-6)) continue;
    if (!choice.reachable(q)) continue;
    Candidate one{q, sensitivity(machine, lines, choice.ball_P, q)};
    for (Eigen::Index i = 0; i < lines.count(); ++i) {
      if (i % AxisLines::kEach >= 2) one.rows.col(i) /= kArm_mm;
    }
    out.push_back(std::move(one));
  }
  return out;
}

double log_determinant(const Matrix& normal) {
  return log_determinant_of_positive(normal, 1e-300);
}

double rotary_distance(const Machine& machine, const JointVector& a, const JointVector& b) {
  double most = 0.0;
  for (const AxisId id : machine.rotary_axes())
    most = std::max(most, std::abs(a[id] - b[id]) / machine.axes[id].rapid.value_or(1.0));
  return most;
}

// Open tour from the first: nearest neighbour, then pairs of legs exchanged while it gets shorter.
std::vector<std::size_t> shortest_order(const Machine& machine, const std::vector<JointVector>& poses) {
  const std::size_t n = poses.size();
  const auto distance = [&](std::size_t i, std::size_t j) {
    return rotary_distance(machine, poses[i], poses[j]);
  };
  std::vector<std::size_t> order{0};
  std::vector<bool> taken(n, false);
  taken[0] = true;
  while (order.size() < n) {
    std::size_t next = n;
    for (std::size_t i = 0; i < n; ++i) {
      if (!taken[i] && (next == n || distance(order.back(), i) < distance(order.back(), next))) next = i;
    }
    taken[next] = true;
    order.push_back(next);
  }
  for (bool shorter = true; shorter;) {
    shorter = false;
    for (std::size_t i = 1; i + 1 < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        const double before =
            distance(order[i - 1], order[i]) + (j + 1 < n ? distance(order[j], order[j + 1]) : 0.0);
        const double after =
            distance(order[i - 1], order[j]) + (j + 1 < n ? distance(order[i], order[j + 1]) : 0.0);
        if (after >= before - 1e-12) continue;
        std::reverse(order.begin() + static_cast<std::ptrdiff_t>(i),
                     order.begin() + static_cast<std::ptrdiff_t>(j) + 1);
        shorter = true;
      }
    }
  }
  return order;
}

}  // namespace

ChosenPoses choose_poses(const Machine& machine, const PoseChoice& choice) {
  ChosenPoses out;
  const AxisLines lines(machine);
  const auto candidates = candidates_of(machine, choice, lines);
  out.candidates = candidates.size();
  if (candidates.size() < kFewest) return out;
  const auto size = lines.count() + 3;
  const std::size_t count =
      choice.planned.empty() ? std::min(choice.count, candidates.size()) : candidates.size();
  // The smallest of weights keeps the determinant above zero while there are too few poses.
  constexpr double kWeight = 1e-9;
  Matrix normal = kWeight * Matrix::Identity(size, size);
  const auto add = [&](const Candidate& c, double sign) { normal += sign * c.rows.transpose() * c.rows; };
  std::vector<std::size_t> chosen;
  std::vector<bool> taken(candidates.size(), false);
  const auto take = [&](std::size_t i) {
    chosen.push_back(i);
    taken[i] = true;
    add(candidates[i], 1.0);
  };
  std::size_t first = 0;
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    if (rotary_distance(machine, candidates[i].q, {}) < rotary_distance(machine, candidates[first].q, {}))
      first = i;
  }
  take(first);
  const auto best_to_add = [&] {
    std::size_t best = candidates.size();
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (taken[i]) continue;
      const double gain = log_determinant(normal + candidates[i].rows.transpose() * candidates[i].rows);
      if (gain > most + 1e-9) {
        most = gain;
        best = i;
      }
    }
    return best;
  };
  while (chosen.size() < count) take(best_to_add());
  constexpr int kMostRounds = 20;
  for (int round = 0; round < kMostRounds && count < candidates.size(); ++round) {
    bool better = false;
    for (std::size_t k = 1; k < chosen.size(); ++k) {
      const double before = log_determinant(normal);
      const std::size_t old = chosen[k];
      add(candidates[old], -1.0);
      taken[old] = false;
      const std::size_t next = best_to_add();
      taken[next] = true;
      chosen[k] = next;
      add(candidates[next], 1.0);
      better = better || log_determinant(normal) > before + 1e-9;
    }
    if (!better) break;
  }
  std::vector<JointVector> poses;
  poses.reserve(chosen.size());
  for (const std::size_t i : chosen) poses.push_back(candidates[i].q);
  for (const std::size_t i : shortest_order(machine, poses)) out.poses.push_back(poses[i]);

  Matrix plain = Matrix::Zero(size, size);
  for (const JointVector& q : out.poses) {
    const Matrix rows = sensitivity(machine, lines, choice.ball_P, q);
    plain += rows.transpose() * rows;
  }
  const Matrix inverse = pseudo_inverse(plain);
  const Matrix seen = inverse * plain;
  for (Eigen::Index i = 0; i < lines.count(); ++i) {
    const bool tells = seen(i, i) > 0.99;
    out.sigma_of_um.push_back(tells ? kMmPerUm * std::sqrt(inverse(i, i))
                                    : std::numeric_limits<double>::infinity());
  }
  return out;
}

}  // namespace trunnion::probe
