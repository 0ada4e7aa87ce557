#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/iso230_4.hpp"
#include "trunnion/geom/linear_algebra.hpp"

namespace trunnion::iso230 {
namespace {

// A commanded point may lie off its circle by the rounding of the file's digits (mm); n off the radial
// direction likewise (sine).
constexpr double kOffCircle_mm = 0.02;
constexpr double kOffRadial = 2e-3;

Vec3 point_of(const Reading& r) {
  return {r.position[0], r.position[1], r.position[2]};
}

// Centre of the circle through points of a plane, least squares (Kasa's linear form; exact for points on a
// circle).
Vec3 centre_of(const std::vector<const Reading*>& rows, int first, int second) {
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  Vec3 right = Vec3::Zero();
  const Vec3 base = point_of(*rows.front());
  for (const Reading* row : rows) {
    const Vec3 p = point_of(*row) - base;
    const Vec3 a(p[first], p[second], 1.0);
    N += a * a.transpose();
    right += a * (p[first] * p[first] + p[second] * p[second]);
  }
  const Vec3 z = N.inverse() * right;
  Vec3 centre = base;
  centre[first] += 0.5 * z[0];
  centre[second] += 0.5 * z[1];
  return centre;
}

Result<std::vector<CircularPath>> paths_of(const std::vector<const Reading*>& rows, const std::string& file) {
  const auto refuse = [&](const std::string& what) {
    return fail(ErrorCode::wrong_input, "run " + rows.front()->run + ": " + what, file,
                {rows.front()->line, 1});
  };
  Vec3 low = point_of(*rows.front()), high = low;
  for (const Reading* row : rows) {
    low = low.cwiseMin(point_of(*row));
    high = high.cwiseMax(point_of(*row));
  }
  std::vector<int> moving;
  for (int k = 0; k < 3; ++k)
    if (high[k] - low[k] > kOffCircle_mm) moving.push_back(k);
  if (moving.size() != 2 || rows.size() < 8)
    return refuse("not a circle in a plane of two linear axes with 8 points or more");
  // The plane's positive sense: XY, YZ, ZX.
  int first = moving[0], second = moving[1];
  if (first == 0 && second == 2) std::swap(first, second);
  CircularPath path;
  path.plane = {Reading::kAxes[static_cast<std::size_t>(first)],
                Reading::kAxes[static_cast<std::size_t>(second)]};
  path.centre_M = centre_of(rows, first, second);
  for (const Reading* row : rows)
    path.radius_mm += (point_of(*row) - path.centre_M).norm() / static_cast<double>(rows.size());
  std::vector<CircularPath> out;
  double last_angle = 0.0;
  int sense = 0;
  CircularPath current = path;
  const auto finish = [&] {
    current.counter_clockwise = sense > 0;
    if (current.points.size() >= 8) out.push_back(current);
  };
  for (const Reading* row : rows) {
    const Vec3 arm = point_of(*row) - path.centre_M;
    if (std::abs(arm.norm() - path.radius_mm) > kOffCircle_mm)
      return refuse("a point lies " + shortest_text(arm.norm() - path.radius_mm) + " mm off the circle");
    const double radial = row->n.dot(arm.normalized());
    if (std::abs(radial) < 1.0 - kOffRadial) return refuse("n is not radial");
    const double angle = std::atan2(arm[second], arm[first]);
    if (!current.points.empty()) {
      const double step = std::remainder(angle - last_angle, kTwoPi);
      const int now = step > 1e-9 ? 1 : step < -1e-9 ? -1 : 0;
      if (sense == 0) sense = now;
      if (now != 0 && now != sense) {  // the path turns round: the point of the turn belongs to both ways
        const RadialPoint turn = current.points.back();
        finish();
        current.points = {turn};
        sense = now;
      }
    }
    current.points.push_back({angle, row->deviation * (radial > 0 ? 1.0 : -1.0)});
    last_angle = angle;
  }
  finish();
  return out;
}

double largest_gap(const CircularPath& path) {
  std::vector<double> angles;
  for (const RadialPoint& p : path.points) angles.push_back(p.angle_rad);
  std::sort(angles.begin(), angles.end());
  double gap = angles.front() + kTwoPi - angles.back();
  for (std::size_t i = 1; i < angles.size(); ++i) gap = std::max(gap, angles[i] - angles[i - 1]);
  return gap;
}

// A full circle leaves no gap above twice its mean step.
bool is_full(const CircularPath& path) {
  const double gap = largest_gap(path);
  return gap < 2.5 * kTwoPi / static_cast<double>(path.points.size()) || gap < 0.1;
}

CircularTest::OneWay one_way(const CircularPath& path) {
  CircularTest::OneWay out;
  out.full_circle = is_full(path);
  out.G = fit_circle(path.points, Centre::minimum_zone).width;
  const CircleFit lsc = fit_circle(path.points, Centre::least_squares);
  out.G_lsc = lsc.width;
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    const RadialPoint& p = path.points[i];
    const double f = out.full_circle
                         ? p.radial_mm - lsc.x * std::cos(p.angle_rad) - lsc.y * std::sin(p.angle_rad)
                         : p.radial_mm;
    out.F_max = i == 0 ? f : std::max(out.F_max, f);
    out.F_min = i == 0 ? f : std::min(out.F_min, f);
  }
  return out;
}

void merge(std::optional<CircularTest::OneWay>& into, const CircularTest::OneWay& add) {
  if (!into) {
    into = add;
    return;
  }
  into->G = std::max(into->G, add.G);
  into->G_lsc = std::max(into->G_lsc, add.G_lsc);
  into->F_max = std::max(into->F_max, add.F_max);
  into->F_min = std::min(into->F_min, add.F_min);
  into->full_circle = into->full_circle && add.full_circle;
}

// Amplitudes of cos 2t and sin 2t by least squares beside the circle (1, cos t, sin t).
std::pair<double, double> second_harmonic(const std::vector<RadialPoint>& points) {
  Eigen::Matrix<double, 5, 5> N = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> right = Eigen::Matrix<double, 5, 1>::Zero();
  for (const RadialPoint& p : points) {
    Eigen::Matrix<double, 5, 1> row;
    row << 1.0, std::cos(p.angle_rad), std::sin(p.angle_rad), std::cos(2 * p.angle_rad),
        std::sin(2 * p.angle_rad);
    N += row * row.transpose();
    right += row * p.radial_mm;
  }
  const Eigen::Matrix<double, 5, 1> z = solve_positive(N, right);
  return {z[3], z[4]};
}

// -1, 0, 1: an axis that turns round here has no direction.
double sign_of(double v) {
  constexpr double kTurnsRound = 1e-9;
  return v > kTurnsRound ? 1.0 : v < -kTurnsRound ? -1.0 : 0.0;
}

// What one unit of a cause does to the radius at angle t; `sense` is 1 counter-clockwise, -1 clockwise.
// Lost motion b leaves an axis b/2 behind its direction of motion: of the first axis that is -sense sin t, of
// the second sense cos t.
double shape_of(CircleCause::Kind kind, double t, double sense) {
  switch (kind) {
    case CircleCause::Kind::scale_mismatch:
      return 0.5 * std::cos(2 * t);
    case CircleCause::Kind::squareness:
      return -0.5 * std::sin(2 * t);
    case CircleCause::Kind::lost_motion_first:
      return 0.5 * sense * sign_of(std::sin(t)) * std::cos(t);
    case CircleCause::Kind::lost_motion_second:
      return -0.5 * sense * sign_of(std::cos(t)) * std::sin(t);
    case CircleCause::Kind::servo_mismatch:
      return sense * std::sin(2 * t);
    case CircleCause::Kind::radius:
      return 0.5 * sense;
  }
  return 0.0;
}

}  // namespace

Result<std::vector<CircularPath>> circular_paths(const Readings& readings) {
  std::vector<std::string> order;
  std::map<std::string, std::vector<const Reading*>> runs;
  for (const Reading& row : readings.rows) {
    if (row.rotation) continue;
    auto& rows = runs[row.run];
    if (rows.empty()) order.push_back(row.run);
    rows.push_back(&row);
  }
  std::vector<CircularPath> out;
  for (const std::string& run : order) {
    const auto paths = paths_of(runs[run], readings.file);
    if (!paths) return tl::unexpected(paths.error());
    out.insert(out.end(), paths->begin(), paths->end());
  }
  if (out.empty()) return fail(ErrorCode::wrong_input, "no displacement readings on a circle", readings.file);
  return out;
}

Result<std::vector<CircularTest>> evaluate_circles(const std::vector<CircularPath>& paths) {
  std::map<std::pair<std::string, long long>, std::vector<const CircularPath*>> groups;
  for (const CircularPath& path : paths)
    groups[{path.plane, std::llround(path.radius_mm / kOffCircle_mm)}].push_back(&path);
  std::vector<CircularTest> out;
  for (const auto& [key, group] : groups) {
    CircularTest test;
    test.plane = group.front()->plane;
    test.radius_mm = group.front()->radius_mm;
    std::vector<RadialPoint> all;
    for (const CircularPath* path : group) {
      merge(path->counter_clockwise ? test.counter_clockwise : test.clockwise, one_way(*path));
      all.insert(all.end(), path->points.begin(), path->points.end());
    }
    if (test.clockwise && test.counter_clockwise) {
      test.G_b = fit_circle(all, Centre::minimum_zone).width;
      test.D = fit_circle(all, Centre::least_squares).radius;
    }
    const auto [cos2, sin2] = second_harmonic(all);
    test.scale_mismatch = 2.0 * cos2;
    test.opening_rad = -2.0 * sin2 / test.radius_mm;
    out.push_back(std::move(test));
  }
  return out;
}

std::vector<CircleCause> circle_causes(const std::vector<const CircularPath*>& paths) {
  constexpr double kDependent = 1e-6;  // of the largest pivot
  using Kind = CircleCause::Kind;
  std::vector<Kind> kinds = {Kind::scale_mismatch, Kind::squareness, Kind::lost_motion_first,
                             Kind::lost_motion_second};
  Eigen::Index rows = 0;
  bool ways[2] = {false, false};
  for (const CircularPath* path : paths) {
    if (largest_gap(*path) > 0.5 * kTwoPi) return {};
    ways[path->counter_clockwise ? 1 : 0] = true;
    rows += static_cast<Eigen::Index>(path->points.size());
  }
  if (ways[0] && ways[1]) kinds.insert(kinds.end(), {Kind::servo_mismatch, Kind::radius});
  const auto causes = static_cast<Eigen::Index>(kinds.size());
  // Where the ball was set up, path by path, and the common radius are none of them.
  Eigen::MatrixXd set_up = Eigen::MatrixXd::Zero(rows, 1 + 2 * static_cast<Eigen::Index>(paths.size()));
  Eigen::MatrixXd shapes(rows, causes);
  Eigen::VectorXd radial(rows);
  Eigen::Index row = 0, column = 1;
  for (const CircularPath* path : paths) {
    for (const RadialPoint& p : path->points) {
      set_up(row, 0) = 1.0;
      set_up(row, column) = std::cos(p.angle_rad);
      set_up(row, column + 1) = std::sin(p.angle_rad);
      for (Eigen::Index k = 0; k < causes; ++k)
        shapes(row, k) =
            shape_of(kinds[static_cast<std::size_t>(k)], p.angle_rad, path->counter_clockwise ? 1.0 : -1.0);
      radial[row++] = p.radial_mm;
    }
    column += 2;
  }
  const LeastSquares of_set_up(set_up);
  radial -= set_up * of_set_up.solve(radial);
  shapes -= set_up * of_set_up.solve_all(shapes);
  const double whole = radial.squaredNorm();
  if (rows == 0 || whole <= 0.0) return {};
  const Eigen::VectorXd sizes = LeastSquares(shapes, kDependent).solve(radial);
  std::vector<CircleCause> out;
  for (Eigen::Index k = 0; k < causes; ++k)
    out.push_back(
        {kinds[static_cast<std::size_t>(k)], sizes[k] * shapes.col(k).dot(radial) / whole, sizes[k]});
  return out;
}

}  // namespace trunnion::iso230
