#include "trunnion/report/study_page.hpp"

#include <algorithm>
#include <array>

#include "trunnion/report/study_json.hpp"

#include "report/nc_figures.hpp"
#include "report/svg.hpp"
#include "report/texts.hpp"

namespace trunnion::report {
namespace {

std::string count(std::size_t n) {
  return std::to_string(n);
}

std::string um_number(double mm) {
  return short_number(mm * kUmPerMm, 4);
}

std::string ratio(std::size_t a, std::size_t b) {
  return b == 0 ? "–" : short_number(static_cast<double>(a) / static_cast<double>(b), 4);
}

Table counts_table(const path::StudyResult& result) {
  Table out;
  out.id = "counts";
  out.title = "Inserted points";
  out.caption =
      "Optimum: longest steps on the chord, each proved. Law: lower bound, no placement with fixed ends "
      "needs fewer points than the sum of ceil((I + 1.172)/4) - 1. From 8 pieces on: two-sided over "
      "on-chord, on segments that need 8 or more.";
  out.columns = {"tolerance (µm)", "moves",
                 "segments",       "over tolerance",
                 "optimum",        "on chord",
                 "/ optimum",      "two-sided",
                 "/ law",          "from 8 pieces on",
                 "points moved",   "/ on chord",
                 "not met",        "largest proved (µm)"};
  out.numeric.assign(out.columns.size(), true);
  out.numeric[1] = false;
  for (const path::ToleranceStudy& t : result.tolerances) {
    if (t.segments == 0) continue;
    const auto& chord = t.placements[0];
    const auto& sides = t.placements[1];
    const auto& moved = t.placements[2];
    double largest = 0.0;
    for (const auto& p : t.placements) largest = std::max(largest, p.largest_certified_mm);
    out.rows.push_back(
        {um_number(t.tolerance_mm), t.links ? "links" : "cutting", count(t.segments), count(t.over),
         count(t.greedy), count(chord.inserted), ratio(chord.inserted, t.greedy), count(sides.inserted),
         ratio(sides.inserted, t.two_sided_law), ratio(sides.inserted_many, chord.inserted_many),
         t.links ? "–" : count(moved.inserted), t.links ? "–" : ratio(moved.inserted, chord.inserted),
         count(chord.unconverged + sides.unconverged + moved.unconverged), um_number(largest)});
  }
  return out;
}

Figure counts_figure(const path::StudyResult& result) {
  XyPlot plot;
  plot.x = {"tolerance", "µm", true};
  plot.y = {"inserted points, cutting moves", "", true};
  const std::array<const char*, 5> names{"on-chord optimum", "on chord", "two-sided", "two-sided law",
                                         "points moved"};
  for (const char* name : names) {
    Series s;
    s.name = name;
    plot.series.push_back(std::move(s));
  }
  for (const path::ToleranceStudy& t : result.tolerances) {
    if (t.segments == 0 || t.links) continue;
    const std::array<std::size_t, 5> n{t.greedy, t.placements[0].inserted, t.placements[1].inserted,
                                       t.two_sided_law, t.placements[2].inserted};
    for (std::size_t i = 0; i < n.size(); ++i) {
      if (n[i] == 0) continue;  // no place on a logarithmic scale
      plot.series[i].x.push_back(t.tolerance_mm * kUmPerMm);
      plot.series[i].y.push_back(static_cast<double>(n[i]));
    }
  }
  std::erase_if(plot.series, [](const Series& s) { return s.x.empty(); });
  return {"points", "Points that the tolerance costs",
          "Programmed points are not counted. Every piece is proved to be within the tolerance.",
          std::move(plot)};
}

Table predictors_table(const path::StudyResult& result) {
  Table out;
  out.id = "predictors";
  out.title = "What a predictor leaves of the error";
  out.caption = "max |e - predicted| / max |e| over cutting segments with an error above 0.01 µm.";
  out.columns = {"predictor",        "segments", "RMS", "median", "99 %", "worst", "CL line of the worst",
                 "largest left (µm)"};
  out.numeric.assign(out.columns.size(), true);
  out.numeric[0] = false;
  for (const path::PredictorStudy& p : result.predictors) {
    out.rows.push_back({path::predictor_text(p.predictor), count(p.segments), short_number(p.rms, 3),
                        short_number(p.median, 3), short_number(p.p99, 3), short_number(p.worst, 3),
                        std::to_string(p.worst_line), um_number(p.worst_left_mm)});
  }
  return out;
}

Figure predictors_figure(const path::StudyResult& result) {
  XyPlot plot;
  plot.y = {"share of the error that is left", "", true};
  Series rms;
  rms.name = "RMS";
  rms.mark = Mark::points;
  Series worst = rms;
  worst.name = "worst segment";
  // A predictor that is exact to rounding has no place on a logarithmic scale.
  constexpr double kLeast = 1e-9;
  for (const path::PredictorStudy& p : result.predictors) {
    const auto x = static_cast<double>(plot.categories.size());
    plot.categories.push_back(path::predictor_text(p.predictor));
    rms.x.push_back(x);
    rms.y.push_back(std::max(p.rms, kLeast));
    worst.x.push_back(x);
    worst.y.push_back(std::max(p.worst, kLeast));
  }
  plot.series = {std::move(rms), std::move(worst)};
  return {"left", "What a predictor leaves", "", std::move(plot)};
}

Table worst_table(const path::StudyResult& result) {
  Table out;
  out.id = "worst";
  out.title = "Errors without inserted points: proved beside predicted (µm)";
  out.caption =
      "The harmonic fails where a rotary axis turns by more than 60° or the error is S-shaped, so that its "
      "middle tells nothing.";
  out.columns = {"CL line", "largest rotary step (°)", "proved"};
  for (const path::PredictorStudy& p : result.predictors)
    out.columns.push_back(path::predictor_text(p.predictor));
  out.columns.emplace_back("harmonic holds");
  out.numeric.assign(out.columns.size(), true);
  out.numeric.back() = false;
  for (const path::SegmentStudy& s : result.worst) {
    std::vector<std::string> row{std::to_string(s.where.line), short_number(s.largest_turn.deg(), 4),
                                 um_number(s.certified_mm)};
    for (const double mm : s.predicted_mm) row.push_back(um_number(mm));
    row.emplace_back(s.harmonic_fails ? "no" : "yes");
    out.rows.push_back(std::move(row));
  }
  return out;
}

}  // namespace

Page study_page(const path::StudyResult& result, const std::string& cl_file, const std::string& made_by) {
  Page page;
  page.title = "Nonlinear error of " + cl_file;
  page.made_by = made_by;
  page.result_json = study_json(result);
  std::size_t unmet = 0;
  for (const path::ToleranceStudy& t : result.tolerances) {
    for (const path::PlacementStudy& p : t.placements) unmet += p.unconverged;
  }
  page.tone = unmet == 0 ? Tone::good : Tone::bad;
  if (result.worst.empty() || result.worst.front().certified_mm < 1e-9) {
    page.verdict = "No segment of this path has a nonlinear error.";
  } else {
    const path::SegmentStudy& worst = result.worst.front();
    page.verdict = "As programmed the tip strays by up to " + um_text(kUmPerMm * worst.certified_mm) +
                   " (proved; CL line " + std::to_string(worst.where.line) + "). " +
                   (unmet == 0 ? "Every placement meets every tolerance, proved on every piece."
                               : count(unmet) + " segments did not meet their tolerance.");
    page.facts.push_back({"largest_error_mm", "error without inserted points",
                          um_text(kUmPerMm * worst.certified_mm), worst.certified_mm});
  }
  page.sections.push_back({"Points by placement", {counts_figure(result), counts_table(result)}});
  page.sections.push_back({"Predictors", {predictors_figure(result), predictors_table(result)}});
  if (!result.worst.empty()) page.sections.push_back({"Worst segments", {worst_table(result)}});
  return page;
}

}  // namespace trunnion::report
