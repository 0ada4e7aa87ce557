#include "trunnion/path/solution_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "trunnion/machine/rotary_solver.hpp"
#include "trunnion/machine/table_kinematics.hpp"

#include "path/choice/choice_account.hpp"
#include "path/choice/far_limits.hpp"
#include "path/choice/global_choice.hpp"
#include "path/choice/pole_settler.hpp"
#include "path/choice/rotary_connection.hpp"
#include "path/choice/turns.hpp"

namespace trunnion::path {
namespace {

struct LocalCandidate {
  JointVector q;
  std::uint8_t branch = 0;
  bool singular = false;
};

struct LocalCandidates {
  std::array<LocalCandidate, 2> at;
  std::size_t count = 0;
};

class Chooser {
 public:
  Chooser(const Machine& machine, const ChoiceOptions& options)
      : machine_(machine),
        options_(options),
        rotary_(machine.rotary_axes()),
        kinematics_(machine, options.tool_mm),
        solver_(machine) {
    if (const auto id = machine.axis(options.axis)) named_axis_ = *id;
  }

  double local_measure(const JointVector& a, const JointVector& b) const {
    double squares = 0.0;
    double largest = 0.0;
    double sum = 0.0;
    for (const AxisId id : rotary_) {
      const double d = std::abs(b[id] - a[id]);
      squares += d * d;
      largest = std::max(largest, d);
      sum += d;
    }
    // The other measures break ties, so that the choice does not hang on rounding.
    constexpr double kTie = 1e-9;
    switch (options_.method) {
      case ChoiceMethod::combined:
        return std::sqrt(squares) + kTie * sum;
      case ChoiceMethod::largest:
        return largest + kTie * sum;
      case ChoiceMethod::axis:
        return std::abs(b[named_axis_] - a[named_axis_]) + kTie * sum;
      default:
        return sum + kTie * largest;
    }
  }

  // Of both branches at `pose` the turns nearest to `seed`: no other does better by any local measure. C at
  // the pole follows `seed`.
  void candidates(const ToolPose& pose, const JointVector& seed, LocalCandidates& out) const {
    out.count = 0;
    const double seed_inner = rotary_.empty() ? 0.0 : seed[rotary_.back()];
    const RotarySolutions solutions = solver_.solve_within_limits(pose.axis_P, seed_inner, options_.inverse);
    for (std::size_t i = 0; i < solutions.count; ++i) {
      const RotarySolution& solution = solutions.at[i];
      LocalCandidate c{seed, solution.branch, solution.singular};
      bool within = true;
      for (std::size_t k = 0; k < rotary_.size(); ++k) {
        const auto turn = nearest_turn(machine_.axes[rotary_[k]], solution.angle[k], seed[rotary_[k]]);
        within = within && turn.has_value();
        if (turn) c.q[rotary_[k]] = *turn;
      }
      if (!within) continue;
      kinematics_.solve_linear(pose.tip_P, kinematics_.sines(c.q), c.q);
      out.at[out.count++] = c;
    }
  }

  const std::vector<AxisId>& rotary() const { return rotary_; }
  const TableKinematics& kinematics() const { return kinematics_; }

 private:
  const Machine& machine_;
  const ChoiceOptions& options_;
  std::vector<AxisId> rotary_;
  TableKinematics kinematics_;
  RotarySolver solver_;
  AxisId named_axis_ = 0;
};

Result<void> choose_global(const Machine& machine, const ChoiceRun& run, const ChoiceOptions& options,
                           std::vector<ChosenPoint>& out) {
  if (const auto free = without_far_limits(machine)) {
    GlobalChoice choice(*free, options);
    if (choice.choose(run.points, run.seed, out) == nullptr && keeps_far_limits(machine, out)) return {};
  }
  GlobalChoice choice(machine, options);
  if (const ChoicePoint* lost = choice.choose(run.points, run.seed, out))
    return tl::unexpected(unreachable(machine, *lost, options, run.cl_file));
  return {};
}

Result<void> choose_local(const Machine& machine, const ChoiceRun& run, const ChoiceOptions& options,
                          std::vector<ChosenPoint>& out) {
  const Chooser chooser(machine, options);
  JointVector q = run.seed;
  Vec3 axis_before = tool_pose(forward(machine, run.seed, options.tool_mm)).axis_P;
  const RotaryConnection connection(chooser.kinematics(), options.axis_tolerance);
  LocalCandidates layer;
  out.clear();
  for (const ChoicePoint& point : run.points) {
    chooser.candidates(point.pose, q, layer);
    if (layer.count == 0) return tl::unexpected(unreachable(machine, point, options, run.cl_file));
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < layer.count; ++c) {
      const double measure = chooser.local_measure(q, layer.at[c].q);
      if (measure < least) {
        least = measure;
        best = c;
      }
    }
    const LocalCandidate& c = layer.at[best];
    const bool leave = !point.rapid && !connection.connects(q, axis_before, c.q, point.pose.axis_P);
    out.push_back({c.q, c.branch, c.singular, leave, c.q, {}});
    q = c.q;
    axis_before = point.pose.axis_P;
  }
  return {};
}

}  // namespace

Result<void> choose_solutions(const Machine& machine, const ChoiceRun& run, const ChoiceOptions& options,
                              std::vector<ChosenPoint>& out, ChoiceSummary& summary) {
  auto chosen = options.method == ChoiceMethod::global ? choose_global(machine, run, options, out)
                                                       : choose_local(machine, run, options, out);
  if (!chosen) return chosen;
  const TableKinematics kinematics(machine, options.tool_mm);
  PoleSettler(machine, kinematics).settle(run.points, out, summary, [] { return PoleSettler::Ahead{}; });
  const std::uint8_t first = out.empty() ? std::uint8_t{0} : out.front().branch;
  ChoiceAccount(machine, run.seed, summary.goes_on ? summary.last_branch : first).add(out, summary);
  return {};
}

bool settles_choice(const Machine& machine, const RotarySolver& solver, const ToolPose& pose,
                    const ChoiceOptions& options) {
  if (solver.surely_on_both(pose.axis_P)) return false;
  const RotarySolutions solutions = solver.solve_within_limits(pose.axis_P, 0.0, options.inverse);
  if (solutions.count > 1) return false;  // each has a turn, or is only just beyond a limit
  const std::vector<AxisId> rotary = machine.rotary_axes();
  std::size_t count = 0;
  for (std::size_t i = 0; i < solutions.count; ++i) {
    if (solutions.at[i].singular) return false;
    std::size_t turns = 1;
    for (std::size_t k = 0; k < rotary.size(); ++k)
      turns *= Turns(machine.axes[rotary[k]], solutions.at[i].angle[k], 0.0, 2).count();
    count += turns;
  }
  return count == 1;
}

}  // namespace trunnion::path
