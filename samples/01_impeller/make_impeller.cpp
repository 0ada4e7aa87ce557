// Writes the CL file of a splittered radial impeller: finishing of every blade by a ball-end mill, both
// sides, several passes from the shroud down to where the ball touches the hub.
//
//   make_impeller POINTS > impeller.cls          POINTS = number of GOTO records, 1000 to 10000000
//
// Part frame P: z along the impeller's axis, the inlet on top at z = 0; mm. A blade is the ruled surface
// between a curve on the hub and one on the shroud, both given by u, 0 at the inlet and 1 at the outlet.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/geom/vec.hpp"

namespace {

using namespace trunnion;
using namespace trunnion::literals;

// The wheel: 7 blades, 7 splitters that begin at a third of the channel.
constexpr int kBlades = 7;
constexpr double kSplitterStart = 0.34;
// The tool and how it stands on the blade.
constexpr double kBallRadius_mm = 2.0;
constexpr double kHubAllowance_mm = 0.05;
constexpr Angle kTilt = 9_deg;        // away from the blade, about the feed direction
constexpr Angle kLeadInlet = 34_deg;  // towards the inlet, in the blade: frees the shank from the hub's rise
constexpr Angle kLeadOutlet = 20_deg;
constexpr double kHighest_v = 0.97;  // the first pass, 3 % below the shroud
constexpr double kRunOut = 0.02;     // of u, beyond both ends of a blade
// Links.
constexpr double kRetract_mm = 30.0;
constexpr double kPlunge_mm = 3.0;
constexpr double kSafeHeight_mm = 60.0;
constexpr long kLinkPoints = 4;  // of one blade side: above, in front of and at the start; away from the end

struct Tool {
  Vec3 tip_P;
  Vec3 axis_P;
};

// A point of the meridional plane: radius and height. Quarter ellipses, axial at the inlet, radial at the
// outlet.
struct Meridian {
  double r;
  double z;
};
Meridian hub(double u) {
  const double a = u * kPi / 2;
  return {14.0 + 41.0 * (1 - std::cos(a)), -40.0 * std::sin(a)};
}
Meridian shroud(double u) {
  const double a = u * kPi / 2;
  return {33.0 + 22.0 * (1 - std::cos(a)), -2.0 - 32.0 * std::sin(a)};
}

// Wrap of the blade about the axis: steep at the inlet, swept back at the outlet; the shroud lags, which
// leans the blade.
double wrap(double u, double v) {
  return -(62_deg).rad() * (u - 0.25 * u * u) + (10_deg).rad() * v * (1 - u) + (7_deg).rad() * v * u;
}
double half_thickness_mm(double u, double v) {
  return (0.9 - 0.4 * v) * (0.6 + 1.6 * u * (1 - u));
}

Vec3 camber(double u, double v) {
  const Meridian h = hub(u);
  const Meridian s = shroud(u);
  const Vec3 on_hub(h.r * std::cos(wrap(u, 0)), h.r * std::sin(wrap(u, 0)), h.z);
  const Vec3 on_shroud(s.r * std::cos(wrap(u, 1)), s.r * std::sin(wrap(u, 1)), s.z);
  return on_hub + v * (on_shroud - on_hub);
}

// Ball centre and axis at (u, v) of the blade at angle 0; `side` +1 or -1.
struct Contact {
  Vec3 centre_P;
  Vec3 axis_P;
};
Contact contact(double u, double v, int side) {
  constexpr double kStep = 1e-4;
  const Vec3 along = ((camber(u + kStep, v) - camber(u - kStep, v)) / (2 * kStep)).normalized();
  const Vec3 ruling = (camber(u, 1) - camber(u, 0)).normalized();
  const Vec3 normal = side * along.cross(ruling).normalized();
  const double blend = u * u * (3 - 2 * u);
  const double lead = kLeadInlet.rad() + (kLeadOutlet.rad() - kLeadInlet.rad()) * blend;
  const Vec3 in_blade = (ruling - ruling.dot(along) * along).normalized();
  const Vec3 led = std::cos(lead) * in_blade - std::sin(lead) * along;
  const Vec3 axis = (std::cos(kTilt.rad()) * led + std::sin(kTilt.rad()) * normal).normalized();
  return {camber(u, v) + (half_thickness_mm(u, v) + kBallRadius_mm) * normal, axis};
}

// Distance of a point from the hub's surface of revolution, outside positive: Newton on the nearest point of
// the ellipse.
double distance_from_hub_mm(const Vec3& p) {
  const double r = std::hypot(p.x(), p.y());
  double u = std::clamp(-p.z() / 40.0, 0.05, 0.95);
  const auto slope = [&](double at) {
    const double a = at * kPi / 2;
    return (hub(at).r - r) * 41.0 * std::sin(a) - (hub(at).z - p.z()) * 40.0 * std::cos(a);
  };
  for (int i = 0; i < 30; ++i) {
    constexpr double kStep = 1e-6;
    const double derivative = (slope(u + kStep) - slope(u - kStep)) / (2 * kStep);
    if (std::abs(derivative) < 1e-9) break;
    u -= std::clamp(slope(u) / derivative, -0.1, 0.1);
  }
  const Meridian h = hub(u);
  const double a = u * kPi / 2;
  const Vec3 outward = Vec3(40.0 * std::cos(a), 41.0 * std::sin(a), 0).normalized();
  return (r - h.r) * outward.x() + (p.z() - h.z) * outward.y();
}

// The lowest v at which the ball still clears the hub (bisection).
double lowest_v(double u, int side) {
  double low = -0.2;
  double high = 0.8;
  for (int i = 0; i < 50; ++i) {
    const double v = (low + high) / 2;
    const bool clear =
        distance_from_hub_mm(contact(u, v, side).centre_P) >= kBallRadius_mm + kHubAllowance_mm;
    (clear ? high : low) = v;
  }
  return high;
}

// lowest_v(u), tabulated and interpolated by cubics (Catmull-Rom): ten million points want it.
class HubLimit {
 public:
  explicit HubLimit(int side) {
    for (int i = 0; i < kNodes; ++i) v_.at(static_cast<std::size_t>(i)) = lowest_v(node(i), side);
  }
  double operator()(double u) const {
    const double at = (u - kFirst) / kStep;
    const auto i = std::clamp<std::size_t>(static_cast<std::size_t>(at), 1, kNodes - 3);
    const double t = at - static_cast<double>(i);
    const double a = v_[i - 1], b = v_[i], c = v_[i + 1], d = v_[i + 2];
    return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
  }

 private:
  static constexpr int kNodes = 513;
  static constexpr double kFirst = -0.05;
  static constexpr double kStep = 1.1 / (kNodes - 1);
  static double node(int i) { return kFirst + i * kStep; }
  std::array<double, kNodes> v_{};
};

Tool turned(const Contact& c, double angle) {
  const Eigen::AngleAxisd turn(angle, Vec3::UnitZ());
  return {turn * (c.centre_P - kBallRadius_mm * c.axis_P), turn * c.axis_P};
}

void go_to(const Tool& tool) {
  std::string line = "GOTO/";
  for (int i = 0; i < 3; ++i) line += fixed_text(tool.tip_P[i], 4) + ',';
  for (int i = 0; i < 3; ++i) line += fixed_text(tool.axis_P[i], 7) + (i < 2 ? ',' : '\n');
  std::fwrite(line.data(), 1, line.size(), stdout);
}

// One side of one blade with exactly `points` GOTO records.
class BladeSide {
 public:
  BladeSide(double first_u, int side, long passes)
      : first_u_{first_u}, side_{side}, passes_{passes}, hub_limit_{side} {}

  void write(double angle, long points) const {
    const Tool start = tool(0, first_u_ - kRunOut, angle);
    Tool above{start.tip_P + kRetract_mm * start.axis_P, start.axis_P};
    Tool high = above;
    high.tip_P.z() = std::max(high.tip_P.z(), kSafeHeight_mm);
    std::fputs("RAPID\n", stdout);
    go_to(high);
    std::fputs("RAPID\n", stdout);
    go_to(above);
    std::fputs("FEDRAT/400.0000,MMPM\n", stdout);
    go_to({start.tip_P + kPlunge_mm * start.axis_P, start.axis_P});
    std::fputs("FEDRAT/1200.0000,MMPM\n", stdout);
    Tool last = start;
    const long cutting = points - kLinkPoints;
    for (long pass = 0; pass < passes_; ++pass) {
      const long count = cutting / passes_ + (pass < cutting % passes_ ? 1 : 0);
      for (long i = 0; i < count; ++i) {
        const double t = static_cast<double>(i) / static_cast<double>(count - 1);
        const double along = pass % 2 == 0 ? t : 1 - t;
        last = tool(pass, first_u_ - kRunOut + along * (1 + 2 * kRunOut - first_u_), angle);
        go_to(last);
      }
    }
    std::fputs("RAPID\n", stdout);
    go_to({last.tip_P + kRetract_mm * last.axis_P, last.axis_P});
  }

 private:
  Tool tool(long pass, double u, double angle) const {
    const double depth = static_cast<double>(pass) / static_cast<double>(passes_ - 1);
    const double v = kHighest_v + depth * (hub_limit_(u) - kHighest_v);
    return turned(contact(u, v, side_), angle);
  }

  double first_u_;
  int side_;
  long passes_;
  HubLimit hub_limit_;
};

void write_impeller(long points) {
  std::fputs(
      "$$ splittered radial impeller, made by samples/01_impeller/make_impeller.cpp\n"
      "PARTNO/IMPELLER 7+7\n"
      "UNITS/MM\n"
      "MULTAX/ON\n"
      "CUTTER/4.0000,2.0000\n"
      "LOADTL/1\n"
      "SPINDL/18000.0000,RPM,CLW\n"
      "COOLNT/ON\n",
      stdout);
  constexpr long kSides = 4 * kBlades;
  // Passes and points of a pass grow alike, so that the rows stay about as far apart as the points: 100 mm by
  // 20 mm a side.
  const long per_side = points / kSides;
  const long passes = std::max(2L, std::lround(std::sqrt(static_cast<double>(per_side) / 6.0)));
  long written = 0;
  for (long k = 0; k < kSides; ++k) {
    const bool splitter = k % 4 >= 2;
    const int side = k % 2 == 0 ? 1 : -1;
    const double angle = kTwoPi * (static_cast<double>(k / 4) + (splitter ? 0.5 : 0.0)) / kBlades;
    std::printf("$$ %s %ld, side %ld\n", splitter ? "splitter" : "blade", k / 4 + 1, k % 2 + 1);
    const long until = points * (k + 1) / kSides;
    BladeSide(splitter ? kSplitterStart : 0.0, side, passes).write(angle, until - written);
    written = until;
  }
  std::fputs("COOLNT/OFF\nSPINDL/OFF\nFINI\n", stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const auto points = argc == 2 ? trunnion::parse_integer(argv[1]) : std::nullopt;
  if (!points || *points < 1000 || *points > 10'000'000) {
    std::fputs("usage: make_impeller POINTS > impeller.cls      (1000 to 10000000 points)\n", stderr);
    return 2;
  }
  write_impeller(static_cast<long>(*points));
  return std::ferror(stdout) != 0 || std::fflush(stdout) != 0 ? 4 : 0;
}
