#pragma once
#include <array>
#include <map>
#include <string>
#include <vector>

#include "trunnion/effects/library.hpp"

namespace trunnion::effects {

/// A `user:` effect as the model file writes it.
struct FormulaSpec {
  std::string id;          // "user:coolant_lift"
  std::string joint;       // axis name, "S" (spindle) or "P" (part)
  std::string component;   // "EZZ" or "EZ": the second letter is the direction
  std::string expression;  // muParser; variables and lag() as in README of this layer
  std::string what;        // optional sentence of its author
  struct Key {
    std::string key;     // "k_um"
    double value = 0.0;  // internal unit; where a search starts
    std::optional<std::array<double, 2>> range;
  };
  std::vector<Key> parameters;
};

/// An effect from a formula. Parameters in which the result is linear (jointly) are found by evaluation and
/// become linear ones, the others shape parameters. Sensors that `context` lacks are appended to it. Fails
/// with wrong_input: syntax, unknown names, unknown joint or component, a parameter that the formula does not
/// use.
Result<std::shared_ptr<const Effect>> make_formula_effect(const FormulaSpec& spec, const Machine& machine,
                                                          EffectContext& context);

}  // namespace trunnion::effects
