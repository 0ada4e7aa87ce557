#pragma once
#include "trunnion/config/section.hpp"
#include "trunnion/thermal/model.hpp"

namespace trunnion::thermal {

/// f(x) = intercept + w . x on the chosen features.
Result<std::shared_ptr<const Regressor>> fit_ols(const TrainingSet& training);
Result<std::shared_ptr<const Regressor>> fit_ridge(const TrainingSet& training);
Result<std::shared_ptr<const Regressor>> fit_svr(const TrainingSet& training, bool significant_only);
Result<std::shared_ptr<const Regressor>> fit_gp(const TrainingSet& training);
/// The mean of ridge on the temperatures, ridge on all features and the Gaussian process: with few runs the
/// held-out ones cannot tell which of the three is best, and their mean is seldom far from it.
Result<std::shared_ptr<const Regressor>> fit_mean(const TrainingSet& training);

std::shared_ptr<const Regressor> linear_regressor(double intercept_mm, Eigen::VectorXd weight_mm);

/// Features that are significant at 5 % in the regression on all of them; the most significant one when none
/// is.
Result<std::vector<Eigen::Index>> significant_features(const TrainingSet& training);

/// Rows of the training set of the given groups (or of all others).
TrainingSet rows_of(const TrainingSet& training, const std::vector<std::size_t>& groups, bool inside);
/// Whole runs dealt out to at most `count` folds.
std::vector<std::vector<std::size_t>> grouped_folds(const TrainingSet& training, std::size_t count);

std::shared_ptr<const Regressor> read_linear(std::size_t features, config::Section& section);
std::shared_ptr<const Regressor> read_svr(std::size_t features, config::Section& section);
std::shared_ptr<const Regressor> read_gp(std::size_t features, config::Section& section);
std::shared_ptr<const Regressor> read_mean(std::size_t features, config::Section& section);
std::shared_ptr<const Regressor> read_regressor(Method method, std::size_t features,
                                                config::Section& section);

config::Value number_value(double value);
config::Value numbers(const Eigen::VectorXd& values);
/// Reads as many numbers as `size` says; reports another count.
Eigen::VectorXd read_numbers(config::Section& section, std::string_view key, std::size_t size);
/// An array of rows.
config::Value matrix_value(const Eigen::MatrixXd& matrix);
Eigen::MatrixXd read_matrix(config::Section& section, std::string_view key, std::size_t rows,
                            std::size_t columns);

}  // namespace trunnion::thermal
