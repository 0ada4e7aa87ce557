#pragma once
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "trunnion/config/section.hpp"
#include "trunnion/nc/controller.hpp"

#include "nc/control/templates.hpp"

// How the keys of a controller file are read.
namespace trunnion::nc {

using config::Section;

// A file and its bases are read one after the other into the same Controller, the base first: every key
// replaces what the base said, and every message names the file in which the key stands.

inline void read_into(Section& s, const char* key, std::string& out) {
  if (auto v = s.find_text(key)) out = *v;
}
inline void read_into(Section& s, const char* key, bool& out) {
  out = s.flag_or(key, out);
}

template <class Integer>
void read_integer(Section& s, const char* key, Integer& out, std::int64_t min, std::int64_t max) {
  const auto v = s.find_integer(key);
  if (!v) return;
  if (*v < min || *v > max) {
    s.error(key, std::string("'") + key + "' must be from " + std::to_string(min) + " to " +
                     std::to_string(max) + ", not " + std::to_string(*v));
    return;
  }
  out = static_cast<Integer>(*v);
}

template <class Enum>
void read_choice(Section& s, const char* key, const std::vector<std::pair<const char*, Enum>>& choices,
                 Enum& out) {
  std::vector<std::string> all;
  all.reserve(choices.size());
  for (const auto& [name, value] : choices) all.emplace_back(name);
  s.takes(key, all);
  const auto v = s.find_text(key);
  if (!v) return;
  std::string names;
  for (const auto& [name, value] : choices) {
    if (*v == name) {
      out = value;
      return;
    }
    names += std::string(names.empty() ? "" : ", ") + "\"" + name + "\"";
  }
  s.error(key, std::string("'") + key + "' must be one of " + names + ", not \"" + *v + "\"");
}

// A line or an array of lines; `allowed` are the placeholders that the writer can fill in here.
inline void read_template(Section& s, const char* key, const std::set<Placeholder>& allowed, Template& out) {
  const config::Value* value = s.raw(key, config::KeyType::text_or_texts);
  if (value == nullptr) return;
  Template lines;
  if (const auto* text = value->as_string()) {
    if (!text->empty()) lines.push_back(*text);
  } else if (auto texts = s.find_texts(key)) {
    lines = *texts;
  } else {
    return;
  }
  for (const auto& line : lines) {
    std::string fault;
    std::string_view rest = line;
    while (!rest.empty()) {
      const auto piece = next_piece(rest, fault);
      if (piece.placeholder && !allowed.contains(*piece.placeholder)) {
        fault = "{" + std::string(name_of(*piece.placeholder)) + "} has no meaning here";
      }
      if (piece.text.find('\n') != std::string_view::npos) fault = "one line in each string";
    }
    if (line.empty()) fault = "empty line";
    if (!fault.empty()) s.error(key, std::string("'") + key + "': " + fault);
  }
  out = std::move(lines);
}

template <class Read>
void in_section(Section& root, const char* name, const Read& read) {
  if (auto s = root.find_section(name)) {
    read(*s);
    s->finish();
  }
}

/// [clamp.A], [clamp.AC], ...: the axes that the words of each clamp together.
void read_clamps(Section& root, Controller& c);
/// [arcs], [cycles], [probing], [axis_numbers] and [post].
void read_shapes(Section& root, Controller& c);

}  // namespace trunnion::nc
