// Between the words: where the tip is on the way of a block.
#include "post/making/block_bend.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"
#include "trunnion/path/correction_run.hpp"
#include "trunnion/path/known_place.hpp"
#include "trunnion/path/pole.hpp"

namespace trunnion::post {
namespace {

// Linear axes need not be square to each other: the sum of their ways is at most sqrt(3) times its root.
constexpr double kAskew = 2.0;

}  // namespace

// Distance of the tip from the chord that ends at `to`, at the fraction t of the block to `q`.
double BlockBend::strays_mm(const path::Point& to, const JointVector& q, double t) const {
  return distance_to_segment(actual_tip_P(q, t), work_.at.point.tip_P, to.tip_P);
}

Vec3 BlockBend::actual_tip_P(const JointVector& q, double t) const {
  const JointVector at = JointVector::interpolate(work_.at.joints, q, t);
  Vec3 tip_P =
      work_.errors.compensator
          ? work_.errors.compensator->actual(work_.errors.state.towards(q, at), work_.errors.state.lagged())
                .tip_P
          : Vec3(work_.tool.kinematics.pose(at).tip_P);
  if (work_.thermal.has_offsets()) tip_P += work_.thermal.deviation_P(at);
  return tip_P;
}

// The nonlinear test on the machine with errors: does the tip between the last block and `q` leave its
// segment of the path by more than the tolerance?
bool BlockBend::leaves_path(const path::Point& to, const JointVector& q, bool bounded) {
  if (!work_.course.segment()) return span_leaves_path(to, q);
  const double limit_mm = work_.modes.tolerances.cutting().tip_mm;
  if (work_.errors.turner) {
    const double flute_limit_mm = work_.modes.tolerances.tolerance_mm();
    const auto off_mm = [&](const JointVector& from, const JointVector& last) {
      return work_.course.flute_mm(from, last, work_.posting.options.rtcp, work_.errors.state,
                                   flute_limit_mm);
    };
    if (off_mm(work_.at.joints, q) > flute_limit_mm) {
      // Where the rotary axes cannot put the tool right at an end no point between helps.
      const double end_mm = std::max(off_mm(work_.at.joints, work_.at.joints), off_mm(q, q));
      if (end_mm <= flute_limit_mm) return true;
      say_what_stays(to, end_mm);
    }
  }
  const bool is_cheap = work_.course.is_fixed_and_proved();
  if (is_cheap && stays_surely(to, q, path::kBentWithErrors * limit_mm, bounded)) return false;
  if (!is_cheap) {
    // On the nominal machine the piece keeps to this bound, proved; the errors bend the rest, and most half
    // way.
    const double middle = strays_mm(to, q, 0.5);
    const path::Certifier certifier(work_.tool.kinematics);
    const double nominal = certifier.bow_from_norms(path::station(work_.tool.kinematics, work_.at.joints),
                                                    path::station(work_.tool.kinematics, q));
    if (2.0 * (nominal + middle) <= path::kBentWithErrors * limit_mm) return false;
  }
  const DeviationMeter::Deviation enough{{0.0, limit_mm}, {0.0, kPi}};
  const auto found =
      work_.course.deviation(work_.at.joints, q, work_.posting.options.rtcp, work_.errors.state, enough);
  return found.tip_mm.upper >
         (found.proved && !found.unbounded ? limit_mm : path::kBentWithErrors * limit_mm);
}

void BlockBend::say_what_stays(const path::Point& to, double off_mm) {
  work_.posting.warn_once(
      "direction stays", to.where,
      "the rotary axes cannot correct the tilt of the tool by the machine's errors here, " +
          fixed_text(path::tilt_from_pole(work_.posting.machine, to.axis_P).deg(), 3) +
          " deg from the axis about which the table turns: " + fixed_text(off_mm, 6) + " mm remain " +
          shortest_text(work_.tool.tool.flute_mm) +
          " mm above the tip. Near that axis the rotary axes tilt the tool in one plane only");
}

// The corrected ends stand where they were prescribed but for the rounding of the words, so that a bound of
// the errors over the motion is all that is needed of them. `bounded`: norms were asked beforehand.
bool BlockBend::stays_surely(const path::Point& to, const JointVector& q, double limit_mm, bool bounded) {
  if (work_.posting.options.rtcp || work_.planes.in_force() || work_.at.holds_digits) return false;
  const auto most = work_.course.meter().bend_at_most(work_.at.joints, q);
  if (!most) return false;
  const double slack_mm = most->tip_mm + path::kBothEnds * work_.axis_words.radius_mm();
  if (slack_mm >= limit_mm) return false;
  const Vec3 from_P = work_.at.point.tip_P + work_.at.point.beside_P;
  const Vec3 to_P = to.tip_P + to.beside_P;
  const Vec3& tip0_P = work_.course.segment()->first.tip_P;
  const Vec3& tip1_P = work_.course.segment()->second.tip_P;
  const auto norms_suffice = [&] {
    // The nominal tip is off these by the correction, which began at rounded words and was rounded.
    const double moved_mm =
        kAskew * (work_.posting.report.largest_correction_mm + 2.0 * work_.axis_words.radius_mm());
    const double left_mm =
        limit_mm - slack_mm -
        path::bow_from_norms(work_.tool.kinematics, {work_.at.joints, from_P}, {q, to_P}, moved_mm);
    if (left_mm < 0.0) return false;
    // Nearly always the ends are those of the segment.
    const double ends2 = std::max((from_P - tip0_P).squaredNorm(), (to_P - tip1_P).squaredNorm());
    return ends2 <= left_mm * left_mm || (distance_to_segment(from_P, tip0_P, tip1_P) <= left_mm &&
                                          distance_to_segment(to_P, tip0_P, tip1_P) <= left_mm);
  };
  if (!bounded && norms_suffice()) return true;
  const auto placed = [](const path::Station& nominal, const Vec3& tip_P) {
    return path::shifted(nominal, tip_P - nominal.tip_P, Vec3::Zero());
  };
  const auto [before, after] = work_.course.nominal(work_.tool.kinematics, work_.at.joints, q);
  const path::Reference reference{tip0_P, tip1_P, work_.course.segment()->first.axis_P,
                                  work_.course.segment()->second.axis_P};
  return work_.course.meter().certifier().tip_within(placed(before, from_P), placed(after, to_P), reference,
                                                     limit_mm - slack_mm) == path::Within::yes;
}

// A piece that passes programmed points keeps to the path as the nominal machine runs it: the refinement saw
// to that. What is left to the errors is how far they take it off that course.
bool BlockBend::span_leaves_path(const path::Point& to, const JointVector& q) const {
  const double limit_mm =
      path::kBentWithErrors * (work_.modes.tolerances.cutting().tip_mm - span_tolerance().tip_mm);
  for (const double t : {0.25, 0.5, 0.75}) {
    const Vec3 nominal_P =
        work_.tool.kinematics.pose(JointVector::interpolate(work_.at.point.q, to.q, t)).tip_P;
    if ((actual_tip_P(q, t) - nominal_P).norm() > limit_mm) return true;
  }
  return false;
}

path::Tolerance BlockBend::span_tolerance() const {
  constexpr double kTipShare = 0.1;   // left to the errors between the blocks
  constexpr double kRoundings = 4.0;  // nominal and corrected words, at both ends
  double quanta2 = 0.0;
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    if (work_.posting.machine.axes[id].kind == AxisKind::linear)
      quanta2 += work_.axis_words.rounding().quantum[id] * work_.axis_words.rounding().quantum[id];
  }
  path::Tolerance out = work_.modes.tolerances.cutting();
  const double left_mm = std::max(kTipShare * out.tip_mm, kRoundings * 0.5 * std::sqrt(quanta2));
  out.tip_mm -= std::min(left_mm, 0.5 * out.tip_mm);
  out.flute.off_mm = std::min(out.flute.off_mm, out.tip_mm);
  return out;
}

// Half way from the last point to `to`: on the chord within a segment, on the nominal course of a piece that
// passes programmed points.
path::Point BlockBend::middle_before(const path::Point& to) const {
  path::Point middle = to;
  middle.q = JointVector::interpolate(work_.at.point.q, to.q, 0.5);
  middle.inserted = true;
  middle.beside_P = Vec3::Zero();
  if (work_.course.segment()) {
    middle.tip_P = 0.5 * (work_.at.point.tip_P + to.tip_P);
    middle.axis_P = slerp(work_.at.point.axis_P, to.axis_P, 0.5);
  } else {
    const ToolPose nominal = work_.tool.kinematics.pose(middle.q);
    middle.tip_P = nominal.tip_P;
    middle.axis_P = nominal.axis_P;
  }
  path::round_to_words(work_.tool.kinematics, work_.axis_words.rounding(), middle.tip_P, middle.q);
  return middle;
}

// In a block in which the rotary axes turn, X Y Z words that only rounding changes are no path, but the
// control takes them for the whole of it: F then means next to nothing (LinuxCNC issue 2410: G93 keeps a
// lowest rate, and the rotary axes run away). Such words stay what they were, where the tip stays within the
// tolerance; what is left out comes with the next block that moves.
std::optional<JointVector> BlockBend::without_idle_digits(const path::Point& to, const JointVector& q) const {
  constexpr std::int64_t kIdleQuanta = 2;  // the rounding of both ends, twice
  constexpr double kMargin = 0.9;          // of the tolerance: these are samples, the verification proves
  const JointVector before = words_.of(work_.at.joints);
  const JointVector after = words_.of(q);
  JointVector held = q;
  bool turns = false;
  for (AxisId id = 0; id < work_.posting.machine.axes.size(); ++id) {
    if (work_.posting.machine.axes[id].kind == AxisKind::rotary) {
      turns = turns || q[id] != work_.at.joints[id];
      continue;
    }
    const auto quanta = [&](double word) {
      return work_.posting.controller.numbers.axes.quanta(work_.posting.letters[id], word);
    };
    if (std::abs(quanta(after[id]) - quanta(before[id])) > kIdleQuanta) return std::nullopt;
    held[id] = work_.at.joints[id];
  }
  if (!turns) return std::nullopt;
  if (work_.posting.options.rtcp) {
    work_.tool.kinematics.solve_linear(words_.tip_P(work_.at.joints), work_.tool.kinematics.sines(held),
                                       held);
    return strays_mm(to, held, 1.0) > kMargin * work_.posting.options.tolerance_mm ? std::nullopt
                                                                                   : std::optional(held);
  }
  for (const double t : {0.25, 0.5, 0.75, 1.0}) {
    if (strays_mm(to, held, t) > kMargin * work_.posting.options.tolerance_mm) return std::nullopt;
  }
  return held;
}

}  // namespace trunnion::post
