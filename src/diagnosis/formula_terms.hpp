#pragma once
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/observations.hpp"

namespace trunnion::diagnosis {

/// A function of the machine's state as a formula of the model file writes it, with its value at every
/// reading (single precision: there are thousands of them).
struct FormulaTerm {
  std::string text;  // "sin(2*A)"; empty: 1
  Eigen::VectorXf values;
  std::string variable;  // the first it names
  /// 2 ln of the number of terms that are as simple or simpler: what it costs to be the one of them.
  double price = 0.0;
};

/// Functions of one variable from the first on, simple ones before the others; then products of two simple
/// ones.
struct FormulaTerms {
  std::vector<FormulaTerm> terms;
  std::size_t of_one_variable = 0;
};
FormulaTerms formula_terms(const Observations& observations);

/// Of two variables; nothing where one text holds the other.
std::optional<FormulaTerm> product(const FormulaTerm& a, const FormulaTerm& b);
/// FormulaTerm::price among so many terms.
double price_among(std::size_t terms);

}  // namespace trunnion::diagnosis
