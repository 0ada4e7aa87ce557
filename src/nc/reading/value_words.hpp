#pragma once
#include <string>
#include <string_view>

#include "trunnion/nc/controller.hpp"

#include "nc/reading/expressions.hpp"

namespace trunnion::nc {

/// Lines of a program that set variables, or whose words have them in place of numbers: X#1, X=R1+5,
/// L X+Q1, DEF REAL _A.
class ValueWords {
 public:
  /// `controller` must outlive the object.
  explicit ValueWords(const Controller& controller);

  enum class Line { as_it_is, with_values, taken, wrong };
  /// False at once for most lines: `take` would find nothing.
  bool may_hold(std::string_view text);
  /// `plain`: the line without comments and block number. What it says with numbers in place of variables is
  /// `out`; why it is wrong stands in `expressions.error`.
  Line take(std::string_view plain, std::string& out);

  Expressions expressions;

 private:
  Line take_marked(std::string_view plain, std::string& out);
  Line take_named(std::string_view plain, std::string& out);
  Line take_numbered(std::string_view plain, std::string& out);
  Line define(const char* p, const char* end);
  bool put_values(std::string_view plain, std::string& out);
  bool put_parameters(std::string_view plain, std::string& out);
  bool begins_value(const char* p, const char* end) const;
  Line wrong(const std::string& why);

  const Controller& c_;
  bool goes_on_ = false;   // the last line ended in ~
  bool in_cycle_ = false;  // it was of a drilling cycle
};

}  // namespace trunnion::nc
