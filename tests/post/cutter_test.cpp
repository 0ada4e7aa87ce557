// Cutter compensation that adds wear to a path of the tool's centre.
#include <gtest/gtest.h>

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

PostOptions with(cl::ReaderOptions::CutterCompensation choice) {
  PostOptions options;
  options.cl.cutter_compensation = choice;
  return options;
}
PostOptions wear() {
  return with(cl::ReaderOptions::CutterCompensation::wear);
}

// A contour across a tilted tool axis, led in and out by lines, as NX writes it.
std::string contour(const std::string& lead_in = "", const std::string& inside = "") {
  const Vec3 axis(0.0, 0.6, 0.8);
  const auto point = [&](double x, double y, double height) {
    const Vec3 tip = Vec3(x, 0.0, 0.0) + y * Vec3(0.0, 0.8, -0.6) + height * axis;
    return "GOTO/" + fixed_text(tip.x(), 4) + "," + fixed_text(tip.y(), 4) + "," + fixed_text(tip.z(), 4) +
           ",0,0.6,0.8\n";
  };
  std::string cl = "LOADTL/7\nSPINDL/RPM,3000,CLW\nFEDRAT/MMPM,500\nRAPID\n" + point(-5, -5, 20);
  cl += point(-5, -5, 0) + "CUTCOM/LEFT,XYPLAN\n" + (lead_in.empty() ? point(0, -2, 0) : lead_in);
  cl += point(0, 30, 0) + inside + point(40, 30, 0) + point(40, -2, 0);
  return cl + "CUTCOM/OFF\n" + point(45, -5, 0) + "RAPID\n" + point(45, -5, 20) + "FINI\n";
}

std::string without(std::string text, const std::string& word) {
  for (auto at = text.find(word); at != std::string::npos; at = text.find(word)) text.erase(at, word.size());
  return text;
}

// LinuxCNC's register is an entry of the tool table: the wear has one of its own there.
std::string contour_of(const std::string& control) {
  std::string cl = contour();
  if (control == "linuxcnc") cl.replace(cl.find("LEFT,XYPLAN"), 11, "LEFT,XYPLAN,ADJUST,95");
  return cl;
}

TEST(Cutter, WearGoesOutWithTheLinesThatLeadInAndOut) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const std::string control : {"linuxcnc", "fanuc_30i", "haas_ngc"}) {
    const std::string number = control == "linuxcnc" ? "95" : "7";
    const auto p = test::posted(contour_of(control), machine, wear(), control);
    ASSERT_TRUE(p.report) << control << ": " << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed()) << control;
    const auto on = p.nc.find("G41 D" + number + " X");
    const auto off = p.nc.find("G40 X");
    EXPECT_NE(on, std::string::npos) << p.nc;
    EXPECT_NE(off, std::string::npos) << p.nc;
    EXPECT_LT(on, off);
    EXPECT_NE(p.nc.find("REGISTER " + number + " HOLDS WEAR ONLY"), std::string::npos) << p.nc;
    // The path itself is that of the tool's centre.
    const auto centre =
        test::posted(contour(), machine, with(cl::ReaderOptions::CutterCompensation::tool_center), control);
    ASSERT_TRUE(centre.report);
    EXPECT_EQ(centre.report->points_in, p.report->points_in);
    EXPECT_EQ(centre.report->verification->points_out, p.report->verification->points_out);
    const auto again = test::verified(p.nc, contour(), machine, 0.01, control);
    EXPECT_FALSE(again);  // CUTCOM is refused unless somebody says what the points are
  }
}

// One table for both on some controls: the contour would be off by the length of the tool.
TEST(Cutter, ARegisterThatHoldsTheLengthIsDoubted) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto doubted = [&](const std::string& cl) {
    const auto p = test::posted(cl, machine, wear(), "fanuc_30i");
    EXPECT_TRUE(p.report) << cl;
    const auto& findings = p.diagnostics.findings();
    return std::any_of(findings.begin(), findings.end(), [](const Finding& f) {
      return f.message.find("is that of the tool's length, too") != std::string::npos;
    });
  };
  std::string cl = contour();
  EXPECT_TRUE(doubted(cl));
  cl.replace(cl.find("LEFT,XYPLAN"), 11, "LEFT,XYPLAN,ADJUST,21");
  EXPECT_FALSE(doubted(cl));
}

TEST(Cutter, TheRegisterIsThatOfTheWord) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::string cl = contour();
  cl.replace(cl.find("LEFT,XYPLAN"), 11, "RIGHT,XYPLAN,ADJUST,21");
  const auto p = test::posted(cl, machine, wear());
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_NE(p.nc.find("G42 D21 X"), std::string::npos) << p.nc;
}

TEST(Cutter, WhatAControlWouldNotTakeIsAnErrorByItsLine) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto error = [&](const std::string& cl, const std::string& control) {
    const auto p = test::posted(cl, machine, wear(), control);
    return p.report ? "no error" : p.report.error().text();
  };
  const auto expect = [&](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_NE(text.find("part.cls:"), std::string::npos) << text;
  };
  // Their compensation takes the radius of the tool, not of a register.
  for (const std::string control : {"siemens_840d_sl", "heidenhain_tnc640", "hnc_8"})
    expect(error(contour(), control), "no words for it");
  // D4 of LinuxCNC is tool 4, whose diameter counts: the contour would be off by the cutter's radius.
  expect(error(contour(), "linuxcnc"), "register 7 is tool 7 of the tool table");
  expect(error(contour("GOTO/-5,-7,-1,0,0.6,0.8\n"), "fanuc_30i"), "a line across the tool axis");
  expect(error(contour("", "GOTO/10,10,10,0,0.5,0.8660254\n"), "fanuc_30i"), "the tool axis turns");
  expect(error(contour("", "RAPID\n"), "fanuc_30i"), "CUTCOM/OFF is missing before this rapid");
  expect(error(without(contour(), "CUTCOM/OFF\n"), "fanuc_30i"), "CUTCOM/OFF is missing");
  // The control would lead in or out on the way to or from the safe height.
  for (const std::string word : {"STOP\n", "ROTATE/CAXIS,ATANGL,30\n", "SPINDL/OFF\n"}) {
    std::string on = contour();
    on.insert(on.find("CUTCOM/LEFT"), word);
    expect(error(on, "fanuc_30i"), "the tool must have been positioned before it is switched on");
    expect(error(contour("", word), "fanuc_30i"), "CUTCOM/OFF is missing before the tool leaves the part");
    std::string off = contour();
    off.insert(off.find("CUTCOM/OFF"), word);
    expect(error(off, "fanuc_30i"), "CUTCOM");
  }
  const std::string ends = contour().substr(0, contour().find("CUTCOM/OFF")) + "FINI\n";
  EXPECT_NE(error(ends, "fanuc_30i").find("CUTCOM/OFF is missing"), std::string::npos)
      << error(ends, "fanuc_30i");
  std::string plane = contour();
  plane.replace(plane.find("XYPLAN"), 6, "ZXPLAN");
  const auto p = test::posted(plane, machine, wear());
  ASSERT_FALSE(p.report);
  EXPECT_NE(p.report.error().text().find("'ZXPLAN' is not understood"), std::string::npos)
      << p.report.error().text();
  PostOptions rtcp = wear();
  rtcp.rtcp = true;
  const auto under = test::posted(contour(), machine, rtcp, "fanuc_30i");
  ASSERT_FALSE(under.report);
  EXPECT_NE(under.report.error().text().find("tool-centre-point"), std::string::npos);
}

// Words of a shop's own that leave a control in a state in which it runs the rest as nobody has judged it.
TEST(Cutter, AProgramInWhoseWordsAnErrorIsFoundIsNone) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl =
      "LOADTL/1,LENGTH,100\nRAPID\nGOTO/0,0,60,0,0,1\nFEDRAT/500,MMPM\nGOTO/0,0,0\nGOTO/20,0,0\nRAPID\n"
      "GOTO/20,0,60\nFINI\n";
  for (const char* control : {"fanuc_30i", "haas_ngc", "linuxcnc"}) {
    nc::Controller c = with_axes_of(machine, test::shipped_controller(control));
    PostJob job;
    job.cl_file = "part.cls";
    job.machine = &machine;
    job.controller = &c;
    Diagnostics d;
    const auto sink = [](std::string_view) { return Result<void>{}; };
    const auto right = post::post(std::make_unique<test::TextOf>(cl), job, {}, sink, d);
    ASSERT_TRUE(right && right->verification->passed()) << control;
    c.program.setup.emplace_back("G41 D91");
    const auto wrong = post::post(std::make_unique<test::TextOf>(cl), job, {}, sink, d);
    ASSERT_FALSE(wrong) << control;
    EXPECT_NE(wrong.error().text().find("no program is written"), std::string::npos) << wrong.error().text();
    EXPECT_TRUE(d.has_errors()) << control;
  }
}

// With the wear in the registers.
Result<VerifyReport> judged(const std::string& nc, const std::string& cl, Diagnostics& d,
                            const std::string& control = "linuxcnc") {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const nc::Controller c = test::shipped_controller(control);
  VerifyOptions options;
  options.tolerance_mm = 0.01;
  return post::verify({std::make_unique<test::TextOf>(cl), "part.cls", wear().cl},
                      {std::make_unique<test::TextOf>(nc), "part.nc"}, {machine, c, options}, d);
}

TEST(Cutter, ATurnOfTheTableUnderCompensationIsFound) {
  const std::string cl = contour_of("linuxcnc");
  const auto p = test::posted(cl, test::shipped_machine("trunnion_offset"), wear());
  ASSERT_TRUE(p.report) << p.report.error().text();
  Diagnostics right, wrong;
  const auto report = judged(p.nc, cl, right);
  EXPECT_TRUE(report && report->passed());
  EXPECT_EQ(right.error_count(), 0U);
  std::string edited = p.nc;
  edited.insert(edited.find('\n', edited.find("G41 D95 X")), " A30.5");
  static_cast<void>(judged(edited, cl, wrong));
  EXPECT_GT(wrong.error_count(), 0U);
}

// The points on the line of the wall are met by a longer block, too: the wear would come in along the wall.
TEST(Cutter, TheWaysInAndOutEndWhereTheyAreAskedTo) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl =
      "LOADTL/4\nSPINDL/3000,CLW\nFEDRAT/500,MMPM\nRAPID\nGOTO/0,-20,60\nGOTO/0,-20,10\nCUTCOM/LEFT,24\n"
      "GOTO/0,0,10\nGOTO/0,40,10\nCUTCOM/OFF\nGOTO/0,60,10\nGOTO/0,80,10\nRAPID\nGOTO/0,80,60\nFINI\n";
  for (const char* control : {"fanuc_30i", "haas_ngc", "linuxcnc"}) {
    const auto p = test::posted(cl, machine, wear(), control);
    ASSERT_TRUE(p.report) << control << p.report.error().text();
    Diagnostics none;
    const auto as_written = judged(p.nc, cl, none, control);
    ASSERT_TRUE(as_written && as_written->passed()) << control << p.nc;
    for (const std::string word : {"G41 D24 ", "G40 "}) {
      std::string nc = p.nc;
      const auto at = nc.rfind(word);
      ASSERT_NE(at, std::string::npos) << control << nc;
      const auto end = nc.find('\n', at);
      // The block of the word goes to where the next one ends.
      nc.erase(at + word.size(), nc.find_first_of("XY", end) - at - word.size());
      Diagnostics d;
      const auto report = judged(nc, cl, d, control);
      ASSERT_TRUE(report) << control << ": " << word << nc;
      const Check& path = report->checks[static_cast<std::size_t>(CheckOf::path)];
      ASSERT_FALSE(path.places.empty()) << control << ": " << word << nc;
      EXPECT_NE(path.places.front().what.find("ends beyond"), std::string::npos) << path.places.front().what;
    }
  }
}

// A lead-in along the wall has nothing that thinning needs, but for the end of the way in.
TEST(Cutter, ThinningKeepsTheEndsOfTheWaysInAndOut) {
  const std::string cl =
      "LOADTL/7\nSPINDL/1200,CLW\nRAPID\nGOTO/0,-20,60,0,0,1\nFEDRAT/300,MMPM\nGOTO/0,-20,10\nCUTCOM/"
      "LEFT,27\n"
      "GOTO/0,0,10\nGOTO/0,20,10\nGOTO/0,40,10\nCUTCOM/OFF\nGOTO/0,60,10\nGOTO/0,80,10\nRAPID\nGOTO/0,80,60\n"
      "FINI\n";
  PostOptions options = wear();
  options.nonlinear.thin = true;
  for (const char* control : {"fanuc_30i", "haas_ngc", "linuxcnc"}) {
    const auto p = test::posted(cl, test::shipped_machine("trunnion_offset"), options, control);
    ASSERT_TRUE(p.report) << control << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed()) << control << p.nc;
    EXPECT_EQ(p.nc.find("Y20"), std::string::npos) << control << p.nc;  // thinned
  }
}

// Its whole diameter would count: in a program that was edited so, as its CL file, and of a tool that comes
// later.
TEST(Cutter, AnEntryOfAToolIsNoWear) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto says_so = [](const Result<VerifyReport>& report) {
    if (!report || report->passed()) return false;
    for (const Check& check : report->checks)
      for (const auto& place : check.places)
        if (place.what.find("half the diameter of that tool") != std::string::npos) return true;
    return false;
  };
  std::string cl = contour_of("linuxcnc");
  std::string nc = test::posted(cl, machine, wear()).nc;
  nc.replace(nc.find("G41 D95"), 7, "G41 D7");
  cl.replace(cl.find("ADJUST,95"), 9, "ADJUST,7");
  Diagnostics d;
  EXPECT_TRUE(says_so(judged(nc, cl, d)));
  std::string later = contour_of("linuxcnc");
  later.replace(later.find("FINI"), 4, "LOADTL/95\nSPINDL/RPM,900,CLW\nGOTO/0,0,60,0,0,1\nGOTO/0,0,40\nFINI");
  const auto p = test::posted(later, machine, wear());
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_FALSE(p.report->verification->passed());
  EXPECT_TRUE(says_so(judged(p.nc, later, d)));
}

}  // namespace
}  // namespace trunnion::post
