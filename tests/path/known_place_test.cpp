#include "trunnion/path/known_place.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/path/certificate.hpp"

#include "support/machines.hpp"

namespace trunnion::path {
namespace {

// With the exact tips it is the bound from the sines; with tips that are off by no more than is said it is no
// smaller, and hardly larger.
TEST(KnownPlace, BoundsTheBowWithoutSines) {
  std::mt19937_64 random(20261122);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::size_t bounded = 0;
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const TableKinematics kinematics(machine, machine.tool_vector());
    const Certifier certifier(kinematics);
    for (int i = 0; i < 500; ++i) {
      std::array<JointVector, 2> q;
      const double step = std::exp(4.0 * u(random) - 3.0);
      for (AxisId id = 0; id < machine.axes.size(); ++id) {
        const bool rotary = machine.axes[id].kind == AxisKind::rotary;
        q[0][id] = u(random) * (rotary ? 2.0 : 100.0);
        q[1][id] = q[0][id] + step * u(random) * (rotary ? 0.05 : 1.0);
      }
      const Station a = station(kinematics, q[0]);
      const Station b = station(kinematics, q[1]);
      const double truth = certifier.bow_from_norms(a, b);
      const double exact = bow_from_norms(kinematics, {q[0], a.tip_P}, {q[1], b.tip_P}, 0.0);
      if (!kinematics.linear_axes_first()) {
        EXPECT_TRUE(std::isinf(exact));
        continue;
      }
      EXPECT_NEAR(exact, truth, 1e-9 * truth + 1e-13);
      const double off_mm = std::abs(u(random));
      const Vec3 off_P = off_mm * Vec3(u(random), u(random), u(random)).normalized();
      const double known =
          bow_from_norms(kinematics, {q[0], a.tip_P + off_P}, {q[1], b.tip_P - off_P}, off_mm);
      EXPECT_GE(known, truth);
      EXPECT_LE(known, truth + 0.25 * 2.0 * off_mm * std::pow(step * 0.05, 2) * 1.01 + 1e-12) << name;
      ++bounded;
    }
  }
  EXPECT_GT(bounded, 1000U);
}

}  // namespace
}  // namespace trunnion::path
