#pragma once
#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "trunnion/diagnosis/measurement.hpp"
#include "trunnion/effects/deviation.hpp"
#include "trunnion/effects/model.hpp"

#include "diagnosis/fit/condensed.hpp"

namespace trunnion::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The geometry of all readings: how each answers to a small twist of every link, and what the exact forward
/// model says of it. Rows are readings, in the order of the dataset; internal units (mm, rad). Const
/// functions may be called by several threads.
class Observations {
 public:
  /// Both must outlive the object.
  Observations(const Machine& machine, const Dataset& data);
  /// Means of readings that are taken together, one each bin: of what is read, of what the model says, of
  /// every derivative, exactly; pose and time are those of the middle.
  Observations(std::shared_ptr<const Observations> whole, const Bins& bins);

  Eigen::Index size() const { return values_.size(); }
  /// All readings, each by itself.
  const Observations& whole() const { return whole_ ? *whole_ : *this; }
  /// Of one value for each of all readings: the mean of each bin.
  MatrixXd means(MatrixXd of_all) const;
  /// Variance by which a single reading of the bin scatters more than their mean, as stated; 0 without bins.
  double scatter(Eigen::Index i) const { return whole_ ? bins_.scatter[i] : 0.0; }
  const Dataset& data() const { return *data_; }
  const Machine& machine() const { return *machine_; }
  const VectorXd& values() const { return values_; }
  const MachineState& state(Eigen::Index i) const { return states_[static_cast<std::size_t>(i)]; }
  const Reading& reading(Eigen::Index i) const { return readings_[static_cast<std::size_t>(i)]; }
  /// Direction of sensitivity in M.
  const Vec3& n_M(Eigen::Index i) const { return n_M_[static_cast<std::size_t>(i)]; }
  /// Readings of each run and of each group (same run, quantity, frame, n).
  const std::vector<std::vector<Eigen::Index>>& runs() const { return runs_; }
  const std::vector<std::vector<Eigen::Index>>& groups() const { return groups_; }

  /// Derivative of the readings in the linear parameters of `effect`, at zero errors. Throws a Failure
  /// (wrong_input) that names the reading where the effect gives no number; so do the next two.
  MatrixXd linear_columns(const Effect& effect, std::span<const double> shape) const;
  /// Derivative in all parameters of a model's effect, linear ones first (shape parameters by central
  /// differences).
  MatrixXd columns(const ModelEffect& effect) const;
  /// The joints in the order of the machine's axes, then spindle and part.
  std::size_t link_count() const { return response_.size(); }
  /// Derivative of the readings in the six components of a link's twist; N x 6.
  const MatrixXd& response(std::size_t link) const { return response_[link]; }
  /// Derivative in the set-up translation of the reading's run (x, y, z of P); zero for rotations.
  const Vec3& setup_row(Eigen::Index i) const { return setup_rows_[static_cast<std::size_t>(i)]; }

  /// What the exact forward model with these errors says, at the nominal set-up.
  VectorXd predicted(const Model& model) const;

 private:
  bool taken_as_before(Eigen::Index i) const;
  std::array<Deviation, 6> unit_twists(const DeviationMap& map, std::size_t link) const;
  /// What depends on state and lags is the same as of the reading before.
  bool repeats(Eigen::Index i, const std::vector<std::vector<double>>& lags) const;
  void take_together(const std::vector<Eigen::Index>& members);
  std::optional<std::size_t> run_of(const Effect& effect) const;
  [[noreturn]] void refuse(const Effect& effect, Eigen::Index i) const;
  VectorXd twist_response(const Effect& effect, std::span<const double> parameters) const;
  std::vector<std::vector<double>> lagged(const Effect& effect, std::span<const double> shape) const;
  std::size_t link_index(const Link& link) const;

  const Machine* machine_;
  const Dataset* data_;
  VectorXd values_;
  std::vector<Reading> readings_;
  std::vector<MachineState> states_;  // of each reading
  struct {
    std::vector<std::size_t> of;  // of each reading
    std::vector<DeviationMap> maps;
    std::vector<Eigen::Index> first;  // reading in each
  } places_;                          // each place of the axes, with its tool, once; none of means
  std::vector<bool> as_before_;       // taken in the same state, with the same tool, as the reading before
  std::vector<Vec3> n_M_, setup_rows_;
  std::vector<MatrixXd> response_;  // per link: N x 6, derivative in (d, r) of its twist
  std::vector<std::vector<Eigen::Index>> runs_, groups_;
  std::shared_ptr<const Observations> whole_;  // what means are of; empty: nothing is taken together
  struct {
    std::vector<Eigen::Index> of;  // of each reading of `whole_`, -1: none
    VectorXd share, scatter;       // of each bin: of one reading in it; `scatter`
  } bins_;
};

}  // namespace trunnion::diagnosis
