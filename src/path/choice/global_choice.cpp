#include "path/choice/global_choice.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::path {

GlobalChoice::GlobalChoice(const Machine& machine, const ChoiceOptions& options)
    : kinematics_(machine, options.tool_mm),
      steps_(machine, kinematics_, options),
      solver_(machine, kinematics_, options.inverse),
      rotary_count_(kinematics_.rotary_count()),
      four_(lanes::four_at_a_time()) {}

void GlobalChoice::start(const JointVector& seed, std::size_t most) {
  seed_ = seed;
  most_ = most;
  axis_before_ = seed_axis_P_ = kinematics_.axis_P(kinematics_.sines(seed));
  traces_.clear();
  kept_.clear();
  left_out_ = {};
  leaves_out_ = false;
  for (Layer& layer : layers_) layer.at.resize(std::max<std::size_t>(2, layer.at.size()));
  Layer& layer = layers_[now_];
  layer.count = 1;
  Candidate& c = layer.at[0];
  c = Candidate{};
  for (std::size_t k = 0; k < rotary_count_; ++k) c.angle[k] = seed[kinematics_.rotary(k)];
  for (std::size_t k = 0; k < 3; ++k) c.linear[static_cast<Eigen::Index>(k)] = seed[kinematics_.linear(k)];
  place_ = {c, seed_axis_P_, 0};
  stay_.on = false;
}

JointVector GlobalChoice::joints(const ChoicePosition& position) const {
  JointVector q = seed_;
  for (std::size_t k = 0; k < rotary_count_; ++k) q[kinematics_.rotary(k)] = position.angle[k];
  for (std::size_t k = 0; k < 3; ++k)
    q[kinematics_.linear(k)] = position.linear[static_cast<Eigen::Index>(k)];
  return q;
}

GlobalChoice::Candidate GlobalChoice::candidate(const SolvedPose& solved, std::size_t solution,
                                                const std::array<double, 2>& angle, TracedStep step) const {
  Candidate c;
  c.angle = angle;
  c.linear = solved.linear[solution];
  c.sines = solved.sines[solution];
  c.branch = solved.rotary.at[solution].branch;
  c.singular = solved.rotary.at[solution].singular;
  c.step = step;
  c.solution = static_cast<std::uint8_t>(solution);
  return c;
}

void GlobalChoice::put(const Candidate& chosen, ChosenPoint& out) const {
  out.q = out.q_leave = joints(chosen);
  out.branch = chosen.branch;
  out.singular = chosen.singular;
  out.reconfigure = chosen.reconfigure;
  out.sines = {chosen.sines, chosen.angle};
}

const ChoicePoint* GlobalChoice::advance(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) {
  const bool looks = solver_.looks_ahead();
  std::size_t looked_to = looked_from_ = may_stay_from_ = 0;
  for (std::size_t i = 0; i < points.size() || stay_.on;) {
    if (i == points.size()) {
      i = give_up_stay(i);
      continue;
    }
    if (looks && (i < looked_from_ || i >= looked_to)) {
      looked_from_ = i;
      looked_to = std::min(i + PoseSolver::kAhead, points.size());
      block_ = out.empty() && looked_to - i == PoseSolver::kAhead ? fresh_block() : &own_block_;
      solver_.look_ahead(points.subspan(i, looked_to - i), *block_);
    }
    if (looks && !leaves_out_ && block_->known[i - looked_from_] != 0) {
      std::size_t end = i;
      if (layers_[now_].count == 1) {
        if (!out.empty() && traces_.layers() > 0) settle_stretch(points.first(i), out.first(i));
        end = follow(points, i, looked_to, out);
      } else if (layers_[now_].count == 2) {
        end = follow_both(points, i, looked_to);
      }
      if (end != i) {
        i = end;
        continue;
      }
    }
    const SolvedPose* ahead = looks ? &solver_.ahead(*block_, i - looked_from_) : nullptr;
    if (!(looks && add_both(points[i], *ahead)) && !add(points[i], ahead)) return &points[i];
    ++i;
  }
  return nullptr;
}

// What `add` does, for what a run at small tilts consists of. The two branches lie side by side.
bool GlobalChoice::add_both(const ChoicePoint& point, const SolvedPose& solved) {
  const Layer& before = layers_[now_];
  if (!solved.known || solved.rotary.count != 2 || before.count > 2 || leaves_out_) return false;
  std::array<std::array<Lanes, 2>, 2> angle;  // [position before][axis]
  const RotarySolution& one = solved.rotary.at[0];
  const RotarySolution& two = solved.rotary.at[1];
  for (std::size_t p = 0; p < before.count; ++p) {
    for (std::size_t k = 0; k < 2; ++k) {
      const Lanes both = {one.angle[k], two.angle[k]};
      if (!steps_.only_turns(k, both, lanes::splat<Lanes>(before.at[p].angle[k]), angle[p][k])) return false;
    }
  }
  const double apart = std::abs(angle[0][0][1] - angle[0][0][0]);
  constexpr double kSurelyApart = 1e-6;
  if (!(apart > kSurelyApart && apart < kPi) &&
      steps_.same_position({angle[0][0][0], angle[0][1][0]}, {angle[0][0][1], angle[0][1][1]}))
    return false;
  const Vec3& a = solved.linear[0];
  const Vec3& b = solved.linear[1];
  const lanes::Triple<Lanes> linear = {{a.x(), b.x()}, {a.y(), b.y()}, {a.z(), b.z()}};
  std::array<Lanes, 2> least;
  for (std::size_t p = 0; p < before.count; ++p)
    least[p] =
        before.at[p].cost + steps_.cost(before.at[p], angle[p], linear) + steps_.centre_preference(angle[p]);
  Layer& after = layers_[1 - now_];
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
    next.reconfigure = steps_.reconfigures(before.at[from], axis_before_, next, point);
    next.cost = least[from][lane] + (next.reconfigure ? kReconfigureSeconds : 0.0);
    if (before.count == 2 && least[1 - from][lane] < next.cost) {
      Candidate other = next;
      other.angle = {angle[1 - from][0][lane], angle[1 - from][1][lane]};
      other.reconfigure = steps_.reconfigures(before.at[1 - from], axis_before_, other, point);
      other.cost = least[1 - from][lane] + (other.reconfigure ? kReconfigureSeconds : 0.0);
      if (other.cost < next.cost) {
        next = other;
        from = 1 - from;
      }
    }
    came_from[n] = static_cast<std::uint16_t>(from);
  }
  traces_.add_two(came_from[0], came_from[1]);
  now_ = 1 - now_;
  axis_before_ = point.pose.axis_P;
  return true;
}

template <class Visit>
void GlobalChoice::visit_positions(const SolvedPose& solved, const ChoicePosition& from,
                                   const Visit& visit) const {
  std::size_t pick = 0;
  for (std::size_t n = 0; n < solved.rotary.count; ++n) {
    const RotarySolution& solution = solved.rotary.at[n];
    std::array<double, 2> angle = solution.angle;
    std::array<std::optional<Turns>, 2> several;
    std::array<std::size_t, 2> counts = {1, 1};
    for (std::size_t k = 0; k < rotary_count_; ++k) {
      if (const auto only = steps_.only_turn(k, solution.angle[k], from.angle[k])) {
        angle[k] = *only;
      } else {
        several[k].emplace(steps_.turns(k, solution.angle[k], from.angle[k], most_ / 2));
        counts[k] = several[k]->count();
      }
    }
    for (std::size_t i = 0; i < counts[0]; ++i) {
      if (several[0]) angle[0] = several[0]->at(i);
      for (std::size_t j = 0; j < counts[1]; ++j) {
        if (several[1]) angle[1] = several[1]->at(j);
        if (visit(pick++, n, angle)) return;
      }
    }
  }
}

void GlobalChoice::gather(const ChoicePoint& point) {
  const Layer& before = layers_[now_];
  arrivals_.clear();
  places_.clear();
  solved_by_.clear();
  if (solved_->follows_seed) {
    solved_by_.resize(before.count);
    for (std::size_t p = 0; p < before.count; ++p)
      solver_.solve(point.pose, before.at[p].angle[rotary_count_ - 1], solved_by_[p]);
  }
  for (std::size_t p = 0; p < before.count; ++p) gather_from(point, static_cast<std::uint16_t>(p));
}

// All positions, of every branch and turn; free turns follow the position before.
void GlobalChoice::gather_from(const ChoicePoint& point, std::uint16_t predecessor) {
  const Candidate& from = layers_[now_].at[predecessor];
  const SolvedPose& solved = solved_at(predecessor);
  visit_positions(solved, from, [&](std::size_t pick, std::size_t n, const std::array<double, 2>& angle) {
    arrive(solved, {predecessor, static_cast<std::uint16_t>(pick)}, n, angle);
    return false;
  });
  for (std::size_t n = 0; n < solved.rotary.count; ++n) leave_out_turns(point, from, solved, n);
}

void GlobalChoice::arrive(const SolvedPose& solved, TracedStep step, std::size_t solution,
                          const std::array<double, 2>& angle) {
  const Candidate& from = layers_[now_].at[step.from];
  const auto is_same = [&](const std::array<double, 2>& other) { return steps_.same_position(other, angle); };
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
  arrival.way = from.cost + steps_.cost(from, angle, solved.linear[solution]);
  arrival.preference = steps_.centre_preference(angle);
  arrivals_.push_back(arrival);
}

// The cheapest way into each position. A reconfiguration makes none cheaper, and to look for one costs most:
// the ways are tried from the shortest on.
void GlobalChoice::keep_cheapest(const ChoicePoint& point) {
  order_.resize(arrivals_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = &arrivals_[i];
  // Of equal ones the first.
  std::sort(order_.begin(), order_.end(), [](const Arrival* a, const Arrival* b) {
    return a->least() < b->least() || (a->least() == b->least() && a < b);
  });
  const Layer& before = layers_[now_];
  Layer& after = layers_[1 - now_];
  after.count = places_.size();
  after.at.resize(std::max(after.at.size(), after.count));
  for (std::size_t i = 0; i < after.count; ++i) after.at[i].cost = std::numeric_limits<double>::infinity();
  for (const Arrival* arrival : order_) {
    Candidate& slot = after.at[arrival->place];
    if (!(arrival->least() < slot.cost)) continue;
    Candidate reached =
        candidate(solved_at(arrival->step.from), arrival->solution, arrival->angle, arrival->step);
    reached.reconfigure = steps_.reconfigures(before.at[arrival->step.from], axis_before_, reached, point);
    reached.cost = arrival->way + (reached.reconfigure ? kReconfigureSeconds : 0.0) + arrival->preference;
    if (reached.cost < slot.cost) slot = reached;
  }
  if (after.count > most_) keep_few();
}

void GlobalChoice::keep_few() {
  Layer& after = layers_[1 - now_];
  std::stable_sort(after.at.begin(), after.at.begin() + static_cast<std::ptrdiff_t>(after.count),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  for (std::size_t i = most_; i < after.count; ++i) {
    const Candidate& c = after.at[i];
    leave_out(c.solution, c, c.cost);
  }
  after.count = most_;
}

void GlobalChoice::leave_out(std::size_t solution, const ChoicePosition& position, double cost) {
  leaves_out_ = true;
  LeftOut& here = left_here_[solution];
  if (!(cost < here.cost)) return;
  here.cost = cost;
  here.position = position;
}

// Turns that are not looked at are farther away than any step leads without leaving the part.
void GlobalChoice::leave_out_turns(const ChoicePoint& point, const Candidate& from, const SolvedPose& solved,
                                   std::size_t solution) {
  const RotarySolution& reached = solved.rotary.at[solution];
  for (std::size_t k = 0; k < rotary_count_; ++k) {
    if (steps_.only_turn(k, reached.angle[k], from.angle[k])) continue;
    const Turns turns = steps_.turns(k, reached.angle[k], from.angle[k], most_ / 2);
    if (!turns.left_out()) continue;
    std::array<double, 2> angle = from.angle;  // the other may be nearer than any turn that there is
    angle[k] = turns.nearest_left_out();
    const double cost = from.cost + steps_.cost(from, angle, solved.linear[solution]) +
                        (point.rapid ? 0.0 : kReconfigureSeconds);
    leave_out(solution, {reached.angle, solved.linear[solution], reached.branch}, cost);
  }
}

// From what was left out at the point before, to wherever it may be now.
void GlobalChoice::follow_left_out(const ChoicePoint& point) {
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
        position.angle[rotary_count_ - 1] = std::numeric_limits<double>::quiet_NaN();
        position.linear.setConstant(std::numeric_limits<double>::quiet_NaN());
      }
      leave_out(n, position, before.cost + steps_.least_cost(before.position, position, axis_before_, point));
    }
  }
}

bool GlobalChoice::add(const ChoicePoint& point, const SolvedPose* ahead) {
  const Layer& before = layers_[now_];
  Layer& after = layers_[1 - now_];
  solved_ = ahead;
  if (ahead == nullptr || !ahead->known) {
    solver_.solve(point.pose, rotary_count_ == 0 ? 0.0 : before.at[0].angle[rotary_count_ - 1], own_);
    solved_ = &own_;
  }
  left_here_ = {};
  follow_left_out(point);
  gather(point);
  if (arrivals_.empty()) return false;
  if (before.count == 1 && arrivals_.size() == 1 && !leaves_out_) {
    // The only way: what it costs decides nothing.
    Candidate& next = after.at[0];
    next = candidate(solved_at(0), arrivals_[0].solution, arrivals_[0].angle, arrivals_[0].step);
    next.reconfigure = steps_.reconfigures(before.at[0], axis_before_, next, point);
    after.count = 1;
  } else {
    keep_cheapest(point);
  }
  left_out_ = left_here_;
  go_on(point);
  return true;
}

void GlobalChoice::go_on(const ChoicePoint& point) {
  const Layer& after = layers_[1 - now_];
  steps_of_layer_.clear();
  for (std::size_t c = 0; c < after.count; ++c) steps_of_layer_.push_back(after.at[c].step);
  traces_.add(steps_of_layer_);
  now_ = 1 - now_;
  axis_before_ = point.pose.axis_P;
}

std::size_t GlobalChoice::settle() {
  const Layer& last = layers_[now_];
  std::size_t best = 0;
  for (std::size_t c = 1; c < last.count; ++c) {
    if (last.at[c].cost < last.at[best].cost) best = c;
  }
  for (const LeftOut& left_out : left_out_) {
    if (left_out.cost < last.at[best].cost && most_ < kMostPositions) return 4 * most_;
  }
  end_ = last.at[best];
  take_picks(best);
  traces_ = {};
  return 0;
}

// Which position each point took on the way to this one of the last.
void GlobalChoice::take_picks(std::size_t best) {
  picks_.resize(traces_.layers());
  for (std::size_t i = picks_.size(); i-- > 0;) {
    if (traces_.take_straight()) {
      picks_[i] = static_cast<std::uint16_t>(kPlain | kOfTwo | best);
      continue;
    }
    const StepTraces::Read read = traces_.take_last(best);
    const unsigned plain = read.plain ? kPlain | (read.count == 2 ? kOfTwo : 0U) : 0U;
    picks_[i] = static_cast<std::uint16_t>(plain | read.step.pick);
    best = read.step.from;
  }
}

GlobalChoice::Candidate GlobalChoice::picked(const SolvedPose& solved, std::uint16_t pick) const {
  Candidate chosen;
  visit_positions(solved, place_.position,
                  [&](std::size_t at, std::size_t n, const std::array<double, 2>& angle) {
                    if (at != pick) return false;
                    chosen = candidate(solved, n, angle, {});
                    return true;
                  });
  return chosen;
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
  replay(points.last(picks_.size()), chosen.last(picks_.size()));
  return nullptr;
}

}  // namespace trunnion::path
