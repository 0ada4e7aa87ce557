#pragma once
#include <optional>

#include "diagnosis/search/search.hpp"

namespace trunnion::diagnosis {

/// Leave-one-run-out: every run is predicted by the parameters that the others give; its own set-up is
/// fitted.
struct HeldOut {
  double rms_um = 0.0, rms_urad = 0.0;  // over all runs, one a quantity; NaN where it was not measured
};
/// Nothing with fewer than two runs.
std::optional<HeldOut> held_out(const Atoms& atoms, const std::vector<Atom>& set);

/// A run that a set predicts worse than the model without it does.
struct Harm {
  std::size_t run = 0;
  double chi2_before = 0.0, chi2_after = 0.0;  // predictive, in units of the noise variance
  double ratio = 0.0;  // -2 ln of the run's probability with the set over that without
};
/// The worst of the runs that the set, its parameters from the other runs, predicts worse by more than chance
/// allows (README of this layer, "Held out"); nothing when there is none. `variance`: of the noise.
std::optional<Harm> held_out_harm(const Atoms& atoms, const std::vector<Atom>& set, double variance);

}  // namespace trunnion::diagnosis
