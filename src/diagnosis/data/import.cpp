#include "trunnion/diagnosis/import.hpp"

#include <algorithm>

#include "trunnion/base/number_text.hpp"
#include "trunnion/config/csv.hpp"

namespace trunnion::diagnosis {
namespace {

struct TemperatureColumn {
  std::size_t column;
  std::string name;
};

// `bed_C` and `T_bed_degC` are temperatures, by the name `bed`.
std::vector<TemperatureColumn> temperatures(const config::CsvTable& table) {
  std::vector<TemperatureColumn> out;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    std::string name = table.columns[i];
    for (const std::string_view end : {std::string_view("_degC"), std::string_view("_C")}) {
      if (!name.ends_with(end)) continue;
      name.resize(name.size() - end.size());
      if (name.starts_with("T_")) name.erase(0, 2);
      if (!name.empty()) out.push_back({i, name});
      break;
    }
  }
  return out;
}

std::string direction_fields(const std::string& direction) {
  return direction == "X" ? "1,0,0" : direction == "Y" ? "0,1,0" : "0,0,1";
}

}  // namespace

Result<std::string> import_map(std::string_view text, const std::string& file, const MapImport& options,
                               Diagnostics& diagnostics) {
  std::string with_header;
  const auto first = text.find_first_of("0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ");
  const bool named = first != std::string_view::npos && !(text[first] >= '0' && text[first] <= '9');
  // The header stands on the first line's place, so that messages name the right line less one.
  if (!named) with_header = "x,y,ex,ey\n";
  with_header += text;
  const auto table = config::parse_csv(with_header, file, diagnostics);
  if (!table) return tl::unexpected(table.error());
  if (table->columns.size() != 4)
    return fail(ErrorCode::wrong_input, "a map has four columns: x, y, error along X, error along Y", file,
                {1, 1});
  if (table->rows.empty()) return fail(ErrorCode::wrong_input, "a map without a point", file, {1, 1});
  const std::size_t errors = diagnostics.error_count();
  // All at time 0: a map does not say when its points were read, and their order is no time.
  std::string out = "# map " + file + ", u_random " + shortest_text(options.u_random_um) + " um assumed\n" +
                    "run_id,time_s,X_mm,Y_mm,Z_mm,quantity,n_x,n_y,n_z,value,unit,u_random\n";
  const std::size_t parts = std::max<std::size_t>(options.parts, 1);
  std::size_t count = 0;
  for (const auto& row : table->rows) {
    double v[4] = {};
    for (std::size_t k = 0; k < 4; ++k) v[k] = config::csv_number(*table, row, k, diagnostics).value_or(0.0);
    const std::string head = "part_" + std::to_string(count % parts + 1) + ",0," + shortest_text(v[0]) + "," +
                             shortest_text(v[1]) + ",0,displacement,";
    for (std::size_t k = 0; k < 2; ++k)
      out += head + (k == 0 ? "1,0,0," : "0,1,0,") + shortest_text(v[2 + k]) + ",um," +
             shortest_text(options.u_random_um) + "\n";
    ++count;
  }
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  return out;
}

Result<std::string> import_log(std::string_view text, const std::string& file, const LogImport& options,
                               Diagnostics& diagnostics) {
  const auto table = config::parse_csv(text, file, diagnostics);
  if (!table) return tl::unexpected(table.error());
  const auto channel = table->column(options.channel);
  if (!channel)
    return fail(ErrorCode::wrong_input, "there is no channel '" + options.channel + "'", file,
                {table->header_line, 1});
  const auto time = table->column("time_s");
  if (!time && !table->column("sample"))
    diagnostics.warning(file, {table->header_line, 1},
                        "no column 'time_s': rows are taken to be " + shortest_text(options.step_s) +
                            " s apart (--step-s), whatever other columns say of the time");
  const auto run = table->column("run_id") ? table->column("run_id") : table->column("day");
  const auto rpm = table->column("spindle_rpm");
  const auto sensors = temperatures(*table);
  const std::size_t errors = diagnostics.error_count();
  std::string out = "# log " + file + ", channel " + options.channel + ", u_random " +
                    shortest_text(options.u_random_um) + " um assumed\n" +
                    "run_id,time_s,X_mm,Y_mm,Z_mm,spindle_rpm";
  for (const auto& sensor : sensors) out += ",T_" + sensor.name + "_degC";
  out += ",quantity,n_x,n_y,n_z,value,unit,u_random\n";
  std::string last_run;
  std::size_t in_run = 0, count = 0;
  for (const auto& row : table->rows) {
    const std::string id = run ? row.fields[*run] : "log";
    if (id != last_run) last_run = id, in_run = 0;
    const double t = time ? config::csv_number(*table, row, *time, diagnostics).value_or(0.0)
                          : static_cast<double>(in_run) * options.step_s;
    ++in_run;
    out += config::csv_field(id) + "," + shortest_text(t) + ",0,0,0," + (rpm ? row.fields[*rpm] : "0");
    for (const auto& sensor : sensors) out += "," + row.fields[sensor.column];
    const bool keep = count++ % std::max<std::size_t>(options.every, 1) == 0 && !row.fields[*channel].empty();
    if (keep) config::csv_number(*table, row, *channel, diagnostics);
    out += ",displacement," + direction_fields(options.direction) + "," + (keep ? row.fields[*channel] : "") +
           ",um," + shortest_text(options.u_random_um) + "\n";
  }
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  return out;
}

}  // namespace trunnion::diagnosis
