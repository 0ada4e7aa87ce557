#include "trunnion/path/solution_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/table_kinematics.hpp"

namespace trunnion::path {
namespace {

// Rates where the machine file gives none: those of a small trunnion. Only ratios of axis times matter for
// the choice.
constexpr double kDefaultLinearRate_mm_s = 30000.0 / kSecondsPerMinute;
constexpr double kDefaultRotaryRate_rad_s = 9000.0 * kRadPerDegree / kSecondsPerMinute;

double rate_of(const Axis& axis) {
  return axis.rapid.value_or(axis.kind == AxisKind::linear ? kDefaultLinearRate_mm_s
                                                           : kDefaultRotaryRate_rad_s);
}

// A step that turns an axis by more than half a turn, or flips a branch far from the pole, is not a cut.
constexpr double kHalfTurn = kPi * (1.0 + 1e-9);

constexpr std::size_t kMaxCandidates = 16;

struct Candidate {
  JointVector q;
  std::uint8_t branch = 0;
  bool singular = false;
  bool reconfigure = false;
  double cost = std::numeric_limits<double>::infinity();
  std::uint8_t from = 0;  // index of the best predecessor
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
        kinematics_(machine, options.tool_mm) {
    if (const auto id = machine.axis(options.axis)) named_axis_ = *id;
  }

  // Cost of moving from a to b, seconds; `reconfigure` tells whether the tool must leave the part.
  double step_cost(const JointVector& a, const JointVector& b) const {
    double sum = 0.0;
    for (AxisId id = 0; id < machine_.axes.size(); ++id)
      sum += std::abs(b[id] - a[id]) / rate_of(machine_.axes[id]);
    return sum;
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

  bool needs_reconfiguration(const JointVector& a, const JointVector& b, const Vec3& axis_a,
                             const Vec3& axis_b) const {
    for (const AxisId id : rotary_) {
      if (std::abs(b[id] - a[id]) > kHalfTurn) return true;
    }
    // The tool swings far away on its way: a branch jumped.
    const Pose X_MP = part_in_machine(machine_, JointVector::interpolate(a, b, 0.5));
    const Vec3 middle_P = X_MP.R.transpose() * Vec3::UnitZ();
    constexpr double kJump_rad =
        20.0 * kRadPerDegree;  // beyond what the two ends span; inserted points do not mend that
    return angle_between(axis_a, middle_P).rad() > angle_between(axis_a, axis_b).rad() + kJump_rad;
  }

  // Turns of one angle within the limits: one (the nearest to `near`) when the axis is free to count turns.
  std::size_t turns(const Axis& axis, double angle, double near, std::array<double, 8>& out) const {
    if (!axis.has_limits()) {
      out[0] = *nearest_turn(axis, angle, near);
      return 1;
    }
    std::size_t count = 0;
    constexpr double kAtLimit = 1e-12;
    for (double k = std::ceil((axis.min - angle - kAtLimit) / kTwoPi);
         angle + k * kTwoPi <= axis.max + kAtLimit; ++k) {
      if (count == out.size()) break;
      out[count++] = std::clamp(angle + k * kTwoPi, axis.min, axis.max);
    }
    return count;
  }

  // All candidates for `pose`; C at the pole and free turns follow `seed`.
  void candidates(const ToolPose& pose, const JointVector& seed, Layer& out) const {
    out.count = 0;
    const double seed_inner = rotary_.empty() ? 0.0 : seed[rotary_.back()];
    const RotarySolutions solutions = rotary_solutions(machine_, pose.axis_P, seed_inner, options_.inverse);
    for (std::size_t i = 0; i < solutions.count; ++i) add_turns(pose, seed, solutions.at[i], out);
  }

  // Whole turns of an axis that may turn for ever make no difference to what follows.
  bool same_position(const JointVector& a, const JointVector& b) const {
    return std::all_of(rotary_.begin(), rotary_.end(), [&](AxisId id) {
      const double d = b[id] - a[id];
      return std::abs(machine_.axes[id].has_limits() ? d : std::remainder(d, kTwoPi)) < 1e-9;
    });
  }

  const std::vector<AxisId>& rotary() const { return rotary_; }

 private:
  void add_turns(const ToolPose& pose, const JointVector& seed, const RotarySolution& solution,
                 Layer& out) const {
    std::array<std::array<double, 8>, 2> angles{};
    std::array<std::size_t, 2> counts = {1, 1};
    for (std::size_t k = 0; k < rotary_.size(); ++k) {
      counts[k] = turns(machine_.axes[rotary_[k]], solution.angle[k], seed[rotary_[k]], angles[k]);
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
  AxisId named_axis_ = 0;
};

std::string degrees_text(double rad) {
  return fixed_text(rad * kDegreePerRad, 4) + " deg";
}

// Why no branch reaches a pose: the tilt itself, or a limit of a rotary axis.
Error unreachable(const Machine& machine, const ChoicePoint& point, const ChoiceOptions& options,
                  const std::string& cl_file) {
  const RotarySolutions solutions = rotary_solutions(machine, point.pose.axis_P, 0.0, options.inverse);
  std::string message = "tool axis (" + fixed_text(point.pose.axis_P.x(), 7) + ", " +
                        fixed_text(point.pose.axis_P.y(), 7) + ", " + fixed_text(point.pose.axis_P.z(), 7) +
                        ") cannot be reached: ";
  const auto rotary = machine.rotary_axes();
  if (solutions.count == 0) {
    message += "the rotary axes miss it by " + degrees_text(solutions.missing_by.rad());
    return {ErrorCode::check_failed, message, cl_file, point.where};
  }
  double least = std::numeric_limits<double>::infinity();
  std::string which;
  for (std::size_t i = 0; i < solutions.count; ++i) {
    double worst = 0.0;
    std::string text;
    for (std::size_t k = 0; k < rotary.size(); ++k) {
      const Axis& axis = machine.axes[rotary[k]];
      if (!axis.has_limits() || nearest_turn(axis, solutions.at[i].angle[k], 0.5 * (axis.min + axis.max)))
        continue;
      // The turn that comes nearest to the travel.
      double by = std::numeric_limits<double>::infinity();
      double best = 0.0;
      for (int turn = -1; turn <= 1; ++turn) {
        const double value = solutions.at[i].angle[k] + turn * kTwoPi;
        const double beyond = std::max(axis.min - value, value - axis.max);
        if (beyond < by) {
          by = beyond;
          best = value;
        }
      }
      if (by > worst) {
        worst = by;
        text = "axis " + axis.name + " would stand at " + degrees_text(best) + ", " + degrees_text(by) +
               " beyond its limits of " + degrees_text(axis.min) + " to " + degrees_text(axis.max);
      }
    }
    if (worst < least) {
      least = worst;
      which = text;
    }
  }
  return {ErrorCode::check_failed, message + which, cl_file, point.where};
}

// Mild preference for the middle of the travel, far below the cost of any motion: it decides ties only.
double centre_preference(const Machine& machine, const std::vector<AxisId>& rotary, const JointVector& q) {
  constexpr double kWeight_s = 1e-6;
  double sum = 0.0;
  for (const AxisId id : rotary) {
    const Axis& axis = machine.axes[id];
    if (axis.has_limits()) sum += std::abs(q[id] - 0.5 * (axis.min + axis.max)) / (axis.max - axis.min);
  }
  return kWeight_s * sum;
}

struct Run {
  const Machine& machine;
  const Chooser& chooser;
  const ChoiceOptions& options;
  const std::string& cl_file;
};

// One step of the dynamic programme: the best way into every candidate of `point`.
void extend(const Run& run, const ChoicePoint& point, const Vec3& axis_before, const Layer& before,
            Layer& after) {
  after.count = 0;
  Layer reached;
  for (std::size_t p = 0; p < before.count; ++p) {
    const Candidate& from = before.at[p];
    run.chooser.candidates(point.pose, from.q, reached);
    for (std::size_t c = 0; c < reached.count; ++c) {
      Candidate next = reached.at[c];
      next.reconfigure =
          !point.rapid && run.chooser.needs_reconfiguration(from.q, next.q, axis_before, point.pose.axis_P);
      next.cost = from.cost + run.chooser.step_cost(from.q, next.q) +
                  (next.reconfigure ? kReconfigureSeconds : 0.0) +
                  centre_preference(run.machine, run.chooser.rotary(), next.q);
      next.from = static_cast<std::uint8_t>(p);
      // The same position reached from another predecessor: keep the cheaper one.
      Candidate* slot = nullptr;
      for (std::size_t k = 0; k < after.count && slot == nullptr; ++k) {
        if (run.chooser.same_position(after.at[k].q, next.q)) slot = &after.at[k];
      }
      if (slot == nullptr && after.count < kMaxCandidates) {
        after.at[after.count++] = next;
      } else if (slot == nullptr) {
        slot = std::max_element(after.at.begin(), after.at.end(),
                                [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
      }
      if (slot != nullptr && next.cost < slot->cost) *slot = next;
    }
  }
}

// What must be kept of a layer to walk back: 24 bytes a candidate instead of a whole Candidate.
struct Trace {
  std::array<double, 2> angle;
  std::uint8_t from;
  std::uint8_t branch;
  bool singular;
  bool reconfigure;
};

Result<void> choose_global(const Run& run, std::span<const ChoicePoint> points, const JointVector& seed,
                           std::vector<ChosenPoint>& out) {
  const auto& rotary = run.chooser.rotary();
  std::vector<Trace> traces;
  std::vector<std::uint32_t> first;  // index of each layer's first trace
  first.reserve(points.size() + 1);
  Layer before;
  before.count = 1;
  before.at[0].q = seed;
  before.at[0].cost = 0.0;
  Vec3 axis_before = tool_pose(forward(run.machine, seed, run.options.tool_mm)).axis_P;
  Layer after;
  for (const ChoicePoint& point : points) {
    extend(run, point, axis_before, before, after);
    if (after.count == 0) return tl::unexpected(unreachable(run.machine, point, run.options, run.cl_file));
    first.push_back(static_cast<std::uint32_t>(traces.size()));
    for (std::size_t c = 0; c < after.count; ++c) {
      Trace t{{}, after.at[c].from, after.at[c].branch, after.at[c].singular, after.at[c].reconfigure};
      for (std::size_t k = 0; k < rotary.size(); ++k) t.angle[k] = after.at[c].q[rotary[k]];
      traces.push_back(t);
    }
    std::swap(before, after);
    axis_before = point.pose.axis_P;
  }
  std::size_t best = 0;
  for (std::size_t c = 1; c < before.count; ++c) {
    if (before.at[c].cost < before.at[best].cost) best = c;
  }
  const std::size_t begin = out.size();
  out.resize(begin + points.size());
  for (std::size_t i = points.size(); i-- > 0;) {
    const Trace& t = traces[first[i] + best];
    ChosenPoint& chosen = out[begin + i];
    chosen.q = seed;
    for (std::size_t k = 0; k < rotary.size(); ++k) chosen.q[rotary[k]] = t.angle[k];
    solve_linear(run.machine, points[i].pose.tip_P, run.options.tool_mm, chosen.q);
    chosen.branch = t.branch;
    chosen.singular = t.singular;
    chosen.reconfigure = t.reconfigure;
    best = t.from;
  }
  return {};
}

Result<void> choose_local(const Run& run, std::span<const ChoicePoint> points, const JointVector& seed,
                          std::vector<ChosenPoint>& out) {
  JointVector q = seed;
  Vec3 axis_before = tool_pose(forward(run.machine, seed, run.options.tool_mm)).axis_P;
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
    const bool leave =
        !point.rapid && run.chooser.needs_reconfiguration(q, c.q, axis_before, point.pose.axis_P);
    out.push_back({c.q, c.branch, c.singular, leave, c.q});
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
  if (turn == 0.0 || points[last + 1].rapid) return;
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
  for (ChosenPoint& c : chosen) c.q_leave = c.q;
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
  const auto chosen = options.method == ChoiceMethod::global ? choose_global(run, points, seed, out)
                                                             : choose_local(run, points, seed, out);
  if (!chosen) return chosen;
  settle_poles(run, points, std::span(out).subspan(begin), summary);
  JointVector before = seed;
  std::uint8_t branch = begin > 0 ? out[begin - 1].branch : out.empty() ? std::uint8_t{0} : out[begin].branch;
  for (std::size_t i = begin; i < out.size(); ++i) {
    summary.axis_time_s += chooser.step_cost(before, out[i].q);
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
  return {};
}

}  // namespace trunnion::path
