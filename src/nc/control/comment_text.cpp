#include "nc/control/comment_text.hpp"

#include <algorithm>
#include <string_view>

#include "nc/reading/lexer.hpp"

namespace trunnion::nc {
namespace {

bool continues_character(char ch) {
  constexpr unsigned kMask = 0xc0;
  constexpr unsigned kContinues = 0x80;
  return (static_cast<unsigned char>(ch) & kMask) == kContinues;
}

// What stands for a character that the control's list does not hold.
char instead_of(char ch) {
  switch (ch) {
    case '(':
    case '{':
      return '[';
    case ')':
    case '}':
      return ']';
    case '"':
    case '`':
      return '\'';
    case ';':
      return ',';
    default:
      return static_cast<unsigned char>(ch) > ' ' ? '?' : ' ';
  }
}

// One character for each of UTF-8; bytes that are none count one each.
std::string listed_characters(const Controller::Comments& rules, const std::string& text) {
  const auto listed = [&](char ch) { return rules.characters.find(ch) != std::string::npos; };
  std::string out;
  bool in_character = false;
  for (char ch : text) {
    const bool ascii = static_cast<unsigned char>(ch) < 0x80;
    const bool goes_on = in_character && continues_character(ch);
    in_character = !ascii;
    if (goes_on) continue;
    if (rules.upper_case) ch = upper(ch);
    if (!listed(ch)) ch = instead_of(ch);
    out += listed(ch) ? ch : ' ';
  }
  return out;
}

// In capital letters: controls read such words in small ones, too. `i` stands behind it.
std::string first_word(std::string_view line, std::size_t& i) {
  std::string word;
  while (i < line.size() && line[i] == ' ') ++i;
  for (; i < line.size() && is_of_name(line[i]); ++i) word += upper(line[i]);
  return word;
}

}  // namespace

bool acts(const Controller::Comments& rules, std::string_view line) {
  std::size_t behind = 0;
  const std::string word = first_word(line, behind);
  return std::find(rules.active_words.begin(), rules.active_words.end(), word) != rules.active_words.end();
}

bool may_act(const Controller::Comments& rules, std::string_view line) {
  std::size_t i = 0;
  const std::string word = first_word(line, i);
  while (i < line.size() && line[i] == ' ') ++i;
  if (i < line.size() && line[i] == ',') return true;
  return std::any_of(rules.active_words.begin(), rules.active_words.end(),
                     [&](const std::string& active) { return word.starts_with(active); });
}

std::vector<std::string> comment_lines(const Controller::Comments& rules, const std::string& text,
                                       bool foreign) {
  const std::string all = listed_characters(rules, text);
  std::string_view rest = all;
  std::vector<std::string> out;
  do {
    rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
    const bool marked = foreign || !out.empty() || may_act(rules, rest);
    std::string line = marked ? rules.mark : "";
    const std::size_t room = rules.max_length - line.size();
    std::size_t n = rest.size();
    if (n > room) {
      const auto blank = rest.rfind(' ', room);
      n = blank == std::string_view::npos || blank == 0 ? room : blank;
    }
    line += rest.substr(0, n);
    rest.remove_prefix(n);
    line.resize(line.find_last_not_of(' ') + 1);
    out.push_back(std::move(line));
  } while (rest.find_first_not_of(' ') != std::string_view::npos);
  return out;
}

}  // namespace trunnion::nc
