#include "trunnion/effects/measured_range.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/base/units.hpp"
#include "trunnion/effects/model.hpp"

#include "support/effect_cases.hpp"

// Where a model was measured, and what is said of what lies beyond.
namespace trunnion {
namespace {

using testing::HasSubstr;

class MeasuredRangeTest : public testing::Test {
 protected:
  MeasuredRangeTest() : machine_(test::effect_machine("trunnion_offset")) {}

  // Of states at these positions of C (deg); the other axes stand.
  MeasuredRange of_c(const std::vector<double>& deg) const {
    const AxisId c = machine_.axes.size() - 1;
    const auto ranges = ranges_of(machine_, {}, deg.size(), [&](std::size_t i) {
      MachineState s;
      s.q[c] = deg[i] / kDegreePerRad;
      return s;
    });
    return ranges.at(c);
  }

  Machine machine_;
};

TEST_F(MeasuredRangeTest, OfAxesAndTemperatures) {
  StateNames names;
  names.temperatures = {"room"};
  const std::vector<double> x = {-100.0, 250.5, 3.0}, room = {0.5, -1.25, 2.0};
  std::vector<std::array<double, 1>> kelvin;
  for (const double k : room) kelvin.push_back({k});
  const auto ranges = ranges_of(machine_, names, x.size(), [&](std::size_t i) {
    MachineState s;
    s.q[0] = x[i];
    s.temperature_K = kelvin[i];
    return s;
  });
  ASSERT_EQ(ranges.size(), machine_.axes.size() + 1);
  EXPECT_EQ(ranges[0].key, "X_mm");
  EXPECT_EQ(ranges[0].low, -100.0);
  EXPECT_EQ(ranges[0].high, 250.5);
  EXPECT_EQ(ranges.back().key, "T_room_degC");
  EXPECT_NEAR(ranges.back().low, machine_.reference_degC - 1.25, 1e-9);
  EXPECT_NEAR(ranges.back().high, machine_.reference_degC + 2.0, 1e-9);
  EXPECT_TRUE(ranges_of(machine_, names, 0, nullptr).empty());
}

// Steps of 50, 70 and 90 deg with 50 deg left to the whole turn: nowhere is the axis farther from a reading
// than between two of them.
TEST_F(MeasuredRangeTest, OfAnAxisThatWasReadAllRound) {
  const MeasuredRange round = of_c({0, 50, 100, 170, 240, 310});
  EXPECT_EQ(round.key, "C_deg");
  EXPECT_NEAR(round.low, 0.0, 1e-9);
  EXPECT_NEAR(round.high, 360.0, 1e-9);
  const MeasuredRange also = of_c({-170, -80, 10, 100});
  EXPECT_NEAR(also.low, -170.0, 1e-9);
  EXPECT_NEAR(also.high, 190.0, 1e-9);
  const MeasuredRange part = of_c({0, 30, 60, 90});
  EXPECT_NEAR(part.low, 0.0, 1e-9);
  EXPECT_NEAR(part.high, 90.0, 1e-9);
  EXPECT_NEAR(of_c({0, 180}).high, 180.0, 1e-9);  // two positions are not all round
}

TEST(BeyondMeasured, SaysBothWithNumbers) {
  const MeasuredRanges measured = {
      {"X_mm", -250.0, 250.0}, {"Z_mm", 100.0, 100.0}, {"C_deg", 0.0, 90.0}, {"T_room_degC", 20.0, 24.0}};
  EXPECT_EQ(beyond_measured(measured, {{"X_mm", -310.0, 249.0}}), "X -310 to 249 mm (measured: -250 to 250)");
  EXPECT_EQ(beyond_measured(measured, {{"Z_mm", 20.0, 40.5}, {"T_room_degC", 19.0, 21.004}}),
            "Z 20 to 40.5 mm (measured: 100), T_room 19 to 21 degC (measured: 20 to 24)");
  // A hundredth of the measured range beyond is none; nor is what nobody measured, or nobody uses.
  EXPECT_EQ(beyond_measured(measured, {{"X_mm", -255.0, 255.0}, {"Y_mm", -900.0, 900.0}}), "");
  EXPECT_NE(beyond_measured(measured, {{"X_mm", -255.1, 0.0}}), "");
  EXPECT_EQ(beyond_measured({}, {{"X_mm", -310.0, 250.0}}), "");
}

TEST(BeyondMeasured, ATurnFurtherIsTheSamePlace) {
  const MeasuredRanges part = {{"C_deg", 0.0, 90.0}}, round = {{"C_deg", -170.0, 190.0}};
  EXPECT_EQ(beyond_measured(part, {{"C_deg", 370.0, 440.0}}), "");
  EXPECT_EQ(beyond_measured(part, {{"C_deg", -360.0, -270.0}}), "");
  EXPECT_EQ(beyond_measured(part, {{"C_deg", -20.0, 10.0}}), "C -20 to 10 deg (measured: 0 to 90)");
  EXPECT_EQ(beyond_measured(part, {{"C_deg", 80.0, 380.0}}), "C 80 to 380 deg (measured: 0 to 90)");
  EXPECT_EQ(beyond_measured(round, {{"C_deg", -2000.0, 2000.0}}), "");
}

TEST(MeasuredRanges, OfTwoCampaignsAreJoined) {
  const MeasuredRanges both =
      joined({{"X_mm", -10.0, 20.0}, {"Y_mm", 0.0, 1.0}}, {{"X_mm", 0.0, 30.0}, {"T_room_degC", 20.0, 25.0}});
  ASSERT_EQ(both.size(), 3U);
  EXPECT_EQ(both[0].low, -10.0);
  EXPECT_EQ(both[0].high, 30.0);
  EXPECT_EQ(both[1].high, 1.0);
  EXPECT_EQ(both[2].key, "T_room_degC");
}

class ModelValid : public testing::Test {
 protected:
  Result<Model> read(const std::string& lines) {
    diagnostics_ = {};
    return parse_model("[model]\nname = \"m\"\n[model.valid]\n" + lines, "m.toml",
                       test::effect_machine("trunnion_offset"), {}, diagnostics_);
  }
  Diagnostics diagnostics_;
};

TEST_F(ModelValid, IsReadAndWritten) {
  const auto model = read("X_mm = [-250, 250.5]\nC_deg = [0, 360]\nT_screw_x_degC = [19.5, 28]\n");
  ASSERT_TRUE(model) << model.error().text();
  ASSERT_EQ(model->valid.size(), 3U);
  EXPECT_EQ(model->valid[0].high, 250.5);
  const auto again =
      parse_model(model_text(*model), "m.toml", test::effect_machine("trunnion_offset"), {}, diagnostics_);
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(beyond_measured(again->valid, model->valid) + beyond_measured(model->valid, again->valid), "");
  EXPECT_EQ(model_text(*again), model_text(*model));
}

TEST_F(ModelValid, WrongOnesAreRefused) {
  for (const auto& [lines, said] : {std::pair{"X_mm = [250, -250]\n", "the smaller first"},
                                    {"X_mm = [250]\n", "two numbers"},
                                    {"X_deg = [0, 1]\n", "no axis of this machine"},
                                    {"B_deg = [0, 1]\n", "no axis of this machine"},
                                    {"T_room = [0, 1]\n", "T_name_degC"}}) {
    const auto model = read(lines);
    ASSERT_FALSE(model) << lines;
    EXPECT_THAT(model.error().text(), HasSubstr("m.toml:4:1")) << lines;
    EXPECT_THAT(model.error().text(), HasSubstr(said)) << lines;
  }
}

}  // namespace
}  // namespace trunnion
