#include "trunnion/path/flute.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "path/bounds/closed_forms.hpp"
#include "path/bounds/tool_segment.hpp"

namespace trunnion::path {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();
// Halvings of a piece: 2^-24 of half a turn is below what doubles resolve.
constexpr int kMostHalvings = 24;
// Beyond this the bow of the arc leads the search astray.
constexpr double kFarTurn_rad = 0.3;
// Places looked at, after which the bound that is there is taken.
constexpr std::uint32_t kMostPlaces = 5000;

}  // namespace

FluteSegment::FluteSegment(const Reference& reference, double flute_mm)
    : tip0_P_(reference.tip0_P),
      chord_(reference.tip1_P - reference.tip0_P),
      axis0_P_(reference.axis0_P),
      tangent_P_(Vec3::Zero()),
      flute_mm_(flute_mm) {
  // cross with the difference: exact where the ends are nearly the same.
  const Vec3 difference = reference.axis1_P - reference.axis0_P;
  const Vec3 normal = reference.axis0_P.cross(difference);
  const double sine = normal.norm();
  turn_ = std::atan2(sine, reference.axis0_P.dot(reference.axis1_P));
  // Below this the plane of the arc comes from rounding.
  constexpr double kOpposite = 1e-9;
  has_arc_ = (reference.axis0_P + reference.axis1_P).norm() >= kOpposite;
  if (sine > 0.0) tangent_P_ = (normal / sine).cross(reference.axis0_P);
}

FluteSegment::Direction FluteSegment::direction(double t) const {
  // Up to here the series below are exact to 1e-15.
  constexpr double kSmall_rad = 0.05;
  const double x = t * turn_;
  if (std::abs(x) > kSmall_rad) return {std::cos(x), std::sin(x)};
  const double x2 = x * x;
  return {1.0 - x2 * (0.5 - x2 * (1.0 / 24.0 - x2 / 720.0)),
          x * (1.0 - x2 * (1.0 / 6.0 - x2 * (1.0 / 120.0 - x2 / 5040.0)))};
}

Vec3 FluteSegment::axis_P(double t) const {
  const Direction to = direction(t);
  return to.cosine * axis0_P_ + to.sine * tangent_P_;
}

ToolOff FluteSegment::off(const Vec3& tip_P, const Vec3& axis_at, double t) const {
  return {tip_P - tip0_P_ - t * chord_, axis_at - axis_P(t)};
}

// On a long arc the steps of `nearest` may end elsewhere: they begin at the best of some places.
double FluteSegment::best_of_grid(const Vec3& tip_P, const Vec3& axis_at, double near) const {
  constexpr int kPlaces = 16;
  double best = near;
  double least_mm = off(tip_P, axis_at, near).largest_mm(flute_mm_);
  for (int i = 0; i <= kPlaces; ++i) {
    const double t = static_cast<double>(i) / kPlaces;
    const double off_mm = off(tip_P, axis_at, t).largest_mm(flute_mm_);
    if (!(off_mm < least_mm)) continue;
    least_mm = off_mm;
    best = t;
  }
  return best;
}

double FluteSegment::nearest(const Vec3& tip_P, const Vec3& axis_at, double near) const {
  constexpr int kMostSteps = 8;
  constexpr double kSettled_mm = 2e-6;  // any place will do, the nearest gives the sharpest bound
  double t = turn_ > kFarTurn_rad ? best_of_grid(tip_P, axis_at, near) : near;
  const double reach_mm = chord_.norm() + flute_mm_ * turn_;
  if (!(reach_mm > 0.0)) return t;
  // Far from the segment a step may lead farther off: the best place so far counts.
  double best = t;
  double best_mm2 = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMostSteps; ++i) {
    const auto [cosine, sine] = direction(t);
    const Vec3 path_axis_P = cosine * axis0_P_ + sine * tangent_P_;
    const Vec3 axis_slope_P = turn_ * (cosine * tangent_P_ - sine * axis0_P_);
    const Vec3 tip_off = tip_P - tip0_P_ - t * chord_;
    const Vec3 end_off = tip_off + flute_mm_ * (axis_at - path_axis_P);
    const double off_mm2 = std::max(tip_off.squaredNorm(), end_off.squaredNorm());
    if (off_mm2 < best_mm2) {
      best_mm2 = off_mm2;
      best = t;
    }
    const double step = smaller_of_two<double>(triple_of(tip_off), triple_of(chord_), triple_of(end_off),
                                               triple_of(chord_ + flute_mm_ * axis_slope_P));
    const double before = t;
    t = std::clamp(t + step, 0.0, 1.0);
    if (std::abs(t - before) * reach_mm > kSettled_mm) continue;
    // It is off by no more than that place, but for what the step was.
    if (best == before) return t;
    break;
  }
  return off(tip_P, axis_at, t).largest_mm(flute_mm_) <= std::sqrt(best_mm2) ? t : best;
}

namespace {

// The places of the path run as a parabola t(s) through those that are nearest at the ends and in the middle
// of a piece. Tip and flute end less theirs are then parabolas too, but for the third derivatives: of the
// machine's motion, and of the arc along t(s).
class FluteSearch {
 public:
  FluteSearch(const TableKinematics& kinematics, FluteCertifier::Tip tip, const FluteSegment& segment,
              const Goal& goal)
      : kinematics_(kinematics),
        segment_(segment),
        goal_(goal),
        straight_(tip == FluteCertifier::Tip::straight) {}

  struct Place {
    ToolOff off;
    double t = 0.0;
  };
  Place place(const Vec3& tip_P, const Vec3& axis_P, double near) {
    ++evaluations_;
    const double t = segment_.nearest(tip_P, axis_P, near);
    return {segment_.off(tip_P, axis_P, t), t};
  }

  // The places taken as they are told: true where that is a proof.
  bool settled_at(const Station& a, const Station& b, const FluteCertifier::Places& about) {
    const Place at_a{segment_.off(a.tip_P, a.axis_P, about.a), about.a};
    const Place at_b{segment_.off(b.tip_P, b.axis_P, about.b), about.b};
    const double flute = segment_.flute_mm();
    if (std::max(at_a.off.largest_mm(flute), at_b.off.largest_mm(flute)) > goal_.tolerance) return false;
    const Part& part = whole_.emplace(part_between(a, b));
    if (accept(even_bound(part, at_a, at_b))) return true;
    const double even = 0.5 * (about.a + about.b);
    const ToolOff middle = segment_.off(part.middle.tip_P, part.middle.axis_P, even);
    return accept(parabola_bound(part, at_a, {middle, even}, at_b, 0.0));
  }

  // An end that is beyond the tolerance decides before the motion is looked at.
  void all(const Station& a, const Station& b, const FluteCertifier::Places& about) {
    const double rounding = rounding_of(a, b);
    const auto place_of = [&](const Station& at, double near) {
      Place out = place(at.tip_P, at.axis_P, near);
      lower_ = std::max(lower_, out.off.largest_mm(segment_.flute_mm()) - rounding);
      return out;
    };
    const Place at_a = place_of(a, about.a);
    if (beyond()) return;
    const Place at_b = place_of(b, about.b);
    if (beyond()) return;
    piece(whole_ ? *whole_ : part_between(a, b), {a, at_a}, {b, at_b}, 0);
  }

  Bound result() const { return {std::max(0.0, lower_), upper_}; }
  Within verdict() const {
    if (beyond()) return Within::no;
    return upper_ <= goal_.tolerance ? Within::yes : Within::unknown;
  }

 private:
  // What is known of the motion between two stations: the tool half way, bounds on its second and third
  // derivatives (tip, axis).
  struct Part {
    ToolPose middle;
    Lanes M2, M3;
    double rounding;
  };
  struct End {
    const Station& station;
    const Place& place;
  };
  // Between places that `lower_` knows of.
  void piece(const Part& part, const End& from, const End& to, int halvings) {
    const double flute = segment_.flute_mm();
    const Place& at_a = from.place;
    const Place& at_b = to.place;
    if (accept(even_bound(part, at_a, at_b)) || beyond()) return;
    const double even = 0.5 * (at_a.t + at_b.t);
    const Place middle = place(part.middle.tip_P, part.middle.axis_P, even);
    lower_ = std::max(lower_, middle.off.largest_mm(flute) - part.rounding);
    if (beyond()) return;
    // Places beyond those of the ends may be none of the segment.
    double bent = 4.0 * (middle.t - even);
    Place on_parabola = middle;
    if (std::abs(bent) > std::abs(at_b.t - at_a.t)) {
      bent = 0.0;
      on_parabola = {segment_.off(part.middle.tip_P, part.middle.axis_P, even), even};
    }
    const double bound = parabola_bound(part, at_a, on_parabola, at_b, bent);
    if (accept(bound)) return;
    if (halvings >= kMostHalvings || evaluations_ >= kMostPlaces) {
      upper_ = std::max(upper_, bound);
      return;
    }
    Station half = halfway(kinematics_, from.station, to.station);
    if (straight_) half.tip_P = part.middle.tip_P;
    piece(part_between(from.station, half), from, {half, middle}, halvings + 1);
    if (!beyond()) piece(part_between(half, to.station), {half, middle}, to, halvings + 1);
  }

  double rounding_of(const Station& a, const Station& b) const {
    const double angles = size_of_angles(kinematics_, a, b);
    return path::tip_rounding(a.size_mm + b.size_mm, angles) +
           segment_.flute_mm() * path::axis_rounding(angles);
  }
  Part part_between(const Station& a, const Station& b) const {
    const NormsOf<Lanes> norms = tip_and_axis_norms(kinematics_, a, b);
    const Lanes counts = {straight_ ? 0.0 : 1.0, 1.0};
    return {{straight_ ? Vec3(0.5 * (a.tip_P + b.tip_P)) : middle_tip(kinematics_, a, b),
             middle_axis(kinematics_, a, b)},
            counts * norms.M2(),
            counts * norms.M3(),
            rounding_of(a, b)};
  }
  // Places that run evenly: the bows of the tool, and of the arc.
  double even_bound(const Part& part, const Place& at_a, const Place& at_b) const {
    const double flute = segment_.flute_mm();
    const double turn = std::abs(at_b.t - at_a.t) * segment_.turn();
    return std::max(at_a.off.largest_mm(flute), at_b.off.largest_mm(flute)) + part.M2[0] / 8.0 +
           flute * (part.M2[1] + turn * turn) / 8.0 + part.rounding;
  }
  // Places that run through that in the middle, `bent` off the even course there by a quarter of it. The
  // slope of the arc's angle and its change bound the third derivative of the axis along it.
  double parabola_bound(const Part& part, const Place& at_a, const Place& middle, const Place& at_b,
                        double bent) const {
    const double flute = segment_.flute_mm();
    const double slope = (std::abs(at_b.t - at_a.t) + std::abs(bent)) * segment_.turn();
    const double change = 2.0 * std::abs(bent) * segment_.turn();
    const double arc_M3 = slope * slope * slope + 3.0 * slope * change;
    const double beyond_tip = beyond_parabola(part.M3[0]);
    const double beyond_end = beyond_parabola(part.M3[0] + flute * (part.M3[1] + arc_M3));
    return std::max(largest(at_a.off.tip_P, middle.off.tip_P, at_b.off.tip_P) + beyond_tip,
                    largest(at_a.off.at(flute), middle.off.at(flute), at_b.off.at(flute)) + beyond_end) +
           part.rounding;
  }

  bool beyond() const { return goal_.decides() && lower_ > goal_.tolerance; }
  bool accept(double bound) {
    const double limit = goal_.decides() ? goal_.tolerance : std::max(goal_.ratio * lower_, goal_.floor);
    if (!(bound <= limit)) return false;
    upper_ = std::max(upper_, bound);
    return true;
  }
  // Largest length of the parabola through `a`, `middle` and `b`: along its bow in closed form, and what its
  // ends are beside that.
  static double largest(const Vec3& a, const Vec3& middle, const Vec3& b) {
    const Vec3 bow = middle - 0.5 * (a + b);
    const double size = bow.norm();
    if (!(size > 0.0)) return std::sqrt(std::max(a.squaredNorm(), b.squaredNorm()));
    const double x = a.dot(bow) / size;
    const double y = b.dot(bow) / size;
    const double along = std::max({largest_bowed(x, y, size), -x, -y});
    const double beside2 = std::max({0.0, a.squaredNorm() - x * x, b.squaredNorm() - y * y});
    return std::sqrt(along * along + beside2);
  }

  const TableKinematics& kinematics_;
  const FluteSegment& segment_;
  Goal goal_;
  bool straight_;
  std::optional<Part> whole_;  // between the stations that are asked about
  double lower_ = 0.0;
  double upper_ = 0.0;
  std::uint32_t evaluations_ = 0;
};

}  // namespace

Bound FluteCertifier::deviation(const Station& a, const Station& b, const FluteSegment& segment, double ratio,
                                double floor_mm) const {
  if (!segment.has_arc()) return {0.0, kUnlimited};
  FluteSearch of(kinematics_, tip_, segment, Goal{kUnlimited, ratio, floor_mm});
  of.all(a, b, {0.0, 1.0});
  return of.result();
}

Within FluteCertifier::within(const Station& a, const Station& b, const FluteSegment& segment,
                              double tolerance_mm, const Places& about) const {
  if (!segment.has_arc()) return Within::unknown;
  FluteSearch of(kinematics_, tip_, segment, Goal{tolerance_mm, 1.0, 0.0});
  if (of.settled_at(a, b, about)) return Within::yes;
  of.all(a, b, about);
  return of.verdict();
}

}  // namespace trunnion::path
