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
  if (solver_.looks_ahead() && solver_.ahead(ahead).known) return solver_.ahead(ahead);
  solver_.solve(point.pose, rotary_count_ == 0 ? 0.0 : place_.position.angle[rotary_count_ - 1], own_);
  return own_;
}

// The branches of the next points that were picked.
void GlobalChoice::look_ahead_for_replay(std::span<const ChoicePoint> points) {
  std::array<std::uint8_t, PoseSolver::kAhead> wanted{};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint16_t pick = picks_[place_.next - 1 + i];
    const bool of_two = (pick & kPlain) != 0 && (pick & kOfTwo) != 0;
    wanted[i] = static_cast<std::uint8_t>(of_two ? 1 << (pick & 1) : 3);
  }
  solver_.look_ahead(points, std::span(wanted).first(points.size()));
}

// Of an axis that may turn for ever the turn follows from the point before.
void GlobalChoice::replay(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) {
  std::size_t looked_up = 0;  // points before this one
  std::size_t first = 0;
  bool left_behind = false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint16_t pick = picks_[place_.next++];
    if (pick == kAlreadyPut) {
      left_behind = true;
      continue;
    }
    if (left_behind) {
      place_.position.angle = out[i - 1].sines.angle;
      place_.position.branch = out[i - 1].branch;
      place_.axis_P = points[i - 1].pose.axis_P;
      left_behind = false;
    }
    if (i >= looked_up && solver_.looks_ahead()) {
      first = i;
      const auto here = picks_.begin() + static_cast<std::ptrdiff_t>(place_.next - 1);
      const auto most = static_cast<std::ptrdiff_t>(std::min(points.size() - i, PoseSolver::kAhead));
      const auto run = std::find(here, here + most, kAlreadyPut) - here;
      looked_up = i + static_cast<std::size_t>(run);
      look_ahead_for_replay(points.subspan(i, looked_up - i));
    }
    const SolvedPose& solved = solved_for_replay(points[i], i - first);
    Candidate chosen = picked(solved, pick);
    chosen.reconfigure = steps_.reconfigures(place_.position, place_.axis_P, chosen, points[i]);
    put(chosen, out[i]);
    place_.position = chosen;
    place_.axis_P = points[i].pose.axis_P;
  }
}

}  // namespace trunnion::path
