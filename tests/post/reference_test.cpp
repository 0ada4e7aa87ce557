// Real CL files of other people's CAM systems, read from the folder in TRUNNION_REFERENCE_DATA.
#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>

#include "trunnion/post/post.hpp"

#include "support/folders.hpp"
#include "support/machines.hpp"

namespace trunnion::post {
namespace {

// The paper's machine with room for parts that stand anywhere.
Machine roomy_machine() {
  Machine machine = test::shipped_machine("paper");
  for (Axis& axis : machine.axes) {
    if (axis.kind != AxisKind::linear) continue;
    axis.min = -50000.0;
    axis.max = 50000.0;
  }
  machine.safe.to_mm[2] = 50000.0;  // the end of the travel
  return machine;
}

struct ReferenceOutcome {
  Result<PostReport> report;
  Diagnostics diagnostics;
};

ReferenceOutcome reference_post(const std::string& name, PostOptions options) {
  options.tools.tool = 1;
  const Machine machine = roomy_machine();
  Diagnostics d;
  const auto controller =
      nc::load_controller(test::source_folder() + "/postconfigs/controllers/linuxcnc.toml", d);
  EXPECT_TRUE(controller);
  PostJob job;
  job.cl_file = name;
  job.machine = &machine;
  job.controller = &*controller;
  ReferenceOutcome out;
  auto source = cl::open_source(std::string(std::getenv("TRUNNION_REFERENCE_DATA")) + "/cl/" + name);
  if (!source) {
    out.report = tl::unexpected(source.error());
    return out;
  }
  out.report = post(
      std::move(*source), job, options, [](std::string_view) { return Result<void>{}; }, out.diagnostics);
  return out;
}

class RealClFiles : public testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("TRUNNION_REFERENCE_DATA") == nullptr)
      GTEST_SKIP() << "skipped: TRUNNION_REFERENCE_DATA is not set";
  }
};

TEST_F(RealClFiles, ImpellerCreoSolidworksAndNxPostWithinTolerance) {
  for (const char* name : {"impeller_yelun_goto6.cls", "creo9_proclfile_5x_multax_cut.ncl",
                           "solidworkscam_3plus2_tilt.apt", "nx_clsf_5x_variable_contour_large.cls"}) {
    const ReferenceOutcome p = reference_post(name, {});
    ASSERT_TRUE(p.report) << name << ": " << p.report.error().text();
    const VerifyReport& v = *p.report->verification;
    EXPECT_TRUE(v.passed()) << name << ": tip " << v.certified_tip_deviation_mm << " mm, missed "
                            << v.points_missed;
  }
}

TEST_F(RealClFiles, NxContourIsOutOfReachWithoutItsMsys) {
  PostOptions options;
  options.cl.frames = cl::ReaderOptions::Frames::ignore;
  const ReferenceOutcome p = reference_post("nx_clsf_5x_variable_contour_large.cls", options);
  ASSERT_FALSE(p.report);
  EXPECT_EQ(p.report.error().code, ErrorCode::check_failed);
  EXPECT_NE(p.report.error().message.find("cannot be reached"), std::string::npos);
}

// A file whose geometry is not fully understood must say which word it is.
TEST_F(RealClFiles, TheOthersPostOrNameTheWord) {
  for (const char* name : {"nx_clsf_cutcom_circle.clsf", "catia_v5_icam_pptable_turn_cycle.aptsource"}) {
    const ReferenceOutcome p = reference_post(name, {});
    if (p.report) {
      EXPECT_TRUE(p.report->verification->passed()) << name;
    } else {
      EXPECT_EQ(p.report.error().code, ErrorCode::wrong_input) << p.report.error().text();
      EXPECT_GT(p.report.error().where.line, 0u);
    }
  }
}

}  // namespace
}  // namespace trunnion::post
