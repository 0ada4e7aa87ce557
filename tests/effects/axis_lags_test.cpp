#include "trunnion/effects/axis_lags.hpp"

#include <cmath>
#include <gtest/gtest.h>

#include "trunnion/effects/state_track.hpp"

#include "support/effect_cases.hpp"

namespace trunnion {
namespace {

constexpr const char* kModel = R"([model]
name = "servos"

[[effect]]
id = "servo_lag:A"
[effect.parameters]
tau_ms = 5

[[effect]]
id = "reversal_spike:Y"
[effect.parameters]
h_um = 20
decay_ms = 15

[[effect]]
id = "squareness:C0Y"
[effect.parameters]
C0Y_urad = 10
)";

class Servos : public testing::Test {
 protected:
  Servos() : machine_(test::effect_machine("trunnion_offset")) {
    Diagnostics diagnostics;
    model_ = parse_model(kModel, "m.toml", machine_, {}, diagnostics).value();
  }
  Machine machine_;
  Model model_;
};

TEST_F(Servos, LagsAreThoseOfTheModelAndTheRestStays) {
  const JointVector lags = axis_lags(model_);
  for (AxisId id = 0; id < machine_.axes.size(); ++id)
    EXPECT_DOUBLE_EQ(lags[id], machine_.axes[id].name == "A" ? 0.005 : 0.0);
  const Model rest = without_servo_effects(model_);
  ASSERT_EQ(rest.effects.size(), 1u);
  EXPECT_EQ(rest.effects[0].effect->info().id, "squareness:C0Y");
}

// Every axis has it beside its own, files keep it, and it is no error at a place.
TEST_F(Servos, TheLagOfAllAxesIsAddedToEach) {
  Model model = model_;
  model.lag_of_all_axes_s = 0.00325;
  Diagnostics diagnostics;
  const auto again = parse_model(model_text(model), "m.toml", machine_, {}, diagnostics);
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_DOUBLE_EQ(again->lag_of_all_axes_s, 0.00325);
  const JointVector lags = axis_lags(*again);
  for (AxisId id = 0; id < machine_.axes.size(); ++id)
    EXPECT_DOUBLE_EQ(lags[id], machine_.axes[id].name == "A" ? 0.00825 : 0.00325);
  EXPECT_EQ(axis_lags(without_servo_effects(*again)), JointVector());
}

TEST_F(Servos, ALagBelowZeroIsRefused) {
  Diagnostics diagnostics;
  const auto model = parse_model("[model]\nlag_of_all_axes_ms = -2\n", "m.toml", machine_, {}, diagnostics);
  ASSERT_FALSE(model);
  EXPECT_EQ(model.error().code, ErrorCode::wrong_input);
  EXPECT_NE(model.error().text().find("m.toml:2:"), std::string::npos) << model.error().text();
}

// The carried body stands back: minus the velocity times the delay, about the vector it turns about.
TEST_F(Servos, ARotaryAxisStandsBackAboutItsOwnDirection) {
  MachineState state;
  const AxisId a = *machine_.axis("A");
  state.velocity[a] = 2.0;
  state.run = 0;
  const Vec3 turned = chain_errors(model_, state).joint[a].rot_rad;
  EXPECT_LT((turned + 0.01 * machine_.axes[a].direction).norm(), 1e-15);
}

TEST_F(Servos, ASpikeDecaysBehindAReversalAndIsNoneInAProgram) {
  const AxisId y = *machine_.axis("Y");
  std::vector<MachineState> rows;
  for (int i = 0; i < 40; ++i) {
    MachineState state;
    state.run = 0;
    state.time_s = 0.003 * i;
    state.direction[y] = i < 10 ? 1 : -1;
    state.velocity[y] = 5.0 * state.direction[y];
    rows.push_back(state);
  }
  const StateTrack track(rows);
  const auto requests = lag_requests(model_);
  ASSERT_EQ(requests.size(), 1u);
  const auto lagged = track.lag(requests[0]);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double t = 0.003 * (static_cast<double>(i) - 10.0);
    const double want_mm = i < 10 ? 0.0 : 0.02 * std::exp(-t / 0.015);
    const double along = chain_errors(model_, rows[i], std::array{lagged[i]})
                             .joint[y]
                             .trans_mm.dot(machine_.axes[y].direction);
    EXPECT_NEAR(along, want_mm, 1e-12);
    rows[i].run = kNoRun;
    EXPECT_EQ(chain_errors(model_, rows[i], std::array{lagged[i]}).joint[y].trans_mm.norm(), 0.0);
  }
}

}  // namespace
}  // namespace trunnion
