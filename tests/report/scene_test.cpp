#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/machine/kinematics.hpp"

#include "report/nc_figures.hpp"
#include "support/machines.hpp"

namespace trunnion::report {
namespace {

Vec3 vec(const std::array<float, 3>& p) {
  return {p[0], p[1], p[2]};
}

const Scene::Body& body(const Scene& scene, std::string_view role) {
  for (const auto& b : scene.bodies)
    if (b.role == role) return b;
  throw std::runtime_error("no body");
}

Vec3 middle(const Scene::Body& b) {
  Vec3 sum = Vec3::Zero();
  for (const auto& c : b.corners) sum += vec(c);
  return sum / static_cast<double>(b.corners.size());
}

// Volume of a closed body by the divergence theorem: positive where its triangles run counter-clockwise from
// outside.
double volume(const Scene::Body& b) {
  double out = 0.0;
  for (std::size_t i = 0; i + 2 < b.corners.size(); i += 3)
    out += vec(b.corners[i]).dot(vec(b.corners[i + 1]).cross(vec(b.corners[i + 2]))) / 6.0;
  return out;
}

class Solids : public testing::TestWithParam<std::string> {};

TEST_P(Solids, StandOnTheRightSides) {
  const Machine machine = test::shipped_machine(GetParam());
  const Scene scene = machine_solids(machine, 100.0);
  const double tip = scene.zero.spindle_M[2] - machine.tool_length_mm;
  // The table is under the part and away from the tool, whichever way its axis is counted.
  EXPECT_LT(middle(body(scene, "table")).z(), scene.zero.part_M[2]);
  EXPECT_LT(middle(body(scene, "bed")).z(), middle(body(scene, "table")).z());
  EXPECT_GT(middle(body(scene, "spindle")).z(), scene.zero.spindle_M[2]);
  double lowest = 1e9;
  for (const auto& c : body(scene, "flute").corners) lowest = std::min<double>(lowest, c[2]);
  EXPECT_NEAR(lowest, tip, 1e-3);
  for (const auto& b : scene.bodies) {
    EXPECT_EQ(b.corners.size() % 3, 0U);
    EXPECT_GT(volume(b), 0.0) << b.name;
  }
}

// What the program's page is drawn from: the file's machine has C about -Z, its mirror image about +Z.
TEST(SolidsOf, AreTheSameForTheOtherSenseOfC) {
  Machine machine = test::shipped_machine("trunnion_offset");
  const Scene one = machine_solids(machine, 100.0);
  machine.axes[machine.rotary_axes().back()].direction *= -1.0;
  const Scene other = machine_solids(machine, 100.0);
  EXPECT_NEAR((middle(body(one, "table")) - middle(body(other, "table"))).norm(), 0.0, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Shipped, Solids, testing::ValuesIn(test::shipped_machines()));

}  // namespace
}  // namespace trunnion::report
