#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/diagnosis/fit.hpp"
#include "trunnion/diagnosis/plan.hpp"

namespace trunnion::diagnosis {

enum class Verdict : std::uint8_t {
  nothing_to_find,
  named,
  named_but_incomplete,
  ambiguous,
  not_in_library,
  not_testable,
  data_problem
};
std::string_view text_of(Verdict verdict);

struct DiagnoseOptions {
  double alpha = 0.01;  // chance of any false alarm, over everything tried
  std::size_t max_effects = 3;
  std::size_t simulations = 80;  // of the null of the maximum; fewer for large data
  std::uint64_t seed = 1;        // fixed: nobody re-rolls for a nicer answer
  bool plan = true;              // propose the next measurement
};

struct Rival {
  std::string effect;
  double rho = 0.0;  // largest cosine between what the two do to the readings, base projected out
};

struct RankedParameter {
  std::string key;  // "X0C_um"
  double value = 0.0;
  std::optional<double> sigma;  // printed unit, as value
};

/// One effect of the library, as if it alone were added to the model.
struct RankedEffect {
  std::string id;
  std::vector<std::pair<std::string, std::string>> variant;
  bool excited = false;  // these runs show something of it that the model cannot imitate
  double p_value = 1.0;  // global: over all effects and shapes tried
  double chi2_drop = 0.0;
  double dof = 0.0;
  std::vector<RankedParameter> parameters;
  std::optional<double> heldout_before_um, heldout_after_um;  // leave-one-run-out
  std::optional<double> detectable_um;  // RMS at the readings that these data would show with 95 % chance
  std::vector<Rival> rivals;
};

struct Dependence {
  std::string covariate;
  double p_value = 1.0;  // over all covariates tried
};

struct NextMeasurement {
  std::string why;
  std::vector<PlanRun> runs;
  double minutes = 0.0;
  double wrong_before = 0.5, wrong_after = 0.5;  // chance of a wrong name
};

struct Diagnosis {
  Verdict verdict = Verdict::nothing_to_find;
  std::vector<std::string> effects;            // best first
  std::vector<std::vector<std::string>> sets;  // that the data cannot tell apart, best first
  double confidence = 0.0;
  std::string paragraph;  // for a person
  std::vector<RankedEffect> ranking;
  double rms_um = 0.0, chi2 = 0.0, dof = 0.0, noise_floor_um = 0.0;
  std::vector<Dependence> depends_on;  // of the residual of the model as it was given
  std::vector<Dependence> leftover;    // of the residual after adding `effects`
  std::vector<std::string> imitators;  // effects that together imitate what one unknown function does
  double explained = 0.0;              // share of the structure that `effects` explain
  double autocorrelation = 0.0;        // of the noise, along the runs
  double noise_factor = 1.0;           // true over stated uncertainty, as far as the residual tells
  std::size_t outliers = 0;
  std::optional<NextMeasurement> next;
  std::vector<NullDirection> null_directions;
  Fit base;                            // the model as given, fitted
  std::vector<ModelEffect> additions;  // `effects` with their fitted parameters
};

/// Which effect is missing in `model`, or that none is, or that these data cannot tell (README of this
/// layer). Deterministic. `extra`: effects that compete beside the library's (formulas of the user).
Diagnosis diagnose(const Machine& machine, const Dataset& data, const Model& model,
                   const DiagnoseOptions& options = {}, const std::vector<EffectFamily>& extra = {});

}  // namespace trunnion::diagnosis
