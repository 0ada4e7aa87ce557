// Between the words: where the tip is on the way of a block, and what the words of its end are.
#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/path/correction_run.hpp"
#include "trunnion/path/known_place.hpp"

#include "post/pipeline.hpp"

namespace trunnion::post {
namespace {

// Linear axes need not be square to each other: the sum of their ways is at most sqrt(3) times its root.
constexpr double kAskew = 2.0;

}  // namespace

// Distance of the tip from the chord that ends at `to`, at the fraction t of the block to `q`.
double Pipeline::strays_mm(const path::Point& to, const JointVector& q, double t) const {
  return distance_to_segment(actual_tip_P(q, t), last_.tip_P, to.tip_P);
}

Vec3 Pipeline::actual_tip_P(const JointVector& q, double t) const {
  const JointVector at = JointVector::interpolate(last_emitted_, q, t);
  Vec3 tip_P = compensator_ ? compensator_->actual(state_.towards(q, at), state_.lagged()).tip_P
                            : Vec3(kinematics_.pose(at).tip_P);
  if (thermal_.has_offsets()) tip_P += thermal_.deviation_P(at);
  return tip_P;
}

// What is lagged counts as it was when the block began.
bool Pipeline::lasts_long(const JointVector& q, double tip_mm, double rate) const {
  constexpr double kLongest_s = 10.0;  // a thirtieth of the shortest time constant that effects have
  return !state_.lagged().empty() && planner_.plan(move_to(q, tip_mm), rate).seconds > kLongest_s;
}

// The nonlinear test on the machine with errors: does the tip between the last block and `q` leave its
// segment of the path by more than the tolerance?
bool Pipeline::bends(const path::Point& to, const JointVector& q, bool bounded) const {
  if (!segment_) return span_bends(to, q);
  const double limit_mm = tolerances_.cutting().tip_mm;
  const bool is_cheap = meter_->is_fixed() && meter_->proves();
  if (is_cheap && stays_surely(to, q, path::kBentWithErrors * limit_mm, bounded)) return false;
  if (!is_cheap) {
    // On the nominal machine the piece keeps to this bound, proved; the errors bend the rest, and most half
    // way.
    const double middle = strays_mm(to, q, 0.5);
    const path::Certifier certifier(kinematics_);
    const double nominal =
        certifier.bow_from_norms(path::station(kinematics_, last_emitted_), path::station(kinematics_, q));
    if (2.0 * (nominal + middle) <= path::kBentWithErrors * limit_mm) return false;
  }
  Vertex& from = vertices_[0];
  Vertex& at = vertices_[1];
  if (is_cheap && at.q == last_emitted_) std::swap(from, at);  // it ended the last block
  if (!is_cheap || from.q != last_emitted_) {
    from.q = last_emitted_;
    meter_->place(from, q, state_);
  }
  at.q = q;
  meter_->place(at, q, state_);
  from.tcp = at.tcp = posting_.options.rtcp;
  const DeviationMeter::Deviation enough{{0.0, limit_mm}, {0.0, kPi}};
  const auto found = meter_->of(from, at, segment_->first, segment_->second, state_, enough);
  return found.tip_mm.upper >
         (found.proved && !found.unbounded ? limit_mm : path::kBentWithErrors * limit_mm);
}

// The corrected ends stand where they were prescribed but for the rounding of the words, so that a bound of
// the errors over the motion is all that is needed of them. `bounded`: norms were asked beforehand.
bool Pipeline::stays_surely(const path::Point& to, const JointVector& q, double limit_mm,
                            bool bounded) const {
  if (posting_.options.rtcp || plane_ || holds_digits_) return false;
  const auto most = meter_->bend_at_most(last_emitted_, q);
  if (!most) return false;
  const double slack_mm = most->tip_mm + path::kBothEnds * axis_words_.radius_mm();
  if (slack_mm >= limit_mm) return false;
  const Vec3 from_P = last_.tip_P + last_.beside_P;
  const Vec3 to_P = to.tip_P + to.beside_P;
  const Vec3& tip0_P = segment_->first.tip_P;
  const Vec3& tip1_P = segment_->second.tip_P;
  const auto norms_suffice = [&] {
    // The nominal tip is off these by the correction, which began at rounded words and was rounded.
    const double moved_mm = kAskew * (posting_.report.largest_correction_mm + 2.0 * axis_words_.radius_mm());
    const double left_mm =
        limit_mm - slack_mm - path::bow_from_norms(kinematics_, {last_emitted_, from_P}, {q, to_P}, moved_mm);
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
  if (station_.q != last_emitted_) station_ = path::station(kinematics_, last_emitted_);
  const path::Station before = std::exchange(station_, path::station(kinematics_, q));
  const path::Reference reference{tip0_P, tip1_P, segment_->first.axis_P, segment_->second.axis_P};
  return meter_->certifier().tip_within(placed(before, from_P), placed(station_, to_P), reference,
                                        limit_mm - slack_mm) == path::Within::yes;
}

// A piece that passes programmed points keeps to the path as the nominal machine runs it: the refinement saw
// to that. What is left to the errors is how far they take it off that course.
bool Pipeline::span_bends(const path::Point& to, const JointVector& q) const {
  const double limit_mm = path::kBentWithErrors * (tolerances_.cutting().tip_mm - span_tolerance().tip_mm);
  for (const double t : {0.25, 0.5, 0.75}) {
    const Vec3 nominal_P = kinematics_.pose(JointVector::interpolate(last_.q, to.q, t)).tip_P;
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
  path::Tolerance out = tolerances_.cutting();
  const double left_mm = std::max(kTipShare * out.tip_mm, kRoundings * 0.5 * std::sqrt(quanta2));
  out.tip_mm -= std::min(left_mm, 0.5 * out.tip_mm);
  return out;
}

// Half way from the last point to `to`: on the chord within a segment, on the nominal course of a piece that
// passes programmed points.
path::Point Pipeline::middle_before(const path::Point& to) const {
  path::Point middle = to;
  middle.q = JointVector::interpolate(last_.q, to.q, 0.5);
  middle.inserted = true;
  middle.beside_P = Vec3::Zero();
  if (segment_) {
    middle.tip_P = 0.5 * (last_.tip_P + to.tip_P);
    middle.axis_P = slerp(last_.axis_P, to.axis_P, 0.5);
  } else {
    const ToolPose nominal = kinematics_.pose(middle.q);
    middle.tip_P = nominal.tip_P;
    middle.axis_P = nominal.axis_P;
  }
  path::round_to_words(kinematics_, axis_words_.rounding(), middle.tip_P, middle.q);
  return middle;
}

// In a block in which the rotary axes turn, X Y Z words that only rounding changes are no path, but the
// control takes them for the whole of it: F then means next to nothing (LinuxCNC issue 2410: G93 keeps a
// lowest rate, and the rotary axes run away). Such words stay what they were, where the tip stays within the
// tolerance; what is left out comes with the next block that moves.
std::optional<JointVector> Pipeline::without_idle_digits(const path::Point& to, const JointVector& q) const {
  constexpr std::int64_t kIdleQuanta = 2;  // the rounding of both ends, twice
  constexpr double kMargin = 0.9;          // of the tolerance: these are samples, the verification proves
  const JointVector before = words(last_emitted_);
  const JointVector after = words(q);
  JointVector held = q;
  bool turns = false;
  for (AxisId id = 0; id < posting_.machine.axes.size(); ++id) {
    if (posting_.machine.axes[id].kind == AxisKind::rotary) {
      turns = turns || q[id] != last_emitted_[id];
      continue;
    }
    const auto quanta = [&](double word) {
      return posting_.controller.numbers.axes.quanta(posting_.letters[id], word);
    };
    if (std::abs(quanta(after[id]) - quanta(before[id])) > kIdleQuanta) return std::nullopt;
    held[id] = last_emitted_[id];
  }
  if (!turns) return std::nullopt;
  if (posting_.options.rtcp) {
    kinematics_.solve_linear(word_tip_P(last_emitted_), kinematics_.sines(held), held);
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
  return plane_ ? plane_->X_PF * tip : tip;
}

JointVector Pipeline::words(const JointVector& q) const {
  if (in_part()) return part_words(q);
  return axis_words_.of(q);
}

FeedPlanner::Move Pipeline::move_to(const JointVector& q, double tip_mm) const {
  FeedPlanner::Move move{last_emitted_, q, tip_mm, std::nullopt, 0.0};
  if (!posting_.options.rtcp) {
    move.axes_s = planner_.slowest_axis_s(last_emitted_, q);
    return move;
  }
  const Vec3 from_P = word_tip_P(last_emitted_);
  const Vec3 to_P = word_tip_P(q);
  move.tcp_way_mm = (to_P - from_P).norm();
  move.axes_s = planner_.slowest_along_s([&](double t) {
    JointVector at = JointVector::interpolate(last_emitted_, q, t);
    kinematics_.solve_linear(from_P + t * (to_P - from_P), kinematics_.sines(at), at);
    return at;
  });
  return move;
}

// Words under tool-centre-point control and in a tilted plane: the tip in P or in the plane, for linear axes
// named X, Y and Z.
JointVector Pipeline::part_words(const JointVector& q) const {
  JointVector words = q;
  Vec3 tip = kinematics_.pose(q).tip_P;
  if (plane_) tip = plane_->X_PF.inverse() * tip;
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
