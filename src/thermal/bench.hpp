#pragma once
#include <map>
#include <tuple>

#include "trunnion/thermal/validation.hpp"

#include "thermal/follower.hpp"
#include "thermal/sigma.hpp"

namespace trunnion::thermal {

/// One run of one channel as the validation sees it. Values relative to the reference state.
struct BenchRun {
  std::size_t log_run = 0;
  Eigen::Index reference_row = 0;
  double reference_mm = 0.0;          // value of the channel there
  std::vector<Eigen::Index> rows;     // measured rows after the reference
  std::vector<double> value_mm;       // at `rows`
  std::vector<Eigen::Index> anchors;  // rows at which a measurement is made known, the reference first
  std::vector<double> anchor_mm;
  std::vector<std::size_t> anchor_of_row;  // for `rows`: the last anchor before it
};

/// Everything that the folds of one channel share: runs, features and training sets.
class ChannelBench {
 public:
  ChannelBench(const Log& log, std::size_t channel, double measure_every_s);

  const std::vector<BenchRun>& runs() const { return runs_; }
  const LogRun& log_run(std::size_t run) const { return log_->runs[runs_[run].log_run]; }
  /// Whether the channel was hardly measured but when it was made known: between those times nothing is
  /// validated.
  bool blind() const;
  /// Features of a run relative to its reference, all rows.
  const RunFeatures& features(Method method, std::size_t run);
  /// Levels (or changes from one anchor to the next) of these runs.
  TrainingSet training(Method method, bool increments, const std::vector<std::size_t>& runs);
  /// Changes are what linear models and the Gaussian process learn for incremental use; the paper's methods
  /// know only levels.
  static bool learns_increments(const Candidate& candidate);
  /// Fit of a method to these runs; kept, since several candidates and folds ask for the same one.
  Result<std::shared_ptr<const Regressor>> regressor(Method method, bool increments,
                                                     const std::vector<std::size_t>& runs);

 private:
  using FitKey = std::tuple<Method, bool, std::vector<std::size_t>>;
  const Log* log_;
  std::vector<BenchRun> runs_;
  std::map<Method, std::vector<RunFeatures>> features_;
  std::map<FitKey, Result<std::shared_ptr<const Regressor>>> fits_;
};

/// Rows at which a measurement of the channel is made known when one is made every `measure_every_s`, the
/// reference's too where it was measured.
std::vector<std::size_t> known_measurements(const LogRun& run, const std::vector<double>& channel_mm,
                                            double measure_every_s);

Result<Fitted> fit_candidate(ChannelBench& bench, const Candidate& candidate,
                             const std::vector<std::size_t>& runs);

/// Errors (predicted minus measured) at every `stride`-th measured row of a run.
std::vector<double> held_out_errors(ChannelBench& bench, const Candidate& candidate, const Fitted& fitted,
                                    std::size_t run, std::size_t stride);
/// The same at all of them, with what had happened since the last measurement.
std::vector<HeldOut> held_out(ChannelBench& bench, const Candidate& candidate, const Fitted& fitted,
                              std::size_t run, std::size_t stride = 1);

}  // namespace trunnion::thermal
