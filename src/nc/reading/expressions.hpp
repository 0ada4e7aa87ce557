#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace trunnion::nc {

/// Variables of a program and what it calculates with them: #1, #<name>, [#1+2*SIN[30]], angles in degrees.
class Expressions {
 public:
  /// `full`: all functions and operators of LinuxCNC; else those that all controls calculate alike.
  explicit Expressions(bool full) : full_(full) { scopes_.emplace_back(); }

  /// A number, a variable, brackets or a function at `p`, which then stands behind it. False, with `error`.
  bool value(const char*& p, const char* end, double& out);
  /// `#1=...`, and nothing else, from `p` on; in LinuxCNC's words several of them, each with the values
  /// before the line. False, with `error`.
  bool assign(const char* p, const char* end);
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

  bool full_;
  int depth_ = 0;
  std::vector<Scope> scopes_;  // the first one is of all
};

/// As a program has it: nine decimals at most, no exponent.
std::string number_text(double value, bool with_point);

}  // namespace trunnion::nc
