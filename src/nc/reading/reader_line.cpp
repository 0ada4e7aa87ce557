#include "nc/reading/reader_line.hpp"

#include <algorithm>

namespace trunnion::nc {
namespace {

using Type = PatternToken::Type;

std::size_t letter_index(char c) {
  return static_cast<std::size_t>(upper(c) - '@') & 31U;
}

bool starts_with(const char* p, const char* end, const std::string& text) {
  return static_cast<std::size_t>(end - p) >= text.size() && std::string_view(p, text.size()) == text;
}

bool match_letters(const char*& p, const char* end, const std::string& letters) {
  const char* s = p;
  for (const char letter : letters) {
    if (s == end || upper(*s) != letter) return false;
    ++s;
  }
  if (s != end && is_letter(*s)) return false;  // a longer name
  p = s;
  return true;
}

bool match_name(const char*& p, const char* end, std::string& out) {
  const char* s = p;
  while (s != end && (is_of_name(*s) || *s == '-' || *s == '.')) ++s;
  if (s == p) return false;
  out.assign(p, s);
  p = s;
  return true;
}

bool match_token(const char*& p, const char* end, const PatternToken& token, Captures& captures) {
  Number number;
  switch (token.type) {
    case Type::letters:
      return match_letters(p, end, token.text);
    case Type::symbol:
      if (p == end || *p != token.text.front()) return false;
      ++p;
      return true;
    case Type::number:
      return scan_number(p, end, number) && equal(number, token.number);
    case Type::placeholder:
      break;
  }
  if (token.placeholder == Placeholder::name) return match_name(p, end, captures.name);
  if (!scan_number(p, end, number)) return false;
  // A placeholder that stands twice in a line is one value.
  if (captures.has(token.placeholder) && !equal(captures[token.placeholder], number)) return false;
  captures.set(token.placeholder, number);
  return true;
}

std::string quoted(const char* p, const char* end) {
  const char* s = p;
  while (s != end && is_of_name(*s) && s - p < 24) ++s;
  if (s != p) return "'" + std::string(p, s) + "'";
  const auto byte = static_cast<unsigned char>(*p);
  if (byte >= ' ' && byte <= '~') return std::string("'") + *p + "'";
  static constexpr char kHex[] = "0123456789abcdef";
  return std::string("byte 0x") + kHex[byte >> 4U] + kHex[byte & 15U];
}

void refuse(ParsedLine& out, const char* begin, const char* p, std::string message) {
  out.error = std::move(message);
  out.error_column = static_cast<std::uint32_t>(p - begin) + 1;
}

}  // namespace

LineScanner::LineScanner(const Controller& controller, const PatternSet& patterns, bool others)
    : c_(controller),
      patterns_(patterns),
      has_expressions_(!controller.run_time.open.empty()),
      others_(others) {
  for (const auto& pattern : patterns.phrases) {
    const auto& first = pattern.tokens.front();
    active_comments_ =
        active_comments_ || (first.type == Type::symbol && first.text == controller.comments.open);
    if (first.type == Type::letters && first.text.size() == 1)
      letter_begins_phrase_[letter_index(first.text.front())] = true;
  }
}

// A letter and its number; blanks may stand between them.
bool LineScanner::scan_word(const char* begin, const char*& p, const char* end, ParsedLine& out) const {
  const char* s = p + 1;
  if (s != end && is_blank(*s)) s = skip_blanks(s, end);
  if (s == end || !begins_number(*s)) return false;
  if (out.word_count == kMaxWords) {
    refuse(out, begin, p, "more words than any block has");
    return false;
  }
  Word& word = out.words[out.word_count];
  word = {};
  word.letter = upper(*p);
  word.column = static_cast<std::uint32_t>(p - begin) + 1;
  if (!scan_number(s, end, word.number)) {
    refuse(out, begin, p, "no number after " + quoted(p, p + 1));
    return false;
  }
  word.length = static_cast<std::uint32_t>(s - p);
  ++out.word_count;
  p = s;
  return true;
}

// C=DC(90.5)
bool LineScanner::scan_modulo_word(const char* begin, const char*& p, const char* end,
                                   ParsedLine& out) const {
  const auto& rotary = c_.rotary;
  const auto letter = axis_letter(std::string(1, upper(*p)));
  if (!letter || !rotary.has_modulo_word(*letter) || out.word_count == kMaxWords) return false;
  const char* s = p + 1;
  if (!begins_as({s, end}, rotary.modulo_open)) return false;
  s += rotary.modulo_open.size();
  Word word;
  word.letter = upper(*p);
  word.modulo = true;
  word.column = static_cast<std::uint32_t>(p - begin) + 1;
  if (s == end || !scan_number(s, end, word.number) || !begins_as({s, end}, rotary.modulo_close))
    return false;
  s += rotary.modulo_close.size();
  word.length = static_cast<std::uint32_t>(s - p);
  out.words[out.word_count++] = word;
  p = s;
  return true;
}

// X=12.5, X=AC(12.5), I=IC(3)
bool LineScanner::scan_assigned(const char*& p, const char* end, Word& word) const {
  if (c_.input.places.absolute_value.empty() ||
      !(axis_letter(std::string(1, word.letter)) || (word.letter >= 'I' && word.letter <= 'K') ||
        word.letter == 'F'))
    return false;
  const char* s = skip_blanks(p + 1, end);
  if (s == end || *s != '=') return false;
  s = skip_blanks(s + 1, end);
  const char* const value = s;
  if (match_letters(s, end, c_.input.places.absolute_value))
    word.means = Word::Means::place;
  else if (match_letters(s, end, c_.input.places.increment_value))
    word.means = Word::Means::way;
  const bool named = s != value;
  if (named && word.letter == 'F') return false;
  if (named && (s = skip_blanks(s, end), s == end || *s++ != '(')) return false;
  s = skip_blanks(s, end);
  if (s == end || !scan_number(s, end, word.number)) return false;
  if (named && (s = skip_blanks(s, end), s == end || *s++ != ')')) return false;
  // 12.5+R1 is no number.
  const char* const next = skip_blanks(s, end);
  if (next != end && (*next == '+' || *next == '-' || *next == '*' || *next == '/' || *next == '('))
    return false;
  p = s;
  return true;
}

// CR=12.5, IX+3 and values that are assigned.
bool LineScanner::scan_word_of_others(const char* begin, const char*& p, const char* end,
                                      ParsedLine& out) const {
  if (out.word_count == kMaxWords) return false;
  Word word;
  word.letter = upper(*p);
  word.column = static_cast<std::uint32_t>(p - begin) + 1;
  const char* s = p;
  const std::string& prefix = c_.input.places.increment_prefix;
  const std::string& radius = c_.input.places.radius_name;
  const std::string& turns = c_.input.places.more_turns;
  if (!radius.empty() && begins_as({p, end}, radius)) {
    word.letter = 'R';
    word.by_name = true;
    s = skip_blanks(p + radius.size(), end);
    if (s == end || !scan_number(s, end, word.number)) return false;
    if (s != end && !is_blank(*s) && !is_letter(*s)) return false;
  } else if (turns.size() > 1 && begins_as({p, end}, turns)) {
    word.letter = kTurns;
    s = skip_blanks(p + turns.size(), end);
    if (s == end || !is_digit(*s) || !scan_number(s, end, word.number) || word.number.has_point) return false;
  } else if (!prefix.empty() && begins_as({p, end}, prefix) && p + prefix.size() != end &&
             axis_letter(std::string(1, upper(p[prefix.size()])))) {
    word.letter = upper(p[prefix.size()]);
    word.means = Word::Means::way;
    s = p + prefix.size() + 1;
    if (s == end || !scan_number(s, end, word.number)) return false;
  } else if (!scan_assigned(s, end, word)) {
    return false;
  }
  word.length = static_cast<std::uint32_t>(s - p);
  out.words[out.word_count++] = word;
  p = s;
  return true;
}

// +#511*0.5 or -#511
bool LineScanner::scan_term(const char*& p, const char* end, std::array<std::int64_t, 3>& coefficient) const {
  const std::int64_t sign = *p == '-' ? -1 : 1;
  const char* s = p + 1;
  if (!starts_with(s, end, c_.run_time.variable)) return false;
  s += c_.run_time.variable.size();
  Number variable;
  if (s == end || !is_digit(*s) || !scan_number(s, end, variable) || variable.has_point) return false;
  const auto& known = c_.run_time.latched;
  const auto it = std::find(known.begin(), known.end(), variable.mantissa);
  if (it == known.end()) return false;
  std::int64_t value = kPowersOfTen[kCoefficientDecimals];
  if (s != end && *s == '*') {
    Number factor;
    ++s;
    if (s == end || !(is_digit(*s) || *s == '.') || !scan_number(s, end, factor) ||
        !to_quanta(factor, kCoefficientDecimals, value))
      return false;
  }
  coefficient[static_cast<std::size_t>(it - known.begin())] += sign * value;
  p = s;
  return true;
}

// X[12.3-#511*0.5+#512]: a number and terms.
bool LineScanner::scan_expression(const char* begin, const char*& p, const char* end, ParsedLine& out) const {
  const auto& r = c_.run_time;
  const auto axis = static_cast<std::size_t>(upper(*p) - 'X');
  if (r.open.empty() || axis > 2 || !starts_with(p + 1, end, r.open) || out.word_count == kMaxWords)
    return false;
  const char* s = p + 1 + r.open.size();
  Word word;
  word.letter = upper(*p);
  word.column = static_cast<std::uint32_t>(p - begin) + 1;
  if (s == end || !scan_number(s, end, word.number)) return false;
  std::array<std::int64_t, 3> coefficient{};
  while (s != end && (*s == '+' || *s == '-')) {
    if (!scan_term(s, end, coefficient)) return false;
  }
  if (!starts_with(s, end, r.close)) return false;
  s += r.close.size();
  word.length = static_cast<std::uint32_t>(s - p);
  out.words[out.word_count++] = word;
  out.coefficient[axis] = coefficient;
  out.has_values = true;
  p = s;
  return true;
}

const char* LineScanner::skip_block_number(const char* p, const char* end) const {
  p = skip_blanks(p, end);
  const char* s = p;
  for (const char ch : c_.block_numbers.prefix) {
    if (s == end || upper(*s) != upper(ch)) return p;
    ++s;
  }
  s = skip_blanks(s, end);
  if (s == end || !is_digit(*s)) return p;
  while (s != end && is_digit(*s)) ++s;
  return skip_blanks(s, end);
}

bool LineScanner::scan_comment(const char*& p, const char* end, ParsedLine& out) const {
  const auto& comments = c_.comments;
  if (starts_with(p, end, comments.open)) {
    const char* const text = p + comments.open.size();
    const std::string_view rest(text, static_cast<std::size_t>(end - text));
    const auto close = comments.close.empty() ? rest.size() : rest.find(comments.close);
    if (close == std::string_view::npos) return false;
    out.comments.emplace_back(without_blanks(rest.substr(0, close)));
    p = text + close + comments.close.size();
    return true;
  }
  // Behind words it is an operator of a formula.
  if (!c_.input.flow.formula.empty() && (out.word_count > 0 || !out.phrases.empty())) return false;
  for (const auto& mark : comments.also_read) {
    if (!starts_with(p, end, mark)) continue;
    out.comments.emplace_back(
        without_blanks({p + mark.size(), static_cast<std::size_t>(end - p) - mark.size()}));
    p = end;
    return true;
  }
  return false;
}

bool LineScanner::scan_phrase(const char*& p, const char* end, FoundEvent& out) const {
  for (const auto& pattern : patterns_.phrases) {
    const char* s = p;
    out.captures = {};
    bool matches = true;
    for (const auto& token : pattern.tokens) {
      s = skip_blanks(s, end);
      if (!(matches = match_token(s, end, token, out.captures))) break;
    }
    if (!matches) continue;
    out.event = pattern.event;
    out.pattern = &pattern;
    p = s;
    return true;
  }
  return false;
}

void LineScanner::scan(const char* begin, const char* p, const char* end, ParsedLine& out) const {
  out.begin = begin;
  while (p != end) {
    const char c = *p;
    if (is_blank(c)) {
      ++p;
      continue;
    }
    if (others_ && is_letter(c) && scan_word_of_others(begin, p, end, out)) continue;
    if (c >= 'X' && has_expressions_ && scan_expression(begin, p, end, out)) continue;
    if (is_letter(c) && !c_.rotary.modulo_open.empty() && scan_modulo_word(begin, p, end, out)) continue;
    if (is_letter(c) && !letter_begins_phrase_[letter_index(c)] && scan_word(begin, p, end, out)) continue;
    if (!out.error.empty()) return;
    FoundEvent found;
    found.column = static_cast<std::uint32_t>(p - begin) + 1;
    // A comment that the control executes is a phrase of its file.
    if (active_comments_ && starts_with(p, end, c_.comments.open) && scan_phrase(p, end, found)) {
      out.phrases.push_back(std::move(found));
      continue;
    }
    if (scan_comment(p, end, out)) continue;
    if (!scan_phrase(p, end, found)) {
      if (is_letter(c) && scan_word(begin, p, end, out)) continue;
      if (!out.error.empty()) return;
      if (starts_with(p, end, c_.comments.open)) return refuse(out, begin, p, "a comment without its end");
      if (c == '/')
        return refuse(out, begin, p,
                      "block delete '/' is not evaluated: it is unknown whether the control runs this block");
      return refuse(out, begin, p, quoted(p, end) + " is not understood");
    }
    out.phrases.push_back(std::move(found));
  }
}

}  // namespace trunnion::nc
