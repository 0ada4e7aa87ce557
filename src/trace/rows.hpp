#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "trunnion/base/number_text.hpp"
#include "trunnion/trace/trace.hpp"

// Private to the layer: rows of a trace, from whatever they are read.
namespace trunnion::trace {

/// `X_mm`, `A_deg`: the column of an axis.
std::string column_of(const Axis& axis);
/// mm and rad in a unit of its column.
double unit_of(const Axis& axis);

inline constexpr double kLargestLine = 4e9;
inline constexpr double kLargestPosition = 1e9;  // mm, degrees: beyond any axis
inline constexpr double kLargestTime_s = 1e11;   // seconds of the year 5138

/// Which field is what.
struct Fields {
  std::optional<std::size_t> time, sample, block;
  double time_unit = 1.0;
  std::array<std::optional<std::size_t>, kMaxAxes> axes;
};

/// The place of a column in `out`; false: nobody knows it.
bool take_column(const std::string& name, std::size_t at, const Machine& machine, Fields& out);

/// There is a time and every axis; else an error that says what is missing.
bool has_all(const Fields& fields, const Machine& machine, const std::string& file, SourceRef where,
             Diagnostics& diagnostics);

/// Takes rows as they come; keeps those that are whole.
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
  void beyond(std::uint32_t line, double value, const char* what);
  void add(const Sample& sample);

  Trace& out_;
  const Machine& machine_;
  const Fields& fields_;
  Diagnostics& diagnostics_;
  bool went_back_ = false;
};

/// The trace, where it has no error and enough rows; warns of those that were left out.
Result<Trace> judged(Trace out, std::size_t errors, Diagnostics& diagnostics);

}  // namespace trunnion::trace
