#include "trunnion/report/machine_json.hpp"

#include "report/json_figures.hpp"
#include "report/nc_figures.hpp"
#include "report/svg.hpp"

namespace trunnion::report {
namespace {

std::string chain_text(const ordered_json& names) {
  return names.empty() ? "nothing that moves" : list_text(names);
}

Table zero_table(const ordered_json& zero) {
  Table out;
  out.id = "zero";
  out.title = "Program zero";
  out.columns = {"program", "where"};
  for (const auto& [name, one] : zero.items()) {
    for (const auto& line : one["text"])
      out.rows.push_back({name == "tool_centre_point" ? "with tool-centre-point control (--rtcp)"
                                                      : "without tool-centre-point control",
                          cell_text(line)});
  }
  return out;
}

}  // namespace

Page machine_page(const Machine& machine, const std::vector<BodyMesh>& bodies, const ResultText& result) {
  const auto json = ordered_json::parse(result.json);
  Page page = opened(result);
  page.tone = Tone::neutral;
  page.verdict = "From the bed to the tool: " + chain_text(json["tool_chain"]) +
                 "; from the bed to the part: " + chain_text(json["part_chain"]) + ". A positive command of ";
  bool first = true;
  for (const auto& axis : json["axes"]) {
    page.verdict += (first ? "" : "; ") + text_at(axis, "name") + ": " + text_at(axis, "motion");
    first = false;
  }
  page.verdict += ".";
  page.facts = {{"gauge_length_mm", "gauge length", short_number(number_at(json, "gauge_length_mm")) + " mm",
                 number_at(json, "gauge_length_mm")},
                {"output_point", "X Y Z words are of the", text_at(json, "output_point"), {}}};
  Table axes = table_of(
      json["axes"],
      {{"name", "axis"}, {"motion", "a positive command"}, {"travel", "travel"}, {"rapid", "rapid"}});
  axes.id = "axes";
  axes.title = "Axes";
  Section section{"Which way each axis goes", {}};
  section.items.emplace_back(jog_scene(machine, bodies));
  section.items.emplace_back(std::move(axes));
  section.items.emplace_back(zero_table(json["program_zero"]));
  section.items.emplace_back(Listing{"proving", "Proving program", text_at(json, "proving_program")});
  page.sections.push_back(std::move(section));
  return page;
}

}  // namespace trunnion::report
