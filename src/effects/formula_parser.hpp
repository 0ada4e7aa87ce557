#pragma once
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "trunnion/base/result.hpp"

namespace trunnion::effects {

/// A muParser expression over named variables. muParser objects may not be shared between threads, so each
/// evaluation borrows one from a pool that grows to the number of threads.
class Expression {
 public:
  /// Fails (wrong_input) on a syntax error or a name that is not in `names`; as FormulaLibrary::load.
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

/// Names in an expression, in the order of their first use, functions left out.
Result<std::vector<std::string>> names_in(const std::string& text);

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
inline std::string lag_name(std::size_t index) {
  return "lag_" + std::to_string(index) + "_";
}

}  // namespace trunnion::effects
