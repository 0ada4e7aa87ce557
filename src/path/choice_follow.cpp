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
  const SolvedBlock& block = solver_.block();
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
  const SolvedBlock& block = solver_.block();
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
    return true;
  }
  for (std::size_t k = 0; k < 2; ++k) {
    const AxisId id = kinematics_.rotary(k);
    out->q[id] = out->q_leave[id] = out->sines.angle[k] = next.angle[k];
    out->sines.sines.sin[k] = of.sin[k][row];
    out->sines.sines.cos[k] = of.cos[k][row];
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const AxisId id = kinematics_.linear(k);
    out->q[id] = out->q_leave[id] = of.linear[k][row];
  }
  out->branch = next.branch;
  out->singular = false;
  out->reconfigure = at.reconfigure;
  return true;
}

// A step on one branch, to which there is no other but by leaving the part.
bool GlobalChoice::stays(const ChoicePosition& next, double turn, bool rapid, std::size_t row) {
  const Candidate& at = layers_[now_].at[0];
  const double apart = solver_.block().apart[row];
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

}  // namespace trunnion::path
