#pragma once
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/result.hpp"

namespace trunnion::effects {

/// A muParser expression over named variables. muParser objects may not be shared between threads, so each
/// evaluation borrows one from a pool that grows to the number of threads.
class Expression {
 public:
  /// Fails (wrong_input) on a syntax error or a name that is not in `names`. Throws Failure (io_failed) where
  /// muParser cannot be loaded or has no memory: that is no error of the text.
  static Result<std::shared_ptr<const Expression>> compile(const std::string& text,
                                                           const std::vector<std::string>& names);
  ~Expression();
  /// `values` in the order of `names`.
  double operator()(std::span<const double> values) const;
  /// True when the text uses this variable.
  bool uses(std::size_t name) const { return used_[name]; }

 private:
  struct Instance;
  Expression() = default;
  std::unique_ptr<Instance> make_instance() const;
  const struct FormulaLibrary* library_ = nullptr;
  std::string text_;
  std::vector<std::string> names_;
  std::vector<bool> used_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Instance>> idle_;
};

/// Names of the variables in an expression, in alphabetical order; functions and the constants _pi and _e are
/// left out. (muParser's own list parses the text once for each name.)
std::vector<std::string> names_in(const std::string& text);

/// Signs that muParser takes and no formula means: an assignment (`k = 5`), a comma outside a function (`0,5
/// * k` is 5 k), characters that are not printable ASCII. Fails with wrong_input, naming the character.
Result<void> check_signs(const std::string& formula);

/// `lag(x, tau)` calls taken out of a formula: `text` has lag_0_, lag_1_ ... in their places.
struct LagCall {
  std::string variable;
  std::string tau;  // an expression of parameters and numbers
};
struct SplitFormula {
  std::string text;
  std::vector<LagCall> lags;
};
Result<SplitFormula> take_out_lags(const std::string& formula);
inline constexpr std::string_view kLagPrefix = "lag_";
inline std::string lag_name(std::size_t index) {
  return std::string(kLagPrefix) + std::to_string(index) + "_";
}

}  // namespace trunnion::effects
