#include "trunnion/base/shdr.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "trunnion/base/field_text.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/trace/trace.hpp"

#include "trace/rows.hpp"

namespace trunnion::trace {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostNames = 12;  // that a message lists
// Of the usual step: an axis that says nothing for longer stood still, since adapters send what changes.
constexpr double kSilent = 1.5;

// One value of an item.
struct Observation {
  double time_s = 0.0;
  double value = 0.0;  // NaN: not available
};
using Course = std::vector<Observation>;

// Reads the lines into a course of each item.
class ShdrReader {
 public:
  ShdrReader(const ShdrImport& how, std::string file, Diagnostics& diagnostics)
      : how_(how), file_(std::move(file)), diagnostics_(diagnostics), courses_(how.items.size()) {}

  bool read(std::string_view text) {
    const std::size_t errors = diagnostics_.error_count();
    for (std::size_t at = 0; at < text.size() && diagnostics_.error_count() == errors;) {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      ++line_;
      take(trimmed(text.substr(at, end - at)));
      at = end + 1;
    }
    if (diagnostics_.error_count() > errors) return false;
    for (std::size_t i = 0; i < courses_.size(); ++i) {
      if (courses_[i].empty())
        diagnostics_.error(file_, {}, "no line gives the item '" + how_.items[i].key + "'" + names());
    }
    return diagnostics_.error_count() == errors;
  }
  std::vector<Course>& courses() { return courses_; }

 private:
  void take(std::string_view line) {
    if (line.empty() || line.front() == '*' || line.front() == '#') return;
    const auto read = parse_shdr_line(line);
    if (!read) {
      diagnostics_.error(file_, {line_, 1}, read.error().message);
      return;
    }
    const auto time = time_of(read->time);
    for (const LiveValue& value : read->values) {
      const auto item = item_of(value.item);
      if (!item) {
        if (names_.size() < kMostNames) names_.emplace(value.item);
      } else if (time) {
        add(*item, *time, value.text);
      } else {
        // The agent would give it the time at which it comes: nobody knows when it was read.
        diagnostics_.error(file_, {line_, 1},
                           "'" + read->time + "' is no time, and the line gives a position");
        return;
      }
    }
  }

  // A date, or milliseconds of a clock of its own; what stands behind @ says how long a value lasted.
  std::optional<double> time_of(std::string_view text) const {
    text = trimmed(text.substr(0, text.find('@')));
    if (const auto utc_s = seconds_of_date(text)) return utc_s;
    const ParsedNumber number = parse_number(text);
    constexpr double kPerMs = 1e-3;
    return number ? std::optional(number.value * kPerMs) : std::nullopt;
  }

  // With or without the device in front (`mill:Xact`).
  std::optional<std::size_t> item_of(std::string_view key) const {
    const std::string_view bare = key.substr(key.find(':') + 1);
    for (std::size_t i = 0; i < how_.items.size(); ++i) {
      if (how_.items[i].key == key || how_.items[i].key == bare) return i;
    }
    return std::nullopt;
  }

  void add(std::size_t item, double time_s, std::string_view text) {
    double value = kNaN;
    if (text != "UNAVAILABLE") {
      const ParsedNumber number = parse_number(text);
      if (!number) {
        diagnostics_.error(
            file_, {line_, 1},
            "'" + std::string(text) + "' is no number, for the item '" + how_.items[item].key + "'");
        return;
      }
      value = number.value;
    }
    Course& course = courses_[item];
    if (!course.empty() && time_s < course.back().time_s) {
      diagnostics_.error(file_, {line_, 1},
                         "the time of '" + how_.items[item].key + "' goes back, by " +
                             shortest_text(course.back().time_s - time_s) + " s");
      return;
    }
    if (!course.empty() && time_s == course.back().time_s)
      course.back().value = value;
    else
      course.push_back({time_s, value});
  }

  std::string names() const {
    std::string out;
    for (const std::string& name : names_) out += (out.empty() ? "; others that it gives: " : ", ") + name;
    return out;
  }

  const ShdrImport& how_;
  std::string file_;
  Diagnostics& diagnostics_;
  std::vector<Course> courses_;
  std::set<std::string> names_;
  std::uint32_t line_ = 0;
};

// Where an axis is between the values that it sent. Adapters send what has changed: a step that is longer
// than usual is a rest, and a usual step at its end.
class BetweenValues {
 public:
  explicit BetweenValues(const Course& course) : course_(course) {
    std::vector<double> steps;
    for (std::size_t i = 1; i < course.size(); ++i) steps.push_back(course[i].time_s - course[i - 1].time_s);
    if (steps.empty()) return;
    const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    usual_s_ = *middle;
  }

  double usual_s() const { return usual_s_; }
  /// Times must not go back. NaN: not known.
  double at(double time_s) {
    while (next_ < course_.size() && course_[next_].time_s <= time_s) ++next_;
    if (next_ == 0) return kNaN;
    const Observation& last = course_[next_ - 1];
    if (next_ == course_.size() || !std::isfinite(course_[next_].value)) return last.value;
    const Observation& next = course_[next_];
    double from_s = last.time_s;
    if (next.time_s - from_s > kSilent * usual_s_) from_s = next.time_s - usual_s_;
    if (time_s <= from_s) return last.value;
    return last.value + (next.value - last.value) * (time_s - from_s) / (next.time_s - from_s);
  }

 private:
  const Course& course_;
  double usual_s_ = 0.0;
  std::size_t next_ = 0;
};

// The last value at a time: of an item that does not move but change.
double held_at(const Course& course, double time_s) {
  const auto behind = std::upper_bound(course.begin(), course.end(), time_s,
                                       [](double t, const Observation& o) { return t < o.time_s; });
  return behind == course.begin() ? kNaN : std::prev(behind)->value;
}

}  // namespace

Result<Trace> parse_shdr(std::string_view text, const std::string& file, const Machine& machine,
                         const ShdrImport& how, Diagnostics& diagnostics) {
  const std::size_t errors = diagnostics.error_count();
  Fields fields;
  fields.time = how.items.size();  // behind the items
  for (std::size_t i = 0; i < how.items.size(); ++i) {
    const std::string& column = how.items[i].column;
    if (column.starts_with("time") || !take_column(column, i, machine, fields))
      diagnostics.error(file, {},
                        "nobody knows the column '" + column + "' of the item '" + how.items[i].key +
                            "'; columns are those of the axes, and block");
  }
  if (diagnostics.error_count() > errors || !has_all(fields, machine, file, {}, diagnostics))
    return tl::unexpected(diagnostics.first_error());
  ShdrReader reader(how, file, diagnostics);
  if (!reader.read(text)) return tl::unexpected(diagnostics.first_error());
  std::vector<double> times;
  std::vector<BetweenValues> between;
  for (const Course& course : reader.courses()) between.emplace_back(course);
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    for (const Observation& at : reader.courses()[*fields.axes[id]]) times.push_back(at.time_s);
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  Trace out;
  out.file = file;
  // Not where the axes are sent together.
  constexpr double kTogether = 1.2;
  std::size_t most = 0;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    most = std::max(most, reader.courses()[*fields.axes[id]].size());
    out.apart_s = std::max(out.apart_s, between[*fields.axes[id]].usual_s());
  }
  if (static_cast<double>(times.size()) < kTogether * static_cast<double>(most)) out.apart_s = 0.0;
  out.apart_s = std::round(out.apart_s * 1e6) / 1e6;
  SampleTaker taker(out, machine, fields, diagnostics);
  for (const double time_s : times) {
    taker.take(0, 1.0, [&](std::size_t field) -> std::optional<double> {
      if (field == how.items.size()) return time_s - times.front();
      if (fields.block == field) return held_at(reader.courses()[field], time_s);
      return between[field].at(time_s);
    });
  }
  return judged(std::move(out), errors, diagnostics);
}

}  // namespace trunnion::trace
