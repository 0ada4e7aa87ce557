#include "trunnion/report/trace_json.hpp"

#include <nlohmann/json.hpp>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/report/post_json.hpp"

#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;

ordered_json place_json(const trace::TracePlace& place) {
  return {{"time_s", place.time_s},
          {"nc_line", place.nc_line},
          {"cl_line", place.cl_line},
          {"tip_deviation_mm", place.tip_mm},
          {"axis_deviation_deg", place.axis_rad * kDegreePerRad},
          {"flute_deviation_mm", place.flute_mm},
          {"tip_mm", {place.tip_P.x(), place.tip_P.y(), place.tip_P.z()}}};
}

ordered_json cause_json(const trace::Cause& cause) {
  ordered_json out = {{"kind", cause.kind}, {"axis", nullptr}, {"value", cause.value}, {"unit", cause.unit}};
  if (!cause.axis.empty()) out["axis"] = cause.axis;
  if (cause.sigma > 0.0) out["sigma"] = cause.sigma;
  if (cause.share > 0.0) out["share"] = cause.share;
  out["time_s"] = cause.place.time_s;
  out["nc_line"] = cause.place.nc_line;
  out["cl_line"] = cause.place.cl_line;
  out["text"] = cause.text;
  return out;
}

ordered_json trace_object(const trace::TraceReport& t) {
  ordered_json out = {{"max_tip_deviation_mm", t.max_tip_deviation_mm},
                      {"rms_tip_deviation_mm", t.rms_tip_deviation_mm},
                      {"max_axis_deviation_deg", t.max_axis_deviation_rad * kDegreePerRad},
                      {"flute_length_mm", t.flute_mm},
                      {"max_flute_deviation_mm", t.max_flute_deviation_mm},
                      {"max_rapid_deviation_mm", t.max_rapid_deviation_mm},
                      {"scatter_mm", t.scatter_mm},
                      {"uncertainty_mm", t.uncertainty_mm},
                      {"within_tolerance", t.within_tolerance},
                      {"duration_s", t.duration_s},
                      {"planned_s", t.planned_s},
                      {"estimated_s", t.planned_s + t.more_s},
                      {"elsewhere_s", t.elsewhere_s},
                      {"begins_s", t.begins_s},
                      {"complete", t.coverage.complete},
                      {"share_of_feed_path", t.coverage.share},
                      {"first_nc_line", t.coverage.first_nc_line},
                      {"last_nc_line", t.coverage.last_nc_line},
                      {"samples", t.coverage.samples},
                      {"samples_along_program", t.coverage.on_path},
                      {"samples_left_out", t.coverage.left_out},
                      {"largest_gap_s", t.coverage.largest_gap_s},
                      {"largest_step_mm", t.coverage.largest_step_mm}};
  out["worst"] = place_json(t.worst);
  auto& places = out["places"] = ordered_json::array();
  for (const auto& place : t.places) places.push_back(place_json(place));
  auto& blocks = out["slowest_blocks"] = ordered_json::array();
  for (const auto& b : t.slow)
    blocks.push_back({{"nc_line", b.nc_line},
                      {"planned_s", b.planned_s},
                      {"duration_s", b.actual_s},
                      {"time_s", b.time_s}});
  auto& causes = out["causes"] = ordered_json::array();
  for (const auto& cause : t.causes) causes.push_back(cause_json(cause));
  out["remarks"] = t.remarks;
  return out;
}

std::string deviation_text(double mm) {
  return fixed_text(mm / kMmPerUm, 2) + " um";
}

}  // namespace

std::string verify_json(const post::VerifyReport& report, const trace::TraceReport& trace) {
  ordered_json out = ordered_json::parse(verify_json(report));
  out["trace"] = trace_object(trace);
  return json_text(out);
}

std::vector<std::string> trace_lines(const trace::TraceReport& t, double tolerance_mm) {
  std::vector<std::string> out;
  out.push_back("trace: the tip was off the CL path by " + deviation_text(t.max_tip_deviation_mm) +
                " at most (RMS " + deviation_text(t.rms_tip_deviation_mm) + ", known within " +
                deviation_text(t.uncertainty_mm) + "), tolerance " + deviation_text(tolerance_mm) +
                "; the tool axis by " + fixed_text(t.max_axis_deviation_rad * kDegreePerRad, 4) + " deg" +
                (t.flute_mm > 0.0 ? "; the flute by " + deviation_text(t.max_flute_deviation_mm) : ""));
  out.push_back("trace: worst at " + fixed_text(t.worst.time_s, 3) + " s, NC line " +
                std::to_string(t.worst.nc_line) + ", CL line " + std::to_string(t.worst.cl_line));
  out.push_back("trace: " + fixed_text(t.duration_s, 3) + " s, planned " + fixed_text(t.planned_s, 3) + " s" +
                (t.more_s > 0.0
                     ? ", with the axes' accelerations " + fixed_text(t.planned_s + t.more_s, 3) + " s"
                     : "") +
                (t.coverage.complete ? "" : " (a part of the program)"));
  for (const auto& cause : t.causes)
    out.push_back("trace: " + cause.text +
                  (cause.share > 0.0
                       ? " (" + fixed_text(100.0 * cause.share, 0) + " % of the squared deviation)"
                       : ""));
  for (const std::string& remark : t.remarks) out.push_back("trace: " + remark);
  return out;
}

}  // namespace trunnion::report
