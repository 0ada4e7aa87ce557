#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/thermal/log.hpp"
#include "trunnion/thermal/statistics.hpp"

namespace trunnion::thermal {

/// What the paper's screening and the stable one say of one sensor.
struct SensorScreen {
  std::string sensor;
  std::optional<ShapiroWilk> normality;  // of the readings at the measurements, all runs
  std::optional<double> p;               // in the regression on all sensors
  double variance_inflation = 0.0;
  bool chosen_by_p = false;     // p < 0.05
  bool chosen_by_runs = false;  // by forward selection on held-out runs
  double share_of_folds = 0.0;  // of leave-one-run-out fits in which p < 0.05 chose it
};

struct ChannelScreen {
  std::string channel;
  std::size_t measurements = 0;
  std::size_t runs = 0;
  std::vector<SensorScreen> sensors;
  double condition = 0.0;     // of the regressors
  std::string no_regression;  // why there are no p-values; else empty
  double p_jaccard = 1.0;     // mean overlap of the sets that p chooses when one run is left out: 1 is stable
  double heldout_all_mm = 0.0;        // leave-one-run-out RMSE of the rise of all sensors,
  double heldout_p_mm = 0.0;          // of those that p chooses,
  double heldout_runs_mm = 0.0;       // of those chosen by held-out runs
  std::vector<std::string> warnings;  // where the two disagree or a test means nothing
};

/// Screens the sensors for each target at its measurements (`measure_every_s` apart): the paper's way
/// (Shapiro-Wilk, then p < 0.05 in a multiple regression) beside forward selection by leave-one-run-out.
/// Fails like fit_thermal.
Result<std::vector<ChannelScreen>> screen(const Log& log, const std::vector<std::string>& targets,
                                          double measure_every_s);

}  // namespace trunnion::thermal
