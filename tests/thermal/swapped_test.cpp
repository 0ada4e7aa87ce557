#include "trunnion/thermal/swapped.hpp"

#include <gtest/gtest.h>
#include <set>
#include <string>
#include <utility>

#include "trunnion/thermal/simulate.hpp"
#include "trunnion/thermal/validation.hpp"

namespace trunnion::thermal {
namespace {

std::size_t place(const Log& log, const std::string& sensor) {
  return *log.sensor(sensor);
}

// A model of four days, and four other days with the plugs as they belong and with two of them exchanged.
TEST(LongSwapped, NamesThePairAndNothingWhereThereIsNone) {
  ImpellerDays days;
  days.impellers = 4;
  days.step_s = 10.0;
  FitOptions options;
  options.method = Method::ridge;
  options.targets = {"dx"};
  Diagnostics diagnostics;
  const auto fitted = fit_thermal(simulate(days).log, options, diagnostics);
  ASSERT_TRUE(fitted);
  days.day_seed += 100;
  const Log good = simulate(days).log;
  for (const LogRun& run : good.runs) EXPECT_FALSE(find_swapped(fitted->model, good, run)) << run.id;
  for (const auto& [one, other] : {std::pair<std::string, std::string>{"spindle_front", "bed"},
                                   {"ambient", "spindle_rear"},
                                   {"head", "bed"}}) {
    Log wrong = good;
    for (LogRun& run : wrong.runs) {
      std::swap(run.temperature_degC[place(wrong, one)], run.temperature_degC[place(wrong, other)]);
      const auto found = find_swapped(fitted->model, wrong, run);
      ASSERT_TRUE(found) << one << " " << other << " " << run.id;
      EXPECT_EQ((std::set<std::string>{found->one, found->other}), (std::set<std::string>{one, other}));
      EXPECT_LT(found->exchanged, 0.5 * found->distance);
    }
  }
}

}  // namespace
}  // namespace trunnion::thermal
