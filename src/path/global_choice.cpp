#include "path/global_choice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trunnion::path {
namespace {

constexpr double kDefaultLinearRate_mm_s = 30000.0 / kSecondsPerMinute;
constexpr double kDefaultRotaryRate_rad_s = 9000.0 * kRadPerDegree / kSecondsPerMinute;

// Mild preference for the middle of the travel, far below the cost of any motion: it decides ties only.
constexpr double kCentreWeight_s = 1e-6;

// An angle that misses a limit by its own rounding is at it.
constexpr double kAtLimit = 1e-12;

// Nearly always one turn is within the limits, and no other.
bool is_only_turn(const Axis& axis, double angle) {
  return axis.within_limits(angle) && angle - kTwoPi < axis.min - kAtLimit &&
         angle + kTwoPi > axis.max + kAtLimit;
}

}  // namespace

double seconds_per_unit(const Axis& axis) {
  return 1.0 / axis.rapid.value_or(axis.kind == AxisKind::linear ? kDefaultLinearRate_mm_s
                                                                 : kDefaultRotaryRate_rad_s);
}

std::size_t turns_within(const Axis& axis, double angle, double near, std::array<double, 8>& out) {
  if (!axis.has_limits()) {
    out[0] = *nearest_turn(axis, angle, near);
    return 1;
  }
  if (is_only_turn(axis, angle)) {
    out[0] = angle;
    return 1;
  }
  std::size_t count = 0;
  for (double k = std::ceil((axis.min - angle - kAtLimit) / kTwoPi);
       angle + k * kTwoPi <= axis.max + kAtLimit; ++k) {
    if (count == out.size()) break;
    out[count++] = std::clamp(angle + k * kTwoPi, axis.min, axis.max);
  }
  return count;
}

GlobalChoice::GlobalChoice(const Machine& machine, const ChoiceOptions& options)
    : options_(options),
      kinematics_(machine, options.tool_mm),
      solver_(machine),
      connection_(kinematics_, options.axis_tolerance),
      rotary_count_(kinematics_.rotary_count()) {
  for (std::size_t k = 0; k < 3; ++k) {
    linear_[k] = kinematics_.linear(k);
    linear_seconds_[k] = seconds_per_unit(machine.axes[linear_[k]]);
  }
  for (std::size_t k = 0; k < rotary_count_; ++k) {
    rotary_[k] = kinematics_.rotary(k);
    rotary_axis_[k] = &machine.axes[rotary_[k]];
    rotary_seconds_[k] = seconds_per_unit(*rotary_axis_[k]);
  }
  if (rotary_count_ < 2) return;
  reaches_pole_ = solver_.solve_within_limits(kinematics_.direction(1), 0.0).count > 0;
  oblique_ = std::abs(kinematics_.direction(0).dot(kinematics_.direction(1))) > 1e-9;
}

void GlobalChoice::start(const JointVector& seed, std::size_t count) {
  seed_ = seed;
  axis_before_ = kinematics_.axis_P(kinematics_.sines(seed));
  traces_.clear();
  first_.clear();
  first_.reserve(count);
  Layer& layer = layers_[now_];
  layer.count = 1;
  Candidate& c = layer.at[0];
  c = Candidate{};
  for (std::size_t k = 0; k < rotary_count_; ++k) c.angle[k] = seed[rotary_[k]];
  for (std::size_t k = 0; k < 3; ++k) c.linear[static_cast<Eigen::Index>(k)] = seed[linear_[k]];
}

JointVector GlobalChoice::joints(const std::array<double, 2>& angle, const Vec3& linear) const {
  JointVector q = seed_;
  for (std::size_t k = 0; k < rotary_count_; ++k) q[rotary_[k]] = angle[k];
  for (std::size_t k = 0; k < 3; ++k) q[linear_[k]] = linear[static_cast<Eigen::Index>(k)];
  return q;
}

double GlobalChoice::step_cost(const Candidate& from, const std::array<double, 2>& angle,
                               const Vec3& linear) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    sum += std::abs(linear[i] - from.linear[i]) * linear_seconds_[k];
  }
  for (std::size_t k = 0; k < rotary_count_; ++k)
    sum += std::abs(angle[k] - from.angle[k]) * rotary_seconds_[k];
  return sum;
}

double GlobalChoice::centre_preference(const std::array<double, 2>& angle) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < rotary_count_; ++k) {
    const Axis& axis = *rotary_axis_[k];
    if (axis.has_limits()) sum += std::abs(angle[k] - 0.5 * (axis.min + axis.max)) / (axis.max - axis.min);
  }
  return kCentreWeight_s * sum;
}

// Whole turns of an axis that may turn for ever make no difference to what follows.
bool GlobalChoice::same_position(const std::array<double, 2>& a, const std::array<double, 2>& b) const {
  for (std::size_t k = 0; k < rotary_count_; ++k) {
    const double d = b[k] - a[k];
    const double least = rotary_axis_[k]->has_limits() || std::abs(d) < kPi ? d : std::remainder(d, kTwoPi);
    if (!(std::abs(least) < 1e-9)) return false;
  }
  return true;
}

bool GlobalChoice::reconfigures(const ChoicePoint& point, const Candidate& a, const Candidate& b) const {
  if (point.rapid) return false;
  double turn = 0.0;
  for (std::size_t k = 0; k < rotary_count_; ++k) turn += std::abs(b.angle[k] - a.angle[k]);
  constexpr double kSurelyNone = 10.0 * kRadPerDegree;
  if (turn < kSurelyNone && a.branch == b.branch) return false;
  return !connection_.connects(a.angle, axis_before_, b.angle, point.pose.axis_P) ||
         !way_within_limits(a, point.pose.axis_P);
}

// The tilt between two tool axes may be less, or beyond a right angle more, than at both, and where the
// rotary axes are not square to each other the inner one may go beyond both its ends: limits that hold at the
// ends may not hold on the way.
bool GlobalChoice::way_within_limits(const Candidate& a, const Vec3& axis_b_P) const {
  if (rotary_count_ < 2) return true;
  const Vec3& n = kinematics_.direction(1);
  if (oblique_ && rotary_axis_[1]->has_limits()) {
    constexpr int kLooks = 16;
    for (int i = 1; i < kLooks; ++i) {
      if (!holds_on_the_way(a, slerp(axis_before_, axis_b_P, static_cast<double>(i) / kLooks))) return false;
    }
    return true;
  }
  if (reaches_pole_ && n.dot(axis_before_) >= 0.0 && n.dot(axis_b_P) >= 0.0) return true;
  const Vec3 normal = axis_before_.cross(axis_b_P);
  if (!(normal.norm() > 1e-9)) return true;
  Vec3 foot = n - (n.dot(normal) / normal.squaredNorm()) * normal;
  if (foot.dot(axis_before_ + axis_b_P) < 0.0) foot = -foot;
  if (axis_before_.cross(foot).dot(normal) <= 0.0 || foot.cross(axis_b_P).dot(normal) <= 0.0) return true;
  return holds_on_the_way(a, foot.normalized());
}

// A position within the limits holds `axis_P`, and the axes come there from `a`.
bool GlobalChoice::holds_on_the_way(const Candidate& a, const Vec3& axis_P) const {
  const RotarySolutions solutions = solver_.solve_within_limits(axis_P, a.angle[1], options_.inverse);
  for (std::size_t i = 0; i < solutions.count; ++i) {
    RotaryConnection::Angles angles{};
    std::array<std::array<double, 8>, 2> turns{};
    const std::size_t outer = turns_within(*rotary_axis_[0], solutions.at[i].angle[0], a.angle[0], turns[0]);
    const std::size_t inner = turns_within(*rotary_axis_[1], solutions.at[i].angle[1], a.angle[1], turns[1]);
    for (std::size_t k = 0; k < outer * inner; ++k) {
      angles = {turns[0][k % outer], turns[1][k / outer]};
      if (connection_.connects(a.angle, axis_before_, angles, axis_P)) return true;
    }
  }
  return false;
}

// C at the pole follows `seed`.
void GlobalChoice::solve(const ToolPose& pose, const Candidate& seed, Solved& out) const {
  const double seed_inner = rotary_count_ == 0 ? 0.0 : seed.angle[rotary_count_ - 1];
  out.rotary = solver_.solve_within_limits(pose.axis_P, seed_inner, options_.inverse);
  out.follows_seed = false;
  for (std::size_t i = 0; i < out.rotary.count; ++i) {
    const RotarySolution& solution = out.rotary.at[i];
    out.follows_seed = out.follows_seed || !solution.sines_known;
    out.sines[i] =
        solution.sines_known ? solution.sines : kinematics_.sines(joints(solution.angle, Vec3::Zero()));
    out.linear[i] = kinematics_.linear_positions(pose.tip_P, out.sines[i]);
  }
}

void GlobalChoice::gather(const ChoicePoint& point) {
  const Layer& before = layers_[now_];
  arrivals_.clear();
  places_ = 0;
  solved_by_.clear();
  if (solved_->follows_seed) {
    solved_by_.resize(before.count);
    for (std::size_t p = 0; p < before.count; ++p) solve(point.pose, before.at[p], solved_by_[p]);
  }
  for (std::size_t p = 0; p < before.count; ++p) gather_from(p);
}

// All positions, of every branch and turn; free turns follow the position before.
void GlobalChoice::gather_from(std::size_t predecessor) {
  const Candidate& from = layers_[now_].at[predecessor];
  const Solved& solved = solved_at(predecessor);
  const std::size_t first = arrivals_.size();
  for (std::size_t n = 0; n < solved.rotary.count; ++n) {
    const std::array<double, 2>& angle = solved.rotary.at[n].angle;
    std::array<std::array<double, 8>, 2> angles;
    angles[0][0] = angle[0];
    angles[1][0] = angle[1];
    std::array<std::size_t, 2> counts = {1, 1};
    for (std::size_t k = 0; k < rotary_count_; ++k) {
      if (const auto turn = only_turn(k, angle[k], from.angle[k])) {
        angles[k][0] = *turn;
      } else {
        counts[k] = turns_within(*rotary_axis_[k], angle[k], from.angle[k], angles[k]);
        if (!rotary_axis_[k]->has_limits())
          angles[k][counts[k]++] = angles[k][0] - std::copysign(kTwoPi, angles[k][0] - from.angle[k]);
      }
    }
    for (std::size_t i = 0; i < counts[0]; ++i) {
      for (std::size_t j = 0; j < counts[1]; ++j) {
        if (arrivals_.size() - first == kMaxCandidates) return;
        arrive(solved, predecessor, n, {angles[0][i], angles[1][j]});
      }
    }
  }
}

void GlobalChoice::arrive(const Solved& solved, std::size_t predecessor, std::size_t solution,
                          const std::array<double, 2>& angle) {
  const Candidate& from = layers_[now_].at[predecessor];
  const auto same = std::find_if(arrivals_.begin(), arrivals_.end(),
                                 [&](const Arrival& other) { return same_position(other.angle, angle); });
  Arrival arrival;
  arrival.angle = angle;
  arrival.solution = static_cast<std::uint8_t>(solution);
  arrival.from = static_cast<std::uint8_t>(predecessor);
  if (same != arrivals_.end()) {
    arrival.place = same->place;
  } else if (places_ == kMaxCandidates) {
    return;  // no machine's limits leave so many
  } else {
    arrival.place = static_cast<std::uint8_t>(places_++);
  }
  arrival.way = from.cost + step_cost(from, angle, solved.linear[solution]);
  arrival.preference = centre_preference(angle);
  arrivals_.push_back(arrival);
}

GlobalChoice::Candidate GlobalChoice::candidate(const Arrival& arrival) const {
  const Solved& solved = solved_at(arrival.from);
  Candidate c;
  c.angle = arrival.angle;
  c.linear = solved.linear[arrival.solution];
  c.sines = solved.sines[arrival.solution];
  c.from = arrival.from;
  c.branch = solved.rotary.at[arrival.solution].branch;
  c.singular = solved.rotary.at[arrival.solution].singular;
  return c;
}

// The cheapest way into each position. A reconfiguration makes none cheaper, and to look for one costs most:
// the ways are tried from the shortest on.
void GlobalChoice::keep_cheapest(const ChoicePoint& point) {
  order_.resize(arrivals_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const Arrival& arrival = arrivals_[i];
    std::size_t at = i;
    for (; at > 0 && arrival.least() < order_[at - 1]->least(); --at) order_[at] = order_[at - 1];
    order_[at] = &arrival;
  }
  const Layer& before = layers_[now_];
  Layer& after = layers_[1 - now_];
  after.count = places_;
  for (std::size_t i = 0; i < places_; ++i) after.at[i].cost = std::numeric_limits<double>::infinity();
  for (const Arrival* arrival : order_) {
    Candidate& slot = after.at[arrival->place];
    if (!(arrival->least() < slot.cost)) continue;
    Candidate reached = candidate(*arrival);
    reached.reconfigure = reconfigures(point, before.at[arrival->from], reached);
    reached.cost = arrival->way + (reached.reconfigure ? kReconfigureSeconds : 0.0) + arrival->preference;
    if (reached.cost < slot.cost) slot = reached;
  }
}

bool GlobalChoice::add(const ChoicePoint& point, const Solved* ahead) {
  const Layer& before = layers_[now_];
  Layer& after = layers_[1 - now_];
  solved_ = ahead;
  if (ahead == nullptr || !ahead->known) {
    solve(point.pose, before.at[0], own_);
    solved_ = &own_;
  }
  gather(point);
  if (arrivals_.empty()) return false;
  if (before.count == 1 && arrivals_.size() == 1) {
    // The only way: what it costs decides nothing.
    Candidate& next = after.at[0];
    next = candidate(arrivals_[0]);
    next.reconfigure = reconfigures(point, before.at[0], next);
    after.count = 1;
  } else {
    keep_cheapest(point);
  }
  go_on(point);
  return true;
}

void GlobalChoice::go_on(const ChoicePoint& point) {
  const Layer& after = layers_[1 - now_];
  first_.push_back(static_cast<std::uint32_t>(traces_.size()));
  for (std::size_t c = 0; c < after.count; ++c) {
    const Candidate& x = after.at[c];
    traces_.push_back({x.angle, x.from, x.branch, x.singular, x.reconfigure});
  }
  now_ = 1 - now_;
  axis_before_ = point.pose.axis_P;
}

// What `add` does, for what a run at small tilts consists of.
bool GlobalChoice::add_both(const ChoicePoint& point, const Solved& solved) {
  const Layer& before = layers_[now_];
  if (!solved.known || solved.rotary.count != 2 || before.count > 2) return false;
  std::array<std::array<std::array<double, 2>, 2>, 2> angle;  // [branch][position before][axis]
  for (std::size_t n = 0; n < 2; ++n) {
    for (std::size_t p = 0; p < before.count; ++p) {
      for (std::size_t k = 0; k < 2; ++k) {
        const auto turn = only_turn(k, solved.rotary.at[n].angle[k], before.at[p].angle[k]);
        if (!turn) return false;
        angle[n][p][k] = *turn;
      }
    }
  }
  if (same_position(angle[0][0], angle[1][0])) return false;
  Layer& after = layers_[1 - now_];
  after.count = 2;
  for (std::size_t n = 0; n < 2; ++n) {
    std::array<double, 2> least{};
    for (std::size_t p = 0; p < before.count; ++p)
      least[p] = before.at[p].cost + step_cost(before.at[p], angle[n][p], solved.linear[n]) +
                 centre_preference(angle[n][p]);
    Candidate& next = after.at[n];
    next.linear = solved.linear[n];
    next.sines = solved.sines[n];
    next.branch = solved.rotary.at[n].branch;
    next.singular = false;
    // The shorter way; the other one too where the tool would have to leave the part.
    std::size_t from = before.count == 2 && least[1] < least[0] ? 1 : 0;
    next.angle = angle[n][from];
    next.reconfigure = reconfigures(point, before.at[from], next);
    next.cost = least[from] + (next.reconfigure ? kReconfigureSeconds : 0.0);
    if (before.count == 2 && least[1 - from] < next.cost) {
      Candidate other = next;
      other.angle = angle[n][1 - from];
      other.reconfigure = reconfigures(point, before.at[1 - from], other);
      other.cost = least[1 - from] + (other.reconfigure ? kReconfigureSeconds : 0.0);
      if (other.cost < next.cost) {
        next = other;
        from = 1 - from;
      }
    }
    next.from = static_cast<std::uint8_t>(from);
  }
  go_on(point);
  return true;
}

void GlobalChoice::look_ahead(std::span<const ChoicePoint> points) {
  for (std::size_t i = 0; i < points.size(); i += 2) {
    // An odd last one stands for two.
    const std::array<const ToolPose*, 2> pose = {&points[i].pose,
                                                 &points[std::min(i + 1, points.size() - 1)].pose};
    const auto side_by_side = [&](const auto& of) {
      const Vec3& a = of(*pose[0]);
      const Vec3& b = of(*pose[1]);
      return lanes::Triple<Lanes>{{a.x(), b.x()}, {a.y(), b.y()}, {a.z(), b.z()}};
    };
    const RotarySolver::Pair solved =
        solver_.solve_pair(side_by_side([](const ToolPose& p) -> const Vec3& { return p.axis_P; }));
    const auto tip_P = side_by_side([](const ToolPose& p) -> const Vec3& { return p.tip_P; });
    const std::size_t lanes_used = std::min<std::size_t>(2, points.size() - i);
    for (std::size_t lane = 0; lane < lanes_used; ++lane) {
      ahead_[i + lane].rotary.count = 0;
      ahead_[i + lane].known = solved.known[static_cast<int>(lane)] != 0;
    }
    for (std::uint8_t branch = 0; branch < 2; ++branch) {
      if (!lanes::any(solved.within[branch])) continue;
      const auto& sin = solved.sin[branch];
      const auto& cos = solved.cos[branch];
      const auto linear = kinematics_.linear_positions(tip_P, TableKinematics::SinesOf<Lanes>{sin, cos});
      for (std::size_t lane = 0; lane < lanes_used; ++lane) {
        const int l = static_cast<int>(lane);
        if (solved.within[branch][l] == 0) continue;
        Solved& of = ahead_[i + lane];
        const std::size_t n = of.rotary.count++;
        of.sines[n] = {{sin[0][l], sin[1][l]}, {cos[0][l], cos[1][l]}};
        of.linear[n] = {linear.x[l], linear.y[l], linear.z[l]};
        of.rotary.at[n] = {
            {solved.angle[branch][0][l], solved.angle[branch][1][l]}, of.sines[n], true, branch, false};
      }
    }
  }
}

// The position of an axis, where no other whole turn is within its limits or of use: axes that are not square
// to each other may follow the tool axis by more than half a turn.
std::optional<double> GlobalChoice::only_turn(std::size_t k, double angle, double near) const {
  const Axis& axis = *rotary_axis_[k];
  if (!axis.has_limits()) {
    const double nearest = std::abs(near - angle) < kPi ? angle : *nearest_turn(axis, angle, near);
    if (oblique_ && k == 1 && std::abs(nearest - near) > 0.5 * kPi) return std::nullopt;
    return nearest;
  }
  if (is_only_turn(axis, angle)) return angle;
  return std::nullopt;
}

bool GlobalChoice::add_only(const ChoicePoint& point, const Solved& solved, ChosenPoint& out) {
  const Layer& before = layers_[now_];
  if (!solved.known || solved.rotary.count != 1 || before.count != 1) return false;
  const RotarySolution& only = solved.rotary.at[0];
  const Candidate& from = before.at[0];
  Layer& after = layers_[1 - now_];
  Candidate& next = after.at[0];
  for (std::size_t k = 0; k < 2; ++k) {
    const auto turn = only_turn(k, only.angle[k], from.angle[k]);
    if (!turn) return false;
    next.angle[k] = *turn;
  }
  next.linear = solved.linear[0];
  next.sines = only.sines;
  next.branch = only.branch;
  next.singular = false;
  next.reconfigure = reconfigures(point, from, next);
  next.from = 0;
  next.cost = 0.0;
  after.count = 1;
  now_ = 1 - now_;
  axis_before_ = point.pose.axis_P;
  put(next, out);
  return true;
}

void GlobalChoice::put(const Candidate& chosen, ChosenPoint& out) const {
  out.q = out.q_leave = joints(chosen.angle, chosen.linear);
  out.branch = chosen.branch;
  out.singular = chosen.singular;
  out.reconfigure = chosen.reconfigure;
  out.sines = {chosen.sines, chosen.angle};
}

// A run of which every point has several positions is held to its end: of each only the angles are kept.
void GlobalChoice::take(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) const {
  const Layer& end = layers_[now_];
  std::size_t best = 0;
  for (std::size_t c = 1; c < end.count; ++c) {
    if (end.at[c].cost < end.at[best].cost) best = c;
  }
  for (std::size_t i = first_.size(); i-- > 0;) {
    if (first_[i] == kNoTrace) {
      best = 0;
      continue;
    }
    const Trace& trace = traces_[first_[i] + best];
    Candidate chosen;
    chosen.angle = trace.angle;
    chosen.branch = trace.branch;
    chosen.singular = trace.singular;
    chosen.reconfigure = trace.reconfigure;
    chosen.sines = kinematics_.sines(joints(trace.angle, Vec3::Zero()));
    chosen.linear = kinematics_.linear_positions(points[i].pose.tip_P, chosen.sines);
    put(chosen, out[i]);
    best = trace.from;
  }
}

const ChoicePoint* GlobalChoice::choose(std::span<const ChoicePoint> points, const JointVector& seed,
                                        std::vector<ChosenPoint>& out) {
  const std::size_t begin = out.size();
  out.resize(begin + points.size());
  start(seed, points.size());
  const bool looks = kinematics_.side_by_side();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (looks && i % kAhead == 0) look_ahead(points.subspan(i, std::min(kAhead, points.size() - i)));
    if (looks && add_only(points[i], ahead_[i % kAhead], out[begin + i])) {
      first_.push_back(kNoTrace);
    } else if (looks && add_both(points[i], ahead_[i % kAhead])) {
      continue;
    } else if (!add(points[i], looks ? &ahead_[i % kAhead] : nullptr)) {
      out.resize(begin);
      return &points[i];
    }
  }
  take(points, std::span(out).subspan(begin));
  return nullptr;
}

}  // namespace trunnion::path
