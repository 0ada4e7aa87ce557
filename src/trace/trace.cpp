#include "trunnion/trace/trace.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"

namespace trunnion::trace {
namespace {

constexpr std::size_t kLeastTraceRows = 10;
constexpr double kLargestLine = 4e9;
constexpr double kLargestPosition = 1e9;  // mm, degrees: beyond any axis
constexpr double kLargestTime_s = 1e11;   // seconds of the year 5138
// Written with nine places: nearer times are the same moment.
constexpr int kTimePlaces = 9;
constexpr double kSameMoment_s = 1e-9;

std::string column_of(const Axis& axis) {
  return axis.name + (axis.kind == AxisKind::linear ? "_mm" : "_deg");
}

double unit_of(const Axis& axis) {
  return axis.kind == AxisKind::linear ? 1.0 : kRadPerDegree;
}

// Which field is what.
struct Fields {
  std::optional<std::size_t> time, sample, block;
  double time_unit = 1.0;
  std::array<std::optional<std::size_t>, kMaxAxes> axes;
};

// The place of a column in `out`; false: nobody knows it.
bool take_column(const std::string& name, std::size_t at, const Machine& machine, Fields& out) {
  if (name == "time_s" || name == "time_ms") {
    out.time = at;
    out.time_unit = name == "time_s" ? 1.0 : 1e-3;
    return true;
  }
  if (name == "block") {
    out.block = at;
    return true;
  }
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    if (name != column_of(machine.axes[id])) continue;
    out.axes[id] = at;
    return true;
  }
  return false;
}

bool has_all(const Fields& fields, const Machine& machine, const std::string& file, SourceRef where,
             Diagnostics& diagnostics) {
  std::string missing;
  const auto miss = [&](const std::string& name) { missing += (missing.empty() ? "" : ", ") + name; };
  if (!fields.time && !fields.sample) miss("time_s");
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    if (!fields.axes[id]) miss(column_of(machine.axes[id]));
  }
  if (missing.empty()) return true;
  diagnostics.error(file, where,
                    "a trace has time_s and a column for every axis of the machine; missing: " + missing);
  return false;
}

// Takes rows as they come; keeps those that are whole.
class SampleTaker {
 public:
  SampleTaker(Trace& out, const Machine& machine, const Fields& fields, Diagnostics& diagnostics)
      : out_(out), machine_(machine), fields_(fields), diagnostics_(diagnostics) {
    out_.has_blocks = fields.block.has_value();
  }

  /// `number`: of a field; NaN where it is empty, nothing where it is none.
  template <class Number>
  void take(std::uint32_t line, double period_s, const Number& number) {
    ++out_.rows;
    Sample sample;
    sample.file_line = line;
    const auto time = number(fields_.time ? *fields_.time : *fields_.sample);
    if (!time) return;
    sample.time_s = *time * (fields_.time ? fields_.time_unit : period_s);
    bool whole = std::isfinite(*time);
    if (std::abs(sample.time_s) > kLargestTime_s) return beyond(line, *time, "any clock");
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const auto value = number(*fields_.axes[id]);
      if (!value) return;
      if (std::abs(*value) > kLargestPosition) return beyond(line, *value, "any axis");
      whole = whole && std::isfinite(*value);
      sample.q[id] = *value * unit_of(machine_.axes[id]);
    }
    if (fields_.block) {
      const auto value = number(*fields_.block);
      if (!value) return;
      if (std::isfinite(*value) && (*value < 0.0 || *value > kLargestLine || std::floor(*value) != *value)) {
        diagnostics_.error(out_.file, {line, static_cast<std::uint32_t>(*fields_.block + 1)},
                           "block is the line of the program, a whole number, not " + shortest_text(*value));
        return;
      }
      sample.nc_line = std::isfinite(*value) ? static_cast<std::uint32_t>(*value) : 0;
    }
    if (!whole) {
      ++out_.incomplete;
      return;
    }
    add(sample);
  }

 private:
  void beyond(std::uint32_t line, double value, const char* what) {
    diagnostics_.error(out_.file, {line, 0}, shortest_text(value) + " is beyond " + what);
  }
  void add(const Sample& sample) {
    if (!out_.samples.empty()) {
      const Sample& last = out_.samples.back();
      if (sample.time_s < last.time_s) {
        if (!went_back_)
          diagnostics_.error(out_.file, {sample.file_line, 0},
                             "the time goes back, from " + shortest_text(last.time_s) + " s in line " +
                                 std::to_string(last.file_line) + " to " + shortest_text(sample.time_s) +
                                 " s: rows of one trace stand in the order of their times, by one clock");
        went_back_ = true;
        return;
      }
      // The same moment twice: the recorder repeated itself.
      if (sample.time_s - last.time_s < kSameMoment_s) {
        ++out_.incomplete;
        return;
      }
    }
    out_.samples.push_back(sample);
  }

  Trace& out_;
  const Machine& machine_;
  const Fields& fields_;
  Diagnostics& diagnostics_;
  bool went_back_ = false;
};

void read_comments(const std::vector<std::string>& comments, Trace& out, Diagnostics& diagnostics) {
  for (std::string text : comments) {
    text.erase(std::remove_if(text.begin(), text.end(), [](char c) { return c == ' ' || c == '\t'; }),
               text.end());
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

Result<Trace> judged(Trace out, std::size_t errors, Diagnostics& diagnostics) {
  if (diagnostics.error_count() > errors) return tl::unexpected(diagnostics.first_error());
  if (out.samples.size() < kLeastTraceRows)
    return fail(ErrorCode::wrong_input,
                "a trace of " + std::to_string(out.samples.size()) +
                    " complete rows says nothing; at least " + std::to_string(kLeastTraceRows) +
                    " are needed",
                out.file);
  if (out.incomplete > 0)
    diagnostics.warning(out.file, {},
                        std::to_string(out.incomplete) + " of " + std::to_string(out.rows) +
                            " rows are left out: a field is empty, or the time is that of the row before");
  return out;
}

std::vector<std::string_view> split_fields(std::string_view line) {
  constexpr std::string_view kBetween = " \t,;\r";
  std::vector<std::string_view> out;
  for (auto at = line.find_first_not_of(kBetween); at != std::string_view::npos;) {
    const auto end = std::min(line.find_first_of(kBetween, at), line.size());
    out.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBetween, end);
  }
  return out;
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
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const auto parts = split_fields(text.substr(at, end - at));
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
