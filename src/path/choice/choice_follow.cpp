// Runs of points that one position reaches: nearly all of a program.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "path/choice/global_choice.hpp"

namespace trunnion::path {

// To leave the part and to come back costs two reconfigurations, 120 s. Less than this is the shorter way,
// whatever else may be preferred.
constexpr double kSurelyShorter_s = 1.5 * kReconfigureSeconds;

std::size_t GlobalChoice::follow(std::span<const ChoicePoint> points, std::size_t first, std::size_t end,
                                 std::span<ChosenPoint> out) {
  const SolvedBlock& block = *block_;
  Candidate& reached = layers_[now_].at[0];
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
    return i == first ? begin : ChoicePosition{at, row_of(branch, i - 1 - looked_from_), branch};
  };
  const auto axis_before_P = [&] { return i > first ? points[i - 1].pose.axis_P : axis_before_; };
  for (; i < end; ++i) {
    const std::size_t row = i - looked_from_;
    const bool one = block.branch[0].within[row] != 0;
    const bool both = one && block.branch[1].within[row] != 0;
    if (both && !stay_.on) {
      if (out.empty() || i < may_stay_from_) break;
      stay_ = {true, i, before(), axis_before_P(), solver_.rotary().apart(at[0]), 0.0};
    }
    const std::uint8_t next_branch = both ? branch : one ? std::uint8_t{0} : std::uint8_t{1};
    const SolvedBlock::Branch& of = block.branch[next_branch];
    std::array<double, 2> next{};
    double turn = 0.0;
    bool only = block.known[row] != 0 && of.within[row] != 0;
    for (std::size_t k = 0; only && k < 2; ++k) {
      only = steps_.has_only_turn(k, of.angle[k][row], at[k], next[k]);
      turn += std::abs(next[k] - at[k]);
    }
    if (!only || (stay_.on && !stays(before(), {next, row_of(next_branch, row), next_branch}, turn,
                                     points[i].rapid, row))) {
      if (stay_.on) return give_up_stay(i);
      break;
    }
    const bool goes_on = turn < ChoiceSteps::kSurelyNone && next_branch == branch;
    reconfigure = !goes_on && steps_.reconfigures(before(), axis_before_P(),
                                                  {next, Vec3::Zero(), next_branch}, points[i]);
    if (out.empty()) {
      traces_.add_one();
    } else {
      put(of, row, next, next_branch, reconfigure, out[i]);
    }
    at = next;
    branch = next_branch;
    if (!both) stay_.on = false;
  }
  if (i == first) return i;
  const ChoicePosition last = before();
  go_to_only(last, points[i - 1].pose.axis_P);
  reached.reconfigure = reconfigure;
  const SolvedBlock::Branch& of = block.branch[branch];
  const std::size_t row = i - 1 - looked_from_;
  reached.sines = {{of.sin[0][row], of.sin[1][row]}, {of.cos[0][row], of.cos[1][row]}};
  if (!out.empty()) place_ = {last, axis_before_, 0};
  return i;
}

// The present layer has this position, and what it took to come there decides nothing.
void GlobalChoice::go_to_only(const ChoicePosition& position, const Vec3& axis_P) {
  Candidate& at = layers_[now_].at[0];
  at = {};
  static_cast<ChoicePosition&>(at) = position;
  axis_before_ = axis_P;
}

void GlobalChoice::put(const SolvedBlock::Branch& of, std::size_t row, const std::array<double, 2>& angle,
                       std::uint8_t branch, bool reconfigure, ChosenPoint& out) const {
  for (std::size_t k = 0; k < 2; ++k) {
    const AxisId id = kinematics_.rotary(k);
    out.q[id] = out.q_leave[id] = out.sines.angle[k] = angle[k];
    out.sines.sines.sin[k] = of.sin[k][row];
    out.sines.sines.cos[k] = of.cos[k][row];
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const AxisId id = kinematics_.linear(k);
    out.q[id] = out.q_leave[id] = of.linear[k][row];
  }
  out.branch = branch;
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

// No turn makes up for more: one of them was come to by leaving the part.
constexpr double kMostOfTurns_s = 5.0;
constexpr double kRounding_s = 1e-9;  // of the sums

bool too_far_apart(const Lanes& cost) {
  return std::abs(cost[0] - cost[1]) > kMostOfTurns_s;
}

// Each branch is reached from itself at this cost, not from the other one.
bool each_from_itself(const Lanes& cost, const Lanes& least_from_other) {
  return !lanes::any(LaneMask(least_from_other <= cost + kRounding_s));
}

// A step to the poses of this row; false where it is none of each branch from itself.
bool goes_straight_on(const ChoiceSteps& steps, const SolvedBlock& block, std::size_t row, SideBySide& at) {
  const SolvedBlock::Branch& a = block.branch[0];
  const SolvedBlock::Branch& b = block.branch[1];
  if (block.known[row] == 0 || a.within[row] == 0 || b.within[row] == 0 || too_far_apart(at.cost))
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
  if (lanes::any(LaneMask(turn >= ChoiceSteps::kSurelyNone)) || !each_from_itself(next.cost, from_other))
    return false;
  at = next;
  return true;
}

template <class T>
lanes::Mask<T> not_zero(const std::int64_t* from) {
  lanes::Mask<T> out;
  std::memcpy(&out, from, sizeof(out));
  return out != 0;
}

// The positions of one branch in a few rows, and those before them.
template <class T>
struct RowsOf {
  std::array<T, 2> angle, before;
  lanes::Triple<T> linear, linear_before;
  lanes::Mask<T> plain;  // by small turns of the axes

  // `lane`: of the branch in `at`, the position before the first row.
  RowsOf(const ChoiceSteps& steps, const SolvedBlock::Branch& of, std::size_t row, const SideBySide& at,
         int lane) {
    plain = not_zero<T>(of.within.data() + row);
    T turn{};
    for (std::size_t k = 0; k < 2; ++k) {
      const double* const solved = of.angle[k].data() + row;
      angle[k] = lanes::load<T>(solved);
      before[k] = lanes::load<T>(solved - 1);
      if (steps.limited(k)) {
        plain &= steps.only_within_limits(k, angle[k]);
      } else {
        // Where they go on the same whole turn; else there is a large one.
        const double turns = kTwoPi * lanes::nearest((at.angle[k][lane] - *solved) * (1.0 / kTwoPi));
        angle[k] = angle[k] + turns;
        before[k] = before[k] + turns;
      }
      turn += lanes::abs(T(angle[k] - before[k]));
    }
    plain &= turn < ChoiceSteps::kSurelyNone;
    const auto linears = [&](std::size_t r) {
      return lanes::Triple<T>{lanes::load<T>(of.linear[0].data() + r),
                              lanes::load<T>(of.linear[1].data() + r),
                              lanes::load<T>(of.linear[2].data() + r)};
    };
    linear = linears(row);
    linear_before = linears(row - 1);
  }
};

// The same a few rows at a time, from `row` on; `at` is the position of the row before. Gives the first row
// that was not gone to.
template <class T>
std::size_t go_straight_on(const ChoiceSteps& steps, const SolvedBlock& block, std::size_t row,
                           std::size_t end, SideBySide& at) {
  constexpr std::size_t kRows = lanes::kCount<T>;
  for (; row + kRows <= end; row += kRows) {
    const std::array<RowsOf<T>, 2> rows = {RowsOf<T>(steps, block.branch[0], row, at, 0),
                                           RowsOf<T>(steps, block.branch[1], row, at, 1)};
    const lanes::Mask<T> known = not_zero<T>(block.known.data() + row);
    if (lanes::any(lanes::Mask<T>(~(known & rows[0].plain & rows[1].plain)))) return row;
    std::array<T, 2> step, preference, from_other;
    for (std::size_t n = 0; n < 2; ++n) {
      const RowsOf<T>& of = rows[n];
      step[n] = steps.cost<T, T>(of.before, of.linear_before, of.angle, of.linear);
      preference[n] = steps.centre_preference(of.angle);
      from_other[n] = steps.least_turn(rows[1 - n].before, of.angle);
    }
    Lanes cost = at.cost;
    for (int i = 0; i < static_cast<int>(kRows); ++i) {
      const Lanes next = cost + Lanes{step[0][i], step[1][i]} + Lanes{preference[0][i], preference[1][i]};
      const Lanes other = Lanes{cost[1], cost[0]} + Lanes{from_other[0][i], from_other[1][i]};
      if (too_far_apart(cost) || !each_from_itself(next, other)) return row;
      cost = next;
    }
    at.cost = cost;
    constexpr int kLast = static_cast<int>(kRows) - 1;
    const auto last = [&](const auto& of) { return Lanes{of(rows[0])[kLast], of(rows[1])[kLast]}; };
    for (std::size_t k = 0; k < 2; ++k) at.angle[k] = last([&](const RowsOf<T>& of) { return of.angle[k]; });
    at.linear = lanes::Triple<Lanes>{last([](const RowsOf<T>& of) { return of.linear.x; }),
                                     last([](const RowsOf<T>& of) { return of.linear.y; }),
                                     last([](const RowsOf<T>& of) { return of.linear.z; })};
  }
  return row;
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
  while (i < end && goes_straight_on(steps_, *block_, i - looked_from_, both)) {
    std::size_t row = i + 1 - looked_from_;
    lanes::at_a_time(
        four_, [&]<class T>() { row = go_straight_on<T>(steps_, *block_, row, end - looked_from_, both); });
    i = looked_from_ + row;
  }
  if (i == first) return i;
  traces_.add_straight(i - first);
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
