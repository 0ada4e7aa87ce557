#pragma once
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/fit/observations.hpp"
#include "diagnosis/verdict/bookkeeping.hpp"
#include "diagnosis/verdict/verdict_text.hpp"

namespace trunnion::diagnosis {

/// What acts. One condition is chosen among those of its kind.
enum class ConditionKind : std::uint8_t {
  moved,     // drifted, grew with the runs, turned over, was displaced
  law,       // an effect of the library by another law
  gradient,  // by recorded temperatures, as the library does not have it
  scale,     // its one parameter, and 1, is a factor of the readings
  wander     // of the readings: no machine does it
};

/// Something that acts while it is measured, that no column of the files records and no effect of the library
/// describes. An effect found in its place would be compensated, and the machine become worse.
struct UnrecordedCondition {
  ConditionKind kind = ConditionKind::moved;
  std::string what;                                  // "a drift of the tool in every run"
  std::string remedy;                                // one sentence: what to do before it is measured again
  std::string covariate;                             // as in Diagnosis::depends_on; empty: none of its own
  std::optional<std::size_t> only_in;                // a single run that shows it: the others stand
  bool goes_with_time = false;                       // steadily (tau infinite), or up to a time constant tau
  bool steady_is_known = false;                      // the library has the steady one
  bool (*stands_for)(const ModelEffect&) = nullptr;  // what it may be taken for
  /// Derivative of the readings in its parameters, at this time constant (s).
  std::function<MatrixXd(double tau_s)> columns;
  VectorXd largest;  // of each parameter that is still such a condition, in the unit of the columns
};

/// A condition in place of effects that were named.
struct InPlace {
  double ahead = -INFINITY;  // of what was named, in -2 ln
  double chi2 = 0.0, dof = 1.0, gained = 0.0, parameters = 0.0;
  std::shared_ptr<const UnrecordedCondition> condition;
  double tau_s = INFINITY, factor = 1.0;
  std::vector<const ModelEffect*> dropped, kept;

  double per_degree() const { return chi2 / dof; }
};

/// Translations of the tool, of a rotary axis, of the part, that begin with each of some runs.
std::vector<UnrecordedCondition> drifts(const Observations& observations);
/// Linear axes that are longer in one run than in another, or become so in it.
std::vector<UnrecordedCondition> growth_by_run(const Observations& observations);
/// What turns over with the sense of one axis in one run: lost motion of a kind that the library lacks. A
/// step at the moment at which the axis turns round is the same.
std::vector<UnrecordedCondition> reversals(const Observations& observations);
/// The measured point of one tool or ball that is not where its columns say.
std::vector<UnrecordedCondition> displaced_tools(const Observations& observations);
/// A spindle that grows by another power of its speed, or with two time constants.
std::vector<UnrecordedCondition> growth_laws(const Observations& observations);
/// A joint that moves or bends with a temperature, or with the difference of two.
std::vector<UnrecordedCondition> temperature_gradients(const Observations& observations);
/// A run whose readings are larger or smaller than they are, by one factor: what the fitted model says of it.
std::vector<UnrecordedCondition> scaled_runs(const Observations& observations, const Model& fitted);
/// The measured point, a rotary axis or a scale that is another one in a single run.
std::vector<UnrecordedCondition> moved_in_run(const Observations& observations);

/// The named effects that are not of motion: what may come of the order in which readings were taken.
bool may_come_of_order(const ModelEffect& effect);
bool is_step(const ModelEffect& effect);
bool is_thermal(const ModelEffect& effect);
bool is_of_axes(const ModelEffect& effect);

/// Whether such a condition does what named effects do (README of this layer, "Conditions that no column
/// records"). Where the two are hardly told apart the verdict becomes `ambiguous`; where the condition does
/// better `not_in_library`, or, of a single run, what the others show. Where nothing is named and a
/// condition leaves only noise the text says so.
void doubt_beside_unrecorded(const Observations& whole, const Model& model, const std::vector<bool>& left_out,
                             Diagnosis& d);

}  // namespace trunnion::diagnosis
