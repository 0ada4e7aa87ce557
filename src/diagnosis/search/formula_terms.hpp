#pragma once
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/fit/observations.hpp"
#include "diagnosis/search/covariates.hpp"

namespace trunnion::diagnosis {

/// A part of the range of one variable: what is multiplied with it acts there only.
struct TermGate {
  std::size_t variable = 0;            // of FormulaTerms::variables
  std::optional<double> above, below;  // Variable::place_unit; one of them or both
  bool operator==(const TermGate&) const = default;
};

/// A variable of formulas: its name there and how people read it.
struct Variable {
  std::string name;
  Covariate covariate;
  bool rotary = false;
  std::string in_formula;  // of a size about 1
  double unit = 1.0;       // of `in_formula`, in the variable's own
  bool only_gates = false, no_gates = false;
  /// A temperature: it is another one in every run, and a part of its range that holds whole runs is a name
  /// for these, no cause.
  bool labels_runs = false;
  /// "T_frame", "degC", and what people read: place in formulas * factor + zero.
  std::string read_as, read_in;
  double read_factor = 1.0, read_zero = 0.0;

  /// Of an angle places are in degrees, else in the variable's own unit.
  double place_unit() const;
  std::string place_text() const;
  std::string text_of(const TermGate& gate) const;
  /// 1 inside, 0 outside.
  Eigen::VectorXf values_of(const TermGate& gate) const;
};

/// A function of the machine's state as a formula of the model file writes it, with its value at every
/// reading (single precision: there are thousands of them).
struct FormulaTerm {
  std::string text;  // "sin(2*A)"; empty: 1
  Eigen::VectorXf values;
  std::string variable;  // the first it names
  std::vector<TermGate> gates;
  /// Without its gates; nothing where it has none, or where nothing is left but 1.
  std::string ungated_text;
  Eigen::VectorXf ungated;
  /// 2 ln of the number of terms that are as simple or simpler: what it costs to be the one of them. Of a
  /// product of two that were chosen one after the other the sum.
  double price = 0.0;
};

/// Functions of one variable from the first on, simple ones before the others; then products of two simple
/// ones.
struct FormulaTerms {
  std::vector<Variable> variables;
  std::vector<FormulaTerm> terms;
  std::size_t of_one_variable = 0;
};
FormulaTerms formula_terms(const Observations& observations);

/// The same with other gates.
FormulaTerm with_gates(const FormulaTerm& term, const std::vector<TermGate>& gates,
                       const std::vector<Variable>& variables);

/// Of two variables; nothing where one text holds the other.
std::optional<FormulaTerm> product(const FormulaTerm& a, const FormulaTerm& b);
/// A place as a formula writes it.
double as_written(double place);

}  // namespace trunnion::diagnosis
