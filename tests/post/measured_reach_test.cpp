// A model is said to be used beyond where it was measured: once, with numbers, of cuts only.
#include <cstdio>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

using testing::HasSubstr;
using testing::Not;

// Cuts 200 mm along X and 60 mm along Z; the rapids go 100 mm higher.
const std::string kCut =
    "PARTNO TEST\nMULTAX/ON\nFEDRAT/MMPM,1200\nRAPID\nGOTO/-100,0,160,0,0,1\nGOTO/-100,0,60\n"
    "GOTO/100,0,60\nGOTO/100,0,0\nGOTO/0,0,0\nRAPID\nGOTO/0,0,160\nFINI\n";

Model measured(const Machine& machine, const std::string& valid) {
  Diagnostics d;
  auto out = parse_model("[model]\nname = \"m\"\n" + valid +
                             "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 8\n",
                         "m.toml", machine, {}, d);
  if (!out) throw std::runtime_error(out.error().text());
  return *out;
}

class MeasuredReach : public testing::Test {
 protected:
  MeasuredReach() : machine_(test::shipped_machine("trunnion_offset")) {}

  // Of a program that is compensated with a model of these ranges: what is said of them.
  std::vector<std::string> said(const std::string& valid) {
    const Model model = measured(machine_, valid);
    const auto p = test::posted(kCut, machine_, {}, "linuxcnc", &model);
    if (!p.report) throw std::runtime_error(p.report.error().text());
    travel_ = p.report->verification->travel;
    std::vector<std::string> out;
    for (const Finding& f : p.diagnostics.findings())
      if (f.message.find("not measured") != std::string::npos) out.push_back(f.file + ": " + f.message);
    return out;
  }
  // As the verification has it, which reads the words of the program.
  const AxisTravel& travel(const std::string& axis) const {
    return *std::find_if(travel_.begin(), travel_.end(),
                         [&](const AxisTravel& t) { return t.axis.name == axis; });
  }
  static std::string range(const std::string& key, double low, double high) {
    return key + " = [" + fixed_text(low, 3) + ", " + fixed_text(high, 3) + "]\n";
  }

  Machine machine_;
  std::vector<AxisTravel> travel_;
};

TEST_F(MeasuredReach, IsSaidOnceWithNumbers) {
  const auto words = said("[model.valid]\nX_mm = [-40, 40]\nC_deg = [0, 360]\n");
  ASSERT_EQ(words.size(), 1U);
  double low = 0.0, high = 0.0;
  ASSERT_EQ(
      std::sscanf(
          words[0].c_str(),
          "m.toml: the program cuts where the model was not measured: X %lf to %lf mm (measured: -40 to 40)",
          &low, &high),
      2)
      << words[0];
  EXPECT_THAT(words[0], HasSubstr("(measured: -40 to 40)"));
  // The correction moves the axis by 8 um.
  EXPECT_NEAR(low, travel("X").smallest, 0.02);
  EXPECT_NEAR(high, travel("X").largest, 0.02);
  EXPECT_NEAR(high - low, 200.0, 0.02);
}

TEST_F(MeasuredReach, NotWhereTheReadingsWere) {
  EXPECT_TRUE(said("").empty());
  const double x_low = travel("X").smallest, x_high = travel("X").largest, top = travel("Z").largest;
  // The cuts end 100 mm below the rapids: on this machine Z carries the tool.
  EXPECT_TRUE(said("[model.valid]\n" + range("X_mm", x_low, x_high) + range("Z_mm", top - 160.0, top - 100.0))
                  .empty());
  const auto words =
      said("[model.valid]\n" + range("X_mm", x_low, x_high) + range("Z_mm", top - 160.0, top - 120.0));
  ASSERT_EQ(words.size(), 1U);
  EXPECT_THAT(words[0], HasSubstr(" Z "));
  EXPECT_THAT(words[0], Not(HasSubstr(" X ")));
}

TEST_F(MeasuredReach, OfTemperaturesWhileItRuns) {
  EffectContext context;
  context.names.temperatures = {"room"};
  Diagnostics d;
  const auto model = parse_model(
      "[model]\nname = \"m\"\n[model.valid]\nT_room_degC = [20, 23]\n[[effect]]\nid = \"location:C\"\n"
      "[effect.parameters]\nX0C_um = 8\n",
      "m.toml", machine_, context, d);
  ASSERT_TRUE(model) << model.error().text();
  const auto said_at = [&](std::vector<std::vector<double>> kelvin) {
    TemperatureHistory history;
    history.time_s = {0.0, 5.0, 1e6};  // the last row is long after the program
    history.temperature_K = std::move(kelvin);
    const nc::Controller c = with_axes_of(machine_, test::shipped_controller("linuxcnc"));
    PostJob job;
    job.cl_file = "part.cls";
    job.machine = &machine_;
    job.controller = &c;
    job.model = &*model;
    job.temperatures = &history;
    PostOptions options;
    options.tools = test::with_some_tool({}, kCut, machine_);
    Diagnostics all;
    const auto report = post(
        std::make_unique<test::TextOf>(kCut), job, options, [](std::string_view) { return Result<void>{}; },
        all);
    if (!report) throw std::runtime_error(report.error().text());
    std::string out;
    for (const Finding& f : all.findings())
      if (f.message.find("not measured") != std::string::npos) out += f.message;
    return out;
  };
  EXPECT_EQ(said_at({{1.0}, {2.0}, {30.0}}), "");
  EXPECT_THAT(said_at({{1.0}, {7.5}, {1.0}}), HasSubstr("T_room 21 to 27.5 degC (measured: 20 to 23)"));
  // What held when it began counts.
  EXPECT_THAT(said_at({{-4.0}, {2.0}, {1.0}}), HasSubstr("T_room 16 to 22 degC (measured: 20 to 23)"));
}

TEST_F(MeasuredReach, AlsoOfALogThatEndsBeforeTheProgram) {
  const auto said_of = [&](std::vector<double> time_s) {
    const Model model = measured(machine_, "");
    TemperatureHistory history;
    history.time_s = std::move(time_s);
    history.temperature_K.assign(history.time_s.size(), {});
    const auto p = test::posted(kCut, machine_, {}, "linuxcnc", &model, &history);
    if (!p.report) throw std::runtime_error(p.report.error().text());
    std::vector<std::string> out;
    for (const Finding& f : p.diagnostics.findings())
      if (f.message.find("of the log cover") != std::string::npos) out.push_back(f.message);
    return out;
  };
  EXPECT_TRUE(said_of({0.0, 3600.0}).empty());
  EXPECT_TRUE(said_of({0.0}).empty());  // always the same
  const auto of_epoch = said_of({1.7e9, 1.7e9 + 3600.0});
  ASSERT_EQ(of_epoch.size(), 1U);
  EXPECT_THAT(of_epoch[0], HasSubstr("cover 1700000000 to 1700003600 s, the program runs from 0 to"));
  EXPECT_EQ(said_of({0.0, 5.0}).size(), 1U);
}

}  // namespace
}  // namespace trunnion::post
