// Laws that every effect of the library keeps, on machines of all chain shapes. A new file in
// src/effects/library is tested here without a change.
#include <Eigen/QR>
#include <cmath>
#include <gtest/gtest.h>
#include <set>

#include "support/effect_cases.hpp"

namespace trunnion {
namespace {

// "component" of "component:EXX": a file of the library.
std::string kind_of(const std::string& id) {
  return id.substr(0, id.find(':'));
}

std::vector<std::string> all_kinds() {
  std::set<std::string> out;
  for (const std::string& name : test::effect_machines()) {
    for (const EffectFamily& family : effect_library(test::effect_machine(name), test::effect_context())) {
      out.insert(kind_of(family.id()));
    }
  }
  return {out.begin(), out.end()};
}

class EveryEffect : public testing::TestWithParam<std::string> {
 protected:
  // Calls `check(family)` for every effect of this kind on every machine; `machine_` is set.
  template <class Check>
  void on_all_machines(Check check) {
    int count = 0;
    for (const std::string& name : test::effect_machines()) {
      machine_ = test::effect_machine(name);
      for (const EffectFamily& family : effect_library(machine_, test::effect_context())) {
        if (kind_of(family.id()) != GetParam()) continue;
        SCOPED_TRACE(name + " " + family.id());
        ++count;
        ASSERT_FALSE(family.variants.empty());
        check(family);
      }
    }
    EXPECT_GT(count, 0);
  }

  // Linear parameters between minus and plus `size_of` each, and behind them the shape.
  template <class SizeOf>
  std::vector<double> random_parameters(const Effect& effect, const std::vector<double>& shape,
                                        test::RandomStates& random, const SizeOf& size_of) {
    std::vector<double> out;
    for (std::size_t k = 0; k < effect.info().linear_count(); ++k)
      out.push_back(random.uniform(-1.0, 1.0) * size_of(effect.info().parameters[k]));
    out.insert(out.end(), shape.begin(), shape.end());
    return out;
  }

  // Shape parameters inside their search, and lags of a size that signals have.
  std::vector<double> random_shape(const Effect& effect, test::RandomStates& random) const {
    std::vector<double> out;
    for (const Parameter& p : effect.info().parameters) {
      if (p.role != ParameterRole::shape) continue;
      const double value = random.uniform(p.min, p.max);
      out.push_back(p.integer ? std::round(value) : value);
    }
    return out;
  }
  static std::vector<double> random_lags(const Effect& effect, const std::vector<double>& shape,
                                         test::RandomStates& random) {
    std::vector<double> out(effect.lags(shape).size());
    for (double& v : out) v = random.uniform(-5.0, 8000.0);
    return out;
  }
  static std::vector<Twist> columns(const Effect& effect, const MachineState& state,
                                    const std::vector<double>& lagged, const std::vector<double>& shape) {
    std::vector<Twist> out(effect.info().linear_count());
    effect.columns(state, lagged, shape, out);
    return out;
  }

  Machine machine_;
};

TEST_P(EveryEffect, SaysWhatItIs) {
  on_all_machines([&](const EffectFamily& family) {
    std::set<std::vector<std::pair<std::string, std::string>>> variants;
    for (const auto& effect : family.variants) {
      const EffectInfo& info = effect->info();
      EXPECT_EQ(info.id, family.id());
      EXPECT_GT(info.what.size(), 20u);
      EXPECT_GT(info.cause.size(), 20u);
      EXPECT_GT(info.remedy.size(), 20u);
      ASSERT_FALSE(info.parameters.empty());
      EXPECT_TRUE(variants.insert(info.variant).second) << "variant twice";
      std::set<std::string> keys;
      for (const Parameter& p : info.parameters) {
        EXPECT_TRUE(keys.insert(p.key()).second) << p.key();
        EXPECT_EQ(unit_of_key(p.key()), p.unit) << p.key();
        EXPECT_GT(p.usual, 0.0) << p.key();
        if (p.role == ParameterRole::linear) {
          EXPECT_NE(p.unit, Unit::none) << p.key();
        } else {
          EXPECT_LT(p.min, p.max) << p.key();
          EXPECT_GE(p.usual, p.min) << p.key();
          EXPECT_LE(p.usual, p.max) << p.key();
        }
      }
      const std::size_t linear = info.linear_count();
      ASSERT_GT(linear, 0u);
      for (std::size_t k = 0; k < linear; ++k)
        EXPECT_EQ(info.parameters[k].role, ParameterRole::linear) << "linear ones first";
    }
  });
}

// What an effect says it does not depend on may change: the twist stays, bit by bit. A motion may depend on
// all.
TEST_P(EveryEffect, DependsOnNoMoreThanItSays) {
  on_all_machines([&](const EffectFamily& family) {
    test::RandomStates random(machine_, 12);
    for (const auto& effect : family.variants) {
      if (effect->depends_on() == DependsOn::motion) continue;
      for (int i = 0; i < 20; ++i) {
        const MachineState state = random.next();
        const auto shape = random_shape(*effect, random);
        const auto lagged = random_lags(*effect, shape, random);
        const auto p = random_parameters(*effect, shape, random, [](const Parameter&) { return 1.0; });
        if (effect->depends_on() < DependsOn::conditions) {
          EXPECT_TRUE(lagged.empty());
        }
        const Twist twist = effect->twist(state, lagged, p);
        MachineState other = state;
        for (AxisId id = 0; id < kMaxAxes; ++id) {
          other.direction[id] = static_cast<std::int8_t>(-state.direction[id]);
          other.velocity[id] = -3.0 * state.velocity[id];
          if (effect->depends_on() == DependsOn::nothing) other.q[id] += random.uniform(-1.0, 1.0);
        }
        std::vector<double> temperatures(state.temperature_K.begin(), state.temperature_K.end());
        std::vector<double> states(state.state.begin(), state.state.end());
        if (effect->depends_on() < DependsOn::conditions) {
          for (double& T : temperatures) T += 1.0;
          for (double& s : states) s = 1.0 - s;
          other.temperature_K = temperatures;
          other.state = states;
          other.spindle_rpm += 1000.0;
          other.time_s += 500.0;
          other.run = 1 - state.run;
        }
        const Twist again = effect->twist(other, lagged, p);
        EXPECT_TRUE(again.trans_mm == twist.trans_mm && again.rot_rad == twist.rot_rad);
      }
    }
  });
}

// What an effect says of its range holds at all positions within the travel, and between them.
TEST_P(EveryEffect, KeepsWithinItsRange) {
  on_all_machines([&](const EffectFamily& family) {
    test::RandomStates random(machine_, 13);
    for (const auto& effect : family.variants) {
      for (int i = 0; i < 100; ++i) {
        const MachineState state = random.next();
        const auto shape = random_shape(*effect, random);
        const auto lagged = random_lags(*effect, shape, random);
        const auto p = random_parameters(*effect, shape, random, [](const Parameter&) { return 1.0; });
        const auto range = effect->range(p, machine_.axes);
        if (!range) continue;
        constexpr double kRounding = 1.0 + 1e-12;
        const Twist twist = effect->twist(state, lagged, p);
        EXPECT_LE(twist.trans_mm.norm(), kRounding * range->largest.trans_mm);
        EXPECT_LE(twist.rot_rad.norm(), kRounding * range->largest.rot_rad);
        MachineState other = state;
        double trans_mm = 0.0;
        double rot_rad = 0.0;
        const JointVector q = random.next().q;
        const double share = std::pow(10.0, random.uniform(-4.0, 0.0));
        for (AxisId id = 0; id < machine_.axes.size(); ++id) {
          other.q[id] += share * (q[id] - state.q[id]);
          trans_mm += range->per_unit[id].trans_mm * std::abs(other.q[id] - state.q[id]);
          rot_rad += range->per_unit[id].rot_rad * std::abs(other.q[id] - state.q[id]);
        }
        const Twist there = effect->twist(other, lagged, p);
        EXPECT_LE((there.trans_mm - twist.trans_mm).norm(), kRounding * trans_mm + 1e-12);
        EXPECT_LE((there.rot_rad - twist.rot_rad).norm(), kRounding * rot_rad + 1e-12);
      }
    }
  });
}

TEST_P(EveryEffect, ZeroParametersGiveNoErrorAndTheTwistIsLinear) {
  on_all_machines([&](const EffectFamily& family) {
    test::RandomStates random(machine_, 11);
    for (const auto& effect : family.variants) {
      for (int i = 0; i < 20; ++i) {
        const MachineState& state = random.next();
        const auto shape = random_shape(*effect, random);
        const auto lagged = random_lags(*effect, shape, random);
        const std::size_t n = effect->info().linear_count();
        std::vector<double> p(n, 0.0);
        p.insert(p.end(), shape.begin(), shape.end());
        EXPECT_TRUE(effect->twist(state, lagged, p).is_zero());
        const auto cols = columns(*effect, state, lagged, shape);
        Twist sum;
        for (std::size_t k = 0; k < n; ++k) {
          EXPECT_TRUE(cols[k].trans_mm.allFinite() && cols[k].rot_rad.allFinite());
          p[k] = random.uniform(-1.0, 1.0) * effect->info().parameters[k].usual;
          sum += cols[k] * p[k];
        }
        const Twist twist = effect->twist(state, lagged, p);
        EXPECT_NEAR((twist.trans_mm - sum.trans_mm).norm(), 0.0, 1e-15);
        EXPECT_NEAR((twist.rot_rad - sum.rot_rad).norm(), 0.0, 1e-18);
      }
    }
  });
}

// What a certificate of a path on the machine with errors stands on.
TEST_P(EveryEffect, LeavesItsStraightCourseByNoMoreThanItSays) {
  on_all_machines([&](const EffectFamily& family) {
    test::RandomStates random(machine_, 13);
    for (const auto& effect : family.variants) {
      for (int i = 0; i < 40; ++i) {
        const MachineState from = random.next();
        const auto shape = random_shape(*effect, random);
        const auto lagged = random_lags(*effect, shape, random);
        const auto p =
            random_parameters(*effect, shape, random, [](const Parameter& of) { return of.usual; });
        MachineState to = from;
        const double size = std::pow(10.0, random.uniform(-3.0, 0.0));
        for (AxisId id = 0; id < machine_.axes.size(); ++id)
          to.q[id] +=
              size * random.uniform(-1.0, 1.0) * (machine_.axes[id].kind == AxisKind::linear ? 200.0 : 2.0);
        const auto bend = effect->bend(from, to, p);
        ASSERT_TRUE(bend.has_value());
        const Twist t0 = effect->twist(from, lagged, p);
        const Twist t1 = effect->twist(to, lagged, p);
        for (int k = 1; k < 32; ++k) {
          MachineState at = from;
          at.q = JointVector::interpolate(from.q, to.q, k / 32.0);
          const Twist off = effect->twist(at, lagged, p) - (t0 * (1.0 - k / 32.0) + t1 * (k / 32.0));
          EXPECT_LE(off.trans_mm.norm(), bend->trans_mm + 1e-13 * (1.0 + t0.trans_mm.norm()));
          EXPECT_LE(off.rot_rad.norm(), bend->rot_rad + 1e-16 * (1.0 + 1e3 * t0.rot_rad.norm()));
        }
      }
    }
  });
}

TEST_P(EveryEffect, UsualValuesGiveErrorsOfUsualSize) {
  on_all_machines([&](const EffectFamily& family) {
    // Between a thousandth of a micrometre and a millimetre at the tool, somewhere among random states:
    // catches wrong units.
    test::RandomStates random(machine_, 12);
    for (const auto& effect : family.variants) {
      std::vector<double> largest(effect->info().linear_count(), 0.0);
      for (int i = 0; i < 50; ++i) {
        const MachineState& state = random.next();
        const auto shape = random_shape(*effect, random);
        std::vector<double> lagged;
        // Settled; of a sense of motion, as it is when the axis has just reversed.
        for (const LagRequest& lag : effect->lags(shape))
          lagged.push_back(lag.signal.kind == Signal::Kind::direction ? -state.value(lag.signal)
                                                                      : state.value(lag.signal));
        const auto cols = columns(*effect, state, lagged, shape);
        const DeviationMap map(machine_, state.q, machine_.tool_vector());
        for (std::size_t k = 0; k < cols.size(); ++k) {
          const Deviation d = map.linear_M(effect->link(), cols[k] * effect->info().parameters[k].usual);
          largest[k] = std::max(largest[k], d.displacement_mm.norm() + 1e2 * d.rotation_rad.norm());
        }
      }
      for (std::size_t k = 0; k < largest.size(); ++k) {
        EXPECT_GT(largest[k], 1e-4) << effect->info().parameters[k].key();
        EXPECT_LT(largest[k], 1.0) << effect->info().parameters[k].key();
      }
    }
  });
}

TEST_P(EveryEffect, IsSmoothInThePosition) {
  on_all_machines([&](const EffectFamily& family) {
    test::RandomStates random(machine_, 13);
    const auto& effect = family.variants.front();
    for (int i = 0; i < 20; ++i) {
      MachineState state = random.next();
      const auto shape = random_shape(*effect, random);
      const auto lagged = random_lags(*effect, shape, random);
      const auto before = columns(*effect, state, lagged, shape);
      constexpr double kStep = 1e-7;
      for (AxisId id = 0; id < machine_.axes.size(); ++id) state.q[id] += kStep;
      const auto after = columns(*effect, state, lagged, shape);
      for (std::size_t k = 0; k < before.size(); ++k) {
        // The steepest column is a worm of 180 periods a turn, or a screw's temperature times its position.
        const double limit = 200.0 * kStep * (1.0 + before[k].trans_mm.norm() + before[k].rot_rad.norm());
        EXPECT_LT((after[k] - before[k]).trans_mm.norm() + (after[k] - before[k]).rot_rad.norm(), limit);
      }
    }
  });
}

TEST_P(EveryEffect, JacobianIsTheFiniteDifferenceOfTheExactChain) {
  on_all_machines([&](const EffectFamily& family) {
    test::RandomStates random(machine_, 14);
    for (const auto& effect : family.variants) {
      const MachineState& state = random.next();
      const auto shape = random_shape(*effect, random);
      const auto lagged = random_lags(*effect, shape, random);
      const auto cols = columns(*effect, state, lagged, shape);
      const DeviationMap map(machine_, state.q, machine_.tool_vector() + random.vector(30.0));
      for (std::size_t k = 0; k < cols.size(); ++k) {
        const double size = std::max(cols[k].trans_mm.norm() / 100.0, cols[k].rot_rad.norm());
        if (size == 0.0) continue;
        const double h =
            1e-5 / size;  // 1 um or 10 urad: the second-order part cancels in the central difference
        const auto exact = [&](double step) {
          ChainErrors errors;
          Twist& at = effect->link().kind == Link::Kind::joint     ? errors.joint[effect->link().axis]
                      : effect->link().kind == Link::Kind::spindle ? errors.spindle
                                                                   : errors.part;
          at = cols[k] * step;
          return map.exact_M(errors);
        };
        const Deviation difference = (exact(h) - exact(-h)) * (0.5 / h);
        const Deviation linear = map.linear_M(effect->link(), cols[k]);
        const double scale = 1e3 * size;
        EXPECT_LT((difference.displacement_mm - linear.displacement_mm).norm(), 1e-7 * scale)
            << effect->info().parameters[k].key();
        EXPECT_LT((difference.rotation_rad - linear.rotation_rad).norm(), 1e-9 * scale)
            << effect->info().parameters[k].key();
      }
    }
  });
}

TEST_P(EveryEffect, SurvivesTheModelFile) {
  on_all_machines([&](const EffectFamily& family) {
    test::RandomStates random(machine_, 15);
    for (const auto& effect : family.variants) {
      Model model;
      model.name = "round trip";
      model.context = test::effect_context();
      ModelEffect entry = model_effect(effect);
      for (std::size_t k = 0; k < entry.parameters.size(); ++k) {
        const Parameter& p = effect->info().parameters[k];
        entry.parameters[k].value = p.role == ParameterRole::linear ? random.uniform(-1.0, 1.0) * p.usual
                                                                    : random.uniform(p.min, p.max);
        entry.parameters[k].given = true;
        entry.parameters[k].sigma = 0.01 * p.usual;
      }
      entry.parameters[0].fixed = true;
      model.effects.push_back(entry);
      Diagnostics diagnostics;
      const auto back =
          parse_model(model_text(model), "round.toml", machine_, test::effect_context(), diagnostics);
      ASSERT_TRUE(back) << back.error().text() << "\n" << model_text(model);
      ASSERT_EQ(back->effects.size(), 1u);
      const ModelEffect& b = back->effects[0];
      EXPECT_EQ(b.effect->info().variant, effect->info().variant);
      ASSERT_EQ(b.parameters.size(), entry.parameters.size());
      for (std::size_t k = 0; k < b.parameters.size(); ++k) {
        EXPECT_NEAR(b.parameters[k].value, entry.parameters[k].value,
                    1e-15 * std::abs(entry.parameters[k].value));
        EXPECT_TRUE(b.parameters[k].sigma);
      }
      EXPECT_TRUE(b.parameters[0].fixed);
      EXPECT_EQ(model_text(*back), model_text(model));
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Library, EveryEffect, testing::ValuesIn(all_kinds()),
                         [](const auto& test) { return test.param; });

TEST(Library, HasEveryEffectOfTheTable) {
  const Machine machine = test::effect_machine("trunnion_offset");
  std::set<std::string> ids;
  for (const EffectFamily& family : effect_library(machine, test::effect_context())) {
    EXPECT_TRUE(ids.insert(family.id()).second) << family.id();
  }
  std::set<std::string> expected;
  for (const char* axis : {"X", "Y", "Z", "A", "C"}) {
    for (const char* d : {"X", "Y", "Z", "A", "B", "C"})
      expected.insert(std::string("component:E") + d + axis);
    for (const char* kind : {"backlash:", "servo_lag:", "reversal_spike:"})
      expected.insert(std::string(kind) + axis);
  }
  for (const char* axis : {"X", "Y", "Z"}) {
    for (const char* kind : {"periodic:", "screw_heating:"}) expected.insert(std::string(kind) + axis);
  }
  for (const char* axis : {"A", "C"}) {
    for (const char* kind : {"worm:", "location:", "thermal_location:"})
      expected.insert(std::string(kind) + axis);
  }
  expected.insert({"squareness:C0Y", "squareness:B0Z", "squareness:A0Z", "crosstalk:XY",   "crosstalk:XZ",
                   "crosstalk:YZ",   "sag:A",          "overhang:Z",     "spindle_growth", "ambient_drift",
                   "time_drift",     "spindle_tilt",   "tool_length",    "setup_tilt",     "step",
                   "zero_offset:A",  "zero_offset:C",  "tool_offset",    "weight:AC",      "unbalance:AC"});
  EXPECT_EQ(ids, expected);
}

TEST(Library, LeavesOutWhatTheDataCannotHave) {
  const Machine machine = test::effect_machine("three_axis");
  for (const EffectFamily& family : effect_library(machine, {})) {
    const std::string& id = family.id();
    EXPECT_EQ(id.find("heating"), std::string::npos);
    EXPECT_TRUE(id != "ambient_drift" && id != "step" && id != "setup_tilt" && id != "sag:A") << id;
  }
}

TEST(Library, ContainedEffectsAreWithinTheSpan) {
  // The twist of the smaller one is a combination of the larger one's columns and a constant, at every state.
  for (const std::string& name : test::effect_machines()) {
    const Machine machine = test::effect_machine(name);
    const auto library = effect_library(machine, test::effect_context());
    for (const EffectFamily& big : library) {
      for (const std::string& inner : big.info().contains) {
        const auto small =
            std::find_if(library.begin(), library.end(), [&](const auto& f) { return f.id() == inner; });
        ASSERT_NE(small, library.end()) << inner;
        const Effect& a = *big.variants.front();
        const Effect& b = *small->variants.front();
        ASSERT_EQ(a.link(), b.link());
        test::RandomStates random(machine, 3);
        constexpr int kStates = 40;
        const auto na = static_cast<Eigen::Index>(a.info().linear_count());
        Eigen::MatrixXd A = Eigen::MatrixXd::Zero(6 * kStates, na + 6);
        Eigen::MatrixXd B(6 * kStates, static_cast<Eigen::Index>(b.info().linear_count()));
        const auto stacked = [](const Twist& t) {
          return (Eigen::Matrix<double, 6, 1>() << t.trans_mm, t.rot_rad).finished();
        };
        for (int i = 0; i < kStates; ++i) {
          const MachineState& state = random.next();
          std::vector<Twist> ca(a.info().linear_count()), cb(b.info().linear_count());
          a.columns(state, {}, {}, ca);
          b.columns(state, {}, {}, cb);
          for (std::size_t k = 0; k < ca.size(); ++k)
            A.block<6, 1>(6 * i, static_cast<Eigen::Index>(k)) = stacked(ca[k]);
          for (std::size_t k = 0; k < cb.size(); ++k)
            B.block<6, 1>(6 * i, static_cast<Eigen::Index>(k)) = stacked(cb[k]);
          A.block<6, 6>(6 * i, na).setIdentity();
        }
        const Eigen::MatrixXd left = B - A * A.completeOrthogonalDecomposition().solve(B);
        EXPECT_LT(left.norm(), 1e-9 * B.norm()) << big.id() << " contains " << inner;
      }
    }
  }
}

}  // namespace
}  // namespace trunnion
