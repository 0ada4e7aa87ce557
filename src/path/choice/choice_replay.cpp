#include "path/choice/choice_replay.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace trunnion::path {

// Which position each point took on the way to this one of the last.
void ChoiceReplay::take_picks(std::size_t best) {
  picks_.resize(work_.traces.layers());
  for (std::size_t i = picks_.size(); i-- > 0;) {
    if (work_.traces.take_straight()) {
      picks_[i] = static_cast<std::uint16_t>(kPlain | kOfTwo | best);
      continue;
    }
    const StepTraces::Read read = work_.traces.take_last(best);
    const unsigned plain = read.plain ? kPlain | (read.count == 2 ? kOfTwo : 0U) : 0U;
    picks_[i] = static_cast<std::uint16_t>(plain | read.step.pick);
    best = read.step.from;
  }
}

Candidate ChoiceReplay::candidate(const SolvedPose& solved, std::uint16_t pick) const {
  Candidate chosen;
  visit_positions(work_, solved, place_.position,
                  [&](std::size_t at, std::size_t n, const std::array<double, 2>& angle) {
                    if (at != pick) return false;
                    chosen = Candidate(solved, n, angle, {});
                    return true;
                  });
  return chosen;
}

const SolvedPose& ChoiceReplay::solved(const ChoicePoint& point, std::size_t ahead) {
  const std::size_t rotary = work_.steps.rotary_count();
  if (work_.solver.looks_ahead() && block_->known[ahead] != 0) return work_.solver.ahead(*block_, ahead);
  work_.solver.solve(point.pose, rotary == 0 ? 0.0 : place_.position.angle[rotary - 1], own_);
  return own_;
}

// Kept where all before it are.
SolvedBlock* ChoiceReplay::block_to_keep() {
  if (work_.traces.layers() != PoseSolver::kAhead * kept_.size() || kept_.size() >= kMostKept) return nullptr;
  kept_.push_back(std::make_unique<SolvedBlock>());
  return kept_.back().get();
}

// The branches of the next points that were picked.
void ChoiceReplay::look_ahead(std::span<const ChoicePoint> points) {
  if (place_.next % PoseSolver::kAhead == 0 && place_.next / PoseSolver::kAhead < kept_.size()) {
    block_ = kept_[place_.next / PoseSolver::kAhead].get();
    return;
  }
  block_ = &own_block_;
  PoseSolver::Wanted wanted{};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint16_t pick = picks_[place_.next + i];
    const bool of_two = (pick & kPlain) != 0 && (pick & kOfTwo) != 0;
    wanted[i] = static_cast<std::uint8_t>(of_two ? 1 << (pick & 1) : 3);
  }
  work_.solver.look_ahead(points, own_block_, &wanted);
}

// Of an axis that may turn for ever the turn follows from the point before.
void ChoiceReplay::replay(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) {
  for (std::size_t i = 0; i < points.size();) {
    const std::size_t ahead = i % PoseSolver::kAhead;
    if (ahead == 0 && work_.solver.looks_ahead())
      look_ahead(points.subspan(i, std::min(PoseSolver::kAhead, points.size() - i)));
    const std::size_t most = std::min(PoseSolver::kAhead - ahead, points.size() - i);
    if (const std::size_t plain = replay_plain(points.subspan(i, most), ahead, out.subspan(i, most))) {
      i += plain;
      continue;
    }
    const SolvedPose& pose = solved(points[i], ahead);
    Candidate chosen = candidate(pose, picks_[place_.next++]);
    chosen.reconfigure = work_.steps.reconfigures(place_.position, place_.axis_P, chosen, points[i]);
    work_.joints.put(chosen, out[i]);
    place_.position = chosen;
    place_.axis_P = points[i].pose.axis_P;
    ++i;
  }
}

// The points up to the first whose pick is not plain; gives their number. `row`: of the first one. A plain
// pick is that of a point which was looked up.
std::size_t ChoiceReplay::replay_plain(std::span<const ChoicePoint> points, std::size_t row,
                                       std::span<ChosenPoint> out) {
  const SolvedBlock& block = *block_;
  const std::uint16_t* const picks = picks_.data() + place_.next;
  // Numbers and no position: two that were written one by one are not read as a pair as fast.
  std::array<double, 2> at = place_.position.angle;
  std::uint8_t branch = place_.position.branch;
  const SolvedBlock::Branch* of = nullptr;
  std::size_t i = 0;
  for (; i < points.size() && (picks[i] & kPlain) != 0; ++i, ++row) {
    const bool second = (picks[i] & kOfTwo) != 0 ? (picks[i] & 1U) != 0 : block.branch[0].within[row] == 0;
    of = &block.branch[second ? 1 : 0];
    const std::uint8_t next_branch = second ? 1 : 0;
    std::array<double, 2> next;
    double turn = 0.0;
    // There is one turn.
    for (std::size_t k = 0; k < 2; ++k) {
      work_.steps.has_only_turn(k, of->angle[k][row], at[k], next[k]);
      turn += std::abs(next[k] - at[k]);
    }
    const bool goes_on = turn < ChoiceSteps::kSurelyNone && next_branch == branch;
    const bool reconfigure =
        !goes_on && work_.steps.reconfigures({at, Vec3::Zero(), branch},
                                             i > 0 ? points[i - 1].pose.axis_P : place_.axis_P,
                                             {next, Vec3::Zero(), next_branch}, points[i]);
    work_.joints.put(*of, row, next, next_branch, out[i]);
    out[i].reconfigure = reconfigure;
    at = next;
    branch = next_branch;
  }
  if (i == 0) return i;
  const std::size_t last = row - 1;
  place_ = {{at, {of->linear[0][last], of->linear[1][last], of->linear[2][last]}, branch},
            points[i - 1].pose.axis_P,
            place_.next + i};
  return i;
}

}  // namespace trunnion::path
