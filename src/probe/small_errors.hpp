#pragma once
#include <Eigen/Core>
#include <vector>

namespace trunnion::probe {

/// A linear(ised) fit: residuals = J x + noise, x known beforehand to be `expected` with the given
/// precisions.
struct LinearFit {
  Eigen::MatrixXd J;
  Eigen::VectorXd residuals;  // taken less predicted at x = 0, mm
  Eigen::VectorXd u;          // standard uncertainty of each reading, mm
  Eigen::VectorXd expected, precision;
};

/// Correlations that small errors of the machine, which the fit does not know, give the readings: one matrix
/// for each length over which they change.
struct SmallErrors {
  std::vector<Eigen::MatrixXd> of_linear_axes;
  Eigen::MatrixXd of_rotary_axes;
};

struct Averaged {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
};

/// x and its covariance with the size of the small errors, the length over which they change and the scatter
/// of the readings taken from the readings themselves: an average over a grid of all of them, each weighted
/// by its marginal likelihood (Rasmussen and Williams, Gaussian Processes for Machine Learning, 5.4.1
/// and 2.7). Small errors move what is fitted by more than the residuals show; this is what is said of them.
Averaged average(const LinearFit& fit, const SmallErrors& errors);

}  // namespace trunnion::probe
