#include <algorithm>
#include <cmath>

#include "trunnion/report/command_pages.hpp"

#include "report/json_figures.hpp"
#include "report/svg.hpp"
#include "report/texts.hpp"

namespace trunnion::report {
namespace {

std::string per_cent(double share) {
  return short_number(100.0 * share, 3) + " %";
}

const ordered_json* named(const ordered_json& rows, const std::string& name, double nodes = kGap) {
  for (const auto& row : rows) {
    if (text_at(row, "name") == name && (std::isnan(nodes) || number_at(row, "nodes") == nodes)) return &row;
  }
  return nullptr;
}

// What is left at random points over the number of nodes, a line for each kind of model.
Figure by_nodes(const ordered_json& json) {
  XyPlot plot;
  plot.x = {"nodes an axis", ""};
  plot.y = {"error left at random points, rms", "µm", true};  // one table hides the others
  std::vector<std::string> names;
  for (const auto& name : texts_of(json["models"], "name")) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  for (const auto& name : names) {
    Series s;
    s.name = name;
    std::vector<std::pair<double, double>> points;
    for (const auto& row : json["models"]) {
      if (text_at(row, "name") == name)
        points.emplace_back(number_at(row, "nodes"), number_at(row, "random_rms_after_um"));
    }
    std::sort(points.begin(), points.end());
    if (points.size() < 2) s.mark = Mark::points;
    for (const auto& [x, y] : points) s.x.push_back(x), s.y.push_back(y);
    plot.series.push_back(std::move(s));
  }
  plot.levels.push_back({"noise of a mean", number_at(json, "floor_rms_um")});
  return {"nodes", "What each kind of table leaves",
          "At random points that no table was made of; dashed: the noise of a mean of the runs.",
          std::move(plot)};
}

Figure diagonals(const ordered_json& model) {
  const auto& lines = model["diagonals"];
  XyPlot plot = bar_plot({"peak to valley", "µm"}, texts_of(lines, "name"));
  add_bars(plot, "before", numbers_of(lines, "before_um"));
  add_bars(plot, "predicted", numbers_of(lines, "predicted_um"));
  add_bars(plot, "measured on a fresh run", numbers_of(lines, "measured_um"));
  return {"diagonals", "The diagonals with the best table",
          "What the table says will be left, beside what a fresh run then shows.", std::move(plot)};
}

}  // namespace

Page cross_talk_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  page.tone = Tone::good;
  const auto& best = json["best"];
  const ordered_json* model = named(json["models"], text_at(best, "name"), number_at(best, "nodes"));
  Section first{"What is left", {by_nodes(json)}};
  if (model != nullptr) {
    page.verdict += " It leaves " + um_text(number_at(*model, "random_rms_after_um")) + " of " +
                    um_text(number_at(*model, "random_rms_before_um")) + " rms.";
    page.facts.push_back({"reduction", "removed at random points", per_cent(number_at(best, "reduction")),
                          number_at(best, "reduction")});
    first.items.emplace_back(diagonals(*model));
  }
  page.facts.push_back({"position_x_um", "positioning of the first axis, peak to valley",
                        um_text(number_at(json, "position_x_um")), number_at(json, "position_x_um")});
  page.facts.push_back({"position_y_um", "positioning of the second axis, peak to valley",
                        um_text(number_at(json, "position_y_um")), number_at(json, "position_y_um")});
  page.facts.push_back({"floor_rms_um", "noise of a mean of the runs",
                        um_text(number_at(json, "floor_rms_um")), number_at(json, "floor_rms_um")});
  Table table = table_of(json["models"], {{"name", "model"},
                                          {"nodes", "nodes an axis"},
                                          {"heldout_rms_before_um", "held out before / µm", 3},
                                          {"heldout_rms_after_um", "after / µm", 3},
                                          {"random_rms_before_um", "random points before / µm", 3},
                                          {"random_rms_after_um", "after / µm", 3},
                                          {"random_rms_after_measured_um", "after, measured / µm", 3},
                                          {"reduction", "removed", 3},
                                          {"evaluation_us", "one position / µs", 2}});
  table.id = "models";
  table.title = "All models";
  first.items.emplace_back(std::move(table));
  page.sections.push_back(std::move(first));
  return page;
}

Page table_choice_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  const auto& models = json["models"];
  const std::string best = text_at(json, "chosen");
  page.tone = Tone::good;
  if (const ordered_json* row = named(models, best)) {
    page.verdict = best + " suits best: it leaves " + um_text(number_at(*row, "heldout_rms_after_um")) +
                   " of " + um_text(number_at(*row, "heldout_rms_before_um")) +
                   " rms at points that it never saw (" + per_cent(number_at(*row, "reduction")) +
                   " removed).";
  }
  XyPlot plot = bar_plot({"rms at held-out points", "µm"}, texts_of(models, "name"));
  add_bars(plot, "before", numbers_of(models, "heldout_rms_before_um"));
  add_bars(plot, "after", numbers_of(models, "heldout_rms_after_um"));
  Table table = table_of(models, {{"name", "table"},
                                  {"heldout_rms_before_um", "rms before / µm"},
                                  {"heldout_rms_after_um", "rms after / µm"},
                                  {"heldout_max_before_um", "largest before / µm"},
                                  {"heldout_max_after_um", "largest after / µm"},
                                  {"reduction", "removed", 3}});
  table.id = "models";
  table.title = "All kinds of table";
  page.sections.push_back({"What is left",
                           {Figure{"left", "What each kind of table leaves",
                                   "Held out: " + text_at(json, "held_out_by") + ".", std::move(plot)},
                            std::move(table)}});
  if (json.contains("gate")) {
    const auto& gate = json["gate"];
    const bool passed = gate["passed"].get<bool>();
    if (!passed) page.tone = Tone::bad;
    page.verdict += passed ? " No independent line gets worse." : " An independent line gets worse: refused.";
    XyPlot lines = bar_plot({"peak to valley", "µm"}, texts_of(gate["lines"], "name"));
    add_bars(lines, "before", numbers_of(gate["lines"], "before_um"));
    add_bars(lines, "after", numbers_of(gate["lines"], "after_um"));
    Table rows =
        table_of(gate["lines"], {{"name", "line"}, {"before_um", "before / µm"}, {"after_um", "after / µm"}});
    rows.id = "lines";
    rows.title = "Independent lines";
    page.sections.push_back(
        {"Independent lines",
         {Figure{"lines-plot", "Independent lines with the chosen table", "", std::move(lines)},
          std::move(rows)}});
  }
  return page;
}

}  // namespace trunnion::report
