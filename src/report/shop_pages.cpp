#include <algorithm>
#include <cmath>

#include "trunnion/report/command_pages.hpp"

#include "report/json_figures.hpp"
#include "report/nc_figures.hpp"
#include "report/svg.hpp"
#include "report/texts.hpp"

namespace trunnion::report {
namespace {

void add_fact(Page& page, const ordered_json& json, const char* key, const char* label, const char* unit) {
  if (!json.contains(key) || json[key].is_null()) return;
  page.facts.push_back({key, label, cell_text(json[key]) + unit,
                        json[key].is_number() ? std::optional(json[key].get<double>()) : std::nullopt});
}

// The keys of the rotary positions of a pose: "A_deg", "C_deg".
std::vector<std::string> rotary_keys(const ordered_json& pose) {
  std::vector<std::string> out;
  for (const auto& [key, value] : pose.items()) {
    if (key.ends_with("_deg") && value.is_number()) out.push_back(key);
  }
  return out;
}

std::string axis_of(const std::string& key) {
  return key.substr(0, key.find('_'));
}

// Where the rotary axes stand, one point a pose.
std::optional<Figure> poses_figure(const ordered_json& poses) {
  if (poses.empty()) return std::nullopt;
  const auto keys = rotary_keys(poses.front());
  if (keys.empty()) return std::nullopt;
  XyPlot plot;
  plot.x = {keys.back().empty() ? "" : axis_of(keys.back()), "°"};
  plot.y = {keys.size() > 1 ? axis_of(keys.front()) : "pose", keys.size() > 1 ? "°" : ""};
  Series s;
  s.mark = Mark::points;
  double number = 0.0;
  for (const auto& pose : poses) {
    number += 1.0;
    s.x.push_back(number_at(pose, keys.back()));
    s.y.push_back(keys.size() > 1 ? number_at(pose, keys.front()) : number);
    s.labels.push_back("pose " + short_number(number));
  }
  plot.series.push_back(std::move(s));
  return Figure{"poses", "Poses of the rotary axes", "One point a pose.", std::move(plot)};
}

// The poses of a run of a plan: as listed, or all combinations of a grid's values.
ordered_json poses_of(const ordered_json& run) {
  if (run.contains("poses")) return run["poses"];
  ordered_json out = ordered_json::array();
  if (!run.contains("grid")) return out;
  out.push_back(ordered_json::object());
  for (const auto& [key, values] : run["grid"].items()) {
    ordered_json more = ordered_json::array();
    for (const auto& pose : out) {
      for (const auto& value : values) {
        more.push_back(pose);
        more.back()[key] = value;
      }
    }
    out = std::move(more);
  }
  return out;
}

Table poses_table(const ordered_json& poses, std::vector<Column> more) {
  ordered_json rows = poses;
  std::vector<std::string> titles;
  const auto keys = poses.empty() ? std::vector<std::string>() : rotary_keys(poses.front());
  titles.reserve(keys.size());
  for (const auto& key : keys) titles.push_back(axis_of(key) + " / °");
  std::vector<Column> columns = {{"pose", "pose"}};
  for (std::size_t i = 0; i < keys.size(); ++i) columns.push_back({keys[i].c_str(), titles[i].c_str(), 6});
  columns.insert(columns.end(), more.begin(), more.end());
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i]["pose"] = std::to_string(i + 1);
  Table out = table_of(rows, columns);
  out.id = "poses-table";
  out.title = "Poses";
  return out;
}

// The spread of 4.5 decades that a certificate can have: logarithmic.
Figure batch_figure(const ordered_json& items) {
  constexpr std::size_t kMost = 60;
  constexpr double kLeast_um = 0.01;  // a logarithmic scale has no zero
  ordered_json drawn = ordered_json::array();
  for (const auto& item : items)
    if (std::isfinite(number_at(item, "certified_tip_deviation_mm"))) drawn.push_back(item);
  std::stable_sort(drawn.begin(), drawn.end(), [](const auto& a, const auto& b) {
    return number_at(a, "certified_tip_deviation_mm") > number_at(b, "certified_tip_deviation_mm");
  });
  const std::size_t all = drawn.size();
  if (all > kMost) drawn.erase(drawn.begin() + kMost, drawn.end());
  XyPlot plot = bar_plot({"tip within", "µm"}, texts_of(drawn, "output"));
  std::vector<double> um;
  for (const auto& item : drawn)
    um.push_back(std::max(1e3 * number_at(item, "certified_tip_deviation_mm"), kLeast_um));
  add_bars(plot, "", um);
  return {"within", "How near each program stays to its path",
          all > kMost
              ? "The " + std::to_string(kMost) + " of " + std::to_string(all) + " programs that stray most."
              : "Bound of the tip's distance from the path, worst first.",
          std::move(plot)};
}

}  // namespace

Page batch_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  const bool failed = number_at(json, "failed") > 0 || number_at(json, "not_run") > 0;
  page.tone = failed ? Tone::bad : Tone::good;
  ordered_json items = json["items"];
  const ordered_json* worst = nullptr;
  for (const auto& item : items) {
    const double mm = number_at(item, "certified_tip_deviation_mm");
    if (std::isfinite(mm) && (worst == nullptr || mm > number_at(*worst, "certified_tip_deviation_mm")))
      worst = &item;
  }
  if (worst != nullptr)
    page.verdict += " " + text_at(*worst, "output") + " strays most: within " +
                    um_text(1e3 * number_at(*worst, "certified_tip_deviation_mm")) + " of its path.";
  for (const auto& [key, label] : {std::pair{"files", "files"}, std::pair{"posted", "posted"},
                                   std::pair{"skipped", "unchanged"}, std::pair{"failed", "failed"},
                                   std::pair{"would_post", "to be posted"}, std::pair{"not_run", "not run"}})
    add_fact(page, json, key, label, "");
  std::stable_sort(items.begin(), items.end(), [](const auto& a, const auto& b) {
    return (text_at(a, "state") == "failed") > (text_at(b, "state") == "failed");
  });
  // In the unit of the sentence and the picture.
  ordered_json rows = items;
  for (auto& row : rows)
    if (row.contains("certified_tip_deviation_mm") && row["certified_tip_deviation_mm"].is_number())
      row["tip_um"] = 1e3 * number_at(row, "certified_tip_deviation_mm");
  Table table = table_of(rows, {{"output", "program"},
                                {"state", "state"},
                                {"within_tolerance", "within tolerance"},
                                {"tip_um", "tip within / µm", 4},
                                {"points_in", "CL points"},
                                {"points_inserted", "inserted"},
                                {"seconds", "seconds", 3},
                                {"error", "error"},
                                {"warnings", "warnings"}});
  table.id = "programs";
  table.title = "Programs";
  table.caption = "What failed stands first.";
  Section section{"Programs", {}};
  if (worst != nullptr) section.items.emplace_back(batch_figure(items));
  section.items.emplace_back(std::move(table));
  page.sections.push_back(std::move(section));
  return page;
}

Page calibration_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  page.tone = json["not_seen"].empty() ? Tone::good : Tone::neutral;
  page.verdict = "The new axes meet " + cell_text(json["readings"]) + " readings within " +
                 um_text(number_at(json, "rms_after_um")) + " rms; by the machine file it was " +
                 um_text(number_at(json, "rms_before_um")) + ".";
  if (json.contains("misfit")) {
    page.tone = Tone::bad;
    page.verdict += " They are not explained by them: they scatter by " +
                    cell_text(json["misfit"]["factor"]) + " times their stated uncertainty, and run '" +
                    text_at(json["misfit"], "worst_run") + "' fits worst, " +
                    um_text(number_at(json["misfit"], "worst_run_rms_um")) + " rms.";
  }
  if (!json["turned_round"].empty())
    page.verdict += " Turned the other way round: " + list_text(json["turned_round"]) + ".";
  const std::size_t blind = json["not_seen"].size();
  if (blind > 0)
    page.verdict += " " + std::to_string(blind) + " things are not seen by these readings (below the table).";
  add_fact(page, json, "chi2", "chi-square", "");
  add_fact(page, json, "dof", "degrees of freedom", "");
  XyPlot error = bar_plot({"rms of the readings", "µm"}, {"by the machine file", "calibrated"});
  add_bars(error, "", {number_at(json, "rms_before_um"), number_at(json, "rms_after_um")});
  const ordered_json rows = named_rows(json["parameters"]);
  Section section{"What changed", {}};
  section.items.emplace_back(Figure{"before-after", "Residual before and after", "", std::move(error)});
  // Lengths and directions have scales of their own.
  for (const auto& [unit, ending] : {std::pair{"µm", "_mm"}, std::pair{"µrad", ""}}) {
    XyPlot plot = bar_plot({"change", unit}, {});
    Series s;
    s.mark = Mark::points;
    for (const auto& row : rows) {
      const bool length = text_at(row, "name").ends_with("_mm");
      if (length != (std::string_view(ending) == "_mm") || !row["seen"].get<bool>()) continue;
      const double factor = length ? 1e3 : 1e6;
      s.x.push_back(static_cast<double>(plot.categories.size()));
      s.y.push_back(factor * (number_at(row, "value") - number_at(row, "was")));
      s.y2.push_back(2.0 * factor * number_at(row, "sigma"));
      plot.categories.push_back(text_at(row, "name"));
    }
    if (s.y.empty()) continue;
    plot.series.push_back(std::move(s));
    plot.levels.push_back({"", 0.0});
    section.items.emplace_back(Figure{
        std::string_view(ending) == "_mm" ? "points" : "directions",
        std::string_view(ending) == "_mm" ? "Points of the axes, new less old" : "Directions, new less old",
        "Whiskers: twice the standard deviation.", std::move(plot)});
  }
  Table table = table_of(rows, {{"name", "parameter"},
                                {"was", "was", 8},
                                {"value", "is", 8},
                                {"sigma", "sigma", 2},
                                {"seen", "seen"}});
  table.id = "parameters";
  table.title = "Parameters";
  section.items.emplace_back(std::move(table));
  for (const auto& words : json["not_seen"])
    section.items.emplace_back(Paragraph{"Not seen: " + cell_text(words) + "."});
  if (json.contains("control_parameters"))
    section.items.emplace_back(
        Listing{"control", "The control's own numbers", list_text(json["control_parameters"], "\n")});
  page.sections.push_back(std::move(section));
  return page;
}

namespace {

// What the keys of a plan's run mean.
std::string said_of(const std::string& key) {
  constexpr std::pair<const char*, const char*> kWords[] = {
      {"id", "run"},
      {"minutes", "time / min"},
      {"quantity", "what is read"},
      {"n", "read along"},
      {"frame", "directions are those of the"},
      {"tool_z_mm", "measured point from the spindle's gauge point, Z / mm"},
      {"u_random", "random uncertainty, one sigma / µm or µrad"},
      {"u_common", "common uncertainty, one sigma / µm or µrad"},
      {"repeat", "times"},
      {"both_directions", "from both directions"},
      {"at", "axes that stand still"},
      {"grid", "positions of the rotary axes / °"},
      {"ball_mm", "ball, in the part / mm"}};
  for (const auto& [name, words] : kWords)
    if (key == name) return words;
  return key;
}

std::string chance_text(double share) {
  return share < 1e-4 ? "below 0.01 %" : short_number(100 * share, 2) + " %";
}

}  // namespace

Page plan_page(const Machine& machine, const std::vector<diagnosis::PlanRun>& runs,
               const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  if (json["runs"].empty()) return page;
  std::string runs_text;
  for (const auto& id : texts_of(json["runs"], "id"))
    runs_text += (runs_text.empty() ? "\"" : ", \"") + id + "\"";
  page.verdict = "Measure next: " + runs_text + ", " + short_number(number_at(json, "minutes"), 3) +
                 " min; the probability of naming a wrong effect falls from " +
                 chance_text(number_at(json, "chance_of_wrong_name_before")) + " to " +
                 chance_text(number_at(json, "chance_of_wrong_name_after")) + ".";
  XyPlot chance =
      bar_plot({"probability of naming a wrong effect", "%"}, {"with these data", "with the new runs"});
  add_bars(chance, "",
           {100 * number_at(json, "chance_of_wrong_name_before"),
            100 * number_at(json, "chance_of_wrong_name_after")});
  Section first{"What it is for", {}};
  first.items.emplace_back(Figure{"chance", "What it is worth", "", std::move(chance)});
  if (json["runs"].size() > 1) {
    XyPlot minutes = bar_plot({"time", "min"}, texts_of(json["runs"], "id"));
    add_bars(minutes, "", numbers_of(json["runs"], "minutes"));
    first.items.emplace_back(Figure{"minutes", "What it takes", "", std::move(minutes)});
  }
  page.sections.push_back(std::move(first));
  if (auto scene = planned_scene(machine, runs))
    page.sections.push_back({"Where the machine goes", {std::move(*scene)}});
  std::size_t number = 0;
  for (const auto& run : json["runs"]) {
    Section section{"Run " + text_at(run, "id"), {}};
    const std::string id = "run-" + std::to_string(++number);
    Table table;
    table.id = id;
    table.title = "What is set up";
    table.columns = {"what", "value"};
    for (const auto& [key, value] : run.items()) {
      if (key == "poses") continue;
      std::string text = cell_text(value, 6);
      if (value.is_object()) {
        text.clear();
        for (const auto& [name, one] : value.items())
          text += (text.empty() ? "" : "; ") + name + " " + cell_text(one, 6);
      }
      table.rows.push_back({said_of(key), text});
    }
    if (const ordered_json poses = poses_of(run); !poses.empty()) {
      if (auto figure = poses_figure(poses)) {
        figure->id = id + "-poses";
        section.items.emplace_back(std::move(*figure));
      }
      Table list = poses_table(poses, {});
      list.id = id + "-table";
      section.items.emplace_back(std::move(list));
    }
    section.items.emplace_back(std::move(table));
    page.sections.push_back(std::move(section));
  }
  return page;
}

Page probe_program_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  page.verdict = cell_text(ordered_json(json["poses"].size())) + " poses and " + cell_text(json["touches"]) +
                 " touches in about " + short_number(number_at(json, "seconds") / 60.0, 2) + " min";
  ordered_json rows = ordered_json::array();
  for (const auto& [axis, s] : json["sigma_of_um"].items()) {
    rows.push_back({{"name", axis},
                    {"first", s["point_mm"][0]},
                    {"second", s["point_mm"][1]},
                    {"tilt1", s["direction_urad"][0]},
                    {"tilt2", s["direction_urad"][1]}});
  }
  page.verdict += "; a centre that errs by 1 µm leaves axis ";
  std::string said;
  for (const auto& row : rows)
    said += (said.empty() ? "" : ", ") + text_at(row, "name") + " uncertain by its direction " +
            cell_text(row["tilt1"], 2) + " and " + cell_text(row["tilt2"], 2) + " µrad";
  page.verdict += said + ".";
  Section section{"Poses", {}};
  if (auto figure = poses_figure(json["poses"])) section.items.emplace_back(std::move(*figure));
  XyPlot plot = bar_plot({"direction uncertain by", "µrad"}, texts_of(rows, "name"));
  add_bars(plot, "first tilt", numbers_of(rows, "tilt1"));
  add_bars(plot, "second tilt", numbers_of(rows, "tilt2"));
  section.items.emplace_back(
      Figure{"known", "How well each axis will be known", "Where a centre errs by 1 µm.", std::move(plot)});
  section.items.emplace_back(poses_table(json["poses"], {}));
  page.sections.push_back(std::move(section));
  return page;
}

Page probe_reading_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  ordered_json poses = json["poses"];
  std::size_t worst = 0;
  std::vector<double> length;
  for (auto& pose : poses) {
    double squares = 0.0;
    for (const auto& d : pose["deviation_um"]) squares += d.get<double>() * d.get<double>();
    length.push_back(std::sqrt(squares));
    if (length.back() > length[worst]) worst = length.size() - 1;
    const char* keys[] = {"dx", "dy", "dz"};
    for (std::size_t k = 0; k < 3; ++k) pose[keys[k]] = pose["deviation_um"][k];
  }
  page.verdict = cell_text(ordered_json(poses.size())) + " poses; the ball is at most " +
                 um_text(length.empty() ? 0.0 : length[worst]) +
                 " from where the machine file has it (pose " + std::to_string(worst + 1) +
                 "), and one touch scatters by " + um_text(number_at(json, "scatter_um")) + ".";
  add_fact(page, json, "radius_mm", "measured radius", " mm");
  add_fact(page, json, "expected_radius_mm", "ball and stylus", " mm");
  add_fact(page, json, "fast_less_slow_um", "fast less slow", " µm");
  std::vector<std::string> names;
  for (std::size_t i = 0; i < poses.size(); ++i) names.push_back(std::to_string(i + 1));
  XyPlot plot = bar_plot({"off the machine file", "µm"}, names);
  plot.x = {"pose", ""};
  add_bars(plot, "X", numbers_of(poses, "dx"));
  add_bars(plot, "Y", numbers_of(poses, "dy"));
  add_bars(plot, "Z", numbers_of(poses, "dz"));
  Section section{
      "The ball",
      {Figure{"deviations", "Where the ball stands, pose by pose", "Machine axes.", std::move(plot)}}};
  if (auto figure = poses_figure(poses)) section.items.emplace_back(std::move(*figure));
  section.items.emplace_back(poses_table(poses, {{"dx", "X / µm"},
                                                 {"dy", "Y / µm"},
                                                 {"dz", "Z / µm"},
                                                 {"radius_mm", "radius / mm", 6},
                                                 {"worst_residual_um", "worst touch / µm", 3}}));
  page.sections.push_back(std::move(section));
  return page;
}

}  // namespace trunnion::report
