#include "trunnion/trace/trace.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"

#include "trace/rows.hpp"

namespace trunnion::trace {
namespace {

constexpr int kTimePlaces = 9;

void read_comments(const std::vector<std::string>& comments, Trace& out, Diagnostics& diagnostics) {
  for (std::string text : comments) {
    text.erase(std::remove_if(text.begin(), text.end(), [](char c) { return c == ' ' || c == '\t'; }),
               text.end());
    constexpr std::string_view kValuesApart = "valuesapart:";
    if (text.starts_with(kValuesApart)) {
      // Without its unit it is no number: 20 may be milliseconds.
      const bool in_seconds = text.ends_with('s');
      const ParsedNumber apart = parse_number(
          std::string_view(text).substr(kValuesApart.size(), text.size() - kValuesApart.size() - 1));
      if (in_seconds && apart && apart.value >= 0.0 && std::isfinite(apart.value))
        out.apart_s = apart.value;
      else
        diagnostics.error(out.file, {}, "values are apart by seconds, as in 'values apart: 0.02 s'");
    }
    if (!text.starts_with("positions:")) continue;
    const std::string what = text.substr(text.find(':') + 1);
    if (what == "words")
      out.positions = Positions::words;
    else if (what == "joints")
      out.positions = Positions::joints;
    else
      diagnostics.error(out.file, {}, "positions are 'joints' or 'words', not '" + what + "'");
  }
}

std::vector<std::string_view> split_fields(std::string_view line, std::string_view between) {
  std::vector<std::string_view> out;
  for (auto at = line.find_first_not_of(between); at != std::string_view::npos;) {
    const auto end = std::min(line.find_first_of(between, at), line.size());
    out.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(between, end);
  }
  return out;
}

// The fields of a line of `count`. Where semicolons or tabs make as many a comma is that of a decimal.
std::vector<std::string_view> list_fields(std::string_view line, std::size_t count, std::string& points) {
  if (line.find(',') != std::string_view::npos && line.find_first_of(";\t") != std::string_view::npos) {
    points = line;
    std::replace(points.begin(), points.end(), ',', '.');
    auto fields = split_fields(points, "; \t\r");
    if (fields.size() >= count) return fields;
  }
  return split_fields(line, " \t,;\r");
}

std::optional<Fields> fields_of(const ListImport& how, const Machine& machine, const std::string& file,
                                Diagnostics& diagnostics) {
  Fields fields;
  for (std::size_t i = 0; i < how.columns.size(); ++i) {
    const std::string& name = how.columns[i];
    if (name == "sample") {
      fields.sample = i;
    } else if (name != "-" && !take_column(name, i, machine, fields)) {
      std::string known = "time_s, time_ms, sample, block, -";
      for (const Axis& axis : machine.axes) known += ", " + column_of(axis);
      diagnostics.error(file, {}, "nobody knows the column '" + name + "'; columns are " + known);
      return std::nullopt;
    }
  }
  if (!has_all(fields, machine, file, {}, diagnostics)) return std::nullopt;
  return fields;
}

}  // namespace

Result<Trace> parse_trace(std::string_view text, const std::string& file, const Machine& machine,
                          Diagnostics& diagnostics) {
  const std::size_t errors = diagnostics.error_count();
  Trace out;
  out.file = file;
  config::CsvRows rows(text, file, diagnostics);
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  Fields fields;
  for (std::size_t i = 0; i < rows.columns().size(); ++i) {
    const std::string& name = rows.columns()[i];
    if (!take_column(name, i, machine, fields))
      diagnostics.warning(file, {rows.header_line(), static_cast<std::uint32_t>(i + 1)},
                          "the column '" + name + "' is none that a trace has; it is left out");
  }
  if (!has_all(fields, machine, file, {rows.header_line(), 1}, diagnostics))
    return tl::unexpected(diagnostics.first_error());
  SampleTaker taker(out, machine, fields, diagnostics);
  while (rows.next()) taker.take(rows.line(), 1.0, [&](std::size_t i) { return rows.number_or_nan(i); });
  read_comments(rows.comments(), out, diagnostics);
  return judged(std::move(out), errors, diagnostics);
}

Result<Trace> parse_list(std::string_view text, const std::string& file, const Machine& machine,
                         const ListImport& how, Diagnostics& diagnostics) {
  const std::size_t errors = diagnostics.error_count();
  const auto fields = fields_of(how, machine, file, diagnostics);
  if (!fields) return tl::unexpected(diagnostics.first_error());
  Trace out;
  out.file = file;
  SampleTaker taker(out, machine, *fields, diagnostics);
  std::uint32_t line = 0;
  std::size_t words = 0;
  std::string points;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const auto parts = list_fields(text.substr(at, end - at), how.columns.size(), points);
    at = end + 1;
    ++line;
    if (parts.empty() || parts[0].front() == '#') continue;
    if (!parse_number(parts[0])) {
      ++words;
      continue;
    }
    if (parts.size() < how.columns.size()) {
      diagnostics.error(file, {line, 1},
                        "this line has " + std::to_string(parts.size()) + " fields; the columns name " +
                            std::to_string(how.columns.size()));
      break;
    }
    taker.take(line, how.period_s, [&](std::size_t i) -> std::optional<double> {
      const ParsedNumber number = parse_number(parts[i]);
      if (number) return number.value;
      diagnostics.error(file, {line, static_cast<std::uint32_t>(i + 1)},
                        "'" + std::string(parts[i]) + "' is no number");
      return std::nullopt;
    });
  }
  if (words > 0)
    diagnostics.warning(file, {},
                        std::to_string(words) +
                            " lines begin with a word and are left out (an overrun of "
                            "the recorder: samples were lost there)");
  return judged(std::move(out), errors, diagnostics);
}

std::string trace_text(const Trace& trace, const Machine& machine, const std::vector<std::string>& comments) {
  constexpr int kPlaces = 6;
  std::string out;
  for (const std::string& comment : comments) out += "# " + comment + "\n";
  out += trace.positions == Positions::joints ? "# positions: joints\n" : "# positions: words\n";
  if (trace.apart_s > 0.0) out += "# values apart: " + shortest_text(trace.apart_s) + " s\n";
  out += "time_s";
  for (const Axis& axis : machine.axes) out += "," + column_of(axis);
  if (trace.has_blocks) out += ",block";
  out += "\n";
  for (const Sample& sample : trace.samples) {
    out += fixed_text(sample.time_s, kTimePlaces);
    for (AxisId id = 0; id < machine.axes.size(); ++id)
      out += "," + fixed_text(sample.q[id] / unit_of(machine.axes[id]), kPlaces);
    if (trace.has_blocks) out += "," + std::to_string(sample.nc_line);
    out += "\n";
  }
  return out;
}

}  // namespace trunnion::trace
