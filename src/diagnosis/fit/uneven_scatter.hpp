#pragma once
#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/fit/fit_core.hpp"

namespace trunnion::diagnosis {

/// Whether readings scatter unevenly about what a fit and a smooth surrogate for all else leave: ln of
/// the variance as a sum of levels (of runs, of quantities) and of polynomials of degree 2 (of positions, of
/// the distance from the middle), by maximum likelihood (Harvey 1976), taken up one after the other while
/// they are sure. Nothing where that is not sure, where it makes little, or where what scatters more is alike
/// in neighbours: that is an error that is missing, and no scatter.
/// @param fit  with every reading: those of a run that scatters more are no outliers
std::optional<UnevenScatter> uneven_scatter(const Observations& observations, const FitCore& fit,
                                            const MatrixXd& surrogate);

}  // namespace trunnion::diagnosis
