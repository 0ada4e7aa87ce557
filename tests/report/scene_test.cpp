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

// The still picture, where nothing in space can be drawn: as the chain of the kinematics has it.
TEST_P(Solids, StandAsTheAxesDo) {
  const Machine machine = test::shipped_machine(GetParam());
  JointVector q;
  Scene::Stand stand;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const bool rotary = machine.axes[id].kind == AxisKind::rotary;
    const double at = rotary ? 10.0 + 7.0 * static_cast<double>(id) : 30.0 - 11.0 * static_cast<double>(id);
    stand.q.push_back(at);
    q[id] = rotary ? at * kRadPerDegree : at;
  }
  const Scene scene = stands_scene(machine, {stand});
  const Pose X_MP = part_in_machine(machine, q);
  const Vec3 part_M = standing(scene, body(scene, "table")) * vec(scene.zero.part_M);
  EXPECT_NEAR((part_M - X_MP.p).norm(), 0.0, 1e-3);
  const Vec3 tip_at_zero = vec(scene.zero.spindle_M) - scene.zero.tool_length_mm * Vec3::UnitZ();
  const Vec3 tip_M = standing(scene, body(scene, "flute")) * tip_at_zero;
  EXPECT_NEAR((tip_M - X_MP * forward(machine, q, machine.tool_vector()).p).norm(), 0.0, 1e-3);
}

TEST_P(Solids, OfAMachineMovedByHandBeginClearOfTheTable) {
  const Scene scene = jog_scene(test::shipped_machine(GetParam()), {});
  const auto heights = [&](std::string_view role) {
    const Scene::Body& of = body(scene, role);
    std::array<double, 2> out = {1e9, -1e9};
    for (const auto& c : of.corners) {
      const double z = (standing(scene, of) * vec(c)).z();
      out = {std::min(out[0], z), std::max(out[1], z)};
    }
    return out;
  };
  EXPECT_GT(heights("flute")[0], heights("table")[1]);
}

// What the program's page is drawn from: the file's machine has C about -Z, its mirror image about +Z.
TEST(SolidsOf, AreTheSameForTheOtherSenseOfC) {
  Machine machine = test::shipped_machine("trunnion_offset");
  const Scene one = machine_solids(machine, 100.0);
  machine.axes[machine.rotary_axes().back()].direction *= -1.0;
  const Scene other = machine_solids(machine, 100.0);
  EXPECT_NEAR((middle(body(one, "table")) - middle(body(other, "table"))).norm(), 0.0, 1e-3);
}

TEST(Meshes, StandForTheBodyThatIsDrawn) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  Scene scene = machine_solids(machine, 100.0);
  const std::size_t before = scene.bodies.size();
  put_meshes(scene, {{"table.stl", true, machine.part_chain.size(), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}},
                     {"head.stl", false, machine.tool_chain.size(), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}});
  EXPECT_EQ(scene.bodies.size(), before);
  EXPECT_EQ(body(scene, "table").name, "table.stl");
  EXPECT_EQ(body(scene, "spindle").name, "head.stl");
  EXPECT_NO_THROW(body(scene, "flute"));  // the tool stays
  EXPECT_NO_THROW(body(scene, "bed"));
}

post::VerifiedBlock feed(std::uint32_t cl_line, double path_mm, float tip_mm) {
  post::VerifiedBlock out;
  out.cl_line = cl_line;
  out.path_mm = path_mm;
  out.tip_deviation_mm = tip_mm;
  out.seconds = 0.5;
  return out;
}

// One program goes to CL lines 1 and 2 in one block each, the other in three and in two; a rapid stands
// between.
TEST(LaidOnto, TakesWhatCutsTheSameStretch) {
  post::VerifyReport plain, fine;
  plain.blocks = {feed(1, 10.0, 9.0F), feed(2, 20.0, 8.0F)};
  post::VerifiedBlock rapid = feed(2, 25.0, 7.0F);
  rapid.rapid = true;
  fine.blocks = {feed(1, 2.0, 1.0F),  feed(1, 4.0, 2.0F),  feed(1, 10.0, 3.0F),
                 feed(2, 15.0, 4.0F), feed(2, 20.0, 5.0F), rapid};
  EXPECT_THAT(laid_onto(fine, plain), testing::ElementsAre(9.0, 9.0, 9.0, 8.0, 8.0, 0.0));
  EXPECT_THAT(laid_onto(plain, fine), testing::ElementsAre(3.0, 5.0));
  EXPECT_THAT(laid_onto(fine, fine), testing::ElementsAre(1.0, 2.0, 3.0, 4.0, 5.0, 0.0));
  // Halves over thirds: the middle third lies on both halves.
  post::VerifyReport thirds, halves;
  thirds.blocks = {feed(1, 3.0, 0.0F), feed(1, 6.0, 0.0F), feed(1, 9.0, 0.0F)};
  halves.blocks = {feed(1, 4.5, 1.0F), feed(1, 9.0, 2.0F)};
  EXPECT_THAT(laid_onto(thirds, halves), testing::ElementsAre(1.0, 2.0, 2.0));
}

// A program of a million blocks: the page keeps the time, the worst places and all that is about them.
TEST(ProgramScene, OfAMillionBlocksKeepsTimeAndTheWorstPlaces) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  post::VerifyReport report;
  constexpr std::size_t kBlocks = 1'000'000;
  constexpr std::size_t kWorst = 654'321;
  report.tolerance_mm = 0.01;
  for (std::size_t i = 0; i < kBlocks; ++i) {
    report.blocks.push_back(feed(static_cast<std::uint32_t>(i + 1), 0.1 * static_cast<double>(i), 0.001F));
    report.blocks.back().nc_line = static_cast<std::uint32_t>(i + 1);
  }
  report.blocks[kWorst].tip_deviation_mm = 0.009F;
  report.worst.push_back({kWorst + 1, kWorst + 1, 0.009, Angle(), Vec3::Zero()});
  const std::string text = [] {
    std::string out;
    for (std::size_t i = 0; i < kBlocks; ++i) out += "G1 X" + std::to_string(i + 1) + " Y0 Z0\n";
    return out;
  }();
  const Scene scene = program_scene({machine, report, {}, nullptr, text});
  const auto column = [&](std::string_view name) -> const std::vector<double>& {
    for (const auto& c : scene.columns)
      if (c.name == name) return c.values;
    throw std::runtime_error("no column");
  };
  const auto& lines = column("nc_line");
  EXPECT_LT(lines.size(), 210'000U);
  double seconds = 0.0;
  for (const double s : column("seconds")) seconds += s;
  EXPECT_NEAR(seconds, 0.5 * kBlocks, 1e-3);
  ASSERT_EQ(scene.worst.size(), 1U);
  EXPECT_EQ(lines[scene.worst[0]], kWorst + 1);
  EXPECT_NEAR(column("tip_um")[scene.worst[0]], 9.0, 1e-3);
  for (std::size_t k = 0; k < 400; ++k) EXPECT_EQ(lines[scene.worst[0] - k], kWorst + 1 - k);
  // Its text is that of its line.
  ASSERT_TRUE(scene.texts.nc.of_blocks);
  std::size_t at = 0;
  for (std::size_t k = 0; k < scene.worst[0]; ++k) at = scene.texts.nc.lines.find('\n', at) + 1;
  EXPECT_EQ(scene.texts.nc.lines.substr(at, 11), "G1 X654322 ");
}

INSTANTIATE_TEST_SUITE_P(Shipped, Solids, testing::ValuesIn(test::shipped_machines()));

}  // namespace
}  // namespace trunnion::report
