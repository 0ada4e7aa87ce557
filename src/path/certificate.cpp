#include "trunnion/path/certificate.hpp"

#include <cmath>
#include <limits>

#include "path/convex.hpp"
#include "path/expansion.hpp"

namespace trunnion::path {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Evaluations after which a search takes the bound that it has: no piece of the tests needs a twentieth of
// it.
constexpr std::uint32_t kWorkLimit = 20000;
// Halvings of a piece: 2^-24 of half a turn is below what doubles resolve in the fifth derivative.
constexpr int kMaxHalvings = 24;
// Parts into which the polynomial of a piece is cut at first.
constexpr std::size_t kFirstParts = 8;
// Parts narrower than this differ from their ends by rounding only.
constexpr double kNarrowestPart = 1e-7;
// Where the answer hangs on rounding, samples as close as this are enough.
constexpr double kNarrowestUndecided = 1e-3;
// Share of the slack between proof and truth that the remainder of the polynomial may take before the piece
// is halved instead.
constexpr double kRemainderShare = 0.2;
// The same of the tolerance of a decision, where the slack is not known beforehand.
constexpr double kRemainderOfTolerance = 0.01;

// Rounding of one evaluation of the chain in doubles: a few units in the last place of every coordinate in
// it, the angles times the arm included.
constexpr double kUnitsInTheLastPlace = 32.0 * std::numeric_limits<double>::epsilon();

double rounding_of(const TableKinematics& kinematics, const Station& a, const Station& b, double arm) {
  double turn = 1.0;
  for (std::size_t k = 0; k < 2; ++k) {
    turn += std::abs(kinematics.angle(a.q, k)) + std::abs(kinematics.angle(b.q, k));
  }
  return kUnitsInTheLastPlace * arm * turn;
}

double arm_mm(const TableKinematics& kinematics, const Station& a, const Station& b) {
  return kinematics.w(a.q).norm() + kinematics.w(b.q).norm() + kinematics.b(a.q).norm() +
         kinematics.b(b.q).norm() + kinematics.g(a.q).norm() + kinematics.g(b.q).norm();
}
// The tool axis is a unit vector.
constexpr double kAxisArm = 1.0;

struct TipRole {
  using Shape = SegmentShape;
  static Curve curve(const TableKinematics& k, const Station& a, const Station& b) {
    return tip_curve(k, a, b);
  }
  static const Vec3& place(const Station& s) { return s.tip_P; }
};
struct AxisRole {
  using Shape = ArcShape;
  static Curve curve(const TableKinematics& k, const Station& a, const Station& b) {
    return axis_curve(k, a, b);
  }
  static const Vec3& place(const Station& s) { return s.axis_P; }
};

// What a search is to reach: every part below `tolerance` (a decision), or within `ratio` of the largest
// sample.
struct Goal {
  double tolerance = kInfinity;
  double ratio = 1.0;
  double floor = 0.0;
  bool decides() const { return tolerance < kInfinity; }
};

// Branch and bound over a piece: the curve is its chord plus a polynomial of degree 4 plus a proved
// remainder. On a part of the polynomial the distance from a convex set exceeds the larger of its ends by at
// most h^2/8 max|x''|.
template <class Role>
class Search {
 public:
  using Shape = typename Role::Shape;
  using Foot = typename Shape::Foot;

  Search(const TableKinematics& kinematics, const Shape& shape, const Goal& goal, double rounding)
      : kinematics_(kinematics), shape_(shape), goal_(goal), rounding_(rounding) {}

  void piece(const Station& a, const Station& b, int halvings = 0) {
    const Expansion e = expand_in_part(Role::curve(kinematics_, a, b));
    const double remainder = e.M5 / 3840.0 + rounding_;
    const Polynomial polynomial{Role::place(a), Role::place(b), e};
    sample(polynomial, remainder);
    if (beyond()) return;
    const bool can_halve = e.M5 / 3840.0 > rounding_ && halvings < kMaxHalvings && evaluations_ < kWorkLimit;
    if (can_halve && remainder > allowed_remainder()) return halves(a, b, halvings);
    for (std::size_t i = 0; i < kFirstParts; ++i) {
      const double s = static_cast<double>(i) / kFirstParts - 0.5;
      if (part(polynomial, remainder, s, s + 1.0 / kFirstParts, feet_[i], feet_[i + 1], can_halve)) continue;
      return halves(a, b, halvings);
    }
  }

  Bound result() const { return {Shape::measure(lower_), Shape::measure(upper_), evaluations_}; }
  Within verdict() const {
    if (upper_ <= goal_.tolerance && !beyond()) return Within::yes;
    return beyond() ? Within::no : Within::unknown;
  }

 private:
  struct Polynomial {
    const Vec3& x0;
    const Vec3& x1;
    const Expansion& e;
    Vec3 at(double s) const {
      const double bow = 0.25 - s * s;
      return (0.5 - s) * x0 + (0.5 + s) * x1 -
             bow * (0.5 * e.f2 + (s / 6.0) * e.f3 + ((0.25 + s * s) / 24.0) * e.f4);
    }
    Bend bend(double s, double eta) const {
      return {e.f2 + s * e.f3 + (0.5 * s * s) * e.f4, e.f3 + s * e.f4, e.f4, eta};
    }
  };

  bool beyond() const { return goal_.decides() && lower_ > goal_.tolerance; }
  double allowed_remainder() const {
    if (goal_.decides()) return kRemainderOfTolerance * goal_.tolerance;
    return kRemainderShare * (goal_.ratio - 1.0) * std::max(lower_, goal_.floor);
  }
  // Compared as angles for the axis: a ratio of sines is not one of angles.
  bool accepted(double bound) const {
    if (goal_.decides()) return bound <= goal_.tolerance;
    return Shape::measure(bound) <= std::max(goal_.ratio * Shape::measure(lower_), goal_.floor);
  }

  void halves(const Station& a, const Station& b, int halvings) {
    const Station middle = station(kinematics_, JointVector::interpolate(a.q, b.q, 0.5));
    ++evaluations_;
    piece(a, middle, halvings + 1);
    if (!beyond()) piece(middle, b, halvings + 1);
  }

  void sample(const Polynomial& polynomial, double remainder) {
    for (std::size_t i = 0; i <= kFirstParts; ++i) {
      feet_[i] = shape_.foot(polynomial.at(static_cast<double>(i) / kFirstParts - 0.5));
      const bool end = i == 0 || i == kFirstParts;
      lower_ = std::max(lower_, Shape::distance(feet_[i]) - (end ? rounding_ : remainder));
      evaluations_ += end ? 0 : 1;
    }
  }

  // False when only a smaller remainder, by halving the piece, can bring a decision.
  bool part(const Polynomial& polynomial, double remainder, double s0, double s1, const Foot& f0,
            const Foot& f1, bool can_halve) {
    const double h = s1 - s0;
    const double middle = 0.5 * (s0 + s1);
    const double bound = shape_.part(f0, f1, h, polynomial.bend(middle, 0.5 * h)) + remainder;
    if (accepted(bound) || h < kNarrowestPart || evaluations_ >= kWorkLimit) {
      upper_ = std::max(upper_, bound);
      return true;
    }
    if (goal_.decides() && std::max(Shape::distance(f0), Shape::distance(f1)) + remainder > goal_.tolerance) {
      if (can_halve) return false;
      // The tolerance within rounding: only a sample farther inside can still say no.
      if (h < kNarrowestUndecided) {
        upper_ = std::max(upper_, bound);
        return true;
      }
    }
    const Foot f = shape_.foot(polynomial.at(middle));
    ++evaluations_;
    lower_ = std::max(lower_, Shape::distance(f) - remainder);
    return beyond() || (part(polynomial, remainder, s0, middle, f0, f, can_halve) &&
                        part(polynomial, remainder, middle, s1, f, f1, can_halve));
  }

  const TableKinematics& kinematics_;
  const Shape& shape_;
  Goal goal_;
  double rounding_;
  double lower_ = 0.0;
  double upper_ = 0.0;
  std::uint32_t evaluations_ = 0;
  std::array<Foot, kFirstParts + 1> feet_;
};

// Proved excess of a curve over its chord, from closed forms of its second to fourth derivatives.

// max |f''| / 8 from norms: al, ga the turns; D, rho the slope and the arm across the outer axis; sig the arm
// across the inner one.
double norm_bow(const TableKinematics& k, const Station& a, const Station& b) {
  const double al = std::abs(k.angle(b.q, 0) - k.angle(a.q, 0));
  const double ga = std::abs(k.angle(b.q, 1) - k.angle(a.q, 1));
  const Vec3 w0 = k.w(a.q);
  const Vec3 w1 = k.w(b.q);
  const Vec3 d = w1 - w0;
  const Vec3& n0 = k.direction(0);
  const Vec3& n1 = k.direction(1);
  // Along a straight w the arm is largest at an end; a turn about n0 does not change it.
  const double rho = std::sqrt(std::max(n0.cross(w0).squaredNorm(), n0.cross(w1).squaredNorm()));
  double slope = d.norm();
  if (!k.linear_axes_first()) slope += (k.b(b.q) - k.b(a.q)).norm();
  const double U2 = 2.0 * al * n0.cross(d).norm() + al * al * rho;
  const double U1 = slope + al * rho;
  const double arm =
      std::max(n1.cross(a.tip_P - k.g(a.q)).squaredNorm(), n1.cross(b.tip_P - k.g(b.q)).squaredNorm());
  const double sig = std::sqrt(arm) + U2 / 8.0;
  return (ga * ga * sig + 2.0 * ga * U1 + U2) / 8.0;
}

// Largest of |(1/4 - s^2)(f2/2 + s f3/6)| over |s| <= 1/2: f3 split along f2 (closed maximum) and across it.
double largest_of_cubic(const Vec3& f2, const Vec3& f3) {
  const double A = 0.5 * f2.norm();
  const double along = A > 0.0 ? std::abs(f3.dot(f2)) / (12.0 * A) : f3.norm() / 6.0;
  const double across2 = std::max(0.0, f3.squaredNorm() - 36.0 * along * along);
  double s = 0.0;
  if (along > 0.0) s = 0.25 * along / (A + std::sqrt(A * A + 0.75 * along * along));
  const double in_line = (0.25 - s * s) * (A + along * s);
  // (1/4 - s^2) s is at most 1 / (12 sqrt 3); 36 * 432 = 15552.
  return std::sqrt(in_line * in_line + across2 / 15552.0);
}

// Distance of the curve from its chord: across the chord, and what it may overshoot its ends by.
double cubic_bow(const TableKinematics& k, const Station& a, const Station& b) {
  const Curve curve = tip_curve(k, a, b);
  const Expansion e = expand(curve);
  const double remainder = e.M4 / 384.0;
  const Vec3 chord = k.turn(1, b.tip_P - a.tip_P, curve.mid);
  const double length = chord.norm();
  const double whole = largest_of_cubic(e.f2, e.f3) + remainder;
  if (!(length > 0.0)) return whole;
  const Vec3 unit = chord / length;
  const double f2_along = e.f2.dot(unit);
  const double f3_along = e.f3.dot(unit);
  const double G = 0.5 * std::abs(f2_along) + std::abs(f3_along) / 12.0 + e.M4 / 48.0;
  const double overshoot = G > length ? (G - length) * (G - length) / (4.0 * G) : 0.0;
  const double across = largest_of_cubic(e.f2 - f2_along * unit, e.f3 - f3_along * unit) + remainder;
  return std::min(whole, std::hypot(across, overshoot));
}

bool opposite(const Reference& reference) {
  // Below this the plane of the arc comes from rounding.
  constexpr double kOpposite = 1e-9;
  return (reference.axis0_P + reference.axis1_P).norm() < kOpposite;
}

}  // namespace

Station station(const TableKinematics& kinematics, const JointVector& q) {
  Station s;
  s.q = q;
  s.sines = kinematics.sines(q);
  s.tip_P = kinematics.tip_P(q, s.sines);
  s.axis_P = kinematics.axis_P(s.sines);
  return s;
}

Bound Certifier::tip(const Station& a, const Station& b, const Reference& reference, double ratio,
                     double floor_mm) const {
  const SegmentShape shape(reference.tip0_P, reference.tip1_P);
  const double rounding = rounding_of(kinematics_, a, b, arm_mm(kinematics_, a, b));
  Search<TipRole> search(kinematics_, shape, Goal{kInfinity, ratio, floor_mm}, rounding);
  search.piece(a, b);
  return search.result();
}

Bound Certifier::axis(const Station& a, const Station& b, const Reference& reference, double ratio,
                      double floor_rad) const {
  if (opposite(reference)) return {0.0, kPi, 0};
  const ArcShape shape(reference.axis0_P, reference.axis1_P);
  Search<AxisRole> search(kinematics_, shape, Goal{kInfinity, ratio, floor_rad},
                          rounding_of(kinematics_, a, b, kAxisArm));
  search.piece(a, b);
  return search.result();
}

double Certifier::bow_from_norms(const Station& a, const Station& b) const {
  return norm_bow(kinematics_, a, b) + rounding_of(kinematics_, a, b, arm_mm(kinematics_, a, b));
}

double Certifier::bow_from_cubic(const Station& a, const Station& b) const {
  return cubic_bow(kinematics_, a, b) + rounding_of(kinematics_, a, b, arm_mm(kinematics_, a, b));
}

Within Certifier::tip_within(const Station& a, const Station& b, const Reference& reference,
                             double tolerance_mm) const {
  // The chord of the piece is no farther from the segment (a convex set) than its ends are.
  const double ends = std::max(distance_to_segment(a.tip_P, reference.tip0_P, reference.tip1_P),
                               distance_to_segment(b.tip_P, reference.tip0_P, reference.tip1_P));
  const double rounding = rounding_of(kinematics_, a, b, arm_mm(kinematics_, a, b));
  if (ends - rounding > tolerance_mm) return Within::no;
  if (ends + norm_bow(kinematics_, a, b) + rounding <= tolerance_mm) return Within::yes;
  // One sample beyond the tolerance is a proof too, and most segments that fail fail in the middle.
  const JointVector q = JointVector::interpolate(a.q, b.q, 0.5);
  const Vec3 middle_P = kinematics_.tip_P(q, kinematics_.sines(q));
  if (distance_to_segment(middle_P, reference.tip0_P, reference.tip1_P) - rounding > tolerance_mm) {
    return Within::no;
  }
  if (ends + cubic_bow(kinematics_, a, b) + rounding <= tolerance_mm) return Within::yes;
  const SegmentShape shape(reference.tip0_P, reference.tip1_P);
  Search<TipRole> search(kinematics_, shape, Goal{tolerance_mm, 1.0, 0.0}, rounding);
  search.piece(a, b);
  return search.verdict();
}

Within Certifier::axis_within(const Station& a, const Station& b, const Reference& reference,
                              Angle tolerance) const {
  if (opposite(reference)) return Within::unknown;
  const ArcShape shape(reference.axis0_P, reference.axis1_P);
  // The cone's distance is a sine and says nothing beyond a right angle: wider tolerances are taken as just
  // below it.
  constexpr double kBelowRightAngle = 1.0 - 1e-12;
  const double sine = tolerance.rad() < 0.5 * kPi ? std::sin(tolerance.rad()) : kBelowRightAngle;
  const double ends =
      std::max(ArcShape::distance(shape.foot(a.axis_P)), ArcShape::distance(shape.foot(b.axis_P)));
  const double rounding = rounding_of(kinematics_, a, b, kAxisArm);
  if (ends - rounding > sine) return Within::no;
  // |u''| <= (|dA| + |dC|)^2: a unit vector turned about two axes.
  const double turn = std::abs(kinematics_.angle(b.q, 0) - kinematics_.angle(a.q, 0)) +
                      std::abs(kinematics_.angle(b.q, 1) - kinematics_.angle(a.q, 1));
  if (ends + turn * turn / 8.0 + rounding <= sine) return Within::yes;
  Search<AxisRole> search(kinematics_, shape, Goal{sine, 1.0, 0.0}, rounding);
  search.piece(a, b);
  return search.verdict();
}

}  // namespace trunnion::path
