#include "trace/rows.hpp"

#include "trunnion/base/units.hpp"

namespace trunnion::trace {
namespace {

constexpr std::size_t kLeastTraceRows = 10;
constexpr double kSameMoment_s = 1e-9;  // traces are written with nine places

}  // namespace

std::string column_of(const Axis& axis) {
  return axis.name + (axis.kind == AxisKind::linear ? "_mm" : "_deg");
}

double unit_of(const Axis& axis) {
  return axis.kind == AxisKind::linear ? 1.0 : kRadPerDegree;
}

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

void SampleTaker::beyond(std::uint32_t line, double value, const char* what) {
  diagnostics_.error(out_.file, {line, 0}, shortest_text(value) + " is beyond " + what);
}

void SampleTaker::add(const Sample& sample) {
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

}  // namespace trunnion::trace
