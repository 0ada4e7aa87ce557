#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/thermal/log.hpp"
#include "trunnion/thermal/model.hpp"

namespace trunnion::thermal {

struct FitOptions {
  std::vector<std::string> targets;  // channels; empty: all of the log
  double measure_every_s = 1800.0;   // a blade
  std::optional<Method> method;      // nothing: the one with the smallest held-out error
  double window_s = 3.0 * 3600.0;    // the beginning of a run that is scored on its own
  std::string name;                  // of the model
  /// Called before each of the candidates of all channels, with how many there are.
  std::function<void(std::size_t total)> progress;
};

/// Held-out errors of one candidate: each run predicted by a model that was fitted to the other runs.
struct Score {
  std::string name;
  double rmse_mm = 0.0;           // over all measurements of all runs
  double mean_run_rmse_mm = 0.0;  // mean over runs of the run's RMSE
  double median_run_rmse_mm = 0.0;
  double worst_run_rmse_mm = 0.0;
  double p95_mm = 0.0;          // of the absolute errors
  double window_rmse_mm = 0.0;  // mean over runs of the RMSE within the window
  double window_worst_rmse_mm = 0.0;
  std::vector<double> run_rmse_mm;
};

/// One run by a model that never saw it (nor was chosen by it, where the choice was held out): at each
/// measured row what was measured, what was said just before, sigma so that 1.96 of it hold 95 % (NaN where
/// the last measurement is held, and with two runs), and what holding the last measurement says.
struct HeldOutTrack {
  std::vector<double> time_s, measured_mm, said_mm, sigma_mm, hold_last_mm;
};

/// How much a sensor (or spindle_rpm, feed_mm_min) does in the fitted model: root mean square, over the
/// training's changes between measurements, of what the model says without its part.
struct InputEffect {
  std::string name;
  double rms_mm = 0.0;
};

struct ChannelReport {
  std::string channel;
  std::string chosen;
  /// `none` and `hold_last` first.
  std::vector<Score> models;
  /// Held-out error of the choice itself: the method is chosen again without each run (nothing with fewer
  /// than four runs, a method asked for, or where doing nothing or holding the last measurement is better:
  /// that is then chosen).
  std::optional<Score> nested;
  /// Of the errors of runs held out, the choice among it where there is one.
  SigmaModel sigma, hold_sigma;
  std::vector<std::string> runs;  // in which the channel was measured
  /// Share of each run's errors within 1.96 sigma, sigma too without that run; empty with fewer than three
  /// runs.
  std::vector<double> coverage;
  std::vector<HeldOutTrack> tracks;   // one for each of `runs`
  std::vector<InputEffect> inputs;    // of the chosen method, the largest effect first
  std::vector<std::string> notes;     // methods that this log does not allow, and why
  std::vector<std::string> warnings;  // runs that the others do not explain; a choice that does not help

  const Score* score(std::string_view name) const;
};

struct FitResult {
  ThermalModel model;
  std::vector<ChannelReport> channels;
};

/// Validates every method leave-one-run-out with a re-measurement every `measure_every_s` (training sees no
/// other measurements either), chooses, and fits the chosen one to all runs. A channel counts from its first
/// measurement in a run when that stands within a tenth of the interval from the run's start, else from zero
/// at the run's start. A prediction uses only what came before it. Fails when a target is missing or fewer
/// than two runs have measurements of it.
Result<FitResult> fit_thermal(const Log& log, const FitOptions& options, Diagnostics& diagnostics);

}  // namespace trunnion::thermal
