#include "nc/control/pattern_tokens.hpp"

#include <algorithm>
#include <utility>

namespace trunnion::nc {
namespace {

using Type = PatternToken::Type;

bool is_text(Placeholder p) {
  return p == Placeholder::name;
}

void tokenise(std::string_view text, std::vector<PatternToken>& out) {
  const char* p = text.data();
  const char* const end = p + text.size();
  while (p != end) {
    PatternToken token;
    if (is_blank(*p)) {
      ++p;
      continue;
    }
    if (is_letter(*p)) {
      token.type = Type::letters;
      while (p != end && is_letter(*p)) token.text += upper(*p++);
    } else if (const char* q = p; begins_number(*p) && scan_number(q, end, token.number)) {
      token.type = Type::number;
      p = q;
    } else {
      token.text = *p++;
    }
    out.push_back(std::move(token));
  }
}

}  // namespace

std::vector<PatternToken> tokens_of(std::string_view line) {
  constexpr std::size_t kUsual = 8;
  std::vector<PatternToken> out;
  out.reserve(kUsual);
  std::string fault;
  while (!line.empty()) {
    const auto piece = next_piece(line, fault);
    tokenise(piece.text, out);
    if (!piece.placeholder) continue;
    PatternToken token;
    token.type = Type::placeholder;
    token.placeholder = *piece.placeholder;
    out.push_back(std::move(token));
  }
  return out;
}

// Letter, number, letter, number, ...: a set of address words; anything else is a phrase.
std::vector<PatternWord> words_of(const std::vector<PatternToken>& tokens) {
  std::vector<PatternWord> out;
  if (tokens.size() % 2 != 0) return {};
  for (std::size_t i = 0; i < tokens.size(); i += 2) {
    const auto& letter = tokens[i];
    const auto& value = tokens[i + 1];
    const bool fixed = value.type == Type::number;
    const bool numeric = value.type == Type::placeholder && !is_text(value.placeholder);
    if (letter.type != Type::letters || letter.text.size() != 1 || (!fixed && !numeric)) return {};
    out.push_back({letter.text.front(), fixed, value.number, value.placeholder});
  }
  return out;
}

// One text for equal patterns, whatever blanks and zeros they are written with.
std::string key_of(std::span<const PatternToken> tokens) {
  std::string out;
  for (const auto& t : tokens) {
    if (t.type == Type::number) {
      std::int64_t quanta = 0;
      out += to_quanta(t.number, kMaxDigits / 2, quanta) ? std::to_string(quanta) : "?";
    } else if (t.type == Type::placeholder) {
      out += "{}";
    } else {
      out += t.text;
    }
    out += ' ';
  }
  return out;
}

// An address word among others: G91.
bool holds_word(const std::vector<PatternToken>& tokens, const std::string& word) {
  const auto wanted = tokens_of(word);
  const std::string key = key_of(wanted);
  for (std::size_t i = 0; i + wanted.size() <= tokens.size(); ++i)
    if (key_of({tokens.data() + i, wanted.size()}) == key) return true;
  return false;
}

bool is_symbols_only(const std::vector<PatternToken>& tokens) {
  return std::all_of(tokens.begin(), tokens.end(),
                     [](const PatternToken& t) { return t.type == Type::symbol; });
}

std::vector<Placeholder> placeholders_of(const std::vector<PatternToken>& tokens) {
  std::vector<Placeholder> out;
  for (const auto& t : tokens) {
    if (t.type == Type::placeholder) out.push_back(t.placeholder);
  }
  return out;
}

bool has_placeholder(const std::vector<PatternToken>& tokens) {
  return std::any_of(tokens.begin(), tokens.end(),
                     [](const PatternToken& t) { return t.type == Type::placeholder; });
}

// "G91" and such: letters with the number behind them.
std::vector<std::string> words_in(const std::vector<PatternToken>& tokens) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i + 1 < tokens.size(); ++i) {
    std::int64_t code = 0;
    if (tokens[i].type == Type::letters && tokens[i + 1].type == Type::number &&
        to_quanta(tokens[i + 1].number, 0, code))
      out.push_back(tokens[i].text + std::to_string(code));
  }
  return out;
}

}  // namespace trunnion::nc
