#include <cmath>

#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/plan.hpp"

namespace trunnion::diagnosis {
namespace {

using config::Array;
using config::Table;
using config::Value;

// Ten digits are enough for a pose and hide the noise of radians.
double tidy(double value) {
  if (value == 0.0 || !std::isfinite(value)) return 0.0;
  const double scale = std::pow(10.0, 10.0 - std::ceil(std::log10(std::abs(value))));
  return std::round(value * scale) / scale;
}
Value real(double value) {
  return {tidy(value), {}};
}
Value text(std::string value) {
  return {std::move(value), {}};
}
Value whole(std::size_t value) {
  return {static_cast<std::int64_t>(value), {}};
}
Value vector(const Vec3& v) {
  return {Array{real(v.x()), real(v.y()), real(v.z())}, {}};
}

class PlanTableWriter {
 public:
  PlanTableWriter(const PlanRun& run, const Machine& machine) : run_(run), machine_(machine) {}

  Table table() {
    put("id", text(run_.id));
    put("minutes", real(run_.minutes));
    put("quantity", text(run_.quantity == Quantity::displacement ? "displacement" : "rotation"));
    if (run_.radial)
      put("n", text("radial"));
    else {
      Array n;
      for (const Vec3& v : run_.n) n.push_back(vector(v));
      put("n", {std::move(n), {}});
    }
    put("frame", text(run_.frame == SensitivityFrame::machine ? "machine" : "part"));
    put("tool_z_mm", real(run_.tool_mm.z()));
    const double unit = run_.quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad;
    put("u_random", real(run_.u_random / unit));
    put("u_common", real(run_.u_common / unit));
    if (run_.feed_mm_s > 0.0) put("feed_mm_min", real(run_.feed_mm_s * kSecondsPerMinute));
    put("repeat", whole(run_.repeat));
    put("both_directions", {run_.both_directions, {}});
    profiles();
    std::visit([&](const auto& path) { this->path(path); }, run_.path);
    return std::move(out_);
  }

 private:
  void put(const std::string& key, Value value) { out_.emplace_back(key, std::move(value)); }
  double unit(AxisId a) const { return machine_.axes[a].kind == AxisKind::linear ? 1.0 : kDegreePerRad; }
  std::string key(AxisId a) const {
    return machine_.axes[a].name + (machine_.axes[a].kind == AxisKind::linear ? "_mm" : "_deg");
  }
  Table position(const JointVector& q) const {
    Table out;
    for (AxisId a = 0; a < machine_.axes.size(); ++a)
      if (q[a] != 0.0) out.emplace_back(key(a), real(q[a] * unit(a)));
    return out;
  }
  void put_base(const JointVector& q) {
    if (Table at = position(q); !at.empty()) put("at", {std::move(at), {}});
  }
  static Value profile(const PlanProfile& p, double offset) {
    Array rows;
    for (const auto& [t, v] : p) rows.push_back({Array{real(t / kSecondsPerMinute), real(v + offset)}, {}});
    return {std::move(rows), {}};
  }
  void profiles() {
    if (!run_.spindle_rpm.empty()) put("spindle_rpm", profile(run_.spindle_rpm, 0.0));
    for (const auto& [name, p] : run_.temperatures_K)
      put("T_" + name + "_degC", profile(p, machine_.reference_degC));
    for (const auto& [name, p] : run_.states) put("s_" + name, profile(p, 0.0));
  }

  void path(const PlanPoses& path) {
    Array rows;
    for (const JointVector& q : path.poses) {
      Array row;
      for (AxisId a = 0; a < machine_.axes.size(); ++a) row.push_back(real(q[a] * unit(a)));
      rows.push_back({std::move(row), {}});
    }
    put("poses", {std::move(rows), {}});
  }
  void path(const PlanSweep& path) {
    put_base(path.base);
    const std::string suffix = machine_.axes[path.axis].kind == AxisKind::linear ? "_mm" : "_deg";
    put("sweep", {Table{{"axis", text(machine_.axes[path.axis].name)},
                        {"from" + suffix, real(path.from * unit(path.axis))},
                        {"to" + suffix, real(path.to * unit(path.axis))},
                        {"points", whole(path.points)}},
                  {}});
  }
  void path(const PlanLine& path) {
    put("line", {Table{{"from", {position(path.from), {}}},
                       {"to", {position(path.to), {}}},
                       {"points", whole(path.points)}},
                 {}});
  }
  void path(const PlanCircle& path) {
    put_base(path.base);
    put("circle",
        {Table{{"axes",
                {Array{text(machine_.axes[path.first].name), text(machine_.axes[path.second].name)}, {}}},
               {"radius_mm", real(path.radius_mm)},
               {"points", whole(path.points)}},
         {}});
  }
  void path(const PlanGrid& path) {
    put_base(path.base);
    Table grid;
    for (const auto& [axis, values] : path.values) {
      Array list;
      for (const double v : values) list.push_back(real(v * unit(axis)));
      grid.emplace_back(key(axis), Value{std::move(list), {}});
    }
    put("grid", {std::move(grid), {}});
    if (path.ball_P) put("ball_mm", vector(*path.ball_P));
  }

  const PlanRun& run_;
  const Machine& machine_;
  Table out_;
};

}  // namespace

config::Table plan_run_table(const PlanRun& run, const Machine& machine) {
  return PlanTableWriter(run, machine).table();
}

}  // namespace trunnion::diagnosis
