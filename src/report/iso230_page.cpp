#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/report/command_pages.hpp"

#include "report/json_figures.hpp"
#include "report/svg.hpp"
#include "report/texts.hpp"

namespace trunnion::report {
namespace {

std::string unit_of(const ordered_json& line) {
  return text_at(line, "unit") == "urad" ? "µrad" : "µm";
}

// mean + sign * 2 s
std::vector<double> edge(const std::vector<double>& mean, const std::vector<double>& s, double sign) {
  std::vector<double> out;
  for (std::size_t i = 0; i < mean.size() && i < s.size(); ++i) out.push_back(mean[i] + sign * 2.0 * s[i]);
  return out;
}

// The plot of the standard: single readings, the mean of each direction, the band of two standard deviations.
Figure line_figure(const ordered_json& line, const std::string& id) {
  const auto& at = line["targets"];
  const bool rotary = at.contains("target_deg");
  const auto target = numbers_of(at[rotary ? "target_deg" : "target_mm"]);
  XyPlot plot;
  plot.x = {"target", rotary ? "°" : "mm"};
  plot.y = {"deviation", unit_of(line)};
  int colour = 0;
  for (const auto& [way, name] : {std::pair{"up", "up"}, std::pair{"down", "down"}}) {
    const auto key = [way = std::string(way)](const char* what) { return what + way; };
    if (!at.contains(key("x_mean_"))) continue;
    const auto mean = numbers_of(at[key("x_mean_")]);
    const auto s = numbers_of(at[key("s_")]);
    if (s.size() == mean.size() && !s.empty())
      plot.series.push_back({std::string("mean ± 2 s ") + name,
                             Mark::band,
                             target,
                             edge(mean, s, -1.0),
                             edge(mean, s, 1.0),
                             {},
                             colour});
    plot.series.push_back({std::string("mean ") + name, Mark::line, target, mean, {}, {}, colour});
    if (at.contains(key("readings_"))) {
      Series single{std::string("readings ") + name, Mark::points, {}, {}, {}, {}, colour};
      const auto& readings = at[key("readings_")];
      for (std::size_t i = 0; i < readings.size() && i < target.size(); ++i) {
        for (const double v : numbers_of(readings[i])) single.x.push_back(target[i]), single.y.push_back(v);
      }
      plot.series.push_back(std::move(single));
    }
    ++colour;
  }
  return {id, text_at(line, "axis"),
          "Points: single readings; lines: mean of each direction; bands: two standard deviations about it.",
          std::move(plot)};
}

Table targets_table(const ordered_json& line, const std::string& id) {
  const auto& at = line["targets"];
  ordered_json rows = ordered_json::array();
  std::vector<Column> columns;
  const std::pair<const char*, const char*> known[] = {{"target_mm", "target / mm"},
                                                       {"target_deg", "target / °"},
                                                       {"x_mean_up", "mean ↑"},
                                                       {"s_up", "s ↑"},
                                                       {"R_up", "R ↑"},
                                                       {"x_mean_down", "mean ↓"},
                                                       {"s_down", "s ↓"},
                                                       {"R_down", "R ↓"},
                                                       {"x_mean", "mean"},
                                                       {"B", "B"},
                                                       {"R", "R"}};
  for (const auto& [key, title] : known) {
    if (!at.contains(key) || at[key].empty()) continue;
    columns.push_back({key, title, 5});
    for (std::size_t i = 0; i < at[key].size(); ++i) {
      if (rows.size() <= i) rows.push_back(ordered_json::object());
      rows[i][key] = at[key][i];
    }
  }
  Table out = table_of(rows, columns);
  out.id = id;
  out.title = text_at(line, "axis") + ", target by target / " + unit_of(line);
  for (const auto& note : line["notes"])
    out.caption += (out.caption.empty() ? "" : " ") + as_sentence(cell_text(note));
  return out;
}

Table symbols_table(ordered_json lines) {
  for (auto& line : lines) line["unit"] = unit_of(line);
  Table out = table_of(lines, {{"axis", "axis"},
                               {"unit", "unit"},
                               {"runs_up", "runs ↑"},
                               {"runs_down", "runs ↓"},
                               {"A", "A"},
                               {"A_up", "A ↑"},
                               {"A_down", "A ↓"},
                               {"R", "R"},
                               {"R_up", "R ↑"},
                               {"R_down", "R ↓"},
                               {"E", "E"},
                               {"E_up", "E ↑"},
                               {"E_down", "E ↓"},
                               {"M", "M"},
                               {"B", "B"},
                               {"B_mean", "mean B"}});
  out.id = "symbols";
  out.title = "All values";
  out.caption =
      "A accuracy, R repeatability, E systematic deviation, M mean deviation, B reversal; ↑ and ↓ are the "
      "directions of approach, – is what it does not give "
      "for these data.";
  return out;
}

std::string line_sentence(const ordered_json& line) {
  const std::string unit = " " + unit_of(line);
  const auto said = [&](const char* key) {
    return cell_text(line[key], 3) + (line[key].is_null() ? "" : unit);
  };
  return text_at(line, "axis") + ": accuracy A " + said("A") + ", repeatability R " + said("R") +
         ", reversal B " + said("B") + ".";
}

// What was held against a limit: the page opens with it.
void add_limits(Page& page, const ordered_json& json) {
  if (!json.contains("limits")) return;
  ordered_json rows = json["limits"];
  std::string beyond, undecided;
  bool known = true;
  for (auto& row : rows) {
    const std::string unit = unit_of(row);
    const std::string result = text_at(row, "result");
    row["name"] = text_at(row, "of") + " " + text_at(row, "symbol");
    known = known && !row["uncertainty"].is_null();
    row["unit"] = unit;
    std::string& list = result == "beyond" ? beyond : undecided;
    if (result == "within") continue;
    list += (list.empty() ? "" : ", ") + text_at(row, "name") + " " + cell_text(row["value"], 3) +
            (row["value"].is_null() ? "" : " " + unit) + " (limit " + cell_text(row["limit"], 3) + " " +
            unit + ")";
  }
  const bool passed = json["passed"].get<bool>();
  page.tone = passed ? Tone::good : beyond.empty() ? Tone::neutral : Tone::bad;
  std::string said = passed ? "All limits are kept." : "";
  if (!beyond.empty()) said += "Beyond the limit: " + beyond + ".";
  if (!undecided.empty()) said += (said.empty() ? "" : " ") + ("Not proved to be within: " + undecided + ".");
  page.verdict = said + " " + page.verdict;
  Table table = table_of(rows, {{"name", "value"},
                                {"result", "result"},
                                {"value", "measured"},
                                {"limit", "limit"},
                                {"uncertainty", "uncertainty U"},
                                {"unit", "unit"}});
  table.id = "limits";
  table.title = "Limits";
  table.caption =
      "By ISO 14253-1: within is value + U up to the limit, beyond is value - U above it, between them "
      "neither is proved.";
  if (!known) table.caption += " Where no uncertainty was given, U is taken as zero.";
  page.sections.insert(page.sections.begin(), {"Pass or fail", {std::move(table)}});
}

double radians(double degrees) {
  return degrees * kRadPerDegree;
}

// A ring every 1, 2 or 5 units, two to five of them on either side of the nominal circle.
double ring_step(double largest) {
  const double rough = largest / 2.5;
  const double ten = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double step : {1.0, 2.0, 5.0})
    if (step * ten >= rough) return step * ten;
  return 10.0 * ten;
}

/// Radial deviations about a circle of their own size, with rings: as a ball bar's report has them.
struct PolarPlot {
  XyPlot plot;
  double zero = 3.0;  // radius of the nominal circle: the circle stays open, its shape stays visible
  double step = 1.0;  // from ring to ring
};

PolarPlot polar(const ordered_json& paths, const std::string& first, const std::string& second) {
  double largest = 0.0;
  for (const auto& path : paths)
    for (const double v : numbers_of(path["radial"])) largest = std::max(largest, std::abs(v));
  if (largest <= 0.0) largest = 1.0;
  PolarPlot out{{}, 3.0 * largest, ring_step(largest)};
  out.plot.equal_scales = true;
  out.plot.numbered = false;
  out.plot.x = {first, ""};
  out.plot.y = {second, ""};
  const int rings = static_cast<int>(std::ceil(largest / out.step));
  constexpr int kSides = 180;
  Series faint{"", Mark::line, {}, {}, {}, {}, kRuleColour};
  Series nominal{"nominal", Mark::line, {}, {}, {}, {}, 7};
  for (int ring = -rings; ring <= rings; ++ring) {
    const double radius = out.zero + ring * out.step;
    Series& s = ring == 0 ? nominal : faint;
    for (int i = 0; i <= kSides; ++i) {
      const double a = radians(360.0 * i / kSides);
      s.x.push_back(radius * std::cos(a));
      s.y.push_back(radius * std::sin(a));
    }
    s.x.push_back(kGap);
    s.y.push_back(kGap);
  }
  out.plot.series = {std::move(faint), std::move(nominal)};
  return out;
}

void add_path(PolarPlot& polar, const std::string& name, const ordered_json& path) {
  const auto angle = numbers_of(path["angle_deg"]);
  const auto radial = numbers_of(path["radial"]);
  Series s;
  s.name = name;
  s.colour = static_cast<int>(polar.plot.series.size()) - 2;
  const std::size_t count = std::min(angle.size(), radial.size());
  const auto add = [&](std::size_t i) {
    s.x.push_back((polar.zero + radial[i]) * std::cos(radians(angle[i])));
    s.y.push_back((polar.zero + radial[i]) * std::sin(radians(angle[i])));
    s.labels.push_back(short_number(angle[i], 4) + "°: " + short_number(radial[i], 4));
  };
  for (std::size_t i = 0; i < count; ++i) add(i);
  // A whole turn ends where it began.
  if (count > 2 &&
      std::abs(std::remainder(angle[count - 1] - angle[0], 360.0)) < 2.5 * 360.0 / static_cast<double>(count))
    add(0);
  polar.plot.series.push_back(std::move(s));
}

}  // namespace

Page positioning_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  const bool diagonal = json.contains("diagonals");
  const auto& lines = json[diagonal ? "diagonals" : "axes"];
  page.verdict.clear();
  for (const auto& line : lines) page.verdict += (page.verdict.empty() ? "" : " ") + line_sentence(line);
  page.verdict += " " + text_at(json, "standard") + ".";
  Section first{"Values", {}};
  std::size_t number = 0;
  for (const auto& line : lines)
    first.items.emplace_back(line_figure(line, "line-" + std::to_string(++number)));
  first.items.emplace_back(symbols_table(lines));
  if (json.contains("squareness") && !json["squareness"].empty()) {
    Table table =
        table_of(json["squareness"], {{"plane", "plane"}, {"opening_urad", "angle above 90° / µrad"}});
    table.id = "squareness";
    table.title = "Squareness";
    first.items.emplace_back(std::move(table));
  }
  page.sections.push_back(std::move(first));
  Section targets{"Target by target", {}};
  number = 0;
  for (const auto& line : lines)
    targets.items.emplace_back(targets_table(line, "targets-" + std::to_string(++number)));
  page.sections.push_back(std::move(targets));
  add_limits(page, json);
  return page;
}

Page circles_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  page.verdict.clear();
  std::size_t number = 0;
  for (const auto& circle : json["circles"]) {
    const std::string name =
        text_at(circle, "plane") + ", radius " + cell_text(circle["radius_mm"], 5) + " mm";
    const std::string id = "circle-" + std::to_string(++number);
    std::string said = name + ":";
    for (const auto& [way, words] :
         {std::pair{"clockwise", "clockwise"}, std::pair{"counter_clockwise", "counter-clockwise"}}) {
      if (circle.contains(way)) said += " G " + um_text(number_at(circle[way], "G")) + " " + words + ",";
    }
    said += " both directions " +
            (circle["G_b"].is_null() ? std::string("not measured") : um_text(number_at(circle, "G_b"))) + ".";
    Section section{name, {}};
    if (circle.contains("paths") && !circle["paths"].empty()) {
      const std::string plane = text_at(circle, "plane");
      PolarPlot drawn = polar(circle["paths"], "+" + plane.substr(0, 1), "+" + plane.substr(1));
      for (const auto& path : circle["paths"]) add_path(drawn, text_at(path, "sense"), path);
      section.items.emplace_back(
          Figure{id, "Polar plot, " + name + ", " + short_number(drawn.step) + " µm a ring",
                 "Radial deviation about the least-squares centre of each path, outwards "
                 "where the circle is too large.",
                 std::move(drawn.plot)});
    }
    if (circle.contains("causes") && !circle["causes"].empty()) {
      const auto& causes = circle["causes"];
      XyPlot bars = bar_plot({"share of the mean square", "%"}, texts_of(causes, "cause"));
      add_bars(bars, "", numbers_of(causes, "per_cent"));
      section.items.emplace_back(Figure{id + "-causes", "What shapes the circle",
                                        "Shares of the mean square of the deviations, all causes fitted "
                                        "together. Negative: the cause cancels part of others.",
                                        std::move(bars)});
      const auto most = std::max_element(causes.begin(), causes.end(), [](const auto& a, const auto& b) {
        return number_at(a, "per_cent") < number_at(b, "per_cent");
      });
      if (most != causes.end())
        said +=
            (*most)["size"].is_null()
                ? " No known cause explains most of it (other " + cell_text((*most)["per_cent"], 3) + " %)."
                : " Main cause: " + text_at(*most, "cause") + " " + cell_text((*most)["size"], 3) + " " +
                      unit_of(*most) + " (" + cell_text((*most)["per_cent"], 3) + " %).";
    }
    ordered_json rows = ordered_json::array();
    for (const auto& way : {"clockwise", "counter_clockwise"}) {
      if (!circle.contains(way)) continue;
      ordered_json row = {{"way", way == std::string_view("clockwise") ? "clockwise" : "counter-clockwise"}};
      row.update(circle[way]);
      rows.push_back(std::move(row));
    }
    Table table = table_of(rows, {{"way", "direction"},
                                  {"G", "G / µm"},
                                  {"G_LSC", "G about the least-squares centre / µm"},
                                  {"F_max", "F max / µm"},
                                  {"F_min", "F min / µm"},
                                  {"full_circle", "full circle"}});
    table.id = id + "-table";
    table.title = "Values";
    table.caption = "Bi-directional G(b) " + cell_text(circle["G_b"]) + " µm, mean radial deviation D " +
                    cell_text(circle["D"]) + " µm; scales differ by " +
                    cell_text(circle["scale_mismatch_um"]) + " µm on the radius, the axes open by " +
                    cell_text(circle["opening_urad"]) + " µrad.";
    if (circle.contains("causes") && !circle["causes"].empty()) {
      ordered_json causes = circle["causes"];
      for (auto& cause : causes) cause["unit"] = cause["unit"].is_null() ? "" : unit_of(cause);
      Table list = table_of(
          causes, {{"cause", "cause"}, {"per_cent", "share / %"}, {"size", "size"}, {"unit", "unit"}});
      // A tenth of a per cent is more than such a fit can tell.
      for (std::size_t i = 0; i < list.rows.size(); ++i)
        list.rows[i][1] = fixed_text(number_at(causes[i], "per_cent"), 1);
      list.id = id + "-causes-table";
      list.title = "Causes";
      list.caption =
          "Lost motion: reversal error of the axis. Servo mismatch: amplitude of the ellipse at 45° that "
          "changes sides with the direction. Other: what none of them explains, with the noise.";
      section.items.emplace_back(std::move(list));
    }
    section.items.emplace_back(std::move(table));
    page.sections.push_back(std::move(section));
    page.verdict += (page.verdict.empty() ? "" : " ") + said;
  }
  page.verdict += " " + text_at(json, "standard") + ".";
  add_limits(page, json);
  return page;
}

Page rotation_page(const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  const auto& motions = json["error_motions"];
  page.verdict.clear();
  Section section{"Error motions", {}};
  std::size_t number = 0;
  for (const auto& motion : motions) {
    const std::string unit = unit_of(motion);
    const std::string name =
        text_at(motion, "axis") + " " + text_at(motion, "kind") + ", " + text_at(motion, "direction");
    page.verdict += (page.verdict.empty() ? "" : " ") + name + ": total " + cell_text(motion["total"], 3) +
                    " " + unit + ", of which each turn repeats " + cell_text(motion["synchronous"], 3) + " " +
                    unit + ".";
    if (!motion.contains("paths") || motion["paths"].empty()) continue;
    PolarPlot drawn = polar(motion["paths"], "0°", "90°");
    for (const auto& path : motion["paths"]) add_path(drawn, text_at(path, "turn"), path);
    section.items.emplace_back(Figure{
        "motion-" + std::to_string(++number), name + ", " + short_number(drawn.step) + " " + unit + " a ring",
        "As read, about the circle that stands for none.", std::move(drawn.plot)});
  }
  Table table = table_of(motions, {{"axis", "axis"},
                                   {"kind", "kind"},
                                   {"direction", "direction"},
                                   {"unit", "unit"},
                                   {"total", "total"},
                                   {"synchronous", "synchronous"},
                                   {"asynchronous", "asynchronous"},
                                   {"residual_synchronous", "residual synchronous"},
                                   {"fundamental", "once a turn"},
                                   {"centre", "centre"},
                                   {"turns", "turns"},
                                   {"angles", "angles"}});
  table.id = "motions";
  table.title = "Values";
  section.items.emplace_back(std::move(table));
  page.sections.push_back(std::move(section));
  page.verdict += " " + text_at(json, "standard") + ".";
  add_limits(page, json);
  return page;
}

}  // namespace trunnion::report
