// What was read from other programs' files, or made: the answer in one sentence, and what it looks like.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"
#include "trunnion/report/command_pages.hpp"

#include "report/json_figures.hpp"
#include "report/nc_figures.hpp"
#include "report/svg.hpp"
#include "report/texts.hpp"

namespace trunnion::report {
namespace {

constexpr std::size_t kMostSeries = 8;  // of one plot, as many as there are colours

struct ColumnRange {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void take(double v) {
    if (!std::isfinite(v)) return;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  bool known() const { return low <= high; }
  std::string text(const std::string& unit) const {
    return short_number(low, 4) + " to " + short_number(high, 4) + " " + unit;
  }
};

/// The columns of a CSV text by name; what is no number is not-a-number.
struct Columns {
  std::vector<std::string> names;
  std::map<std::string, std::vector<double>> numbers;
  std::vector<std::string> run;  // of each row, where there is such a column
  std::size_t rows = 0;

  explicit Columns(const std::string& csv) {
    Diagnostics none;  // our own text
    config::CsvRows reader(csv, "", none);
    names = reader.columns();
    const auto run_column = reader.column("run_id");
    while (reader.next()) {
      ++rows;
      for (std::size_t c = 0; c < names.size(); ++c) {
        const std::string field(reader.fields()[c]);
        char* end = nullptr;
        const double value = std::strtod(field.c_str(), &end);
        numbers[names[c]].push_back(end != field.c_str() && *end == '\0' ? value : std::nan(""));
      }
      if (run_column) run.emplace_back(reader.fields()[*run_column]);
    }
  }
  bool has(const std::string& name) const { return numbers.contains(name); }
};

// "X_mm" -> {"X", "mm"}
Scale scale_of_column(const std::string& name) {
  for (const auto& [ending, unit] :
       {std::pair{"_mm", "mm"}, std::pair{"_deg", "°"}, std::pair{"_um", "µm"}}) {
    if (name.ends_with(ending)) return {name.substr(0, name.size() - std::string_view(ending).size()), unit};
  }
  return {name, ""};
}

// Readings in the order of the file, one colour a run.
Figure readings_figure(const Columns& csv, const std::string& unit) {
  XyPlot plot{{"row", ""}, {"reading", unit}, {}, {}, {}, false};
  std::map<std::string, std::size_t> series;
  const auto& value = csv.numbers.at("value");
  for (std::size_t i = 0; i < csv.rows; ++i) {
    const std::string run = i < csv.run.size() ? csv.run[i] : "";
    const auto [at, is_new] = series.emplace(run, std::min(series.size(), kMostSeries - 1));
    if (is_new && at->second == plot.series.size()) {
      Series s;
      s.name = run;
      s.mark = Mark::points;
      plot.series.push_back(std::move(s));
    }
    Series& s = plot.series[at->second];
    if (is_new && s.name != run) s.name = "further runs";
    s.x.push_back(static_cast<double>(i + 1));
    s.y.push_back(value[i]);
  }
  return {"readings", "Readings in the order of the file", "Row 1 is the first below the header.",
          std::move(plot)};
}

// Where the machine stood, column by column of one unit.
void add_position_figures(const Columns& csv, Section& section) {
  std::map<std::string, XyPlot> of_unit;
  for (const std::string& name : csv.names) {
    const Scale scale = scale_of_column(name);
    if (scale.unit.empty() || !csv.has(name)) continue;
    XyPlot& plot = of_unit[scale.unit];
    if (plot.series.size() == kMostSeries) continue;
    Series s;
    s.name = scale.label;
    s.y = csv.numbers.at(name);
    if (csv.has("time_s")) s.x = csv.numbers.at("time_s");
    for (std::size_t i = s.x.size(); i < csv.rows; ++i) s.x.push_back(static_cast<double>(i + 1));
    plot.series.push_back(std::move(s));
  }
  for (auto& [unit, plot] : of_unit) {
    plot.x = csv.has("time_s") ? Scale{"time", "s"} : Scale{"row", ""};
    plot.y = {"position", unit};
    section.items.emplace_back(Figure{unit == "°"    ? "rotary"
                                      : unit == "mm" ? "linear"
                                                     : "deviations",
                                      "Columns in " + unit, "In the order of the file.", std::move(plot)});
  }
}

Table columns_table(const ordered_json& json) {
  ordered_json ranges = ordered_json::array();
  for (const auto& range : json["ranges"])
    if (!range["smallest"].is_null()) ranges.push_back(range);
  Table out =
      table_of(ranges, {{"column", "column"}, {"smallest", "smallest", 6}, {"largest", "largest", 6}});
  out.id = "columns";
  out.title = "Range of each column with numbers";
  return out;
}

// The poses of a file that is still to be filled in.
std::vector<Scene::Stand> stands_of(const Columns& csv, const Machine& machine) {
  std::vector<Scene::Stand> out;
  for (std::size_t i = 0; i < csv.rows; ++i) {
    JointVector q;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      const bool rotary = machine.axes[id].kind == AxisKind::rotary;
      const std::string column = machine.axes[id].name + (rotary ? "_deg" : "_mm");
      if (csv.has(column)) q[id] = csv.numbers.at(column)[i] * (rotary ? kRadPerDegree : 1.0);
    }
    add_stand(out, machine, i < csv.run.size() ? csv.run[i] : "", q);
  }
  return out;
}

Section machine_section(const Machine& machine, const std::vector<BodyMesh>& bodies, std::string title) {
  Section section{std::move(title), {}};
  section.items.emplace_back(jog_scene(machine, bodies));
  return section;
}

}  // namespace

Page measurements_page(const ResultText& result, const std::string& csv_text, const Machine* machine) {
  const Columns csv(csv_text);
  Page page = opened(result);
  const std::set<std::string> runs(csv.run.begin(), csv.run.end());
  const std::string of_runs = runs.empty() ? "" : " in " + std::to_string(runs.size()) + " runs";
  page.facts = {{"rows", "rows", std::to_string(csv.rows), static_cast<double>(csv.rows)}};
  if (!runs.empty())
    page.facts.push_back({"runs", "runs", std::to_string(runs.size()), static_cast<double>(runs.size())});
  Section section{"What it holds", {}};
  ColumnRange range;
  if (csv.has("value")) {
    for (const double v : csv.numbers.at("value")) range.take(v);
  }
  if (range.known()) {
    // Files of ours hold lengths in um unless they say otherwise, row by row.
    page.verdict = std::to_string(csv.rows) + " readings" + of_runs + ", from " +
                   range.text("(unit of each row)") + ". " + page.verdict;
    section.items.emplace_back(readings_figure(csv, ""));
  } else {
    page.verdict = std::to_string(csv.rows) + (csv.has("value") ? " readings to be taken" : " rows") +
                   of_runs + ". " + page.verdict;
  }
  if (machine != nullptr && csv.has("value") && !range.known()) {
    section.items.emplace_back(stands_scene(*machine, stands_of(csv, *machine)));
  } else {
    add_position_figures(csv, section);
  }
  section.items.emplace_back(columns_table(ordered_json::parse(result.json)));
  page.sections.push_back(std::move(section));
  return page;
}

Page measuring_plan_page(const Machine& machine, const std::vector<diagnosis::PlanRun>& runs,
                         const ResultText& result) {
  Page page = opened(result);
  double minutes = 0.0;
  for (const auto& run : runs) minutes += run.minutes;
  page.facts = {{"runs", "runs", std::to_string(runs.size()), static_cast<double>(runs.size())},
                {"minutes", "time", short_number(minutes, 3) + " min", minutes}};
  Section section{"Where the machine goes", {}};
  if (auto scene = planned_scene(machine, runs))
    section.items.emplace_back(std::move(*scene));
  else
    section.items.emplace_back(Paragraph{"These runs have no pose that this machine can take."});
  page.sections.push_back(std::move(section));
  return page;
}

Page log_page(const ResultText& result, const thermal::Log& log) {
  Page page = opened(result);
  const double hour_s = 60.0 * kSecondsPerMinute;
  XyPlot channels{{"time within the run", "h"}, {"deviation", "µm"}, {}, {}, {}, false};
  XyPlot sensors{{"time within the run", "h"}, {"temperature", "°C"}, {}, {}, {}, false};
  const auto add = [&](XyPlot& plot, std::string name, const std::vector<double>& time_s,
                       const std::vector<double>& values) {
    if (plot.series.size() >= kMostSeries) return;
    const double unit = &plot == &channels ? kMmPerUm : 1.0;
    Series s;
    s.name = std::move(name);
    for (std::size_t i = 0; i < time_s.size(); ++i) {
      if (!std::isfinite(values[i])) continue;  // measured more seldom than temperatures
      s.x.push_back((time_s[i] - time_s.front()) / hour_s);
      s.y.push_back(values[i] / unit);
    }
    plot.series.push_back(std::move(s));
  };
  const auto json = ordered_json::parse(result.json);
  ordered_json rows = json["runs"];
  std::vector<std::string> titles;
  for (const auto& c : log.channels) titles.push_back(c + " / µm");
  std::vector<ColumnRange> all(log.channels.size());
  for (std::size_t r = 0; r < log.runs.size(); ++r) {
    const thermal::LogRun& run = log.runs[r];
    if (run.time_s.empty()) continue;
    for (std::size_t c = 0; c < log.channels.size(); ++c) {
      ColumnRange range;
      for (const double v : run.channel_mm[c]) range.take(v / kMmPerUm), all[c].take(v / kMmPerUm);
      rows[r][log.channels[c]] =
          range.known() ? short_number(range.low, 4) + " to " + short_number(range.high, 4) : "–";
      add(channels, log.channels[c] + ", " + run.id, run.time_s, run.channel_mm[c]);
    }
    for (std::size_t k = 0; k < log.sensors.size() && r == 0; ++k)
      add(sensors, log.sensors[k], run.time_s, run.temperature_degC[k]);
  }
  std::vector<Column> columns = {{"run_id", "run"}, {"rows", "rows"}, {"hours", "hours"}};
  for (std::size_t c = 0; c < titles.size(); ++c)
    columns.push_back({log.channels[c].c_str(), titles[c].c_str()});
  columns.push_back({"largest_rise_K", "largest rise of a sensor / K", 3});
  Table table = table_of(rows, columns);
  table.id = "runs";
  table.title = "Runs";
  page.verdict =
      std::to_string(log.runs.size()) + " runs, " + std::to_string(log.sensors.size()) + " sensors";
  for (std::size_t c = 0; c < log.channels.size(); ++c) {
    if (all[c].known()) page.verdict += ", " + log.channels[c] + " from " + all[c].text("µm");
  }
  page.verdict += ". " + result.verdict;
  Section section{"What it holds", {}};
  if (!channels.series.empty())
    section.items.emplace_back(
        Figure{"channels", "Measured deviations", "The first runs, one line each.", std::move(channels)});
  if (!sensors.series.empty())
    section.items.emplace_back(Figure{"sensors", "Temperatures of the first run", "", std::move(sensors)});
  section.items.emplace_back(std::move(table));
  page.sections.push_back(std::move(section));
  return page;
}

Page tables_page(const ResultText& result, const std::vector<ErrorTable>& tables) {
  Page page = opened(result);
  Section section{"What the tables hold", {}};
  Table list{"tables",
             "Tables",
             "",
             {"over", "component", "points", "unit", "smallest", "largest"},
             {false, false, true, false, true, true},
             {},
             {}};
  std::string most;
  double most_um = 0.0;
  for (const ErrorTable& table : tables) {
    const std::string over = joined(table.arguments, " ");
    XyPlot lengths{{over, "mm"}, {"error", "µm"}, {}, {}, {}, false};
    XyPlot angles{{over, "mm"}, {"error", "µrad"}, {}, {}, {}, false};
    const bool rotary = !over.empty() && over.front() <= 'C';
    if (rotary) lengths.x.unit = angles.x.unit = "°";
    for (const auto& component : table.components) {
      // EXX is a translation, EAX a rotation.
      const bool angle = component.name.size() > 1 && component.name[1] <= 'C';
      ColumnRange range;
      Series s;
      s.name = component.name;
      for (std::size_t i = 0; i < component.values.size(); ++i) {
        const double v = component.values[i] / (angle ? kRadPerUrad : kMmPerUm);
        range.take(v);
        if (table.nodes.size() == 1) {
          s.x.push_back(table.nodes[0][i] * (rotary ? kDegreePerRad : 1.0));
          s.y.push_back(v);
        }
      }
      if (!range.known()) continue;
      const double size = std::max(std::abs(range.low), std::abs(range.high));
      if (!angle && size >= most_um) {
        most_um = size;
        most = component.name + " over " + over;
      }
      list.rows.push_back({over, component.name, std::to_string(component.values.size()),
                           angle ? "µrad" : "µm", short_number(range.low, 4), short_number(range.high, 4)});
      XyPlot& plot = angle ? angles : lengths;
      if (!s.x.empty()) plot.series.push_back(std::move(s));
    }
    for (auto* plot : {&lengths, &angles}) {
      if (plot->series.empty()) continue;
      section.items.emplace_back(Figure{"table-" + std::to_string(section.items.size() + 1),
                                        (plot == &angles ? "Rotations over " : "Translations over ") + over,
                                        "", std::move(*plot)});
    }
  }
  page.verdict = std::to_string(tables.size()) + (tables.size() == 1 ? " table" : " tables") +
                 (most.empty() ? "" : "; the largest translation is " + um_text(most_um) + ", " + most) +
                 ". " + result.verdict;
  section.items.emplace_back(std::move(list));
  page.sections.push_back(std::move(section));
  return page;
}

Page machine_check_page(const Machine& machine, const std::vector<BodyMesh>& bodies,
                        const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  const auto& beyond = json["beyond_travel_at_part_zero"];
  const auto& open = json["left_open"];
  page.tone = beyond.empty() ? Tone::good : Tone::neutral;
  const std::string every = short_number(number_at(json, "tool_axis_every_way_deg"), 4);
  const std::string some = short_number(number_at(json, "tool_axis_one_way_deg"), 4);
  page.verdict = "The tool axis reaches every direction up to " + every + "° from the spindle" +
                 (every == some ? "" : ", some up to " + some + "°") + ". With the tip at the part's zero ";
  page.verdict += beyond.empty() ? "every axis stays within its travel at all rotary positions." : "";
  for (std::size_t i = 0; i < beyond.size(); ++i)
    page.verdict += (i == 0 ? "" : ", ") + text_at(beyond[i], "axis") + " would go " +
                    short_number(number_at(beyond[i], "by_mm"), 4) + " mm beyond its travel (at " +
                    text_at(beyond[i], "at") + ")";
  if (!beyond.empty()) page.verdict += ".";
  if (!open.empty()) page.verdict += " Left open: " + list_text(open, "; ") + ".";
  page.facts = {{"controller", "control", text_at(json, "controller"), {}},
                {"left_open", "left open", std::to_string(open.size()), {}}};
  page.sections.push_back(machine_section(machine, bodies, "The machine of this file"));
  return page;
}

Page machine_new_page(const Machine& machine, const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  page.verdict = "Written: " + text_at(json, "file") +
                 ". Compare the machine below with yours, axis by axis, before a program runs there.";
  Section section = machine_section(machine, {}, "The machine of this file");
  section.items.emplace_back(Listing{"file", "The file", text_at(json, "text")});
  page.sections.push_back(std::move(section));
  return page;
}

Page effects_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  Table table{"effects", "Effects", "", {"effect", "kind", "what it is", "cause", "what to do", "parameters"},
              {},        {},        {}};
  std::map<std::string, std::size_t> kinds;
  for (const auto& effect : json["effects"]) {
    ++kinds[text_at(effect, "class")];
    std::string parameters;
    for (const auto& p : effect["parameters"])
      parameters += (parameters.empty() ? "" : ", ") + text_at(p, "key");
    table.rows.push_back({text_at(effect, "id"), text_at(effect, "class"), text_at(effect, "what"),
                          text_at(effect, "cause"), text_at(effect, "remedy"), parameters});
  }
  std::vector<std::string> names;
  std::vector<double> counts;
  for (const auto& [kind, count] : kinds) {
    names.push_back(kind);
    counts.push_back(static_cast<double>(count));
  }
  XyPlot plot = bar_plot({"effects", ""}, names);
  add_bars(plot, "", counts);
  page.sections.push_back(
      {"The library", {Figure{"kinds", "Effects by kind", "", std::move(plot)}, std::move(table)}});
  return page;
}

}  // namespace trunnion::report
