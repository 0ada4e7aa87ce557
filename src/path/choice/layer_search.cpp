#include "path/choice/layer_search.hpp"

#include <algorithm>

namespace trunnion::path {

void LayerSearch::start() {
  left_out_ = {};
  leaves_out_ = false;
}

void LayerSearch::gather(const ChoicePoint& point) {
  const ChoiceFront::Layer& before = work_.front.before();
  arrivals_.clear();
  places_.clear();
  solved_by_.clear();
  if (solved_->follows_seed) {
    solved_by_.resize(before.count);
    for (std::size_t p = 0; p < before.count; ++p)
      work_.solver.solve(point.pose, before.at[p].angle[rotary_count() - 1], solved_by_[p]);
  }
  for (std::size_t p = 0; p < before.count; ++p) gather_from(point, static_cast<std::uint16_t>(p));
}

// All positions, of every branch and turn; free turns follow the position before.
void LayerSearch::gather_from(const ChoicePoint& point, std::uint16_t predecessor) {
  const Candidate& from = work_.front.before().at[predecessor];
  const SolvedPose& solved = solved_at(predecessor);
  visit_positions(work_, solved, from,
                  [&](std::size_t pick, std::size_t n, const std::array<double, 2>& angle) {
                    arrive(solved, {predecessor, static_cast<std::uint16_t>(pick)}, n, angle);
                    return false;
                  });
  for (std::size_t n = 0; n < solved.rotary.count; ++n) leave_out_turns(point, from, solved, n);
}

void LayerSearch::arrive(const SolvedPose& solved, TracedStep step, std::size_t solution,
                         const std::array<double, 2>& angle) {
  const Candidate& from = work_.front.before().at[step.from];
  const auto is_same = [&](const std::array<double, 2>& other) {
    return work_.steps.same_position(other, angle);
  };
  // Mostly the same are reached from all positions before, in the same order.
  const auto guess =
      places_.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(step.pick, places_.size()));
  const auto same = guess != places_.end() && is_same(*guess)
                        ? guess
                        : std::find_if(places_.begin(), places_.end(), is_same);
  Arrival arrival;
  arrival.angle = angle;
  arrival.step = step;
  arrival.solution = static_cast<std::uint8_t>(solution);
  arrival.place = static_cast<std::size_t>(same - places_.begin());
  if (same == places_.end()) places_.push_back(angle);
  arrival.way = from.cost + work_.steps.cost(from, angle, solved.linear[solution]);
  arrival.preference = work_.steps.centre_preference(angle);
  arrivals_.push_back(arrival);
}

// The cheapest way into each position. A reconfiguration makes none cheaper, and to look for one costs most:
// the ways are tried from the shortest on.
void LayerSearch::keep_cheapest(const ChoicePoint& point) {
  order_.resize(arrivals_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = &arrivals_[i];
  // Of equal ones the first.
  std::sort(order_.begin(), order_.end(), [](const Arrival* a, const Arrival* b) {
    return a->least() < b->least() || (a->least() == b->least() && a < b);
  });
  const ChoiceFront::Layer& before = work_.front.before();
  ChoiceFront::Layer& after = work_.front.after();
  after.count = places_.size();
  after.at.resize(std::max(after.at.size(), after.count));
  for (std::size_t i = 0; i < after.count; ++i) after.at[i].cost = std::numeric_limits<double>::infinity();
  for (const Arrival* arrival : order_) {
    Candidate& slot = after.at[arrival->place];
    if (!(arrival->least() < slot.cost)) continue;
    Candidate reached(solved_at(arrival->step.from), arrival->solution, arrival->angle, arrival->step);
    reached.reconfigure =
        work_.steps.reconfigures(before.at[arrival->step.from], work_.front.axis_P(), reached, point);
    reached.cost = arrival->way + (reached.reconfigure ? kReconfigureSeconds : 0.0) + arrival->preference;
    if (reached.cost < slot.cost) slot = reached;
  }
  if (after.count > work_.most_positions) keep_few();
}

void LayerSearch::keep_few() {
  ChoiceFront::Layer& after = work_.front.after();
  std::stable_sort(after.at.begin(), after.at.begin() + static_cast<std::ptrdiff_t>(after.count),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  for (std::size_t i = work_.most_positions; i < after.count; ++i) {
    const Candidate& c = after.at[i];
    leave_out(c.solution, c, c.cost);
  }
  after.count = work_.most_positions;
}

void LayerSearch::leave_out(std::size_t solution, const ChoicePosition& position, double cost) {
  leaves_out_ = true;
  LeftOut& here = left_here_[solution];
  if (!(cost < here.cost)) return;
  here.cost = cost;
  here.position = position;
}

// Turns that are not looked at are farther away than any step leads without leaving the part.
void LayerSearch::leave_out_turns(const ChoicePoint& point, const Candidate& from, const SolvedPose& solved,
                                  std::size_t solution) {
  const RotarySolution& reached = solved.rotary.at[solution];
  for (std::size_t k = 0; k < rotary_count(); ++k) {
    if (work_.steps.only_turn(k, reached.angle[k], from.angle[k])) continue;
    const Turns turns = work_.steps.turns(k, reached.angle[k], from.angle[k], work_.most_positions / 2);
    if (!turns.left_out()) continue;
    std::array<double, 2> angle = from.angle;  // the other may be nearer than any turn that there is
    angle[k] = turns.nearest_left_out();
    const double cost = from.cost + work_.steps.cost(from, angle, solved.linear[solution]) +
                        (point.rapid ? 0.0 : kReconfigureSeconds);
    leave_out(solution, {reached.angle, solved.linear[solution], reached.branch}, cost);
  }
}

// From what was left out at the point before, to wherever it may be now.
void LayerSearch::follow_left_out(const ChoicePoint& point) {
  if (!leaves_out_) return;
  for (const LeftOut& before : left_out_) {
    if (std::isinf(before.cost)) continue;
    for (std::size_t n = 0; n < solved_->rotary.count; ++n) {
      ChoicePosition position;
      position.angle = solved_->rotary.at[n].angle;
      position.linear = solved_->linear[n];
      position.branch = solved_->rotary.at[n].branch;
      if (solved_->follows_seed) {
        // C stands as it was, and nobody knows how.
        position.angle[rotary_count() - 1] = std::numeric_limits<double>::quiet_NaN();
        position.linear.setConstant(std::numeric_limits<double>::quiet_NaN());
      }
      leave_out(n, position,
                before.cost + work_.steps.least_cost(before.position, position, work_.front.axis_P(), point));
    }
  }
}

bool LayerSearch::add(const ChoicePoint& point, const SolvedPose* ahead) {
  const ChoiceFront::Layer& before = work_.front.before();
  ChoiceFront::Layer& after = work_.front.after();
  solved_ = ahead;
  if (ahead == nullptr || !ahead->known) {
    work_.solver.solve(point.pose, rotary_count() == 0 ? 0.0 : before.at[0].angle[rotary_count() - 1], own_);
    solved_ = &own_;
  }
  left_here_ = {};
  follow_left_out(point);
  gather(point);
  if (arrivals_.empty()) return false;
  if (before.count == 1 && arrivals_.size() == 1 && !leaves_out_) {
    // The only way: what it costs decides nothing.
    Candidate& next = after.at[0];
    next = Candidate(solved_at(0), arrivals_[0].solution, arrivals_[0].angle, arrivals_[0].step);
    next.reconfigure = work_.steps.reconfigures(before.at[0], work_.front.axis_P(), next, point);
    after.count = 1;
  } else {
    keep_cheapest(point);
  }
  left_out_ = left_here_;
  go_on(point);
  return true;
}

void LayerSearch::go_on(const ChoicePoint& point) {
  const ChoiceFront::Layer& after = work_.front.after();
  steps_of_layer_.clear();
  for (std::size_t c = 0; c < after.count; ++c) steps_of_layer_.push_back(after.at[c].step);
  work_.traces.add(steps_of_layer_);
  work_.front.go_on(point.pose.axis_P);
}

}  // namespace trunnion::path
