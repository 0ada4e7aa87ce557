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
  Candidate& at = layers_[now_].at[0];
  std::size_t i = first;
  for (; i < end; ++i) {
    const std::size_t row = i - looked_from_;
    const bool both = block.branch[0].within[row] != 0 && block.branch[1].within[row] != 0;
    if (both && !stay_.on) {
      if (out.empty() || i < may_stay_from_) break;
      stay_ = {true, i, at, axis_before_, solver_.rotary().apart(at.angle[0]), 0.0};
    }
    if (!follow_one(points[i], row, both, out.empty() ? nullptr : &out[i])) {
      if (stay_.on) return give_up_stay(i);
      break;
    }
    if (!both) stay_.on = false;
  }
  if (i == first) return i;
  const std::size_t last = i - 1 - looked_from_;
  const SolvedBlock::Branch& of = block.branch[at.branch];
  at.sines = {{of.sin[0][last], of.sin[1][last]}, {of.cos[0][last], of.cos[1][last]}};
  at.cost = 0.0;
  at.singular = false;
  if (!out.empty()) place_ = {at, axis_before_, 0};
  return i;
}

bool GlobalChoice::follow_one(const ChoicePoint& point, std::size_t row, bool both, ChosenPoint* out) {
  const SolvedBlock& block = *block_;
  Candidate& at = layers_[now_].at[0];
  const std::size_t branch = both ? at.branch : block.branch[0].within[row] != 0 ? 0 : 1;
  const SolvedBlock::Branch& of = block.branch[branch];
  if (block.known[row] == 0 || of.within[row] == 0) return false;
  ChoicePosition next;
  next.branch = static_cast<std::uint8_t>(branch);
  next.linear = {of.linear[0][row], of.linear[1][row], of.linear[2][row]};
  double turn = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    if (!steps_.has_only_turn(k, of.angle[k][row], at.angle[k], next.angle[k])) return false;
    turn += std::abs(next.angle[k] - at.angle[k]);
  }
  if (stay_.on && !stays(next, turn, point.rapid, row)) return false;
  const bool goes_on = turn < ChoiceSteps::kSurelyNone && next.branch == at.branch;
  at.reconfigure = !goes_on && steps_.reconfigures(at, axis_before_, next, point);
  static_cast<ChoicePosition&>(at) = next;
  axis_before_ = point.pose.axis_P;
  if (out == nullptr) {
    traces_.add_one();
  } else {
    put(of, row, next, at.reconfigure, *out);
  }
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
bool GlobalChoice::stays(const ChoicePosition& next, double turn, bool rapid, std::size_t row) {
  const Candidate& at = layers_[now_].at[0];
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
  layers_[now_].at[0] = stay_.before;
  axis_before_ = stay_.axis_before_P;
  place_ = {stay_.before, stay_.axis_before_P, 0};
  return stay_.begin;
}

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
  while (i < end && follow_both_one(i - looked_from_, both)) ++i;
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

bool GlobalChoice::follow_both_one(std::size_t row, SideBySide& at) {
  const SolvedBlock& block = *block_;
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
    if (!steps_.only_turns(k, angle, at.angle[k], next.angle[k])) return false;
    turn += lanes::abs(Lanes(next.angle[k] - at.angle[k]));
    other[k] = Lanes{at.angle[k][1], at.angle[k][0]};
  }
  const auto linear = [&](std::size_t k) { return Lanes{a.linear[k][row], b.linear[k][row]}; };
  next.linear = lanes::Triple<Lanes>{linear(0), linear(1), linear(2)};
  next.cost = at.cost + steps_.cost<Lanes, Lanes>(at.angle, at.linear, next.angle, next.linear) +
              steps_.centre_preference(next.angle);
  const Lanes from_other = Lanes{at.cost[1], at.cost[0]} + steps_.least_turn(other, next.angle);
  constexpr double kRounding = 1e-9;  // of the sums, s
  if (lanes::any(LaneMask((turn >= ChoiceSteps::kSurelyNone) | (from_other <= next.cost + kRounding))))
    return false;
  at = next;
  traces_.add_two(0, 1);
  return true;
}

}  // namespace trunnion::path
