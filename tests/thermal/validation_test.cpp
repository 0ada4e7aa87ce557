#include "trunnion/thermal/validation.hpp"

#include <gtest/gtest.h>
#include <string>
#include <utility>
#include <vector>

#include "trunnion/thermal/simulate.hpp"

namespace trunnion::thermal {
namespace {

// Eight days; what was measured on the fourth is `factor` times too large.
ChannelReport report_with_a_wrong_day(int seed, double factor) {
  ImpellerDays days;
  days.impellers = 8;
  days.step_s = 10.0;
  days.day_seed = static_cast<decltype(days.day_seed)>(seed);
  Log log = simulate(days).log;
  for (double& value : log.runs[3].channel_mm[*log.channel("dx")]) value *= factor;
  FitOptions options;
  options.targets = {"dx"};
  Diagnostics diagnostics;
  auto fit = fit_thermal(log, options, diagnostics);
  EXPECT_TRUE(fit);
  EXPECT_EQ(fit->model.channels[0].candidate.name(), fit->channels[0].chosen);
  return std::move(fit->channels[0]);
}

std::string all_of(const std::vector<std::string>& lines) {
  std::string out;
  for (const auto& line : lines) out += line + "\n";
  return out;
}

TEST(LongThermalValidation, NamesTheDayThatTheOthersDoNotExplain) {
  const ChannelReport wrong = report_with_a_wrong_day(100, 0.001);  // mm for um
  const std::string told = all_of(wrong.warnings);
  EXPECT_NE(told.find("run '" + wrong.runs[3] + "': 0 % of its readings"), std::string::npos) << told;
  const ChannelReport good = report_with_a_wrong_day(100, 1.0);
  EXPECT_TRUE(good.warnings.empty()) << all_of(good.warnings);
}

// A day of the other sign spoils every method; what is chosen is no worse than holding the last measurement.
TEST(LongThermalValidation, TakesNoMethodThatDoesNotHelp) {
  const ChannelReport wrong = report_with_a_wrong_day(1, -1.0);
  EXPECT_EQ(wrong.chosen, "hold_last");
  EXPECT_FALSE(wrong.nested);
  EXPECT_NE(all_of(wrong.warnings).find("no method helps"), std::string::npos) << all_of(wrong.warnings);
}

}  // namespace
}  // namespace trunnion::thermal
