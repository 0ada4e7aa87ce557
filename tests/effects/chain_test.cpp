// The forward model with errors against a second chain built by another method (dual quaternions, nothing
// shared with the library but the machine file), and against closed forms, one error at a time.
#include <cmath>
#include <gtest/gtest.h>

#include "support/effect_cases.hpp"

namespace trunnion {
namespace {

// Unit dual quaternion r + eps d as eight doubles; only the algebra i^2 = j^2 = k^2 = ijk = -1, eps^2 = 0.
struct Dual {
  std::array<double, 4> r{1, 0, 0, 0};
  std::array<double, 4> d{0, 0, 0, 0};
};
using Q = std::array<double, 4>;

Q times(const Q& a, const Q& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}
Q plus(const Q& a, const Q& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]};
}
Q conjugate(const Q& a) {
  return {a[0], -a[1], -a[2], -a[3]};
}
Dual operator*(const Dual& a, const Dual& b) {
  return {times(a.r, b.r), plus(times(a.r, b.d), times(a.d, b.r))};
}
Dual inverse(const Dual& a) {
  return {conjugate(a.r), conjugate(a.d)};
}

Dual shift(double x, double y, double z) {
  return {{1, 0, 0, 0}, {0, x / 2, y / 2, z / 2}};
}
Dual shift(const Vec3& v) {
  return shift(v.x(), v.y(), v.z());
}
Dual turn(const Vec3& n, double angle) {
  const double s = std::sin(angle / 2);
  return {{std::cos(angle / 2), s * n.x(), s * n.y(), s * n.z()}, {0, 0, 0, 0}};
}
// exp((rot + eps trans) / 2): a screw about rot with the pitch trans . n and its moment.
Dual screw(const Twist& t) {
  const double angle = t.rot_rad.norm();
  if (angle == 0.0) return shift(t.trans_mm);
  const Vec3 n = t.rot_rad / angle;
  const double slide = t.trans_mm.dot(n);
  const Vec3 moment = (t.trans_mm - slide * n) / angle;
  const double s = std::sin(angle / 2), c = std::cos(angle / 2);
  const Vec3 d = s * moment + 0.5 * slide * c * n;
  return {{c, s * n.x(), s * n.y(), s * n.z()}, {-0.5 * slide * s, d.x(), d.y(), d.z()}};
}
Vec3 position(const Dual& a) {
  const Q t = times(a.d, conjugate(a.r));
  return 2.0 * Vec3(t[1], t[2], t[3]);
}
Vec3 turned(const Dual& a, const Vec3& v) {
  const Q w = times(times(a.r, {0, v.x(), v.y(), v.z()}), conjugate(a.r));
  return {w[1], w[2], w[3]};
}

Dual side(const Machine& m, const std::vector<AxisId>& chain, const MachineState& s, const ChainErrors& e) {
  Dual out;
  for (const AxisId id : chain) {
    const Axis& axis = m.axes[id];
    if (axis.kind == AxisKind::linear) {
      out = out * shift(s.q[id] * axis.direction) * shift(axis.point_mm) * screw(e.joint[id]) *
            shift(-axis.point_mm);
    } else {
      out = out * shift(axis.point_mm) * screw(e.joint[id]) * turn(axis.direction, s.q[id]) *
            shift(-axis.point_mm);
    }
  }
  return out;
}
Dual second_chain(const Machine& m, const MachineState& s, const Vec3& tool, const ChainErrors& e) {
  const Dual X_MT = side(m, m.tool_chain, s, e) * screw(e.spindle) * shift(tool);
  const Dual X_MP = side(m, m.part_chain, s, e) * shift(m.part_zero_mm) * screw(e.part);
  return inverse(X_MP) * X_MT;
}

class ChainOf : public testing::TestWithParam<std::string> {};

TEST_P(ChainOf, EqualsTheDualQuaternionChain) {
  Machine machine = test::effect_machine(GetParam());
  machine.part_zero_mm = Vec3(12, -7, 31);
  machine.axes[1].point_mm = Vec3(5, 80, -20);  // a carriage point beside the zero
  test::RandomStates random(machine, 41);
  double worst_mm = 0.0, worst_rad = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const MachineState& state = random.next();
    const Vec3 tool = machine.tool_vector() + random.vector(50.0);
    const ChainErrors errors = test::random_errors(machine, random);
    const Pose X = forward(machine, state.q, tool, errors);
    const Dual D = second_chain(machine, state, tool, errors);
    worst_mm = std::max(worst_mm, (X.p - position(D)).norm());
    for (int k = 0; k < 3; ++k)
      worst_rad = std::max(worst_rad, (X.R.col(k) - turned(D, Vec3::Unit(k))).norm());
  }
  EXPECT_LT(worst_mm, 1e-9);
  EXPECT_LT(worst_rad, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Machines, ChainOf, testing::ValuesIn(test::effect_machines()),
                         [](const auto& test) { return test.param; });

// Closed forms on the paper's machine (X carries Y carries Z carries the spindle; A carries C carries the
// part; both rotary axes through (0, 0, -200)): what an observer at the tool sees in machine axes.
class ClosedForm : public testing::Test {
 protected:
  ClosedForm() : machine_(test::effect_machine("paper")), random_(machine_, 5) {}

  // One error, random poses; `expected(tip_M, state, R_A, R_AC, value)` gives d_M.
  template <class Expected>
  void check(const char* effect_id, const char* key, double value, Expected expected) {
    EffectContext context = test::effect_context();
    for (int i = 0; i < 50; ++i) {
      const MachineState& state = random_.next();
      Model model;
      model.context = context;
      const auto effect = make_effect(machine_, model.context, effect_id);
      ASSERT_TRUE(effect) << effect.error().message;
      ModelEffect entry = model_effect(*effect);
      const auto index = entry.find(key);
      ASSERT_TRUE(index) << key;
      entry.parameters[*index].value = value;
      model.effects.push_back(entry);
      const DeviationMap map(machine_, state.q, machine_.tool_vector());
      const Deviation d = map.exact_M(chain_errors(model, state));
      const Mat3 R_A = rotation_about(Vec3::UnitX(), Angle::radians(state.q[3]));
      const Mat3 R_AC = R_A * rotation_about(Vec3::UnitZ(), Angle::radians(state.q[4]));
      const Vec3 tip_M(state.q[0], state.q[1], state.q[2] - 150.0);
      const Vec3 want = expected(tip_M, state, R_A, R_AC);
      EXPECT_LT((d.displacement_mm - want).norm(), 1e-9)
          << effect_id << " " << key << " at " << tip_M.transpose();
      const Deviation d_P = map.exact_P(chain_errors(model, state));
      EXPECT_LT((d_P.displacement_mm - R_AC.transpose() * want).norm(), 1e-9);
    }
  }
  static Mat3 about(int axis, double angle) {
    return rotation_about(Vec3::Unit(axis), Angle::radians(angle));
  }

  Machine machine_;
  test::RandomStates random_;
};

constexpr double kD = 0.02;  // mm
constexpr double kR = 3e-4;  // rad
const Vec3 kPivot(0, 0, -200);

TEST_F(ClosedForm, Squareness) {
  check("squareness:C0Y", "C0Y", kR, [](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) {
    return Vec3(-kR * s.q[1], 0, 0);
  });
  check("squareness:B0Z", "B0Z", kR,
        [](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) { return Vec3(kR * s.q[2], 0, 0); });
  check("squareness:A0Z", "A0Z", kR, [](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) {
    return Vec3(0, -kR * s.q[2], 0);
  });
}

TEST_F(ClosedForm, PositioningAndStraightness) {
  // P2(x / 500) of the axis that runs from -500 to 500.
  const auto P2 = [](double x) { return 1.5 * x * x / 250000.0 - 0.5; };
  check("component:EXX", "P2_um", kD, [&](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) {
    return Vec3(kD * P2(s.q[0]), 0, 0);
  });
  check("component:EZY", "P2_um", kD, [&](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) {
    return Vec3(0, 0, kD * P2(s.q[1]));
  });
}

TEST_F(ClosedForm, AnglesHaveTheirLeverArms) {
  // Yaw of X about its carriage (x, 0, 0): the tip stands at (0, y, z_tip) from there.
  check("component:ECX", "P1_urad", kR, [](const Vec3& tip, const MachineState& s, const Mat3&, const Mat3&) {
    const Vec3 lever(0, tip.y(), tip.z());
    return Vec3(about(2, kR * s.q[0] / 500.0) * lever - lever);
  });
  // Yaw of Y about (x, y, 0): no lever across. Its pitch has the height of the tip.
  check("component:ECY", "P1_urad", kR,
        [](const Vec3&, const MachineState&, const Mat3&, const Mat3&) { return Vec3::Zero(); });
  check("component:EAY", "P1_urad", kR, [](const Vec3& tip, const MachineState& s, const Mat3&, const Mat3&) {
    const Vec3 lever(0, 0, tip.z());
    return Vec3(about(0, kR * s.q[1] / 500.0) * lever - lever);
  });
  // Tilt of the spindle: the tool of 150 mm below S.
  check("spindle_tilt", "B0S_urad", kR, [](const Vec3&, const MachineState&, const Mat3&, const Mat3&) {
    return Vec3(-150.0 * std::sin(kR), 0, 150.0 - 150.0 * std::cos(kR));
  });
  check("tool_length", "Z0S_um", kD,
        [](const Vec3&, const MachineState&, const Mat3&, const Mat3&) { return Vec3(0, 0, kD); });
}

TEST_F(ClosedForm, LocationErrorsMoveThePart) {
  // The part moves by the twist, so the tool relative to it by the opposite.
  check("location:A", "Y0A", kD,
        [](const Vec3&, const MachineState&, const Mat3&, const Mat3&) { return Vec3(0, -kD, 0); });
  check("location:A", "ZOA", kD,
        [](const Vec3&, const MachineState&, const Mat3&, const Mat3&) { return Vec3(0, 0, -kD); });
  check("location:A", "EC0A_urad", kR, [](const Vec3& tip, const MachineState&, const Mat3&, const Mat3&) {
    return Vec3(about(2, -kR) * (tip - kPivot) - (tip - kPivot));
  });
  check("location:C", "X0C_um", kD, [](const Vec3&, const MachineState&, const Mat3& R_A, const Mat3&) {
    return Vec3(R_A * Vec3(-kD, 0, 0));
  });
  check("location:C", "Y0C_um", kD, [](const Vec3&, const MachineState&, const Mat3& R_A, const Mat3&) {
    return Vec3(R_A * Vec3(0, -kD, 0));
  });
  // A0C tilts with A: about the X of A's table, through the pivot.
  check("location:C", "A0C_urad", kR, [](const Vec3& tip, const MachineState&, const Mat3& R_A, const Mat3&) {
    const Vec3 w = R_A.transpose() * (tip - kPivot);
    return Vec3(R_A * (about(0, -kR) * w - w));
  });
}

TEST_F(ClosedForm, TiltErrorsOfRotaryAxes) {
  check("component:EBC", "sin1_urad", kR,
        [](const Vec3& tip, const MachineState& s, const Mat3& R_A, const Mat3&) {
          const Vec3 w = R_A.transpose() * (tip - kPivot);
          return Vec3(R_A * (about(1, -kR * std::sin(s.q[4])) * w - w));
        });
  check("component:EAA", "cos2_urad", kR,
        [](const Vec3& tip, const MachineState& s, const Mat3&, const Mat3&) {
          return Vec3(about(0, -kR * std::cos(2.0 * s.q[3])) * (tip - kPivot) - (tip - kPivot));
        });
}

TEST_F(ClosedForm, BacklashAndFollowingError) {
  check("backlash:Y", "b_um", kD, [](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) {
    return Vec3(0, -0.5 * kD * s.direction[1], 0);
  });
  check("backlash:A", "b_urad", kR, [](const Vec3& tip, const MachineState& s, const Mat3&, const Mat3&) {
    return Vec3(about(0, 0.5 * kR * s.direction[3]) * (tip - kPivot) - (tip - kPivot));
  });
  check("servo_lag:X", "tau_ms", 1e-4, [](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) {
    return Vec3(-1e-4 * s.velocity[0], 0, 0);
  });
}

TEST_F(ClosedForm, SagAndOverhang) {
  check("sag:A", "Z_cos_um", kD, [](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) {
    return Vec3(0, 0, -kD * std::cos(s.q[3]));
  });
  check("sag:A", "A_sin_urad", kR, [](const Vec3& tip, const MachineState& s, const Mat3&, const Mat3&) {
    return Vec3(about(0, -kR * std::sin(s.q[3])) * (tip - kPivot) - (tip - kPivot));
  });
  check("overhang:Z", "A_urad_per_m", 1e-6, [](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) {
    const Vec3 lever(0, 0, -150);
    return Vec3(about(0, 1e-6 * (700.0 - s.q[2])) * lever - lever);
  });
}

// A carries C here. What is carried by the table moves the other way seen from the part.
TEST_F(ClosedForm, WeightsAndOffsets) {
  check("weight:AC", "A_sin_sin_urad", kR,
        [](const Vec3& tip, const MachineState& s, const Mat3&, const Mat3&) {
          const double angle = -kR * std::sin(s.q[3]) * std::sin(s.q[4]);
          return Vec3(about(0, angle) * (tip - kPivot) - (tip - kPivot));
        });
  check("weight:AC", "Y_sin_cos_um", kD, [](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) {
    return Vec3(0, -kD * std::sin(s.q[3]) * std::cos(s.q[4]), 0);
  });
  check("zero_offset:A", "A0A_urad", kR, [](const Vec3& tip, const MachineState&, const Mat3&, const Mat3&) {
    return Vec3(about(0, -kR) * (tip - kPivot) - (tip - kPivot));
  });
  check("tool_offset", "Y0S_um", kD,
        [](const Vec3&, const MachineState&, const Mat3&, const Mat3&) { return Vec3(0, kD, 0); });
}

TEST(Unbalance, IsTheProductOfSines) {
  const Machine machine = test::effect_machine("trunnion_offset");
  EffectContext context;
  for (const auto& [component, functions] : {std::pair{"ECC", 2u}, {"EYA", 2u}, {"EAA", 4u}}) {
    const auto effect = make_effect(machine, context, "unbalance:AC", {{"component", component}});
    ASSERT_TRUE(effect);
    MachineState state;
    state.q[3] = 0.7;
    state.q[4] = -2.3;
    std::vector<Twist> out((*effect)->info().linear_count());
    ASSERT_EQ(out.size(), functions);
    (*effect)->columns(state, {}, {}, out);
    const std::array expected = {std::sin(0.7) * std::cos(2.3), -std::sin(0.7) * std::sin(2.3),
                                 std::cos(0.7) * std::cos(2.3), -std::cos(0.7) * std::sin(2.3)};
    const std::string symbol = component;
    for (std::size_t k = 0; k < out.size(); ++k) {
      Twist unit;
      if (symbol == "EYA") unit.trans_mm = Vec3::UnitY();
      if (symbol == "ECC") unit.rot_rad = Vec3::UnitZ();
      if (symbol == "EAA") unit.rot_rad = Vec3::UnitX();
      EXPECT_LT((out[k].trans_mm - unit.trans_mm * expected[k]).norm() +
                    (out[k].rot_rad - unit.rot_rad * expected[k]).norm(),
                1e-15);
    }
    EXPECT_EQ((*effect)->link().axis, symbol.back() == 'C' ? 4u : 3u);
  }
}

// Where C carries the axis that tilts, C's joint leans: about X and Y, and along them.
TEST(Weight, ActsOnTheAxisBelow) {
  Machine machine = test::effect_machine("trunnion_offset");
  std::swap(machine.part_chain.front(), machine.part_chain.back());
  EffectContext context;
  const auto effect = make_effect(machine, context, "weight:AC", {});
  ASSERT_TRUE(effect);
  EXPECT_EQ((*effect)->link().axis, 4u);
  MachineState state;
  state.q[3] = 0.5;
  state.q[4] = 1.2;
  std::vector<Twist> out((*effect)->info().linear_count());
  ASSERT_EQ(out.size(), 8u);
  (*effect)->columns(state, {}, {}, out);
  EXPECT_NEAR(out[0].rot_rad.x(), std::sin(0.5) * std::cos(1.2), 1e-15);
  EXPECT_NEAR(out[3].rot_rad.y(), std::sin(0.5) * std::sin(1.2), 1e-15);
  EXPECT_NEAR(out[6].trans_mm.y(), std::sin(0.5) * std::cos(1.2), 1e-15);
}

TEST_F(ClosedForm, SetUpAndHeat) {
  check("screw_heating:X", "alpha_um_per_m_K", 1e-5,
        [](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) {
          return Vec3(1e-5 * s.temperature_K[1] * s.q[0], 0, 0);
        });
  check("time_drift", "Y_um_per_h", 1e-5, [](const Vec3&, const MachineState& s, const Mat3&, const Mat3&) {
    return Vec3(0, 1e-5 * s.time_s, 0);
  });
  check("setup_tilt", "B_r2_urad", kR,
        [](const Vec3& tip, const MachineState& s, const Mat3&, const Mat3& R_AC) {
          const Vec3 p = R_AC.transpose() * (tip - kPivot) + kPivot;  // the tip in P
          return Vec3(R_AC * (about(1, s.run == 1 ? -kR : 0.0) * p - p));
        });
  check("step", "X_um", kD, [](const Vec3&, const MachineState& s, const Mat3&, const Mat3& R_AC) {
    return Vec3(R_AC * Vec3(s.run == 0 && s.time_s >= 1800.0 ? -kD : 0.0, 0, 0));
  });
}

TEST_F(ClosedForm, CrosstalkIsTheProduct) {
  EffectContext context;
  const auto effect = make_effect(machine_, context, "crosstalk:XY", {{"component", "EBY"}});
  ASSERT_TRUE(effect);
  const MachineState& state = random_.next();
  std::array<Twist, 4> out;
  (*effect)->columns(state, {}, {}, out);
  const double s = state.q[0] / 500.0, t = state.q[1] / 500.0;
  EXPECT_NEAR(out[0].rot_rad.y(), s * t, 1e-15);
  EXPECT_NEAR(out[1].rot_rad.y(), s * (1.5 * t * t - 0.5), 1e-15);
  EXPECT_NEAR(out[2].rot_rad.y(), (1.5 * s * s - 0.5) * t, 1e-15);
  EXPECT_NEAR(out[3].rot_rad.y(), (1.5 * s * s - 0.5) * (1.5 * t * t - 0.5), 1e-15);
  EXPECT_EQ((*effect)->link().axis, 1u);
}

TEST(Deviation, SetUpTranslationMovesThePart) {
  const Machine machine = test::effect_machine("trunnion_offset");
  test::RandomStates random(machine, 9);
  const MachineState& state = random.next();
  const DeviationMap map(machine, state.q, machine.tool_vector());
  ChainErrors errors;
  errors.part.trans_mm = Vec3(0.01, -0.02, 0.03);
  const Deviation d = map.exact_P(errors);
  EXPECT_LT((d.displacement_mm + errors.part.trans_mm).norm(), 1e-12);
  EXPECT_LT(
      (map.setup_translation_M(errors.part.trans_mm).displacement_mm - map.to_M(d).displacement_mm).norm(),
      1e-12);
}

TEST(Deviation, RotationIsThatOfTheToolInThePart) {
  // A part turned by +r about C's axis makes the tool turn by -r relative to it, in both frames about the
  // same axis.
  const Machine machine = test::effect_machine("paper");
  MachineState state;
  state.q[3] = 0.4;
  state.q[4] = 1.1;
  const DeviationMap map(machine, state.q, machine.tool_vector());
  ChainErrors errors;
  errors.joint[4].rot_rad = Vec3(0, 0, 1e-3);
  EXPECT_LT((map.exact_P(errors).rotation_rad - Vec3(0, 0, -1e-3)).norm(), 1e-12);
  EXPECT_LT((map.exact_M(errors).rotation_rad -
             rotation_about(Vec3::UnitX(), Angle::radians(0.4)) * Vec3(0, 0, -1e-3))
                .norm(),
            1e-12);
}

TEST(Datum, IsTheDeviationOfProgramZeroAtTheProbedPose) {
  // Probed at A = C = 0 with X0C = 20 um: the tool relative to the part stands off by -20 um there, which the
  // work offset took up.
  Machine machine = test::effect_machine("paper");
  Model model;
  const auto effect = make_effect(machine, model.context, "location:C");
  ASSERT_TRUE(effect);
  model.effects.push_back(model_effect(*effect));
  model.effects[0].parameters[0].value = 0.02;
  EXPECT_TRUE(datum_shift_P(machine, ModelEvaluator(model)).isZero(0.0));
  machine.probed_at = JointVector{};
  EXPECT_LT((datum_shift_P(machine, ModelEvaluator(model)) - Vec3(-0.02, 0, 0)).norm(), 1e-12);
  (*machine.probed_at)[4] = kPi / 2;  // the table turned: X0C now lies along P's -Y
  EXPECT_LT((datum_shift_P(machine, ModelEvaluator(model)) - Vec3(0, 0.02, 0)).norm(), 1e-12);
}

}  // namespace
}  // namespace trunnion
