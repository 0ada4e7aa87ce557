#pragma once
#include <functional>
#include <string>
#include <vector>

#include "diagnosis/fit/observations.hpp"

namespace trunnion::diagnosis {

constexpr int kFullDegree = 6;  // a bump a sixth of the range wide is still seen
constexpr int kHarmonics = 4;   // of a rotary axis

/// What a residual may depend on: one number for each reading.
struct Covariate {
  std::string name;
  VectorXd values;
  bool periodic = false;     // a rotary axis that makes (most of) a turn
  std::size_t distinct = 0;  // values, counted up to 40
};

/// Number of different values (to a millionth of the range), counted up to `limit`.
std::size_t distinct_values(const VectorXd& v, std::size_t limit);

/// At most so many places between the values that occur, evenly in rank.
std::vector<double> places_between(const VectorXd& v, int most);

Covariate covariate(const Observations& o, std::string name,
                    const std::function<double(const MachineState&)>& value);
/// Positions of the axes that move.
std::vector<Covariate> axis_covariates(const Observations& o);
/// Time, speed, sensors, free states, velocities, tool length: those that vary.
std::vector<Covariate> state_covariates(const Observations& o);

/// Functions of one covariate, without the constant: harmonics, or Legendre polynomials on its range.
MatrixXd functions(const Covariate& c, int degree);
/// One harmonic alone, for power: components of the library hold the first two.
MatrixXd harmonic(const Covariate& c, int k);
/// Waves of up to `count` half cycles along the range, or harmonics: what polynomials of a low degree miss.
MatrixXd waves(const Covariate& c, int count);

}  // namespace trunnion::diagnosis
