#include "path/choice/global_choice.hpp"

#include <algorithm>

#include "path/choice/both_branches.hpp"

namespace trunnion::path {

GlobalChoice::GlobalChoice(const Machine& machine, const ChoiceOptions& options)
    : work_(machine, options), search_(work_), replay_(work_), one_branch_(work_, replay_) {}

void GlobalChoice::start(const JointVector& seed, std::size_t most) {
  const Vec3 axis_P = work_.kinematics.axis_P(work_.kinematics.sines(seed));
  work_.joints.start(seed);
  work_.most_positions = most;
  // The first point may be cut to.
  ChoicePosition begin = work_.joints.seed();
  begin.branch = work_.steps.branch_of(begin, axis_P);
  work_.front.start(begin, axis_P);
  work_.traces.clear();
  search_.start();
  replay_.start({begin, axis_P, 0});
  one_branch_.start();
}

// The inverse of the points from number `from` to `to`; `keep`: for the replay, if it has a place for it.
void GlobalChoice::look_up(std::span<const ChoicePoint> points, std::size_t from, std::size_t to, bool keep) {
  SolvedBlock* const kept = keep ? replay_.block_to_keep() : nullptr;
  work_.block = kept != nullptr ? kept : &own_block_;
  work_.block_from = from;
  work_.solver.look_ahead(points.subspan(from, to - from), *work_.block);
}

// Points that were looked up, many at once; gives the next one, `first` where no such step takes it.
std::size_t GlobalChoice::follow(std::span<const ChoicePoint> points, std::size_t first, std::size_t end,
                                 std::span<ChosenPoint> out) {
  if (search_.leaves_out() || work_.block->known[first - work_.block_from] == 0) return first;
  const std::size_t before = work_.front.before().count;
  if (before == 1) {
    if (!out.empty() && work_.traces.layers() > 0) settle_stretch(points.first(first), out.first(first));
    return one_branch_.follow(points, first, end, out);
  }
  return before == 2 ? follow_both(work_, points, first, end) : first;
}

const ChoicePoint* GlobalChoice::advance(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) {
  const bool looks = work_.solver.looks_ahead();
  std::size_t looked_to = work_.block_from = 0;
  one_branch_.begin_points();
  for (std::size_t i = 0; i < points.size() || one_branch_.is_staying();) {
    if (i == points.size()) {
      i = one_branch_.give_up(i);
      continue;
    }
    const SolvedPose* ahead = nullptr;
    if (looks) {
      if (i < work_.block_from || i >= looked_to) {
        looked_to = std::min(i + PoseSolver::kAhead, points.size());
        look_up(points, i, looked_to, out.empty() && looked_to - i == PoseSolver::kAhead);
      }
      if (const std::size_t next = follow(points, i, looked_to, out); next != i) {
        i = next;
        continue;
      }
      ahead = &work_.solver.ahead(*work_.block, i - work_.block_from);
      if (!search_.leaves_out() && add_both(work_, points[i], *ahead)) {
        ++i;
        continue;
      }
    }
    if (!search_.add(points[i], ahead)) return &points[i];
    ++i;
  }
  return nullptr;
}

std::size_t GlobalChoice::settle() {
  const ChoiceFront::Layer& last = work_.front.before();
  std::size_t best = 0;
  for (std::size_t c = 1; c < last.count; ++c) {
    if (last.at[c].cost < last.at[best].cost) best = c;
  }
  if (search_.least_left_out() < last.at[best].cost && work_.most_positions < kMostPositions)
    return 4 * work_.most_positions;
  end_ = last.at[best];
  replay_.take_picks(best);
  work_.traces = {};
  return 0;
}

// All of it is settled up to the last of these points, where one position is left.
void GlobalChoice::settle_stretch(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) {
  replay_.take_picks(0);
  work_.traces.clear();
  const std::size_t stretch = replay_.picked();
  replay_.replay(points.last(stretch), out.last(stretch));
  Place place = replay_.place();
  place.next = 0;
  replay_.go_to(place);
}

ChosenPoint GlobalChoice::end() const {
  ChosenPoint out;
  work_.joints.put(end_, out);
  return out;
}

const ChoicePoint* GlobalChoice::choose(std::span<const ChoicePoint> points, const JointVector& seed,
                                        std::vector<ChosenPoint>& out) {
  out.resize(points.size());
  const std::span<ChosenPoint> chosen(out);
  for (std::size_t most = kFewPositions; most > 0;) {
    start(seed, most);
    if (const ChoicePoint* lost = advance(points, chosen)) {
      out.clear();
      return lost;
    }
    most = settle();
  }
  // The rest was settled on the way.
  replay(points.last(replay_.picked()), chosen.last(replay_.picked()));
  return nullptr;
}

}  // namespace trunnion::path
