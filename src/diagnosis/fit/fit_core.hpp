#pragma once
#include <memory>

#include "trunnion/diagnosis/fit.hpp"

#include "diagnosis/fit/whitening.hpp"

namespace trunnion::diagnosis {

/// A parameter that a fit may move.
struct FreeParameter {
  std::size_t effect = 0, index = 0;  // of Model::effects, of its parameters
  bool prior = false;
};

/// A fitted model with everything that later tests project out.
struct FitCore {
  Model model;
  std::vector<FreeParameter> free;
  std::shared_ptr<const Whitening> whitening;
  VectorXd raw;         // value - prediction at the nominal set-up; mm, rad
  VectorXd white;       // whitened residual, set-ups and base projected out; N, then one for each prior
  MatrixXd basis;       // of the whitened base columns, orthonormal, (N + priors) x rank
  MatrixXd covariance;  // of the free parameters; 0 in directions that the data do not see
  std::vector<bool> determined;  // of each free parameter
  MatrixXd null_vectors;         // free x count, in internal units
  EstimatedCommon common;
  bool converged = true;

  double chi2() const { return white.squaredNorm(); }
  double dof() const {
    return static_cast<double>(whitening->noise().used_count() + prior_count() - whitening->setup_rank() -
                               basis.cols());
  }
  Eigen::Index prior_count() const { return white.size() - raw.size(); }
  /// Raw columns of candidates -> whitened, without set-ups and without what the base imitates; rows as
  /// `white`. 0 where nothing but rounding is left.
  MatrixXd projected(const MatrixXd& raw_columns) const;
};

/// value - prediction - set-up of each reading, without the offsets of groups where the data had to tell how
/// large they are; mm, rad.
VectorXd plain_residual(const Observations& observations, const FitCore& fit);

/// Root mean squares of the readings that `used` says (empty: all), one a quantity; NaN where it was not
/// measured.
struct SizeByQuantity {
  double um = 0.0, urad = 0.0;
};
SizeByQuantity size_by_quantity(const Dataset& data, const VectorXd& values,
                                const std::vector<bool>& used = {});

/// Fits from the model's values. `outliers` (empty or one flag per reading) are left out; `options.robust`
/// finds them instead.
FitCore fit_core(const Observations& observations, const Model& model, const FitOptions& options,
                 const std::vector<bool>& outliers = {});

/// The same and all that is said of it, as on a machine and its data.
Fit fit(const Observations& observations, const Model& model, const FitOptions& options = {});

/// Effects whose variant the file leaves open (`crosstalk:XY` without a component) get the one that fits
/// best, in the order of the model.
Model with_best_variants(const Observations& observations, Model model);

/// The effect of the model that is the same in the same variant, of which a model file holds one; null where
/// there is none.
const ModelEffect* find_effect(const Model& model, const EffectInfo& info);

/// Readings that stand alone beyond what base and a smooth surrogate explain: Huber's fit, then |r| beyond
/// kOutlier robust standard deviations.
std::vector<bool> find_outliers(const Observations& observations, const FitCore& fit);
inline constexpr double kOutlier = 4.5;  // one false flag in 150 000 readings of Gaussian noise

/// Shape parameters that a search tries for this effect on these data: known candidates first. Each entry has
/// info().shape_count() values; one empty entry for an effect without shape parameters.
std::vector<std::vector<double>> shape_grid(const Observations& observations, const Effect& effect);

/// All moments between two times (s) at which a step of this effect's run could be told.
std::vector<double> step_moments(const Observations& observations, const Effect& effect, double low,
                                 double high);

std::vector<NullDirection> null_directions(const Observations& observations, const FitCore& fit);

}  // namespace trunnion::diagnosis
