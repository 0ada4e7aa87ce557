// What the positions are that a settled choice picked.
#include <algorithm>
#include <array>
#include <cmath>

#include "path/choice/global_choice.hpp"

namespace trunnion::path {

ChosenPoint GlobalChoice::end() const {
  ChosenPoint out;
  put(end_, out);
  return out;
}

const SolvedPose& GlobalChoice::solved_for_replay(const ChoicePoint& point, std::size_t ahead) {
  if (solver_.looks_ahead() && replayed_->known[ahead] != 0) return solver_.ahead(*replayed_, ahead);
  solver_.solve(point.pose, rotary_count_ == 0 ? 0.0 : place_.position.angle[rotary_count_ - 1], own_);
  return own_;
}

// For the points from the present one on; kept where all before it are.
SolvedBlock* GlobalChoice::fresh_block() {
  if (traces_.layers() != PoseSolver::kAhead * kept_.size() || kept_.size() >= kMostKept) return &own_block_;
  kept_.push_back(std::make_unique<SolvedBlock>());
  return kept_.back().get();
}

// The branches of the next points that were picked.
void GlobalChoice::look_ahead_for_replay(std::span<const ChoicePoint> points) {
  if (place_.next % PoseSolver::kAhead == 0 && place_.next / PoseSolver::kAhead < kept_.size()) {
    replayed_ = kept_[place_.next / PoseSolver::kAhead].get();
    return;
  }
  replayed_ = &replay_block_;
  PoseSolver::Wanted wanted{};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint16_t pick = picks_[place_.next + i];
    const bool of_two = (pick & kPlain) != 0 && (pick & kOfTwo) != 0;
    wanted[i] = static_cast<std::uint8_t>(of_two ? 1 << (pick & 1) : 3);
  }
  solver_.look_ahead(points, replay_block_, &wanted);
}

// Of an axis that may turn for ever the turn follows from the point before.
void GlobalChoice::replay(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) {
  for (std::size_t i = 0; i < points.size();) {
    const std::size_t ahead = i % PoseSolver::kAhead;
    if (ahead == 0 && solver_.looks_ahead())
      look_ahead_for_replay(points.subspan(i, std::min(PoseSolver::kAhead, points.size() - i)));
    const std::size_t most = std::min(PoseSolver::kAhead - ahead, points.size() - i);
    if (const std::size_t plain = replay_plain(points.subspan(i, most), ahead, out.subspan(i, most))) {
      i += plain;
      continue;
    }
    const SolvedPose& solved = solved_for_replay(points[i], ahead);
    Candidate chosen = picked(solved, picks_[place_.next++]);
    chosen.reconfigure = steps_.reconfigures(place_.position, place_.axis_P, chosen, points[i]);
    put(chosen, out[i]);
    place_.position = chosen;
    place_.axis_P = points[i].pose.axis_P;
    ++i;
  }
}

// The points up to the first whose pick is not plain; gives their number. `row`: of the first one. A plain
// pick is that of a point which was looked up.
std::size_t GlobalChoice::replay_plain(std::span<const ChoicePoint> points, std::size_t row,
                                       std::span<ChosenPoint> out) {
  const SolvedBlock& block = *replayed_;
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
      steps_.has_only_turn(k, of->angle[k][row], at[k], next[k]);
      turn += std::abs(next[k] - at[k]);
    }
    const bool goes_on = turn < ChoiceSteps::kSurelyNone && next_branch == branch;
    const bool reconfigure =
        !goes_on &&
        steps_.reconfigures({at, Vec3::Zero(), branch}, i > 0 ? points[i - 1].pose.axis_P : place_.axis_P,
                            {next, Vec3::Zero(), next_branch}, points[i]);
    put(*of, row, next, next_branch, reconfigure, out[i]);
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

// All of it is settled up to the last of these points, where one position is left.
void GlobalChoice::settle_stretch(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) {
  take_picks(0);
  traces_.clear();
  replay(points.last(picks_.size()), out.last(picks_.size()));
  place_.next = 0;
}

}  // namespace trunnion::path
