#include "nc/reading/value_words.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "nc/reading/lexer.hpp"

namespace trunnion::nc {
namespace {

bool is_plain_number(const char* p, const char* end) {
  Number number;
  return p != end && scan_number(p, end, number) && p == end;
}

Arithmetic arithmetic_of(const Controller::Input::Flow& flow) {
  Arithmetic out;
  if (!flow.variables.empty()) out.mark = flow.variables;
  out.full = flow.o_words;
  out.names = !flow.define.empty();
  out.bare_arguments = !flow.formula.empty();
  if (is_letter(out.mark.front())) {
    out.open = '(';
    out.close = ')';
  }
  out.control = flow.control_variables;
  return out;
}

// Words that count something have no decimals.
bool counts_things_of(char letter) {
  return std::strchr("GMTHDPLNOS", letter) != nullptr;
}

}  // namespace

ValueWords::ValueWords(const Controller& controller)
    : expressions(arithmetic_of(controller.input.flow)), c_(controller) {}

ValueWords::Line ValueWords::wrong(const std::string& why) {
  expressions.error = why;
  return Line::wrong;
}

bool ValueWords::may_hold(std::string_view text) {
  const auto& flow = c_.input.flow;
  if (flow.variables.empty()) return false;
  if (!flow.define.empty())
    return text.find_first_of("=(") != std::string_view::npos ||
           text.find(flow.define) != std::string_view::npos;
  if (!flow.formula.empty())
    return goes_on_ || in_cycle_ || text.find("CYCL") != std::string_view::npos ||
           text.find_first_of("Qq~") != std::string_view::npos ||
           text.find(flow.formula) != std::string_view::npos;
  return text.find(flow.variables) != std::string_view::npos || text.find('[') != std::string_view::npos;
}

ValueWords::Line ValueWords::take(std::string_view plain, std::string& out) {
  out.clear();
  expressions.error.clear();
  if (!c_.input.flow.define.empty()) return take_named(plain, out);
  if (!c_.input.flow.formula.empty()) return take_numbered(plain, out);
  return take_marked(plain, out);
}

// X#1, X-#1, X[#1+2]: the value in their place.
ValueWords::Line ValueWords::take_marked(std::string_view plain, std::string& out) {
  const std::string& mark = c_.input.flow.variables;
  if (plain.find(mark) == std::string::npos && plain.find('[') == std::string::npos) return Line::as_it_is;
  const char* p = plain.data();
  const char* const end = p + plain.size();
  if (plain.starts_with(mark)) return expressions.assign(p, end) ? Line::taken : Line::wrong;
  while (p != end) {
    const char letter = upper(*p);
    const bool is_word = is_letter(*p);
    out += *p++;
    if (!is_word) {
      if (out.back() == '[' || out.back() == '#')
        return wrong("a variable or brackets where no word is: what they say is not read");
      continue;
    }
    const char* s = skip_blanks(p, end);
    const char* const value = s;
    if (s != end && (*s == '-' || *s == '+')) s = skip_blanks(s + 1, end);
    if (s == end || (*s != '#' && *s != '[')) continue;
    double number = 0.0;
    s = value;
    if (!expressions.value(s, end, number)) return Line::wrong;
    out += number_text(number, !(counts_things_of(letter) && number == std::floor(number)));
    out += ' ';
    p = s;
    // X[#1]+2 is no word.
    s = skip_blanks(p, end);
    if (s != end && std::strchr("+-*/.[", *s) != nullptr)
      return wrong("something behind the value of a word");
  }
  return Line::with_values;
}

// DEF REAL _A, _B=2
ValueWords::Line ValueWords::define(const char* p, const char* end) {
  p = skip_blanks(p, end);
  // Variables of other kinds hold no number, and no word is one.
  const bool real = takes(p, end, "REAL");
  if (!real && !takes(p, end, "INT") && !takes(p, end, "BOOL")) return Line::taken;
  do {
    p = skip_blanks(p, end);
    std::string name;
    for (; p != end && is_of_name(*p); ++p) name += upper(*p);
    const char* const behind = p = skip_blanks(p, end);
    if (name.size() < 2 || is_digit(name.front()) || (behind != end && *behind != ',' && *behind != '='))
      return wrong("'" + c_.input.flow.define + "' is read with names, each with a value or none");
    double value = 0.0;
    if (p != end && *p == '=' && !expressions.calculated(++p, end, value)) return Line::wrong;
    expressions.define(name, !real);
    if (value != 0.0) {
      const std::string line = name + "=" + number_text(value, true);
      if (!expressions.assign(line.data(), line.data() + line.size())) return Line::wrong;
    }
    p = skip_blanks(p, end);
  } while (p != end && *p++ == ',');
  return p == end ? Line::taken : wrong("text after the names of variables");
}

// R1=5 _A=R1+2, X=_A, X=AC(R1), CYCLE81(R1,..)
ValueWords::Line ValueWords::take_named(std::string_view plain, std::string& out) {
  const char* p = plain.data();
  const char* const end = p + plain.size();
  if (const char* s = p; takes(s, end, c_.input.flow.define) && s != end && is_blank(*s))
    return define(s, end);
  if (const char* s = p; expressions.is_variable(s, end)) {
    s = skip_blanks(s, end);
    if (s != end && *s == '=' && (s + 1 == end || s[1] != '='))
      return expressions.assign(p, end) ? Line::taken : Line::wrong;
  }
  if (!put_values(plain, out)) return Line::wrong;
  return out == plain ? Line::as_it_is : Line::with_values;
}

bool ValueWords::begins_value(const char* p, const char* end) const {
  while (p != end && (is_blank(*p) || *p == '+' || *p == '-' || *p == '(')) ++p;
  if (p == end) return false;
  if (is_digit(*p) || *p == '.') return true;
  const char* behind = p;
  return expressions.is_variable(behind, end) || Expressions::is_function(p, end);
}

bool ValueWords::put_values(std::string_view plain, std::string& out) {
  const char* p = plain.data();
  const char* const end = p + plain.size();
  while (p != end) {
    if (*p == '"') {
      do out += *p++;
      while (p != end && *p != '"');
      if (p != end) out += *p++;
      continue;
    }
    const char mark = *p++;
    out += mark;
    if (mark != '=' && mark != '(' && mark != ',') continue;
    const char* s = skip_blanks(p, end);
    if (!begins_value(s, end)) continue;
    const char* const begin = s;
    double value = 0.0;
    if (!expressions.calculated(s, end, value)) return false;
    const char* last = s;
    while (last != begin && is_blank(last[-1])) --last;
    if (is_plain_number(begin, last)) continue;
    p = s;
    // S=R1 is S1000; axes keep their sign of equality.
    const auto n = out.size();
    const bool counts_things =
        mark == '=' && n >= 2 && counts_things_of(upper(out[n - 2])) && (n == 2 || !is_of_name(out[n - 3]));
    if (counts_things) out.pop_back();
    out += number_text(value, !(counts_things && value == std::floor(value)));
    out += ' ';
  }
  return true;
}

// FN 0: Q1 = +5, Q1 = Q2 * 2, L X+Q1
ValueWords::Line ValueWords::take_numbered(std::string_view plain, std::string& out) {
  if (plain.empty()) return Line::as_it_is;
  const char* p = plain.data();
  const char* const end = p + plain.size();
  const char* behind = p;
  const bool sets =
      expressions.is_variable(behind, end) && (behind = skip_blanks(behind, end)) != end && *behind == '=';
  const bool goes_on = goes_on_ || (in_cycle_ && sets);
  const auto& cycles = c_.input.flow.holes.cycles;
  in_cycle_ = (goes_on && in_cycle_) || std::any_of(cycles.begin(), cycles.end(), [&](const auto& cycle) {
                return cycle.is_begun_by(plain);
              });
  goes_on_ = plain.ends_with('~');
  if (const char* s = p; !goes_on && takes(s, end, c_.input.flow.formula)) {
    Number number;
    constexpr std::int64_t kLast = 4;  // 0 to 4: a value, + - * and division
    s = skip_blanks(s, end);
    if (s == end || !scan_number(s, end, number) || (s = skip_blanks(s, end), s == end || *s++ != ':'))
      return wrong("'" + c_.input.flow.formula + "' without its number");
    if (number.has_point || number.mantissa < 0 || number.mantissa > kLast)
      return wrong("'" + c_.input.flow.formula + " " + std::to_string(number.mantissa) + "' is not read");
    return expressions.assign(s, end) ? Line::taken : Line::wrong;
  }
  if (const char* s = p; !goes_on && expressions.is_variable(s, end))
    return expressions.assign(p, end) ? Line::taken : Line::wrong;
  if (!put_parameters(plain, out)) return Line::wrong;
  // What a cycle's line sets the program may use.
  if (goes_on) {
    std::string set = out;
    while (!set.empty() && (set.back() == '~' || is_blank(set.back()))) set.pop_back();
    const char* s = set.data();
    if (expressions.is_variable(s, set.data() + set.size()))
      static_cast<void>(expressions.assign(set.data(), set.data() + set.size()));
    expressions.error.clear();
  }
  return out == plain ? Line::as_it_is : Line::with_values;
}

bool ValueWords::put_parameters(std::string_view plain, std::string& out) {
  const char* p = plain.data();
  const char* const end = p + plain.size();
  while (p != end) {
    const char* behind = p;
    const bool stands_alone = p == plain.data() || !is_digit(p[-1]);
    if (!stands_alone || !expressions.is_variable(behind, end)) {
      out += *p++;
      continue;
    }
    // The name of what is set.
    if (const char* s = skip_blanks(behind, end); s != end && *s == '=') {
      out.append(p, behind);
      p = behind;
      continue;
    }
    double value = 0.0;
    if (!expressions.value(p, end, value)) return false;
    if (!out.empty() && (out.back() == '-' || out.back() == '+')) {
      if (out.back() == '-') value = -value;
      out.pop_back();
    }
    out += (value < 0.0 ? "" : "+") + number_text(value, true);
    if (out.back() == '.') out.pop_back();
    out += ' ';
  }
  return true;
}

}  // namespace trunnion::nc
