// What the positions are that a settled choice picked.
#include <algorithm>
#include <array>

#include "path/global_choice.hpp"

namespace trunnion::path {

ChosenPoint GlobalChoice::end() const {
  ChosenPoint out;
  put(end_, out);
  return out;
}

const SolvedPose& GlobalChoice::solved_for_replay(const ChoicePoint& point, std::size_t ahead) {
  if (replay_solver_.looks_ahead() && replay_solver_.block().known[ahead] != 0)
    return replay_solver_.ahead(ahead);
  solver_.solve(point.pose, rotary_count_ == 0 ? 0.0 : place_.position.angle[rotary_count_ - 1], own_);
  return own_;
}

// The branches of the next points that were picked.
void GlobalChoice::look_ahead_for_replay(std::span<const ChoicePoint> points) {
  std::array<std::uint8_t, PoseSolver::kAhead> wanted{};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint16_t pick = picks_[place_.next + i];
    const bool of_two = (pick & kPlain) != 0 && (pick & kOfTwo) != 0;
    wanted[i] = static_cast<std::uint8_t>(of_two ? 1 << (pick & 1) : 3);
  }
  replay_solver_.look_ahead(points, std::span(wanted).first(points.size()));
}

// Of an axis that may turn for ever the turn follows from the point before.
void GlobalChoice::replay(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t ahead = i % PoseSolver::kAhead;
    if (ahead == 0 && replay_solver_.looks_ahead())
      look_ahead_for_replay(points.subspan(i, std::min(PoseSolver::kAhead, points.size() - i)));
    const std::uint16_t pick = picks_[place_.next++];
    const SolvedPose& solved = solved_for_replay(points[i], ahead);
    Candidate chosen = picked(solved, pick);
    chosen.reconfigure = steps_.reconfigures(place_.position, place_.axis_P, chosen, points[i]);
    put(chosen, out[i]);
    place_.position = chosen;
    place_.axis_P = points[i].pose.axis_P;
  }
}

// All of it is settled up to the last of these points, where one position is left.
void GlobalChoice::settle_stretch(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) {
  take_picks(0);
  traces_.clear();
  replay(points.last(picks_.size()), out.last(picks_.size()));
  place_.next = 0;
}

}  // namespace trunnion::path
