#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/plan.hpp"
#include "trunnion/machine/kinematics.hpp"

namespace trunnion::diagnosis {
namespace {

struct Pass {
  std::vector<JointVector> poses;
  std::vector<Vec3> radial;  // of a circle, else empty
  bool approached = false;   // the first pose is reached in the direction of the second (overrun of a sweep)
};

JointVector moved(const JointVector& q, AxisId axis, double value) {
  JointVector out = q;
  out[axis] = value;
  return out;
}

double fraction(std::size_t i, std::size_t points) {
  return points < 2 ? 0.0 : static_cast<double>(i) / static_cast<double>(points - 1);
}

Result<Pass> once(const PlanPoses& path, const PlanRun&, const Machine&) {
  return Pass{path.poses, {}, false};
}

Result<Pass> once(const PlanSweep& path, const PlanRun&, const Machine&) {
  Pass pass;
  for (std::size_t i = 0; i < path.points; ++i)
    pass.poses.push_back(
        moved(path.base, path.axis, path.from + fraction(i, path.points) * (path.to - path.from)));
  pass.approached = true;
  return pass;
}

Result<Pass> once(const PlanLine& path, const PlanRun&, const Machine&) {
  Pass pass;
  for (std::size_t i = 0; i < path.points; ++i)
    pass.poses.push_back(JointVector::interpolate(path.from, path.to, fraction(i, path.points)));
  pass.approached = true;
  return pass;
}

Result<Pass> once(const PlanCircle& path, const PlanRun&, const Machine& machine) {
  Pass pass;
  for (std::size_t i = 0; i < path.points; ++i) {
    const double phi = kTwoPi * static_cast<double>(i) / static_cast<double>(path.points);
    JointVector q = path.base;
    q[path.first] += path.radius_mm * std::cos(phi);
    q[path.second] += path.radius_mm * std::sin(phi);
    pass.poses.push_back(q);
    const auto out = [&](AxisId a) {
      return machine.axes[a].direction * (machine.axes[a].carries_part ? -1.0 : 1.0);
    };
    pass.radial.push_back((std::cos(phi) * out(path.first) + std::sin(phi) * out(path.second)).normalized());
  }
  pass.approached = true;
  return pass;
}

Result<Pass> once(const PlanGrid& path, const PlanRun& run, const Machine& machine) {
  Pass pass;
  pass.poses = {path.base};
  for (const auto& [axis, values] : path.values) {
    std::vector<JointVector> next;
    for (const JointVector& q : pass.poses)
      for (const double value : values) next.push_back(moved(q, axis, value));
    pass.poses = std::move(next);
  }
  if (path.ball_P)
    for (JointVector& q : pass.poses) solve_linear(machine, *path.ball_P, run.tool_mm, q);
  return pass;
}

double hold(const PlanProfile& profile, double time_s) {
  double value = profile.empty() ? 0.0 : profile.front().second;
  for (const auto& [at, v] : profile)
    if (at <= time_s) value = v;
  return value;
}

double line(const PlanProfile& profile, double time_s) {
  if (profile.empty()) return 0.0;
  if (time_s <= profile.front().first) return profile.front().second;
  for (std::size_t i = 1; i < profile.size(); ++i) {
    const auto [t0, v0] = profile[i - 1];
    const auto [t1, v1] = profile[i];
    if (time_s < t1) return v0 + (v1 - v0) * (time_s - t0) / (t1 - t0);
  }
  return profile.back().second;
}

// Axis velocities at feed: the feed is that of the linear axes together, or of the rotary ones in deg/min
// where no linear one moves.
JointVector velocity(const Machine& machine, const JointVector& from, const JointVector& to, double feed) {
  double linear = 0.0, rotary = 0.0;
  for (AxisId a = 0; a < machine.axes.size(); ++a) {
    const double step = to[a] - from[a];
    (machine.axes[a].kind == AxisKind::linear ? linear : rotary) += step * step;
  }
  JointVector v;
  const double path = linear > 0.0 ? std::sqrt(linear) : std::sqrt(rotary) * kDegreePerRad;
  if (!(path > 0.0)) return v;
  for (AxisId a = 0; a < machine.axes.size(); ++a) v[a] = (to[a] - from[a]) / path * feed;
  return v;
}

class Expander {
 public:
  Expander(const std::vector<PlanRun>& runs, const Machine& machine, const EffectContext& known)
      : machine_(machine), context_(known) {
    for (const PlanRun& run : runs) {
      for (const auto& [name, profile] : run.temperatures_K) add_name(context_.names.temperatures, name);
      for (const auto& [name, profile] : run.states) add_name(context_.names.states, name);
    }
    width_ = context_.names.temperatures.size() + context_.names.states.size();
  }

  Result<void> add(const PlanRun& run) {
    auto pass = std::visit([&](const auto& path) { return once(path, run, machine_); }, run.path);
    if (!pass) return tl::unexpected(pass.error());
    for (const JointVector& q : pass->poses)
      for (const LimitViolation& v : limit_violations(machine_, q)) return refuse(run, v);
    const std::size_t passes = run.repeat * (run.both_directions ? 2 : 1);
    const double seconds = run.minutes * kSecondsPerMinute / static_cast<double>(passes * pass->poses.size());
    context_.runs.push_back({run.id, run.minutes * kSecondsPerMinute});
    DirectionTracker tracker(1e-9);
    double time_s = 0.0;
    for (std::size_t p = 0; p < passes; ++p) {
      if (p > 0 && run.both_directions) {
        std::reverse(pass->poses.begin(), pass->poses.end());
        std::reverse(pass->radial.begin(), pass->radial.end());
      }
      JointVector before = pass->poses.front();
      if (pass->approached && pass->poses.size() > 1) {
        before = JointVector::interpolate(pass->poses[0], pass->poses[1], -1.0);
        tracker.move_to(pass->poses[0]);
        tracker.move_to(before);
      }
      for (std::size_t i = 0; i < pass->poses.size(); ++i, time_s += seconds) {
        MachineState state;
        state.q = pass->poses[i];
        state.direction = tracker.move_to(state.q);
        if (run.feed_mm_s > 0.0) state.velocity = velocity(machine_, before, state.q, run.feed_mm_s);
        state.time_s = time_s;
        state.run = context_.runs.size() - 1;
        add_row(run, state,
                pass->radial.empty() || !run.radial ? std::nullopt : std::optional(pass->radial[i]));
        before = state.q;
      }
    }
    return {};
  }

  Dataset finish() {
    for (std::size_t i = 0; i < states_.size(); ++i) {
      const std::span<const double> all(values_.data() + i * width_, width_);
      states_[i].temperature_K = all.first(context_.names.temperatures.size());
      states_[i].state = all.subspan(context_.names.temperatures.size());
    }
    Dataset data = make_dataset(context_, states_, std::move(rows_), std::move(readings_));
    data.files = {"plan"};
    return data;
  }

 private:
  static void add_name(std::vector<std::string>& names, const std::string& name) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  Result<void> refuse(const PlanRun& run, const LimitViolation& v) const {
    const Axis& axis = machine_.axes[v.axis];
    const double unit = axis.kind == AxisKind::linear ? 1.0 : kDegreePerRad;
    return fail(ErrorCode::wrong_input, "run '" + run.id + "' wants " + axis.name + " = " +
                                            shortest_text(v.value * unit) + ", beyond its limit by " +
                                            shortest_text(v.by * unit) +
                                            (axis.kind == AxisKind::linear ? " mm" : " deg"));
  }
  void add_row(const PlanRun& run, MachineState& state, std::optional<Vec3> radial) {
    state.spindle_rpm = hold(run.spindle_rpm, state.time_s);
    const auto value = [&](const auto& profiles, const std::string& name) {
      const auto it = profiles.find(name);
      return it == profiles.end() ? 0.0 : line(it->second, state.time_s);
    };
    for (const auto& name : context_.names.temperatures) values_.push_back(value(run.temperatures_K, name));
    for (const auto& name : context_.names.states) values_.push_back(value(run.states, name));
    const std::vector<Vec3> directions = radial ? std::vector<Vec3>{*radial} : run.n;
    for (const Vec3& n : directions) {
      Reading reading{rows_.size(), run.quantity, run.frame, n, 0.0, run.u_random, run.u_common, 0};
      if (!run.u_common_known) reading.u_common = std::nullopt;
      readings_.push_back(reading);
    }
    states_.push_back(state);
    rows_.push_back({0, static_cast<std::uint32_t>(rows_.size() + 2), run.tool_mm});
  }

  const Machine& machine_;
  EffectContext context_;
  std::size_t width_ = 0;
  std::vector<MachineState> states_;
  std::vector<double> values_;
  std::vector<RowOrigin> rows_;
  std::vector<Reading> readings_;
};

}  // namespace

Result<Dataset> expand(const std::vector<PlanRun>& runs, const Machine& machine, const EffectContext& known) {
  Expander expander(runs, machine, known);
  for (const PlanRun& run : runs)
    if (auto added = expander.add(run); !added) return tl::unexpected(added.error());
  return expander.finish();
}

}  // namespace trunnion::diagnosis
