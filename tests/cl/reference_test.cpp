// Real CL files of six CAM systems (TRUNNION_REFERENCE_DATA/cl). Counts are those of grep on the files.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <string>

#include "trunnion/base/files.hpp"

#include "cl/support.hpp"

namespace trunnion::cl {
namespace {

using test::joined;
using test::Reading;

class ReferenceCl : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("TRUNNION_REFERENCE_DATA");
    if (folder == nullptr) GTEST_SKIP() << "TRUNNION_REFERENCE_DATA is not set";
    folder_ = std::string(folder) + "/cl/";
  }
  Reading read(const std::string& name, const ReaderOptions& options = test::in_mm()) const {
    const auto text = read_file(folder_ + name);
    EXPECT_TRUE(text) << name;
    return text ? test::read(*text, options) : Reading{};
  }

 private:
  std::string folder_;
};

double tilt_deg(const Motion& motion) {
  return Angle::radians(std::atan2(motion.axis_P.head<2>().norm(), motion.axis_P.z())).deg();
}

std::pair<double, double> tilt_range_deg(const Reading& reading) {
  double least = INFINITY;
  double most = -INFINITY;
  for (const Motion& motion : reading.motions()) {
    least = std::min(least, tilt_deg(motion));
    most = std::max(most, tilt_deg(motion));
  }
  return {least, most};
}

std::size_t rapids(const Reading& reading) {
  const auto motions = reading.motions();
  return static_cast<std::size_t>(
      std::count_if(motions.begin(), motions.end(), [](const Motion& m) { return m.rapid; }));
}

TEST_F(ReferenceCl, ImpellerOfBareGotos) {
  const auto reading = read("impeller_yelun_goto6.cls");
  EXPECT_EQ(joined(reading.findings), "");
  EXPECT_EQ(reading.motions().size(), 52U);
  EXPECT_EQ(reading.motions()[0].tip_P, Vec3(74.9684, -35.1178, 112.8946));
  EXPECT_DOUBLE_EQ(reading.resolution.axis, 0.5e-7);
  const auto [least, most] = tilt_range_deg(reading);
  EXPECT_NEAR(least, 20.0, 0.5);
  EXPECT_NEAR(most, 90.0, 30.0);
}

TEST_F(ReferenceCl, CreoInInchesWithContinuedPoints) {
  const auto reading = read("creo9_proclfile_5x_multax_cut.ncl");
  // The file was cut in the middle of this point: it keeps the axis of the one before.
  EXPECT_EQ(joined(reading.findings),
            "6000:57: warning: continued by $, but the next line is a new GOTO: the statement is taken as it "
            "stands\n");
  const auto motions = reading.motions();
  EXPECT_EQ(motions.size(), 2994U);
  EXPECT_EQ(rapids(reading), 3U);
  EXPECT_NEAR(motions.back().tip_P.x(), 278.1093870791 * 25.4, 1e-9);
  EXPECT_NEAR(motions[2].feed.value, 1193.663081 * 25.4 / 60.0, 1e-9);
  EXPECT_EQ(reading.all<ToolChange>().at(0).number, 2U);
  EXPECT_NEAR(*reading.all<Spindle>().at(0).speed_rpm, 7957.753876, 1e-9);
  EXPECT_EQ(std::count_if(motions.begin(), motions.end(),
                          [](const Motion& m) { return tilt_deg(m) > 0.01 && tilt_deg(m) < 5.0; }),
            96);
}

TEST_F(ReferenceCl, NxContourWithItsMsysAndWithout) {
  const auto applied = read("nx_clsf_5x_variable_contour_large.cls");
  EXPECT_EQ(joined(applied.findings),
            "3:1: note: MSYS is applied: the points are in the absolute system (in it the tool axis points "
            "down)\n");
  EXPECT_EQ(applied.motions().size(), 20057U);
  EXPECT_EQ(rapids(applied), 459U);
  EXPECT_EQ(applied.all<ToolSelect>().at(0).number, 2U);
  EXPECT_EQ(applied.all<ToolGeometry>().at(0).corner_radius_mm, 5.0);
  const auto [least, most] = tilt_range_deg(applied);
  EXPECT_GE(least, 0.0);
  EXPECT_LT(most, 90.0);
  ReaderOptions ignore = test::in_mm();
  ignore.frames = ReaderOptions::Frames::ignore;
  const auto [least_ignored, most_ignored] =
      tilt_range_deg(read("nx_clsf_5x_variable_contour_large.cls", ignore));
  EXPECT_NEAR(least_ignored, 91.0, 0.5);
  EXPECT_EQ(most_ignored, 180.0);
}

TEST_F(ReferenceCl, SolidWorksThreePlusTwoWithItsHoles) {
  const auto reading = read("solidworkscam_3plus2_tilt.apt");
  EXPECT_EQ(joined(reading.findings), "");
  EXPECT_EQ(reading.all<ToolChange>().size(), 3U);
  const auto [least, most] = tilt_range_deg(reading);
  EXPECT_NEAR(least, 10.0, 1e-4);
  EXPECT_NEAR(most, 10.0, 1e-4);
  // The bottoms of the first tool's holes: 2.75344 below their points along the tool axis.
  const Vec3 axis = Vec3(-0.173648, 0, 0.984808).normalized();
  const auto motions = reading.motions();
  for (const double y : {10.0, 30.0}) {
    const Vec3 bottom = Vec3(15.756924, y, -6.156343) - 2.75344 * axis;
    EXPECT_TRUE(std::any_of(motions.begin(), motions.end(), [&](const Motion& m) {
      return (m.tip_P - bottom).norm() < 1e-9 && !m.rapid && std::abs(m.feed.value - 731.52 / 60.0) < 1e-9;
    }));
  }
}

TEST_F(ReferenceCl, NxCirclesAreRefusedForTheirCompensationAndReadWithoutIt) {
  const auto refused = read("nx_clsf_cutcom_circle.clsf");
  ASSERT_GE(refused.findings.size(), 2U);
  EXPECT_EQ(refused.findings[1],
            "17:1: error: CUTCOM/LEFT changes the geometry: whether the points are those of the tool's "
            "center the file "
            "does not say (--cutter-compensation tool-center or wear)");
  ReaderOptions options = test::in_mm();
  options.cutter_compensation = ReaderOptions::CutterCompensation::tool_center;
  options.mark_shapes = true;
  const auto reading = read("nx_clsf_cutcom_circle.clsf", options);
  EXPECT_EQ(joined(reading.findings),
            "3:1: note: MSYS: the points are taken as given in it\n"
            "17:1: warning: CUTCOM is left out: the points are those of the tool's center\n");
  EXPECT_EQ(reading.arcs().size(), 140U);
  std::size_t motions = reading.motions().size() + 140U;
  for (const ShapeBegin& shape : reading.all<ShapeBegin>()) motions -= shape.shape->motions;
  EXPECT_EQ(motions, 566U);
  // All of them lead in or out tangentially over a quarter turn: with the other sense it would be three.
  for (const Arc& arc : reading.arcs()) EXPECT_NEAR(arc.sweep.deg(), 90.0, 0.01);
}

TEST_F(ReferenceCl, CatiaTurningIsRefusedByName) {
  const auto reading = read("catia_v5_icam_pptable_turn_cycle.aptsource");
  std::vector<std::string> errors;
  for (const std::string& finding : reading.findings) {
    if (finding.find(" error: ") != std::string::npos) errors.push_back(finding.substr(0, finding.find(' ')));
  }
  EXPECT_EQ(errors, (std::vector<std::string>{"29:1:"}));  // TURRET; the rest is not read
}

}  // namespace
}  // namespace trunnion::cl
