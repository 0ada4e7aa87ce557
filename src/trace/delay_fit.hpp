#pragma once
#include <optional>
#include <vector>

#include "trace/followed.hpp"

// Private to the layer: what must be added to the positions of a trace to bring them onto the program.
namespace trunnion::trace {

/// Least squares over the rows of feed moves: c = x + sum over axes of (tau v + offset + backlash sign(v) +
/// spike exp(-t / T) sign after a reversal) + kappa a is on the path; what is off along the path counts for
/// nothing. Sigmas from sums over stretches of rows, so that neighbours that err alike do not count as many.
///
/// A delay tau that all axes share (shared) is seen by its second order only: x + tau v is on the path, at
/// corners and at starts too, where kappa a follows it no further than curves.
class DelayFit {
 public:
  enum class Kind : std::uint8_t { lag, curve, offset, backlash, spike, shared };
  struct Term {
    Kind kind = Kind::lag;
    AxisId axis = 0;
    double value = 0.0, sigma = 0.0;  // s; s2; scaled mm
    double share = 0.0;               // of the squared deviation that is gone with it
    double rms = 0.0;                 // of what it does across the path, scaled mm
    std::size_t worst = 0;            // row where it does most
  };

  static constexpr double kSpike_s = 0.015;  // T
  /// What is not known of the mean of a command over some rows, as a share of what the command at both ends
  /// of their time is off from going on straight: where between two rows a corner is, and at which place it
  /// passes them (a 350th of it and a 130th, root mean square).
  static constexpr double kBend = 1.0 / 128.0;

  DelayFit(const Followed& followed, const JointPath& path, const Machine& machine, const Plan& plan);

  void run();
  /// After `run`, for values that are exact: of means of rows, in which those during which the command turns
  /// count as much as is known of them, with a delay of all axes in place of the curve where that leaves
  /// less.
  void refine();
  bool has_run() const { return has_run_; }
  const std::vector<Term>& terms() const { return terms_; }
  /// Sum of squares across the path, before anything is added.
  double before2() const { return before2_; }
  /// What must be added to the position at a row, where the axes have these velocities, to bring it onto the
  /// program: delays, and spikes, offsets and backlash where the row was fitted.
  Scaled to_program(std::size_t row, const Scaled& velocity) const;
  /// What is to be added to a mean of rows: a control sends straight pieces from row to row, and the later an
  /// axis follows the smoother it goes between two rows.
  Scaled between_rows(const Scaled& smooth) const;
  /// One standard deviation of that, but for the delay that all axes share.
  Scaled sigma_to_program(std::size_t row, const Scaled& velocity) const;
  /// What is left of spikes at a row, as `to_program` adds it.
  Scaled spikes_at(std::size_t row) const;
  /// A term as it was found; 0 where it was not.
  Term found(Kind kind, AxisId axis) const;
  /// Of single positions, after `refine`.
  const Scaled& scatter() const { return scatter_; }
  /// What is left across the path at a row when delays of single axes, offsets and backlash are taken out.
  Scaled left_at(std::size_t row) const;

 private:
  struct Row {
    std::size_t sample = 0;
    Scaled x, v, a;
    Scaled smooth = Scaled::Zero();    // as Mean has it
    Scaled reversed = Scaled::Zero();  // exp(-t / T) with the sign of the new direction
    Scaled sign = Scaled::Zero();      // direction of the last motion
    Scaled inside = Scaled::Zero();    // by which the mean of the command in its time is off the path
    double bend = 0.0;                 // how much that may be wrong
  };
  void collect();
  void choose_terms();
  Row row_at(std::size_t sample, const Scaled& velocity) const;
  bool is_added(const Term& term, std::size_t sample) const;
  Scaled column(const Row& row, const Term& term) const;
  Scaled added(const Row& row, bool all) const;
  Scaled off(const Row& row, const Scaled& by, Scaled& tangent) const;
  struct Normal {
    Eigen::MatrixXd matrix;
    Eigen::VectorXd right;
    double left2, of_nothing;  // sums of squares
  };
  Normal normal_equations(bool weighted);
  void iterate();
  Scaled scatter2() const;
  template <class Take>
  void each_off(const Take& take) const;
  double unlikeliness() const;
  struct Excess {
    double sum, sigma;
  };
  Excess excess() const;
  Term* shared();
  void iterate_beside_shared();
  void find_shared();
  bool add_smaller_lags();
  void find_bends();
  std::optional<Scaled> mean_command(std::size_t row, const std::vector<Scaled>& commands) const;
  double weight(const Row& row, double size) const;
  void select();
  void name_fewest_lags(const std::vector<Term>& all);
  void judge();

  const Followed& followed_;
  const JointPath& path_;
  const Machine& machine_;
  const Plan& plan_;
  std::vector<Row> rows_;
  std::vector<std::size_t> row_of_;  // of each sample: its row + 1; 0: none
  std::vector<Term> terms_;
  std::vector<AxisId> moving_;
  double before2_ = 0.0;
  Scaled scatter_ = Scaled::Zero();        // of single positions
  Scaled speed_scatter_ = Scaled::Zero();  // the same, as velocities show it
  double rounding_ = 1e-6;                 // weights: what is beyond a few of it counts less
  bool has_run_ = false;
};

}  // namespace trunnion::trace
