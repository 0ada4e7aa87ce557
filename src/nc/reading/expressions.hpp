#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trunnion::nc {

/// How a control writes what it calculates.
struct Arithmetic {
  std::string mark = "#";  // before the number of a variable
  char open = '[', close = ']';
  bool full = false;   // all functions and operators of LinuxCNC; else those that all calculate alike
  bool names = false;  // variables of the program's own names
  bool bare_arguments = false;            // SIN Q1, Q1 DIV Q2
  std::array<std::int64_t, 2> control{};  // numbers of the control's own variables, first and last
};

/// Variables of a program and what it calculates with them: #1, #<name>, [#1+2*SIN[30]], angles in degrees.
class Expressions {
 public:
  explicit Expressions(Arithmetic how) : how_(std::move(how)) { scopes_.emplace_back(); }

  /// A number, a variable, brackets or a function at `p`, which then stands behind it. False, with `error`.
  bool value(const char*& p, const char* end, double& out);
  /// Such values and the operators between them.
  bool calculated(const char*& p, const char* end, double& out);
  /// `#1=...`, and nothing else, from `p` on; in LinuxCNC's words several of them, each with the values
  /// before the line. False, with `error`.
  bool assign(const char* p, const char* end);
  /// A variable with a name of its own, at 0; `whole`: it holds no fractions.
  void define(const std::string& name, bool whole) {
    scopes_.front()[name] = 0.0;
    if (whole) whole_.insert(name);
  }
  /// A variable of the program stands at `p`, which then stands behind its name.
  bool is_variable(const char*& p, const char* end) const;
  static bool is_function(const char* p, const char* end);
  /// Variables of a subprogram: #1 and on are its arguments.
  void enter(const std::vector<double>& arguments);
  void leave() { scopes_.pop_back(); }

  std::string error;

 private:
  using Scope = std::map<std::string, double, std::less<>>;
  bool fail(const std::string& message);
  bool sum(const char*& p, const char* end, int level, double& out);
  bool operator_at(const char*& p, const char* end, int level, std::string& name) const;
  bool apply(const std::string& name, double right, double& left);
  bool function(const char*& p, const char* end, double& out);
  bool name_at(const char*& p, const char* end, std::string& out);
  Scope& scope_of(const std::string& name);
  bool is_of_control(const std::string& name) const;

  Arithmetic how_;
  int depth_ = 0;
  std::vector<Scope> scopes_;      // the first one is of all
  std::vector<std::string> read_;  // variables, since a line began
  std::set<std::string> whole_;
};

/// As a program has it: nine decimals at most, no exponent.
std::string number_text(double value, bool with_point);

}  // namespace trunnion::nc
