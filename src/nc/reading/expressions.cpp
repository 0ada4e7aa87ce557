#include "nc/reading/expressions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include "trunnion/base/units.hpp"

#include "nc/reading/lexer.hpp"

namespace trunnion::nc {
namespace {

constexpr int kMostBrackets = 40;       // brackets
constexpr double kSame = 1e-4;          // EQ and NE of LinuxCNC's interpreter
constexpr double kLargestValue = 1e7;   // mm, degrees, numbers of anything
constexpr long kLastOfSubprogram = 30;  // #1 to #30 are a subprogram's own

// By level: what binds least stands first.
const std::array<std::vector<std::string>, 5> kOperators = {
    {{"AND", "OR", "XOR"}, {"EQ", "NE", "GT", "GE", "LT", "LE"}, {"+", "-"}, {"*", "/", "MOD"}, {"**"}}};
constexpr int kAddition = 2;
constexpr int kMultiplication = 3;
const std::vector<std::string> kFunctions = {"ABS",  "COS", "SIN", "SQRT", "TAN", "ATAN", "ACOS",
                                             "ASIN", "EXP", "FIX", "FUP",  "LN",  "ROUND"};
constexpr std::size_t kAlike = 5;  // of these
constexpr int kPower = 4;

}  // namespace

std::string number_text(double value, bool with_point) {
  std::array<char, 64> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.9f", value);
  std::string out(buffer.data());
  out.erase(out.find_last_not_of('0') + 1);
  if (!with_point && out.back() == '.') out.pop_back();
  if (out == "-0" || out == "-0.") out.erase(0, 1);
  return out;
}

bool Expressions::fail(const std::string& message) {
  if (error.empty()) error = message;
  return false;
}

Expressions::Scope& Expressions::scope_of(const std::string& name) {
  const bool is_number = is_digit(name.front());
  const bool is_own =
      is_number ? std::strtol(name.c_str(), nullptr, 10) <= kLastOfSubprogram : name.front() != '_';
  return is_own ? scopes_.back() : scopes_.front();
}

void Expressions::enter(const std::vector<double>& arguments) {
  Scope own;
  for (long i = 1; i <= kLastOfSubprogram; ++i) {
    const auto k = static_cast<std::size_t>(i - 1);
    own[std::to_string(i)] = k < arguments.size() ? arguments[k] : 0.0;
  }
  scopes_.push_back(std::move(own));
}

bool Expressions::is_function(const char* p, const char* end) {
  return std::any_of(kFunctions.begin(), kFunctions.end(), [&](const std::string& name) {
    const char* s = p;
    return takes(s, end, name) && (s == end || !is_of_name(*s));
  });
}

bool Expressions::is_variable(const char*& p, const char* end) const {
  const char* s = p;
  if (!takes(s, end, how_.mark)) s = p;
  const bool marked = s != p;
  if (marked && !is_letter(how_.mark.front())) return p = s, true;
  if (marked && s != end && is_digit(*s)) {
    while (s != end && is_digit(*s)) ++s;
    if (s == end || !is_letter(*s)) return p = s, true;
  }
  if (!how_.names || p == end || !is_letter(*p)) return false;
  std::string name;
  for (s = p; s != end && is_of_name(*s); ++s) name += upper(*s);
  if (!scopes_.front().contains(name)) return false;
  p = s;
  return true;
}

bool Expressions::is_of_control(const std::string& name) const {
  if (!is_digit(name.front())) return false;
  const long number = std::strtol(name.c_str(), nullptr, 10);
  return number >= how_.control[0] && number <= how_.control[1];
}

bool Expressions::name_at(const char*& p, const char* end, std::string& out) {
  out.clear();
  p = skip_blanks(p, end);
  const char* const begin = p;
  if (!takes(p, end, how_.mark) || (is_letter(how_.mark.front()) && (p == end || !is_digit(*p)))) {
    for (p = begin; p != end && is_of_name(*p); ++p) out += upper(*p);
    return (how_.names && scopes_.front().contains(out)) || fail("no variable");
  }
  p = skip_blanks(p, end);
  if (p != end && *p == '<' && how_.full) {
    for (++p; p != end && *p != '>'; ++p)
      if (!is_blank(*p)) out += upper(*p);
    if (p == end || out.empty() || is_digit(out.front()))
      return fail("the name of a variable without its end");
    ++p;
    return true;
  }
  while (p != end && is_digit(*p)) out += *p++;
  out.erase(0, std::min(out.find_first_not_of('0'), out.size() - (how_.mark == "#" ? 0 : 1)));
  if (out.empty() || out.size() > 5) return fail("a variable is read by its number, as " + how_.mark + "101");
  return true;
}

bool Expressions::function(const char*& p, const char* end, double& out) {
  const std::size_t known = how_.full ? kFunctions.size() : kAlike;
  std::size_t which = 0;
  while (which < known && !takes(p, end, kFunctions[which])) ++which;
  if (which == known) return fail("no number, variable or function that is read here");
  const std::string& name = kFunctions[which];
  p = skip_blanks(p, end);
  const bool in_brackets = p != end && *p == how_.open;
  if ((!in_brackets && !how_.bare_arguments) || !value(p, end, out))
    return fail("'" + name + "' without brackets");
  const double rad = out * kRadPerDegree;
  if (name == "ABS") out = std::abs(out);
  if (name == "COS") out = std::cos(rad);
  if (name == "SIN") out = std::sin(rad);
  if (name == "TAN") out = std::tan(rad);
  if (name == "SQRT") out = std::sqrt(out);
  if (name == "ACOS") out = std::acos(out) * kDegreePerRad;
  if (name == "ASIN") out = std::asin(out) * kDegreePerRad;
  if (name == "EXP") out = std::exp(out);
  if (name == "LN") out = std::log(out);
  if (name == "FIX") out = std::floor(out);
  if (name == "FUP") out = std::ceil(out);
  if (name == "ROUND") out = std::round(out);
  if (name == "ATAN") {
    double across = 0.0;
    p = skip_blanks(p, end);
    if (p == end || *p != '/') return fail("'ATAN' is read as ATAN[y]/[x]");
    p = skip_blanks(p + 1, end);
    if (p == end || *p != '[' || !value(p, end, across)) return fail("'ATAN' is read as ATAN[y]/[x]");
    out = std::atan2(out, across) * kDegreePerRad;
  }
  return std::isfinite(out) || fail("'" + name + "' of this value has no result");
}

bool Expressions::value(const char*& p, const char* end, double& out) {
  p = skip_blanks(p, end);
  if (p == end) return fail("a value is missing");
  if (*p == '-' || *p == '+') {
    const bool negative = *p++ == '-';
    if (!value(p, end, out)) return false;
    if (negative) out = -out;
    return true;
  }
  if (*p == how_.open) {
    if (++depth_ > kMostBrackets)
      return fail("brackets in more than " + std::to_string(kMostBrackets) + " brackets");
    ++p;
    const bool good = sum(p, end, 0, out);
    --depth_;
    if (!good) return false;
    p = skip_blanks(p, end);
    if (p == end || *p != how_.close)
      return fail("brackets without their end, or an operator that is not read");
    ++p;
    return true;
  }
  if (const char* behind = p; is_variable(behind, end)) {
    std::string name;
    if (!name_at(p, end, name)) return false;
    const std::string said = is_digit(name.front()) || how_.mark == "#" ? how_.mark + name : name;
    if (is_of_control(name))
      return fail("variable " + said + " belongs to the control: its value is not in the program");
    const Scope& scope = scope_of(name);
    const auto it = scope.find(name);
    if (it == scope.end()) return fail("variable " + said + " has no value: the program has not set it");
    out = it->second;
    read_.push_back(name);
    return true;
  }
  if (is_digit(*p) || *p == '.') {
    Number number;
    if (!scan_number(p, end, number)) return fail("a number that cannot be read");
    out = static_cast<double>(number.mantissa) / std::pow(10.0, number.decimals);
    return true;
  }
  return function(p, end, out);
}

bool Expressions::operator_at(const char*& p, const char* end, int level, std::string& name) const {
  p = skip_blanks(p, end);
  const char* s = p;
  // ** is no *.
  if (level<kPower&& static_cast<std::size_t>(end - p)> 1 && p[0] == '*' && p[1] == '*') return false;
  if (how_.bare_arguments && level == kMultiplication && takes(s, end, "DIV")) {
    name = "/";
    p = s;
    return true;
  }
  for (const std::string& text : kOperators[static_cast<std::size_t>(level)]) {
    if (!how_.full && text.size() > 1) continue;
    if (!takes(s, end, text)) continue;
    name = text;
    p = s;
    return true;
  }
  return false;
}

bool Expressions::apply(const std::string& name, double right, double& left) {
  if (name == "+") left += right;
  if (name == "-") left -= right;
  if (name == "*") left *= right;
  if (name == "/" || name == "MOD") {
    if (right == 0.0) return fail("a division by nothing");
    left = name == "/" ? left / right : std::fmod(left, right);
    if (name == "MOD" && left < 0.0) left += std::abs(right);
  }
  if (name == "**") left = std::pow(left, right);
  if (name == "EQ") left = std::abs(left - right) < kSame ? 1.0 : 0.0;
  if (name == "NE") left = std::abs(left - right) >= kSame ? 1.0 : 0.0;
  if (name == "GT") left = left > right ? 1.0 : 0.0;
  if (name == "GE") left = left >= right ? 1.0 : 0.0;
  if (name == "LT") left = left < right ? 1.0 : 0.0;
  if (name == "LE") left = left <= right ? 1.0 : 0.0;
  const bool a = left != 0.0, b = right != 0.0;
  if (name == "AND") left = a && b ? 1.0 : 0.0;
  if (name == "OR") left = a || b ? 1.0 : 0.0;
  if (name == "XOR") left = a != b ? 1.0 : 0.0;
  return (std::isfinite(left) && std::abs(left) < 1e15) || fail("a value beyond all numbers");
}

bool Expressions::sum(const char*& p, const char* end, int level, double& out) {
  if (level > kPower) return value(p, end, out);
  if (!sum(p, end, level + 1, out)) return false;
  std::string name;
  int count = 0;
  while (operator_at(p, end, level, name)) {
    // What two of them mean is not the same on all controls.
    if (++count > 1 && (level < kAddition || level == kPower))
      return fail("two of '" + name + "' behind each other: set brackets");
    double right = 0.0;
    if (!sum(p, end, level + 1, right) || !apply(name, right, out)) return false;
  }
  return true;
}

bool Expressions::calculated(const char*& p, const char* end, double& out) {
  error.clear();
  depth_ = 0;
  return sum(p, end, kAddition, out);
}

bool Expressions::assign(const char* p, const char* end) {
  error.clear();
  depth_ = 0;
  read_.clear();
  const bool several = how_.full || how_.names;
  // LinuxCNC takes all values of a line before it sets the first of its variables.
  std::vector<std::pair<std::string, double>> set;
  do {
    std::string name;
    double result = 0.0;
    if (!name_at(p, end, name)) return false;
    p = skip_blanks(p, end);
    if (p == end || *p++ != '=') return fail("a variable begins the line, and '=' does not follow");
    // #1=#2+3 where brackets need not stand.
    if (how_.full ? !value(p, end, result) : !sum(p, end, kAddition, result)) return false;
    if (is_of_control(name))
      return fail("variable " + how_.mark + name + " is the control's: what setting it does is not known");
    if (std::abs(result) > kLargestValue) return fail("a value beyond 10000000");
    if (whole_.contains(name) && result != std::floor(result))
      return fail("a value with a fraction for '" + name +
                  "', which holds whole numbers: the control rounds it");
    const bool is_used = std::any_of(set.begin(), set.end(), [&](const auto& one) {
      return std::find(read_.begin(), read_.end(), one.first) != read_.end();
    });
    if (is_used && !how_.full) return fail("a variable that is set and used in one line");
    set.emplace_back(std::move(name), result);
    p = skip_blanks(p, end);
  } while (several && p != end && (how_.names || *p == '#'));
  if (p != end) return fail("text after the value of a variable");
  for (const auto& [name, result] : set) scope_of(name)[name] = result;
  return true;
}

}  // namespace trunnion::nc
