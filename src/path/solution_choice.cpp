#include "trunnion/path/solution_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "trunnion/machine/rotary_solver.hpp"
#include "trunnion/machine/table_kinematics.hpp"

#include "path/global_choice.hpp"
#include "path/reach.hpp"
#include "path/rotary_connection.hpp"

namespace trunnion::path {
namespace {

constexpr std::size_t kMaxCandidates = 16;

struct Candidate {
  JointVector q;
  std::uint8_t branch = 0;
  bool singular = false;
};

struct Layer {
  std::array<Candidate, kMaxCandidates> at;
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

  // All candidates for `pose`; C at the pole and free turns follow `seed`.
  void candidates(const ToolPose& pose, const JointVector& seed, Layer& out) const {
    out.count = 0;
    const double seed_inner = rotary_.empty() ? 0.0 : seed[rotary_.back()];
    const RotarySolutions solutions = solver_.solve_within_limits(pose.axis_P, seed_inner, options_.inverse);
    for (std::size_t i = 0; i < solutions.count; ++i) add_turns(pose, seed, solutions.at[i], out);
  }

  const std::vector<AxisId>& rotary() const { return rotary_; }
  const TableKinematics& kinematics() const { return kinematics_; }

 private:
  void add_turns(const ToolPose& pose, const JointVector& seed, const RotarySolution& solution,
                 Layer& out) const {
    std::array<std::array<double, 8>, 2> angles{};
    std::array<std::size_t, 2> counts = {1, 1};
    for (std::size_t k = 0; k < rotary_.size(); ++k) {
      counts[k] = turns_within(machine_.axes[rotary_[k]], solution.angle[k], seed[rotary_[k]], angles[k]);
    }
    for (std::size_t i = 0; i < counts[0]; ++i) {
      for (std::size_t j = 0; j < counts[1]; ++j) {
        if (out.count == kMaxCandidates) return;
        Candidate& c = out.at[out.count++];
        c = Candidate{};
        c.q = seed;
        if (!rotary_.empty()) c.q[rotary_[0]] = angles[0][i];
        if (rotary_.size() > 1) c.q[rotary_[1]] = angles[1][j];
        c.branch = solution.branch;
        c.singular = solution.singular;
        kinematics_.solve_linear(pose.tip_P, kinematics_.sines(c.q), c.q);
      }
    }
  }

  const Machine& machine_;
  const ChoiceOptions& options_;
  std::vector<AxisId> rotary_;
  TableKinematics kinematics_;
  RotarySolver solver_;
  AxisId named_axis_ = 0;
};

// Why no branch reaches a pose: the tilt itself, or a limit of a rotary axis.
Error unreachable(const Machine& machine, const ChoicePoint& point, const ChoiceOptions& options,
                  const std::string& cl_file) {
  return {ErrorCode::check_failed, unreachable_text(machine, point.pose.axis_P, options.inverse), cl_file,
          point.where};
}

struct Run {
  const Machine& machine;
  const Chooser& chooser;
  const ChoiceOptions& options;
  const std::string& cl_file;
};

Result<void> choose_global(const Run& run, std::span<const ChoicePoint> points, const JointVector& seed,
                           std::vector<ChosenPoint>& out) {
  GlobalChoice choice(run.machine, run.options);
  if (const ChoicePoint* lost = choice.choose(points, seed, out))
    return tl::unexpected(unreachable(run.machine, *lost, run.options, run.cl_file));
  return {};
}

Result<void> choose_local(const Run& run, std::span<const ChoicePoint> points, const JointVector& seed,
                          std::vector<ChosenPoint>& out) {
  JointVector q = seed;
  Vec3 axis_before = tool_pose(forward(run.machine, seed, run.options.tool_mm)).axis_P;
  const RotaryConnection connection(run.chooser.kinematics(), run.options.axis_tolerance);
  Layer layer;
  for (const ChoicePoint& point : points) {
    run.chooser.candidates(point.pose, q, layer);
    if (layer.count == 0) return tl::unexpected(unreachable(run.machine, point, run.options, run.cl_file));
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < layer.count; ++c) {
      const double measure = run.chooser.local_measure(q, layer.at[c].q);
      if (measure < least) {
        least = measure;
        best = c;
      }
    }
    const Candidate& c = layer.at[best];
    const bool leave = !point.rapid && !connection.connects(q, axis_before, c.q, point.pose.axis_P);
    out.push_back({c.q, c.branch, c.singular, leave, c.q, {}});
    q = c.q;
    axis_before = point.pose.axis_P;
  }
  return {};
}

// Gives C its position at the points first..last of the pole, which were chosen with C as it came.
void settle_pole(const Run& run, std::span<const ChoicePoint> points, std::span<ChosenPoint> chosen,
                 std::size_t first, std::size_t last, ChoiceSummary& summary) {
  if (last + 1 == chosen.size()) return;  // nothing follows that asks for a position
  const AxisId inner = run.chooser.rotary().back();
  const double in = chosen[first].q[inner];
  const double turn = chosen[last + 1].q[inner] - in;
  if (turn == 0.0 || points[last + 1].rapid || chosen[last + 1].reconfigure) return;
  const auto place = [&](std::size_t i, double angle) {
    JointVector q = chosen[i].q;
    q[inner] = angle;
    solve_linear(run.machine, points[i].pose.tip_P, run.options.tool_mm, q);
    return q;
  };
  double way = 0.0;
  for (std::size_t i = first + 1; i <= last; ++i)
    way += (points[i].pose.tip_P - points[i - 1].pose.tip_P).norm();
  if (points[first].rapid) {
    for (std::size_t i = first; i <= last; ++i) chosen[i].q = place(i, in + turn);
  } else if (way > 0.0) {
    double gone = 0.0;
    for (std::size_t i = first + 1; i <= last; ++i) {
      gone += (points[i].pose.tip_P - points[i - 1].pose.tip_P).norm();
      chosen[i].q = place(i, in + turn * gone / way);
    }
  } else {
    chosen[last].q_leave = place(last, in + turn);
    ++summary.turns_in_place;
    return;
  }
  for (std::size_t i = first; i <= last; ++i) chosen[i].q_leave = chosen[i].q;
}

void settle_poles(const Run& run, std::span<const ChoicePoint> points, std::span<ChosenPoint> chosen,
                  ChoiceSummary& summary) {
  if (run.chooser.rotary().size() < 2) return;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (!chosen[i].singular) continue;
    std::size_t last = i;
    // A rapid within the pole begins a new stretch: C may turn there.
    while (last + 1 < chosen.size() && chosen[last + 1].singular && !points[last + 1].rapid) ++last;
    const bool pole_goes_on = last + 1 < chosen.size() && chosen[last + 1].singular;
    if (!pole_goes_on) settle_pole(run, points, chosen, i, last, summary);
    i = last;
  }
}

}  // namespace

Result<void> choose_solutions(const Machine& machine, std::span<const ChoicePoint> points,
                              const JointVector& seed, const ChoiceOptions& options,
                              const std::string& cl_file, std::vector<ChosenPoint>& out,
                              ChoiceSummary& summary) {
  const Chooser chooser(machine, options);
  const Run run{machine, chooser, options, cl_file};
  const std::size_t begin = out.size();
  auto chosen = options.method == ChoiceMethod::global ? choose_global(run, points, seed, out)
                                                       : choose_local(run, points, seed, out);
  if (!chosen) return chosen;
  settle_poles(run, points, std::span(out).subspan(begin), summary);
  JointVector before = seed;
  std::uint8_t branch = summary.goes_on ? summary.last_branch
                        : begin > 0     ? out[begin - 1].branch
                        : out.empty()   ? std::uint8_t{0}
                                        : out[begin].branch;
  std::array<double, kMaxAxes> seconds{};
  for (AxisId id = 0; id < machine.axes.size(); ++id) seconds[id] = seconds_per_unit(machine.axes[id]);
  for (std::size_t i = begin; i < out.size(); ++i) {
    for (AxisId id = 0; id < machine.axes.size(); ++id)
      summary.axis_time_s += std::abs(out[i].q[id] - before[id]) * seconds[id];
    for (const AxisId id : chooser.rotary()) summary.rotary_travel_rad += std::abs(out[i].q[id] - before[id]);
    if (out[i].reconfigure) ++summary.reconfigurations;
    if (out[i].singular) {
      ++summary.pole_points;
    } else {
      if (out[i].branch != branch) ++summary.branch_changes;
      branch = out[i].branch;
    }
    before = out[i].q;
  }
  summary.last_branch = branch;
  return {};
}

bool settles_choice(const Machine& machine, const ToolPose& pose, const ChoiceOptions& options) {
  const RotarySolutions solutions =
      RotarySolver(machine).solve_within_limits(pose.axis_P, 0.0, options.inverse);
  const std::vector<AxisId> rotary = machine.rotary_axes();
  std::size_t count = 0;
  for (std::size_t i = 0; i < solutions.count; ++i) {
    if (solutions.at[i].singular) return false;
    std::size_t turns = 1;
    std::array<double, 8> angles;
    for (std::size_t k = 0; k < rotary.size(); ++k)
      turns *= turns_within(machine.axes[rotary[k]], solutions.at[i].angle[k], 0.0, angles);
    count += turns;
  }
  return count == 1;
}

}  // namespace trunnion::path
