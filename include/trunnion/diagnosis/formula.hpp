#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/diagnosis/measurement.hpp"
#include "trunnion/effects/model.hpp"

namespace trunnion::diagnosis {

/// A part of what one variable went through, in the units that people read; open where there is no value.
struct ActingRange {
  std::string of, unit;  // "C", "deg"; "T_frame", "degC"; "speed of X", "mm/min"
  std::optional<double> from, to;
};

/// A formula of the machine's state that explains what no effect of the library does: what to add until the
/// cause is known. It says how the error goes, not why.
struct ProposedFormula {
  Model alone;        // a model file with it and nothing else: `user:leftover`, fitted
  std::string words;  // "-3.1 um * sin(A) * cos(C) in EY of joint Z"
  std::size_t terms = 0;
  /// Where it acts, all of these together; empty: everywhere, or its terms in different parts.
  std::vector<ActingRange> acts_in;
  double ahead = 0.0;                          // propose_part: of the named effects, in -2 ln
  double chi2_before = 0.0, chi2_after = 0.0;  // of all readings, fitted without and with it
  double dof_before = 0.0, dof_after = 0.0;
  /// Leave-one-run-out, one a quantity; nothing where it was not measured.
  std::optional<double> heldout_before_um, heldout_after_um, heldout_before_urad, heldout_after_urad;

  /// Share of what is wrong that it takes away, by chi-square beyond its degrees of freedom.
  double explained() const;
};

/// The simplest formula of one component of one joint that `data` ask for beside `model`: a sum of at most
/// four terms, each a function of an axis, a sensor or the spindle's speed (powers, harmonics, waves, steps
/// and kinks somewhere in the travel), or a product of two or three of them, by the Bayesian information
/// criterion with a price for the number of terms that were tried. Nothing where no such formula earns its
/// price, or where runs that were held out are predicted worse with it. `left_out`: outliers, one flag a
/// reading (of those that stand for several, where readings are taken together). Deterministic.
std::optional<ProposedFormula> propose_formula(const Machine& machine, const Dataset& data,
                                               const Model& model, const std::vector<bool>& left_out);

/// Effects that were named, and from how many they were chosen.
struct NamedEffects {
  std::vector<ModelEffect> effects;
  double families = 1.0;
};

/// A formula that acts in a part of a range only and does better than the effects `named` would, beside
/// `model`, by the same criterion; nothing where there is none. Else as above.
std::optional<ProposedFormula> propose_part(const Machine& machine, const Dataset& data, const Model& model,
                                            const std::vector<bool>& left_out, const NamedEffects& named);

}  // namespace trunnion::diagnosis
