#include "cl/scanner.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "cl/plain_number.hpp"

namespace trunnion::cl {

namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 17;  // fits the level 2 cache
constexpr std::size_t kPadding = 16;  // zeros behind the text: the fast path reads words of bytes
constexpr std::size_t kLongestStatement = 1 << 16;

/// Words whose rest of the line is text, with or without a separator.
constexpr std::array<std::string_view, 10> kTextWords = {"PARTNO",   "PPRINT",       "INSERT", "REMARK",
                                                         "TPRINT",   "LETTER",       "TITLES", "HEADER",
                                                         "TOOLPATH", "CSI_TOOL_PATH"};

bool is_blank(char c) {
  return c == ' ' || c == '\t';
}
char upper(char c) {
  return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
}
bool number_character(char c) {
  return (c >= '0' && c <= '9') || c == '.';
}

bool is_word_character(char c) {
  return (c >= '0' && c <= '9') || (upper(c) >= 'A' && upper(c) <= 'Z') || c == '_' || c == '-';
}

std::uint32_t column_of(std::size_t index) {
  return static_cast<std::uint32_t>(index + 1);
}

std::string hexadecimal(unsigned char byte) {
  constexpr std::string_view kHexDigits = "0123456789ABCDEF";
  return std::string("0x") + kHexDigits[byte / 16] + kHexDigits[byte % 16];
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// A cut file: the line behind a `$` is no continuation but the next point.
bool begins_goto(std::string_view line) {
  constexpr std::string_view kGoto = "GOTO";
  std::size_t i = std::min(line.find_first_not_of(" \t"), line.size());
  for (const char c : kGoto) {
    if (i >= line.size() || upper(line[i]) != c) return false;
    ++i;
  }
  while (i < line.size() && is_blank(line[i])) ++i;
  return i < line.size() && line[i] == '/';
}

/// The line begins a statement of its own, behind a `$` that is one too many: no value is a word with a
/// slash, and where no comma says that more comes, none is one of the bare words either.
bool begins_statement(std::string_view line, bool more_comes) {
  std::string word;
  std::size_t i = std::min(line.find_first_not_of(" \t"), line.size());
  for (; i < line.size() && (is_word_character(line[i]) || is_blank(line[i])); ++i)
    if (!is_blank(line[i])) word.push_back(upper(line[i]));
  if (word.empty() || number_character(word.front())) return false;
  if (i < line.size()) return line[i] == '/';
  return !more_comes && std::find(kBareWords.begin(), kBareWords.end(), word) != kBareWords.end();
}

}  // namespace

Scanner::Scanner(std::unique_ptr<TextSource> source, Findings& findings)
    : source_(std::move(source)), findings_(findings) {
  buffer_ = std::make_unique_for_overwrite<char[]>(kBufferBytes + kPadding);
  std::fill_n(buffer_.get(), kPadding, '\0');
}

void Scanner::fatal(SourceRef where, const std::string& message) {
  findings_.error(where, message);
  stopped_ = true;
}

// Moves what is unread to the front and reads on behind it. False when nothing more came.
bool Scanner::refill() {
  if (source_ended_) return false;
  std::memmove(buffer_.get(), buffer_.get() + cursor_, end_ - cursor_);
  end_ -= cursor_;
  cursor_ = 0;
  const std::size_t before = end_;
  while (end_ < kBufferBytes) {
    const auto count = source_->read(buffer_.get() + end_, kBufferBytes - end_);
    if (!count) {
      read_failure_ = count.error();
      fatal({line_, 0}, count.error().message);
      source_ended_ = true;
      break;
    }
    if (*count == 0) {
      source_ended_ = true;
      break;
    }
    end_ += *count;
  }
  std::fill_n(buffer_.get() + end_, kPadding, '\0');
  return end_ > before;
}

bool Scanner::physical_line(std::string_view& line) {
  if (stopped_) return false;
  std::size_t searched = cursor_;
  const char* newline = nullptr;
  for (;;) {
    newline = static_cast<const char*>(std::memchr(buffer_.get() + searched, '\n', end_ - searched));
    if (newline != nullptr) break;
    const std::size_t unread = end_ - cursor_;
    if (unread >= kBufferBytes) {
      fatal({line_ + 1, 0},
            "a line of more than " + std::to_string(kBufferBytes) + " bytes: this is no CL text");
      return false;
    }
    if (!refill()) break;
    searched = cursor_ + unread;
  }
  if (cursor_ == end_ || stopped_) return false;
  const char* begin = buffer_.get() + cursor_;
  const char* stop = newline != nullptr ? newline : buffer_.get() + end_;
  cursor_ = static_cast<std::size_t>(stop - buffer_.get()) + (newline != nullptr ? 1 : 0);
  ++line_;
  line = {begin, static_cast<std::size_t>(stop - begin)};
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  if (!line.empty() && line.back() == '\x1A' && cursor_ == end_ && source_ended_)
    line.remove_suffix(1);  // DOS
  return check_text(line);
}

std::string_view Scanner::last_number() const {
  const std::string_view text(buffer_.get(), end_);
  if (!source_ended_ || text.empty() || text.back() == '\n' || text.back() == '\x1A') return {};
  const std::string_view line = trimmed(text.substr(text.rfind('\n') + 1));
  if (line.empty() || !(begins_goto(line) || number_character(line.front()) || line.front() == '-'))
    return {};
  return line.substr(line.find_last_of("/, \t") + 1);
}

void Scanner::unread_line(std::string_view line) {
  cursor_ = static_cast<std::size_t>(line.data() - buffer_.get());
  --line_;
}

// A CL file is text: any control character but the tab tells that it is something else. DOS ends a text with
// 0x1A.
bool Scanner::check_text(std::string_view line) {
  if (line_ == 1 && (line.starts_with("\xFF\xFE") || line.starts_with("\xFE\xFF"))) {
    fatal({1, 1}, "UTF-16 text: a CL file is ASCII or UTF-8");
    return false;
  }
  for (std::size_t i = 0; i < line.size(); ++i) {
    const auto byte = static_cast<unsigned char>(line[i]);
    if ((byte >= 0x20 || byte == '\t') && byte != 0x7F) continue;
    fatal({line_, column_of(i)}, "byte " + hexadecimal(byte) + " is not text: this is no CL file");
    return false;
  }
  return true;
}

bool Scanner::next(Statement& statement) {
  std::string_view line;
  while (physical_line(line)) {
    std::size_t begin = 0;
    if (line_ == 1 && line.starts_with("\xEF\xBB\xBF")) begin = 3;  // byte order mark of UTF-8
    while (begin < line.size() && is_blank(line[begin])) ++begin;
    if (begin == line.size()) continue;
    statement.fields.clear();
    statement.text = {};
    statement.word = {};
    statement.where = {line_, column_of(begin)};
    if (line.substr(begin).starts_with("$$->")) {
      statement.kind = Statement::Kind::directive;
      if (assemble(line, begin + 4, statement)) return true;
      continue;
    }
    if (line.substr(begin).starts_with("$$")) {
      statement.kind = Statement::Kind::comment;
      statement.text = trimmed(line.substr(begin + 2));
      return true;
    }
    if (text_word(line, begin, statement)) return true;
    statement.kind = Statement::Kind::command;
    if (assemble(line, begin, statement)) return true;
  }
  return false;
}

// Blanks may stand inside the word too (`TOOL PATH`).
bool Scanner::text_word(std::string_view line, std::size_t begin, Statement& statement) {
  for (const std::string_view word : kTextWords) {
    std::size_t i = begin;
    std::size_t matched = 0;
    while (i < line.size() && matched < word.size()) {
      if (upper(line[i]) == word[matched]) {
        ++matched;
      } else if (!is_blank(line[i])) {
        break;
      }
      ++i;
    }
    if (matched < word.size()) continue;
    std::string_view rest = trimmed(line.substr(i));
    if (!rest.empty() && rest.front() == '/') rest = trimmed(rest.substr(1));
    statement.kind = Statement::Kind::text;
    statement.word = word;
    statement.text = rest;
    return true;
  }
  return false;
}

// Takes the part of a physical line that counts into compacted_. True when the statement goes on in the next
// line.
bool Scanner::compact(std::string_view line, std::size_t begin) {
  bool blank = true;  // the end of a line parts two numbers as a blank does
  for (std::size_t i = begin; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '\'') compacted_.in_quotes = !compacted_.in_quotes;
    if (!compacted_.in_quotes && c == '$') return i + 1 >= line.size() || line[i + 1] != '$';
    if (is_blank(c)) {
      blank = true;
      continue;
    }
    compacted_.text.push_back(upper(c));
    compacted_.places.push_back({line_, column_of(i)});
    compacted_.after_blank.push_back(blank ? 1 : 0);
    blank = false;
  }
  return false;
}

bool Scanner::assemble(std::string_view line, std::size_t begin, Statement& statement) {
  compacted_.text.clear();
  compacted_.places.clear();
  compacted_.after_blank.clear();
  compacted_.in_quotes = false;
  bool continued = compact(line, begin);
  while (continued) {
    compacted_.in_quotes = false;
    const SourceRef place{line_, column_of(line.find_last_not_of(" \t"))};
    if (!physical_line(line)) {
      if (!stopped_) findings_.error(place, "the file ends after a continuation ($)");
      return false;
    }
    const bool more_comes = compacted_.text.ends_with(',') || compacted_.text.ends_with('/');
    if (begins_goto(line) || begins_statement(line, more_comes)) {
      unread_line(line);
      if (compacted_.text.ends_with(',')) compacted_.text.pop_back();
      findings_.warning(place, "continued by $, but the next line is a new " +
                                   std::string(begins_goto(line) ? "GOTO" : "statement") +
                                   ": the statement is taken as it stands");
      break;
    }
    const std::size_t first = line.find_first_not_of(" \t");
    if (first != std::string_view::npos && line.substr(first).starts_with("$$"))
      continue;  // a comment in between
    continued = compact(line, 0);
    if (compacted_.text.size() > kLongestStatement) {
      fatal(statement.where, "a statement of more than " + std::to_string(kLongestStatement) + " characters");
      return false;
    }
  }
  if (compacted_.text.empty()) return false;
  split(statement);
  return true;
}

void Scanner::append_field(std::size_t begin, std::size_t end, Statement& statement) {
  Field field;
  field.text = std::string_view(compacted_.text).substr(begin, end - begin);
  // An empty field stands where its comma is, or behind the last character.
  field.where = begin < compacted_.places.size()
                    ? compacted_.places[begin]
                    : SourceRef{compacted_.places.back().line, compacted_.places.back().column + 1};
  for (std::size_t i = begin + 1; i < end; ++i) {
    if (compacted_.after_blank[i] != 0 && number_character(compacted_.text[i]) &&
        number_character(compacted_.text[i - 1])) {
      field.blank_inside_number = true;
      constexpr std::uint32_t kFar = 4;
      const SourceRef &here = compacted_.places[i], &before = compacted_.places[i - 1];
      const bool behind_sign = compacted_.text[i - 1] == '-' || compacted_.text[i - 1] == '+';
      field.digits_far_apart = field.digits_far_apart || (!behind_sign && here.line == before.line &&
                                                          here.column > before.column + kFar);
    }
  }
  statement.fields.push_back(field);
}

void Scanner::split(Statement& statement) {
  const std::string_view all = compacted_.text;
  statement.where = compacted_.places.front();
  std::size_t at = all.find_first_of("/,(=");
  if (at == std::string_view::npos) at = all.size();
  statement.word = all.substr(0, at);
  statement.text = all.substr(at);
  if (at == all.size()) return;
  std::size_t begin = at + 1;
  if (begin == all.size()) return;  // `RAPID/`
  bool quoted = false;
  for (std::size_t i = begin; i < all.size(); ++i) {
    if (all[i] == '\'') quoted = !quoted;
    if (quoted || all[i] != ',') continue;
    append_field(begin, i, statement);
    begin = i + 1;
  }
  append_field(begin, all.size(), statement);
}

bool Scanner::plain_goto(PlainGoto& out) {
  constexpr std::size_t kComfort = 2048;  // longer than any plain GOTO, so that one refill at most is needed
  if (stopped_) return false;
  if (end_ - cursor_ < kComfort) refill();
  const char* const line_start = buffer_.get() + cursor_;
  const char* p = line_start;
  while (is_blank(*p)) ++p;
  std::uint32_t word = 0;
  std::memcpy(&word, p, sizeof(word));
  std::uint32_t goto_word = 0;
  std::memcpy(&goto_word, "goto", sizeof(goto_word));
  if ((word | 0x20202020U) != goto_word) return false;
  out.where = {line_ + 1, column_of(static_cast<std::size_t>(p - line_start))};
  p += sizeof(word);
  while (is_blank(*p)) ++p;
  if (*p != '/') return false;
  ++p;
  std::uint32_t lines = 1;
  int count = 0;
  std::array<unsigned, 6> places{};
  for (;;) {
    while (*p == ' ') ++p;
    if (*p == '\t' || *p == '$') {
      while (is_blank(*p)) ++p;
      if (*p == '$') {
        ++p;
        while (is_blank(*p)) ++p;
        if (*p == '\r') ++p;
        if (*p != '\n') return false;
        ++p;
        ++lines;
        while (is_blank(*p)) ++p;
      }
    }
    p = plain_number(p, out.value[count], places[static_cast<std::size_t>(count)]);
    if (p == nullptr) return false;
    ++count;
    if (*p != ',') {
      while (is_blank(*p)) ++p;
      if (*p != ',') break;
    }
    if (count == 6) break;
    ++p;
  }
  if (*p == '\r') ++p;
  const char* const text_end = buffer_.get() + end_;
  if (p == text_end && source_ended_) {
    // last line without a newline
  } else if (*p == '\n') {
    ++p;
  } else {
    return false;
  }
  if (count != 3 && count != 6) return false;
  out.count = count;
  out.coordinate_decimals = static_cast<std::uint8_t>(std::max({places[0], places[1], places[2]}));
  out.axis_decimals = static_cast<std::uint8_t>(std::max({places[3], places[4], places[5]}));
  goto_cursor_ = cursor_;
  goto_line_ = line_;
  cursor_ = static_cast<std::size_t>(p - buffer_.get());
  line_ += lines;
  if (count == 6 && lines == 1) {
    const auto length = static_cast<std::size_t>(p - line_start);
    if (length == last_length_ && p[-1] == '\n') layout_.learn(line_start, length);
    last_length_ = length;
  }
  return true;
}

std::size_t Scanner::plain_run(std::span<PlainCut> cuts) {
  const std::size_t length = layout_.length();
  if (stopped_ || length == 0) return 0;
  std::size_t count = 0;
  for (; count < cuts.size() && end_ - cursor_ >= GotoLayout::kWidest; ++count) {
    PlainCut& cut = cuts[count];
    std::array<double, 6> value;
    if (!layout_.read(buffer_.get() + cursor_, value.data())) break;
    cut.tip_P = {value[0], value[1], value[2]};
    cut.axis_P = {value[3], value[4], value[5]};
    cut.where = {++line_, layout_.column()};
    cursor_ += length;
  }
  return count;
}

void Scanner::unread_run(std::size_t count) {
  cursor_ -= count * layout_.length();
  line_ -= static_cast<std::uint32_t>(count);
}

void Scanner::unread_goto() {
  cursor_ = goto_cursor_;
  line_ = goto_line_;
}

}  // namespace trunnion::cl
