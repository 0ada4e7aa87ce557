#include "trunnion/probe/touch_log.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

namespace trunnion::probe {
namespace {

constexpr double kLargest = 1e9;  // mm, degrees
constexpr std::string_view kBlank = " \t\r=,;";

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> out;
  while (true) {
    const auto begin = text.find_first_not_of(kBlank);
    if (begin == std::string_view::npos) return out;
    text.remove_prefix(begin);
    const auto end = std::min(text.find_first_of(kBlank), text.size());
    out.emplace_back(text.substr(0, end));
    text.remove_prefix(end);
  }
}

// "X12.3Y4" becomes X, 12.3, Y, 4.
std::vector<std::string> pieces_of(std::string_view text) {
  std::string spaced;
  for (const char ch : text) {
    const bool letter = nc::axis_letter(std::string(1, ch)).has_value();
    if (letter) spaced += ' ';
    spaced += ch;
    if (letter) spaced += ' ';
  }
  return words_of(spaced);
}

double internal(nc::AxisLetter letter, double value) {
  return nc::is_rotary(letter) ? value * kRadPerDegree : value;
}

// Why it is no line of a log; empty where it is one.
std::string read_line(std::string_view text, LogLine& out) {
  const auto words = pieces_of(text);
  if (words.empty()) return "has no number";
  const bool lettered = nc::axis_letter(words.front()).has_value();
  if (!lettered && words.size() > nc::kAxisLetters)
    return "has " + std::to_string(words.size()) + " numbers, more than there are axes";
  for (std::size_t i = 0; i < words.size(); ++i) {
    nc::AxisLetter axis = nc::kAllAxisLetters[std::min(i, nc::kAxisLetters - 1)];
    if (lettered) {
      const auto letter = nc::axis_letter(words[i]);
      if (!letter) return "has '" + words[i] + "' where the letter of an axis must stand";
      axis = *letter;
      if (++i == words.size()) return std::string("ends behind the letter ") + nc::letter_of(axis);
    }
    const auto number = parse_number(words[i]);
    if (!number) return "has '" + words[i] + "', which is no number";
    if (std::abs(number.value) > kLargest) return "has '" + words[i] + "', which is beyond any axis";
    auto& at = out.at[nc::index(axis)];
    if (at) return std::string("has two numbers for ") + nc::letter_of(axis);
    at = internal(axis, number.value);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (!out.at[i]) return "has no X, Y and Z";
  }
  return {};
}

bool same_axes(const LogLine& a, const LogLine& b) {
  for (std::size_t i = 0; i < a.at.size(); ++i) {
    if (a.at[i].has_value() != b.at[i].has_value()) return false;
  }
  return true;
}

}  // namespace

TouchLog parse_touch_log(std::string_view text) {
  TouchLog out;
  const bool ends = text.empty() || text.back() == '\n';
  std::uint32_t number = 0;
  while (!text.empty()) {
    const auto end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    const bool last = end == std::string_view::npos;
    text.remove_prefix(last ? text.size() : end + 1);
    ++number;
    if (line.find_first_not_of(" \t\r%") == std::string_view::npos) continue;
    LogLine one;
    one.line = number;
    one.text = std::string(line);
    std::string why = line.size() > 400 ? "is longer than any line of a log" : read_line(line, one);
    if (why.empty() && !out.lines.empty() && !same_axes(one, out.lines.front()))
      why = "has other axes than the first line";
    if (why.empty() && last && !ends) why = "has no end: the file is cut";
    if (!why.empty()) {
      out.broken = std::move(one);
      out.broken_because = std::move(why);
      return out;
    }
    out.lines.push_back(std::move(one));
  }
  return out;
}

}  // namespace trunnion::probe
