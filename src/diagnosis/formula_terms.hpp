#pragma once
#include <string>
#include <vector>

#include "diagnosis/observations.hpp"

namespace trunnion::diagnosis {

/// A function of the machine's state as a formula of the model file writes it, with its value at every
/// reading.
struct FormulaTerm {
  std::string text;  // "sin(2*A)"; empty: 1
  VectorXd values;
  std::string variable;  // the first it names
  /// 2 ln of the number of terms that are as simple or simpler: what it costs to be the one of them.
  double price = 0.0;
};

/// Terms of one variable, and products of the simple ones of two.
struct FormulaTerms {
  std::vector<FormulaTerm> simple;    // factors of products: powers to the second, two harmonics, signs
  std::vector<FormulaTerm> single;    // of one variable: these, and the less simple ones
  std::vector<FormulaTerm> products;  // of two variables
};
FormulaTerms formula_terms(const Observations& observations);

FormulaTerm product(const FormulaTerm& a, const FormulaTerm& b);
/// Sets the price of terms beside which there are `simpler` ones.
void set_price(std::vector<FormulaTerm>& terms, std::size_t simpler);

}  // namespace trunnion::diagnosis
