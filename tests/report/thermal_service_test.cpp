#include "trunnion/report/thermal_service.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trunnion/thermal/simulate.hpp"
#include "trunnion/thermal/validation.hpp"

namespace trunnion::report {
namespace {

using nlohmann::json;

const thermal::ThermalModel& model() {
  static const thermal::ThermalModel fitted = [] {
    thermal::ImpellerDays days;
    days.impellers = 4;
    days.step_s = 10.0;
    thermal::FitOptions options;
    options.method = thermal::Method::ridge;
    options.targets = {"dx", "dy"};
    Diagnostics diagnostics;
    auto result = thermal::fit_thermal(thermal::simulate(days).log, options, diagnostics);
    for (auto& channel : result->model.channels) channel.candidate.anchor = thermal::Anchor::update;
    return result->model;
  }();
  return fitted;
}

std::string reading(double time_s, double degC) {
  json out;
  out["time_s"] = time_s;
  for (const char* name :
       {"spindle_front", "spindle_rear", "head", "column", "a_bearing", "c_bearing", "bed", "ambient"})
    out["T_degC"][name] = degC;
  return out.dump();
}

TEST(ThermalService, AnswersReadingsAndMeasurementsWithACorrection) {
  ThermalService service(model(), {});
  EXPECT_TRUE(json::parse(service.handle(reading(0.0, 20.0)))["ok"]);
  service.handle(reading(1800.0, 20.0));
  const auto measured =
      json::parse(service.handle(R"({"time_s": 1801, "measured_um": {"dx": 12.0, "dy": -4.0}})"));
  EXPECT_NEAR(measured["deviation_um"]["dx"], 12.0, 1e-9);
  // One second under the slew limit of 1 um/s.
  EXPECT_NEAR(measured["correction_um"]["dx"], -1.0, 1e-6);
  service.handle(reading(1900.0, 20.0));
  const auto answer = json::parse(service.handle(R"({"query": "offset"})"));
  EXPECT_NEAR(answer["correction_um"]["dx"], -12.0, 0.6);
  EXPECT_NEAR(answer["correction_um"]["dy"], 4.0, 0.6);
  EXPECT_GT(answer["sigma_um"], 0.0);
  EXPECT_EQ(service.readings(), 4U);
}

TEST(ThermalService, SpeaksXml) {
  ThermalService service(model(), {});
  EXPECT_EQ(service.handle("<reading time_s=\"0\" spindle_rpm=\"0\"><T name=\"head\">20</T></reading>")
                .rfind("<offset ", 0),
            0U);
  EXPECT_EQ(service.handle("<query/>").rfind("<offset ", 0), 0U);
  EXPECT_EQ(service.handle("<reading time_s=\"x\"/>"), "<error>'time_s' is no number: 'x'</error>");
  EXPECT_EQ(service.handle("<reading").rfind("<error>this is no XML", 0), 0U);
  EXPECT_EQ(service.readings(), 1U);
}

TEST(ThermalService, SurvivesBadInput) {
  ThermalService service(model(), {});
  service.handle(reading(0.0, 20.0));
  const std::string before = service.handle(R"({"query": 1})");
  for (const std::string line :
       {"", "{", "[]", "{}", "null", "\xff\xfe", R"({"time_s": "x"})", R"({"time_s": 1e999, "T_degC": {}})",
        R"({"time_s": 5, "T_degC": 3})", R"({"T_degC": {"head": 20}})", R"({"time_s": -5})",
        R"({"time_s": 5, "measured_um": {"nonsense": 1}})", R"({"colour": 1})", "<a><b></a>", "<x/>",
        "<reading time_s=\"1\"><um>3</um></reading>"}) {
    const std::string answer = service.handle(line);
    EXPECT_TRUE(answer.find("\"ok\":false") != std::string::npos || answer.rfind("<error>", 0) == 0)
        << line << " -> " << answer;
    EXPECT_FALSE(service.changed());
  }
  EXPECT_EQ(service.handle(R"({"query": 1})"), before);
}

TEST(ThermalService, LeavesOutASensorThatCannotBeTrue) {
  ThermalService service(model(), {});
  service.handle(reading(0.0, 20.0));
  const auto answer = json::parse(service.handle(R"({"time_s": 10, "T_degC": {"head": 850, "bed": 20}})"));
  EXPECT_TRUE(answer["ok"]);
  EXPECT_EQ(answer["rejected"], json::array({"head"}));
}

TEST(ThermalService, SwitchesOffAndBeginsAnew) {
  ThermalService service(model(), {});
  service.handle(reading(0.0, 20.0));
  service.handle(R"({"time_s": 1800, "measured_um": {"dx": 12.0}})");
  EXPECT_EQ(json::parse(service.handle(R"({"enabled": false})"))["correction_um"]["dx"], 0.0);
  EXPECT_EQ(json::parse(service.handle(reading(3600.0, 20.0)))["correction_um"]["dx"], 0.0);
  service.handle(R"({"enabled": true})");
  service.handle(R"({"run": "start"})");
  EXPECT_TRUE(json::parse(service.handle(reading(0.0, 20.0)))["ok"]);  // time begins again
}

// The same lines give the same state: that is how the service restarts from its journal.
TEST(ThermalService, ReplayGivesTheSameState) {
  std::vector<std::string> lines = {reading(0.0, 20.0), reading(60.0, 21.0),
                                    R"({"time_s": 1800, "measured_um": {"dx": 12.0}})", reading(1900.0, 24.0),
                                    reading(2000.0, 24.5)};
  ThermalService first(model(), {}), second(model(), {});
  for (const auto& line : lines) first.handle(line);
  for (const auto& line : lines) second.handle(line);
  EXPECT_EQ(first.handle(R"({"query": 1})"), second.handle(R"({"query": 1})"));
}

}  // namespace
}  // namespace trunnion::report
