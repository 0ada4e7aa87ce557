#include "trunnion/diagnosis/measurement_template.hpp"

#include <algorithm>
#include <set>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"
#include "trunnion/diagnosis/plan.hpp"

#include "diagnosis/verdict/next_measurement.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kAssumed_um = 1.0;  // standard uncertainty, for the user to put right

struct Kind {
  std::string name, runs;  // of the menu: how their names begin
  std::string words;
};
const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all = {
      {"laser", "laser and straightness", "laser and straightness"},
      {"rtest", "R-test", "a ball on the table, followed by the tool"},
      {"ballbar", "ball-bar", "circles with a ball bar; value: its change of length, + is longer"},
      {"probe", "R-test", "a ball on the table, touched from five sides"}};
  return all;
}

bool is_wanted(const Kind& kind, const PlanRun& run) {
  if (!run.id.starts_with(kind.runs)) return false;
  if (kind.name == "ballbar") return run.id.ends_with("slow");
  // Without those that only repeat the ball's poses.
  return kind.name == "laser" || !run.both_directions;
}

// A run that only records where it stood needs neither speeds nor a clock.
bool is_kept(const std::string& column) {
  static const std::set<std::string> left_out = {"time_s", "spindle_rpm", "tool_x_mm", "tool_y_mm"};
  return !column.starts_with("vel_") && left_out.count(column) == 0;
}

std::string without_readings(const config::CsvTable& table) {
  std::string out;
  for (const std::string& comment : table.comments) out += "#" + comment + "\n";
  const auto line = [&](const std::vector<std::string>& fields, bool header) {
    std::string text;
    for (std::size_t k = 0; k < fields.size(); ++k) {
      if (!is_kept(table.columns[k])) continue;
      if (k > 0) text += ",";
      if (header || table.columns[k] != "value") text += config::csv_field(fields[k]);
    }
    return text + "\n";
  };
  out += line(table.columns, true);
  for (const auto& row : table.rows) out += line(row.fields, false);
  return out;
}

}  // namespace

std::vector<std::string> template_kinds() {
  std::vector<std::string> out;
  for (const Kind& kind : kinds()) out.push_back(kind.name);
  return out;
}

Result<std::string> measurement_template(const Machine& machine, std::string_view name) {
  const auto kind =
      std::find_if(kinds().begin(), kinds().end(), [&](const Kind& k) { return k.name == name; });
  if (kind == kinds().end())
    return fail(ErrorCode::wrong_input, "there is no template '" + std::string(name) + "'");
  std::vector<PlanRun> runs;
  for (PlanRun& run : menu(machine, kAssumed_um * kMmPerUm, kAssumed_um * kRadPerUrad))
    if (is_wanted(*kind, run)) runs.push_back(std::move(run));
  if (runs.empty())
    return fail(ErrorCode::wrong_input,
                "machine '" + machine.name + "' has no axes for a template '" + kind->name + "'");
  if (kind->name == "probe") {
    runs.resize(1);
    runs.front().id = "probe";
    runs.front().n = {Vec3::UnitX(), -Vec3::UnitX(), Vec3::UnitY(), -Vec3::UnitY(), Vec3::UnitZ()};
  }
  const auto data = expand(runs, machine);
  if (!data) return tl::unexpected(data.error());
  const std::string text = measurements_text(
      *data, machine,
      {kind->words + "; machine '" + machine.name + "'",
       "Fill in value: actual minus nominal of the tool relative to the part, along n. Put right positions,",
       "dir_* (+1, -1: sense of the last motion), tool_z_mm, unit (um, mm, nm; urad, arcsec, deg ...) and",
       "u_random (standard uncertainty of one reading, same unit). Rows without a value are no readings."});
  Diagnostics none;  // our own text
  const auto table = config::parse_csv(text, "template", none);
  if (!table) return tl::unexpected(table.error());
  return without_readings(*table);
}

}  // namespace trunnion::diagnosis
