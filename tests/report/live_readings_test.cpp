#include "trunnion/report/live_readings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace trunnion::report {
namespace {

using nlohmann::json;
using testing::HasSubstr;

thermal::ThermalModel two_sensors() {
  thermal::ThermalModel model;
  model.channels.resize(1);
  model.channels[0].channel = "dz";
  model.channels[0].features.sensors = {"front", "head"};
  return model;
}

LiveReadings readings(const std::vector<std::string>& items = {}) {
  return *LiveReadings::create(two_sensors(), items);
}

json message(LiveReadings& live, const std::string& topic, const std::string& payload, double now_s = 5.0) {
  const auto line = live.of_message(topic, payload, now_s);
  if (!line) return "error: " + line.error().message;
  return line->empty() ? json() : json::parse(*line);
}

json shdr(LiveReadings& live, const std::string& text, double now_s) {
  const auto line = live.of_shdr("a", *parse_shdr_line(text), now_s);
  if (!line) return "error: " + line.error().message;
  return line->empty() ? json() : json::parse(*line);
}

// What mqtt-publisher sends: pins by their names, and what a shop's other publishers send.
TEST(LiveReadings, TakesItemsOfMessages) {
  LiveReadings live =
      readings({"front=hal.temp-1", "spindle_rpm=spindle.0.speed-out-rps*60", "dz=probe.dz-mm*1000"});
  EXPECT_EQ(message(live, "devices/mill",
                    R"({"hal.temp-1": 21.5, "spindle.0.speed-out-rps": 100.0, "probe.dz-mm": 0.0125,
                        "mqtt-publisher.period": 10})"),
            json::parse(R"({"time_s": 5.0, "T_degC": {"front": 21.5}, "measured_um": {"dz": 12.5},
                            "spindle_rpm": 6000.0})"));
  EXPECT_EQ(message(live, "shop/mill/head", "22.25"),
            json::parse(R"({"time_s": 5.0, "T_degC": {"head": 22.25}})"));
  EXPECT_EQ(message(live, "shop/overhead", "22.25"), json());  // another item
  EXPECT_EQ(message(live, "lamp", "on"), json());
  // Its own protocol, published.
  EXPECT_EQ(message(live, "x", R"({"time_s": 77, "T_degC": {"head": "23"}, "feed_mm_min": 900})"),
            json::parse(R"({"time_s": 5.0, "T_degC": {"head": 23.0}, "feed_mm_min": 900.0})"));
}

TEST(LiveReadings, LeavesOutWhatIsFaulty) {
  LiveReadings live = readings();
  EXPECT_THAT(message(live, "x", R"({"head": "warm"})").get<std::string>(),
              HasSubstr("'x/head' is no number: 'warm'"));
  EXPECT_THAT(message(live, "shop/head", "22,5").get<std::string>(), HasSubstr("is no number"));
  EXPECT_THAT(message(live, "x", R"({"head": 22.5)").get<std::string>(), HasSubstr("no JSON"));
  EXPECT_THAT(message(live, "x", R"({"head": [1, 2]})").get<std::string>(), HasSubstr("is no number"));
  // Python's NaN is no JSON: that value is not read, the others are. A null says that the source lives.
  EXPECT_EQ(message(live, "x", R"({"head": NaN, "front": 20.5, "note": "NaN \" Infinity"})"),
            json::parse(R"({"time_s": 5.0, "T_degC": {"front": 20.5, "head": null}})"));
  EXPECT_EQ(message(live, "shop/head", "NaN"), json::parse(R"({"time_s": 5.0, "T_degC": {"head": null}})"));
}

TEST(LiveReadings, AMeasurementIsOneWhenItDiffers) {
  LiveReadings live = readings();
  EXPECT_TRUE(message(live, "x", R"({"dz": 3.5, "head": 20})").contains("measured_um"));
  EXPECT_FALSE(message(live, "x", R"({"dz": 3.5, "head": 20})").contains("measured_um"));
  EXPECT_FALSE(message(live, "x", R"({"dz": NaN, "head": 20})").contains("measured_um"));
  EXPECT_TRUE(message(live, "x", R"({"dz": 3.6, "head": 20})").contains("measured_um"));
}

TEST(LiveReadings, TimeIsTheArrivalUnlessItHasAnItem) {
  LiveReadings live = readings();
  live.set_clock(1000.0, 2.0);
  EXPECT_EQ(message(live, "x", R"({"head": 20, "time_s": 3})")["time_s"], 1003.0);
  LiveReadings timed = readings({"time_s=clock"});
  EXPECT_EQ(message(timed, "x", R"({"head": 20})"), json());  // none was said yet
  EXPECT_EQ(message(timed, "x", R"({"head": 20, "clock": 7})")["time_s"], 7.0);
  EXPECT_EQ(message(timed, "x", R"({"head": 20})")["time_s"], 7.0);
  EXPECT_EQ(message(timed, "x", R"({"clock": 8})"), json());  // no reading by itself
}

// Adapters send what has changed.
TEST(LiveReadings, ValuesOfAnAdapterHold) {
  LiveReadings live = readings();
  EXPECT_EQ(shdr(live, "2009-06-15T00:00:00|mill:front|21.3|dz|4|power|ON", 1.0),
            json::parse(R"({"time_s": 1.0, "T_degC": {"front": 21.3}, "measured_um": {"dz": 4.0}})"));
  EXPECT_EQ(shdr(live, "2009-06-15T00:00:01|head|20", 2.0),
            json::parse(R"({"time_s": 2.0, "T_degC": {"front": 21.3, "head": 20.0}})"));
  EXPECT_EQ(shdr(live, "2009-06-15T00:00:01|power|OFF", 3.0), json());
  EXPECT_EQ(shdr(live, "* PONG 10000", 12.0),
            json::parse(R"({"time_s": 12.0, "T_degC": {"front": 21.3, "head": 20.0}})"));
  EXPECT_EQ(shdr(live, "|front|UNAVAILABLE", 13.0),
            json::parse(R"({"time_s": 13.0, "T_degC": {"front": null, "head": 20.0}})"));
  EXPECT_THAT(shdr(live, "|front|warm", 14.0).get<std::string>(), HasSubstr("no number"));
  live.forget("a");
  EXPECT_EQ(shdr(live, "|head|21", 15.0), json::parse(R"({"time_s": 15.0, "T_degC": {"head": 21.0}})"));
}

TEST(LiveReadings, RefusesItemsThatTheModelDoesNotTake) {
  for (const char* text : {"nothing=x", "front", "front=", "front=x*0", "front=x*y"}) {
    const auto live = LiveReadings::create(two_sensors(), {text});
    ASSERT_FALSE(live) << text;
    EXPECT_EQ(live.error().code, ErrorCode::wrong_use);
  }
  EXPECT_THAT(LiveReadings::create(two_sensors(), {"nothing=x"}).error().message,
              HasSubstr("front, head, spindle_rpm, feed_mm_min, dz, time_s"));
}

}  // namespace
}  // namespace trunnion::report
