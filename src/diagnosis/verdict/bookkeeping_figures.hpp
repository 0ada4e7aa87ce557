#pragma once
#include <algorithm>

#include "trunnion/diagnosis/bookkeeping.hpp"

#include "diagnosis/fit/fit_core.hpp"

namespace trunnion::diagnosis {

/// A fit's figures. `deviance` is -2 ln of the likelihood and of a long-tailed prior of the parameters
/// (`sizes` of it); `floor` what noise alone would leave of it.
struct Figures {
  double deviance = 0.0, floor = 0.0, sizes = 0.0, chi2 = 0.0, dof = 0.0;
  double parameters = 0.0;  // that the readings pay: what they hardly see of an effect counts little
  double reduced() const { return chi2 / std::max(dof, 1.0); }
  double of_readings() const { return deviance - sizes; }
};

/// `start`: the model before the fit; `scale`: -2 ln of the density of the readings as they stand over that
/// of those fitted.
Figures figures(const Observations& observations, const Model& start, const FitCore& fit, double scale);

/// The same without sizes and number of the parameters, for which fits beside priors are needed: no deviance
/// is smaller.
Figures least_figures(const Observations& observations, const FitCore& fit, double scale);

/// That quotient for a convention that scales readings, else 0.
double of_scale(const Convention& convention, const Dataset& data);

/// How far readings of one quantity and run (nothing: of all) stand from the middle of their group, over
/// their uncertainties: 0.67 is the middle one of noise alone. Groups of fewer than three have no middle.
std::vector<double> scatter_over_uncertainty(const Dataset& data, const std::optional<Quantity>& quantity,
                                             const std::optional<std::size_t>& run);

}  // namespace trunnion::diagnosis
