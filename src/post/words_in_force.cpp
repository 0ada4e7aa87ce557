#include "post/words_in_force.hpp"

namespace trunnion::post {
namespace {

WordOfAxis word_of_axis(const nc::AxisFormat& format, nc::AxisLetter letter, AxisKind kind) {
  const bool rotary = kind == AxisKind::rotary;
  WordOfAxis out;
  out.letter = nc::index(letter);
  for (int i = 0; i < format.decimals(letter); ++i) out.scale *= 10.0;
  if (nc::is_rotary(letter)) out.factor = kRadPerDegree;
  if (rotary) out.rotary = nc::AxisWords::bit(letter);
  (rotary ? out.rotary_share : out.linear_share) = 1.0;
  return out;
}

}  // namespace

AxisWordsOf::AxisWordsOf(const Machine& machine, const nc::AxisFormat& format) : count(machine.axes.size()) {
  for (AxisId id = 0; id < count; ++id) {
    const AxisKind kind = machine.axes[id].kind;
    letters[id] = *nc::axis_letter(machine.axes[id].name);
    const std::uint16_t bit = nc::AxisWords::bit(letters[id]);
    all = static_cast<std::uint16_t>(all | bit);
    if (kind == AxisKind::linear) linear = static_cast<std::uint16_t>(linear | bit);
    of[id] = word_of_axis(format, letters[id], kind);
  }
}

JointVector AxisWordsOf::with_xyz(const JointVector& words, const std::array<double, 3>& xyz) const {
  JointVector out = words;
  for (AxisId id = 0; id < count; ++id) {
    if (of[id].letter < 3) out[id] = xyz[of[id].letter];
  }
  return out;
}

WordsInForce::WordsInForce(const Machine& machine, const nc::Controller& controller,
                           const AxisWordsOf& axis_words, const SpindleTool& in_spindle)
    : tool(in_spindle),
      kinematics(machine, in_spindle.vector()),
      shift(machine, controller),
      machine_(machine),
      controller_(controller),
      axis_words_(axis_words) {
  add_length(in_spindle.control_adds_length);
}

void WordsInForce::add_length(bool control_adds_length) {
  tool.control_adds_length = control_adds_length;
  Machine counted = machine_;
  counted.output_point = control_adds_length ? OutputPoint::tip : OutputPoint::spindle;
  offset = words_of(counted, JointVector(), tool.vector());
}

bool WordsInForce::enter(const nc::TiltedPlane& block) {
  plane.reset();
  follows_part = block.on && block.follows_part;
  if (!block.on || follows_part) return false;
  plane = PlaneFrame::of(controller_, block, part_zero_in_words(machine_));
  const auto found = inverse(machine_, {plane->X_PF.p, plane->X_PF.R.col(2)}, rotary);
  plane_q = found.empty() ? rotary : found[0].q;
  return true;
}

BlockEnd WordsInForce::end_at(const JointVector& words) const {
  BlockEnd v;
  v.tcp = tcp && !plane;
  if (v.tcp) v.word_tip_P = tip_of(words);
  v.q = plane          ? joints_of_plane_words(words)
        : follows_part ? joints_of_following_words(words)
        : tcp          ? joints_of_part_words(words)
                       : joints_of(words);
  if (!plane && !shift.is_idle()) v.q = shift.joints(v.q, tcp);
  return v;
}

// They count from where the part's zero has gone.
JointVector WordsInForce::joints_of_following_words(const JointVector& words) const {
  const JointVector q = joints_of(words);
  JointVector turned = q, still = q;
  for (AxisId id = 0; id < axis_words_.count; ++id)
    if (!axis_words_.is_linear(id)) still[id] = 0.0;
  kinematics.solve_linear(Vec3::Zero(), kinematics.sines(turned), turned);
  kinematics.solve_linear(Vec3::Zero(), kinematics.sines(still), still);
  JointVector out = q;
  for (AxisId id = 0; id < axis_words_.count; ++id)
    if (axis_words_.is_linear(id)) out[id] += turned[id] - still[id];
  return out;
}

// Under tool-centre-point control X Y Z are the tip in P.
Vec3 WordsInForce::tip_of(const JointVector& words) const {
  Vec3 tip_P = Vec3::Zero();
  for (AxisId id = 0; id < axis_words_.count; ++id) {
    if (axis_words_.is_linear(id)) tip_P[static_cast<Eigen::Index>(axis_words_.of[id].letter)] = words[id];
  }
  return tip_P;
}

}  // namespace trunnion::post
