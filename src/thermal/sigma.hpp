#pragma once
#include <cstddef>
#include <vector>

#include "trunnion/thermal/model.hpp"

namespace trunnion::thermal {

/// One held-out prediction: what it missed by, and what had happened since the last measurement.
struct HeldOut {
  double error_mm = 0.0;
  Causes causes;
  bool made_known = false;  // the measurement is told to the model afterwards
};
using HeldOutRuns = std::vector<std::vector<HeldOut>>;  // [run][row]

/// Sigma of a method by runs that it was not fitted to (the choice of the method among it).
/// The variances are those of the largest normal likelihood, every run counting alike; prior and coverage
/// factor are found on runs that were held out once more.
SigmaModel fit_sigma(const HeldOutRuns& runs);

/// Sigma of each row of each run, fitted and scaled without that run, so that 1.96 of it are to hold 95 %;
/// NaN where the last measurement is held. Needs three runs.
std::vector<std::vector<double>> held_out_sigmas(const HeldOutRuns& runs);
/// Share of each run's errors within 1.96 of these; NaN for a run without errors.
std::vector<double> coverage_of(const HeldOutRuns& runs, const std::vector<std::vector<double>>& sigma_mm);

}  // namespace trunnion::thermal
