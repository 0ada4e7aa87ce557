#pragma once
#include "diagnosis/fit/observations.hpp"

namespace trunnion::diagnosis {

/// Readings that wander: beside the white noise of each, a process of Ornstein and Uhlenbeck that successive
/// readings share, which fades with their number.
struct Wander {
  double size = 0.0;      // standard deviation, over `u_random` of each reading
  double length = 1.0;    // readings in which it fades to 1/e
  bool along_run = true;  // shared by all readings of a run; else by those of one direction of it
};

/// Readings of each run, or of each group, in the order of their times, without those that are not used.
std::vector<std::vector<Eigen::Index>> sequences_of(const Observations& observations, bool along_run,
                                                    const std::vector<bool>& used);

/// Rows divided by `u_random` -> rows of unit variance that are independent of each other (the innovations of
/// a Kalman filter with one state a sequence), in place. Returns ln of the determinant of their covariance.
double take_wander(const Wander& wander, const std::vector<std::vector<Eigen::Index>>& sequences,
                   Eigen::Ref<MatrixXd> rows);

}  // namespace trunnion::diagnosis
