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

// Millimetres for micrometres: the machine follows nothing of it, and the answer says so.
TEST(ThermalService, RejectsAMeasurementBeyondAllReason) {
  ThermalService service(model(), {});
  service.handle(reading(0.0, 20.0));
  service.handle(R"({"time_s": 1, "measured_um": {"dx": 0.0, "dy": 0.0}})");
  service.handle(reading(1800.0, 20.0));
  const auto wrong =
      json::parse(service.handle(R"({"time_s": 1801, "measured_um": {"dx": -7000.0, "dy": 2.0}})"));
  EXPECT_TRUE(wrong["ok"]);
  EXPECT_NEAR(wrong["deviation_um"]["dx"], 0.0, 0.1);
  EXPECT_NEAR(wrong["deviation_um"]["dy"], 2.0, 1e-9);
  EXPECT_EQ(wrong["rejected"], json::array({"dx"}));
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

// One line with the seconds of the calendar shut out all that followed, and "stale" stayed false.
TEST(ThermalService, RefusesAJumpAheadAndGoesOn) {
  ThermalService service(model(), {});
  service.handle(reading(0.0, 20.0));
  for (const double time_s : {1e19, 1.7e9, 86401.0}) {
    const auto answer = json::parse(service.handle(reading(time_s, 20.0)));
    EXPECT_FALSE(answer["ok"]) << time_s;
    EXPECT_FALSE(service.changed());
  }
  EXPECT_NE(
      service.handle(reading(1.7e9, 20.0)).find("jumps ahead to 1.7e+09 s; the last reading was at 0 s"),
      std::string::npos);
  EXPECT_TRUE(json::parse(service.handle(reading(86400.0, 20.0)))["ok"]);
  EXPECT_FALSE(json::parse(service.handle(reading(86339.0, 20.0)))["ok"]);
  // A new run may begin at any time, in the same line too.
  EXPECT_TRUE(
      json::parse(service.handle(R"({"run": "start", "time_s": 1.7e9, "T_degC": {"head": 20}})"))["ok"]);
}

TEST(ThermalService, SaysStaleWhenNoReadingIsAcceptedForLong) {
  ThermalService service(model(), {});
  service.handle(reading(1.7e9, 20.0), 0.0);  // the clock of another logger: all others are refused
  EXPECT_FALSE(json::parse(service.handle(reading(10.0, 20.0), 10.0))["ok"]);
  EXPECT_FALSE(json::parse(service.handle(R"({"query": 1})", 900.0))["stale"]);
  EXPECT_TRUE(json::parse(service.handle(R"({"query": 1})", 901.0))["stale"]);
  EXPECT_NE(service.handle("<query/>", 901.0).find("stale=\"1\""), std::string::npos);
  service.handle(R"({"run": "start"})", 902.0);
  EXPECT_FALSE(json::parse(service.handle(reading(20.0, 20.0), 903.0))["stale"]);
}

TEST(ThermalService, AFaultyLineChangesNothingWhateverElseItSays) {
  ThermalService service(model(), {});
  service.handle(reading(0.0, 20.0));
  const std::string before = service.handle(R"({"query": 1})");
  for (const std::string line :
       {R"({"enabled": false, "time_s": -1})", R"({"run": "start", "time_s": -1})",
        R"({"run": "start", "T_degC": {"head": 20}})", R"({"time_s": 5, "spindle_rpm": 1e300})",
        R"({"time_s": 5, "feed_mm_min": 1e9})", R"({"time_s": 5, "measured_um": {"dx": 1e12}})",
        R"({"time_s": 5, "T_degC": {"head": 1e18}})"}) {
    EXPECT_FALSE(json::parse(service.handle(line))["ok"]) << line;
    EXPECT_FALSE(service.changed()) << line;
  }
  EXPECT_EQ(service.handle(R"({"query": 1})"), before);
}

// Neither the median nor the record of measurements grows with what a client sends.
TEST(ThermalService, CostsTheSameAfterManyReadingsOfOneMoment) {
  ThermalService service(model(), {});
  for (int i = 0; i < 30000; ++i)
    service.handle(R"({"time_s": 1, "T_degC": {"head": 20, "bed": 20}, "measured_um": {"dx": 1}})");
  EXPECT_EQ(service.readings(), 30000U);
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
