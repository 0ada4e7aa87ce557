#include "post/making/post_words.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {
namespace {

using Fields = std::vector<std::string>;

std::optional<double> number_in(const Fields& fields, std::size_t i) {
  if (i >= fields.size()) return std::nullopt;
  const auto number = parse_number(fields[i]);
  return number ? std::optional(number.value) : std::nullopt;
}

bool has(const Fields& fields, std::string_view word) {
  return std::find(fields.begin(), fields.end(), word) != fields.end();
}

// "AAXIS" and such.
bool names_axis(const std::string& word) {
  return word.size() == 5 && word.compare(1, 4, "AXIS") == 0;
}

std::optional<AxisId> axis_of_word(const Machine& machine, const std::string& word) {
  return names_axis(word) ? machine.axis(word.substr(0, 1)) : std::nullopt;
}

// The number of a rotary axis counts from the bed. Nothing where the machine has no such axis.
std::optional<AxisId> rotary_axis(const Machine& machine, const Fields& fields) {
  const auto rotary = machine.rotary_axes();
  if (rotary.empty()) return std::nullopt;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (names_axis(fields[i])) {
      const auto id = axis_of_word(machine, fields[i]);
      return id && machine.axes[*id].kind == AxisKind::rotary ? id : std::nullopt;
    }
    if (fields[i] != "AXIS") continue;
    const auto number = number_in(fields, i + 1);
    if (number && *number >= 1.0 && *number <= static_cast<double>(rotary.size()))
      return rotary[static_cast<std::size_t>(*number) - 1];
    return std::nullopt;
  }
  return rotary.back();  // TABLE, or nothing said: the one that carries the part
}

}  // namespace

bool take_limits(const cl::PostWord& word, const Machine& given, Machine& machine, std::string& cut) {
  const Fields& f = word.fields;
  if (f.size() == 1 && f[0] == "OFF") {
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      machine.axes[id].min = given.axes[id].min;
      machine.axes[id].max = given.axes[id].max;
    }
    return true;
  }
  if (f.empty() || f.size() % 3 != 0) return false;
  Machine limited = machine;
  for (std::size_t i = 0; i < f.size(); i += 3) {
    const auto id = axis_of_word(machine, f[i]);
    const auto min = number_in(f, i + 1);
    const auto max = number_in(f, i + 2);
    if (!id || !min || !max || !(*min < *max)) return false;
    const Axis& own = given.axes[*id];
    const double factor = own.kind == AxisKind::rotary ? kRadPerDegree : 1.0;
    if (*min * factor < own.min || *max * factor > own.max) cut = own.name;
    limited.axes[*id].min = std::max(own.min, *min * factor);
    limited.axes[*id].max = std::min(own.max, *max * factor);
  }
  machine = limited;
  return true;
}

std::optional<double> rotary_limit_rad_s(const cl::PostWord& word) {
  const auto limit = number_in(word.fields, 0);
  if (!limit || word.fields.size() != 1 || !(*limit > 0.0)) return std::nullopt;
  return *limit * kRadPerDegree / kSecondsPerMinute;
}

std::optional<ClearPlane> clear_plane_of(const cl::PostWord& word) {
  const Fields& f = word.fields;
  const auto a = number_in(f, 0);
  const auto b = number_in(f, 1);
  const auto c = number_in(f, 2);
  const auto d = number_in(f, 3);
  if (f.size() != 4 || !a || !b || !c || !d) return std::nullopt;
  const Vec3 normal(*a, *b, *c);
  if (!(normal.norm() > 1e-6)) return std::nullopt;
  return ClearPlane{normal.normalized(), *d / normal.norm()};
}

std::optional<Measure> measure_of(const cl::PostWord& word, const Machine& machine) {
  const Fields& f = word.fields;
  if (word.word != "ROTABL" || f.size() < 2 || f[0] != "SHORT") return std::nullopt;
  if (f.size() == 2 && f[1] == "COMBIN") return Measure{path::ChoiceMethod::combined, ""};
  if (f.size() == 2 && f[1] == "LARGE") return Measure{path::ChoiceMethod::largest, ""};
  if (f.size() == 2 && f[1] == "PLUS") return Measure{path::ChoiceMethod::sum, ""};
  if (f.size() != 3 || f[1] != "AXIS") return std::nullopt;
  const auto id = rotary_axis(machine, f);
  if (!id) return std::nullopt;
  return Measure{path::ChoiceMethod::axis, machine.axes[*id].name};
}

// Behind ATANGL, else the only number that does not say which axis: AXIS,2,ATANGL,90  90,TABLE
// AAXIS,ABSOL,90.
std::optional<double> angle_in(const Fields& f) {
  const auto at = std::find(f.begin(), f.end(), "ATANGL");
  if (at != f.end()) return number_in(f, static_cast<std::size_t>(at - f.begin()) + 1);
  std::optional<double> found;
  for (std::size_t i = 0; i < f.size(); ++i) {
    const auto number = i > 0 && f[i - 1] == "AXIS" ? std::nullopt : number_in(f, i);
    if (number && found) return std::nullopt;
    if (number) found = number;
  }
  return found;
}

std::optional<TableTurn> table_turn_of(const cl::PostWord& word, const Machine& machine,
                                       const JointVector& from) {
  const Fields& f = word.fields;
  if ((word.word != "ROTABL" && word.word != "ROTATE") || has(f, "SHORT")) return std::nullopt;
  const auto id = rotary_axis(machine, f);
  const auto degrees = angle_in(f);
  const auto known = [](const std::string& text) {
    constexpr std::array<std::string_view, 11> kWords = {"AXIS", "ATANGL", "ABSOL", "CLW",   "CCLW", "INCR",
                                                         "NOW",  "NEXT",   "SAME",  "TABLE", ""};
    return parse_number(text) || names_axis(text) ||
           std::find(kWords.begin(), kWords.end(), text) != kWords.end();
  };
  if (!id || !degrees || !std::all_of(f.begin(), f.end(), known)) return std::nullopt;
  const double now = from[*id];
  double angle = *degrees * kRadPerDegree;
  if (has(f, "INCR")) {
    angle += now;
  } else if (!machine.axes[*id].has_limits() || has(f, "CLW") || has(f, "CCLW")) {
    angle = now + std::remainder(angle - now, kTwoPi);
    if (has(f, "CLW") && angle < now - 1e-12) angle += kTwoPi;
    if (has(f, "CCLW") && angle > now + 1e-12) angle -= kTwoPi;
  }
  return TableTurn{*id, angle, !has(f, "NEXT")};
}

bool may_turn_table(const cl::PostWord& word) {
  constexpr std::array kMeasures = {"SHORT", "LARGE", "PLUS", "COMBIN"};
  const bool may = word.word == "ROTABL" || word.word == "ROTATE" || word.word == kStands;
  return may && std::none_of(kMeasures.begin(), kMeasures.end(),
                             [&](const char* measure) { return has(word.fields, measure); });
}

bool stands_at(const cl::PostWord& word, const Machine& machine, JointVector& q) {
  if (word.word != kStands) return false;
  for (std::size_t i = 0; i + 1 < word.fields.size(); i += 2) {
    const auto id = machine.axis(word.fields[i]);
    const ParsedNumber angle_deg = parse_number(word.fields[i + 1]);
    if (id && angle_deg) q[*id] = Angle::degrees(angle_deg.value).rad();
  }
  return true;
}

}  // namespace trunnion::post
