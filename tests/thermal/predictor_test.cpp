#include "trunnion/thermal/predictor.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>

#include "trunnion/base/units.hpp"
#include "trunnion/thermal/simulate.hpp"
#include "trunnion/thermal/validation.hpp"

#include "thermal/bench.hpp"
#include "thermal/watch.hpp"

namespace trunnion::thermal {
namespace {

SimulatedDays few_days() {
  ImpellerDays days;
  days.impellers = 4;
  days.step_s = 10.0;
  return simulate(days);
}

ThermalModel fitted(const Log& log, Method method, const std::string& channel) {
  FitOptions options;
  options.targets = {channel};
  options.method = method;
  Diagnostics diagnostics;
  auto result = fit_thermal(log, options, diagnostics);
  EXPECT_TRUE(result) << result.error().text();
  return result->model;
}

// The streaming predictor and the matrices of the validation are two ways to the same number.
TEST(ThermalPredictor, SaysWhatTheValidationSays) {
  const SimulatedDays days = few_days();
  const std::size_t channel = *days.log.channel("dy");
  for (const Method method : {Method::ols, Method::svr, Method::rises, Method::ridge, Method::lag,
                              Method::combined, Method::gp, Method::mean}) {
    for (const Anchor anchor : {Anchor::open, Anchor::bias, Anchor::filter, Anchor::update}) {
      const Candidate candidate{method, anchor};
      ChannelBench bench(days.log, channel, 1800.0);
      const auto fit = fit_candidate(bench, candidate, {0, 1, 2});
      if (!fit) continue;  // too few measurements for the paper's p-values
      ThermalModel model;
      ChannelModel c;
      c.channel = "dy";
      c.candidate = candidate;
      c.features = features_of(method, days.log);
      c.regressor = fit->regressor;
      c.guard = fit->guard;
      c.typical_change_mm = fit->typical_change_mm;
      model.channels.push_back(std::move(c));
      const auto errors = held_out_errors(bench, candidate, *fit, 3, 1);
      // Before each measurement: predict without it, from what was known.
      const BenchRun& run = bench.runs()[3];
      const LogRun& log_run = days.log.runs[3];
      Predictor predictor(model);
      std::size_t next = 0;
      for (std::size_t row = 0; row < log_run.rows(); ++row) {
        std::vector<double> temperature;
        for (const auto& name : predictor.sensors())
          temperature.push_back(log_run.temperature_degC[*days.log.sensor(name)][row]);
        ASSERT_TRUE(predictor.read(log_run.time_s[row], temperature, log_run.spindle_rpm[row],
                                   log_run.feed_mm_s[row]));
        const double measured = log_run.channel_mm[channel][row];
        if (std::isnan(measured)) continue;
        ASSERT_EQ(run.rows[next], static_cast<Eigen::Index>(row));
        EXPECT_NEAR(predictor.estimate(0).value_mm - measured, errors[next], 1e-9)
            << candidate.name() << " " << next;
        predictor.measure(0, measured);
        ++next;
      }
      EXPECT_EQ(next, errors.size());
    }
  }
}

TEST(ThermalModelFile, ReadsBackTheSamePredictions) {
  const SimulatedDays days = few_days();
  for (const Method method : {Method::ridge, Method::svr_all, Method::gp, Method::lag, Method::mean}) {
    const ThermalModel model = fitted(days.log, method, "dx");
    Diagnostics diagnostics;
    const auto again = parse_model(model_text(model), "thermal.toml", diagnostics);
    ASSERT_TRUE(again) << again.error().text();
    EXPECT_EQ(again->data_hash, data_hash(days.log));
    const auto a = predict(model, days.log, 1, UseMeasurements::yes);
    const auto b = predict(*again, days.log, 1, UseMeasurements::yes);
    ASSERT_TRUE(a && b);
    for (std::size_t i = 0; i < a->time_s.size(); i += 7) {
      EXPECT_NEAR(a->channel[0][i].value_mm, b->channel[0][i].value_mm, 1e-9);
      EXPECT_NEAR(a->channel[0][i].sigma_mm, b->channel[0][i].sigma_mm, 1e-12);
    }
  }
}

// No channel turns into a zero offset because of its name.
TEST(ThermalModel, AsksWhichOffsetAChannelGives) {
  ThermalModel model;
  model.channels.push_back({.channel = "ch3"});
  model.channels.push_back({.channel = "z", .axis = axis_of_name("z")});
  EXPECT_EQ(model.channels[1].axis, "dz");
  const auto asked = check_axes(model, "t.toml");
  ASSERT_FALSE(asked);
  EXPECT_NE(asked.error().message.find("--axes ch3=dx|dy|dz|none"), std::string::npos);
  model.channels[0].axis = "dz";
  EXPECT_FALSE(check_axes(model, "t.toml"));  // two that give the same
  model.channels[0].axis = "none";
  EXPECT_TRUE(check_axes(model, "t.toml"));
  EXPECT_FALSE(offset_component(model.channels[0]));
  EXPECT_EQ(offset_component(model.channels[1]), 2);
}

TEST(ThermalModelFile, SaysWhereItIsWrong) {
  const auto message = [](const std::string& text) {
    Diagnostics diagnostics;
    const auto model = parse_model(text, "t.toml", diagnostics);
    return model ? std::string("no error") : model.error().text();
  };
  EXPECT_EQ(message("[model]\nkind = 'geometric'\nmeasure_every_min = "
                    "30\n[[channel]]\nname='dx'\nmethod='hold_last'\nsigma_floor_um=1\n"),
            "t.toml:2:1: error: this is no thermal model: kind is 'geometric', not 'thermal'");
  EXPECT_EQ(message("[model]\nkind = 'thermal'\nmeasure_every_min = "
                    "30\n[[channel]]\nname='dx'\nmethod='magic'\nsigma_floor_um=1\n"),
            "t.toml:6:1: error: unknown method 'magic'");
  EXPECT_EQ(message("[model]\nkind = 'thermal'\nmeasure_every_min = 30\n"),
            "t.toml:1:1: error: a thermal model needs at least one [[channel]]");
  EXPECT_EQ(message("[model]\nkind = 'thermal'\nmeasure_every_min = "
                    "30\n[[channel]]\nname='dx'\nmethod='hold_last'\nsigma_floor_um=1\n"),
            "no error");
}

// What a control adds up is what the predictor says of a run without measurements.
TEST(ThermalModel, WeightsOfTheMomentAreTheModel) {
  const SimulatedDays days = few_days();
  ThermalModel model = fitted(days.log, Method::rises, "dx");
  model.channels[0].features.median_s = 0.0;
  model.channels[0].guard = Guard();
  Predictor predictor(model);
  const auto weights = instant_weights(model, predictor.sensors());
  ASSERT_TRUE(weights) << weights.error().text();
  EXPECT_EQ(weights->row(1).norm() + weights->row(2).norm(), 0.0);
  const Eigen::Index n = weights->cols();
  const Eigen::VectorXd cold = Eigen::VectorXd::LinSpaced(n, 18.0, 22.0);
  const Eigen::VectorXd rise = Eigen::VectorXd::LinSpaced(n, -1.0, 6.0);
  const Eigen::VectorXd warm = cold + rise;
  ASSERT_TRUE(predictor.read(0.0, {cold.data(), static_cast<std::size_t>(n)}, 0.0, 0.0));
  ASSERT_TRUE(predictor.read(600.0, {warm.data(), static_cast<std::size_t>(n)}, 0.0, 0.0));
  EXPECT_NEAR(predictor.estimate(0).value_mm, weights->row(0).dot(rise), 1e-12);
  const auto lagged = instant_weights(fitted(days.log, Method::ridge, "dx"), predictor.sensors());
  ASSERT_FALSE(lagged);
  EXPECT_NE(lagged.error().message.find("which a control cannot calculate"), std::string::npos);
}

TEST(ThermalPredictor, NamesWhatTheLogLacks) {
  const SimulatedDays days = few_days();
  const ThermalModel model = fitted(days.log, Method::lag, "dx");
  Log log = days.log;
  log.has_speed = false;
  const auto prediction = predict(model, log, 0, UseMeasurements::yes);
  ASSERT_FALSE(prediction);
  EXPECT_EQ(prediction.error().text(),
            "simulated: error: the model uses the spindle speed (column spindle_rpm), which the log lacks");
}

TEST(ThermalPredictor, HoldsTheLastMeasurementWhenSensorsFallSilent) {
  const SimulatedDays days = few_days();
  ThermalModel model = fitted(days.log, Method::ridge, "dx");
  model.channels[0].candidate.anchor = Anchor::update;
  Predictor predictor(model);
  const std::vector<double> warm(predictor.sensors().size(), 25.0);
  const std::vector<double> silent(predictor.sensors().size(), std::nan(""));
  ASSERT_TRUE(predictor.read(0.0, warm, 0.0, 0.0));
  ASSERT_TRUE(predictor.read(1800.0, warm, 0.0, 0.0));
  predictor.measure(0, 0.042);
  EXPECT_NEAR(predictor.estimate(0).value_mm, 0.042, 1e-12);
  const double sigma = predictor.estimate(0).sigma_mm;
  ASSERT_TRUE(predictor.read(3600.0, silent, 8000.0, 10.0));
  EXPECT_TRUE(predictor.estimate(0).stale);
  EXPECT_NEAR(predictor.estimate(0).value_mm, 0.042, 1e-12);
  EXPECT_GT(predictor.estimate(0).sigma_mm, sigma);
  EXPECT_FALSE(predictor.read(10.0, warm, 0.0, 0.0));  // time goes back: refused, nothing changes
  EXPECT_EQ(predictor.time_s(), 3600.0);
}

// Feeds a run up to a time; sensors as `change` leaves them.
void feed(Predictor& predictor, const Log& log, double until_s,
          const std::function<void(std::size_t, std::vector<double>&)>& change) {
  const LogRun& run = log.runs[1];
  for (std::size_t row = 0; row < run.rows() && run.time_s[row] <= until_s; ++row) {
    std::vector<double> degC;
    for (const auto& name : predictor.sensors()) degC.push_back(run.temperature_degC[*log.sensor(name)][row]);
    change(row, degC);
    ASSERT_TRUE(predictor.read(run.time_s[row], degC, run.spindle_rpm[row], run.feed_mm_s[row]));
  }
}

// A measurement in a gap of the sensors holds what they did until then: it is not to be added once more when
// they are back.
TEST(ThermalPredictor, CountsOnceWhatSensorsDidInAGap) {
  const SimulatedDays days = few_days();
  const std::size_t channel = *days.log.channel("dy");
  for (const Method method : {Method::ridge, Method::rises, Method::gp}) {
    for (const Anchor anchor : {Anchor::bias, Anchor::filter, Anchor::update}) {
      ThermalModel model = fitted(days.log, method, "dy");
      model.channels[0].candidate.anchor = anchor;
      Log gap = days.log;
      LogRun& run = gap.runs[1];
      std::size_t measured = 0;
      while (measured < run.rows() &&
             (run.time_s[measured] < 2500.0 || std::isnan(run.channel_mm[channel][measured])))
        ++measured;
      ASSERT_LT(measured, run.rows());
      const double from_s = run.time_s[measured] - 1200.0, to_s = run.time_s[measured] + 600.0;
      for (std::size_t row = 0; row < run.rows(); ++row) {
        if (run.time_s[row] < from_s || run.time_s[row] > to_s) continue;
        for (auto& column : run.temperature_degC) column[row] = kNotRead;
      }
      const auto with = predict(model, gap, 1, UseMeasurements::yes);
      const auto without = predict(model, days.log, 1, UseMeasurements::yes);
      ASSERT_TRUE(with && without);
      for (std::size_t row = 0; row < run.rows() && run.time_s[row] < to_s + 600.0; ++row) {
        const Estimate &a = with->channel[0][row], &b = without->channel[0][row];
        if (run.time_s[row] <= to_s) continue;
        ASSERT_LT(std::abs(a.value_mm - b.value_mm), 3.0 * a.sigma_mm)
            << model.channels[0].candidate.name() << " " << run.time_s[row];
      }
    }
  }
}

// A unit or a digit that is wrong: nothing is to follow it, and the next measurement counts again.
TEST(ThermalPredictor, FollowsNoMeasurementBeyondAllReason) {
  const SimulatedDays days = few_days();
  ThermalModel model = fitted(days.log, Method::ridge, "dx");
  model.channels[0].candidate.anchor = Anchor::update;
  const double largest_mm = model.channels[0].largest_mm;
  ASSERT_GT(largest_mm, 0.0);
  Predictor predictor(model);
  const std::vector<double> warm(predictor.sensors().size(), 25.0);
  ASSERT_TRUE(predictor.read(0.0, warm, 0.0, 0.0));
  EXPECT_TRUE(predictor.measure(0, 0.001));
  ASSERT_TRUE(predictor.read(1800.0, warm, 0.0, 0.0));
  EXPECT_TRUE(predictor.measure(0, 0.005));
  const double before_mm = predictor.estimate(0).value_mm;
  EXPECT_FALSE(predictor.measure(0, 11.0 * largest_mm + 0.005));
  EXPECT_FALSE(predictor.measure(0, -7.0));
  EXPECT_EQ(predictor.estimate(0).value_mm, before_mm);
  ASSERT_EQ(predictor.warnings().size(), 1U);
  EXPECT_NE(predictor.warnings()[0].find("such measurements are not followed"), std::string::npos);
  ASSERT_TRUE(predictor.read(3600.0, warm, 0.0, 0.0));
  EXPECT_TRUE(predictor.measure(0, 0.008));
  EXPECT_NEAR(predictor.estimate(0).value_mm, 0.007, 1e-12);
  // Where a run has no zero nobody knows what the first one counts from.
  Predictor unzeroed(model);
  ASSERT_TRUE(unzeroed.read(0.0, warm, 0.0, 0.0));
  ASSERT_TRUE(unzeroed.read(1800.0, warm, 0.0, 0.0));
  EXPECT_TRUE(unzeroed.measure(0, 20.0 * largest_mm));
  // If that was the wrong one, the right ones are not shut out behind it.
  ASSERT_TRUE(unzeroed.read(3600.0, warm, 0.0, 0.0));
  EXPECT_TRUE(unzeroed.measure(0, 0.004));
  EXPECT_NEAR(unzeroed.estimate(0).value_mm, 0.004, 1e-12);
}

// A live loop whose first reading is wrong says what it says without that reading, once it can tell; until
// then it does nothing, and its sigma says so.
TEST(ThermalPredictor, JudgesTheStartOfRawReadings) {
  const SimulatedDays days = few_days();
  const ThermalModel model = fitted(days.log, Method::ridge, "dx");
  for (const double by_K : {40.0, 3.0}) {
    Predictor raw(model, Readings::raw), judged(model);
    const auto wrong = [&](std::size_t row, std::vector<double>& degC) {
      if (row == 0) degC[0] += by_K;
    };
    feed(raw, days.log, 200.0, wrong);
    EXPECT_EQ(raw.estimate(0).value_mm, 0.0);
    EXPECT_FALSE(raw.estimate(0).stale);
    EXPECT_NEAR(raw.estimate(0).sigma_mm, model.channels[0].hold_sigma.sigma_mm({.age_s = 200.0}, {}), 1e-12);
    Predictor again(model, Readings::raw);
    feed(again, days.log, 5000.0, wrong);
    feed(judged, days.log, 5000.0, [](std::size_t row, std::vector<double>& degC) {
      if (row == 0) degC[0] = kNotRead;
    });
    EXPECT_EQ(again.estimate(0).value_mm, judged.estimate(0).value_mm) << by_K;
    EXPECT_EQ(again.estimate(0).sigma_mm, judged.estimate(0).sigma_mm) << by_K;
  }
}

// A stuck sensor counts as a silent one: in a log as a whole, and in the live loop once it is known.
TEST(ThermalPredictor, DoesWithoutAStuckSensor) {
  const SimulatedDays days = few_days();
  const ThermalModel model = fitted(days.log, Method::ridge, "dx");
  Log stuck = days.log, empty = days.log;
  stuck.runs.resize(2);
  empty.runs.resize(2);
  const std::size_t front = *days.log.sensor("spindle_front");
  auto& column = stuck.runs[1].temperature_degC[front];
  std::fill(column.begin(), column.end(), 22.0);
  auto& none = empty.runs[1].temperature_degC[front];
  std::fill(none.begin(), none.end(), kNotRead);
  const std::vector<SensorFault> faults = {
      {stuck.runs[1].id, "spindle_front", FaultKind::stuck, 0.0, 1e9, 1, {}}};
  const Log without = without_stuck(model, stuck, faults);
  const auto a = predict(model, without, 1, UseMeasurements::yes);
  const auto b = predict(model, empty, 1, UseMeasurements::yes);
  ASSERT_TRUE(a && b);
  for (std::size_t row = 0; row < a->time_s.size(); row += 10) {
    EXPECT_EQ(a->channel[0][row].value_mm, b->channel[0][row].value_mm);
    EXPECT_EQ(a->channel[0][row].sigma_mm, b->channel[0][row].sigma_mm);
    EXPECT_TRUE(a->channel[0][row].stale);
  }
  Predictor live(model, Readings::raw);
  feed(live, stuck, 1200.0, [](std::size_t, std::vector<double>&) {});
  EXPECT_FALSE(live.estimate(0).stale);
  Predictor later(model, Readings::raw);
  feed(later, stuck, 7200.0, [](std::size_t, std::vector<double>&) {});
  EXPECT_TRUE(later.estimate(0).stale);
  EXPECT_GE(later.estimate(0).sigma_mm, model.channels[0].hold_sigma.floor_mm);
}

// A sensor that jumps is silent until it is back; one that stops flickering stands, a quiet one may.
TEST(ThermalWatch, BelievesNoJumpAndNoStandstill) {
  SensorWatch watch({1.0, 1.0, 0.1});
  for (int i = 0; i < 800; ++i) {
    const double t = 10.0 * i;
    const bool away = i >= 20 && i < 60;
    const double flickers = i < 300 ? 21.0 + 0.1 * (i % 2) : 21.0;
    const auto out =
        watch.believed(t, std::vector<double>{20.0 + 0.01 * i + (away ? 9.0 : 0.0), flickers, 22.0});
    EXPECT_EQ(std::isnan(out[0]), away) << i;
    EXPECT_FALSE(watch.stuck(0) || watch.stuck(2)) << i;
    EXPECT_EQ(watch.stuck(1), t - 3000.0 >= 3600.0) << i;
  }
}

// Measurements of the wrong sign are no noise: told once, and sigma is no smaller than they are off.
TEST(ThermalPredictor, SaysWhereMeasurementsContradictIt) {
  const SimulatedDays days = few_days();
  ThermalModel model = fitted(days.log, Method::ridge, "dx");
  model.channels[0].candidate.anchor = Anchor::open;
  Log wrong = days.log;
  for (std::size_t row = 0; row < wrong.runs[1].rows(); ++row) {
    double& value = wrong.runs[1].channel_mm[*wrong.channel("dx")][row];
    if (!std::isnan(value)) value = -value;
  }
  const auto good = predict(model, days.log, 1, UseMeasurements::yes);
  const auto bad = predict(model, wrong, 1, UseMeasurements::yes);
  ASSERT_TRUE(good && bad);
  EXPECT_TRUE(good->warnings.empty()) << good->warnings.front();
  ASSERT_EQ(bad->warnings.size(), 1U);
  EXPECT_NE(bad->warnings[0].find(" um was predicted: sign or unit of the measurement, or a wrong sensor?"),
            std::string::npos);
  const double told_s = std::stod(bad->warnings[0].substr(3));
  for (std::size_t row = 0; row < bad->time_s.size(); ++row) {
    EXPECT_EQ(bad->channel[0][row].value_mm, good->channel[0][row].value_mm);
    if (bad->time_s[row] < told_s) continue;
    EXPECT_GT(bad->channel[0][row].sigma_mm, std::abs(days.drift_mm[1][row].x())) << bad->time_s[row];
  }
}

TEST(ThermalPredictor, SaysThatALogBeginsOnAWarmMachine) {
  const SimulatedDays days = few_days();
  const ThermalModel model = fitted(days.log, Method::ridge, "dx");
  Log late = days.log;
  auto& column = late.runs[1].channel_mm[*late.channel("dx")];
  for (double& value : column) value += 0.05;
  column[0] = 0.05;
  const auto prediction = predict(model, late, 1, UseMeasurements::yes);
  ASSERT_TRUE(prediction);
  ASSERT_EQ(prediction->warnings.size(), 1U);
  EXPECT_NE(prediction->warnings[0].find(" um: the offsets count from there"), std::string::npos);
}

// However far outside of its training, a model knows no less than who holds the last measurement.
TEST(ThermalPredictor, SigmaEndsAtWhatTheMachineMayDo) {
  const SimulatedDays days = few_days();
  const ThermalModel model = fitted(days.log, Method::ridge, "dx");
  Predictor predictor(model);
  const std::size_t n = predictor.sensors().size();
  ASSERT_TRUE(predictor.read(0.0, std::vector<double>(n, 20.0), 0.0, 0.0));
  std::vector<double> strange(n, 20.0);
  for (std::size_t i = 0; i < n; ++i) strange[i] = i % 2 == 0 ? 120.0 : -20.0;
  ASSERT_TRUE(predictor.read(1800.0, strange, 0.0, 0.0));
  const Estimate estimate = predictor.estimate(0);
  EXPECT_TRUE(estimate.outside_training());
  const double hold_mm = model.channels[0].hold_sigma.sigma_mm({.age_s = 1800.0}, {});
  EXPECT_LE(estimate.sigma_mm, std::max(hold_mm, model.channels[0].largest_mm + std::abs(estimate.value_mm)));
  EXPECT_GE(estimate.sigma_mm, hold_mm);
}

// An empty speed is unknown, not 0: the model that lags it widens at once and holds the last measurement
// when it knows too little; a model of temperatures alone does not care.
TEST(ThermalPredictor, WidensWhileTheSpeedItNeedsIsUnknown) {
  const SimulatedDays days = few_days();
  Log blank = days.log;
  for (std::size_t row = 0; row < blank.runs[0].rows(); ++row) {
    if (blank.runs[0].time_s[row] > 2000.0) {
      blank.runs[0].spindle_rpm[row] = std::nan("");
      blank.runs[0].feed_mm_s[row] = std::nan("");
    }
  }
  for (const Method method : {Method::lag, Method::ridge}) {
    ThermalModel model = fitted(days.log, method, "dx");
    model.channels[0].candidate.anchor = Anchor::update;
    const auto known = predict(model, days.log, 0, UseMeasurements::yes);
    const auto unknown = predict(model, blank, 0, UseMeasurements::yes);
    ASSERT_TRUE(known && unknown);
    for (std::size_t row = 0; row < known->time_s.size(); row += 10) {
      const Estimate& a = known->channel[0][row];
      const Estimate& b = unknown->channel[0][row];
      if (method == Method::ridge || known->time_s[row] < 2000.0) {
        EXPECT_EQ(a.value_mm, b.value_mm);
        EXPECT_EQ(a.sigma_mm, b.sigma_mm);
      } else if (known->time_s[row] > 2000.0 + kDriveHeld_s + 60.0) {
        EXPECT_GT(b.unknown_mm, 0.0);
        EXPECT_GT(b.sigma_mm, a.sigma_mm);
      }
    }
  }
}

// Of an hour without a measurement nobody knows but the model. Before: one sensor that fell silent took all
// offsets to zero at once, into a cut.
TEST(ThermalPredictor, HoldsWhatItSaidLastWhenASensorFallsSilent) {
  const SimulatedDays days = few_days();
  constexpr double kDies_s = 4000.0;
  for (const bool speed : {false, true}) {
    ThermalModel model = fitted(days.log, speed ? Method::lag : Method::ridge, "dx");
    model.channels[0].candidate.anchor = Anchor::open;
    Log dead = days.log;
    LogRun& run = dead.runs[1];
    for (std::size_t row = 0; row < run.rows(); ++row) {
      if (run.time_s[row] <= kDies_s) continue;
      if (speed)
        run.spindle_rpm[row] = std::nan("");
      else
        for (auto& column : run.temperature_degC) column[row] = std::nan("");
    }
    const auto prediction = predict(model, dead, 1, UseMeasurements::no);
    ASSERT_TRUE(prediction);
    const auto& said = prediction->channel[0];
    double largest = 0.0;
    for (std::size_t row = 1; row < said.size(); ++row)
      if (run.time_s[row] > kDies_s)
        largest = std::max(largest, std::abs(said[row].value_mm - said[row - 1].value_mm));
    EXPECT_GT(std::abs(said.back().value_mm), 5.0 * kMmPerUm) << speed;
    EXPECT_LT(largest, 1.0 * kMmPerUm) << speed;
    ASSERT_EQ(prediction->warnings.size(), 1U) << speed;
    EXPECT_NE(prediction->warnings[0].find("what was said last is held"), std::string::npos);
  }
}

// What an unknown speed may have done to its lag is the same lag of "unknown".
TEST(ThermalFeatures, AnUnknownSpeedIsNotZero) {
  FeatureSpec spec;
  spec.speed_taus_s = {600.0};
  spec.speed_powers = {1.0};
  FeatureState state(spec);
  const std::vector<double> none;
  const double unread = std::nan("");
  state.step({.time_s = 0.0, .temperature_degC = none, .spindle_rpm = unread});
  state.step({.time_s = 600.0, .temperature_degC = none, .spindle_rpm = 3000.0});
  EXPECT_NEAR(state.unknown()[0], 1.0 - std::exp(-1.0), 1e-12);  // never read so far
  state.step({.time_s = 1200.0, .temperature_degC = none, .spindle_rpm = unread});
  EXPECT_NEAR(state.unknown()[0], (1.0 - std::exp(-1.0)) * std::exp(-1.0), 1e-12);
  EXPECT_NEAR(state.values()[0], 3.0 * (1.0 - std::exp(-1.0)), 1e-12);
  const double before = state.unknown()[0];
  state.step({.time_s = 1800.0, .temperature_degC = none, .spindle_rpm = unread});  // read 600 s ago
  EXPECT_NEAR(state.unknown()[0], 1.0 - (1.0 - before) * std::exp(-1.0), 1e-12);
}

// The correction of a state far outside the training stops growing, and says so.
TEST(ThermalGuard, WeighsAModelDownOutsideItsTraining) {
  TrainingSet set;
  set.from = Eigen::MatrixXd::Zero(20, 2);
  set.to.resize(20, 2);
  set.change_mm = Eigen::VectorXd::Zero(20);
  for (int i = 0; i < 20; ++i) {
    set.to.row(i) << i * 0.5, i * 0.25;  // the two always move together
    set.group.push_back(static_cast<std::size_t>(i) / 5);
  }
  const Guard guard(set);
  EXPECT_LE(guard.distance(Eigen::Vector2d(9.0, 4.5)), 1.0);
  EXPECT_NEAR(guard.distance(Eigen::Vector2d(19.0, 9.5)), 2.0, 1e-9);
  EXPECT_GT(guard.distance(Eigen::Vector2d(5.0, -2.5)),
            Guard::kMargin);  // within each range, but never together
  EXPECT_EQ(Guard::trust(1.9), 1.0);
  EXPECT_NEAR(Guard::trust(8.0) * 8.0, Guard::trust(16.0) * 16.0, 1e-12);
}

TEST(ThermalFeatures, LagsFollowTheClosedForm) {
  FeatureSpec spec;
  spec.sensors = {"a"};
  spec.temperature_taus_s = {0.0, 900.0};
  spec.speed_taus_s = {600.0};
  spec.speed_powers = {2.0};
  FeatureState state(spec);
  const double cold = 20.0;
  const double warm = 30.0;
  state.step({.time_s = 0.0, .temperature_degC = {&cold, 1}, .spindle_rpm = 2000.0});
  state.step({.time_s = 0.0, .temperature_degC = {&warm, 1}, .spindle_rpm = 2000.0});
  state.step({.time_s = 300.0, .temperature_degC = {&warm, 1}, .spindle_rpm = 0.0});
  EXPECT_NEAR(state.values()[0], 30.0, 1e-12);
  EXPECT_NEAR(state.values()[1], 30.0 - 10.0 * std::exp(-300.0 / 900.0), 1e-12);
  EXPECT_NEAR(state.values()[2], 4.0 * (1.0 - std::exp(-0.5)), 1e-12);
  state.step({.time_s = 900.0, .temperature_degC = {&warm, 1}, .spindle_rpm = 0.0});
  EXPECT_NEAR(state.values()[2], 4.0 * (1.0 - std::exp(-0.5)) * std::exp(-1.0), 1e-12);
}

// A sine behind the lag of 120 s has w tau / sqrt(1 + (w tau)^2) of its amplitude left, its mean square is
// half of the square of that; what only rises does not swing.
TEST(ThermalFeatures, OnlyWhatGoesUpAndDownSwings) {
  FeatureSpec spec;
  spec.sensors = {"still", "swinging"};
  spec.temperature_taus_s = {0.0};
  FeatureState swinging(spec);
  FeatureState rising(spec);
  const double amplitude_K = 2.0;
  const double w = 2.0 * std::acos(-1.0) / 200.0;
  double mean_K2 = 0.0;
  for (int i = 0; i < 8000; ++i) {
    const std::vector<double> sine = {20.0, 25.0 + amplitude_K * std::sin(w * i)};
    const std::vector<double> warm = {20.0, 25.0 + 15.0 * (1.0 - std::exp(-i / 300.0))};
    swinging.step({.time_s = 1.0 * i, .temperature_degC = sine});
    rising.step({.time_s = 1.0 * i, .temperature_degC = warm});
    EXPECT_LT(rising.swing_K(), 1e-9) << i;
    if (i >= 6000) mean_K2 += std::pow(swinging.swing_K(), 2) / 2000.0;
  }
  const double left = w * 120.0 / std::sqrt(1.0 + std::pow(w * 120.0, 2));
  EXPECT_NEAR(std::sqrt(mean_K2), amplitude_K * left / std::sqrt(2.0), 0.02 * amplitude_K);
}

TEST(ThermalFeatures, TheMedianDoesNotSeeAnOpenDoor) {
  FeatureSpec spec;
  spec.sensors = {"a"};
  spec.temperature_taus_s = {0.0};
  spec.median_s = 300.0;
  FeatureState state(spec);
  for (int i = 0; i < 200; ++i) {
    const double t = 10.0 * i;
    const double value = t >= 1000.0 && t < 1120.0 ? 18.0 : 25.0;
    state.step({.time_s = t, .temperature_degC = {&value, 1}});
    EXPECT_EQ(state.values()[0], 25.0) << t;
  }
}

}  // namespace
}  // namespace trunnion::thermal
