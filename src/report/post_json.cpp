#include "trunnion/report/post_json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;

ordered_json vector_json(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

ordered_json travel_json(const post::AxisTravel& t) {
  const bool rotary = t.axis.kind == AxisKind::rotary;
  const double factor = rotary ? kDegreePerRad : 1.0;
  const std::string unit = rotary ? "_deg" : "_mm";
  ordered_json out = {{"axis", t.axis.name},
                      {"smallest" + unit, t.smallest * factor},
                      {"largest" + unit, t.largest * factor}};
  if (!t.axis.has_limits()) return out;
  out["min" + unit] = t.axis.min * factor;
  out["max" + unit] = t.axis.max * factor;
  out["room" + unit] = std::min(t.smallest - t.axis.min, t.axis.max - t.largest) * factor;
  return out;
}

const char* source_text(post::LengthSource source) {
  switch (source) {
    case post::LengthSource::tool_file:
      return "tool file";
    case post::LengthSource::cl_file:
      return "CL file";
    case post::LengthSource::option:
      return "--tool-length-mm";
    default:
      return "machine file";
  }
}

ordered_json tools_json(const std::vector<post::LoadedTool>& tools) {
  ordered_json out = ordered_json::array();
  for (const post::LoadedTool& tool : tools) {
    ordered_json one = {{"tool", nullptr}, {"gauge_length_mm", tool.length_mm}};
    if (tool.number) {
      one["tool"] = *tool.number;
      one["length_register"] = tool.length_register;
    }
    one["length_from"] = source_text(tool.source);
    out.push_back(one);
  }
  return out;
}

ordered_json check_json(post::CheckOf of, const post::Check& check) {
  ordered_json out = {{"check", post::name_of(of)},
                      {"result", post::name_of(check.state)},
                      {"compared", check.about},
                      {"places", check.count}};
  auto& first = out["first"] = ordered_json::array();
  for (const post::CheckPlace& place : check.places)
    first.push_back({{"nc_line", place.nc_line}, {"what", place.what}});
  return out;
}

ordered_json verify_object(const post::VerifyReport& r) {
  ordered_json out;
  out["max_tip_deviation_mm"] = r.max_tip_deviation_mm;
  out["certified_tip_deviation_mm"] = r.certified_tip_deviation_mm;
  out["certified"] = r.certified;
  out["sampled_blocks"] = r.sampled_blocks;
  out["unproved_effects"] = r.unproved_effects;
  out["max_axis_deviation_deg"] = r.max_axis_deviation.deg();
  out["max_axis_deviation_at_tip_deg"] = r.max_axis_deviation_at_tip.deg();
  out["max_pole_axis_deviation_deg"] = r.max_pole_axis_deviation.deg();
  out["pole_tolerance_deg"] = r.pole_tolerance.deg();
  out["flute_length_mm"] = r.flute_mm;
  out["max_flute_deviation_mm"] = r.max_flute_deviation_mm;
  out["certified_flute_deviation_mm"] = r.certified_flute_deviation_mm;
  out["certified_pole_flute_deviation_mm"] = r.certified_pole_flute_deviation_mm;
  out["pole_flute_tolerance_mm"] = r.pole_flute_tolerance_mm;
  out["max_point_deviation_mm"] = r.max_point_deviation_mm;
  out["max_rapid_deviation_mm"] = r.max_rapid_deviation_mm;
  out["rapid_tolerance_mm"] = r.rapid_tolerance_mm;
  out["worst_rapid"] = {{"nc_line", r.worst_rapid.nc_line}, {"cl_line", r.worst_rapid.cl_line}};
  out["unsafe_moves"] = r.unsafe_count;
  auto& unsafe = out["unsafe"] = ordered_json::array();
  for (const auto& u : r.unsafe) unsafe.push_back({{"nc_line", u.nc_line}, {"what", u.what}});
  out["tolerance_mm"] = r.tolerance_mm;
  out["axis_tolerance_deg"] = r.axis_tolerance.deg();
  out["points_in"] = r.points_in;
  out["points_out"] = r.points_out;
  out["points_missed"] = r.points_missed;
  out["blocks"] = r.feed_blocks + r.rapid_blocks;
  out["feed_blocks"] = r.feed_blocks;
  out["rapid_blocks"] = r.rapid_blocks;
  out["duration_s"] = r.duration_s;
  out["estimated_s"] = nullptr;
  if (r.estimated_s) {
    out["estimated_s"] = *r.estimated_s;
    out["feeds_not_reached"] = r.feeds_not_reached;
    out["max_feed_excess"] = r.max_feed_excess;
    out["max_feed_excess_nc_line"] = r.max_feed_excess_nc_line;
  }
  out["max_axis_speed_ratio"] = r.max_speed_ratio;
  out["axis_speeds_ok"] = r.speeds_ok();
  out["blocks_too_fast"] = r.too_fast_count;
  // Who left it to another verification of the same text has no table.
  if (!r.checks[0].about.empty()) {
    auto& checks = out["checks"] = ordered_json::array();
    for (std::size_t i = 0; i < post::kChecks; ++i)
      checks.push_back(check_json(static_cast<post::CheckOf>(i), r.checks[i]));
  }
  out["limits_ok"] = r.limits_ok();
  out["within_tolerance"] = r.within_tolerance();
  out["passed"] = r.passed();
  out["machine"] = r.on_truth ? "with errors" : "nominal";
  auto& limits = out["beyond_limits"] = ordered_json::array();
  for (const auto& b : r.beyond_limits) {
    const bool rotary = b.kind == AxisKind::rotary;
    const double factor = rotary ? kDegreePerRad : 1.0;
    limits.push_back({{"axis", b.axis},
                      {"nc_line", b.nc_line},
                      {"cl_line", b.cl_line},
                      {rotary ? "value_deg" : "value_mm", b.value * factor},
                      {rotary ? "by_deg" : "by_mm", b.by * factor}});
  }
  auto& travel = out["travel"] = ordered_json::array();
  for (const auto& t : r.travel) travel.push_back(travel_json(t));
  auto& fast = out["too_fast"] = ordered_json::array();
  for (const auto& f : r.too_fast) {
    fast.push_back(
        {{"axis", f.axis}, {"nc_line", f.nc_line}, {"cl_line", f.cl_line}, {"speed_ratio", f.ratio}});
  }
  auto& worst = out["worst"] = ordered_json::array();
  for (const auto& w : r.worst) {
    worst.push_back({{"nc_line", w.nc_line},
                     {"cl_line", w.cl_line},
                     {"tip_deviation_mm", w.tip_mm},
                     {"axis_deviation_deg", w.axis.deg()},
                     {"tip_mm", vector_json(w.tip_P)}});
  }
  return out;
}

}  // namespace

std::string verify_json(const post::VerifyReport& report) {
  return json_text(verify_object(report));
}

std::string post_json(const post::PostReport& r) {
  ordered_json out = r.verification ? verify_object(*r.verification) : ordered_json::object();
  out["verified"] = r.verification.has_value();
  out["offset_shifts"] = r.offset_shifts;
  out["offset_sigma_mm"] = r.head.offset_sigma_mm;
  out["shift_error_mm"] = r.shift_error_mm;
  out["lag_step_mm"] = r.lag_step_mm;
  out["run_time_bend_mm"] = r.run_time_bend_mm;
  out["points_in"] = r.points_in;
  out["points_inserted"] = r.points_inserted;
  out["segments_with_points"] = r.segments_with_points;
  out["segments_not_converged"] = r.segments_not_converged;
  out["worst_predicted_mm"] = r.worst_predicted_mm;
  out["worst_programmed_mm"] = r.worst_programmed_mm;
  out["branch_changes"] = r.choice.branch_changes;
  out["pole_points"] = r.choice.pole_points;
  out["reconfigurations"] = r.choice.reconfigurations;
  out["turns_in_place"] = r.choice.turns_in_place;
  out["rewinds_at_rapids"] = r.rewinds_at_rapids;
  out["pole_stretches_tilted"] = r.pole_stretches;
  out["largest_pole_tilt_deg"] = r.largest_pole_tilt.deg();
  out["pole_turns_early"] = r.pole_turns_early;
  out["pole_turns_cutting"] = r.pole_turns_cutting;
  out["tilted_planes"] = r.tilted_planes;
  out["arcs"] = r.arcs;
  out["holes"] = r.holes;
  out["shapes_as_moves"] = r.shapes_as_moves;
  out["axis_time_s"] = r.choice.axis_time_s;
  out["rotary_travel_deg"] = r.choice.rotary_travel_rad * kDegreePerRad;
  out["duration_s"] = r.duration_s;
  out["feed_time_lost_s"] = r.feed_time_lost_s;
  out["blocks_held"] = r.blocks_held;
  out["largest_error_mm"] = r.largest_error_mm;
  out["largest_correction_mm"] = r.largest_correction_mm;
  out["nc_lines"] = r.nc_lines;
  out["tools"] = tools_json(r.tools);
  if (r.nominal_verification) out["nominal"] = verify_object(*r.nominal_verification);
  return json_text(out);
}

}  // namespace trunnion::report
