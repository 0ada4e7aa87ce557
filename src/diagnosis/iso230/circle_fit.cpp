#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/iso230_4.hpp"

namespace trunnion::iso230 {
namespace {

using Vec4 = Eigen::Vector4d;

// a . z <= b
struct Cut {
  Vec4 a;
  double b = 0.0;
};

// min c . z over the cuts: the best of all vertices (intersections of `unknowns` cuts) that keep every cut.
// The sets are small (cutting planes add one cut at a time), so trying all vertices is exact and quick
// enough.
Vec4 solve_small(const Vec4& c, const std::vector<Cut>& cuts, int unknowns, double slack) {
  Vec4 best = Vec4::Zero();
  double least = std::numeric_limits<double>::infinity();
  std::array<std::size_t, 4> pick{};
  const auto m = cuts.size();
  const auto attempt = [&] {
    Eigen::Matrix4d A = Eigen::Matrix4d::Identity();
    Vec4 b = Vec4::Zero();
    for (int k = 0; k < unknowns; ++k) {
      A.row(k) = cuts[pick[static_cast<std::size_t>(k)]].a.transpose();
      b[k] = cuts[pick[static_cast<std::size_t>(k)]].b;
    }
    const Eigen::FullPivLU<Eigen::Matrix4d> lu(A);
    if (!lu.isInvertible()) return;
    const Vec4 z = lu.solve(b);
    if (c.dot(z) >= least) return;
    for (const Cut& cut : cuts)
      if (cut.a.dot(z) > cut.b + slack) return;
    least = c.dot(z);
    best = z;
  };
  const auto choose = [&](auto&& self, std::size_t depth, std::size_t from) -> void {
    if (depth == static_cast<std::size_t>(unknowns)) return attempt();
    for (std::size_t i = from; i < m; ++i) {
      pick[depth] = i;
      self(self, depth + 1, i + 1);
    }
  };
  choose(choose, 0, 0);
  return best;
}

// z = (x, y, R, h). Two-sided: |r - x cos - y sin - R| <= h, min h. One-sided (h = 0): the circle outside
// (sign +1, min R) or inside (sign -1, max R) of all points.
Vec4 chebyshev(const std::vector<RadialPoint>& points, Centre centre) {
  const bool zone = centre == Centre::minimum_zone;
  const double side = centre == Centre::maximum_inscribed ? -1.0 : 1.0;
  const auto cut_of = [&](const RadialPoint& p, double sign) {
    const double co = std::cos(p.angle_rad), si = std::sin(p.angle_rad);
    return Cut{Vec4(-sign * co, -sign * si, -sign, zone ? -1.0 : 0.0), -sign * p.radial_mm};
  };
  Vec4 cost = zone ? Vec4(0, 0, 0, 1) : Vec4(0, 0, side, 0);
  const int unknowns = zone ? 4 : 3;
  // Start: points spread over the turn and over what was measured (an arc), so that the first programme is
  // bounded.
  std::vector<RadialPoint> sorted = points;
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a.angle_rad < b.angle_rad; });
  std::vector<Cut> cuts;
  double spread = 0.0;
  for (const RadialPoint& p : points) spread = std::max(spread, std::abs(p.radial_mm));
  const auto add_start = [&](const RadialPoint& p) {
    for (const Cut& cut : cuts)
      if (cut.a == cut_of(p, side).a) return;
    cuts.push_back(cut_of(p, side));
    if (zone) cuts.push_back(cut_of(p, -side));
  };
  for (std::size_t k = 0; k < 4; ++k) {
    const double want = (static_cast<double>(k) - 1.5) * (kPi / 2.0);
    add_start(
        *std::max_element(points.begin(), points.end(), [&](const RadialPoint& a, const RadialPoint& b) {
          return std::cos(a.angle_rad - want) < std::cos(b.angle_rad - want);
        }));
    add_start(sorted[k * (sorted.size() - 1) / 3]);
  }
  const double slack = 1e-12 * spread + 1e-18;
  Vec4 z = Vec4::Zero();
  for (std::size_t round = 0; round < 2 * points.size(); ++round) {
    z = solve_small(cost, cuts, unknowns, slack);
    double worst = slack;
    Cut add;
    for (const RadialPoint& p : points)
      for (const double sign : {1.0, -1.0}) {
        if (!zone && sign != side) continue;
        const Cut cut = cut_of(p, sign);
        if (const double over = cut.a.dot(z) - cut.b; over > worst) {
          worst = over;
          add = cut;
        }
      }
    if (worst <= slack) break;
    // Cuts that are far from tight no longer bound the optimum; dropping them keeps the programmes small.
    if (cuts.size() > 12)
      std::erase_if(cuts,
                    [&](const Cut& cut) { return cut.b - cut.a.dot(z) > 1e-3 * spread && cuts.size() > 9; });
    cuts.push_back(add);
  }
  return z;
}

Vec4 least_squares(const std::vector<RadialPoint>& points) {
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  Vec3 right = Vec3::Zero();
  for (const RadialPoint& p : points) {
    const Vec3 row(std::cos(p.angle_rad), std::sin(p.angle_rad), 1.0);
    N += row * row.transpose();
    right += row * p.radial_mm;
  }
  const Vec3 z = N.ldlt().solve(right);
  return {z[0], z[1], z[2], 0.0};
}

}  // namespace

std::string_view text_of(Centre centre) {
  switch (centre) {
    case Centre::polar_chart:
      return "PC";
    case Centre::least_squares:
      return "LSC";
    case Centre::minimum_zone:
      return "MZC";
    case Centre::maximum_inscribed:
      return "MIC";
    case Centre::minimum_circumscribed:
      return "MCC";
  }
  return {};
}

CircleFit fit_circle(const std::vector<RadialPoint>& points, Centre centre) {
  TRUNNION_EXPECTS(points.size() >= 3);
  Vec4 z = Vec4::Zero();
  if (centre == Centre::least_squares) {
    z = least_squares(points);
  } else if (centre == Centre::polar_chart) {
    for (const RadialPoint& p : points) z[2] += p.radial_mm / static_cast<double>(points.size());
  } else {
    z = chebyshev(points, centre);
  }
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const RadialPoint& p : points) {
    const double r = p.radial_mm - z[0] * std::cos(p.angle_rad) - z[1] * std::sin(p.angle_rad);
    low = std::min(low, r);
    high = std::max(high, r);
  }
  return {z[0], z[1], z[2], high - low};
}

}  // namespace trunnion::iso230
