#include "trunnion/report/trace_page.hpp"

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

#include "report/svg.hpp"

namespace trunnion::report {
namespace {

constexpr double kSameCut_s = 0.2;  // rows farther apart are of different cuts

Figure traced_path(const trace::TraceReport& trace) {
  SpacePlot plot;
  plot.frame = "part frame P";
  plot.colour = {"tip deviation", "µm"};
  double last_s = trace.course.front().time_s;
  for (const auto& place : trace.course) {
    plot.x.push_back(place.tip_P.x());
    plot.y.push_back(place.tip_P.y());
    plot.z.push_back(place.tip_P.z());
    plot.value.push_back(place.time_s - last_s > kSameCut_s ? kGap : place.tip_mm / kMmPerUm);
    last_s = place.time_s;
  }
  return {
      "traced-path", "Where the tip really was, coloured by its deviation",
      "Tool tip in the part frame from the positions of the trace, feed moves; distance from the CL path.",
      std::move(plot)};
}

Figure traced_deviation(const trace::TraceReport& trace, double tolerance_mm) {
  XyPlot plot{{"time of the trace", "s"},
              {"tip deviation", "µm"},
              {},
              {{"tolerance", tolerance_mm / kMmPerUm}},
              {},
              false};
  Series series;
  series.name = "trace";
  double last_s = trace.course.front().time_s;
  for (const auto& place : trace.course) {
    if (place.time_s - last_s > kSameCut_s) {
      series.x.push_back(last_s);
      series.y.push_back(kGap);
    }
    last_s = place.time_s;
    series.x.push_back(place.time_s);
    series.y.push_back(place.tip_mm / kMmPerUm);
  }
  plot.series.push_back(std::move(series));
  return {"traced-deviation", "Deviation in time",
          "Distance of the tip from the CL path, row by row; feed moves.", std::move(plot)};
}

Table cause_table(const trace::TraceReport& trace) {
  Table table{"trace-causes",
              "Why, as far as the rows show it",
              "Share: of the squared deviation from the program.",
              {"cause", "share / %", "NC line", "time / s"},
              {false, true, true, true},
              {},
              {}};
  for (const auto& cause : trace.causes)
    table.rows.push_back({cause.text, cause.share > 0.0 ? fixed_text(100.0 * cause.share, 1) : "",
                          std::to_string(cause.place.nc_line), fixed_text(cause.place.time_s, 3)});
  return table;
}

Table slow_table(const trace::TraceReport& trace) {
  Table table{"trace-slow",
              "Blocks that took longest beside the plan",
              "Planned: by F and the rapid rates, with dwells.",
              {"NC line", "planned / s", "took / s", "begun / s"},
              {true, true, true, true},
              {},
              {}};
  for (const auto& block : trace.slow)
    table.rows.push_back({std::to_string(block.nc_line), fixed_text(block.planned_s, 4),
                          fixed_text(block.actual_s, 4), fixed_text(block.time_s, 3)});
  return table;
}

}  // namespace

Section trace_section(const trace::TraceReport& trace, double tolerance_mm) {
  Section section{"What the control really did", {}};
  if (trace.course.empty()) return section;
  section.items.emplace_back(traced_path(trace));
  section.items.emplace_back(traced_deviation(trace, tolerance_mm));
  if (!trace.causes.empty()) section.items.emplace_back(cause_table(trace));
  if (!trace.slow.empty()) section.items.emplace_back(slow_table(trace));
  return section;
}

}  // namespace trunnion::report
