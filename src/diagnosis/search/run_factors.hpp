#pragma once
#include "diagnosis/search/search.hpp"

namespace trunnion::diagnosis {

inline constexpr double kUradPerArcsec = 4.84813681109536;

/// Readings of one run that are right once they are multiplied by `factor`: -1 is their sign, others a unit.
struct RunFactor {
  std::size_t run = 0;
  double factor = 1.0;
  bool with_uncertainty = false;  // their uncertainties too
  double gain = 0.0;              // in -2 ln of the evidence, each side with its own best effects
};

/// The runs of which the model leaves most first, by the sum of the squares of `white`; of what fits nothing
/// is wrong. Empty runs are left out.
std::vector<std::size_t> in_order_of_misfit(const Observations& o, const VectorXd& white);

/// What was tried, and of it what does better than the readings as they are, best first.
struct RunFactors {
  std::vector<RunFactor> better;
  double tried = 0.0;
};

/// Effects are searched beside each factor of each run anew: those that were found beside a wrong sign suit
/// the wrong sign (README of this layer, "Conventions"). Only effects without shapes, on both sides. `level`:
/// of false alarms; `depth`: effects at once.
RunFactors run_factors(const Atoms& all_shapes, const Atoms::Multiplicity& multiplicity, double level,
                       std::size_t depth);

}  // namespace trunnion::diagnosis
