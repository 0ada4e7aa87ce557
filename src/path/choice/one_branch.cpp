#include "path/choice/one_branch.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::path {

namespace {

// To leave the part and to come back costs two reconfigurations, 120 s. Less than this is the shorter way,
// whatever else may be preferred.
constexpr double kSurelyShorter_s = 1.5 * kReconfigureSeconds;

}  // namespace

std::size_t OneBranch::follow(std::span<const ChoicePoint> points, std::size_t first, std::size_t end,
                              std::span<ChosenPoint> out) {
  const SolvedBlock& block = *work_.block;
  Candidate& reached = work_.front.before().at[0];
  const ChoicePosition begin = reached;
  // Numbers and no position, as in `replay_plain`.
  std::array<double, 2> at = begin.angle;
  std::uint8_t branch = begin.branch;
  bool reconfigure = false;
  std::size_t i = first;
  const auto row_of = [&](std::size_t of_branch, std::size_t row) -> Vec3 {
    const auto& linear = block.branch[of_branch].linear;
    return {linear[0][row], linear[1][row], linear[2][row]};
  };
  const auto before = [&]() -> ChoicePosition {
    return i == first ? begin : ChoicePosition{at, row_of(branch, i - 1 - work_.block_from), branch};
  };
  const auto axis_before_P = [&] { return i > first ? points[i - 1].pose.axis_P : work_.front.axis_P(); };
  for (; i < end; ++i) {
    const std::size_t row = i - work_.block_from;
    const bool one = block.branch[0].within[row] != 0;
    const bool both = one && block.branch[1].within[row] != 0;
    if (both && !stay_.on) {
      if (out.empty() || i < may_stay_from_) break;
      stay_ = {true, i, before(), axis_before_P(), work_.solver.rotary().apart(at[0]), 0.0};
    }
    const std::uint8_t next_branch = both ? branch : one ? std::uint8_t{0} : std::uint8_t{1};
    const SolvedBlock::Branch& of = block.branch[next_branch];
    std::array<double, 2> next{};
    double turn = 0.0;
    bool only = block.known[row] != 0 && of.within[row] != 0;
    for (std::size_t k = 0; only && k < 2; ++k) {
      only = work_.steps.has_only_turn(k, of.angle[k][row], at[k], next[k]);
      turn += std::abs(next[k] - at[k]);
    }
    if (!only || (stay_.on && !stays(before(), {next, row_of(next_branch, row), next_branch}, turn,
                                     points[i].rapid, row))) {
      if (stay_.on) return give_up(i);
      break;
    }
    const bool goes_on = turn < ChoiceSteps::kSurelyNone && next_branch == branch;
    reconfigure = !goes_on && work_.steps.reconfigures(before(), axis_before_P(),
                                                       {next, Vec3::Zero(), next_branch}, points[i]);
    if (out.empty()) {
      work_.traces.add_one();
    } else {
      work_.joints.put(of, row, next, next_branch, out[i]);
      out[i].reconfigure = reconfigure;
    }
    at = next;
    branch = next_branch;
    if (!both) stay_.on = false;
  }
  if (i == first) return i;
  const ChoicePosition last = before();
  work_.front.go_to_only(last, points[i - 1].pose.axis_P);
  reached.reconfigure = reconfigure;
  const SolvedBlock::Branch& of = block.branch[branch];
  const std::size_t row = i - 1 - work_.block_from;
  reached.sines = {{of.sin[0][row], of.sin[1][row]}, {of.cos[0][row], of.cos[1][row]}};
  if (!out.empty()) replay_.go_to({last, work_.front.axis_P(), 0});
  return i;
}

// A step on one branch, to which there is no other but by leaving the part.
bool OneBranch::stays(const ChoicePosition& at, const ChoicePosition& next, double turn, bool rapid,
                      std::size_t row) {
  const double apart = work_.block->apart[row];
  if (rapid || next.branch != at.branch || turn >= ChoiceSteps::kSurelyNone ||
      !work_.steps.parts(std::min(apart, stay_.apart), turn))
    return false;
  stay_.apart = apart;
  stay_.seconds += work_.steps.cost(at, next.angle, next.linear);
  return stay_.seconds < kSurelyShorter_s;
}

// Back to where it began; gives that point. It did not do up to point `at`.
std::size_t OneBranch::give_up(std::size_t at) {
  stay_.on = false;
  may_stay_from_ = at + 1;
  work_.front.go_to_only(stay_.before, stay_.axis_before_P);
  replay_.go_to({stay_.before, stay_.axis_before_P, 0});
  return stay_.begin;
}

}  // namespace trunnion::path
