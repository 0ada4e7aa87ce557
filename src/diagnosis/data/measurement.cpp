#include "trunnion/diagnosis/measurement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/texts.hpp"
#include "trunnion/base/units.hpp"

#include "diagnosis/data/measurement_columns.hpp"
#include "diagnosis/data/reading_unit.hpp"
#include "diagnosis/data/zeroed_groups.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kNotRead =
    std::numeric_limits<double>::quiet_NaN();  // an empty sensor field, until it is filled in
constexpr double kSameDirection = 1e-6;        // README, "u_common": n equal within this
constexpr double kDirectionLengthError =
    1e-2;  // n given with two decimals, (0.71, 0.71, 0), is still a direction

// One row with its values apart, as long as several files' sensors are being joined.
struct RawRow {
  MachineState state;
  RowOrigin origin;
  std::string run_id;
  std::map<std::string, double> temperatures, states;
  std::optional<Reading> reading;
};

class RowReader {
 public:
  RowReader(const config::CsvTable& table, const MeasurementColumns& columns, const Machine& machine,
            Diagnostics& diagnostics)
      : table_(table), columns_(columns), machine_(machine), diagnostics_(diagnostics) {}

  RawRow read(const config::CsvTable::Row& row, std::size_t file) {
    row_ = &row;
    RawRow out;
    out.run_id = text(columns_.run_id);
    if (out.run_id.empty()) error(*columns_.run_id, "run_id is empty");
    out.origin = {file, row.line, machine_.tool_vector()};
    out.state.time_s = optional_number(columns_.time, kNotRead);
    for (std::size_t a = 0; a < machine_.axes.size(); ++a) read_axis(a, out.state);
    out.state.spindle_rpm = optional_number(columns_.rpm, 0.0);
    for (const auto& sensor : columns_.temperatures)
      out.temperatures[sensor.name] = optional_number(sensor.column, kNotRead) - machine_.reference_degC;
    for (const auto& sensor : columns_.states)
      out.states[sensor.name] = optional_number(sensor.column, kNotRead);
    for (int i = 0; i < 3; ++i)
      out.origin.tool_mm[i] =
          optional_number(columns_.tool[static_cast<std::size_t>(i)], out.origin.tool_mm[i]);
    if (!text(columns_.value).empty()) out.reading = read_reading();
    return out;
  }

 private:
  std::string text(std::optional<std::size_t> column) const {
    if (!column) return {};
    const std::string& field = row_->fields[*column];
    const auto begin = field.find_first_not_of(" \t");
    return begin == std::string::npos ? std::string()
                                      : field.substr(begin, field.find_last_not_of(" \t") - begin + 1);
  }
  void error(std::size_t column, const std::string& message) {
    diagnostics_.error(table_.file, {row_->line, static_cast<std::uint32_t>(column + 1)}, message);
  }
  double number(std::size_t column) {
    return config::csv_number(table_, *row_, column, diagnostics_).value_or(0.0);
  }
  double optional_number(std::optional<std::size_t> column, double fallback) {
    return text(column).empty() ? fallback : number(*column);
  }

  void read_axis(std::size_t a, MachineState& state) {
    const auto& columns = columns_.axes[a];
    const double unit = machine_.axes[a].kind == AxisKind::linear ? 1.0 : kRadPerDegree;
    state.q[a] = number(*columns.position) * unit;
    state.velocity[a] = optional_number(columns.velocity, 0.0) * unit / kSecondsPerMinute;
    const double direction = optional_number(columns.direction, 0.0);
    if (direction != 0.0 && std::abs(direction) != 1.0)
      error(*columns.direction,
            direction_column(machine_.axes[a]) + " must be +1, -1 or 0, not " + shortest_text(direction));
    state.direction[a] = static_cast<std::int8_t>((direction > 0.0) - (direction < 0.0));
  }

  Reading read_reading() {
    Reading reading;
    const std::string quantity = text(columns_.quantity);
    if (quantity == "rotation")
      reading.quantity = Quantity::rotation;
    else if (quantity != "displacement")
      error(*columns_.quantity, "quantity must be 'displacement' or 'rotation', not '" + quantity + "'");
    const std::string frame = text(columns_.frame);
    if (frame == "part")
      reading.frame = SensitivityFrame::part;
    else if (!frame.empty() && frame != "machine")
      error(*columns_.frame, "frame must be 'machine' or 'part', not '" + frame + "'");
    const std::string unit = text(columns_.unit);
    const std::optional<double> known = factor_of_unit(reading.quantity, unit);
    if (!known)
      error(*columns_.unit, "the unit of a " + quantity + " must be " +
                                (reading.quantity == Quantity::displacement
                                     ? "'um' (or 'mm', 'nm', 'in')"
                                     : "'urad' (or 'mrad', 'rad', 'arcsec', 'arcmin', 'deg')") +
                                ", not '" + unit + "'");
    const double factor = known.value_or(1.0);
    for (int i = 0; i < 3; ++i) reading.n[i] = number(*columns_.n[static_cast<std::size_t>(i)]);
    const double length = reading.n.norm();
    if (std::abs(length - 1.0) > kDirectionLengthError)
      error(*columns_.n[0], "(n_x, n_y, n_z) must be a unit vector; its length is " + shortest_text(length));
    else
      reading.n /= length;
    reading.value = number(*columns_.value) * factor;
    reading.u_random = number(*columns_.u_random) * factor;
    if (!(reading.u_random > 0.0)) error(*columns_.u_random, "u_random must be greater than 0");
    if (columns_.u_common && text(columns_.u_common).empty())
      reading.u_common = std::nullopt;
    else
      reading.u_common = optional_number(columns_.u_common, 0.0) * factor;
    if (reading.u_common.value_or(0.0) < 0.0) error(*columns_.u_common, "u_common must not be negative");
    return reading;
  }

  const config::CsvTable& table_;
  const MeasurementColumns& columns_;
  const Machine& machine_;
  Diagnostics& diagnostics_;
  const config::CsvTable::Row* row_ = nullptr;
};

// The number of the row within its run, where no time is given.
void number_rows_without_time(std::vector<RawRow>& rows) {
  std::map<std::string, double> next;
  for (RawRow& row : rows) {
    double& count = next[row.run_id];
    if (std::isnan(row.state.time_s)) row.state.time_s = count;
    count += 1.0;
  }
}

struct Span {
  double begin = std::numeric_limits<double>::infinity();
  double end = -std::numeric_limits<double>::infinity();
};

// A run_id in a further file goes on with the run when its times do; else that file measured a run of its
// own.
class RunNames {
 public:
  void rename(std::vector<RawRow>& rows, const std::string& file, Diagnostics& diagnostics) {
    std::map<std::string, Span> here;
    for (const RawRow& row : rows) {
      Span& span = here[row.run_id];
      span.begin = std::min(span.begin, row.state.time_s);
      span.end = std::max(span.end, row.state.time_s);
    }
    std::map<std::string, std::string> new_name;
    for (const auto& [id, span] : here) {
      std::string name = id;
      const auto before = seen_.find(id);
      if (before != seen_.end() && span.begin < before->second.end) {
        for (int i = 1; seen_.contains(name) || here.contains(name); ++i)
          name = id + " (" + file + (i == 1 ? "" : ", " + std::to_string(i)) + ")";
        diagnostics.note(
            file, {},
            "run '" + id +
                "' stands in several files with overlapping times: here it is a run of its own, '" + name +
                "'");
      }
      new_name[id] = name;
    }
    for (const auto& [id, span] : here) {
      Span& known = seen_[new_name[id]];
      known.begin = std::min(known.begin, span.begin);
      known.end = std::max(known.end, span.end);
    }
    for (RawRow& row : rows) row.run_id = new_name[row.run_id];
  }

 private:
  std::map<std::string, Span> seen_;
};

// Sensors that some files lack, and empty fields: a value holds until the next one of its run; before the
// first one it was the first one; a run without any is at reference (temperature) or 0 (state).
void fill_in(std::vector<RawRow>& rows, std::vector<std::size_t>& by_time, const std::string& sensor,
             std::map<std::string, double> RawRow::*values) {
  double last = kNotRead;
  for (int pass = 0; pass < 2; ++pass) {
    for (const std::size_t i : by_time) {
      auto [it, missing] = (rows[i].*values).try_emplace(sensor, kNotRead);
      if (std::isnan(it->second)) it->second = last;
      last = it->second;
    }
    std::reverse(by_time.begin(), by_time.end());
  }
  for (const std::size_t i : by_time) {
    double& value = (rows[i].*values)[sensor];
    if (std::isnan(value)) value = 0.0;
  }
}

EffectContext context_of(std::vector<RawRow>& rows) {
  EffectContext context;
  std::vector<std::string> ids;
  for (RawRow& row : rows) {
    row.state.run = index_of(ids, row.run_id);
    if (row.state.run == context.runs.size()) context.runs.push_back({row.run_id, row.state.time_s});
    RunInfo& run = context.runs[row.state.run];
    run.duration_s = std::max(run.duration_s, row.state.time_s);
    for (const auto& [name, value] : row.temperatures) index_of(context.names.temperatures, name);
    for (const auto& [name, value] : row.states) index_of(context.names.states, name);
  }
  return context;
}

Dataset joined_files(std::vector<RawRow>& rows, std::vector<std::string> files) {
  EffectContext context = context_of(rows);
  std::vector<std::vector<std::size_t>> by_time(context.runs.size());
  for (std::size_t i = 0; i < rows.size(); ++i) by_time[rows[i].state.run].push_back(i);
  for (auto& run : by_time) {
    std::stable_sort(run.begin(), run.end(), [&](std::size_t a, std::size_t b) {
      return rows[a].state.time_s < rows[b].state.time_s;
    });
    for (const auto& name : context.names.temperatures) fill_in(rows, run, name, &RawRow::temperatures);
    for (const auto& name : context.names.states) fill_in(rows, run, name, &RawRow::states);
  }
  std::vector<double> values;
  for (const RawRow& row : rows) {
    for (const auto& name : context.names.temperatures) values.push_back(row.temperatures.at(name));
    for (const auto& name : context.names.states) values.push_back(row.states.at(name));
  }
  const std::size_t temperatures = context.names.temperatures.size();
  const std::size_t width = temperatures + context.names.states.size();
  std::vector<MachineState> states;
  std::vector<RowOrigin> origins;
  std::vector<Reading> readings;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    MachineState state = rows[i].state;
    const std::span<const double> all(values.data() + i * width, width);
    state.temperature_K = all.first(temperatures);
    state.state = all.subspan(temperatures);
    states.push_back(state);
    origins.push_back(rows[i].origin);
    if (!rows[i].reading) continue;
    readings.push_back(*rows[i].reading);
    readings.back().row = i;
  }
  Dataset out = make_dataset(std::move(context), states, std::move(origins), std::move(readings));
  out.files = std::move(files);
  mark_zeroed(out);
  return out;
}

}  // namespace

Dataset make_dataset(EffectContext context, std::span<const MachineState> states, std::vector<RowOrigin> rows,
                     std::vector<Reading> readings) {
  TRUNNION_EXPECTS(states.size() == rows.size());
  Dataset out;
  out.context = std::move(context);
  out.track = StateTrack(states);
  out.rows = std::move(rows);
  out.readings = std::move(readings);
  using Key = std::tuple<std::size_t, Quantity, SensitivityFrame, std::int64_t, std::int64_t, std::int64_t>;
  std::map<Key, std::size_t> groups;
  const auto cell = [](double x) { return static_cast<std::int64_t>(std::llround(x / kSameDirection)); };
  for (Reading& r : out.readings) {
    const Key key{states[r.row].run, r.quantity, r.frame, cell(r.n.x()), cell(r.n.y()), cell(r.n.z())};
    // Two n within kSameDirection may fall into neighbouring cells: look there too before a new group is
    // opened.
    auto it = groups.find(key);
    for (int i = 0; it == groups.end() && i < 27; ++i) {
      Key near = key;
      std::get<3>(near) += i % 3 - 1;
      std::get<4>(near) += i / 3 % 3 - 1;
      std::get<5>(near) += i / 9 - 1;
      it = groups.find(near);
    }
    if (it == groups.end()) it = groups.emplace(key, out.group_count++).first;
    r.group = it->second;
  }
  return out;
}

Result<Dataset> parse_measurements(std::span<const NamedText> files, const Machine& machine,
                                   Diagnostics& diagnostics) {
  const std::size_t errors_before = diagnostics.error_count();
  std::vector<RawRow> all;
  std::vector<std::string> names;
  RunNames runs;
  for (const NamedText& file : files) {
    const auto table = config::parse_csv(file.text, file.file, diagnostics);
    if (!table) continue;
    const std::size_t before = diagnostics.error_count();
    const MeasurementColumns columns = measurement_columns(*table, machine, diagnostics);
    if (diagnostics.error_count() > before) continue;
    RowReader reader(*table, columns, machine, diagnostics);
    std::vector<RawRow> rows;
    for (const auto& row : table->rows) rows.push_back(reader.read(row, names.size()));
    names.push_back(file.file);
    number_rows_without_time(rows);
    runs.rename(rows, file.file, diagnostics);
    all.insert(all.end(), std::make_move_iterator(rows.begin()), std::make_move_iterator(rows.end()));
  }
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  Dataset out = joined_files(all, std::move(names));
  if (out.readings.empty())
    return fail(ErrorCode::wrong_input, "no row has a value: nothing was measured",
                files.empty() ? "" : files.front().file);
  return out;
}

Result<Dataset> load_measurements(const std::vector<std::string>& paths, const Machine& machine,
                                  Diagnostics& diagnostics) {
  std::vector<NamedText> texts;
  for (const std::string& path : paths) {
    auto text = read_file(path);
    if (!text) return tl::unexpected(text.error());
    texts.push_back({path, std::move(*text)});
  }
  return parse_measurements(texts, machine, diagnostics);
}

}  // namespace trunnion::diagnosis
