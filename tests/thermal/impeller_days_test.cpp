// The paper's experiment on a simulated machine: a model from earlier impellers, one pair A (uncorrected) and
// B, and seven more.
#include <cstdio>
#include <gtest/gtest.h>

#include "trunnion/base/units.hpp"
#include "trunnion/thermal/predictor.hpp"
#include "trunnion/thermal/simulate.hpp"
#include "trunnion/thermal/validation.hpp"

namespace trunnion::thermal {
namespace {

constexpr double kTolerance_mm = 0.1;  // the paper's

ThermalModel model_of_earlier_impellers() {
  ImpellerDays earlier;
  earlier.impellers = 8;
  earlier.day_seed = 100;
  Diagnostics diagnostics;
  auto fit = fit_thermal(simulate(earlier).log, {}, diagnostics);
  EXPECT_TRUE(fit) << fit.error().text();
  for (const ChannelReport& c : fit->channels) {
    std::printf("%s: %s %.2f um held out, hold_last %.2f um\n", c.channel.c_str(), c.chosen.c_str(),
                c.score(c.chosen)->rmse_mm / kMmPerUm, c.score("hold_last")->rmse_mm / kMmPerUm);
  }
  return fit->model;
}

struct Corrections {
  std::vector<OffsetTable> over_time;  // of each run
  Correction continuous(const SimulatedDays& days) const {
    return [&days, this](std::size_t run, std::size_t row) {
      return over_time[run].at_time(days.log.runs[run].time_s[row]);
    };
  }
};

Corrections predict_all(const ThermalModel& model, const SimulatedDays& days) {
  Corrections out;
  for (std::size_t r = 0; r < days.log.runs.size(); ++r) {
    const auto prediction = predict(model, days.log, r, UseMeasurements::yes);
    EXPECT_TRUE(prediction) << prediction.error().text();
    out.over_time.push_back(offsets_of(model, *prediction));
  }
  return out;
}

double root_mean_square_mm(const SimulatedDays& days, const Correction& correction) {
  double sum = 0.0;
  double n = 0.0;
  for (std::size_t r = 0; r < days.log.runs.size(); ++r) {
    for (std::size_t row = 0; row < days.log.runs[r].rows(); ++row, n += 2.0)
      sum += (days.drift_mm[r][row] - correction(r, row)).head<2>().squaredNorm();
  }
  return std::sqrt(sum / n);
}

TEST(LongImpellerDays, SevenImpellersAreWithinATenthAfterCompensation) {
  const ThermalModel model = model_of_earlier_impellers();
  ImpellerDays seven;
  seven.day_seed = 7;
  const SimulatedDays days = simulate(seven);
  const Corrections corrections = predict_all(model, days);
  const auto blades = assess(days, corrections.continuous(days));
  const double before = share_within(blades, &BladeResult::before_mm, kTolerance_mm);
  const double after = share_within(blades, &BladeResult::after_mm, kTolerance_mm);
  const double rms_um = root_mean_square_mm(days, corrections.continuous(days)) / kMmPerUm;
  std::printf("blades within 0.1 mm: %.2f %% before, %.2f %% after; RMS left %.2f um\n", 100.0 * before,
              100.0 * after, rms_um);
  EXPECT_GE(before, 0.55);
  EXPECT_LE(before, 0.65);
  EXPECT_EQ(after, 1.0);
  // Of the measurement that the correction starts from; the drift within a blade adds to it.
  std::printf("one measurement: %.2f um\n", kMeasurementFloor_mm / kMmPerUm);
  EXPECT_LT(rms_um, 2.0 * kMeasurementFloor_mm / kMmPerUm);
}

}  // namespace
}  // namespace trunnion::thermal
