#include "trunnion/report/probe_json.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "trunnion/base/number_text.hpp"
#include "trunnion/probe/axis_lines.hpp"

#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;

ordered_json number_or_null(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

ordered_json rotary_json(const Machine& machine, const JointVector& q) {
  ordered_json out = ordered_json::object();
  for (const AxisId id : machine.rotary_axes()) {
    // The double nearest to the decimal number of the word.
    constexpr double kDigits = 1e9;
    out[machine.axes[id].name + "_deg"] = std::round(q[id] * kDegreePerRad * kDigits) / kDigits;
  }
  return out;
}

ordered_json vector_json(const Vec3& v, double factor) {
  return {v.x() * factor, v.y() * factor, v.z() * factor};
}

std::string figure(double value, double unit, int decimals) {
  return std::isfinite(value) ? fixed_text(value / unit, decimals) : "not seen";
}

}  // namespace

std::string probe_program_json(const Machine& machine, const probe::MadeProgram& program) {
  ordered_json out;
  out["poses"] = ordered_json::array();
  for (const JointVector& q : program.chosen.poses) out["poses"].push_back(rotary_json(machine, q));
  out["touches"] = program.touches;
  out["seconds"] = std::round(program.seconds);
  const auto& s = program.chosen.sigma_of_um;
  const auto axes = machine.rotary_axes();
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const std::size_t at = 4 * k;
    out["sigma_of_um"][machine.axes[axes[k]].name] = {
        {"point_mm", {number_or_null(s[at]), number_or_null(s[at + 1])}},
        {"direction_urad",
         {number_or_null(s[at + 2] / kRadPerUrad), number_or_null(s[at + 3] / kRadPerUrad)}}};
  }
  return json_text(out);
}

std::string probe_program_text(const Machine& machine, const probe::MadeProgram& program) {
  std::string out = std::to_string(program.chosen.poses.size()) + " poses, " +
                    std::to_string(program.touches) + " touches, about " +
                    fixed_text(program.seconds / kSecondsPerMinute, 0) + " min\n";
  const auto& s = program.chosen.sigma_of_um;
  const auto axes = machine.rotary_axes();
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const std::size_t at = 4 * k;
    const std::string& name = machine.axes[axes[k]].name;
    if (std::none_of(&s[at], &s[at] + 4, [](double v) { return std::isfinite(v); })) {
      out += "these poses do not show where axis " + name + " is: it does not move, or hardly\n";
      continue;
    }
    out += "per 1 um of uncertainty of a ball centre: position of axis " + name + " to " +
           figure(s[at], kMmPerUm, 1) + " and " + figure(s[at + 1], kMmPerUm, 1) + " um, direction to " +
           figure(s[at + 2], kRadPerUrad, 1) + " and " + figure(s[at + 3], kRadPerUrad, 1) + " urad\n";
  }
  return out;
}

std::string probe_reading_json(const Machine& machine, const probe::Strokes& strokes,
                               const probe::ProbeReading& reading) {
  ordered_json out;
  out["poses"] = ordered_json::array();
  for (const probe::PoseReading& pose : reading.poses) {
    ordered_json one = rotary_json(machine, pose.q);
    double worst = 0.0;
    for (const double r : pose.sphere.residuals_mm) worst = std::max(worst, std::abs(r));
    one["center_mm"] = vector_json(pose.sphere.center_mm, 1.0);
    one["radius_mm"] = pose.free_radius_mm;
    one["worst_residual_um"] = worst / kMmPerUm;
    one["deviation_um"] = vector_json(pose.deviation_M, 1.0 / kMmPerUm);
    one["u_um"] = vector_json(pose.u_mm, 1.0 / kMmPerUm);
    out["poses"].push_back(one);
  }
  out["radius_mm"] = reading.radius_mm;
  out["u_radius_um"] = reading.u_radius_mm / kMmPerUm;
  out["expected_radius_mm"] = strokes.ball.reach_mm();
  out["scatter_um"] = reading.scatter_mm / kMmPerUm;
  out["fast_less_slow_um"] = reading.fast_less_slow_mm / kMmPerUm;
  out["u_common_z_um"] = reading.u_common_z_mm / kMmPerUm;
  out["lobes"] = ordered_json::array();
  for (const probe::Lobes& one : reading.lobes) {
    out["lobes"].push_back({{"count", one.count},
                            {"size_um", one.size_mm() / kMmPerUm},
                            {"cos_um", one.cos_mm / kMmPerUm},
                            {"sin_um", one.sin_mm / kMmPerUm},
                            {"u_um", one.u_mm / kMmPerUm}});
  }
  return json_text(out);
}

std::string probe_reading_text(const Machine& machine, const probe::Strokes& strokes,
                               const probe::ProbeReading& reading) {
  double farthest = 0.0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < reading.poses.size(); ++i) {
    if (reading.poses[i].deviation_M.norm() <= farthest) continue;
    farthest = reading.poses[i].deviation_M.norm();
    at = i;
  }
  std::string lobes;
  for (const probe::Lobes& one : reading.lobes) {
    lobes += "the probe travels by direction, " + std::to_string(one.count) +
             " times round the spindle: " + fixed_text(one.size_mm() / kMmPerUm, 2) + " um, taken out\n";
  }
  return std::to_string(reading.poses.size()) + " poses; one touch scatters by " +
         fixed_text(reading.scatter_mm / kMmPerUm, 2) + " um about its sphere\neffective radius " +
         fixed_text(reading.radius_mm, 4) + " mm, ball and stylus " + fixed_text(strokes.ball.reach_mm(), 4) +
         " mm\nthe ball is farthest from where the machine file has it at " + strokes.pose_text(machine, at) +
         ": " + fixed_text(farthest, 4) + " mm\n" + lobes;
}

}  // namespace trunnion::report
