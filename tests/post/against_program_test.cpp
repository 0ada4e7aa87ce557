// Programs judged against the path of another NC program (verify --against PROGRAM --from): what was posted
// from it passes, whatever control and machine it was for; a word that is another one on either side is
// found.
#include <gtest/gtest.h>
#include <random>

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

struct MadeFor {
  Machine machine;
  std::string control;
};

NcOrigin origin_of(const MadeFor& made_for, const nc::Controller& control) {
  return {&made_for.machine, &control, FromPath::points};
}

// `path` is a program for the one, and becomes one for the other.
test::Posted posted_from(const std::string& path, const MadeFor& from, const MadeFor& to) {
  const nc::Controller c0 = with_axes_of(from.machine, test::shipped_controller(from.control));
  const nc::Controller c = with_axes_of(to.machine, test::shipped_controller(to.control));
  const NcOrigin origin = origin_of(from, c0);
  PostJob job;
  job.cl_file = "path.nc";
  job.from = &origin;
  job.machine = &to.machine;
  job.controller = &c;
  test::Posted out;
  out.report = post(
      std::make_unique<test::TextOf>(path), job, {},
      [&](std::string_view text) {
        out.nc += text;
        return Result<void>{};
      },
      out.diagnostics);
  return out;
}

Result<VerifyReport> judged(const std::string& program, const MadeFor& of, const std::string& path,
                            const MadeFor& from) {
  const nc::Controller c0 = with_axes_of(from.machine, test::shipped_controller(from.control));
  const nc::Controller c = with_axes_of(of.machine, test::shipped_controller(of.control));
  const NcOrigin origin = origin_of(from, c0);
  Diagnostics d;
  VerifyOptions options;
  options.axis_tolerance = of.machine.axis_tolerance;
  return verify({std::make_unique<test::TextOf>(path), "path.nc", {}, &origin},
                {std::make_unique<test::TextOf>(program), "part.nc"}, {of.machine, c, options}, d);
}

bool passes(const std::string& program, const MadeFor& of, const std::string& path, const MadeFor& from) {
  const auto report = judged(program, of, path, from);
  return report && report->passed();
}

std::string with(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

TEST(AgainstProgram, WhatWasPostedFromItPassesOnEveryControl) {
  const MadeFor to{test::shipped_machine("nutating_45"), "linuxcnc"};
  for (const std::string& control : test::shipped_controllers()) {
    const MadeFor from{test::shipped_machine("trunnion_offset"), control};
    const auto path = test::posted(test::sample_path(3), from.machine, {}, control);
    ASSERT_TRUE(path.report) << control;
    EXPECT_TRUE(passes(path.nc, from, path.nc, from)) << control;
    const auto there = posted_from(path.nc, from, to);
    ASSERT_TRUE(there.report) << control << ": " << there.report.error().text();
    EXPECT_TRUE(passes(there.nc, to, path.nc, from)) << control;
  }
}

TEST(AgainstProgram, AnotherWordOnEitherSideIsFound) {
  const MadeFor from{test::shipped_machine("trunnion_offset"), "linuxcnc"};
  const MadeFor to{test::shipped_machine("nutating_45"), "linuxcnc"};
  const auto path = test::posted(test::sample_path(3), from.machine);
  ASSERT_TRUE(path.report);
  const auto there = posted_from(path.nc, from, to);
  ASSERT_TRUE(there.report) << there.report.error().text();
  ASSERT_TRUE(passes(there.nc, to, path.nc, from));
  std::mt19937_64 random(5);
  for (int i = 0; i < 60; ++i) {
    EXPECT_FALSE(passes(test::with_changed_word(there.nc, random, 0.05), to, path.nc, from)) << i;
    EXPECT_FALSE(passes(there.nc, to, test::with_changed_word(path.nc, random, 0.05), from)) << i;
  }
  for (const auto& [what, by] : std::initializer_list<std::pair<const char*, const char*>>{
           {"S8000 M3", "S800 M3"}, {"S8000 M3", "S8000 M4"}, {"M8\n", "M7\n"}, {"T3 M6", "T4 M6"}}) {
    EXPECT_FALSE(passes(there.nc, to, with(path.nc, what, by), from)) << by;
    EXPECT_FALSE(passes(with(there.nc, what, by), to, path.nc, from)) << by;
  }
}

// The machine that the program was made for is part of what it says.
TEST(AgainstProgram, TheMachineThatItWasMadeForCounts) {
  const MadeFor from{test::shipped_machine("trunnion_offset"), "linuxcnc"};
  const auto path = test::posted(test::sample_path(3), from.machine);
  ASSERT_TRUE(path.report);
  MadeFor other = from;
  for (Axis& axis : other.machine.axes)
    if (axis.name == "C") axis.point_mm.y() += 0.05;
  EXPECT_FALSE(passes(path.nc, from, path.nc, other));
  EXPECT_FALSE(passes(path.nc, from, path.nc, {from.machine, "heidenhain_tnc640"}));
}

TEST(AgainstProgram, WhatThePathDoesNotSayIsRefusedByItsLine) {
  const MadeFor from{test::shipped_machine("trunnion_offset"), "linuxcnc"};
  const auto path = test::posted(test::sample_path(3), from.machine);
  ASSERT_TRUE(path.report);
  const auto report = judged(path.nc, from, with(path.nc, "\nM2", "\nM98 P1\nM2"), from);
  ASSERT_FALSE(report);
  EXPECT_NE(report.error().text().find("path.nc:"), std::string::npos) << report.error().text();
  EXPECT_NE(report.error().text().find("M98"), std::string::npos);
}

}  // namespace
}  // namespace trunnion::post
