#pragma once
#include "diagnosis/fit/noise_scale.hpp"

namespace trunnion::diagnosis {

/// Whether residuals of readings that lie next to each other along one axis (same run, quantity and n) are
/// alike: structure of any shape, without a basis for it (the k-index of smoothing; lag-1 product along the
/// coordinate).
struct NeighbourTest {
  std::string covariate;
  double z = 0.0;  // excess of the lag-1 product over that of simulated noise, in its standard deviations
  std::size_t pairs = 0;
};

/// One test for each axis that has enough pairs. Noise is simulated with `noise`'s correlation and projected
/// as the residual was.
std::vector<NeighbourTest> neighbour_tests(const Atoms& atoms, const Remainder& set, const NoiseScale& noise,
                                           std::uint64_t seed);

/// How far the nearest neighbours (in pose, then in time, within the group) of readings that stand out stand
/// out to the same side, one of each or two, whichever says more: standard normal, each, when those readings
/// are outliers.
double company(const Observations& observations, const std::vector<bool>& outliers, const VectorXd& white);
inline constexpr double kInCompany = 4.0;  // from which they stand out together
/// Readings that stand out, from which on a common cause is looked for.
inline constexpr std::ptrdiff_t kFewestTogether = 8;
/// What a reading that stands out has beside it: the residuals of its two nearest neighbours, positive to the
/// same side, at most 3 of the noise; 0 where there is none.
struct Company {
  double nearest = 0.0, next = 0.0;
};
/// 0 of readings that do not stand out.
std::vector<Company> companions(const Observations& observations, const std::vector<bool>& outliers,
                                const VectorXd& white);

/// The readings among `outliers` that stand out alone. Those that do so together, with their neighbours or as
/// one function of the state, are evidence of something that the model lacks, and stay. `all`: a fit in which
/// every reading has its weight.
std::vector<bool> isolated_outliers(const Observations& observations, const FitCore& all,
                                    std::vector<bool> outliers);

}  // namespace trunnion::diagnosis
