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

double GlobalChoice::step_cost(const Candidate& a, const Candidate& b) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    sum += std::abs(b.linear[i] - a.linear[i]) * linear_seconds_[k];
  }
  for (std::size_t k = 0; k < rotary_count_; ++k)
    sum += std::abs(b.angle[k] - a.angle[k]) * rotary_seconds_[k];
  return sum;
}

double GlobalChoice::centre_preference(const Candidate& c) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < rotary_count_; ++k) {
    const Axis& axis = *rotary_axis_[k];
    if (axis.has_limits()) sum += std::abs(c.angle[k] - 0.5 * (axis.min + axis.max)) / (axis.max - axis.min);
  }
  return kCentreWeight_s * sum;
}

// Whole turns of an axis that may turn for ever make no difference to what follows.
bool GlobalChoice::same_position(const Candidate& a, const Candidate& b) const {
  for (std::size_t k = 0; k < rotary_count_; ++k) {
    const double d = b.angle[k] - a.angle[k];
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
void GlobalChoice::solve(const ToolPose& pose, const Candidate& seed) {
  const double seed_inner = rotary_count_ == 0 ? 0.0 : seed.angle[rotary_count_ - 1];
  solved_.rotary = solver_.solve_within_limits(pose.axis_P, seed_inner, options_.inverse);
  solved_.follows_seed = false;
  for (std::size_t i = 0; i < solved_.rotary.count; ++i) {
    const RotarySolution& solution = solved_.rotary.at[i];
    solved_.follows_seed = solved_.follows_seed || !solution.sines_known;
    solved_.sines[i] =
        solution.sines_known ? solution.sines : kinematics_.sines(joints(solution.angle, Vec3::Zero()));
    solved_.linear[i] = kinematics_.linear_positions(pose.tip_P, solved_.sines[i]);
  }
}

// All positions that reach the solved pose; free turns follow `seed`.
void GlobalChoice::candidates(const Candidate& seed, Layer& out) const {
  out.count = 0;
  for (std::size_t i = 0; i < solved_.rotary.count; ++i) add_turns(i, seed, out);
}

void GlobalChoice::add_turns(std::size_t solution, const Candidate& seed, Layer& out) const {
  const RotarySolution& solved = solved_.rotary.at[solution];
  std::array<std::array<double, 8>, 2> angles;
  angles[0][0] = solved.angle[0];
  angles[1][0] = solved.angle[1];
  std::array<std::size_t, 2> counts = {1, 1};
  for (std::size_t k = 0; k < rotary_count_; ++k)
    counts[k] = turns_within(*rotary_axis_[k], solved.angle[k], seed.angle[k], angles[k]);
  // Axes that are not square to each other may follow the tool axis by more than half a turn.
  if (oblique_ && !rotary_axis_[1]->has_limits()) {
    const double turn = angles[1][0] - seed.angle[1];
    if (std::abs(turn) > 0.5 * kPi) angles[1][counts[1]++] = angles[1][0] - std::copysign(kTwoPi, turn);
  }
  for (std::size_t i = 0; i < counts[0]; ++i) {
    for (std::size_t j = 0; j < counts[1]; ++j) {
      if (out.count == kMaxCandidates) return;
      Candidate& c = out.at[out.count++];
      c.angle = {angles[0][i], angles[1][j]};
      c.linear = solved_.linear[solution];
      c.sines = solved_.sines[solution];
      c.branch = solved.branch;
      c.singular = solved.singular;
    }
  }
}

// All ways into the present point.
void GlobalChoice::gather(const ChoicePoint& point) {
  const Layer& before = layers_[now_];
  arrivals_.clear();
  std::size_t places = 0;
  for (std::size_t p = 0; p < before.count; ++p) {
    const Candidate& from = before.at[p];
    if (p > 0 && solved_.follows_seed) solve(point.pose, from);
    candidates(from, reached_);
    for (std::size_t c = 0; c < reached_.count; ++c) {
      Arrival& arrival = arrivals_.emplace_back();
      arrival.candidate = reached_.at[c];
      arrival.candidate.from = static_cast<std::uint8_t>(p);
      arrival.way = from.cost + step_cost(from, arrival.candidate);
      arrival.preference = centre_preference(arrival.candidate);
      const auto same = std::find_if(arrivals_.begin(), arrivals_.end() - 1, [&](const Arrival& other) {
        return same_position(other.candidate, arrival.candidate);
      });
      arrival.place = same == arrivals_.end() - 1 ? places++ : same->place;
    }
  }
}

// The cheapest way into each position. A reconfiguration makes none cheaper, and to look for one costs most:
// the ways are tried from the shortest on.
void GlobalChoice::arrive(const ChoicePoint& point) {
  gather(point);
  order_.resize(arrivals_.size());
  for (std::size_t i = 0; i < order_.size(); ++i) {
    std::size_t at = i;
    for (; at > 0 && arrivals_[i].least() < arrivals_[order_[at - 1]].least(); --at)
      order_[at] = order_[at - 1];
    order_[at] = i;
  }
  const Layer& before = layers_[now_];
  Layer& after = layers_[1 - now_];
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::size_t count = 0;
  for (const Arrival& arrival : arrivals_) count = std::max(count, arrival.place + 1);
  after.count = std::min(count, kMaxCandidates);
  for (std::size_t i = 0; i < after.count; ++i) after.at[i].cost = kNone;
  for (const std::size_t i : order_) {
    const Arrival& arrival = arrivals_[i];
    if (arrival.place >= after.count) continue;
    Candidate& slot = after.at[arrival.place];
    if (!(arrival.least() < slot.cost)) continue;
    const bool reconfigure = reconfigures(point, before.at[arrival.candidate.from], arrival.candidate);
    const double cost = arrival.way + (reconfigure ? kReconfigureSeconds : 0.0) + arrival.preference;
    if (!(cost < slot.cost)) continue;
    slot = arrival.candidate;
    slot.cost = cost;
    slot.reconfigure = reconfigure;
  }
}

bool GlobalChoice::add(const ChoicePoint& point, const Solved* ahead) {
  const Layer& before = layers_[now_];
  Layer& after = layers_[1 - now_];
  after.count = 0;
  if (ahead != nullptr && ahead->known) {
    solved_ = *ahead;
  } else {
    solve(point.pose, before.at[0]);
  }
  if (before.count == 1) candidates(before.at[0], after);
  if (after.count == 1) {
    // The only way: what it costs decides nothing.
    Candidate& next = after.at[0];
    next.reconfigure = reconfigures(point, before.at[0], next);
    next.from = 0;
    next.cost = 0.0;
  } else {
    arrive(point);
  }
  if (after.count == 0) return false;
  first_.push_back(static_cast<std::uint32_t>(traces_.size()));
  for (std::size_t c = 0; c < after.count; ++c) {
    const Candidate& x = after.at[c];
    traces_.push_back({x.angle, x.linear, x.sines, x.from, x.branch, x.singular, x.reconfigure});
  }
  now_ = 1 - now_;
  axis_before_ = point.pose.axis_P;
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

// Of an axis' position, where no other whole turn is within its limits.
std::optional<double> GlobalChoice::only_turn(std::size_t k, double angle, double near) const {
  const Axis& axis = *rotary_axis_[k];
  if (!axis.has_limits()) return std::abs(near - angle) < kPi ? angle : *nearest_turn(axis, angle, near);
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
  put({next.angle, next.linear, next.sines, 0, next.branch, false, next.reconfigure}, out);
  return true;
}

void GlobalChoice::put(const Trace& trace, ChosenPoint& out) const {
  out.q = out.q_leave = joints(trace.angle, trace.linear);
  out.branch = trace.branch;
  out.singular = trace.singular;
  out.reconfigure = trace.reconfigure;
  out.sines = {trace.sines, trace.angle};
}

void GlobalChoice::take(std::span<ChosenPoint> out) const {
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
    const Trace& t = traces_[first_[i] + best];
    put(t, out[i]);
    best = t.from;
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
    } else if (!add(points[i], looks ? &ahead_[i % kAhead] : nullptr)) {
      out.resize(begin);
      return &points[i];
    }
  }
  take(std::span(out).subspan(begin));
  return nullptr;
}

}  // namespace trunnion::path
