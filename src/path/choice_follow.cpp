// Runs of points that one position reaches: nearly all of a program.
#include <algorithm>
#include <cmath>

#include "path/global_choice.hpp"

namespace trunnion::path {

// To leave the part and to come back costs two reconfigurations, 120 s. Less than this is the shorter way,
// whatever else may be preferred.
constexpr double kSurelyShorter_s = 1.5 * kReconfigureSeconds;

std::size_t GlobalChoice::follow(std::span<const ChoicePoint> points, std::size_t first, std::size_t end,
                                 std::span<ChosenPoint> out) {
  const SolvedBlock& block = *block_;
  Candidate& reached = layers_[now_].at[0];
  ChoicePosition at = reached;
  bool reconfigure = false;
  std::size_t i = first;
  const auto axis_before_P = [&] { return i > first ? points[i - 1].pose.axis_P : axis_before_; };
  for (; i < end; ++i) {
    const std::size_t row = i - looked_from_;
    const bool one = block.branch[0].within[row] != 0;
    const bool both = one && block.branch[1].within[row] != 0;
    if (both && !stay_.on) {
      if (out.empty() || i < may_stay_from_) break;
      stay_ = {true, i, at, axis_before_P(), solver_.rotary().apart(at.angle[0]), 0.0};
    }
    ChoicePosition next;
    next.branch = both ? at.branch : one ? std::uint8_t{0} : std::uint8_t{1};
    const SolvedBlock::Branch& of = block.branch[next.branch];
    double turn = 0.0;
    if (block.known[row] == 0 || of.within[row] == 0 || !only_position(of, row, at, next, turn) ||
        (stay_.on && !stays(at, next, turn, points[i].rapid, row))) {
      if (stay_.on) return give_up_stay(i);
      break;
    }
    const bool goes_on = turn < ChoiceSteps::kSurelyNone && next.branch == at.branch;
    reconfigure = !goes_on && steps_.reconfigures(at, axis_before_P(), next, points[i]);
    if (out.empty()) {
      traces_.add_one();
    } else {
      put(of, row, next, reconfigure, out[i]);
    }
    at = next;
    if (!both) stay_.on = false;
  }
  if (i == first) return i;
  go_to_only(at, points[i - 1].pose.axis_P);
  reached.reconfigure = reconfigure;
  const SolvedBlock::Branch& of = block.branch[at.branch];
  const std::size_t last = i - 1 - looked_from_;
  reached.sines = {{of.sin[0][last], of.sin[1][last]}, {of.cos[0][last], of.cos[1][last]}};
  if (!out.empty()) place_ = {at, axis_before_, 0};
  return i;
}

// The present layer has this position, and what it took to come there decides nothing.
void GlobalChoice::go_to_only(const ChoicePosition& position, const Vec3& axis_P) {
  Candidate& at = layers_[now_].at[0];
  at = {};
  static_cast<ChoicePosition&>(at) = position;
  axis_before_ = axis_P;
}

// Where the pose of this row is reached from `at` in one turn of each axis only; `turn`: of both, rad.
bool GlobalChoice::only_position(const SolvedBlock::Branch& of, std::size_t row, const ChoicePosition& at,
                                 ChoicePosition& next, double& turn) const {
  for (std::size_t k = 0; k < 2; ++k) {
    if (!steps_.has_only_turn(k, of.angle[k][row], at.angle[k], next.angle[k])) return false;
    turn += std::abs(next.angle[k] - at.angle[k]);
  }
  next.linear = {of.linear[0][row], of.linear[1][row], of.linear[2][row]};
  return true;
}

void GlobalChoice::put(const SolvedBlock::Branch& of, std::size_t row, const ChoicePosition& position,
                       bool reconfigure, ChosenPoint& out) const {
  for (std::size_t k = 0; k < 2; ++k) {
    const AxisId id = kinematics_.rotary(k);
    out.q[id] = out.q_leave[id] = out.sines.angle[k] = position.angle[k];
    out.sines.sines.sin[k] = of.sin[k][row];
    out.sines.sines.cos[k] = of.cos[k][row];
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const AxisId id = kinematics_.linear(k);
    out.q[id] = out.q_leave[id] = of.linear[k][row];
  }
  out.branch = position.branch;
  out.singular = false;
  out.reconfigure = reconfigure;
}

// A step on one branch, to which there is no other but by leaving the part.
bool GlobalChoice::stays(const ChoicePosition& at, const ChoicePosition& next, double turn, bool rapid,
                         std::size_t row) {
  const double apart = block_->apart[row];
  if (rapid || next.branch != at.branch || turn >= ChoiceSteps::kSurelyNone ||
      !steps_.parts(std::min(apart, stay_.apart), turn))
    return false;
  stay_.apart = apart;
  stay_.seconds += steps_.cost(at, next.angle, next.linear);
  return stay_.seconds < kSurelyShorter_s;
}

// Back to where it began; gives that point. It did not do up to point `at`.
std::size_t GlobalChoice::give_up_stay(std::size_t at) {
  stay_.on = false;
  may_stay_from_ = at + 1;
  go_to_only(stay_.before, stay_.axis_before_P);
  place_ = {stay_.before, stay_.axis_before_P, 0};
  return stay_.begin;
}

namespace {

// Positions on both branches.
struct SideBySide {
  std::array<Lanes, 2> angle;
  lanes::Triple<Lanes> linear;
  Lanes cost;
};

// A step to the poses of this row; false where it is none of each branch from itself.
bool goes_straight_on(const ChoiceSteps& steps, const SolvedBlock& block, std::size_t row, SideBySide& at) {
  const SolvedBlock::Branch& a = block.branch[0];
  const SolvedBlock::Branch& b = block.branch[1];
  // No turn makes up for more: one of them was come to by leaving the part.
  constexpr double kMostOfTurns_s = 5.0;
  if (block.known[row] == 0 || a.within[row] == 0 || b.within[row] == 0 ||
      std::abs(at.cost[0] - at.cost[1]) > kMostOfTurns_s)
    return false;
  SideBySide next;
  std::array<Lanes, 2> other;
  Lanes turn{};
  for (std::size_t k = 0; k < 2; ++k) {
    const Lanes angle = {a.angle[k][row], b.angle[k][row]};
    if (!steps.only_turns(k, angle, at.angle[k], next.angle[k])) return false;
    turn += lanes::abs(Lanes(next.angle[k] - at.angle[k]));
    other[k] = Lanes{at.angle[k][1], at.angle[k][0]};
  }
  const auto linear = [&](std::size_t k) { return Lanes{a.linear[k][row], b.linear[k][row]}; };
  next.linear = lanes::Triple<Lanes>{linear(0), linear(1), linear(2)};
  next.cost = at.cost + steps.cost<Lanes, Lanes>(at.angle, at.linear, next.angle, next.linear) +
              steps.centre_preference(next.angle);
  const Lanes from_other = Lanes{at.cost[1], at.cost[0]} + steps.least_turn(other, next.angle);
  constexpr double kRounding = 1e-9;  // of the sums, s
  if (lanes::any(LaneMask((turn >= ChoiceSteps::kSurelyNone) | (from_other <= next.cost + kRounding))))
    return false;
  at = next;
  return true;
}

}  // namespace

std::size_t GlobalChoice::follow_both(std::span<const ChoicePoint> points, std::size_t first,
                                      std::size_t end) {
  Candidate& a = layers_[now_].at[0];
  Candidate& b = layers_[now_].at[1];
  if (a.branch != 0 || b.branch != 1) return first;
  SideBySide both;
  for (std::size_t k = 0; k < 2; ++k) both.angle[k] = Lanes{a.angle[k], b.angle[k]};
  const auto linear = [&](Eigen::Index k) { return Lanes{a.linear[k], b.linear[k]}; };
  both.linear = lanes::Triple<Lanes>{linear(0), linear(1), linear(2)};
  both.cost = Lanes{a.cost, b.cost};
  std::size_t i = first;
  for (; i < end && goes_straight_on(steps_, *block_, i - looked_from_, both); ++i) traces_.add_two(0, 1);
  if (i == first) return i;
  const std::size_t last = i - 1 - looked_from_;
  for (std::size_t n = 0; n < 2; ++n) {
    const int lane = static_cast<int>(n);
    const SolvedBlock::Branch& of = block_->branch[n];
    Candidate& c = layers_[now_].at[n];
    c.angle = {both.angle[0][lane], both.angle[1][lane]};
    c.linear = {both.linear.x[lane], both.linear.y[lane], both.linear.z[lane]};
    c.sines = {{of.sin[0][last], of.sin[1][last]}, {of.cos[0][last], of.cos[1][last]}};
    c.solution = static_cast<std::uint8_t>(n);
    c.singular = c.reconfigure = false;
    c.cost = both.cost[lane];
  }
  axis_before_ = points[i - 1].pose.axis_P;
  return i;
}

}  // namespace trunnion::path
