// Edits that change what a control knows while the geometry of the cuts stays: found by the walk of changed
// programs (tests/walk), each passed by the verification once.
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/controllers.hpp"
#include "posting.hpp"

namespace trunnion {
namespace {

using ::testing::HasSubstr;

// Two tools, coolant on all the time; the tool is tilted, and the path comes back beside itself.
constexpr const char* kPath =
    "UNITS/MM\nLOADTL/1\nSPINDL/4000,RPM,CLW\nCOOLNT/FLOOD\nFEDRAT/800.,MMPM\n"
    "RAPID\nGOTO/0,0,100,0.5,0,0.8660254\nGOTO/20,0,30,0.5,0,0.8660254\nGOTO/30,0,30,0.5,0.,0.8660254\n"
    "GOTO/40,0,30,0.45,0,0.8930286\nGOTO/50,0,30,0.4,0,0.9165151\nOPSTOP\nGOTO/50,10,30,0.4,0,0.9165151\n"
    "RAPID\nGOTO/50,10,90,0.4,0,0.9165151\n"
    "LOADTL/2\nRAPID\nGOTO/0,40,60,0,0.7071068,0.7071068\nGOTO/0,40,50,0,0.7071068,0.7071068\n"
    "GOTO/5,40,50,0,0.7071068,0.7071068\nRAPID\nGOTO/5,80,90,0,0.7071068,0.7071068\nFINI\n";
// As some CAM systems write it: the first motion is a feed.
constexpr const char* kBeginsWithAFeed =
    "UNITS/MM\nLOADTL/1\nSPINDL/4000,RPM,CLW\nFEDRAT/800.,MMPM\nGOTO/20,0,30,0.5,0,0.8660254\nGOTO/"
    "30,0,30,0.5,0,0.8660254\n"
    "FINI\n";

constexpr const char* kStopPath =
    "UNITS/MM\nLOADTL/1\nSPINDL/4000,RPM,CLW\nRAPID\nGOTO/30,0,60,0.5,0,0.8660254\nFEDRAT/800.,MMPM\n"
    "GOTO/30,0,30,0.5,0,0.8660254\nSTOP\nGOTO/20,0,30,0.5,0,0.8660254\nRAPID\nGOTO/20,0,60,0.5,0,0.8660254\n"
    "FINI\n";

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) out.push_back(line);
  return out;
}

class Program {
 public:
  Program(const char* cl, const std::string& control, const post::PostOptions& options = {},
          const std::string& point = "tip")
      : cl_(cl), control_(control), machine_(test::shipped_machine("trunnion_offset")) {
    if (point == "spindle") machine_.output_point = OutputPoint::spindle;
    const auto p = test::posted(cl_, machine_, options, control_);
    EXPECT_TRUE(p.report) << p.report.error().text();
    lines_ = lines_of(p.nc);
    EXPECT_EQ(found(lines_), "") << p.nc;
  }

  const std::vector<std::string>& lines() const { return lines_; }
  // The first line behind `from` that holds the text.
  std::size_t line(const std::string& text, std::size_t from = 0) const {
    for (std::size_t i = from; i < lines_.size(); ++i) {
      if (lines_[i].find(text) != std::string::npos) return i;
    }
    ADD_FAILURE() << "no " << text;
    return 0;
  }
  std::string without(std::size_t i) const {
    auto lines = lines_;
    lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(i));
    return found(lines);
  }
  std::string with(std::size_t before, const std::string& line) const {
    auto lines = lines_;
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(before), line);
    return found(lines);
  }
  std::string with_word(std::size_t i, const std::string& what, const std::string& by) const {
    auto lines = lines_;
    const auto at = lines[i].find(what);
    EXPECT_NE(at, std::string::npos) << what << " in " << lines[i];
    if (at != std::string::npos) lines[i].replace(at, what.size(), by);
    return found(lines);
  }
  std::string swapped(std::size_t i) const {
    auto lines = lines_;
    std::swap(lines[i], lines[i + 1]);
    return found(lines);
  }

 private:
  // What the verification says first; empty where it lets the program pass.
  std::string found(const std::vector<std::string>& lines) const {
    std::string text;
    for (const std::string& line : lines) text.append(line).append("\n");
    const auto v = test::verified(text, cl_, machine_, 0.01, control_);
    if (!v) return v.error().text();
    if (v->passed()) return "";
    if (!v->unsafe.empty()) return v->unsafe[0].what;
    for (const post::Check& check : v->checks) {
      if (!check.places.empty()) return check.places[0].what;
    }
    return "failed";
  }

  std::string cl_, control_;
  Machine machine_;
  std::vector<std::string> lines_;
};

// Words of tool-centre-point control and of tilted planes are places of the tip: with the length off the tool
// goes too deep by all of it.
TEST(ControlState, WordsOfTheGaugePointAreNoneOfTheTip) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.output_point = OutputPoint::spindle;
  for (const bool rtcp : {true, false}) {
    for (const std::string control : {"siemens_840d_sl", "fanuc_30i", "linuxcnc"}) {
      if (!rtcp && control == "linuxcnc") continue;  // it has no tilted planes
      post::PostOptions options;
      options.rtcp = rtcp;
      options.tilted_plane = !rtcp;
      const auto p = test::posted(kPath, machine, options, control);
      ASSERT_FALSE(p.report) << control << p.nc;
      EXPECT_EQ(p.report.error().code, ErrorCode::wrong_use) << control;
      EXPECT_THAT(p.report.error().text(), HasSubstr("it needs point = \"tip\"")) << control;
      // Nor does such a program pass that somebody else wrote.
      Machine of_tip = machine;
      of_tip.output_point = OutputPoint::tip;
      const auto right = test::posted(kPath, of_tip, options, control);
      ASSERT_TRUE(right.report) << control << right.report.error().text();
      const auto v = test::verified(right.nc, kPath, machine, 0.01, control);
      ASSERT_TRUE(v) << control << v.error().text();
      EXPECT_FALSE(v->passed()) << control;
    }
  }
}

// An operator who jogs an axis at a stop goes on from somewhere else.
TEST(ControlState, BehindAStopAllAxesAreSaidAgainFromTheSafeHeight) {
  for (const std::string control : {"fanuc_30i", "siemens_840d_sl", "linuxcnc"}) {
    const Program p(kStopPath, control);
    const auto& lines = p.lines();
    const std::size_t stop = p.line("M0");
    const std::size_t up = p.line(control == "siemens_840d_sl" ? "SUPA" : "G53", stop);
    const std::size_t turn = p.line("A", up + 1);
    EXPECT_NE(lines[turn].find('C'), std::string::npos) << control << lines[turn];
    EXPECT_EQ(lines[turn].find('Z'), std::string::npos) << control << lines[turn];
    const std::size_t over = p.line("X", turn);
    EXPECT_EQ(lines[over].find('Z'), std::string::npos) << control << lines[over];
    EXPECT_NE(p.line("Z", over + 1), 0U) << control;
  }
}

TEST(ControlState, OptionalStopsAreThoseOfTheClFile) {
  const Program p(kPath, "linuxcnc");
  EXPECT_THAT(p.without(p.line("M1")), HasSubstr("the optional stop before it is missing"));
  EXPECT_THAT(p.with(p.line("M1") - 1, "M1"),
              HasSubstr("an optional stop that the CL file does not ask for"));
}

TEST(ControlState, CoolantIsSaidAgainAfterAToolChange) {
  const Program p(kPath, "linuxcnc");
  EXPECT_THAT(p.without(p.line("M8", p.line("T2 M6"))), HasSubstr("the coolant is not said again"));
}

// An operator begins there, behind a reset: in the first work offset, with F per minute.
TEST(ControlState, ModesAreSaidAgainBehindAToolChange) {
  const std::string second = std::string("SET/OFSETL,2\n") + kPath;
  for (const char* control :
       {"fanuc_30i", "haas_ngc", "siemens_840d_sl", "heidenhain_tnc640", "iso", "linuxcnc"}) {
    const Program p(second.c_str(), control);
    const bool is_klartext = std::string_view(control) == "heidenhain_tnc640";
    const bool is_siemens = std::string_view(control) == "siemens_840d_sl";
    // Behind the head, which names the tools too.
    const std::size_t call = p.line(is_klartext  ? "TOOL CALL 2 Z"
                                    : is_siemens ? " T2"
                                                 : "T2 M6",
                                    p.line("M3"));
    const std::size_t change = is_siemens ? call + 1 : call;
    const auto is_behind = [&](const std::string& words) {
      const std::size_t at = p.line(words, change);
      EXPECT_LE(at, change + (is_klartext ? 8 : 5)) << control << ": " << words;
    };
    is_behind(is_klartext ? "M126" : is_siemens ? "G17 G40 G710 G90 G94" : "G17 G21 G40 G80 G90 G94");
    is_behind(is_klartext ? "CYCL DEF 247" : "G55");
    if (is_siemens) is_behind("RTLION");
    // What an aborted program may have left on.
    if (is_siemens || is_klartext) {
      is_behind(is_siemens ? "TRAFOOF" : "M129");
      is_behind(is_siemens ? "CYCLE800()" : "PLANE RESET STAY");
    }
    // Nothing that could move an axis.
    EXPECT_EQ(p.lines()[change + 1].find("G49"), std::string::npos) << control;
    const auto is_feed = [&](const std::string& line) {
      return line.find(" F8") != std::string::npos || line.find("G1 ") != std::string::npos;
    };
    const auto cut =
        std::find_if(p.lines().begin() + static_cast<std::ptrdiff_t>(change), p.lines().end(), is_feed);
    ASSERT_NE(cut, p.lines().end());
    EXPECT_THAT(*cut, HasSubstr(" F")) << control;
  }
}

TEST(ControlState, SpindleAndCoolantAreSaidAgainBehindAStopThatEndsThem) {
  for (const char* control : {"fanuc_30i", "haas_ngc", "siemens_840d_sl", "heidenhain_tnc640", "iso"}) {
    const Program p(kPath, control);
    const bool is_klartext = std::string_view(control) == "heidenhain_tnc640";
    const std::size_t stop = p.line(is_klartext ? " M1" : "M1", p.line("M8"));
    const std::size_t spindle = p.line("M3", stop);
    const std::size_t coolant = p.line("M8", stop);
    EXPECT_LE(std::max(spindle, coolant), stop + (is_klartext ? 3 : 2)) << control;
    EXPECT_THAT(p.without(spindle), is_klartext
                                        ? HasSubstr("is not followed by the other lines")
                                        : HasSubstr("the spindle is off, the CL file asks for 4000 rpm"))
        << control;
    EXPECT_THAT(p.without(coolant), HasSubstr("coolant")) << control;
  }
  const Program goes_on(kPath, "linuxcnc");
  EXPECT_THAT(goes_on.lines()[goes_on.line("M1", goes_on.line("M8")) + 1], HasSubstr("G0 Z"));
}

TEST(ControlState, ATapBehindAStopGetsItsSpindleToo) {
  constexpr const char* kTaps =
      "UNITS/MM\nLOADTL/4\nSPINDL/500,CLW\nCOOLNT/ON\nFEDRAT/400,MMPM\nRAPID\nGOTO/0,0,60,0,0,1\n"
      "CYCLE/TAP,10,MMPR,1.25,CLEAR,3\nGOTO/10,0,20\nCYCLE/OFF\nRAPID\nGOTO/10,0,60\nSTOP\nRAPID\n"
      "GOTO/20,0,60\nCYCLE/TAP,10,MMPR,1.25,CLEAR,3\nGOTO/20,0,20\nCYCLE/OFF\nRAPID\nGOTO/0,0,60\nFINI\n";
  post::PostOptions options;
  options.native_cycles = true;
  for (const char* control :
       {"linuxcnc", "fanuc_30i", "haas_ngc", "siemens_840d_sl", "heidenhain_tnc640", "iso"}) {
    const Program p(kTaps, control, options);
    const bool is_klartext = std::string_view(control) == "heidenhain_tnc640";
    if (std::string_view(control) == "linuxcnc") continue;
    const std::size_t stop = p.line(is_klartext ? " M0" : "M0");
    EXPECT_LE(p.line("M3", stop), stop + 2) << control;
  }
}

// A new speed takes a TOOL CALL, which this control does not take under its tool-centre-point control.
TEST(ControlState, ASpeedThatEndsToolCentrePointControlIsSaidOutsideOfThePart) {
  post::PostOptions options;
  options.rtcp = true;
  const char* const path =
      "UNITS/MM\nLOADTL/1\nSPINDL/4000,RPM,CLW\nFEDRAT/800.,MMPM\nRAPID\nGOTO/20,0,60,0.5,0,0.8660254\n"
      "GOTO/20,0,30,0.5,0,0.8660254\nSPINDL/5000,RPM,CLW\nGOTO/30,0,30,0.5,0.,0.8660254\n"
      "SPINDL/5000,RPM,CLW\nGOTO/30,9,30,0.5,0.,0.8660254\nFINI\n";
  const Program tnc(path, "heidenhain_tnc640", options);
  const std::size_t speed = tnc.line("S5000");
  EXPECT_THAT(tnc.lines()[speed - 2] + tnc.lines()[speed - 1], HasSubstr("M91"));
  EXPECT_EQ(tnc.line("M129", tnc.line("M128")), speed - 2);
  EXPECT_THAT(tnc.with(tnc.line("X+30"), "TOOL CALL Z S5000\nM3"),
              HasSubstr("a speed of the spindle under tool-centre-point control: end that first ('M129')"));
  const Program fanuc(path, "fanuc_30i", options);
  EXPECT_THAT(fanuc.lines()[fanuc.line("S5000") - 1], HasSubstr("Z30."));
}

TEST(ControlState, AToolIsChangedAtTheSafeHeightFromTheFirstOneOn) {
  const Program p(kPath, "linuxcnc");
  EXPECT_THAT(p.without(p.line("G53 G0 Z")), HasSubstr("the tool is changed below the safe height"));
}

TEST(ControlState, CompensationOfTheCutterIsOffAtTheEnd) {
  const Program p(kPath, "fanuc_30i");
  EXPECT_THAT(p.with(p.line("M5", p.line("T2 M6")), "G41 D1"),
              HasSubstr("the program ends with cutter compensation on"));
}

TEST(ControlState, LengthCompensationIsSaidToBeOffWhereTheWordsAreTheSpindles) {
  const Program p(kPath, "linuxcnc", {}, "spindle");
  EXPECT_THAT(p.without(p.line("G49", p.line("T1 M6"))), HasSubstr("the program must say it again"));
}

TEST(ControlState, NoOtherRegisterIsCalledOnTheWay) {
  const Program p(kPath, "iso");
  EXPECT_THAT(p.with(p.line("G43 H1"), "G43 H7"), HasSubstr("register 7, asked for is register 1"));
}

// Where a word of the length may move Z by it at once, 150 mm down into the part.
TEST(ControlState, TheLengthIsSaidAndEndedAtTheSafeHeight) {
  for (const bool rtcp : {false, true}) {
    post::PostOptions options;
    options.rtcp = rtcp;
    const Program p(kPath, "fanuc_30i", options);
    const std::size_t up = p.line("G53 G0 Z", p.line(rtcp ? "X30." : "G1 "));
    const std::size_t low = rtcp ? up - 2 : up;
    EXPECT_THAT(p.with(low, "G49"),
                HasSubstr("tool length compensation is switched on or off below the safe height"));
    if (rtcp) {
      EXPECT_THAT(p.without(low), HasSubstr("is switched on or off below the safe height"));
    }
  }
  // Haas moves nothing there.
  const Program p(kPath, "haas_ngc");
  EXPECT_EQ(p.with(p.line("G53 G0 Z", p.line("G1 ")), "G49"), "");
}

// A control that takes the length out where G49 stands goes down by it, from wherever that is.
TEST(ControlState, AWordThatMayDropTheToolIsWarnedOf) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto warning = [&](double length_mm, bool rtcp, const std::string& control) {
    Machine m = machine;
    m.tool_length_mm = length_mm;
    m.safe.table = TableExtent{100.0, 0.0};
    post::PostOptions options;
    options.rtcp = rtcp;
    const auto p = test::posted(kBeginsWithAFeed, m, options, control);
    EXPECT_TRUE(p.report) << p.report.error().text();
    const auto& findings = p.diagnostics.findings();
    return std::any_of(findings.begin(), findings.end(), [](const Finding& f) {
      return f.message.find("Z may go down by the") != std::string::npos;
    });
  };
  EXPECT_TRUE(warning(340.0, true, "fanuc_30i"));
  EXPECT_FALSE(warning(120.0, true, "fanuc_30i"));
  EXPECT_FALSE(warning(340.0, false, "fanuc_30i"));
  EXPECT_FALSE(warning(340.0, true, "siemens_840d_sl"));
}

// Holes around a ring: between two of them the tool goes to the safe height, and the table turns there.
TEST(ControlState, BetweenHolesOfOtherAxesTheToolIsAtTheSafeHeight) {
  const Program p(
      "UNITS/MM\nLOADTL/1\nSPINDL/2000,RPM,CLW\nRAPID\nGOTO/0,0,60,0,0,1\n"
      "CYCLE/DRILL,DEPTH,10,CLEAR,3,MMPM,100\nGOTO/0,-40,0,0,-0.7071068,0.7071068\n"
      "GOTO/0,40,0,0,0.7071068,0.7071068\nCYCLE/OFF\nRAPID\nGOTO/0,60,20,0,0.7071068,0.7071068\nFINI\n",
      "linuxcnc");
  const std::size_t first = p.line("G1 ");
  const std::size_t second = p.line("G1 ", first + 1);
  const std::size_t up = p.line("G53 G0 Z", first);
  EXPECT_LT(up, second);
  EXPECT_LT(up, p.line("C", first));
}

// No tool change stands between: the control goes on with the tool that it has.
TEST(ControlState, ANewDiameterIsNoNewTool) {
  const auto warnings = [](const std::string& between) {
    const auto p = test::posted(
        "UNITS/MM\nLOADTL/1\nCUTTER/20\nSPINDL/2000,RPM,CLW\nFEDRAT/500,MMPM\nRAPID\n"
        "GOTO/0,0,60,0,0,1\nGOTO/0,0,10\nRAPID\nGOTO/0,0,60\n" +
            between + "SPINDL/2000,RPM,CLW\nRAPID\nGOTO/9,0,60\nGOTO/9,0,10\nFINI\n",
        test::shipped_machine("trunnion_offset"), {}, "linuxcnc");
    EXPECT_TRUE(p.report) << p.report.error().text();
    const auto& findings = p.diagnostics.findings();
    return std::count_if(findings.begin(), findings.end(), [](const Finding& f) {
      return f.message.find(
                 "a diameter of 6 mm, and the tool in the spindle, tool 1, has moved with 20 mm") !=
             std::string::npos;
    });
  };
  EXPECT_EQ(warnings("CUTTER/6\n"), 1);
  EXPECT_EQ(warnings("CUTTER/6\nCUTTER/20\n"), 0);
  EXPECT_EQ(warnings("CUTTER/6\nLOADTL/2\n"), 0);
  EXPECT_EQ(warnings("LOADTL/2\nCUTTER/6\n"), 0);
}

// Python of the interpreter, files of the control.
TEST(ControlState, NoCommentActs) {
  const Program p(kPath, "linuxcnc");
  for (const char* comment : {";py,this.x=1", "(PY,this.x=1)", "( logopen,a.txt)"})
    EXPECT_THAT(p.with(p.line("G1"), comment), HasSubstr("the control executes the comment")) << comment;
  EXPECT_EQ(p.with(p.line("G1"), "(MSG,look)"), "");
  EXPECT_EQ(p.with(p.line("G1"), "(pythons)"), "");
}

TEST(ControlState, AFeedOfZeroIsNone) {
  const Program p(kPath, "fanuc_30i");
  EXPECT_THAT(p.with(p.line("G53 G0 Z"), "F0."), HasSubstr("F is not above 0"));
}

TEST(ControlState, PointsAreCutInTheirOrder) {
  post::PostOptions options;
  options.rtcp = true;
  const Program p(kPath, "fanuc_30i", options);
  const std::size_t at_30 = p.line("X30.");
  // Out to X40, back to X30, on to X50: every place is on the path.
  EXPECT_NE(p.swapped(at_30), "");
}

// There and back on one great circle: without its word the axis never leaves that circle, and is 3.3 deg off
// the point where the tip is.
TEST(ControlState, TheToolAxisIsThatOfThePointWhereTheTipIs) {
  constexpr const char* kThereAndBack =
      "UNITS/MM\nLOADTL/1\nSPINDL/4000,RPM,CLW\nFEDRAT/800.,MMPM\nRAPID\nGOTO/0,0,100,0.5,0,0.8660254\n"
      "GOTO/20,0,30,0.5,0,0.8660254\nGOTO/30,0,30,0.5,0.,0.8660254\nGOTO/40,0,30,0.45,0,0.8930286\n"
      "GOTO/50,0,30,0.5,0,0.8660254\nGOTO/60,0,30,0.5,0,0.8660254\nRAPID\nGOTO/60,0,90,0.5,0,0.8660254\n"
      "FINI\n";
  post::PostOptions options;
  options.rtcp = true;
  for (const char* control : {"fanuc_30i", "haas_ngc", "siemens_840d_sl"}) {
    const Program p(kThereAndBack, control, options);
    const std::size_t at_40 = p.line("X40");
    const std::string line = p.lines()[at_40];
    const auto a = line.find(" A");
    ASSERT_NE(a, std::string::npos) << line;
    const std::string word = line.substr(a, line.find(' ', a + 1) - a);
    EXPECT_EQ(p.with_word(at_40, word, ""), "failed") << control;
  }
}

TEST(ControlState, NothingMovesWithAToolThatNobodyKnows) {
  const Program fanuc(kPath, "fanuc_30i");
  EXPECT_THAT(fanuc.with(fanuc.line("T1 M6"), "G0 X5."), HasSubstr("which tool is in the spindle"));
  EXPECT_THAT(fanuc.with(fanuc.line("T1 M6"), "G0 A5."), HasSubstr("which tool is in the spindle"));
  const Program tnc(kPath, "heidenhain_tnc640");
  EXPECT_THAT(tnc.with(tnc.line("TOOL CALL 1"), "L X+5 R0 FMAX"), HasSubstr("which tool is in the spindle"));
}

TEST(ControlState, AFeedFromAnUnknownPlaceIsJudgedByItsWord) {
  for (const char* control : {"linuxcnc", "heidenhain_tnc640", "siemens_840d_sl"}) {
    const Program p(kBeginsWithAFeed, control);
    const std::size_t first = p.line("F800");
    EXPECT_THAT(p.with_word(first, "F800", "F1600"), HasSubstr("F says 1600.0 mm/min")) << control;
    EXPECT_THAT(p.with_word(first, "F800", "F400"), HasSubstr("F says 400.0 mm/min")) << control;
  }
  const Program p(
      "UNITS/MM\nLOADTL/1\nSPINDL/4000,RPM,CLW\nFEDRAT/800.,MMPM\nGOTO/20,0,30,0.5,0,0.8660254\nRAPID\n"
      "GOTO/45,0,73.30127,0.5,0,0.8660254\nFINI\n",
      "iso");
  EXPECT_THAT(p.with_word(p.line("F800"), "G1", "G93 G1"),
              HasSubstr("inverse time from a place that is not known"));
}

TEST(ControlState, TheWayDownUnderToolCentrePointControlIsStraight) {
  post::PostOptions options;
  options.rtcp = true;
  const Program p(kPath, "haas_ngc", options);
  const std::size_t first = p.line("G234");
  const std::string line = p.lines()[first];
  const auto y = line.find(" Y");
  const std::string word = line.substr(y, line.find(' ', y + 1) - y);
  EXPECT_NE(p.with_word(first, word, " Y30."), "");
  EXPECT_THAT(p.with_word(first, word, ""), HasSubstr("X, Y or Z moves under tool-centre-point control"));
}

}  // namespace
}  // namespace trunnion
