#include "thermal/stuck.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "trunnion/base/number_text.hpp"
#include "trunnion/thermal/features.hpp"

#include "thermal/regressors.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Largest range of any other sensor's readings between two rows.
double others_moved(const LogRun& run, std::size_t sensor, std::size_t from, std::size_t to) {
  double out = 0.0;
  for (std::size_t s = 0; s < run.temperature_degC.size(); ++s) {
    if (s == sensor) continue;
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (std::size_t row = from; row <= to; ++row) {
      const double value = run.temperature_degC[s][row];
      if (value < least) least = value;
      if (value > most) most = value;
    }
    out = std::max(out, most - least);
  }
  return out;
}

// Smallest step between two readings one after the other; 0 where there is none.
double step_of(const Log& log, std::size_t sensor) {
  double least = std::numeric_limits<double>::infinity();
  for (const LogRun& run : log.runs) {
    double before = kNotRead;
    for (const double value : run.temperature_degC[sensor]) {
      if (std::isnan(value)) continue;
      // Differences of decimals are not exact: what is far below the last digit of any logger is none.
      constexpr double kNone_K = 1e-6;
      const double step = std::abs(value - before);
      if (step > kNone_K && step < least) least = step;
      before = value;
    }
  }
  return std::isfinite(least) ? least : 0.0;
}

// How often the readings of a sensor turn round, for each reading outside `left_out`: its noise, in its
// steps.
double flicker_of(const Log& log, std::size_t sensor, const std::vector<Standstill>& left_out) {
  double turns = 0.0;
  double readings = 0.0;
  for (std::size_t r = 0; r < log.runs.size(); ++r) {
    double before = kNotRead;
    double direction = 0.0;
    for (const double value : log.runs[r].temperature_degC[sensor]) {
      if (std::isnan(value)) continue;
      readings += 1.0;
      if (value != before && !std::isnan(before)) {
        const double now = value > before ? 1.0 : -1.0;
        if (now * direction < 0.0) turns += 1.0;
        direction = now;
      }
      before = value;
    }
  }
  for (const Standstill& s : left_out) readings -= static_cast<double>(s.readings);
  return readings > 0.0 ? turns / readings : 0.0;
}

// What the other sensors let expect of one sensor.
class Expectation {
 public:
  Expectation(const Log& log, std::size_t sensor) : log_(resampled(log, kStep_s)), sensor_(sensor) {
    FeatureSpec spec;
    for (std::size_t s = 0; s < log.sensors.size(); ++s) {
      if (s != sensor) spec.sensors.push_back(log.sensors[s]);
    }
    spec.temperature_taus_s = {0.0, 900.0, 3600.0};  // as the models of the channels have them
    for (const LogRun& run : log_.runs) {
      features_.push_back(run_features(spec, log_, run).values);
      if (features_.back().rows() > 0) {
        const Eigen::RowVectorXd first = features_.back().row(0);
        features_.back().rowwise() -= first;
      }
    }
  }

  // Fits to all rows that are in none of `left_out`; false when they are too few to tell.
  bool fit(const std::vector<Standstill>& left_out, const Log& raw) {
    const TrainingSet set = training(left_out, raw);
    const auto enough = 2 * set.to.rows() >= set.to.cols() && set.to.rows() >= 8;
    auto fitted =
        enough ? fit_ridge(set) : Result<std::shared_ptr<const Regressor>>(fail(ErrorCode::wrong_input, ""));
    if (!fitted) return false;
    regressor_ = *fitted;
    double squares = 0.0;
    for (const auto& fold : grouped_folds(set, set.group.size())) {
      const TrainingSet outside = rows_of(set, fold, true);
      const auto without = fit_ridge(rows_of(set, fold, false));
      if (!without) return false;
      for (Index i = 0; i < outside.to.rows(); ++i)
        squares += std::pow((*without)->level_mm(outside.to.row(i).transpose()) - outside.change_mm[i], 2);
    }
    scatter_K_ = std::sqrt(squares / static_cast<double>(set.to.rows()));
    return true;
  }

  // Largest expected departure from where the standstill begins, K.
  double change_K(const Standstill& still, const Log& raw) const {
    const double from_s = raw.runs[still.run].time_s[still.from];
    const double to_s = raw.runs[still.run].time_s[still.to];
    const LogRun& run = log_.runs[still.run];
    double begin = kNotRead;
    double largest = 0.0;
    for (std::size_t row = 0; row < run.rows(); ++row) {
      if (run.time_s[row] < from_s || run.time_s[row] > to_s) continue;
      const double here = regressor_->level_mm(features_[still.run].row(static_cast<Index>(row)).transpose());
      if (std::isnan(begin)) begin = here;
      largest = std::max(largest, std::abs(here - begin));
    }
    return largest;
  }
  double scatter_K() const { return scatter_K_; }

 private:
  static constexpr double kStep_s = 120.0;

  TrainingSet training(const std::vector<Standstill>& left_out, const Log& raw) const {
    std::vector<std::pair<std::size_t, std::size_t>> rows;  // run, row
    for (std::size_t r = 0; r < log_.runs.size(); ++r) {
      const LogRun& run = log_.runs[r];
      for (std::size_t row = 0; row < run.rows(); ++row) {
        if (std::isnan(run.temperature_degC[sensor_][row])) continue;
        const bool out = std::any_of(left_out.begin(), left_out.end(), [&](const Standstill& s) {
          return s.run == r && run.time_s[row] >= raw.runs[r].time_s[s.from] &&
                 run.time_s[row] <= raw.runs[r].time_s[s.to];
        });
        if (!out) rows.emplace_back(r, row);
      }
    }
    // One run is held out at a time; a log of one or two runs in quarters, since two parts must be left.
    constexpr std::size_t kParts = 4;
    std::set<std::size_t> runs;
    for (const auto& [run, row] : rows) runs.insert(run);
    const bool few = runs.size() < 3;
    TrainingSet set;
    const auto count = static_cast<Index>(rows.size());
    set.to.resize(count, features_.empty() ? 0 : features_.front().cols());
    set.from = Eigen::MatrixXd::Zero(set.to.rows(), set.to.cols());
    set.change_mm.resize(count);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto [r, row] = rows[i];
      const auto& column = log_.runs[r].temperature_degC[sensor_];
      const double first =
          *std::find_if(column.begin(), column.end(), [](double v) { return !std::isnan(v); });
      set.to.row(static_cast<Index>(i)) = features_[r].row(static_cast<Index>(row));
      set.change_mm[static_cast<Index>(i)] = column[row] - first;  // of a temperature here, K
      set.group.push_back(few ? i * kParts / rows.size() : r);
    }
    return set;
  }

  Log log_;
  std::size_t sensor_;
  std::vector<Eigen::MatrixXd> features_;
  std::shared_ptr<const Regressor> regressor_;
  double scatter_K_ = 0.0;
};

}  // namespace

std::vector<Standstill> standstills(const Log& log, std::size_t sensor, const SensorLimits& limits) {
  std::vector<Standstill> out;
  for (std::size_t r = 0; r < log.runs.size(); ++r) {
    const LogRun& run = log.runs[r];
    const auto& column = run.temperature_degC[sensor];
    Standstill now;
    const auto close = [&] {
      if (now.readings > 2 && run.time_s[now.to] - run.time_s[now.from] >= limits.stuck_s &&
          others_moved(run, sensor, now.from, now.to) >= limits.stuck_while_other_K)
        out.push_back(now);
    };
    for (std::size_t row = 0; row < run.rows(); ++row) {
      if (std::isnan(column[row])) continue;
      if (now.readings == 0 || column[row] != column[now.from]) {
        close();
        now = {r, row, row, 0};
      }
      now.to = row;
      ++now.readings;
    }
    close();
  }
  return out;
}

void report_stuck(const Log& log, const SensorLimits& limits, std::vector<SensorFault>& faults) {
  for (std::size_t s = 0; s < log.sensors.size(); ++s) {
    const auto all = standstills(log, s, limits);
    if (all.empty()) continue;
    const double step_K = step_of(log, s);
    const double flicker = flicker_of(log, s, all);
    const auto report = [&](const Standstill& still, const std::string& why) {
      const LogRun& run = log.runs[still.run];
      faults.push_back({run.id, log.sensors[s], FaultKind::stuck, run.time_s[still.from],
                        run.time_s[still.to], still.readings, why});
    };
    if (step_K == 0.0) {
      for (const Standstill& still : all) report(still, "it never moves");
      continue;
    }
    Expectation expectation(log, s);
    const bool elsewhere = expectation.fit(all, log);
    for (const Standstill& still : all) {
      // Where nearly all is standstills each one is judged by the others.
      if (!elsewhere && !expectation.fit({still}, log)) continue;
      const double expected_K = expectation.change_K(still, log);
      constexpr double kSteps = 5.0;
      constexpr double kScatters = 5.0;
      // A sensor that flickers between its steps and then no more says itself that it stands.
      constexpr double kSilentTurns = 20.0;
      const bool silent = flicker * static_cast<double>(still.readings) > kSilentTurns;
      const double scatter_K = silent ? 0.0 : kScatters * expectation.scatter_K();
      const double explained_K = std::max({limits.stuck_least_K, kSteps * step_K, scatter_K});
      if (expected_K <= explained_K) continue;
      report(still, "the other sensors let expect a change of " + fixed_text(expected_K, 1) +
                        " K, its steps are " + fixed_text(step_K, 3) + " K");
    }
  }
}

}  // namespace trunnion::thermal
