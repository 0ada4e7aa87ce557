#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/diagnosis/bookkeeping.hpp"
#include "trunnion/diagnosis/fit.hpp"
#include "trunnion/diagnosis/formula.hpp"
#include "trunnion/diagnosis/plan.hpp"

namespace trunnion::diagnosis {

enum class Verdict : std::uint8_t {
  nothing_to_find,
  named,
  named_but_incomplete,
  ambiguous,
  not_in_library,
  not_testable,
  data_problem,
  bookkeeping  // a convention is the wrong way round in the machine file or the measurements
};
std::string_view text_of(Verdict verdict);

struct DiagnoseOptions {
  double alpha = 0.01;  // chance of any false alarm, over everything tried
  /// At once. Where more are missing than are looked for, one that is none of them stands in for two: with
  /// three a cross-talk did for a squareness and a component (tests: FourEffectsAtOnce).
  std::size_t max_effects = 4;
  std::size_t simulations = 80;  // of the null of the maximum; fewer for large data
  std::uint64_t seed = 1;        // fixed: nobody re-rolls for a nicer answer
  bool plan = true;              // propose the next measurement
  bool conventions = true;       // try what may be the wrong way round in the files
  bool formula = true;           // propose one for what no effect of the library explains
  bool weigh = true;             // readings by their scatter, where it is surely uneven
};

struct Rival {
  std::string effect;
  double rho = 0.0;  // largest cosine between what the two do to the readings, base projected out
};

struct RankedParameter {
  std::string key;  // "X0C_um"
  double value = 0.0;
  std::optional<double> sigma;    // printed unit, as value
  std::vector<double> also = {};  // other whole numbers, or periods, that these readings cannot tell from it
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
  /// Leave-one-run-out, one a quantity; nothing where it was not measured or not computed.
  std::optional<double> heldout_before_um, heldout_after_um, heldout_before_urad, heldout_after_urad;
  std::optional<double> detectable_um;  // RMS at the readings that these data would show with 95 % chance
  std::vector<Rival> rivals;
  bool same_in_all =
      false;  // in each of the sets that the data cannot tell apart, sure, with the same values

  /// A number of periods a turn, or a period, that these readings leave open: the last parameter's `also`.
  bool number_is_open() const { return !parameters.empty() && !parameters.back().also.empty(); }
};

struct Dependence {
  std::string covariate;
  double p_value = 1.0;  // over all covariates tried
};

/// Effects that explain the readings, and of which one run says what is wrong in the others.
struct HeldOutHarm {
  std::string run;                   // that the others predict worse with these effects than without
  std::vector<std::string> effects;  // best first
  double chi2_before = 0.0, chi2_after = 0.0;  // of that run as the others predict it
};

/// What is wrong with rows of the measurement file.
struct BadRows {
  std::vector<std::string> problems;  // rows that cannot be right, file:row first
  bool contradicted = false;          // rows contradict each other, or stand twice
  std::vector<std::string> odd_runs;  // without any one of these runs the others leave only noise
};

struct NextMeasurement {
  std::string why;
  std::vector<PlanRun> runs;
  double minutes = 0.0;
  double wrong_before = 0.5, wrong_after = 0.5;  // chance of a wrong name
};

/// Readings that scatter more than others, as far as the residual tells, and what that hangs on.
struct UnevenScatter {
  std::vector<std::string> depends_on;  // "run", "quantity", "direction" (of n), "distance" (from the
                                        // middle), an axis; largest first
  double largest = 1.0;
  std::vector<double> factor;  // of each reading's `u_random`: 1 of those that scatter least, else larger
};

/// How the readings scatter.
struct ScatterSeen {
  double factor = 1.0;           // true over stated uncertainty (that of `uneven` included)
  double autocorrelation = 0.0;  // along the runs
  std::optional<UnevenScatter> uneven;
};

/// The readings with the uncertainties that an uneven scatter gives them.
Dataset weighed(Dataset data, const UnevenScatter& scatter);

struct Diagnosis {
  Verdict verdict = Verdict::nothing_to_find;
  std::vector<std::string> effects;            // best first
  std::vector<std::vector<std::string>> sets;  // that the data cannot tell apart, best first
  double confidence = 0.0;
  std::string paragraph;  // for a person
  std::vector<RankedEffect> ranking;
  double rms_um = 0.0, rms_urad = 0.0;                  // one a quantity; NaN where it was not measured
  double noise_floor_um = 0.0, noise_floor_urad = 0.0;  // likewise
  double chi2 = 0.0, dof = 0.0;
  std::vector<Dependence> depends_on;  // of the residual of the model as it was given
  std::vector<Dependence> leftover;    // of the residual after adding `effects`
  /// Effects that together imitate what one unknown function does, or may be a condition that no column
  /// records.
  std::vector<std::string> imitators;
  double explained = 0.0;  // share of the structure that `effects` explain
  ScatterSeen scatter;
  std::size_t outliers = 0;
  bool only_rounding = false;       // what is left is no larger than the step of the readings makes it
  std::optional<HeldOutHarm> harm;  // why what fits is not named
  BadRows rows;
  /// Best first: of the verdict `bookkeeping`; of `ambiguous` where effects do about as well; else empty.
  std::vector<Bookkeeping> bookkeeping;
  std::optional<NextMeasurement> next;
  std::optional<ProposedFormula> formula;  // of what `effects` leave
  std::vector<NullDirection> null_directions;
  Fit base;                            // the model as given, fitted
  std::vector<ModelEffect> additions;  // `effects` with their fitted parameters

  /// Some effect's number of periods a turn, or its period, is open, of those that are said to be missing.
  bool number_is_open() const;
  /// Why it is `named_but_incomplete`: beside the effects, the rest is noise.
  bool only_number_is_open() const {
    return verdict == Verdict::named_but_incomplete && leftover.empty() && number_is_open();
  }
};

/// What is to be done next, in words: the next measurement, or what to check where none helps.
std::string what_next(const Diagnosis& diagnosis);

/// Which effect is missing in `model`, or that none is, or that these data cannot tell (README of this
/// layer). Deterministic. `extra`: effects that compete beside the library's (formulas of the user).
Diagnosis diagnose(const Machine& machine, const Dataset& data, const Model& model,
                   const DiagnoseOptions& options = {}, const std::vector<EffectFamily>& extra = {});

}  // namespace trunnion::diagnosis
