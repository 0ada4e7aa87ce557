// One part in the words of every control: tests/golden. Each program is read back by our reader, and all give
// the same tip path. TRUNNION_WRITE_GOLDEN=1 writes the programs anew: look at what changed before you commit
// it.
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <gtest/gtest.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"

#include "post/posting.hpp"
#include "support/folders.hpp"

namespace trunnion::post {
namespace {

const std::string kFolder = test::source_folder() + "/tests/golden/";

struct Variant {
  std::string control;
  bool rtcp = false;
  bool plane = false;
  std::string file() const { return kFolder + control + (rtcp ? "_rtcp" : plane ? "_plane" : "") + ".nc"; }
};

std::vector<Variant> variants() {
  std::vector<Variant> out;
  for (const std::string& control : test::shipped_controllers()) {
    out.push_back({control, false, false});
    const nc::Controller c = test::shipped_controller(control);
    if (c.has_tcp()) out.push_back({control, true, false});
    if (c.has_tilted_plane()) out.push_back({control, false, true});
  }
  return out;
}

PostOptions options_of(const Variant& v) {
  PostOptions options;
  options.tolerance_mm = 0.01;
  options.rtcp = v.rtcp;
  options.tilted_plane = v.plane;
  if (v.rtcp) options.feed = FeedOutput::tip;
  return options;
}

std::string part() {
  return read_file(kFolder + "part.cls").value_or("");
}

TEST(Golden, EveryControlHasItsProgramAndWritesItAgain) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  ASSERT_FALSE(part().empty());
  for (const Variant& v : variants()) {
    const auto p = test::posted(part(), machine, options_of(v), v.control);
    ASSERT_TRUE(p.report) << v.file() << ": " << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed()) << v.file();
    if (std::getenv("TRUNNION_WRITE_GOLDEN") != nullptr) std::ofstream(v.file()) << p.nc;
    EXPECT_EQ(p.nc, read_file(v.file()).value_or("")) << v.file();
  }
}

// Circles and holes in the words of every control that has them.
TEST(Golden, EveryControlWritesArcsAndHolesInItsOwnWords) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl = read_file(kFolder + "shapes.cls").value_or("");
  PostOptions options;
  options.native_arcs = true;
  options.native_cycles = true;
  for (const std::string& control : test::shipped_controllers()) {
    const nc::Controller c = test::shipped_controller(control);
    if (c.arcs.clockwise.empty()) continue;
    SCOPED_TRACE(control);
    const std::string file = kFolder + control + "_native.nc";
    const auto p = test::posted(cl, machine, options, control);
    ASSERT_TRUE(p.report) << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed());
    EXPECT_GE(p.report->arcs, 2U);
    EXPECT_GE(p.report->holes, 5U);
    if (std::getenv("TRUNNION_WRITE_GOLDEN") != nullptr) std::ofstream(file) << p.nc;
    EXPECT_EQ(p.nc, read_file(file).value_or(""));
    const auto again = test::verified(read_file(file).value_or(""), cl, machine, 0.01, control);
    ASSERT_TRUE(again);
    EXPECT_TRUE(again->passed());
  }
}

// Where each program has its tip at every point of the CL file, from its text alone.
TEST(Golden, AllProgramsGiveTheSameTipPathWithinOneDigit) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  Diagnostics d;
  const auto program = cl::read_program(part(), "part.cls", {}, d);
  ASSERT_TRUE(program);
  std::vector<std::vector<Vec3>> paths;
  for (const Variant& v : variants()) {
    const std::string text = read_file(v.file()).value_or("");
    const auto report = test::verified(text, part(), machine, 0.01, v.control, true);
    ASSERT_TRUE(report) << v.file();
    EXPECT_TRUE(report->passed()) << v.file();
    const nc::Controller c = test::shipped_controller(v.control);
    const double digit = std::pow(10.0, -c.numbers.axes.decimals(nc::AxisLetter::X));
    // Every point of the CL file is the end of a block, in order.
    std::vector<Vec3> path;
    std::size_t block = 0;
    for (const cl::Record& record : program->records) {
      const auto* motion = std::get_if<cl::Motion>(&record.data);
      if (motion == nullptr) continue;
      const auto there = [&] {
        return (report->blocks[block].tip_P - motion->tip_P).cwiseAbs().maxCoeff() <= digit;
      };
      while (block < report->blocks.size() && !there()) ++block;
      ASSERT_LT(block, report->blocks.size()) << v.file() << " line " << record.where.line;
      path.push_back(report->blocks[block].tip_P);
    }
    EXPECT_EQ(path.size(), 23U) << v.file();
    paths.push_back(path);
  }
  for (const auto& path : paths) {
    for (std::size_t k = 0; k < path.size(); ++k) EXPECT_LE((path[k] - paths[0][k]).norm(), 0.002);
  }
}

}  // namespace
}  // namespace trunnion::post
