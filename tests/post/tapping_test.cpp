// Threads: CYCLE/TAP becomes the control's tapping cycle and passes its verification; a word of it that would
// cut another thread, or none, does not.
#include <gtest/gtest.h>

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

std::vector<std::string> controls_that_tap() {
  std::vector<std::string> out;
  for (const std::string& control : test::shipped_controllers())
    if (!test::shipped_controller(control).cycles.tap.empty()) out.push_back(control);
  return out;
}

// Two threads of M6 (right-hand) or one hand more, and a cut behind them with the same tool.
std::string threads(const std::string& spindle, const std::string& feed, const std::string& axis = "0,0,1") {
  return "PARTNO THREADS\nLOADTL/3\nSPINDL/RPM,500," + spindle +
         "\nCOOLNT/FLOOD\nFEDRAT/MMPM,700\nRAPID\nGOTO/0,0,60," + axis + "\nCYCLE/TAP,FEDTO,-12.5," + feed +
         ",RAPTO,4.,RTRCTO,10.\nGOTO/5,0,20\nGOTO/5,8,20\nCYCLE/OFF\n" +
         "RAPID\nGOTO/30,0,60\nGOTO/30,0,40\nGOTO/35,0,40\nRAPID\nGOTO/35,0,60\nFINI\n";
}

bool has(const std::string& text, const std::string& what) {
  return text.find(what) != std::string::npos;
}

std::string with(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what << "\n" << text;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

// As often as it stands there.
std::string with_all(std::string text, const std::string& what, const std::string& by) {
  EXPECT_TRUE(has(text, what)) << what << "\n" << text;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

const std::string kTilted = "0.0,-0.5,0.8660254";

TEST(Tapping, EveryControlGetsItsCycle) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  EXPECT_EQ(controls_that_tap().size(), 6u);
  for (const std::string& control : controls_that_tap()) {
    for (const std::string spindle : {"CLW", "CCLW"}) {
      for (const std::string feed : {"MMPR,1.0", "MMPM,500."}) {
        for (const std::string& axis : {std::string("0,0,1"), kTilted}) {
          const auto p = test::posted(threads(spindle, feed, axis), machine, {}, control);
          ASSERT_TRUE(p.report) << control << ": " << p.report.error().text();
          EXPECT_TRUE(p.report->verification->passed()) << control << "\n" << p.nc;
          EXPECT_EQ(p.report->holes, 2u);
        }
      }
    }
  }
}

// What the manuals and LinuxCNC's interpreter say: M6 at 500 rpm is 500 mm/min.
TEST(Tapping, WordsAreThoseOfTheControl) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto text = [&](const std::string& control, const std::string& spindle) {
    return test::posted(threads(spindle, "MMPR,1.0"), machine, {}, control).nc;
  };
  EXPECT_TRUE(has(text("fanuc_30i", "CLW"), "M29 S500\n"));
  EXPECT_TRUE(has(text("fanuc_30i", "CLW"), "G98 G84 X5. Y0. Z7.5 R24. F500."));
  EXPECT_TRUE(has(text("fanuc_30i", "CCLW"), "G74 X5."));
  EXPECT_TRUE(has(text("haas_ngc", "CLW"), "G84 X5."));
  EXPECT_TRUE(has(text("siemens_840d_sl", "CLW"), "CYCLE84(30"));
  EXPECT_TRUE(has(text("siemens_840d_sl", "CLW"), ",,,5,,1"));
  EXPECT_TRUE(has(text("siemens_840d_sl", "CCLW"), ",,,5,,-1"));
  EXPECT_TRUE(has(text("heidenhain_tnc640", "CLW"), "CYCL DEF 207"));
  EXPECT_TRUE(has(text("heidenhain_tnc640", "CCLW"), "Q239=-1"));
  EXPECT_TRUE(has(text("linuxcnc", "CLW"), "G33.1 Z7.5000 K1.000000"));
}

struct WrongThread {
  const char* control;
  const char* what;
  const char* by;
};

TEST(Tapping, AWrongThreadIsFound) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl = threads("CLW", "MMPR,1.0");
  for (const WrongThread& w : std::initializer_list<WrongThread>{
           // pitch: M6 fine, a percent
           {"iso", "F500.", "F400."},
           {"fanuc_30i", "R24. F500.", "R24. F505."},
           {"haas_ngc", "R24. F500.", "R24. F495."},
           {"siemens_840d_sl", "5,,1", "5,,0.75"},
           {"heidenhain_tnc640", "Q239=+1", "Q239=+1.25"},
           {"linuxcnc", "K1.000000", "K1.010000"},
           // hand
           {"iso", "G84", "G74"},
           {"fanuc_30i", "G84", "G74"},
           {"haas_ngc", "G84", "G74"},
           {"siemens_840d_sl", "5,,1", "5,,-1"},
           {"heidenhain_tnc640", "Q239=+1", "Q239=-1"},
           // speed
           {"fanuc_30i", "M29 S500", "M29 S600"},
           {"siemens_840d_sl", ",0,500,0)", ",0,600,0)"},
           {"siemens_840d_sl", ",0,500,0)", ",0,500,900)"},
           {"linuxcnc", "S500 M3", "S600 M3"},
           // rigid no longer
           {"fanuc_30i", "M29 S500\n", "M8\n"},
           // another cycle
           {"iso", "G84", "G81"},
           {"fanuc_30i", "G84", "G85"},
           {"haas_ngc", "G84", "G85"},
           {"linuxcnc", "G33.1 Z7.5000 K1.000000", "G1 Z7.5000 F500.000\nG1 Z24.0000"},
           {"heidenhain_tnc640", "CYCL DEF 207 RIGID TAPPING NEW", "CYCL DEF 200 DRILLING"},
           // depth and height
           {"fanuc_30i", "Z7.5 R24.", "Z6.5 R24."},
           {"linuxcnc", "Z7.5000 K", "Z6.5000 K"}}) {
    const auto p = test::posted(cl, machine, {}, w.control);
    ASSERT_TRUE(p.report) << w.control;
    ASSERT_TRUE(test::verified(p.nc, cl, machine, 0.01, w.control)->passed());
    const auto report = test::verified(with(p.nc, w.what, w.by), cl, machine, 0.01, w.control);
    EXPECT_FALSE(report && report->passed()) << w.control << ": " << w.what << " -> " << w.by;
  }
}

// Off, or the other way round, or not said again behind the thread.
TEST(Tapping, AWrongSpindleIsFound) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl = threads("CLW", "MMPR,1.0");
  for (const std::string& control : controls_that_tap()) {
    const auto p = test::posted(cl, machine, {}, control);
    ASSERT_TRUE(p.report) << control;
    const auto passes = [&](const std::string& nc) {
      const auto report = test::verified(nc, cl, machine, 0.01, control);
      return report && report->passed();
    };
    ASSERT_TRUE(passes(p.nc)) << control;
    const auto tap = std::min({p.nc.find("G84"), p.nc.find("M29"), p.nc.find("CYCLE84"),
                               p.nc.find("CYCL DEF 207"), p.nc.find("G33.1")});
    ASSERT_NE(tap, std::string::npos) << control;
    const auto line = p.nc.rfind('\n', tap) + 1;
    for (const std::string stop : {"M5", "M4", "S400 M3"}) {
      const std::string at = control == "heidenhain_tnc640" && stop == "M4" ? "M4" : stop;
      EXPECT_FALSE(passes(p.nc.substr(0, line) + at + "\n" + p.nc.substr(line))) << control << " " << stop;
    }
    // Said again behind the last thread, before the cut.
    const auto again = p.nc.find("M3", tap);
    ASSERT_NE(again, std::string::npos) << control << "\n" << p.nc;
    const auto begin = p.nc.rfind('\n', again) + 1;
    const auto end = p.nc.find('\n', again) + 1;
    EXPECT_FALSE(passes(p.nc.substr(0, begin) + p.nc.substr(end)))
        << control << p.nc.substr(begin, end - begin);
  }
}

TEST(Tapping, ADrilledHoleIsNoThread) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::string drilled = with(threads("CLW", "MMPM,500."), "CYCLE/TAP", "CYCLE/REAM");
  PostOptions native;
  native.native_cycles = true;
  const auto p = test::posted(drilled, machine, native, "fanuc_30i");
  ASSERT_TRUE(p.report && has(p.nc, "G85"));
  const auto report = test::verified(with_all(p.nc, "G85", "G84"), drilled, machine, 0.01, "fanuc_30i");
  EXPECT_FALSE(report && report->passed());
}

// M1 before a thread is what a shop writes every day.
TEST(Tapping, AStopOrAReversalMayStandBeforeIt) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const char* control : {"fanuc_30i", "haas_ngc", "linuxcnc", "siemens_840d_sl", "heidenhain_tnc640"}) {
    for (const char* word : {"STOP\n", "OPSTOP\n", "SPINDL/OFF\nSPINDL/RPM,500,CLW\n"}) {
      for (const char* to : {"GOTO/0,0,10\n", "GOTO/20,0,10\n"}) {
        const std::string cl = std::string("UNITS/MM\nLOADTL/4,LENGTH,120\nSPINDL/RPM,500,CLW\nRAPID\n") +
                               "GOTO/0,0,60,0,0,1\n" + word + "CYCLE/TAP,RAPTO,3.0,FEDTO,-12.5,MMPR,1.25\n" +
                               to + "CYCLE/OFF\nRAPID\nGOTO/30,0,60\nFINI\n";
        const auto p = test::posted(cl, machine, {}, control);
        ASSERT_TRUE(p.report) << control << word << p.report.error().text();
        EXPECT_TRUE(p.report->verification->passed()) << control << word << p.nc;
        EXPECT_EQ(p.report->holes, 1U) << control << word;
      }
    }
  }
}

TEST(Tapping, WhatCannotBeTappedIsRefusedByItsLine) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto refused = [&](const test::Posted& p, const std::string& says) {
    ASSERT_FALSE(p.report) << says;
    EXPECT_EQ(p.report.error().code, ErrorCode::wrong_input) << p.report.error().text();
    EXPECT_TRUE(has(p.report.error().text(), says)) << p.report.error().text();
    EXPECT_TRUE(has(p.report.error().text(), "part.cls:9")) << p.report.error().text();
  };
  const std::string good = threads("CLW", "MMPR,1.0");
  refused(test::posted(good, machine, {}, "hnc_8"), "[cycles] tap");
  PostOptions rtcp;
  rtcp.rtcp = true;
  refused(test::posted(good, machine, rtcp, "siemens_840d_sl"), "--rtcp");
  const Model errors = test::model_of(
      "[model]\nname = \"m\"\n[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 20.0\n",
      machine);
  refused(test::posted(good, machine, {}, "linuxcnc", &errors), "--no-geometric");
  refused(test::posted(with(good, "SPINDL/RPM,500,CLW\n", "REMARK\n"), machine), "does not turn");
  refused(test::posted(threads("CLW", "MMPM,20."), machine), "no tap has that");
  refused(test::posted(threads("CLW", "MMPR,100."), machine), "no tap has that");
}

// Programs of others: what they tap comes out as what they tapped.
test::Posted reposted(const std::string& nc, const std::string& from, const std::string& to) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const nc::Controller c0 = with_axes_of(machine, test::shipped_controller(from));
  const nc::Controller c = with_axes_of(machine, test::shipped_controller(to));
  const NcOrigin origin{&machine, &c0, FromPath::points};
  PostJob job;
  job.cl_file = "part.nc";
  job.from = &origin;
  job.machine = &machine;
  job.controller = &c;
  test::Posted out;
  out.report = post(
      std::make_unique<test::TextOf>(nc), job, {},
      [&](std::string_view text) {
        out.nc += text;
        return Result<void>{};
      },
      out.diagnostics);
  return out;
}

TEST(Tapping, ProgramsComeBackAndGoToEveryControl) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const std::string& control : controls_that_tap()) {
    const auto first = test::posted(threads("CCLW", "MMPR,1.25"), machine, {}, control);
    ASSERT_TRUE(first.report);
    for (const std::string& to : controls_that_tap()) {
      const auto there = reposted(first.nc, control, to);
      ASSERT_TRUE(there.report) << control << " -> " << to << ": " << there.report.error().text();
      EXPECT_TRUE(there.report->verification->passed()) << control << " -> " << to;
      if (to == "siemens_840d_sl") {
        EXPECT_TRUE(has(there.nc, ",,,5,,-1.25")) << there.nc;
      }
    }
  }
}

const std::string kHead = "G21 G90 G17\nG54\nT1 M6\nG43 H1\nS500 M3\nG0 A30. C0.\nG0 X40. Y0.\nG0 Z50.\n";

TEST(Tapping, PitchesOfOthersAreThoseOfTheirUnits) {
  // 1/4-20 at 500 rpm: 25 inches a minute. An S word of its own, and one in the cycle's line.
  const std::string inch = "G20 G90 G17\nG54\nT1 M6\nG43 H1\nS500 M3\nG0 A30. C0.\nG0 X1. Y0.\nG0 Z2.\n";
  const auto p = reposted(inch + "G98 G84 Z1. R1.5 F25.\nG80\nM30\n", "haas_ngc", "siemens_840d_sl");
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(has(p.nc, ",,,5,,1.27")) << p.nc;
  const auto s = reposted(inch + "S250\nG98 G84 Z1. R1.5 F25.\nG80\nM30\n", "haas_ngc", "siemens_840d_sl");
  ASSERT_TRUE(s.report) << s.report.error().text();
  EXPECT_TRUE(has(s.nc, ",,,5,,2.54")) << s.nc;
  const auto in_line =
      reposted(inch + "G98 G84 Z1. R1.5 F25. S250\nG80\nM30\n", "haas_ngc", "siemens_840d_sl");
  ASSERT_TRUE(in_line.report) << in_line.report.error().text();
  EXPECT_TRUE(has(in_line.nc, ",,,5,,2.54")) << in_line.nc;
}

TEST(Tapping, WhatOthersDoNotSayIsRefused) {
  const auto refused = [&](const std::string& lines, const std::string& from, const std::string& says) {
    const auto p = reposted(kHead + lines + "M30\n", from, "siemens_840d_sl");
    ASSERT_FALSE(p.report) << lines << p.nc;
    EXPECT_TRUE(has(p.report.error().text(), says)) << p.report.error().text();
  };
  refused("G98 G84 Z40. R45.\nG80\n", "haas_ngc", "without its feed");
  refused("M4\nG98 G84 Z40. R45. F500.\nG80\n", "haas_ngc", "other hand");
  refused("M5\nG33.1 Z40. K1.\n", "linuxcnc", "does not turn");
  refused("G33.1 Z40.\n", "linuxcnc", "K word");
  refused("G33.1 X5. Z40. K1.\n", "linuxcnc", ":9:");
  refused("G33.1 Z40. K-1.\n", "linuxcnc", "pitch");
  refused("G33 Z40. K1.\n", "linuxcnc", "G33");
}

// Behind G95 the F of a tap is its pitch.
TEST(Tapping, FeedPerRevolutionIsThePitch) {
  const auto p = reposted(kHead + "G95\nG98 G84 Z40. R45. F1.25\nG80\nM30\n", "haas_ngc", "siemens_840d_sl");
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(has(p.nc, "CYCLE84(50,45,0,40,,,5,,1.25,0,500,0)")) << p.nc;
}

}  // namespace
}  // namespace trunnion::post
