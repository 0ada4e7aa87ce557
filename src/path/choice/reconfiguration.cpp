#include "trunnion/path/reconfiguration.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/rotary_solver.hpp"

#include "path/choice/reach.hpp"
#include "path/choice/rotary_connection.hpp"
#include "path/choice/turns.hpp"

namespace trunnion::path {
namespace {

// Steps in which the way is looked at before its end within the limits is halved down to: below a degree.
constexpr int kCourseSteps = 256;
// Whole turns of an axis that are looked at, nearest first: what is wanted is the least turn.
constexpr std::size_t kTurnsOfAxis = 8;
constexpr int kBisections = 60;
// More turns than whole turns and branches there are on half a great circle: a bug.
constexpr int kMostTurns = 16;

class TurnPlanner {
 public:
  TurnPlanner(const Machine& machine, const ToolPose& from, const ToolPose& to, const ChoiceOptions& options)
      : machine_(machine),
        from_(from),
        to_(to),
        options_(options),
        kinematics_(machine, options.tool_mm),
        solver_(machine),
        connection_(kinematics_, options.axis_tolerance) {}

  Result<std::vector<TurnAway>> plan(const JointVector& a, const JointVector& b) const {
    std::vector<TurnAway> out;
    if (goes_to(a, 0.0, b)) return out;
    // At a point of the CL file, where one turn does it.
    if (const auto after =
            best(positions(0.0, b), a, [&](const JointVector& q) { return goes_to(q, 0.0, b); }))
      return std::vector<TurnAway>{{0.0, from_, a, *after}};
    JointVector now = a;
    double share = 0.0;
    for (int turn = 0; turn < kMostTurns; ++turn) {
      const auto [end, q] = farthest(now, share);
      if (end >= 1.0) {
        if (!same(q, b)) out.push_back({1.0, to_, q, b});
        return out;
      }
      double best_end = end;
      std::optional<JointVector> next;
      for (const JointVector& candidate : positions(end, q)) {
        const double reached = farthest(candidate, end).first;
        if (!(reached > best_end + kLeast)) continue;
        best_end = reached;
        next = candidate;
      }
      if (!next) return tl::unexpected(blocked(end));
      out.push_back({end, pose(end), q, *next});
      now = *next;
      share = end;
    }
    return tl::unexpected(blocked(share));
  }

 private:
  static constexpr double kLeast = 1e-9;  // of the way: rounding

  ToolPose pose(double share) const {
    return {(1.0 - share) * from_.tip_P + share * to_.tip_P, slerp(from_.axis_P, to_.axis_P, share)};
  }

  // All positions within the limits at `share`; what is free follows `seed`.
  std::vector<JointVector> positions(double share, const JointVector& seed) const {
    std::vector<JointVector> out;
    const ToolPose at = pose(share);
    const std::size_t count = kinematics_.rotary_count();
    const double seed_inner = count == 0 ? 0.0 : seed[kinematics_.rotary(count - 1)];
    const RotarySolutions solutions = solver_.solve_within_limits(at.axis_P, seed_inner, options_.inverse);
    for (std::size_t i = 0; i < solutions.count; ++i) {
      const std::size_t first = out.size();
      out.push_back(seed);
      for (std::size_t k = 0; k < count; ++k) {
        const AxisId id = kinematics_.rotary(k);
        const Turns turns(machine_.axes[id], solutions.at[i].angle[k], seed[id], kTurnsOfAxis);
        const std::vector<JointVector> so_far(out.begin() + static_cast<std::ptrdiff_t>(first), out.end());
        out.resize(first);
        for (std::size_t j = 0; j < turns.count(); ++j) {
          for (JointVector q : so_far) {
            q[id] = turns.at(j);
            out.push_back(q);
          }
        }
      }
      for (std::size_t j = first; j < out.size(); ++j)
        kinematics_.solve_linear(at.tip_P, kinematics_.sines(out[j]), out[j]);
    }
    return out;
  }

  double way(const JointVector& a, const JointVector& b) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < kinematics_.rotary_count(); ++k)
      sum += std::abs(kinematics_.angle(b, k) - kinematics_.angle(a, k));
    return sum;
  }
  bool same(const JointVector& a, const JointVector& b) const { return way(a, b) < 1e-6; }

  template <typename Condition>
  std::optional<JointVector> best(const std::vector<JointVector>& from, const JointVector& near,
                                  const Condition& condition) const {
    std::optional<JointVector> out;
    for (const JointVector& q : from) {
      if (condition(q) && (!out || way(near, q) < way(near, *out))) out = q;
    }
    return out;
  }

  // Where the axes come to at `share`, from `q` at `begin` on, if that is within the limits.
  std::optional<JointVector> follow(const JointVector& q, double begin, double share) const {
    const Vec3 axis_a_P = pose(begin).axis_P;
    const Vec3 axis_b_P = pose(share).axis_P;
    return best(positions(share, q), q,
                [&](const JointVector& p) { return connection_.connects(q, axis_a_P, p, axis_b_P); });
  }

  // How far the axes follow from `q` at `begin` on, and where they stand then.
  std::pair<double, JointVector> farthest(const JointVector& q, double begin) const {
    double inside = begin;
    JointVector at = q;
    for (int i = 1; i <= kCourseSteps; ++i) {
      const double share = i == kCourseSteps ? 1.0 : begin + (1.0 - begin) * i / kCourseSteps;
      const auto found = follow(at, inside, share);
      if (found) {
        inside = share;
        at = *found;
        continue;
      }
      double outside = share;
      for (int k = 0; k < kBisections; ++k) {
        const double middle = 0.5 * (inside + outside);
        const auto between = follow(at, inside, middle);
        (between ? inside : outside) = middle;
        if (between) at = *between;
      }
      break;
    }
    return {inside, at};
  }

  bool goes_to(const JointVector& q, double begin, const JointVector& b) const {
    const auto [share, at] = farthest(q, begin);
    return share >= 1.0 && connection_.connects(q, pose(begin).axis_P, b, to_.axis_P);
  }

  // The tool axis behind `share` that is farthest from what the axes reach.
  Error blocked(double share) const {
    Reach most;
    double where = share;
    for (int i = 0; i <= kCourseSteps; ++i) {
      const double at = share + (1.0 - share) * i / kCourseSteps;
      const Reach reach = reach_of(machine_, pose(at).axis_P, options_.inverse);
      if (reach.beyond_rad <= most.beyond_rad) continue;
      most = reach;
      where = at;
    }
    return {ErrorCode::check_failed,
            fixed_text(100.0 * where, 1) + " % of the way the " +
                unreachable_text(machine_, pose(where).axis_P, options_.inverse),
            {},
            {}};
  }

  const Machine& machine_;
  ToolPose from_;
  ToolPose to_;
  const ChoiceOptions& options_;
  TableKinematics kinematics_;
  RotarySolver solver_;
  RotaryConnection connection_;
};

}  // namespace

bool connects(const Machine& machine, const Point& a, const Point& b, const ChoiceOptions& options) {
  const TableKinematics kinematics(machine, options.tool_mm);
  return RotaryConnection(kinematics, options.axis_tolerance).connects(a.q, a.axis_P, b.q, b.axis_P);
}

Result<std::vector<TurnAway>> plan_turns(const Machine& machine, const Point& from, const Point& to,
                                         const ChoiceOptions& options) {
  return TurnPlanner(machine, {from.tip_P, from.axis_P}, {to.tip_P, to.axis_P}, options).plan(from.q, to.q);
}

}  // namespace trunnion::path
