// Between the words: where the tip is on the way of a block, and what the words of its end are.
#include <algorithm>
#include <cmath>

#include "post/pipeline.hpp"

namespace trunnion::post {
namespace {

// Share of the tolerance that a piece may take at the samples of `bends`: the rest is left to what lies
// between them and to the proof of the verification.
constexpr double kBentWithErrors = 0.98;

}  // namespace

// Distance of the tip from the chord that ends at `to`, at the fraction t of the block to `q`.
double Pipeline::strays_mm(const path::Point& to, const JointVector& q, double t) const {
  const JointVector at = JointVector::interpolate(last_emitted_, q, t);
  Vec3 tip_P = compensator_ ? compensator_->actual(state_.towards(q, at), state_.lagged()).tip_P
                            : Vec3(kinematics_.pose(at).tip_P);
  if (offsets_) tip_P += offsets_->deviation_P(part_in_machine(machine_, at).R);
  return distance_to_segment(tip_P, last_.tip_P, to.tip_P);
}

// What is lagged counts as it was when the block began.
bool Pipeline::lasts_long(const JointVector& q, double tip_mm, double rate) const {
  constexpr double kLongest_s = 10.0;  // a thirtieth of the shortest time constant that effects have
  return !state_.lagged().empty() && planner_.plan(move_to(q, tip_mm), rate).seconds > kLongest_s;
}

// Where an axis is about to reverse, its lost motion is taken up before the cut goes on: a block to the same
// place, corrected for the new sense of motion.
Result<void> Pipeline::emit_take_up(const path::Point& to, SourceRef where) {
  if (!compensator_) return {};
  const MachineState after = state_.towards(expected(to.q), last_.q);
  if (after.direction == state_.now().direction) return {};
  const auto found =
      compensator_->corrected(last_.tip_P + last_.beside_P, last_.axis_P, after, state_.lagged());
  if (!found) return {};  // the same failure comes with its place for the point itself
  JointVector q = found->q;
  for (AxisId id = 0; id < machine_.axes.size(); ++id) q[id] = rounding_.rounded(id, q[id]);
  if (q == last_emitted_ || !is_take_up(machine_, last_emitted_, q)) return {};
  const BlockFeed block = planner_.plan(move_to(q, 0.0), options_.default_feed_mm_s);
  moved(q, block.seconds);
  last_emitted_ = q;
  return emit_motion(q, nc::MotionKind::feed, block, where);
}

// The nonlinear test on the machine with errors: does the tip between the last block and `q` leave the chord
// by more than the tolerance?
bool Pipeline::bends(const path::Point& to, const JointVector& q) const {
  const auto off_chord = [&](double t) { return strays_mm(to, q, t); };
  const double limit_mm = kBentWithErrors * tolerances_.cutting().tip_mm;
  const double middle = off_chord(0.5);
  if (middle > limit_mm) return true;
  // On the nominal machine the piece keeps to this bound, proved; the errors bend the rest, and most half
  // way.
  const path::Certifier certifier(kinematics_);
  const double nominal =
      certifier.bow_from_norms(path::station(kinematics_, last_emitted_), path::station(kinematics_, q));
  if (2.0 * (nominal + middle) <= limit_mm) return false;
  return off_chord(0.25) > limit_mm || off_chord(0.75) > limit_mm;
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
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (machine_.axes[id].kind == AxisKind::rotary) {
      turns = turns || q[id] != last_emitted_[id];
      continue;
    }
    const auto quanta = [&](double word) { return controller_.numbers.axes.quanta(letters_[id], word); };
    if (std::abs(quanta(after[id]) - quanta(before[id])) > kIdleQuanta) return std::nullopt;
    held[id] = last_emitted_[id];
  }
  if (!turns) return std::nullopt;
  if (options_.rtcp) {
    kinematics_.solve_linear(word_tip_P(last_emitted_), kinematics_.sines(held), held);
    return strays_mm(to, held, 1.0) > kMargin * options_.tolerance_mm ? std::nullopt : std::optional(held);
  }
  for (const double t : {0.25, 0.5, 0.75, 1.0}) {
    if (strays_mm(to, held, t) > kMargin * options_.tolerance_mm) return std::nullopt;
  }
  return held;
}

Vec3 Pipeline::word_tip_P(const JointVector& q) const {
  const JointVector at = part_words(q);
  Vec3 tip = Vec3::Zero();
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (machine_.axes[id].kind == AxisKind::linear)
      tip[static_cast<Eigen::Index>(nc::index(letters_[id]))] =
          controller_.numbers.axes.rounded(letters_[id], at[id]);
  }
  return plane_ ? plane_->X_PF * tip : tip;
}

JointVector Pipeline::words(const JointVector& q) const {
  if (in_part()) return part_words(q);
  JointVector out = q;
  for (AxisId id = 0; id < machine_.axes.size(); ++id) out[id] += word_offsets_[id];
  return out;
}

FeedPlanner::Move Pipeline::move_to(const JointVector& q, double tip_mm) const {
  FeedPlanner::Move move{last_emitted_, q, tip_mm, std::nullopt, 0.0};
  if (!options_.rtcp) {
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
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (machine_.axes[id].kind != AxisKind::linear) continue;
    const double word = tip[static_cast<Eigen::Index>(nc::index(letters_[id]))];
    words[id] = word + std::copysign(kHalfWay_mm, word);
  }
  return words;
}

}  // namespace trunnion::post
