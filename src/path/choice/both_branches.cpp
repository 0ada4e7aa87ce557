#include "path/choice/both_branches.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace trunnion::path {

// The two branches lie side by side.
bool add_both(ChoiceInWork& work, const ChoicePoint& point, const SolvedPose& solved) {
  const ChoiceFront::Layer& before = work.front.before();
  const ChoiceSteps& steps = work.steps;
  if (!solved.known || solved.rotary.count != 2 || before.count > 2) return false;
  std::array<std::array<Lanes, 2>, 2> angle;  // [position before][axis]
  const RotarySolution& one = solved.rotary.at[0];
  const RotarySolution& two = solved.rotary.at[1];
  for (std::size_t p = 0; p < before.count; ++p) {
    for (std::size_t k = 0; k < 2; ++k) {
      const Lanes both = {one.angle[k], two.angle[k]};
      if (!steps.only_turns(k, both, lanes::splat<Lanes>(before.at[p].angle[k]), angle[p][k])) return false;
    }
  }
  const double apart = std::abs(angle[0][0][1] - angle[0][0][0]);
  constexpr double kSurelyApart = 1e-6;
  if (!(apart > kSurelyApart && apart < kPi) &&
      steps.same_position({angle[0][0][0], angle[0][1][0]}, {angle[0][0][1], angle[0][1][1]}))
    return false;
  const Vec3& a = solved.linear[0];
  const Vec3& b = solved.linear[1];
  const lanes::Triple<Lanes> linear = {{a.x(), b.x()}, {a.y(), b.y()}, {a.z(), b.z()}};
  std::array<Lanes, 2> least;
  for (std::size_t p = 0; p < before.count; ++p)
    least[p] =
        before.at[p].cost + steps.cost(before.at[p], angle[p], linear) + steps.centre_preference(angle[p]);
  ChoiceFront::Layer& after = work.front.after();
  after.count = 2;
  std::array<std::uint16_t, 2> came_from;
  for (std::size_t n = 0; n < 2; ++n) {
    const int lane = static_cast<int>(n);
    Candidate& next = after.at[n];
    next.linear = solved.linear[n];
    next.sines = solved.sines[n];
    next.branch = solved.rotary.at[n].branch;
    next.solution = static_cast<std::uint8_t>(n);
    next.singular = false;
    // The shorter way; the other one too where the tool would have to leave the part.
    std::size_t from = before.count == 2 && least[1][lane] < least[0][lane] ? 1 : 0;
    next.angle = {angle[from][0][lane], angle[from][1][lane]};
    next.reconfigure = steps.reconfigures(before.at[from], work.front.axis_P(), next, point);
    next.cost = least[from][lane] + (next.reconfigure ? kReconfigureSeconds : 0.0);
    if (before.count == 2 && least[1 - from][lane] < next.cost) {
      Candidate other = next;
      other.angle = {angle[1 - from][0][lane], angle[1 - from][1][lane]};
      other.reconfigure = steps.reconfigures(before.at[1 - from], work.front.axis_P(), other, point);
      other.cost = least[1 - from][lane] + (other.reconfigure ? kReconfigureSeconds : 0.0);
      if (other.cost < next.cost) {
        next = other;
        from = 1 - from;
      }
    }
    came_from[n] = static_cast<std::uint16_t>(from);
  }
  work.traces.add_two(came_from[0], came_from[1]);
  work.front.go_on(point.pose.axis_P);
  return true;
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

std::size_t follow_both(ChoiceInWork& work, std::span<const ChoicePoint> points, std::size_t first,
                        std::size_t end) {
  Candidate& a = work.front.before().at[0];
  Candidate& b = work.front.before().at[1];
  if (a.branch != 0 || b.branch != 1) return first;
  SideBySide both;
  for (std::size_t k = 0; k < 2; ++k) both.angle[k] = Lanes{a.angle[k], b.angle[k]};
  const auto linear = [&](Eigen::Index k) { return Lanes{a.linear[k], b.linear[k]}; };
  both.linear = lanes::Triple<Lanes>{linear(0), linear(1), linear(2)};
  both.cost = Lanes{a.cost, b.cost};
  std::size_t i = first;
  while (i < end && goes_straight_on(work.steps, *work.block, i - work.block_from, both)) {
    std::size_t row = i + 1 - work.block_from;
    lanes::at_a_time(lanes::way(), [&]<class T>() {
      row = go_straight_on<T>(work.steps, *work.block, row, end - work.block_from, both);
    });
    i = work.block_from + row;
  }
  if (i == first) return i;
  work.traces.add_straight(i - first);
  const std::size_t last = i - 1 - work.block_from;
  for (std::size_t n = 0; n < 2; ++n) {
    const int lane = static_cast<int>(n);
    const SolvedBlock::Branch& of = work.block->branch[n];
    Candidate& c = work.front.before().at[n];
    c.angle = {both.angle[0][lane], both.angle[1][lane]};
    c.linear = {both.linear.x[lane], both.linear.y[lane], both.linear.z[lane]};
    c.sines = {{of.sin[0][last], of.sin[1][last]}, {of.cos[0][last], of.cos[1][last]}};
    c.solution = static_cast<std::uint8_t>(n);
    c.singular = c.reconfigure = false;
    c.cost = both.cost[lane];
  }
  work.front.stay(points[i - 1].pose.axis_P);
  return i;
}

}  // namespace trunnion::path
