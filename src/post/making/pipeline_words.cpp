// Between the words: where the tip is on the way of a block, and what the words of its end are.
#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/path/correction_run.hpp"
#include "trunnion/path/known_place.hpp"

#include "post/making/pipeline.hpp"

namespace trunnion::post {
namespace {

// Linear axes need not be square to each other: the sum of their ways is at most sqrt(3) times its root.
constexpr double kAskew = 2.0;

}  // namespace

// Distance of the tip from the chord that ends at `to`, at the fraction t of the block to `q`.
double Pipeline::strays_mm(const path::Point& to, const JointVector& q, double t) const {
  return distance_to_segment(actual_tip_P(q, t), at_.point.tip_P, to.tip_P);
}

Vec3 Pipeline::actual_tip_P(const JointVector& q, double t) const {
  const JointVector at = JointVector::interpolate(at_.joints, q, t);
  Vec3 tip_P = errors_.compensator
                   ? errors_.compensator->actual(errors_.state.towards(q, at), errors_.state.lagged()).tip_P
                   : Vec3(tool_.kinematics.pose(at).tip_P);
  if (thermal_.has_offsets()) tip_P += thermal_.deviation_P(at);
  return tip_P;
}

// What is lagged counts as it was when the block began.
bool Pipeline::lasts_long(const JointVector& q, double tip_mm, double rate) const {
  constexpr double kLongest_s = 10.0;  // a thirtieth of the shortest time constant that effects have
  return !errors_.state.lagged().empty() && planner_.plan(move_to(q, tip_mm), rate).seconds > kLongest_s;
}

// The nonlinear test on the machine with errors: does the tip between the last block and `q` leave its
// segment of the path by more than the tolerance?
bool Pipeline::bends(const path::Point& to, const JointVector& q, bool bounded) {
  if (!course_.segment()) return span_bends(to, q);
  const double limit_mm = modes_.tolerances.cutting().tip_mm;
  if (errors_.turner) {
    const double flute_limit_mm = modes_.tolerances.tolerance_mm();
    if (course_.flute_mm(at_.joints, q, posting_.options.rtcp, errors_.state, flute_limit_mm) >
        flute_limit_mm)
      return true;
  }
  const bool is_cheap = course_.is_fixed_and_proved();
  if (is_cheap && stays_surely(to, q, path::kBentWithErrors * limit_mm, bounded)) return false;
  if (!is_cheap) {
    // On the nominal machine the piece keeps to this bound, proved; the errors bend the rest, and most half
    // way.
    const double middle = strays_mm(to, q, 0.5);
    const path::Certifier certifier(tool_.kinematics);
    const double nominal = certifier.bow_from_norms(path::station(tool_.kinematics, at_.joints),
                                                    path::station(tool_.kinematics, q));
    if (2.0 * (nominal + middle) <= path::kBentWithErrors * limit_mm) return false;
  }
  const DeviationMeter::Deviation enough{{0.0, limit_mm}, {0.0, kPi}};
  const auto found = course_.deviation(at_.joints, q, posting_.options.rtcp, errors_.state, enough);
  return found.tip_mm.upper >
         (found.proved && !found.unbounded ? limit_mm : path::kBentWithErrors * limit_mm);
}

// The corrected ends stand where they were prescribed but for the rounding of the words, so that a bound of
// the errors over the motion is all that is needed of them. `bounded`: norms were asked beforehand.
bool Pipeline::stays_surely(const path::Point& to, const JointVector& q, double limit_mm, bool bounded) {
  if (posting_.options.rtcp || planes_.in_force() || at_.holds_digits) return false;
  const auto most = course_.meter().bend_at_most(at_.joints, q);
  if (!most) return false;
  const double slack_mm = most->tip_mm + path::kBothEnds * axis_words_.radius_mm();
  if (slack_mm >= limit_mm) return false;
  const Vec3 from_P = at_.point.tip_P + at_.point.beside_P;
  const Vec3 to_P = to.tip_P + to.beside_P;
  const Vec3& tip0_P = course_.segment()->first.tip_P;
  const Vec3& tip1_P = course_.segment()->second.tip_P;
  const auto norms_suffice = [&] {
    // The nominal tip is off these by the correction, which began at rounded words and was rounded.
    const double moved_mm = kAskew * (posting_.report.largest_correction_mm + 2.0 * axis_words_.radius_mm());
    const double left_mm = limit_mm - slack_mm -
                           path::bow_from_norms(tool_.kinematics, {at_.joints, from_P}, {q, to_P}, moved_mm);
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
  const auto [before, after] = course_.nominal(tool_.kinematics, at_.joints, q);
  const path::Reference reference{tip0_P, tip1_P, course_.segment()->first.axis_P,
                                  course_.segment()->second.axis_P};
  return course_.meter().certifier().tip_within(placed(before, from_P), placed(after, to_P), reference,
                                                limit_mm - slack_mm) == path::Within::yes;
}

// A piece that passes programmed points keeps to the path as the nominal machine runs it: the refinement saw
// to that. What is left to the errors is how far they take it off that course.
bool Pipeline::span_bends(const path::Point& to, const JointVector& q) const {
  const double limit_mm =
      path::kBentWithErrors * (modes_.tolerances.cutting().tip_mm - span_tolerance().tip_mm);
  for (const double t : {0.25, 0.5, 0.75}) {
    const Vec3 nominal_P = tool_.kinematics.pose(JointVector::interpolate(at_.point.q, to.q, t)).tip_P;
    if ((actual_tip_P(q, t) - nominal_P).norm() > limit_mm) return true;
  }
  return false;
}

path::Tolerance Pipeline::span_tolerance() const {
  constexpr double kTipShare = 0.1;   // left to the errors between the blocks
  constexpr double kRoundings = 4.0;  // nominal and corrected words, at both ends
  double quanta2 = 0.0;
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    if (posting_.machine.axes[id].kind == AxisKind::linear)
      quanta2 += axis_words_.rounding().quantum[id] * axis_words_.rounding().quantum[id];
  }
  path::Tolerance out = modes_.tolerances.cutting();
  const double left_mm = std::max(kTipShare * out.tip_mm, kRoundings * 0.5 * std::sqrt(quanta2));
  out.tip_mm -= std::min(left_mm, 0.5 * out.tip_mm);
  out.flute.off_mm = std::min(out.flute.off_mm, out.tip_mm);
  return out;
}

// Half way from the last point to `to`: on the chord within a segment, on the nominal course of a piece that
// passes programmed points.
path::Point Pipeline::middle_before(const path::Point& to) const {
  path::Point middle = to;
  middle.q = JointVector::interpolate(at_.point.q, to.q, 0.5);
  middle.inserted = true;
  middle.beside_P = Vec3::Zero();
  if (course_.segment()) {
    middle.tip_P = 0.5 * (at_.point.tip_P + to.tip_P);
    middle.axis_P = slerp(at_.point.axis_P, to.axis_P, 0.5);
  } else {
    const ToolPose nominal = tool_.kinematics.pose(middle.q);
    middle.tip_P = nominal.tip_P;
    middle.axis_P = nominal.axis_P;
  }
  path::round_to_words(tool_.kinematics, axis_words_.rounding(), middle.tip_P, middle.q);
  return middle;
}

// In a block in which the rotary axes turn, X Y Z words that only rounding changes are no path, but the
// control takes them for the whole of it: F then means next to nothing (LinuxCNC issue 2410: G93 keeps a
// lowest rate, and the rotary axes run away). Such words stay what they were, where the tip stays within the
// tolerance; what is left out comes with the next block that moves.
std::optional<JointVector> Pipeline::without_idle_digits(const path::Point& to, const JointVector& q) const {
  constexpr std::int64_t kIdleQuanta = 2;  // the rounding of both ends, twice
  constexpr double kMargin = 0.9;          // of the tolerance: these are samples, the verification proves
  const JointVector before = words(at_.joints);
  const JointVector after = words(q);
  JointVector held = q;
  bool turns = false;
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    if (posting_.machine.axes[id].kind == AxisKind::rotary) {
      turns = turns || q[id] != at_.joints[id];
      continue;
    }
    const auto quanta = [&](double word) {
      return posting_.controller.numbers.axes.quanta(posting_.letters[id], word);
    };
    if (std::abs(quanta(after[id]) - quanta(before[id])) > kIdleQuanta) return std::nullopt;
    held[id] = at_.joints[id];
  }
  if (!turns) return std::nullopt;
  if (posting_.options.rtcp) {
    tool_.kinematics.solve_linear(word_tip_P(at_.joints), tool_.kinematics.sines(held), held);
    return strays_mm(to, held, 1.0) > kMargin * posting_.options.tolerance_mm ? std::nullopt
                                                                              : std::optional(held);
  }
  for (const double t : {0.25, 0.5, 0.75, 1.0}) {
    if (strays_mm(to, held, t) > kMargin * posting_.options.tolerance_mm) return std::nullopt;
  }
  return held;
}

Vec3 Pipeline::word_tip_P(const JointVector& q) const {
  const JointVector at = part_words(q);
  Vec3 tip = Vec3::Zero();
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    if (posting_.machine.axes[id].kind == AxisKind::linear)
      tip[static_cast<Eigen::Index>(nc::index(posting_.letters[id]))] =
          posting_.controller.numbers.axes.rounded(posting_.letters[id], at[id]);
  }
  return planes_.in_force() ? planes_.in_force()->X_PF * tip : tip;
}

JointVector Pipeline::words(const JointVector& q) const {
  if (in_part()) return part_words(q);
  return axis_words_.of(q);
}

FeedPlanner::Move Pipeline::move_to(const JointVector& q, double tip_mm) const {
  FeedPlanner::Move move{at_.joints, q, tip_mm, std::nullopt, 0.0};
  if (!posting_.options.rtcp) {
    move.axes_s = planner_.slowest_axis_s(at_.joints, q);
    return move;
  }
  const Vec3 from_P = word_tip_P(at_.joints);
  const Vec3 to_P = word_tip_P(q);
  move.tcp_way_mm = (to_P - from_P).norm();
  move.axes_s = planner_.slowest_along_s([&](double t) {
    JointVector at = JointVector::interpolate(at_.joints, q, t);
    tool_.kinematics.solve_linear(from_P + t * (to_P - from_P), tool_.kinematics.sines(at), at);
    return at;
  });
  return move;
}

// Words under tool-centre-point control and in a tilted plane: the tip in P or in the plane, for linear axes
// named X, Y and Z.
JointVector Pipeline::part_words(const JointVector& q) const {
  JointVector words = q;
  Vec3 tip = tool_.kinematics.pose(q).tip_P;
  if (planes_.in_force()) tip = planes_.in_force()->X_PF.inverse() * tip;
  // A CL file of more digits has points half way between two words: away from zero then, however the
  // evaluation of the tip was rounded.
  constexpr double kHalfWay_mm = 1e-9;
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    if (posting_.machine.axes[id].kind != AxisKind::linear) continue;
    const double word = tip[static_cast<Eigen::Index>(nc::index(posting_.letters[id]))];
    words[id] = word + std::copysign(kHalfWay_mm, word);
  }
  return words;
}

}  // namespace trunnion::post
