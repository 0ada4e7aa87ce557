#pragma once
#include <Eigen/Core>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/config/value.hpp"
#include "trunnion/thermal/features.hpp"

namespace trunnion::thermal {

/// How a channel follows from the features.
enum class Method {
  none,       // no error is predicted
  hold_last,  // the last measurement stays
  ols,        // the paper's regression: temperatures with p < 0.05, with a constant
  svr,  // the paper's model: support vector regression with an RBF kernel on the temperatures with p < 0.05
  svr_all,   // the same on all temperatures
  rises,     // ridge without intercept on the temperature rises of the moment: what a control can calculate
  ridge,     // ridge without intercept on temperature rises and their first-order lags
  lag,       // first-order-lag sums on spindle speed and feed
  combined,  // ridge on the features of both
  gp,   // Gaussian process, linear + RBF kernel, on the features of both; has a standard deviation of its own
  mean  // the mean of ridge, combined and gp
};

/// What measurements within the run do for the prediction.
enum class Anchor {
  open,    // nothing: y = f(x)
  bias,    // the mean of what the measurements so far differ from f is added (a bias of the run)
  filter,  // the same bias, but following: each measurement moves it half of the way
  update   // incremental: the last measurement plus the change of f since then, as far as f kept its word
};

struct Candidate {
  Method method = Method::none;
  Anchor anchor = Anchor::open;
  std::string name() const;  // "none", "hold_last", "ridge", "ridge+bias", "ridge+update"
  bool operator==(const Candidate&) const = default;
};
std::optional<Candidate> candidate_of_name(std::string_view name);
std::string method_name(Method method);
std::optional<Method> method_of_name(std::string_view name);

/// Features that a method uses of a log with these sensors.
FeatureSpec features_of(Method method, const Log& log);

/// What a model is trained on: changes of a channel between two moments of a run. A level has its `from` at
/// the run's reference state (zero).
struct TrainingSet {
  Eigen::MatrixXd from, to;        // features relative to the run's reference, one row each
  Eigen::VectorXd change_mm;       // of the channel
  std::vector<std::size_t> group;  // run of each row: folds are made of whole runs
  Eigen::Index temperatures = 0;   // how many features, the first ones, are temperatures and their lags
};

/// A fitted function of the features.
class Regressor {
 public:
  virtual ~Regressor() = default;
  /// Deviation at features `x` relative to the reference state.
  virtual double level_mm(const Eigen::VectorXd& x) const = 0;
  /// Change of the deviation from `from` to `to`; level_mm(to) - level_mm(from) unless the method knows
  /// better.
  virtual double change_mm(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const {
    return level_mm(to) - level_mm(from);
  }
  /// Standard deviation of the change, where the method has one.
  virtual std::optional<double> change_sd_mm(const Eigen::VectorXd& from, const Eigen::VectorXd& to) const;
  /// Where f(x) = constant + w . x: w, mm per unit of each feature.
  virtual std::optional<Eigen::VectorXd> weights_mm() const { return std::nullopt; }
  /// For the model file.
  virtual config::Table table() const = 0;
};

/// Fits a method; hyperparameters by folds of whole runs within `training` (marginal likelihood for gp).
/// Fails when the measurements do not suffice (as for p-values without spare degrees of freedom). Not for
/// none and hold_last.
Result<std::shared_ptr<const Regressor>> fit_regressor(Method method, const TrainingSet& training);

/// Tells whether features are like those of the training. The squared distance h of x is taken in the
/// principal directions of the training features, each in units of its own spread, with a floor; beyond twice
/// the largest distance of the training the prediction is shrunk, as the reciprocal of the distance, so
/// that its correction stops growing.
class Guard {
 public:
  Guard() = default;
  explicit Guard(const TrainingSet& training);
  /// What a model file keeps of it.
  struct Parts {
    Eigen::VectorXd scale;       // of each feature
    Eigen::MatrixXd directions;  // features x kept
    Eigen::VectorXd spread;      // variance along each kept direction
    double floor = 1.0;          // variance of the directions that are not kept
    double largest = 1.0;        // largest distance of the training
    Eigen::MatrixXd seen;        // unit vectors of the training, one row each, far enough apart; may be empty
  };
  explicit Guard(Parts parts);
  /// Distance in units of the largest of the training: below 1 inside.
  double distance(const Eigen::VectorXd& x) const;
  /// Weight of the model at `x`, 1 inside. Beside the distance it knows reversals: a training that never
  /// cooled says little of cooling, however slow, and a model that is linear would say the reverse of
  /// heating. A change that is more like the reverse of what the training saw counts less, early where the
  /// training went one way only, late where it went both ways. A change that is like nothing seen keeps its
  /// weight: short changes have directions of their own.
  double weight(const Eigen::VectorXd& x) const;
  /// `x` in units of the training's spread of each feature.
  Eigen::VectorXd scaled(const Eigen::VectorXd& x) const;
  /// These shares of each feature's spread in the training.
  Eigen::VectorXd spread_of(const Eigen::VectorXd& share) const;
  /// Weight of the model, 1 inside.
  static double trust(double distance) { return distance > kMargin ? kMargin / distance : 1.0; }
  static constexpr double kMargin =
      2.0;  // linear models extrapolate twice the range well on the reference data, see README
  config::Table table() const;

 private:
  // 0 where no change of the training has its reverse in the training, 1 where nearly all have.
  double both_ways() const;
  Parts parts_;
};

/// How far a model that is used incrementally kept its word in this run. Predicted changes g and measured
/// changes m of the past count as much as their features resemble the present ones (the cosine between them:
/// cooling says nothing of heating); with the prior weight w of the guard, worth one typical change,
///     trust = (lambda w + sum s g m) / (lambda + sum s g^2), within 0 and 1,
/// the least-squares factor of g. At 0 the last measurement is held: a model that does worse than that is
/// found out after one interval.
class TrackRecord {
 public:
  /// @param change  features: present minus those at the measurement before, scaled (Guard::scaled)
  void add(const Eigen::VectorXd& change, double predicted_mm, double measured_mm);
  double trust(const Eigen::VectorXd& change, double prior_weight, double typical_change_mm) const;

 private:
  struct Kept {
    Eigen::VectorXd change;
    double predicted_mm, measured_mm;
  };
  static constexpr std::size_t kMostKept = 200;  // what is older has a weight of 0.8^200
  std::deque<Kept> past_;
};

/// What happened since the last measurement, as far as it makes a prediction less certain.
struct Causes {
  double age_s = 0.0;       // time since then
  double change_mm = 0.0;   // what the model says has changed since then
  double moved = 0.0;       // mean square of the features' changes, in units of the training's
  double unsettled = 0.0;   // how far the speed is from its fastest lag, and was at the measurement, 1000 rpm
  double swing_K = 0.0;     // of the temperatures, and as it was at the measurement: FeatureState::swing_K
  double unknown_mm = 0.0;  // what inputs that were not read may have done
  bool held = false;        // the last measurement stands instead of the model's word
};

/// How a run turns out against what its sigma promised, by its measurements: the mean square of (measured -
/// predicted) / sigma, each one counting 0.9 of the next.
class RunScale {
 public:
  void add(double in_sigmas);
  /// Factor of sigma; `prior` measurements speak for 1.
  double factor(double prior) const;

 private:
  double squares_ = 0.0;
  double count_ = 0.0;
};

/// So that 1.96 sigma cover 95 % of the errors of runs held out, in quiet hours as in lively ones: linear in
/// the share of the variance that is due to what happens (SigmaModel::liveliness), and the end's value beyond
/// them.
struct CoverageFactor {
  double quiet = 1.0, lively = 1.0;
  double quiet_at = 0.0, lively_at = 1.0;  // shares; equal: one factor, `quiet`
  double at(double liveliness) const;
};

/// Standard deviation of a prediction:
///     coverage * run factor * sqrt(floor^2 + growth^2 age + (per_change change)^2 + per_move^2 moved
///     + (per_krpm unsettled)^2 + (per_swing swing)^2
///     + unknown^2)
struct SigmaModel {
  double floor_mm = 0.0;
  double growth_mm_per_sqrt_s = 0.0;
  double per_change = 0.0;          // share of the change that the model says
  double per_move_mm = 0.0;         // where all features moved as they usually do between two measurements
  double per_krpm_mm = 0.0;         // of speed that has just changed
  double per_swing_mm = 0.0;        // of a kelvin by which temperatures go up and down within minutes
  double prior_measurements = 0.0;  // of the run factor; 0: there is none
  CoverageFactor coverage = {};
  /// Share of the variance that comes of changes, moves, speeds and swings, not of age and floor: 0 to 1.
  double liveliness(const Causes& causes) const;
  /// Without the two factors.
  double before_run_mm(const Causes& causes) const;
  double sigma_mm(const Causes& causes, const RunScale& run) const;

 private:
  double quiet_mm2(const Causes& causes) const;   // floor and age
  double lively_mm2(const Causes& causes) const;  // what happens
};

/// The model of one channel.
struct ChannelModel {
  std::string channel = {};  // name in the log, without _um
  /// "dx", "dy", "dz": which offset it gives; "none": it gives none; empty: nobody said, see check_axes.
  std::string axis = {};
  Candidate candidate = {};
  FeatureSpec features = {};
  std::shared_ptr<const Regressor> regressor = {};  // null for none and hold_last
  Guard guard = {};
  double typical_change_mm = 0.0;  // root mean square of the training's changes between measurements
  SigmaModel sigma = {};
  SigmaModel hold_sigma = {};  // of holding the last measurement, where the model cannot be asked
  double heldout_rmse_mm = 0.0;
  double hold_last_rmse_mm = 0.0;
  double largest_mm = 0.0;  // largest deviation of the training: the natural clamp
};

struct ThermalModel {
  std::string name;
  std::string data_hash;  // of the measurements it was fitted to
  std::vector<std::string> files;
  std::vector<std::string> runs;
  double measure_every_s = 1800.0;
  std::vector<ChannelModel> channels;
};

/// 0, 1, 2 for a channel that gives dx, dy, dz; nothing for one that gives no offset.
std::optional<Eigen::Index> offset_component(const ChannelModel& channel);
/// Of a channel called x, dx, y, ...: "dx", "dy", "dz"; empty for any other name.
std::string axis_of_name(const std::string& channel);
/// Before offsets are made of a model. Fails where a channel's offset was never said (it would be zero in
/// silence) and where two channels are to give the same one; the message holds the option that says it.
Result<void> check_axes(const ThermalModel& model, const std::string& file);

/// The model as the sum of weights times the rises of these sensors since the last measurement (before it:
/// since the reference state): mm/K, a row for each of dx, dy, dz. Fails for a
/// channel whose model is another function, naming it.
Result<Eigen::Matrix3Xd> instant_weights(const ThermalModel& model, const std::vector<std::string>& sensors);

std::string model_text(const ThermalModel& model);
Result<ThermalModel> parse_model(std::string_view toml, const std::string& file, Diagnostics& diagnostics);
Result<ThermalModel> load_model(const std::string& path, Diagnostics& diagnostics);

/// 64-bit FNV-1a of all numbers and names of a log, as hexadecimal: tells whether a model was fitted to this
/// data.
std::string data_hash(const Log& log);

}  // namespace trunnion::thermal
