#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"
#include "trunnion/diagnosis/iso230_lines.hpp"

#include "diagnosis/data/reading_unit.hpp"

namespace trunnion::iso230 {
namespace {

// Positions that differ by less are the same target: below the resolution of any axis (mm, rad).
constexpr double kSameTarget = 1e-6;
// |n| may differ from 1 by the rounding of its printed digits.
constexpr double kUnitTolerance = 1e-4;

struct Columns {
  std::array<std::optional<std::size_t>, 6> position, direction;
  std::optional<std::size_t> run, quantity, frame, value, unit, n[3];
};

std::optional<std::size_t> need(const config::CsvTable& table, const char* name, Diagnostics& diagnostics) {
  const auto found = table.column(name);
  if (!found)
    diagnostics.error(table.file, {table.header_line, 1}, "column '" + std::string(name) + "' is missing");
  return found;
}

Columns find_columns(const config::CsvTable& table, Diagnostics& diagnostics) {
  Columns columns;
  for (std::size_t k = 0; k < Reading::kAxes.size(); ++k) {
    const std::string letter(1, Reading::kAxes[k]);
    columns.position[k] = table.column(letter + (k < 3 ? "_mm" : "_deg"));
    columns.direction[k] = table.column("dir_" + letter);
  }
  columns.run = need(table, "run_id", diagnostics);
  columns.quantity = need(table, "quantity", diagnostics);
  columns.frame = table.column("frame");
  columns.n[0] = need(table, "n_x", diagnostics);
  columns.n[1] = need(table, "n_y", diagnostics);
  columns.n[2] = need(table, "n_z", diagnostics);
  columns.value = need(table, "value", diagnostics);
  columns.unit = need(table, "unit", diagnostics);
  return columns;
}

// Fails (nothing) when a field is faulty; the fault is in `diagnostics`.
std::optional<Reading> reading_of(const config::CsvTable& table, const config::CsvTable::Row& row,
                                  const Columns& columns, Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.error_count();
  const auto number = [&](std::size_t column) {
    return config::csv_number(table, row, column, diagnostics).value_or(0.0);
  };
  const auto error = [&](std::size_t column, const std::string& message) {
    diagnostics.error(table.file, {row.line, static_cast<std::uint32_t>(column + 1)}, message);
  };
  Reading r;
  r.line = row.line;
  r.run = row.fields[*columns.run];
  for (std::size_t k = 0; k < 6; ++k) {
    if (columns.position[k]) r.position[k] = number(*columns.position[k]) * (k < 3 ? 1.0 : kRadPerDegree);
    if (columns.direction[k]) r.direction[k] = static_cast<int>(std::lround(number(*columns.direction[k])));
  }
  const std::string& quantity = row.fields[*columns.quantity];
  r.rotation = quantity == "rotation";
  if (!r.rotation && quantity != "displacement")
    error(*columns.quantity, "quantity is '" + quantity + "', expected displacement or rotation");
  if (columns.frame) r.part_frame = row.fields[*columns.frame] == "part";
  r.n = {number(*columns.n[0]), number(*columns.n[1]), number(*columns.n[2])};
  if (std::abs(r.n.norm() - 1.0) > kUnitTolerance)
    error(*columns.n[0], "n has the length " + shortest_text(r.n.norm()) + ", expected 1");
  const std::string& unit = row.fields[*columns.unit];
  const auto factor = diagnosis::factor_of_unit(
      r.rotation ? diagnosis::Quantity::rotation : diagnosis::Quantity::displacement, unit);
  if (!factor) error(*columns.unit, "unit is '" + unit + "', expected " + (r.rotation ? "urad" : "um"));
  r.deviation = number(*columns.value) * factor.value_or(0.0);
  if (diagnostics.error_count() > before) return std::nullopt;
  r.n.normalize();
  return r;
}

// A reading on its line: position along it, sense, deviation along it.
struct Sample {
  double s = 0.0;
  int sense = 0;
  double deviation = 0.0;
  std::string run;
};

// Sense of approach where the file does not say: the way from the run's last reading, or to its next.
void complete_senses(std::vector<Sample>& samples) {
  const auto step = [&](std::size_t from, std::size_t to) {
    if (samples[from].run != samples[to].run) return 0;
    const double d = samples[to].s - samples[from].s;
    return d > kSameTarget ? 1 : d < -kSameTarget ? -1 : 0;
  };
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].sense != 0) continue;
    if (i > 0) samples[i].sense = step(i - 1, i);
    for (std::size_t k = i + 1; samples[i].sense == 0 && k < samples.size(); ++k)
      samples[i].sense = step(i, k);
  }
}

Result<LineTest> make_line(std::string name, std::vector<Sample> samples, const std::string& file) {
  complete_senses(samples);
  LineTest line;
  line.name = std::move(name);
  for (const Sample& sample : samples) line.target.push_back(sample.s);
  std::sort(line.target.begin(), line.target.end());
  line.target.erase(std::unique(line.target.begin(), line.target.end(),
                                [](double a, double b) { return b - a < kSameTarget; }),
                    line.target.end());
  line.up.resize(line.target.size());
  line.down.resize(line.target.size());
  for (const Sample& sample : samples) {
    if (sample.sense == 0)
      return fail(ErrorCode::wrong_input,
                  "line " + line.name + ": the direction of approach of a reading at " +
                      shortest_text(sample.s) + " is unknown (columns dir_*)",
                  file);
    const auto at = std::lower_bound(line.target.begin(), line.target.end(), sample.s - kSameTarget);
    auto& list = sample.sense > 0 ? line.up : line.down;
    list[static_cast<std::size_t>(at - line.target.begin())].push_back(sample.deviation);
  }
  const auto is_empty = [](const std::vector<double>& v) { return v.empty(); };
  if (std::all_of(line.up.begin(), line.up.end(), is_empty)) line.up.clear();
  if (std::all_of(line.down.begin(), line.down.end(), is_empty)) line.down.clear();
  return line;
}

// Rounded to the tolerance, as a key of a map.
long long key_of(double value) {
  return std::llround(value / kSameTarget);
}

std::string diagonal_name(const Vec3& n) {
  std::string name;
  for (int k = 0; k < 3; ++k)
    if (std::abs(n[k]) > kSameTarget)
      name += std::string(n[k] > 0 ? "+" : "-") + Reading::kAxes[static_cast<std::size_t>(k)];
  return name;
}

bool varies(const std::vector<Sample>& samples) {
  return std::any_of(samples.begin(), samples.end(),
                     [&](const Sample& s) { return std::abs(s.s - samples.front().s) > kSameTarget; });
}

}  // namespace

Result<Readings> parse_readings(std::string_view csv, const std::string& file, Diagnostics& diagnostics) {
  const auto table = config::parse_csv(csv, file, diagnostics);
  if (!table) return tl::unexpected(table.error());
  const std::size_t before = diagnostics.error_count();
  const Columns columns = find_columns(*table, diagnostics);
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  Readings readings{.file = file, .rows = {}};
  for (const auto& row : table->rows) {
    if (row.fields[*columns.value].find_first_not_of(" \t") == std::string::npos)
      continue;  // records the state only
    if (auto reading = reading_of(*table, row, columns, diagnostics))
      readings.rows.push_back(std::move(*reading));
  }
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  return readings;
}

Result<std::vector<LineTest>> axis_lines(const Readings& readings) {
  struct Group {
    std::size_t axis = 0;
    std::vector<Sample> samples;
  };
  std::map<std::pair<std::size_t, std::vector<long long>>, Group> groups;
  for (const Reading& r : readings.rows) {
    Eigen::Index along = 0;
    if (r.n.cwiseAbs().maxCoeff(&along) < 1.0 - kUnitTolerance) continue;
    const std::size_t axis = static_cast<std::size_t>(along) + (r.rotation ? 3U : 0U);
    std::vector<long long> rest;
    for (std::size_t k = 0; k < 6; ++k)
      if (k != axis) rest.push_back(key_of(r.position[k]));
    Group& group = groups[{axis, rest}];
    group.axis = axis;
    group.samples.push_back(
        {r.position[axis], r.direction[axis], r.deviation * (r.n[along] > 0 ? 1.0 : -1.0), r.run});
  }
  std::vector<LineTest> lines;
  for (auto& [key, group] : groups) {
    if (!varies(group.samples)) continue;
    auto line =
        make_line(std::string(1, Reading::kAxes[group.axis]), std::move(group.samples), readings.file);
    if (!line) return tl::unexpected(line.error());
    line->rotary = group.axis >= 3;
    if (group.axis < 3) line->direction_M = Vec3::Unit(static_cast<Eigen::Index>(group.axis));
    lines.push_back(std::move(*line));
  }
  if (lines.empty())
    return fail(ErrorCode::wrong_input,
                "no axis moves along (or about) the direction in which it is read; an ISO 230-2 test needs "
                "readings of an axis' own positioning",
                readings.file);
  return lines;
}

Result<std::vector<LineTest>> diagonal_lines(const Readings& readings) {
  struct Group {
    Vec3 n = Vec3::Zero();
    std::vector<Sample> samples;
  };
  std::map<std::vector<long long>, Group> groups;
  for (const Reading& r : readings.rows) {
    if (r.rotation || (r.n.cwiseAbs().array() > kUnitTolerance).count() < 2) continue;
    Vec3 n = r.n;
    for (int k = 0; k < 3; ++k)
      if (std::abs(n[k]) > kUnitTolerance) {
        if (n[k] < 0) n = -n;
        break;
      }
    const Vec3 p(r.position[0], r.position[1], r.position[2]);
    int sense = 0;
    for (int k = 0; k < 3; ++k)
      if (std::abs(n[k]) > kUnitTolerance && sense == 0) sense = r.direction[k] * (n[k] > 0 ? 1 : -1);
    // Digits of n as printed decide what is one line: four of them.
    std::vector<long long> key;
    key.reserve(3);
    for (int k = 0; k < 3; ++k) key.push_back(std::llround(n[k] / kUnitTolerance));
    Group& group = groups[key];
    group.n = n;
    group.samples.push_back({n.dot(p), sense, r.deviation * (r.n.dot(n) > 0 ? 1.0 : -1.0), r.run});
  }
  std::vector<LineTest> lines;
  for (auto& [key, group] : groups) {
    if (!varies(group.samples)) continue;
    double low = group.samples.front().s;
    for (const Sample& sample : group.samples) low = std::min(low, sample.s);
    for (Sample& sample : group.samples) sample.s -= low;
    auto line = make_line(diagonal_name(group.n), std::move(group.samples), readings.file);
    if (!line) return tl::unexpected(line.error());
    line->direction_M = group.n;
    lines.push_back(std::move(*line));
  }
  if (lines.empty())
    return fail(ErrorCode::wrong_input,
                "no readings along a diagonal: n needs two or three components that are not zero, and the "
                "position has to move along it",
                readings.file);
  return lines;
}

}  // namespace trunnion::iso230
