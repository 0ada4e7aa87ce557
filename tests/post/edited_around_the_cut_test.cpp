// Words between the cuts that a control executes and that nothing of the path shows: each is found by the
// verification.
#include <algorithm>
#include <cctype>
#include <gtest/gtest.h>
#include <iomanip>
#include <sstream>

#include "trunnion/base/units.hpp"
#include "trunnion/machine/kinematics.hpp"

#include "post/posting.hpp"

namespace trunnion::post {
namespace {

constexpr const char* kHoles =
    "PARTNO/HOLES\nUNITS/MM\nLOADTL/4,LENGTH,120.5\nSPINDL/500,CLW\nCOOLNT/FLOOD\nRAPID\n"
    "GOTO/30,0,60,0,0,1\nFEDRAT/400,MMPM\nGOTO/30,0,20,0,0,1\nGOTO/20,25,18,0,0,1\nRAPID\nGOTO/"
    "20,25,66,0,0,1\n";
constexpr const char* kDrill = "CYCLE/DRILL,DEPTH,10,MMPM,100,CLEAR,3\n";
constexpr const char* kTap = "CYCLE/TAP,DEPTH,10,MMPR,1.25,CLEAR,5\n";

std::string part(const std::string& cycle) {
  return kHoles + cycle +
         "GOTO/10,10,30\nGOTO/-10,10,30\nGOTO/-10,20,30\nCYCLE/OFF\nRAPID\nGOTO/10,0,60\nFINI\n";
}

// `line` put in before (or for) the first line behind `mark` that begins with one of these words.
std::string edited(const std::string& nc, const std::string& mark, const std::string& begins,
                   const std::string& line, bool instead = false) {
  std::istringstream in(nc);
  std::string out;
  bool marked = false, done = false;
  for (std::string text; std::getline(in, text);) {
    const auto at = text[0] == 'N' ? text.find(' ') + 1 : 0;
    const bool here = marked && !done && text.compare(at, begins.size(), begins) == 0;
    if (here) out += line + "\n";
    if (!here || !instead) out += text + "\n";
    done = done || here;
    marked = marked || text.find(mark) != std::string::npos;
  }
  return done ? out : std::string();
}

class EditedAroundTheCut : public ::testing::Test {
 protected:
  EditedAroundTheCut() {
    machine_.spindle_max_rpm = 12000.0;
    options_.native_cycles = true;
  }
  void expect_found(const std::string& cl, const std::string& control, const std::string& nc,
                    const std::string& what) const {
    ASSERT_FALSE(nc.empty()) << control << ": no place for " << what;
    const auto report = test::verified(nc, cl, machine_, 0.01, control);
    EXPECT_FALSE(report && report->passed()) << control << ": " << what << " passed\n" << nc;
  }
  std::string right(const std::string& cl, const std::string& control) const {
    const auto p = test::posted(cl, machine_, options_, control);
    EXPECT_TRUE(p.report && p.report->verification->passed()) << control;
    const auto again = test::verified(p.nc, cl, machine_, 0.01, control);
    EXPECT_TRUE(again && again->passed()) << control << (again ? "" : again.error().text());
    return p.nc;
  }
  Machine machine_ = test::shipped_machine("trunnion_offset");
  PostOptions options_;
};

// From below R a control of this kind goes across first: through what the hole before was higher than.
TEST_F(EditedAroundTheCut, AHoleThatBeginsBelowItsR) {
  const std::string cl =
      std::string(kHoles) + kDrill + "GOTO/10,10,10\nGOTO/-10,10,30\nCYCLE/OFF\nRAPID\nGOTO/10,0,60\nFINI\n";
  for (const char* control : {"fanuc_30i", "haas_ngc"}) {
    const std::string nc = right(cl, control);
    expect_found(cl, control, edited(nc, "G80", "G0 Z", "G0", true), "no way up before the second hole");
  }
}

// Half way between two words an approach is rounded otherwise than the words of the cycle.
TEST_F(EditedAroundTheCut, HeightsHalfWayBetweenWordsAreNotBelow) {
  const std::string cl =
      "LOADTL/4,LENGTH,120.5\nSPINDL/500,CLW\nRAPID\nGOTO/0,0,60,0,0,1\nFEDRAT/400,MMPM\n"
      "CYCLE/DRILL,DEPTH,10.0005,MMPM,100,CLEAR,1.0005\nGOTO/-9.8505,-4.5725,17.3175\n"
      "GOTO/-9.8505,3.4275,17.5205\nGOTO/-19.8505,3.4275,17.7205\nCYCLE/OFF\nRAPID\nGOTO/0,0,60\nFINI\n";
  for (const char* control : {"fanuc_30i", "haas_ngc", "linuxcnc"}) right(cl, control);
}

// 60 mm deep in steps of 3: chips that stay in the hole jam the drill.
TEST_F(EditedAroundTheCut, AHoleInStepsIsOfItsKindAndFeed) {
  const std::string cl = part("CYCLE/DEEP,DEPTH,60,STEP,3,MMPM,120,CLEAR,2\n");
  for (const auto& [control, kind, other] :
       {std::tuple{"fanuc_30i", "G83", "G73"}, std::tuple{"haas_ngc", "G83", "G73"},
        std::tuple{"linuxcnc", "G83", "G73"}, std::tuple{"siemens_840d_sl", ",1,1)", ",1,0)"}}) {
    std::string nc = right(cl, control);
    const auto at = nc.find(kind);
    ASSERT_NE(at, std::string::npos) << control << nc;
    expect_found(cl, control, nc.replace(at, std::string(kind).size(), other), "chips that stay");
  }
  for (const auto& [control, feed, slow] :
       {std::tuple{"fanuc_30i", "F120.", "F1."}, std::tuple{"linuxcnc", "F120.", "F1."},
        std::tuple{"heidenhain_tnc640", "Q206=120", "Q206=1"}}) {
    std::string nc = right(cl, control);
    const auto at = nc.find(feed);
    ASSERT_NE(at, std::string::npos) << control << nc;
    expect_found(cl, control, nc.replace(at, std::string(feed).size(), slow), "a feed of 1 mm/min");
  }
  // A step of 4 takes a third more than the CL file lets it.
  for (const auto& [control, step, larger] :
       {std::tuple{"fanuc_30i", "Q3.", "Q4."}, std::tuple{"haas_ngc", "Q3.", "Q4."},
        std::tuple{"linuxcnc", "Q3.", "Q4."}, std::tuple{"siemens_840d_sl", ",,,3,", ",,,4,"},
        std::tuple{"heidenhain_tnc640", "Q202=3", "Q202=4"}}) {
    std::string nc = right(cl, control);
    const auto at = nc.find(step);
    ASSERT_NE(at, std::string::npos) << control << nc;
    expect_found(cl, control, nc.replace(at, std::string(step).size(), larger), "a step of 4 mm");
    for (const char* depth : {"4", "5.9", "6", "6.1", "9", "61"})
      right(part("CYCLE/DEEP,DEPTH," + std::string(depth) + ",STEP,3,MMPM,120,CLEAR,2\n"), control);
  }
  // Chips that are broken only, where the CL file wants no more, may be taken out.
  const std::string broken = part("CYCLE/BRKCHP,DEPTH,30,STEP,3,MMPM,120,CLEAR,2\n");
  std::string nc = right(broken, "fanuc_30i");
  nc.replace(nc.find("G73"), 3, "G83");
  EXPECT_TRUE(test::verified(nc, broken, machine_, 0.01, "fanuc_30i")->passed());
}

// Up, over, and down on the end of a cut: what lies between would stay, and rapids behind it go through it.
TEST_F(EditedAroundTheCut, ACutThatIsLeftOutForAnApproach) {
  const std::string cl =
      "LOADTL/4,LENGTH,100\nSPINDL/1000,CLW\nRAPID\nGOTO/0,0,40,0,0,1\nRAPID\nGOTO/0,0,20\nFEDRAT/300,MMPM\n"
      "GOTO/0,0,10\nGOTO/20,0,10\nGOTO/20,20,10\nGOTO/0,20,10\nRAPID\nGOTO/0,20,40\nFINI\n";
  const std::string nc = right(cl, "linuxcnc");
  const std::string cut = "\nY20.0000\n";
  const auto at = nc.find(cut);
  ASSERT_NE(at, std::string::npos) << nc;
  const auto with = [&](const std::string& words) { return std::string(nc).replace(at, cut.size(), words); };
  const auto over = test::verified(with("\nG53 G0 Z700\nG0 X20 Y20\nG1 Z10\n"), cl, machine_, 0.01);
  ASSERT_TRUE(over);
  EXPECT_FALSE(over->passed());
  const auto& places = over->checks[static_cast<std::size_t>(CheckOf::path)].places;
  ASSERT_FALSE(places.empty());
  EXPECT_NE(places.front().what.find("where the CL file cuts"), std::string::npos) << places.front().what;
  // Down on the place where it left, it cuts on.
  const auto back = test::verified(with("\nG53 G0 Z700\nG0 X20 Y0\nG1 Z10" + cut), cl, machine_, 0.01);
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->passed());
}

// Another tool comes from anywhere, under tool-centre-point control, too.
TEST_F(EditedAroundTheCut, ACutThatBeginsWithAnotherTool) {
  const std::string cl =
      "LOADTL/4,LENGTH,100\nSPINDL/1000,CLW\nRAPID\nGOTO/0,0,40,0,0,1\nFEDRAT/300,MMPM\nGOTO/0,0,10\n"
      "GOTO/20,0,10\nLOADTL/9,LENGTH,80\nSPINDL/1000,CLW\nGOTO/20,20,10\nGOTO/0,20,10\nRAPID\n"
      "GOTO/0,20,40\nFINI\n";
  for (const bool rtcp : {false, true}) {
    options_ = {};
    options_.rtcp = rtcp;
    for (const char* control : {"linuxcnc", "fanuc_30i", "siemens_840d_sl"}) right(cl, control);
  }
}

// It takes frames back while the tool is in the part.
TEST_F(EditedAroundTheCut, TheEndOfAPlaneUnderToolCentrePointControl) {
  options_ = {};
  options_.rtcp = true;
  const std::string cl = part(kDrill);
  for (const auto& [control, words] :
       {std::pair{"siemens_840d_sl", "CYCLE800()"}, std::pair{"fanuc_30i", "G69"}}) {
    const std::string nc = edited(right(cl, control), "G1", "X", words);
    ASSERT_FALSE(nc.empty()) << control;
    const auto report = test::verified(nc, cl, machine_, 0.01, control);
    ASSERT_FALSE(report) << control << nc;
    EXPECT_NE(report.error().text().find("the end of a tilted plane under tool-centre-point control"),
              std::string::npos)
        << report.error().text();
  }
}

// LinuxCNC's interpreter ends at each of these, with the tool in the part.
TEST_F(EditedAroundTheCut, WordsThatStopTheControlInTheCut) {
  const std::string cl = part(kDrill);
  const std::string nc = right(cl, "linuxcnc");
  for (const char* words : {"G80", "(ABORT,x)", "(abort,x)"})
    expect_found(cl, "linuxcnc", edited(nc, "G1 Z20", "X", words), words);
}

constexpr const char* kTiltedTools =
    "PARTNO/FIVE\nUNITS/MM\nMULTAX/ON\nLOADTL/4,LENGTH,120.5\nSPINDL/8000,CLW\nRAPID\nGOTO/"
    "30,0,60,0.6,0,0.8\n"
    "FEDRAT/400,MMPM\nGOTO/30,0,20,0.6,0,0.8\nGOTO/20,10,20,0.3,0.3,0.905539\nRAPID\n"
    "GOTO/20,10,60,0.3,0.3,0.905539\nLOADTL/5,LENGTH,80\nSPINDL/8000,CLW\nRAPID\nGOTO/-30,0,60,0,0,1\n"
    "FEDRAT/400,MMPM\nGOTO/-30,0,20,0,0,1\nRAPID\nGOTO/-30,0,60,0,0,1\nFINI\n";

// Under tool-centre-point control the tip goes straight on the table that turns: machine Z goes down half
// way.
TEST_F(EditedAroundTheCut, AnAxisThatTurnsOnTheWayToACut) {
  options_ = {};
  options_.rtcp = true;
  std::string nc = right(kTiltedTools, "fanuc_30i");
  const auto replace = [&](const std::string& what, const std::string& by) {
    const auto at = nc.find(what);
    ASSERT_NE(at, std::string::npos) << what << nc;
    nc.replace(at, what.size(), by);
  };
  replace(" G0 A36.87 C90.", " G0 A120. C90.");
  replace("G43.4 H4 ", "G0 A36.87 C90. G43.4 H4 ");
  expect_found(kTiltedTools, "fanuc_30i", nc, "A turns in the block of G43.4");
}

// The next tool asks for A0; below the safe height nobody does.
TEST_F(EditedAroundTheCut, ATurnForTheNextToolBelowTheSafeHeight) {
  options_ = {};
  options_.rtcp = true;
  const std::string nc = right(kTiltedTools, "siemens_840d_sl");
  expect_found(kTiltedTools, "siemens_840d_sl", edited(nc, "A25.1041", "TRAFOOF", "A0"),
               "A0 before the retract");
}

TEST_F(EditedAroundTheCut, OneOfXAndYInATiltedPlane) {
  options_ = {};
  options_.tilted_plane = true;
  const std::string cl =
      "PARTNO/SL\nUNITS/MM\nLOADTL/4,LENGTH,120.5\nSPINDL/3000,CLW\nRAPID\nGOTO/0,-200,60,0,0,1\n"
      "FEDRAT/400,MMPM\nGOTO/0,-200,50\nRAPID\nGOTO/0,-200,60,0,0,1\nRAPID\nGOTO/30,0,60.0,0.6,0.0,0.8\n"
      "GOTO/30.0,0.0,40.0,0.6,0.0,0.8\nGOTO/22.0,10.0,46.0,0.6,0.0,0.8\nRAPID\nGOTO/"
      "40,30,70,0.6,0.0,0.8\nFINI\n";
  const std::string nc = right(cl, "fanuc_30i");
  for (const char* words : {"X0.", "Y12."})
    expect_found(cl, "fanuc_30i", edited(nc, "G53.1", "X", words, true), words);
}

// F is modal, and in tapping it is the pitch: the second thread would have been cut with another one.
TEST_F(EditedAroundTheCut, AnFBetweenTwoHolesIsThatOfTheNext) {
  for (const char* control : {"fanuc_30i", "haas_ngc", "linuxcnc"})
    for (const char* words : {"F900.", "M9 F900.", "M3 S500 F900."}) {
      const std::string cl = part(kDrill);
      expect_found(cl, control, edited(right(cl, control), "G81", "X", words), words);
    }
  for (const char* control : {"fanuc_30i", "haas_ngc", "iso"}) {
    const std::string cl = part(kTap);
    expect_found(cl, control, edited(right(cl, control), "G84", "X", "F1000."), "F in a tapping cycle");
  }
}

// G00, G01 and the cycles are one group: a hole would be missing, or drilled where the tool only travels.
TEST_F(EditedAroundTheCut, AMotionWordAloneEndsTheCycle) {
  for (const char* control : {"fanuc_30i", "haas_ngc", "linuxcnc"})
    for (const char* word : {"G0", "G1", "G1 F100."}) {
      const std::string cl = part(kDrill);
      expect_found(cl, control, edited(right(cl, control), "G81", "X", word), word);
    }
}

TEST_F(EditedAroundTheCut, TheSpindleTurnsRoundAndFasterAboveThePartOnly) {
  const std::string cl = std::string(kHoles) +
                         "FEDRAT/400,MMPM\nRAPID\nGOTO/0,0,60,0,0,1\nFEDRAT/400,MMPM\nGOTO/"
                         "0,0,20,0,0,1\nRAPID\nGOTO/0,0,66,0,0,1\nFINI\n";
  for (const char* control : {"fanuc_30i", "haas_ngc", "linuxcnc"}) {
    const std::string nc = right(cl, control);
    expect_found(cl, control, edited(nc, "X20.", "G0", "S500 M4"), "M4 in the part");
    expect_found(cl, control, edited(nc, "X20.", "G0", "S99999 M3"), "S above max_rpm");
  }
}

// SPINDL/...,CCLW between two cuts: up first, as for a stop.
TEST_F(EditedAroundTheCut, ASpindleThatTurnsRoundLeavesThePart) {
  const std::string cl = std::string(kHoles) +
                         "RAPID\nGOTO/0,0,60,0,0,1\nFEDRAT/400,MMPM\nGOTO/0,0,20,0,0,1\nSPINDL/400,CCLW\n"
                         "GOTO/9,0,20,0,0,1\nRAPID\nGOTO/9,0,66,0,0,1\nFINI\n";
  const std::string nc = right(cl, "fanuc_30i");
  const auto turns = nc.find("S400 M4");
  ASSERT_NE(turns, std::string::npos) << nc;
  const auto up = nc.rfind("G53 G0 Z", turns);
  ASSERT_NE(up, std::string::npos) << nc;
  EXPECT_EQ(nc.substr(up, turns - up).find("G1"), std::string::npos) << nc;
}

// In the words of every control, with its tool, offset and travel: each such program passes.
TEST_F(EditedAroundTheCut, ASpindleThatTurnsRoundIsVerifiedOnEveryControl) {
  const std::string cl =
      std::string(kHoles) +
      "RAPID\nGOTO/0,0,60,0.3,0,0.953939\nFEDRAT/400,MMPM\nGOTO/0,0,20,0.3,0,0.953939\n"
      "SPINDL/400,CCLW\nGOTO/9,0,20,0.3,0,0.953939\nRAPID\nGOTO/9,0,66,0.3,0,0.953939\nFINI\n";
  for (const std::string& control : test::shipped_controllers()) {
    const nc::Controller c = test::shipped_controller(control);
    options_ = {};
    right(cl, control);
    options_.rtcp = c.has_tcp();
    options_.feed = options_.rtcp ? FeedOutput::tip : FeedOutput::inverse;
    right(cl, control);
    options_ = {};
    options_.tilted_plane = c.has_tilted_plane();
    right(cl, control);
  }
}

// The sign of a direction: possible, and mostly wrong. The part would be mirrored.
TEST_F(EditedAroundTheCut, AMirroredAxisIsDoubtedByPostAndVerify) {
  machine_.axes[*machine_.axis("X")].direction *= -1.0;
  const auto told = [](const Diagnostics& diagnostics) {
    return std::any_of(diagnostics.findings().begin(), diagnostics.findings().end(), [](const auto& f) {
      return f.text().find("is the part mirrored?") != std::string::npos;
    });
  };
  EXPECT_TRUE(told(test::posted(part(kDrill), machine_, options_).diagnostics));
  machine_.axes[*machine_.axis("X")].direction *= -1.0;
  EXPECT_FALSE(told(test::posted(part(kDrill), machine_, options_).diagnostics));
}

// What is said of a cut behind SPINDL/OFF is that, not that there was no SPINDL.
TEST_F(EditedAroundTheCut, ACutBehindAStoppedSpindleSaysSo) {
  const auto said = [&](const std::string& spindle) {
    const auto p = test::posted("PARTNO/S\nUNITS/MM\nLOADTL/4,LENGTH,120.5\n" + spindle +
                                    "RAPID\nGOTO/0,0,60,0,0,1\nFEDRAT/400,MMPM\nGOTO/0,0,20,0,0,1\nFINI\n",
                                machine_, options_);
    std::string out;
    for (const auto& f : p.diagnostics.findings()) out += f.text() + "\n";
    return out;
  };
  EXPECT_NE(said("SPINDL/500,CLW\nSPINDL/OFF\n").find("the spindle was stopped before this cut"),
            std::string::npos);
  EXPECT_NE(said("").find("no SPINDL before this cut"), std::string::npos);
}

// The table goes all the way round, 2 mm under a leaning tool, and ends where it began.
TEST_F(EditedAroundTheCut, AWholeTurnBesideThePart) {
  const std::string cl =
      "PARTNO/T\nUNITS/MM\nLOADTL/4,LENGTH,120.5\nSPINDL/500,CLW\nRAPID\nGOTO/30,0,60,0.5,0,0.8660254\n"
      "FEDRAT/400,MMPM\nGOTO/30,0,10,0.5,0,0.8660254\nGOTO/26,15,10,0.433012,0.25,0.8660254\nRAPID\n"
      "GOTO/27,15.6,12,0.433012,0.25,0.8660254\nRAPID\nGOTO/30,0,12,0.5,0,0.8660254\nFEDRAT/400,MMPM\n"
      "GOTO/30,0,10,0.5,0,0.8660254\nRAPID\nGOTO/60,0,60,0.5,0,0.8660254\nFINI\n";
  for (const std::string control : {"linuxcnc", "fanuc_30i", "siemens_840d_sl", "haas_ngc", "iso"}) {
    const std::string nc = right(cl, control);
    std::istringstream in(nc);
    std::string edited_nc;
    double c_deg = 0.0;
    bool cuts = false, done = false;
    for (std::string line; std::getline(in, line);) {
      const auto at = line.find(" C");
      if (line.find('(') == std::string::npos && line.find(';') == std::string::npos &&
          at != std::string::npos)
        c_deg = std::strtod(line.c_str() + at + 2 + (line[at + 2] == '=' ? 1 : 0), nullptr);
      edited_nc += line + "\n";
      cuts = cuts || line.find("G1 ") != std::string::npos;
      // The block that leaves the cut is the first rapid behind it.
      if (!done && cuts && line.find("G0 ") != std::string::npos) {
        std::ostringstream turn;
        turn << std::fixed << "G0 " << (control == "siemens_840d_sl" ? "C=" : "C") << c_deg + 360.0 << "\n";
        edited_nc += turn.str();
        done = true;
      }
    }
    ASSERT_TRUE(done) << control << nc;
    expect_found(cl, control, edited_nc, "a whole turn");
  }
}

// Both solutions of the rotary axes are one pose of the tool, and the table swings round between them.
TEST_F(EditedAroundTheCut, TheOtherSolutionBesideThePart) {
  const std::string cl =
      "PARTNO/T\nUNITS/MM\nLOADTL/4,LENGTH,150\nSPINDL/500,CLW\nRAPID\nGOTO/30,0,60,0.34202014,0,0.93969262\n"
      "FEDRAT/400,MMPM\nGOTO/30,0,10,0.34202014,0,0.93969262\nRAPID\nGOTO/31,0,12,0.34202014,0,0.93969262\n"
      "RAPID\nGOTO/60,0,60,0.34202014,0,0.93969262\nFINI\n";
  const ToolPose pose{{31.0, 0.0, 12.0}, Vec3(0.34202014, 0.0, 0.93969262).normalized()};
  const std::string nc = right(cl, "linuxcnc");
  const auto solutions = inverse(machine_, pose, {});
  ASSERT_EQ(solutions.size(), 2U);
  std::string said[2];
  for (std::size_t i = 0; i < 2; ++i) {
    const JointVector& q = solutions[i].q;
    std::ostringstream line;
    line << std::fixed << std::setprecision(4) << "G0 X" << q[0] << " Y" << q[1] << " Z" << q[2] - 150.0
         << " A" << q[3] * kDegreePerRad << " C" << q[4] * kDegreePerRad << "\n";
    said[i] = line.str();
  }
  // Behind the block that leaves the cut: to the other one, and back.
  const auto cut = nc.find("G1 ");
  ASSERT_NE(cut, std::string::npos);
  const auto leaves = nc.find('\n', nc.find("G0 ", cut)) + 1;
  for (const auto& [there, back] : {std::pair{said[0], said[1]}, {said[1], said[0]}})
    expect_found(cl, "linuxcnc", nc.substr(0, leaves) + there + back + nc.substr(leaves),
                 "the other solution");
}

// The operator reaches in at M0, and the spindle turns there.
TEST_F(EditedAroundTheCut, WhatIsOffAtAStopIsOff) {
  const std::string cl =
      "PARTNO/S\nUNITS/MM\nLOADTL/4,LENGTH,120.5\nSPINDL/500,CLW\nCOOLNT/FLOOD\nRAPID\n"
      "GOTO/0,0,60,0,0,1\nFEDRAT/400,MMPM\nGOTO/0,0,20,0,0,1\nRAPID\nGOTO/0,0,60,0,0,1\nSPINDL/OFF\n"
      "COOLNT/OFF\nSTOP\nSPINDL/500,CLW\nCOOLNT/FLOOD\nRAPID\nGOTO/9,0,60,0,0,1\nGOTO/9,0,20,0,0,1\nFINI\n";
  for (const std::string control :
       {"linuxcnc", "fanuc_30i", "siemens_840d_sl", "haas_ngc", "iso", "hnc_8", "heidenhain_tnc640"}) {
    const std::string nc = right(cl, control);
    std::istringstream in(nc);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    const auto word_of = [](const std::string& line) {
      const auto blank = line.find(' ');
      return blank != std::string::npos && (line[0] == 'N' || std::isdigit(line[0]) != 0)
                 ? line.substr(blank + 1)
                 : line;
    };
    const auto stop = std::find_if(lines.begin(), lines.end(),
                                   [&](const std::string& line) { return word_of(line) == "M0"; });
    ASSERT_NE(stop, lines.end()) << control << nc;
    for (const auto& [off, on] : {std::pair<std::string, std::string>{"M5", "M3"}, {"M9", "M8"}})
      for (const std::string& now : {std::string(), on}) {
        const auto at = std::find_if(std::make_reverse_iterator(stop), lines.rend(),
                                     [&](const std::string& line) { return word_of(line) == off; });
        ASSERT_NE(at, lines.rend()) << control << off << nc;
        std::string edited_nc;
        for (const std::string& line : lines) {
          if (&line != &*at)
            edited_nc += line + "\n";
          else if (!now.empty())
            edited_nc += now + "\n";
        }
        expect_found(cl, control, edited_nc, off + " -> '" + now + "'");
      }
  }
}

// The next block comes down and goes 300 mm sideways, at rapid.
TEST_F(EditedAroundTheCut, AnotherPlaceOfTheApproachInATiltedPlane) {
  options_ = {};
  options_.tilted_plane = true;
  const std::string cl =
      "PARTNO/PLANE\nUNITS/MM\nLOADTL/4,LENGTH,120.5\nSPINDL/8000,CLW\nCOOLNT/FLOOD\nRAPID\n"
      "GOTO/30,0,60,0.6,0,0.8\nFEDRAT/400,MMPM\nGOTO/30,0,20,0.6,0,0.8\nGOTO/20,25,18,0.6,0,0.8\nRAPID\n"
      "GOTO/56,25,66,0.6,0,0.8\nFINI\n";
  const std::string nc = right(cl, "fanuc_30i");
  expect_found(cl, "fanuc_30i", edited(nc, "G53.1", "X", "X0. Y-300.", true), "another Y");
}

// A second plane without the end of the first.
TEST_F(EditedAroundTheCut, AnotherPlaneBeforeTheEndOfTheFirst) {
  options_ = {};
  options_.tilted_plane = true;
  const std::string cl =
      "PARTNO/PLANES\nUNITS/MM\nLOADTL/4,LENGTH,120.5\nSPINDL/8000,CLW\nRAPID\nGOTO/30,0,60,0.6,0,0.8\n"
      "FEDRAT/400,MMPM\nGOTO/30,0,20,0.6,0,0.8\nRAPID\nGOTO/30,0,60,0.6,0,0.8\nLOADTL/5,LENGTH,80\n"
      "SPINDL/8000,CLW\nRAPID\nGOTO/-30,0,60,-0.6,0,0.8\nFEDRAT/400,MMPM\nGOTO/-30,0,20,-0.6,0,0.8\nRAPID\n"
      "GOTO/-30,0,60,-0.6,0,0.8\nFINI\n";
  const std::string nc = right(cl, "fanuc_30i");
  expect_found(cl, "fanuc_30i", edited(nc, "G53.1", "G69", "", true), "G69 left out");
}

}  // namespace
}  // namespace trunnion::post
