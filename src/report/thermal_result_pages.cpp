#include <algorithm>
#include <cmath>

#include "trunnion/report/command_pages.hpp"

#include "report/json_figures.hpp"
#include "report/svg.hpp"
#include "report/texts.hpp"

namespace trunnion::report {
namespace {

// The sensors of which `key` is true.
std::vector<std::string> chosen(const ordered_json& sensors, std::string_view key) {
  std::vector<std::string> out;
  for (const auto& s : sensors) {
    const auto it = s.find(key);
    if (it != s.end() && it->is_boolean() && it->get<bool>()) out.push_back(text_at(s, "name"));
  }
  return out;
}

std::string screened(const std::string& channel, const ordered_json& j) {
  const auto by_runs = chosen(j["sensors"], "chosen_by_held_out_runs");
  const auto& left = j["heldout_rmse_um"];
  return channel + ": " + (by_runs.empty() ? "no sensor helps" : "use " + joined(by_runs, ", ")) +
         "; the error on held-out runs is " + um_text(number_at(left, "chosen_by_held_out_runs")) +
         " (with all sensors " + um_text(number_at(left, "all")) + ", with those chosen by p " +
         um_text(number_at(left, "chosen_by_p")) + ").";
}

Section screen_section(const std::string& channel, const ordered_json& j) {
  Section out{channel, {}};
  XyPlot folds = bar_plot({"share of folds in which p chooses it", ""}, texts_of(j["sensors"], "name"));
  folds.series.reserve(2);
  add_bars(folds, "chosen by p", numbers_of(j["sensors"], "share_of_folds_chosen_by_p"));
  std::vector<double> kept;
  for (const auto& s : j["sensors"]) kept.push_back(s["chosen_by_held_out_runs"].get<bool>() ? 1.0 : 0.0);
  add_bars(folds, "chosen by held-out runs", kept);
  out.items.emplace_back(Figure{"sensors-" + channel, "Which sensors follow " + channel,
                                "Sensors that p chooses in only some folds are chosen by chance. Second bar "
                                "= 1: the sensor reduces the error on runs left out.",
                                std::move(folds)});
  const auto& left = j["heldout_rmse_um"];
  XyPlot error = bar_plot({"error on held-out runs", "µm"}, {"all sensors", "chosen by p", "chosen by runs"});
  add_bars(
      error, "",
      {number_at(left, "all"), number_at(left, "chosen_by_p"), number_at(left, "chosen_by_held_out_runs")});
  out.items.emplace_back(Figure{"left-" + channel, "What each choice leaves",
                                "Root mean square on runs that the choice and the fit never saw.",
                                std::move(error)});
  Table table = table_of(j["sensors"], {{"name", "sensor"},
                                        {"chosen_by_held_out_runs", "chosen by held-out runs"},
                                        {"chosen_by_p", "chosen by p"},
                                        {"p_value", "p", 2},
                                        {"share_of_folds_chosen_by_p", "share of folds", 3},
                                        {"vif", "variance inflation", 3},
                                        {"shapiro_wilk_W", "Shapiro-Wilk W", 3},
                                        {"shapiro_wilk_p", "its p", 2}});
  table.id = "table-" + channel;
  table.title = "Sensors";
  table.caption = cell_text(j["measurements"]) + " measurements in " + cell_text(j["runs"]) +
                  " runs; condition number " + cell_text(j["condition_number"], 3) +
                  "; agreement of the sensors chosen by p between folds (Jaccard index): " +
                  cell_text(j["jaccard_of_p"], 3) + ".";
  out.items.emplace_back(std::move(table));
  for (const auto& warning : j["warnings"])
    out.items.emplace_back(Paragraph{as_sentence(cell_text(warning))});
  return out;
}

}  // namespace

Page thermal_screen_page(const ResultText& result) {
  Page page = opened(result);
  page.tone = Tone::neutral;
  const auto json = ordered_json::parse(result.json);
  page.verdict.clear();
  for (const auto& [channel, j] : json["channels"].items()) {
    page.verdict += (page.verdict.empty() ? "" : " ") + screened(channel, j);
    page.sections.push_back(screen_section(channel, j));
  }
  return page;
}

Page thermal_split_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  page.tone = json["refused"].empty() ? Tone::good : Tone::bad;
  const ordered_json rows = named_rows(json.value("parameters", ordered_json::object()));
  ordered_json known = ordered_json::array();
  for (const auto& row : rows)
    if (row["identifiable"].get<bool>()) known.push_back(row);
  // What moved is what is asked for; whether these poses can tell stands behind it.
  const auto most = std::max_element(known.begin(), known.end(), [](const auto& a, const auto& b) {
    return std::abs(number_at(a, "value_um")) < std::abs(number_at(b, "value_um"));
  });
  if (most != known.end())
    page.verdict = "Moved most since the datum: " + text_at(*most, "name") + ", by " +
                   um_text(number_at(*most, "value_um")) + " (standard deviation " +
                   um_text(number_at(*most, "sigma_um")) + "). " + page.verdict;
  page.verdict += " Rank " + cell_text(json["rank"]) + " of " + cell_text(json["parameters_count"]) +
                  "; the displacements are met within " + um_text(number_at(json, "rms_um")) + " rms.";
  XyPlot plot = bar_plot({"moved since the datum", "µm"}, texts_of(known, "name"));
  Series points;
  points.mark = Mark::points;
  points.y = numbers_of(known, "value_um");
  points.y2 = numbers_of(known, "sigma_um");
  for (double& s : points.y2) s *= 2.0;
  for (std::size_t i = 0; i < points.y.size(); ++i) points.x.push_back(static_cast<double>(i));
  plot.series.push_back(std::move(points));
  plot.levels.push_back({"", 0.0});
  Table table = table_of(rows, {{"name", "what moved"},
                                {"value_um", "by / µm"},
                                {"sigma_um", "sigma / µm", 3},
                                {"identifiable", "told apart"}});
  table.id = "parameters";
  table.title = "What moved";
  Section section{"What moved", {}};
  section.items.emplace_back(Figure{"moved", "Tool and axes since the datum",
                                    "Whiskers: twice the standard deviation. What these poses do not tell "
                                    "apart is not drawn.",
                                    std::move(plot)});
  section.items.emplace_back(std::move(table));
  for (const auto& words : json["null_directions"])
    section.items.emplace_back(Paragraph{"Not told apart: " + cell_text(words)});
  page.sections.push_back(std::move(section));
  return page;
}

Page thermal_assess_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  page.tone = Tone::neutral;
  const double tolerance_um = 1e3 * number_at(json, "tolerance_mm");
  page.verdict += " Within " + um_text(tolerance_um) + ": " +
                  short_number(100 * number_at(json, "share_within_after"), 3) + " % of the blades, " +
                  short_number(100 * number_at(json, "share_within_before"), 3) +
                  " % without correction; rms " + um_text(number_at(json, "rms_after_um")) + " after " +
                  um_text(number_at(json, "rms_before_um")) + ".";
  const auto& blades = json["blades"];
  XyPlot plot;
  plot.x = {"blade, in the order of cutting", ""};
  plot.y = {"largest deviation", "µm"};
  for (const auto& [key, name] : {std::pair{"before_um", "without"}, std::pair{"after_um", "corrected"}}) {
    Series s;
    s.name = name;
    s.mark = Mark::points;
    s.y = numbers_of(blades, key);
    for (std::size_t i = 0; i < s.y.size(); ++i) {
      s.x.push_back(static_cast<double>(i + 1));
      s.labels.push_back(text_at(blades[i], "run_id"));
    }
    plot.series.push_back(std::move(s));
  }
  plot.levels.push_back({"tolerance", tolerance_um});
  Table table = table_of(
      blades,
      {{"run_id", "run"}, {"blade", "blade"}, {"before_um", "without / µm"}, {"after_um", "corrected / µm"}});
  table.id = "blades";
  table.title = "Blades";
  page.sections.push_back(
      {"Blade by blade",
       {Figure{"blades-plot", "Before and after, blade by blade",
               "Measuring alone leaves " + um_text(number_at(json, "measurement_floor_um")) + ".",
               std::move(plot)},
        std::move(table)}});
  return page;
}

}  // namespace trunnion::report
