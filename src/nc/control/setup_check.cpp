#include "nc/control/setup_check.hpp"

#include <algorithm>
#include <string>

#include "nc/control/pattern_tokens.hpp"

namespace trunnion::nc {
namespace {

constexpr std::string_view kLettersOfAxes = "XYZABCUVW";

// X10, Y-3, C.5, X=10; not CYCLE832 or G17. Of a placeholder nothing is known.
bool says_an_axis(std::string_view line) {
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const bool begins = i == 0 || !is_letter(line[i - 1]);
    const std::size_t value = line.find_first_not_of("=+-. ", i + 1);
    if (begins && kLettersOfAxes.find(upper(line[i])) != std::string_view::npos &&
        value != std::string_view::npos && (is_digit(line[value]) || line[i + 1] == '='))
      return true;
  }
  return false;
}

// Why a program must not say this word where nobody asked for it; empty: it may.
std::string reason_against(const std::string& word, const Controller& c) {
  const std::string key = pattern_key(word);
  const auto is = [&](const std::string& other) { return !other.empty() && pattern_key(other) == key; };
  const auto is_one_of = [&](const Template& list) { return std::any_of(list.begin(), list.end(), is); };
  for (const auto& [refused, why] : c.refused)
    if (is(refused)) return why;
  const auto& input = c.input;
  if (is_one_of(input.inch)) return "programs are written in millimetres";
  if (!input.planes.empty() && !is(input.planes.front()) && is_one_of(input.planes))
    return "arcs and cycles are written in the plane of X and Y";
  if (is(input.places.per_revolution)) return "feeds are written per minute or inverse to time";
  if (is(c.incremental.on)) return "coordinates are absolute";
  if (is(input.places.shift) || is(input.places.set_position) || is(input.places.turn) ||
      is_one_of(input.places.frames))
    return "it moves the zero of the program, and nothing here knows by how much";
  if (is_one_of(input.reference) || is(input.machine_position)) return "it moves axes";
  return {};
}

void check_lines(config::Section& s, const char* key, const Template& lines, const Controller& c) {
  if (!s.has(key)) return;
  for (const std::string& line : lines) {
    if (says_an_axis(line))
      s.error(key, std::string("'") + key + "': '" + line +
                       "' has a word of an axis: it would move it, or its zero");
    for (const std::string& word : setup_words(line))
      if (const std::string why = reason_against(word, c); !why.empty())
        s.error(key, std::string("'") + key + "': '" + word + "': " + why);
  }
}

}  // namespace

void check_setup(config::Section& root, const Controller& c) {
  if (auto s = root.find_section("program")) {
    check_lines(*s, "setup", c.program.setup, c);
    for (const std::string& line : c.program.begin)
      if (s->has("begin") && line.ends_with(" INCH"))  // of Klartext
        s->error("begin", "'begin': '" + line + "': programs are written in millimetres");
  }
  if (auto s = root.find_section("spindle")) {
    check_lines(*s, "clockwise", c.spindle_clockwise, c);
    check_lines(*s, "counterclockwise", c.spindle_counterclockwise, c);
    check_lines(*s, "off", c.spindle_off, c);
  }
  if (auto s = root.find_section("coolant")) {
    for (std::size_t i = 0; i < kCoolantNames.size(); ++i) check_lines(*s, kCoolantNames[i], c.coolant[i], c);
  }
}

void warn_of_unknown_setup(const Controller& c, const PatternSet& patterns, Diagnostics& diagnostics) {
  const auto is_silent = [&](const std::string& key) {
    return std::any_of(c.silent.begin(), c.silent.end(),
                       [&](const std::string& word) { return pattern_key(word) == key; });
  };
  const auto is_of_setup_alone = [&](const std::string& key) {
    for (const auto* list : {&patterns.words, &patterns.phrases})
      for (const Pattern& pattern : *list)
        if (pattern.key == key) return pattern.event.kind == EventKind::silent && pattern.origin == kSetup;
    return false;
  };
  std::string unknown;
  for (const std::string& line : c.program.setup)
    for (const std::string& word : setup_words(line)) {
      const std::string key = pattern_key(word);
      if (!is_silent(key) && is_of_setup_alone(key)) unknown += (unknown.empty() ? "'" : ", '") + word + "'";
    }
  if (unknown.empty()) return;
  diagnostics.warning_once(
      "setup", c.file, {},
      kSetup + std::string(" has ") + unknown +
          ", which nothing else in this file knows: a program is verified as if it changed "
          "nothing. List what does so in [read] silent");
}

}  // namespace trunnion::nc
