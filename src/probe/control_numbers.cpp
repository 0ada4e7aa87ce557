#include "trunnion/probe/control_numbers.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <map>
#include <regex>

#include "trunnion/base/number_text.hpp"

namespace trunnion::probe {
namespace {

using Numbers = std::map<std::string, std::string>;

constexpr int kLengthDigits = 4;
constexpr int kDirectionDigits = 9;

void add_vector(Numbers& out, const std::string& name, const Vec3& v, int digits) {
  static constexpr std::array kLetters = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) out[name + kLetters[static_cast<std::size_t>(i)]] = fixed_text(v[i], digits);
}

Eigen::Index along_of(const Vec3& n) {
  Eigen::Index along = 0;
  n.cwiseAbs().maxCoeff(&along);
  return along;
}

void add_axis(Numbers& out, const std::string& name, const Vec3& point, const Vec3& n) {
  add_vector(out, name + ".", point, kLengthDigits);
  add_vector(out, name + ".n", n, kDirectionDigits);
  add_vector(out, name + ".against_", -n, kDirectionDigits);
  out[name + ".left_hand"] = n[along_of(n)] < 0.0 ? "1" : "0";
  out[name + ".axis"] = std::to_string(along_of(n) + 1);
}

Result<std::string> filled(const std::string& line, const Numbers& numbers, const std::string& file) {
  std::string out;
  std::size_t at = 0;
  while (at < line.size()) {
    const auto open = line.find('{', at);
    out += line.substr(at, open == std::string::npos ? open : open - at);
    if (open == std::string::npos) break;
    const auto close = line.find('}', open);
    const std::string name = line.substr(open + 1, close == std::string::npos ? close : close - open - 1);
    const auto number = numbers.find(name);
    if (close == std::string::npos || number == numbers.end())
      return fail(ErrorCode::wrong_input,
                  "[axis_numbers]: unknown placeholder {" + name + "} in '" + line + "'", file);
    out += number->second;
    at = close + 1;
  }
  return out;
}

Result<const std::vector<std::string>*> lines_of(const std::string& letters,
                                                 const nc::Controller& controller) {
  auto lines = controller.axis_numbers.find(letters);
  if (lines == controller.axis_numbers.end()) lines = controller.axis_numbers.find("any");
  if (letters.size() == 2 && lines != controller.axis_numbers.end()) return &lines->second;
  return fail(ErrorCode::wrong_input,
              "[axis_numbers] has no lines for the rotary axes " + letters +
                  ", and none for any: this control's own numbers are not known here",
              controller.file);
}

std::string without_blanks(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (std::isspace(static_cast<unsigned char>(c)) == 0) out += c;
  }
  return out;
}

// A line of [axis_numbers] as a pattern, and the placeholders in its order.
struct LinePattern {
  std::regex pattern;
  std::vector<std::string> names;
};

LinePattern pattern_of(const std::string& line) {
  static const std::regex kSpecial(R"([.^$|()\[\]*+?\\{}])");
  static const std::string kNumber = R"(([-+]?(?:\d+\.?\d*|\.\d+)))";
  LinePattern out;
  const std::string tight = without_blanks(line);
  // A number of its own may stand before a name that begins with $.
  std::string text = tight.starts_with('$') ? "" : "(?:^|[^A-Za-z0-9_$])";
  for (std::size_t at = 0; at < tight.size();) {
    const auto open = std::min(tight.find('{', at), tight.size());
    text += std::regex_replace(tight.substr(at, open - at), kSpecial, R"(\$&)");
    if (open == tight.size()) break;
    const auto close = std::min(tight.find('}', open), tight.size());
    out.names.push_back(tight.substr(open + 1, close - open - 1));
    text += kNumber;
    at = close + 1;
  }
  out.pattern = std::regex(text + "(?![0-9.])", std::regex::icase);
  return out;
}

// A number as the list has it, with its line.
struct Told {
  double value = 0.0;
  std::uint32_t line = 0;
};
using ToldNumbers = std::map<std::string, Told>;

bool is_length(const std::string& name) {
  const auto dot = name.find('.');
  return dot != std::string::npos && name.size() == dot + 2 && name[dot + 1] >= 'x' && name[dot + 1] <= 'z';
}

// What is wrong with a number of a list by what stands behind it; empty: nothing.
std::string not_a_number(const std::string& last, bool length, const std::string& behind,
                         double mm_per_unit) {
  static const std::regex kGoesOn(R"(^(?:[,'][0-9]+|e[-+]?[0-9]+))", std::regex::icase);
  std::smatch more;
  if (std::regex_search(behind, more, kGoesOn))
    return "'" + last + more.str() + "' is no number here: digits, and a point for the decimals";
  static const std::regex kUnit(R"(^(mm|in|inch|inches|")(?![A-Za-z]))", std::regex::icase);
  if (!length || !std::regex_search(behind, more, kUnit)) return {};
  const bool mm = more.str()[0] == 'm' || more.str()[0] == 'M';
  if (mm == (mm_per_unit == 1.0)) return {};
  return "'" + last + more.str() + "', and the numbers are read in " + (mm ? "inches" : "mm");
}

// All of the list's numbers that one of the lines asks for.
Result<ToldNumbers> told_by(const ControlNumbers& numbers, const std::vector<std::string>& lines) {
  std::vector<LinePattern> patterns;
  patterns.reserve(lines.size());
  for (const std::string& line : lines) patterns.push_back(pattern_of(line));
  ToldNumbers out;
  std::uint32_t number = 0;
  for (std::size_t at = 0; at < numbers.text.size();) {
    const auto end = std::min(numbers.text.find('\n', at), numbers.text.size());
    const std::string text = without_blanks(numbers.text.substr(at, end - at));
    ++number;
    at = end + 1;
    for (const LinePattern& p : patterns) {
      std::smatch match;
      if (p.names.empty() || !std::regex_search(text, match, p.pattern)) continue;
      const std::string last = match[p.names.size()].str();
      const bool at_end = match.str().ends_with(last);
      if (const std::string wrong =
              not_a_number(last, is_length(p.names.back()), match.suffix().str(), numbers.mm_per_unit);
          at_end && !wrong.empty())
        return fail(ErrorCode::wrong_input, wrong, numbers.file, {number, 1});
      for (std::size_t i = 0; i < p.names.size(); ++i) {
        const auto value = parse_number(match[i + 1].str());
        if (!value) continue;
        const Told told{value.value * (is_length(p.names[i]) ? numbers.mm_per_unit : 1.0), number};
        const auto [other, is_new] = out.emplace(p.names[i], told);
        if (!is_new && std::abs(other->second.value - told.value) > 1e-6)
          return fail(ErrorCode::wrong_input,
                      "this is " + shortest_text(told.value) + ", and line " +
                          std::to_string(other->second.line) + " says " + shortest_text(other->second.value),
                      numbers.file, {number, 1});
      }
    }
  }
  return out;
}

std::optional<Vec3> vector_of(const ToldNumbers& told, const std::string& name) {
  Vec3 out;
  for (int i = 0; i < 3; ++i) {
    const auto found = told.find(name + "xyz"[i]);
    if (found == told.end()) return std::nullopt;
    out[i] = found->second.value;
  }
  return out;
}

// A point of which the list has some numbers has all of them, unless a line was left out.
void warn_of_lines_left_out(const ToldNumbers& told, const std::vector<std::string>& lines,
                            const std::string& file, Diagnostics& diagnostics) {
  for (const std::string& line : lines) {
    for (const std::string& name : pattern_of(line).names) {
      const std::string point = name.substr(0, name.size() - 1);
      const auto beside = told.lower_bound(point);
      if (!is_length(name) || told.contains(name) || beside == told.end() ||
          !beside->first.starts_with(point) || !is_length(beside->first))
        continue;
      diagnostics.warning(file, {},
                          "no line '" + line.substr(0, line.find('{')) + "...': its other numbers are there");
      break;
    }
  }
}

// From one axis to the other. Where the control's lines never ask for a component it counts as 0: a shift
// along the axis.
std::optional<Vec3> way_of(ToldNumbers told, const std::string& name, const std::vector<std::string>& lines) {
  bool any = false;
  for (const char c : {'x', 'y', 'z'}) {
    const std::string full = name + c;
    any = any || told.contains(full);
    const bool asked = std::any_of(lines.begin(), lines.end(), [&](const std::string& line) {
      return line.find("{" + full + "}") != std::string::npos;
    });
    if (!asked) told.emplace(full, Told{});
  }
  return any ? vector_of(told, name) : std::nullopt;
}

// The first that is told.
std::optional<Vec3> either(const std::optional<Vec3>& a, const std::optional<Vec3>& b) {
  return a ? a : b;
}
std::optional<Vec3> sum(const std::optional<Vec3>& a, const std::optional<Vec3>& b) {
  return a && b ? std::optional<Vec3>(*a + *b) : std::nullopt;
}
std::optional<Vec3> minus(const std::optional<Vec3>& a) {
  return a ? std::optional<Vec3>(-*a) : std::nullopt;
}

// +1: the table turns about + of the machine axis of that letter; nothing where it is not told.
Result<std::optional<double>> sense_of(const ToldNumbers& told, const std::string& axis, char letter,
                                       const std::string& file, Diagnostics& diagnostics) {
  const auto left = told.find(axis + ".left_hand");
  if (left != told.end()) return std::optional<double>(left->second.value == 0.0 ? 1.0 : -1.0);
  const auto n = either(vector_of(told, axis + ".n"), minus(vector_of(told, axis + ".against_")));
  if (!n) return std::optional<double>{};
  const Vec3 along = Vec3::Unit(letter - 'A');
  const double off_deg = angle_between(n->normalized(), n->dot(along) < 0.0 ? Vec3(-along) : along).deg();
  constexpr double kOther_deg = 5.0;  // another axis, not one that is out of square
  constexpr double kSquare_deg = 1e-4;
  const std::string what = std::string("axis ") + letter + " is " + fixed_text(off_deg, 4) +
                           " deg off machine " + "XYZ"[letter - 'A'];
  if (off_deg > kOther_deg)
    return fail(ErrorCode::wrong_input, what + ": write its direction into the machine file", file);
  if (off_deg > kSquare_deg)
    diagnostics.warning(
        file, {}, what + ": the machine file takes it as square; its direction is written there by hand");
  return std::optional<double>(n->dot(along) < 0.0 ? -1.0 : 1.0);
}

}  // namespace

Result<std::vector<std::string>> control_numbers(const Machine& machine, const nc::Controller& controller) {
  const auto axes = machine.rotary_axes();
  std::string letters;
  for (const AxisId id : axes) letters += machine.axes[id].name;
  const auto lines = lines_of(letters, controller);
  if (!lines) return tl::unexpected(lines.error());
  const Axis& outer = machine.axes[axes[0]];
  const Axis& inner = machine.axes[axes[1]];
  // The points of the common perpendicular.
  const Vec3 between = inner.point_mm - outer.point_mm;
  const double c = outer.direction.dot(inner.direction);
  const double a = between.dot(outer.direction);
  const double b = between.dot(inner.direction);
  const double square = 1.0 - c * c;
  const Vec3 p_outer = outer.point_mm + (a - b * c) / square * outer.direction;
  const Vec3 p_inner = inner.point_mm + (a * c - b) / square * inner.direction;
  Numbers numbers;
  add_axis(numbers, "outer", p_outer, outer.direction);
  add_axis(numbers, "inner", p_inner, inner.direction);
  add_vector(numbers, "minus_inner.", -p_inner, kLengthDigits);
  add_vector(numbers, "inner_from_outer.", p_inner - p_outer, kLengthDigits);
  add_vector(numbers, "outer_from_inner.", p_outer - p_inner, kLengthDigits);
  std::vector<std::string> out;
  for (const std::string& line : **lines) {
    if (line.find("{crossing.") != std::string::npos) continue;
    auto text = filled(line, numbers, controller.file);
    if (!text) return tl::unexpected(text.error());
    out.push_back(std::move(*text));
  }
  const auto hold = [&](const char* placeholder) {
    return std::any_of((*lines)->begin(), (*lines)->end(),
                       [&](const std::string& line) { return line.find(placeholder) != std::string::npos; });
  };
  if (hold(".n") || hold(".against_")) return out;
  // One number for the sense of both.
  if (hold("outer.left_hand") && !hold("inner.left_hand") &&
      numbers["outer.left_hand"] != numbers["inner.left_hand"])
    return fail(ErrorCode::wrong_input,
                "this control's numbers take one sense for both rotary axes; here " + outer.name + " and " +
                    inner.name + " turn opposite ways for a positive command",
                machine.file);
  for (const AxisId id : axes) {
    const Vec3& n = machine.axes[id].direction;
    const Eigen::Index along = along_of(n);
    const Vec3 beside = Vec3::Unit(along) * (n[along] < 0.0 ? -1.0 : 1.0);
    const double off_deg = angle_between(n, beside).deg();
    constexpr double kSquare_deg = 1e-4;
    constexpr double kOblique_deg = 5.0;  // no error of a machine that is meant to be square
    const std::string off = "axis " + machine.axes[id].name + " is " + fixed_text(off_deg, 4) +
                            " deg off machine " + std::string(1, "XYZ"[along]);
    if (off_deg > kOblique_deg && controller.axis_numbers.contains(letters))
      return fail(ErrorCode::wrong_input, "this control's numbers are of square axes: " + off, machine.file);
    if (off_deg > kSquare_deg) out.push_back("these numbers do not hold that " + off);
  }
  return out;
}

Result<AxisPlaces> axis_places(const ControlNumbers& numbers, const std::string& letters,
                               const nc::Controller& controller, Diagnostics& diagnostics) {
  const auto lines = lines_of(letters, controller);
  if (!lines) return tl::unexpected(lines.error());
  const auto read = told_by(numbers, **lines);
  if (!read) return tl::unexpected(read.error());
  const ToldNumbers& told = *read;
  if (told.empty()) {
    std::string known;
    for (const std::string& line : **lines)
      known += (known.empty() ? "'" : ", '") + line.substr(0, line.find('{')) + "...'";
    return fail(ErrorCode::wrong_input, "no line is one of these of " + controller.name + ": " + known,
                numbers.file);
  }
  warn_of_lines_left_out(told, **lines, numbers.file, diagnostics);
  const auto crossing = vector_of(told, "crossing.");
  auto outer = either(vector_of(told, "outer."), crossing);
  auto inner = either(vector_of(told, "inner."), either(minus(vector_of(told, "minus_inner.")), crossing));
  if (!inner) inner = sum(outer, way_of(told, "inner_from_outer.", **lines));
  if (!outer) outer = sum(inner, way_of(told, "outer_from_inner.", **lines));
  const auto also = sum(outer, way_of(told, "inner_from_outer.", **lines));
  constexpr double kRounding_mm = 2e-3;
  if (also && inner && (*also - *inner).cwiseAbs().maxCoeff() > kRounding_mm)
    return fail(ErrorCode::wrong_input,
                "two of its numbers contradict each other: axis " + letters.substr(1) + " is " +
                    shortest_text((*also - *inner).norm()) + " mm elsewhere by one than by the other",
                numbers.file);
  AxisPlaces out;
  if (outer) out.points_mm[letters[0]] = *outer;
  if (inner) out.points_mm[letters[1]] = *inner;
  const auto first = sense_of(told, "outer", letters[0], numbers.file, diagnostics);
  if (!first) return tl::unexpected(first.error());
  const auto second = sense_of(told, "inner", letters[1], numbers.file, diagnostics);
  if (!second) return tl::unexpected(second.error());
  if (*first && *second && **first != **second)
    return fail(ErrorCode::wrong_input,
                "axes " + letters + " turn in opposite senses: write the directions into the machine file",
                numbers.file);
  if (*first || *second) out.table_turns_positively = (*first ? **first : **second) > 0.0;
  return out;
}

}  // namespace trunnion::probe
