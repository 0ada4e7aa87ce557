#include "trunnion/report/study_json.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;

ordered_json predictors_json(const path::StudyResult& result) {
  ordered_json out = ordered_json::array();
  for (const path::PredictorStudy& p : result.predictors) {
    out.push_back({{"predictor", path::predictor_text(p.predictor)},
                   {"segments", p.segments},
                   {"left_rms", p.rms},
                   {"left_median", p.median},
                   {"left_p99", p.p99},
                   {"left_worst", p.worst},
                   {"left_worst_mm", p.worst_left_mm},
                   {"worst_cl_line", p.worst_line}});
  }
  return out;
}

ordered_json placement_json(const path::PlacementStudy& p) {
  return {{"placement", p.placement},
          {"inserted", p.inserted},
          {"inserted_where_8_or_more", p.inserted_many},
          {"unconverged", p.unconverged},
          {"segments_with_more_than_on_chord", p.more_than_on_chord},
          {"certified_tip_deviation_mm", p.largest_certified_mm},
          {"certified_axis_deviation_deg", p.largest_axis.deg()}};
}

// A share of counts; null where there is nothing to compare with.
ordered_json share(std::size_t a, std::size_t b) {
  return b == 0 ? ordered_json(nullptr) : ordered_json(static_cast<double>(a) / static_cast<double>(b));
}

ordered_json tolerances_json(const path::StudyResult& result) {
  ordered_json out = ordered_json::array();
  for (const path::ToleranceStudy& t : result.tolerances) {
    if (t.segments == 0) continue;
    ordered_json placements = ordered_json::array();
    for (const path::PlacementStudy& p : t.placements) placements.push_back(placement_json(p));
    out.push_back({{"tolerance_mm", t.tolerance_mm},
                   {"moves", t.links ? "links" : "cutting"},
                   {"segments", t.segments},
                   {"segments_over_tolerance", t.over},
                   {"on_chord_optimum", t.greedy},
                   {"two_sided_law", t.two_sided_law},
                   {"on_chord_over_optimum", share(t.placements[0].inserted, t.greedy)},
                   {"two_sided_over_law", share(t.placements[1].inserted, t.two_sided_law)},
                   {"two_sided_over_on_chord_where_8_or_more",
                    share(t.placements[1].inserted_many, t.placements[0].inserted_many)},
                   {"moved_over_on_chord", share(t.placements[2].inserted, t.placements[0].inserted)},
                   {"placements", placements}});
  }
  return out;
}

ordered_json worst_json(const path::StudyResult& result) {
  ordered_json out = ordered_json::array();
  for (const path::SegmentStudy& s : result.worst) {
    ordered_json predicted;
    for (std::size_t i = 0; i < s.predicted_mm.size(); ++i) {
      predicted[path::predictor_text(result.predictors[i].predictor)] = s.predicted_mm[i];
    }
    out.push_back({{"cl_line", s.where.line},
                   {"largest_rotary_step_deg", s.largest_turn.deg()},
                   {"certified_mm", s.certified_mm},
                   {"predicted_mm", predicted},
                   {"harmonic_fails", s.harmonic_fails}});
  }
  return out;
}

}  // namespace

std::string study_json(const path::StudyResult& result) {
  const ordered_json out{{"predictors", predictors_json(result)},
                         {"tolerances", tolerances_json(result)},
                         {"worst_segments", worst_json(result)}};
  return json_text(out);
}

std::string study_text(const path::StudyResult& result) {
  char line[256];
  std::string out =
      "predictor    segments  left of the error: rms    median       p99     worst  (CL line)\n";
  for (const path::PredictorStudy& p : result.predictors) {
    std::snprintf(line, sizeof line, "%-12s %8zu %23.2g %9.2g %9.2g %9.2g  (%u)\n",
                  path::predictor_text(p.predictor).c_str(), p.segments, p.rms, p.median, p.p99, p.worst,
                  p.worst_line);
    out += line;
  }
  out +=
      "\ntolerance mm  moves     over  optimum on chord  on chord  two-sided (law)   moved  certified mm\n";
  for (const path::ToleranceStudy& t : result.tolerances) {
    if (t.segments == 0) continue;
    const auto& p = t.placements;
    double certified = 0.0;
    for (const path::PlacementStudy& placement : p)
      certified = std::max(certified, placement.largest_certified_mm);
    std::snprintf(line, sizeof line, "%-13g %-8s %5zu %17zu %9zu %10zu (%zu) %7zu  %.6f\n", t.tolerance_mm,
                  t.links ? "links" : "cutting", t.over, t.greedy, p[0].inserted, p[1].inserted,
                  t.two_sided_law, p[2].inserted, certified);
    out += line;
  }
  if (result.worst.empty()) return out;
  std::size_t failing = 0;
  for (const path::SegmentStudy& s : result.worst) failing += s.harmonic_fails ? 1 : 0;
  const path::SegmentStudy& s = result.worst.front();
  std::snprintf(line, sizeof line,
                "\nerror without inserted points: %.6f mm proved, %.6f mm predicted by the harmonic (CL line "
                "%u, rotary step %.2f deg)\n",
                s.certified_mm, s.predicted_mm.front(), s.where.line, s.largest_turn.deg());
  out += line;
  return out + "the harmonic fails on " + std::to_string(failing) + " of the " +
         std::to_string(result.worst.size()) + " worst segments\n";
}

}  // namespace trunnion::report
