#include "trunnion/report/calibration_json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "trunnion/base/number_text.hpp"

#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;

ordered_json vector_of(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

std::string in_column(const std::string& text, std::size_t width) {
  return text + std::string(width > text.size() ? width - text.size() : 1, ' ');
}

}  // namespace

std::string calibration_json(const probe::Calibration& c, const std::vector<std::string>& control_lines) {
  ordered_json out;
  out["parameters"] = ordered_json::object();
  for (const auto& e : c.estimates)
    out["parameters"][e.name] = {{"value", e.value}, {"sigma", e.sigma}, {"was", e.was}, {"seen", e.seen}};
  out["axes"] = ordered_json::object();
  for (const AxisId id : c.machine.rotary_axes()) {
    const Axis& axis = c.machine.axes[id];
    out["axes"][axis.name] = {{"point_mm", vector_of(axis.point_mm)},
                              {"direction", vector_of(axis.direction)}};
  }
  for (const auto& e : c.linear) out["linear_axes"][e.name] = {{"value", e.value}, {"sigma", e.sigma}};
  out["turned_round"] = c.turned_round;
  out["not_seen"] = c.not_seen;
  out["rms_before_um"] = c.rms_before_mm / kMmPerUm;
  out["rms_after_um"] = c.rms_after_mm / kMmPerUm;
  out["chi2"] = c.chi2;
  out["dof"] = c.freedom;
  out["readings"] = c.readings;
  if (c.misfit)
    out["misfit"] = {{"factor", c.misfit->factor},
                     {"sigma_factor", c.misfit->sigma_factor},
                     {"worst_run", c.misfit->worst_run},
                     {"worst_run_rms_um", c.misfit->worst_rms_mm / kMmPerUm}};
  if (!control_lines.empty()) out["control_parameters"] = control_lines;
  return json_text(out);
}

std::string calibration_text(const probe::Calibration& c, const std::vector<std::string>& control_lines) {
  std::string out =
      std::to_string(c.readings) + " displacements: " + fixed_text(c.rms_before_mm / kMmPerUm, 2) +
      " um RMS by the machine file, " + fixed_text(c.rms_after_mm / kMmPerUm, 2) + " um after; chi-square " +
      fixed_text(c.chi2, 1) + " for " + fixed_text(c.freedom, 1) + " degrees of freedom\n";
  for (const std::string& name : c.turned_round) out += "axis " + name + " turns the other way round\n";
  std::size_t width = 0;
  for (const auto& e : c.estimates) width = std::max(width, e.name.size() + 2);
  for (const auto& e : c.estimates) {
    // Angles are written with the digits of a micrometre a metre away.
    const bool length = e.name.ends_with("_mm");
    const int decimals = length ? 4 : 7;
    out += "  " + in_column(e.name, width) + in_column(fixed_text(e.was, decimals), 13) + "-> " +
           in_column(fixed_text(e.value, decimals), 13) + "sigma " + fixed_text(e.sigma, decimals + 1) +
           (e.seen ? "" : "   not seen") + "\n";
  }
  for (const std::string& line : c.not_seen) out += "not seen: " + line + "\n";
  if (!control_lines.empty()) out += "the control's own numbers:\n";
  for (const std::string& line : control_lines) out += "  " + line + "\n";
  return out;
}

}  // namespace trunnion::report
