#include "trunnion/path/certificate.hpp"

#include <cmath>
#include <limits>

#include "path/bounds/closed_forms.hpp"
#include "path/bounds/convex.hpp"
#include "path/bounds/expansion.hpp"

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

double axis_rounding(const TableKinematics& k, const Station& a, const Station& b) {
  return path::axis_rounding(size_of_angles(k, a, b));
}

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
      if (part(polynomial, remainder, {s, s + 1.0 / kFirstParts, feet_[i], feet_[i + 1]}, can_halve))
        continue;
      return halves(a, b, halvings);
    }
  }

  Bound result() const { return {Shape::measure(lower_), Shape::measure(upper_)}; }
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
    const Station middle = halfway(kinematics_, a, b);
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
  struct Part {
    double s0, s1;  // where it begins and ends
    const Foot& f0;
    const Foot& f1;
  };
  bool part(const Polynomial& polynomial, double remainder, const Part& of, bool can_halve) {
    const auto& [s0, s1, f0, f1] = of;
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
    return beyond() || (part(polynomial, remainder, {s0, middle, f0, f}, can_halve) &&
                        part(polynomial, remainder, {middle, s1, f, f1}, can_halve));
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

bool opposite(const Reference& reference) {
  // Below this the plane of the arc comes from rounding.
  constexpr double kOpposite = 1e-9;
  return (reference.axis0_P + reference.axis1_P).norm() < kOpposite;
}

}  // namespace

// The tip and the tool axis side by side, with the formulas of StationOf.
void put_station(const TableKinematics& kinematics, const JointVector& q, const TableKinematics::Sines& sines,
                 Station& s) {
  using Both = lanes::Triple<Lanes>;
  const auto both = [](const Vec3& tip, const Vec3& axis) {
    return Both{Lanes{tip.x(), axis.x()}, Lanes{tip.y(), axis.y()}, Lanes{tip.z(), axis.z()}};
  };
  const auto of_tip = [](const Vec3& v) {
    return Both{Lanes{v.x(), 0.0}, Lanes{v.y(), 0.0}, Lanes{v.z(), 0.0}};
  };
  const auto lane = [](const Both& v, int i) { return Vec3(v.x[i], v.y[i], v.z[i]); };
  const auto triple = [](const Vec3& v) { return lanes::Triple<double>{v.x(), v.y(), v.z()}; };
  const auto size = [](const Vec3& v) { return std::abs(v.x()) + std::abs(v.y()) + std::abs(v.z()); };
  const auto twice = [](double x) { return lanes::splat<Lanes>(x); };
  const TableKinematics::SinesOf<Lanes> turns{{twice(sines.sin[0]), twice(sines.sin[1])},
                                              {twice(sines.cos[0]), twice(sines.cos[1])}};
  const Vec3 w = kinematics.w(q);
  const Vec3 b = kinematics.b(q);
  const Vec3 g = kinematics.g(q);
  const Both inner = kinematics.turned_back(0, both(w, kinematics.spindle()), turns) + of_tip(b);
  const Both placed = kinematics.turned_back(1, inner, turns) + of_tip(g);
  const lanes::Triple<double> inner_tip{inner.x[0], inner.y[0], inner.z[0]};
  s.q = q;
  s.sines = sines;
  s.tip_P = lane(placed, 0);
  s.axis_P = lane(placed, 1);
  s.w = w;
  s.arm2_outer = lanes::squared(lanes::cross(triple(kinematics.direction(0)), triple(w)));
  s.arm2_inner = lanes::squared(lanes::cross(triple(kinematics.direction(1)), inner_tip));
  s.tip_shift_P = Vec3::Zero();
  s.axis_shift_P = Vec3::Zero();
  s.size_mm = size(w) + size(b) + size(g);
}

void put_station(const TableKinematics& kinematics, const JointVector& q, Station& out) {
  put_station(kinematics, q, kinematics.sines(q), out);
}

Station station(const TableKinematics& kinematics, const JointVector& q) {
  Station s;
  put_station(kinematics, q, s);
  return s;
}

Station station(const TableKinematics& kinematics, const JointVector& q,
                const TableKinematics::Sines& sines) {
  Station s;
  put_station(kinematics, q, sines, s);
  return s;
}

Station shifted(Station nominal, const Vec3& tip_shift_P, const Vec3& axis_shift_P) {
  nominal.tip_shift_P += tip_shift_P;
  nominal.axis_shift_P += axis_shift_P;
  nominal.tip_P += tip_shift_P;
  nominal.axis_P += axis_shift_P;
  return nominal;
}

Station halfway(const TableKinematics& kinematics, const Station& a, const Station& b) {
  return shifted(station(kinematics, JointVector::interpolate(a.q, b.q, 0.5)),
                 0.5 * (a.tip_shift_P + b.tip_shift_P), 0.5 * (a.axis_shift_P + b.axis_shift_P));
}

Bound Certifier::tip(const Station& a, const Station& b, const Reference& reference, double ratio,
                     double floor_mm) const {
  const double rounding = tip_rounding(kinematics_, a, b);
  const ParabolaForm parabola(reference, a, b, middle_tip(kinematics_, a, b));
  const double upper = parabola.largest() + beyond_parabola(piece_norms(kinematics_, a, b).M3()) + rounding;
  const double lower = std::max(0.0, std::sqrt(parabola.largest_sample2()) - rounding);
  // Where the figure itself is wanted it may as well be sharp.
  constexpr double kShareOfSlack = 0.1;
  if (upper <= std::max((1.0 + kShareOfSlack * (ratio - 1.0)) * lower, floor_mm)) return {lower, upper};
  const SegmentShape shape(reference.tip0_P, reference.tip1_P);
  Search<TipRole> search(kinematics_, shape, Goal{kInfinity, ratio, floor_mm}, rounding);
  search.piece(a, b);
  return search.result();
}

Bound Certifier::axis(const Station& a, const Station& b, const Reference& reference, double ratio,
                      double floor_rad) const {
  if (opposite(reference)) return {0.0, kPi};
  const ArcShape shape(reference.axis0_P, reference.axis1_P);
  Search<AxisRole> search(kinematics_, shape, Goal{kInfinity, ratio, floor_rad},
                          axis_rounding(kinematics_, a, b));
  search.piece(a, b);
  return search.result();
}

double Certifier::bow_from_norms(const Station& a, const Station& b) const {
  return piece_norms(kinematics_, a, b).M2() / 8.0 + tip_rounding(kinematics_, a, b);
}

Certifier::Bows Certifier::bows_from_norms(const Station& a, const Station& b) const {
  const Lanes bow = tip_and_axis_norms(kinematics_, a, b).M2() / 8.0;
  const double angles = size_of_angles(kinematics_, a, b);
  return {bow[0] + path::tip_rounding(a.size_mm + b.size_mm, angles), bow[1] + axis_rounding(angles)};
}

double Certifier::bow_from_cubic(const Station& a, const Station& b) const {
  return cubic_bow(kinematics_, a, b) + tip_rounding(kinematics_, a, b);
}

Within Certifier::tip_within(const Station& a, const Station& b, const Reference& reference,
                             double tolerance_mm) const {
  const double rounding = tip_rounding(kinematics_, a, b);
  const NormsOf<double> norms = piece_norms(kinematics_, a, b);
  // The chord of the piece is no farther from the segment (a convex set) than its ends are, and these no
  // farther than from the segment's ends: nearly always the two are the same.
  const double ends2 =
      std::max((a.tip_P - reference.tip0_P).squaredNorm(), (b.tip_P - reference.tip1_P).squaredNorm());
  const double left = tolerance_mm - norms.M2() / 8.0 - rounding;
  if (left >= 0.0) {
    if (ends2 <= left * left) return Within::yes;
    const auto off = [&](const Vec3& p) {
      return distance_to_segment(p, reference.tip0_P, reference.tip1_P);
    };
    if (std::max(off(a.tip_P), off(b.tip_P)) <= left) return Within::yes;
  }
  // One sample beyond the tolerance is a proof too, and most segments that fail fail in the middle.
  const ParabolaForm parabola(reference, a, b, middle_tip(kinematics_, a, b));
  const double beyond = tolerance_mm + rounding;
  if (parabola.largest_sample2() > beyond * beyond) return Within::no;
  if (parabola.largest() + beyond_parabola(norms.M3()) + rounding <= tolerance_mm) return Within::yes;
  const double within = tolerance_mm - cubic_bow(kinematics_, a, b) - rounding;
  if (within >= 0.0 && ends2 <= within * within) return Within::yes;
  const SegmentShape shape(reference.tip0_P, reference.tip1_P);
  Search<TipRole> search(kinematics_, shape, Goal{tolerance_mm, 1.0, 0.0}, rounding);
  search.piece(a, b);
  return search.verdict();
}

Within Certifier::axis_within(const Station& a, const Station& b, const Reference& reference,
                              Angle tolerance) const {
  if (opposite(reference)) return Within::unknown;
  const NormsOf<double> norms = axis_norms(kinematics_, a, b);
  const double bow = norms.M2() / 8.0;
  const double rounding = axis_rounding(kinematics_, a, b);
  // The arc's ends are no nearer than the arc itself.
  const double left = sine_at_least(tolerance.rad()) - bow - rounding;
  const double ends2 =
      std::max((a.axis_P - reference.axis0_P).squaredNorm(), (b.axis_P - reference.axis1_P).squaredNorm());
  if (left >= 0.0 && ends2 <= left * left) return Within::yes;
  const ArcShape shape(reference.axis0_P, reference.axis1_P);
  // The cone's distance is a sine and says nothing beyond a right angle: wider tolerances are taken as just
  // below it.
  constexpr double kBelowRightAngle = 1.0 - 1e-12;
  const double sine = tolerance.rad() < 0.5 * kPi ? std::sin(tolerance.rad()) : kBelowRightAngle;
  const double ends =
      std::max(ArcShape::distance(shape.foot(a.axis_P)), ArcShape::distance(shape.foot(b.axis_P)));
  if (ends - rounding > sine) return Within::no;
  if (ends + bow + rounding <= sine) return Within::yes;
  if (axis_from_parabola(shape, a.axis_P, middle_axis(kinematics_, a, b), b.axis_P, norms) + rounding <= sine)
    return Within::yes;
  Search<AxisRole> search(kinematics_, shape, Goal{sine, 1.0, 0.0}, rounding);
  search.piece(a, b);
  return search.verdict();
}

}  // namespace trunnion::path
