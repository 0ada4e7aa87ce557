#include "path/insertion/segment_judge.hpp"

#include <algorithm>
#include <cmath>

#include "path/bounds/closed_forms.hpp"
#include "path/bounds/convex.hpp"

namespace trunnion::path {
namespace {

// A bound this far below the tolerance is reported as the cheap form gives it.
constexpr double kSurelyBelow = 0.25;
// Interior samples of a piece when proof was declined.
constexpr int kSamples = 9;

}  // namespace

void SegmentJudge::start(const Point& a, const Point& b, const Tolerance& tolerance) {
  tolerance_ = tolerance;
  end_part(a, b);
}

void SegmentJudge::end_part(const Point& a, const Point& b) {
  reference_ = {a.tip_P, b.tip_P, a.axis_P, b.axis_P};
  flute_.reset();
  if (tolerance_.flute.length_mm > 0.0) {
    const FluteSegment whole(reference_, tolerance_.flute.length_mm);
    flute_ = Flute{whole, whole};
  }
}

void SegmentJudge::start_part(const Reference& ends, double share, bool in_place) {
  if (flute_) {
    const double length_mm = tolerance_.flute.length_mm;
    flute_->part = FluteSegment(ends, length_mm);
    const Vec3 axis_P = flute_->whole.axis_P(share);
    if (in_place) flute_->whole = FluteSegment({ends.tip0_P, ends.tip0_P, axis_P, axis_P}, length_mm);
  }
  // To swing along the path and back is no course of it: at its end the next segment may have begun.
  if (in_place) reference_.tip0_P = reference_.tip1_P = ends.tip0_P;
}

SegmentJudge::Verdict SegmentJudge::verdict(const Station& a, const Station& b, const Known& known) const {
  if (flute_) return flute_verdict(a, b, {0.0, 1.0});
  if (options_.certify) {
    return certifier_.tip_within(a, b, reference_, tolerance_.tip_mm) == Within::yes &&
                   certifier_.axis_within(a, b, reference_, tolerance_.axis) == Within::yes
               ? Verdict::proved
               : Verdict::beyond;
  }
  // Sampled, where the cheap proofs and the middle do not answer.
  const double ends_mm = known.ends_mm ? *known.ends_mm : std::max(off_mm(a.tip_P), off_mm(b.tip_P));
  const Verdict tip = tip_verdict(a, b, known.middle_P, ends_mm);
  if (tip == Verdict::beyond) return tip;
  if (tip == Verdict::proved && (axis_surely_within(a, b, known.off_axis2) ||
                                 certifier_.axis_within(a, b, reference_, tolerance_.axis) == Within::yes))
    return tip;
  Largest largest;
  measure(a, b, largest);
  return largest.tip_mm <= tolerance_.tip_mm && largest.axis_rad <= tolerance_.axis.rad() ? Verdict::sampled
                                                                                          : Verdict::beyond;
}

// A proof for the flute is one for its tip; sampled it would not be any cheaper.
SegmentJudge::Verdict SegmentJudge::flute_verdict(const Station& a, const Station& b,
                                                  const FluteCertifier::Places& about) const {
  const bool keeps =
      flute_surely_within(a, b) ||
      (flute_certifier().within(a, b, flute_->whole, tolerance_.flute.off_mm, about) == Within::yes &&
       certifier_.axis_within(a, b, reference_, tolerance_.axis) == Within::yes);
  return keeps ? Verdict::proved : Verdict::beyond;
}

// `sampled`: samples have to tell.
SegmentJudge::Verdict SegmentJudge::tip_verdict(const Station& a, const Station& b,
                                                const Vec3* known_middle_P, double ends) const {
  if (ends > tolerance_.tip_mm) return Verdict::beyond;
  const NormsOf<double> norms = piece_norms(kinematics(), a, b);
  const double left_mm = tolerance_.tip_mm - ends - tip_rounding(kinematics(), a, b);
  if (norms.M2() / 8.0 <= left_mm) return Verdict::proved;
  const Vec3 middle_P = known_middle_P != nullptr ? *known_middle_P : middle_tip(kinematics(), a, b);
  if (off_mm(middle_P) > tolerance_.tip_mm) return Verdict::beyond;
  const Vec3 bow = middle_P - 0.5 * (a.tip_P + b.tip_P);
  const double beyond = beyond_parabola(norms.M3());
  if (bow.norm() + beyond <= left_mm) return Verdict::proved;
  // Rounded ends stand off where the bow is not at its largest, and what leads along the segment is no error;
  // nor is it from the straight course of the ends, which is what a prediction is held against.
  const double room_mm = left_mm + ends;
  const Reference straight = {a.tip_P, b.tip_P, a.axis_P, b.axis_P};
  const double parabola_mm = std::max(ParabolaForm(reference_, a, b, middle_P).largest(),
                                      ParabolaForm(straight, a, b, middle_P).largest());
  if (parabola_mm + beyond <= room_mm) return Verdict::proved;
  if (parabola_mm <= room_mm &&
      parabola_mm + beyond_parabola(expand(tip_curve(kinematics(), a, b))) <= room_mm)
    return Verdict::proved;
  return ends + certifier_.bow_from_cubic(a, b) <= tolerance_.tip_mm ? Verdict::proved : Verdict::sampled;
}

// A unit vector turned about two axes bends by at most (|dA| + |dC|)^2 / 8 off its chord; a chord is no
// longer than pi/2 times the sine of its angle up to a right angle.
bool SegmentJudge::axis_surely_within(const Station& a, const Station& b, double off_axis2) const {
  double turn = 0.0;
  for (std::size_t k = 0; k < 2; ++k)
    turn += std::abs(kinematics().angle(b.q, k) - kinematics().angle(a.q, k));
  const double bow = turn * turn / 8.0;
  const double limit = tolerance_.axis.rad() * 2.0 / kPi;  // below its sine
  if (bow > limit) return false;
  if (off_axis2 <= (limit - bow) * (limit - bow)) return true;
  const ArcShape arc(reference_.axis0_P, reference_.axis1_P);
  return std::max(ArcShape::distance(arc.foot(a.axis_P)), ArcShape::distance(arc.foot(b.axis_P))) + bow <=
         limit;
}

// Ends as they stand and motion in norms: what is far below the tolerance needs no more.
bool SegmentJudge::flute_surely_within(const Station& a, const Station& b) const {
  const double off2 =
      std::max((a.tip_P - reference_.tip0_P).squaredNorm(), (b.tip_P - reference_.tip1_P).squaredNorm());
  const double limit_mm = tolerance_.flute.off_mm;
  if (off2 > limit_mm * limit_mm) return false;
  const double off2_axis =
      std::max((a.axis_P - reference_.axis0_P).squaredNorm(), (b.axis_P - reference_.axis1_P).squaredNorm());
  const AxisMotion<double> axis = axis_motion(kinematics(), a, b);
  const double turn = std::abs(axis.outer) + std::abs(axis.inner);
  const double off_axis = std::sqrt(off2_axis);
  const double off_mm = std::sqrt(off2) + (options_.straight_tip ? 0.0 : certifier_.bow_from_norms(a, b)) +
                        tolerance_.flute.length_mm * off_for_each_mm_up(axis, off_axis);
  return off_mm <= limit_mm && off_axis + turn * turn / 8.0 <= tolerance_.axis.rad() * 2.0 / kPi;
}

void SegmentJudge::measure(const Station& a, const Station& b, Largest& largest) const {
  const SegmentShape segment(reference_.tip0_P, reference_.tip1_P);
  const ArcShape arc(reference_.axis0_P, reference_.axis1_P);
  const auto tip_of = [&](const Vec3& p) { return SegmentShape::distance(segment.foot(p)); };
  const auto axis_of = [&](const Vec3& u) { return ArcShape::measure(ArcShape::distance(arc.foot(u))); };
  double tip = std::max(tip_of(a.tip_P), tip_of(b.tip_P));
  double axis = std::max(axis_of(a.axis_P), axis_of(b.axis_P));
  if (!options_.certify) {
    for (int i = 1; i <= kSamples; ++i) {
      const JointVector q = JointVector::interpolate(a.q, b.q, static_cast<double>(i) / (kSamples + 1));
      const ToolPose pose = kinematics().pose(q);
      tip = std::max(tip, tip_of(pose.tip_P));
      axis = std::max(axis, axis_of(pose.axis_P));
    }
  } else {
    tip += certifier_.bow_from_norms(a, b);
    if (tip > kSurelyBelow * tolerance_.tip_mm) tip = certifier_.tip(a, b, reference_).upper;
    // The bound is within 5 % of the truth; in between the decision is the sharper proof.
    if (tip > tolerance_.tip_mm && certifier_.tip_within(a, b, reference_, tolerance_.tip_mm) == Within::yes)
      tip = tolerance_.tip_mm;
    double turn = 0.0;
    for (std::size_t k = 0; k < 2; ++k)
      turn += std::abs(kinematics().angle(b.q, k) - kinematics().angle(a.q, k));
    // sin x >= 2x/pi up to a right angle.
    axis += 0.5 * kPi * turn * turn / 8.0;
    if (axis > kSurelyBelow * tolerance_.axis.rad()) axis = certifier_.axis(a, b, reference_).upper;
    if (axis > tolerance_.axis.rad() &&
        certifier_.axis_within(a, b, reference_, tolerance_.axis) == Within::yes)
      axis = tolerance_.axis.rad();
  }
  largest.tip_mm = std::max(largest.tip_mm, tip);
  largest.axis_rad = std::max(largest.axis_rad, axis);
  if (!flute_) return;
  double flute_mm = flute_certifier().deviation(a, b, flute_->whole).upper;
  // As above.
  const double limit_mm = tolerance_.flute.off_mm;
  if (flute_mm > limit_mm && flute_certifier().within(a, b, flute_->whole, limit_mm) == Within::yes)
    flute_mm = limit_mm;
  largest.flute_mm = std::max(largest.flute_mm, flute_mm);
}

// Rotary axes that run straight keep the tool axis where it has to be.
bool SegmentJudge::axis_holds(const Station& a, const Station& b) const {
  constexpr double kShareOfFlute = 0.25;  // of the tolerance, at the end of the flute
  const Angle limit =
      flute_ ? std::min(tolerance_.axis, tolerance_.axis_room() * kShareOfFlute) : tolerance_.axis;
  return certifier_.axis_within(a, b, reference_, limit) == Within::yes;
}

}  // namespace trunnion::path
