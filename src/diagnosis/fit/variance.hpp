#pragma once
#include "trunnion/diagnosis/fit.hpp"

#include "diagnosis/fit/whitening.hpp"

namespace trunnion::diagnosis {

/// Which quantities have readings whose `u_common` is to be estimated.
struct UnknownCommon {
  bool displacement = false, rotation = false;
  bool any() const { return displacement || rotation; }
};
UnknownCommon has_unknown_common(const Observations& observations);

/// Median u_random of a quantity's readings; 0 without any.
double typical_u(const Observations& observations, Quantity quantity);

/// Restricted maximum likelihood of the unknown common standard deviations, one for each quantity (Patterson
/// and Thompson 1971): minimises ln|C| + ln|X' C^-1 X| + r' C^-1 r, X = set-ups and `columns`, over a grid,
/// then by golden section.
EstimatedCommon estimate_common(const Observations& observations, const NoiseModel& noise, bool free_setup,
                                const MatrixXd& columns, const VectorXd& raw_residual);

}  // namespace trunnion::diagnosis
