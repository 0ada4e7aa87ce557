#include "nc/reading/unfolder.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "nc/reading/lexer.hpp"

namespace trunnion::nc {
namespace {

constexpr std::size_t kDeepestCalls = 32;        // calls within calls, loops within loops
constexpr std::uint64_t kMostLines = 1'000'000;  // that are run
constexpr std::int64_t kMostTimes = 100'000;
constexpr std::int64_t kLastNumber = 99'999;  // of blocks

bool reads(const char*& p, const char* end, std::string_view word) {
  const char* s = p;
  for (const char letter : word) {
    if (letter == ' ') {
      s = skip_blanks(s, end);
      continue;
    }
    if (s == end || upper(*s) != letter) return false;
    ++s;
  }
  p = s;
  return true;
}

// Without comments, block number and blanks at both ends.
std::string bare(std::string_view text, const Controller& c) {
  std::string out;
  const std::string& open = c.comments.open;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (!open.empty() && text.substr(i).starts_with(open)) {
      const auto close = c.comments.close.empty() ? std::string_view::npos : text.find(c.comments.close, i);
      if (close == std::string_view::npos) break;
      i = close + c.comments.close.size() - 1;
      continue;
    }
    // In a formula it is an operator.
    const bool may_be_remark =
        c.input.flow.formula.empty() || out.find_first_not_of(" \t0123456789") == std::string::npos;
    if (may_be_remark &&
        std::any_of(c.comments.also_read.begin(), c.comments.also_read.end(),
                    [&](const std::string& mark) { return text.substr(i).starts_with(mark); }))
      break;
    out += text[i];
  }
  const char* p = skip_blanks(out.data(), out.data() + out.size());
  const char* const end = out.data() + out.size();
  if (const char* s = p; reads(s, end, c.block_numbers.prefix)) {
    s = skip_blanks(s, end);
    const char* const digits = s;
    while (s != end && is_digit(*s)) ++s;
    if (s != digits) p = skip_blanks(s, end);
  }
  std::string result(p, end);
  while (!result.empty() && is_blank(result.back())) result.pop_back();
  // `Q200=+2 ;SET-UP CLEARANCE ~` goes on with the next line.
  const auto last = text.find_last_not_of(" \t\r");
  if (!c.input.flow.formula.empty() && last != std::string_view::npos && text[last] == '~' &&
      !result.ends_with('~'))
    result += " ~";
  return result;
}

// The whole number behind `word`; what follows it stands at `p` afterwards.
bool reads_whole(const char*& p, const char* end, std::string_view word, std::int64_t& out) {
  const char* s = skip_blanks(p, end);
  if (!reads(s, end, word)) return false;
  s = skip_blanks(s, end);
  Number number;
  if (s == end || !is_digit(*s) || !scan_number(s, end, number) || number.has_point) return false;
  out = number.mantissa;
  p = s;
  return true;
}

}  // namespace

Unfolder::Unfolder(const Controller& controller, Sink sink, Fault fault)
    : c_(controller), sink_(std::move(sink)), fault_(std::move(fault)), values_(controller) {}

bool Unfolder::fail(const std::string& message) {
  if (!std::exchange(over_, true)) fault_(line_, message);
  return true;
}

// What stands behind the end is no part of the program.
void Unfolder::put(std::string_view text, std::uint32_t line) {
  if (!sink_(text, line)) over_ = true;
}

void Unfolder::feed(std::string_view text) {
  while (!text.empty()) {
    const void* const newline = std::memchr(text.data(), '\n', text.size());
    if (newline == nullptr) {
      carry_ += text;
      return;
    }
    const auto n = static_cast<std::size_t>(static_cast<const char*>(newline) - text.data());
    if (carry_.empty()) {
      take_line(text.substr(0, n));
    } else {
      carry_ += text.substr(0, n);
      take_line(std::exchange(carry_, {}));
    }
    text.remove_prefix(n + 1);
  }
}

void Unfolder::finish() {
  if (!carry_.empty()) take_line(std::exchange(carry_, {}));
}

void Unfolder::take_line(std::string_view text) {
  if (over_) return;
  if (first_kept_ != 0) return kept_.emplace_back(text), void();
  ++line_;
  if (!folds(text)) {
    if (!c_.input.flow.call_line.empty()) note_number(text);
    return run(text, line_);
  }
  first_kept_ = line_;
  kept_.emplace_back(text);
}

void Unfolder::note_number(std::string_view text) {
  const char* p = skip_blanks(text.data(), text.data() + text.size());
  std::int64_t number = 0;
  if (!reads_whole(p, text.data() + text.size(), "N", number) || number > kLastNumber) return;
  if (numbers_.empty()) numbers_.resize(static_cast<std::size_t>(kLastNumber) + 1);
  numbers_[static_cast<std::size_t>(number)] = true;
}

// A line from which on the order of the lines may be another one.
bool Unfolder::folds(std::string_view text) const {
  const auto& in = c_.input.flow;
  if (!in.o_words && in.call.empty() && in.label.empty()) return false;
  // Nearly every line has none of these letters.
  if ((!in.o_words || text.find_first_of("Oo") == std::string_view::npos) &&
      (in.call.empty() || text.find_first_of("Mm") == std::string_view::npos) &&
      (in.label.empty() || text.find_first_of("Bb") == std::string_view::npos))
    return false;
  const std::string line = bare(text, c_);
  const char* p = line.data();
  const char* const end = p + line.size();
  OWord word;
  if (in.o_words && parse_o_word(line, word)) return true;
  std::int64_t number = 0;
  for (const std::string* name : {&in.call, &in.call_line}) {
    if (name->empty()) continue;
    for (const char* s = p; s != end; ++s) {
      const char* t = s;
      if (reads(t, end, *name) && (t == end || !is_digit(*t))) return true;
    }
  }
  if (in.label.empty()) return false;
  const char* s = p;
  return reads_whole(s, end, in.label, number) || reads(p, end, in.call_label);
}

// The text, or the program of which the subprogram is one, is at its end.
bool Unfolder::is_behind_all(std::string_view text) const {
  const bool is_program = !c_.input.flow.o_words && !c_.input.flow.call.empty() && text.size() > 1 &&
                          upper(text[0]) == 'O' && is_digit(text[1]);
  return is_program || text == "%";
}

bool Unfolder::step() {
  if (over_) return false;
  const bool at_end = next_ >= kept_.size();
  // What stands behind it is not run by the control, which stops with an alarm.
  if (!frames_.empty() && (at_end || is_behind_all(bare(kept_[next_], c_)))) {
    line_ = first_kept_ + static_cast<std::uint32_t>(frames_.back().back - 1);
    fail("the subprogram does not come back: its end is missing");
  }
  if (over_ || at_end) return false;
  line_ = first_kept_ + static_cast<std::uint32_t>(next_);
  if (++ran_ > kMostLines) {
    fail("the program runs more than " + std::to_string(kMostLines) + " lines: is there a loop without end?");
    return false;
  }
  const std::string text = bare(kept_[next_], c_);
  if (run_flow(text)) return !over_;
  ++next_;
  run(kept_[next_ - 1], line_);
  return !over_;
}

void Unfolder::run(std::string_view text, std::uint32_t line) {
  if (!values_.may_hold(text)) return put(text, line);
  std::string out;
  switch (values_.take(bare(text, c_), out)) {
    case ValueWords::Line::as_it_is:
      return put(text, line);
    case ValueWords::Line::with_values:
      return put(out, line);
    case ValueWords::Line::taken:
      return;
    case ValueWords::Line::wrong:
      fail(values_.expressions.error);
  }
}

bool Unfolder::run_flow(const std::string& text) {
  return (c_.input.flow.o_words && run_o_word(text)) || (!c_.input.flow.label.empty() && run_labels(text)) ||
         (!c_.input.flow.call.empty() && run_call(text));
}

bool Unfolder::call(std::size_t to, std::int64_t times, bool has_variables) {
  if (frames_.size() >= kDeepestCalls) {
    fail("subprograms call each other more than " + std::to_string(kDeepestCalls) + " deep");
  } else if (times > kMostTimes || times < 0) {
    fail("a subprogram " + std::to_string(times) + " times: more than " + std::to_string(kMostTimes) +
         " are not read");
  } else if (times == 0) {
    ++next_;
  } else {
    frames_.push_back({next_ + 1, to, times - 1, has_variables, loops_.size()});
    next_ = to;
  }
  return true;
}

void Unfolder::leave() {
  Frame& frame = frames_.back();
  loops_.resize(frame.loops);
  if (frame.more-- > 0) {
    next_ = frame.begin;
    return;
  }
  next_ = frame.back;
  if (frame.has_variables) values_.expressions.leave();
  frames_.pop_back();
}

// M98 P1000 L3, M97 P100 L2, M99.
bool Unfolder::run_call(const std::string& text) {
  const auto& in = c_.input.flow;
  const char* p = text.data();
  const char* const end = p + text.size();
  for (const std::string* name : {&in.call, &in.call_line, &in.end_call}) {
    if (name->empty()) continue;
    const char* s = p;
    if (!reads(s, end, *name) || (s != end && is_digit(*s))) {
      for (s = p; s != end; ++s) {
        const char* t = s;
        if (!reads(t, end, *name) || (t != end && is_digit(*t))) continue;
        return fail("'" + *name + "' beside other words: it is read in a line of its own");
      }
      continue;
    }
    if (name == &in.end_call) {
      if (skip_blanks(s, end) != end) {
        fail("'" + *name + "' with other words is not read: where the control goes on is not followed");
      } else if (frames_.empty()) {
        fail("'" + *name + "' outside of a subprogram: the control would begin again");
      } else {
        leave();
      }
      return true;
    }
    std::int64_t number = 0, times = 1;
    if (!reads_whole(s, end, "P", number)) return fail("'" + *name + "' without P and a number");
    reads_whole(s, end, "L", times);
    if (skip_blanks(s, end) != end)
      return fail("'" + *name + "' is read with P and L, and nothing else in its line");
    if (name == &in.call && number > in.largest_program)
      return fail("'P" + std::to_string(number) + "': a number of a program has up to " +
                  std::to_string(in.largest_program) + " here; how often it is called is said by L");
    if (times == 0) return fail("'L0': how often controls run a subprogram then differs");
    const std::size_t to = find_program(number, name == &in.call ? 'O' : 'N');
    if (to == kept_.size())
      return fail(
          std::string("no ") + (name == &in.call ? "O" : "N") + std::to_string(number) +
          " behind this line, or more than one: put the subprogram into this file, behind the program");
    return call(to, times, false);
  }
  return false;
}

// Two of the same number are refused where they are called.
std::size_t Unfolder::find_program(std::int64_t number, char letter) const {
  std::size_t found = kept_.size();
  // The control looks for it from the beginning on.
  if (letter == 'N' && static_cast<std::size_t>(number) < numbers_.size() &&
      numbers_[static_cast<std::size_t>(number)])
    return found;
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    const std::string& text = kept_[i];
    const char* p = skip_blanks(text.data(), text.data() + text.size());
    std::int64_t value = 0;
    if (!reads_whole(p, text.data() + text.size(), std::string(1, letter), value) || value != number)
      continue;
    if (found != kept_.size()) return kept_.size();
    found = i;
  }
  // An O number stands for itself, words may stand behind an N number.
  return found == kept_.size() || letter == 'N' ? found : found + 1;
}

std::size_t Unfolder::find_label(const std::string& name) const {
  std::size_t found = kept_.size();
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    const std::string text = bare(kept_[i], c_);
    const char* p = text.data();
    std::int64_t value = 0;
    if (!reads_whole(p, text.data() + text.size(), c_.input.flow.label, value) ||
        std::to_string(value) != name)
      continue;
    if (found != kept_.size()) return kept_.size();
    found = i;
  }
  return found == kept_.size() ? found : found + 1;
}

// LBL 1 .. LBL 0, CALL LBL 1, CALL LBL 1 REP 3.
bool Unfolder::run_labels(const std::string& text) {
  const auto& in = c_.input.flow;
  const char* p = text.data();
  const char* const end = p + text.size();
  std::int64_t number = 0;
  if (const char* s = p; reads_whole(s, end, in.label, number) && skip_blanks(s, end) == end) {
    if (number == 0 && !frames_.empty())
      leave();
    else
      ++next_;
    return true;
  }
  const char* s = p;
  if (!reads(s, end, in.call_label)) return false;
  std::int64_t times = 0;
  if (!reads_whole(s, end, "", number) || number == 0)
    return fail("'" + in.call_label + "' is read with a number above 0");
  const char* const behind_number = s;
  const bool repeats = reads_whole(s, end, in.repeats, times);
  if (skip_blanks(s, end) != end && skip_blanks(behind_number, end) != end)
    return fail("'" + in.call_label + "' is read with a number and '" + in.repeats +
                "', and nothing else in its line");
  const std::size_t to = find_label(std::to_string(number));
  if (to == kept_.size())
    return fail("no '" + in.label + " " + std::to_string(number) + "', or more than one");
  if (!repeats) return call(to, 1, false);
  // The part between the label and here again.
  const std::string label = std::to_string(line_);
  if (to > next_) return fail("the part of the program to repeat comes after this line");
  if (loops_.empty() || loops_.back().label != label) {
    if (times > kMostTimes || loops_.size() >= kDeepestCalls)
      return fail("a part of the program " + std::to_string(times) +
                  " times, or too many parts in each other");
    loops_.push_back({to, label, times});
  }
  if (loops_.back().more-- > 0) {
    next_ = to;
  } else {
    loops_.pop_back();
    ++next_;
  }
  return true;
}

// o100 sub, o<name> call [1] [2]
bool Unfolder::parse_o_word(const std::string& text, OWord& out) const {
  const char* p = text.data();
  const char* const end = p + text.size();
  if (p == end || upper(*p) != 'O') return false;
  p = skip_blanks(p + 1, end);
  const char* const begin = p;
  if (p != end && *p == '<') {
    while (p != end && *p != '>') ++p;
    if (p == end) return false;
    ++p;
  } else {
    while (p != end && is_digit(*p)) ++p;
  }
  if (p == begin) return false;
  out.label.clear();
  for (const char* s = begin; s != p; ++s)
    if (!is_blank(*s)) out.label += upper(*s);
  if (is_digit(out.label.front()))
    out.label.erase(0, std::min(out.label.find_first_not_of('0'), out.label.size() - 1));
  p = skip_blanks(p, end);
  out.keyword.clear();
  while (p != end && is_letter(*p)) out.keyword += upper(*p++);
  out.rest = p;
  return !out.keyword.empty();
}

std::size_t Unfolder::behind(const std::string& label, const std::vector<std::string>& keywords,
                             std::size_t from) const {
  for (std::size_t i = from; i < kept_.size(); ++i) {
    OWord word;
    const std::string line = bare(kept_[i], c_);
    if (!parse_o_word(line, word)) {
      // `o-1 else`: the control reads the numbers of all O words that it passes by.
      if (!line.empty() && upper(line.front()) == 'O') break;
      continue;
    }
    if (word.label == label && std::find(keywords.begin(), keywords.end(), word.keyword) != keywords.end())
      return i;
  }
  return kept_.size();
}

bool Unfolder::is_open(const std::string& label) const {
  return loops_.size() > (frames_.empty() ? 0 : frames_.back().loops) && loops_.back().label == label;
}

// ELSE and ELSEIF are met behind a part that ran.
bool Unfolder::run_if(const OWord& word, const std::string& name) {
  static const std::vector<std::string> kParts = {"ELSEIF", "ELSE", "ENDIF"};
  std::size_t at = next_;
  const bool behind_part = word.keyword != "IF";
  if (behind_part) {
    if (!is_open(word.label)) return fail("'" + name + "' without its begin");
    loops_.pop_back();
    if (word.keyword == "ENDIF") {
      ++next_;
      return true;
    }
  } else if (loops_.size() >= kDeepestCalls) {
    return fail("loops and parts in each other more than " + std::to_string(kDeepestCalls) + " deep");
  }
  while (true) {
    const std::string line = bare(kept_[at], c_);
    OWord here;
    parse_o_word(line, here);
    if (here.keyword == "ENDIF") {
      next_ = at + 1;
      return true;
    }
    bool runs = !behind_part && here.keyword == "ELSE";
    if (!behind_part && !runs) {
      double value = 0.0;
      const char* p = skip_blanks(here.rest, line.data() + line.size());
      const char* const end = line.data() + line.size();
      values_.expressions.error.clear();
      if (p == end || *p != '[' || !values_.expressions.value(p, end, value) || skip_blanks(p, end) != end)
        return fail(values_.expressions.error.empty()
                        ? "'" + name + "' is read with a value in brackets, and nothing else"
                        : values_.expressions.error);
      runs = value != 0.0;
    }
    if (runs) {
      loops_.push_back({0, word.label, 0});
      next_ = at + 1;
      return true;
    }
    at = behind(word.label, behind_part ? std::vector<std::string>{"ENDIF"} : kParts, at + 1);
    if (at == kept_.size())
      return fail("'" + name + "' without its end, or with a line before it that is no O word");
  }
}

bool Unfolder::run_o_word(const std::string& text) {
  OWord word;
  if (!parse_o_word(text, word)) return false;
  const std::string name = "O" + word.label + " " + word.keyword;
  const char* p = word.rest;
  const char* const end = text.data() + text.size();
  values_.expressions.error.clear();
  const auto condition = [&](double& out) {
    p = skip_blanks(p, end);
    if (p != end && *p == '[' && values_.expressions.value(p, end, out) && skip_blanks(p, end) == end)
      return true;
    fail(values_.expressions.error.empty()
             ? "'" + name + "' is read with a value in brackets, and nothing else"
             : values_.expressions.error);
    return false;
  };
  const auto find = [&](const std::vector<std::string>& keywords, std::size_t& out) {
    out = behind(word.label, keywords, next_ + 1);
    if (out < kept_.size()) return true;
    fail("'" + name + "' without its end, or with a line before it that is no O word");
    return false;
  };
  const auto loop_here = [&] { return is_open(word.label); };
  const std::string& key = word.keyword;
  std::size_t to = 0;
  double value = 0.0;
  if (key == "SUB") {
    if (find({"ENDSUB"}, to)) next_ = to + 1;
  } else if (key == "ENDSUB" || key == "RETURN") {
    if (skip_blanks(p, end) != end)
      fail("'" + name + "' with a value is not read");
    else if (frames_.empty())
      fail("'" + name + "' outside of a subprogram");
    else
      leave();
  } else if (key == "CALL") {
    std::vector<double> arguments;
    while ((p = skip_blanks(p, end)) != end) {
      double argument = 0.0;
      if (*p != '[' || !values_.expressions.value(p, end, argument))
        return fail(values_.expressions.error.empty() ? "'" + name + "' is read with values in brackets"
                                                      : values_.expressions.error);
      arguments.push_back(argument);
    }
    to = behind(word.label, {"SUB"}, 0);
    if (to == kept_.size() || behind(word.label, {"SUB"}, to + 1) != kept_.size())
      return fail(
          "no 'O" + word.label +
          " SUB' in this text, or more than one: put the subprogram into the file, before the program");
    if (frames_.size() < kDeepestCalls) values_.expressions.enter(arguments);
    return call(to + 1, 1, true);
  } else if (key == "REPEAT") {
    if (!condition(value) || !find({"ENDREPEAT"}, to)) return true;
    // Halves: what the control makes of them is not asked.
    if (value != std::floor(value) || value > static_cast<double>(kMostTimes) ||
        loops_.size() >= kDeepestCalls)
      fail("'" + name + "' of " + number_text(value, false) + " times is not read");
    else if (value < 1.0)
      next_ = to + 1;
    else
      loops_.push_back({++next_, word.label, static_cast<std::int64_t>(value) - 1});
  } else if (key == "ENDREPEAT") {
    if (!loop_here())
      fail("'" + name + "' without its begin");
    else if (loops_.back().more-- > 0)
      next_ = loops_.back().begin;
    else
      loops_.pop_back(), ++next_;
  } else if (key == "WHILE") {
    if (!condition(value) || !find({"ENDWHILE"}, to)) return true;
    if (value == 0.0) {
      if (loop_here()) loops_.pop_back();
      next_ = to + 1;
    } else {
      if (loops_.size() >= kDeepestCalls)
        return fail("loops in each other more than " + std::to_string(kDeepestCalls) + " deep");
      if (!loop_here()) loops_.push_back({next_, word.label, 0});
      ++next_;
    }
  } else if (key == "ENDWHILE") {
    if (!loop_here())
      fail("'" + name + "' without its begin");
    else
      next_ = loops_.back().begin;
  } else if (key == "IF" || key == "ELSEIF" || key == "ELSE" || key == "ENDIF") {
    return run_if(word, name);
  } else {
    return fail("'" + name + "' is not read");
  }
  return true;
}

}  // namespace trunnion::nc
