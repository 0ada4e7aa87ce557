// NC programs as paths: a program that is read for its own machine is written again word for word, whatever
// the control; by way of another machine it comes back; what it does not say is refused by its line.
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <sstream>

#include "trunnion/base/files.hpp"
#include "trunnion/machine/table_kinematics.hpp"

#include "post/own_chain.hpp"
#include "post/posting.hpp"
#include "support/folders.hpp"

namespace trunnion::post {
namespace {

struct ReadFrom {
  Machine machine;
  std::string control = "linuxcnc";
  FromPath path = FromPath::near_points;
};

test::Posted reposted(const std::string& nc, const ReadFrom& from, const Machine& given,
                      const PostOptions& options = {}, const std::string& control = "linuxcnc") {
  Machine machine = given;
  machine.switchable_kinematics = machine.switchable_kinematics || options.rtcp;
  Machine made_for = from.machine;
  made_for.switchable_kinematics = made_for.switchable_kinematics || nc.find("M428") != std::string::npos;
  const nc::Controller c = with_axes_of(machine, test::shipped_controller(control));
  const nc::Controller c0 = with_axes_of(made_for, test::shipped_controller(from.control));
  const NcOrigin origin{&made_for, &c0, from.path};
  PostJob job;
  job.cl_file = "part.nc";
  job.from = &origin;
  job.machine = &machine;
  job.controller = &c;
  test::Posted out;
  out.report = post(
      std::make_unique<test::TextOf>(nc), job, options,
      [&](std::string_view text) {
        out.nc += text;
        return Result<void>{};
      },
      out.diagnostics);
  return out;
}

std::string said(const test::Posted& p) {
  std::string out;
  for (const auto& f : p.diagnostics.findings()) out += f.text() + "\n";
  return out;
}

std::string golden(const std::string& name) {
  return read_file(test::source_folder() + "/tests/golden/" + name).value_or("");
}

// Without block numbers, comments and the names that a control gives programs.
std::vector<std::string> words_of(const std::string& nc) {
  std::vector<std::string> out;
  std::istringstream lines(nc);
  for (std::string line; std::getline(lines, line);) {
    const auto number = line.find_first_not_of("N0123456789");
    const bool numbered = !line.empty() && (line[0] == 'N' || std::isdigit(line[0]) != 0);
    if (numbered && number != std::string::npos && line[number] == ' ') line.erase(0, number + 1);
    if (line.empty() || line[0] == '(' || line[0] == ';' || line[0] == 'O' ||
        line.find("PGM") != std::string::npos)
      continue;
    out.push_back(line);
  }
  return out;
}

struct WordsOfPost {
  const char* name;
  PostOptions options;
};

std::vector<WordsOfPost> words_of_posts(const nc::Controller& c) {
  std::vector<WordsOfPost> out = {{"joints", {}}};
  PostOptions native;
  native.native_arcs = native.native_cycles = true;
  out.push_back({"native", native});
  if (c.has_tcp()) {
    PostOptions rtcp;
    rtcp.rtcp = true;
    rtcp.feed = FeedOutput::tip;
    out.push_back({"rtcp", rtcp});
  }
  return out;
}

// Inserted points may lie on both sides of the path, so that the chord between two of them leaves the block
// by more than the tolerance: with three times that nothing is put between.
TEST(NcInput, EveryProgramIsWrittenAgainWordForWord) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  std::size_t programs = 0;
  for (const std::string& control : test::shipped_controllers()) {
    for (const WordsOfPost& v : words_of_posts(test::shipped_controller(control))) {
      for (const char* part : {"part.cls", "shapes.cls"}) {
        const auto first = test::posted(golden(part), machine, v.options, control);
        if (!first.report) continue;  // the control has no words for it
        PostOptions again = v.options;
        again.tolerance_mm = 0.03;
        const auto second = reposted(first.nc, {machine, control}, machine, again, control);
        ASSERT_TRUE(second.report) << control << " " << v.name << ": " << second.report.error().text();
        EXPECT_TRUE(second.report->verification->passed()) << control << " " << v.name;
        EXPECT_EQ(words_of(first.nc), words_of(second.nc)) << control << " " << v.name << " " << part;
        ++programs;
      }
    }
  }
  EXPECT_GE(programs, 36u);
}

// The numbers of a line, with the place of their last digit, and the text between them.
struct LineOfWords {
  std::vector<double> values, digits;
  std::string text;
};

LineOfWords line_of_words(const std::string& line) {
  LineOfWords out;
  for (std::size_t i = 0; i < line.size();) {
    const std::size_t end = line.find_first_not_of("+-.0123456789", i);
    const std::string number = line.substr(i, end - i);
    if (number.find_first_of("0123456789") == std::string::npos) {
      out.text += line[i++];
      continue;
    }
    const std::size_t point = number.find('.');
    const std::size_t decimals = point == std::string::npos ? 0 : number.size() - point - 1;
    out.values.push_back(std::stod(number));
    out.digits.push_back(std::pow(10.0, -static_cast<double>(decimals)));
    out.text += '#';
    i += number.size();
  }
  return out;
}

void expect_within_a_digit(const std::vector<std::string>& a, const std::vector<std::string>& b,
                           const std::string& control) {
  ASSERT_EQ(a.size(), b.size()) << control;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const LineOfWords x = line_of_words(a[i]);
    const LineOfWords y = line_of_words(b[i]);
    ASSERT_EQ(x.text, y.text) << control << ": " << a[i] << " | " << b[i];
    for (std::size_t k = 0; k < x.values.size(); ++k)
      EXPECT_NEAR(x.values[k], y.values[k], 1.001 * std::max(x.digits[k], y.digits[k]))
          << control << ": " << a[i] << " | " << b[i];
  }
}

TEST(NcInput, TiltedPlanesComeBackWithinADigit) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  for (const std::string& control : test::shipped_controllers()) {
    if (!test::shipped_controller(control).has_tilted_plane()) continue;
    PostOptions options;
    options.tilted_plane = true;
    const auto first = test::posted(golden("shapes.cls"), machine, options, control);
    ASSERT_TRUE(first.report);
    options.tolerance_mm = 0.03;
    const auto second = reposted(first.nc, {machine, control}, machine, options, control);
    ASSERT_TRUE(second.report) << control << ": " << second.report.error().text();
    expect_within_a_digit(words_of(first.nc), words_of(second.nc), control);
  }
}

// Tips and tool axes of the feeds of a joint program for LinuxCNC, by the chain of the machine file.
std::vector<ToolPose> cuts_of(const std::string& nc, const Machine& machine) {
  std::map<char, double> at;
  std::vector<ToolPose> out;
  bool feed = false;
  std::istringstream lines(nc);
  for (std::string line; std::getline(lines, line);) {
    if (line.find_first_of("(TMS") == 0 || line.find("G53") != std::string::npos) continue;
    std::istringstream words(line);
    bool moves = false;
    for (std::string word; words >> word;) {
      if (word == "G1") feed = true;
      if (word == "G0") feed = false;
      if (std::string("XYZAC").find(word[0]) == std::string::npos) continue;
      at[word[0]] = std::stod(word.substr(1));
      moves = true;
    }
    if (!moves || !feed) continue;
    JointVector q;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      const double value = at[machine.axes[id].name[0]];
      q[id] = machine.axes[id].kind == AxisKind::rotary ? Angle::degrees(value).rad() : value;
    }
    const Vec3 tool(0.0, 0.0, -machine.tool_length_mm);
    out.push_back(TableKinematics(machine, tool).pose(joints_of_words(machine, q, tool)));
  }
  return out;
}

TEST(NcInput, ByWayOfAnotherMachineThePathComesBack) {
  const Machine a = test::shipped_machine("trunnion_offset");
  const Machine b = test::shipped_machine("nutating_45");
  const auto first = test::posted(golden("part.cls"), a);
  ASSERT_TRUE(first.report);
  const auto there = reposted(first.nc, {a}, b);
  ASSERT_TRUE(there.report) << there.report.error().text();
  const auto back = reposted(there.nc, {b}, a);
  ASSERT_TRUE(back.report) << back.report.error().text();
  const auto wanted = cuts_of(first.nc, a);
  const auto got = cuts_of(back.nc, a);
  ASSERT_FALSE(wanted.empty());
  ASSERT_FALSE(got.empty());
  // Every point of the first is passed by the last: digits of both machines, no tolerance is used up at
  // points.
  for (const ToolPose& pose : wanted) {
    double nearest = 1e9;
    for (const ToolPose& p : got)
      nearest = std::min(nearest, (p.tip_P - pose.tip_P).norm() + 10.0 * (p.axis_P - pose.axis_P).norm());
    EXPECT_LT(nearest, 1e-3);
  }
}

// One block through a quarter turn of C: the tip of the machine leaves its chord by r (1 - cos 45 deg).
TEST(NcInput, ThePathBetweenPointsIsChosen) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string nc =
      "G21 G90 G17\nG54\nT1 M6\nG43 H1\nS1000 M3\nG0 A30 C0\nG0 X40 Y0\nG0 Z50\nG1 Z40 F500\n"
      "G1 X40 Y0 Z40 C90 F500\nG0 Z100\nM2\n";
  ReadFrom from{machine};
  // Nobody has said which: the middle of the quarter turn is 40 (1 - cos 45 deg) = 11.72 mm off.
  const auto open = reposted(nc, from, machine);
  ASSERT_FALSE(open.report);
  EXPECT_THAT(said(open),
              ::testing::HasSubstr("part.nc:10:4: error: rotary axes turn by 90.00 deg in this cut"));
  EXPECT_THAT(said(open), ::testing::HasSubstr("--from-path motion"));
  from.path = FromPath::points;
  const auto points = reposted(nc, from, machine);
  ASSERT_TRUE(points.report) << points.report.error().text();
  EXPECT_THAT(said(points), ::testing::HasSubstr("this deviation is dropped"));
  EXPECT_EQ(points.report->points_in, 4u);
  EXPECT_GT(points.report->points_inserted, 10u);
  from.path = FromPath::motion;
  const auto motion = reposted(nc, from, machine);
  ASSERT_TRUE(motion.report) << motion.report.error().text();
  EXPECT_GT(motion.report->points_in, 20u);
  // As the machine moves: X, Y, Z and A stand while C turns.
  std::size_t turning = 0;
  for (const std::string& line : words_of(motion.nc)) {
    if (line.find('C') == std::string::npos || line.find("G0") != std::string::npos) continue;
    ++turning;
    for (const char* word : {"X", "Y", "Z", "A"}) {
      const auto at = line.find(word);
      if (at == std::string::npos) continue;
      const double value = std::stod(line.substr(at + 1));
      EXPECT_NEAR(value, *word == 'X' ? 40.0 : *word == 'Z' ? 40.0 : *word == 'A' ? 30.0 : 0.0, 2e-3) << line;
    }
  }
  EXPECT_GT(turning, 20u);
}

// The table is indexed over the part while X, Y and Z stand: a straight line of the tip would lead through
// it.
TEST(NcInput, RapidsGoAsTheMachineTakesThem) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string nc =
      "G21 G90 G17\nG54\nT1 M6\nG43 H1\nS1000 M3\nG0 A40 C0\nG0 X30 Y10\nG0 Z50\nG1 Z10 F200\nG0 Z100\n"
      "G0 C180\nG0 Z50\nG1 Z10 F200\nG0 Z100\nM2\n";
  const auto p = reposted(nc, {machine}, machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  const std::vector<std::string> lines = words_of(p.nc);
  const auto last = std::find_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.find("C180.0") != std::string::npos;
  });
  ASSERT_NE(last, lines.end());
  std::size_t turning = 0;
  for (auto line = last; line != lines.begin() && line->find('C') != std::string::npos; --line, ++turning) {
    for (const auto& [word, stands] : {std::pair{'X', 30.0}, {'Y', 10.0}, {'Z', 100.0}, {'A', 40.0}}) {
      const auto at = line->find(word);
      if (at == std::string::npos) continue;
      EXPECT_NEAR(std::stod(line->substr(at + 1)), stands, 2e-3) << *line;
    }
  }
  EXPECT_GT(turning, 5u);
}

// A ring that is milled by a turn of the table: its ends are one place.
TEST(NcInput, ATurnOfTheTableUnderTheToolIsNotLost) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string nc =
      "G21 G90 G17\nG54\nT1 M6\nG43 H1\nS1000 M3\nG0 A0 C0\nG0 X30 Y10\nG0 Z50\nG1 Z10 F200\n"
      "G1 C360 F1000\nG0 Z50\nM2\n";
  ReadFrom from{machine};
  EXPECT_FALSE(reposted(nc, from, machine).report);
  from.path = FromPath::motion;
  const auto ring = reposted(nc, from, machine);
  ASSERT_TRUE(ring.report) << ring.report.error().text();
  const double radius = std::hypot(30.0, 10.0);
  EXPECT_GT(static_cast<double>(ring.report->points_in), 2.0 * kPi / (2.0 * std::acos(1.0 - 0.001 / radius)));
}

TEST(NcInput, ARotaryAxisBeyondItsTravelIsNoPlace) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto p =
      reposted("G21 G90 G17\nG54\nT1 M6\nG43 H1\nS1000 M3\nG0 A10 C0\nG0 X30 Y10\nG0 Z50\nG1 A370 F200\nM2\n",
               {machine}, machine);
  ASSERT_FALSE(p.report);
  EXPECT_THAT(said(p), ::testing::HasSubstr("axis A would stand at 370.00 deg, beyond its travel"));
}

// As posts of CAM systems and people at controls write them.
TEST(NcInput, ProgramsOfOthersAreRead) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string iso =
      "%\nO1001 (PART)\nN10 G90 G94 G17 G49 G40 G80\nN15 G21\nN20 G28 G91 Z0.\nN25 G90\nN30 T1 M06\n"
      "N35 S5000 M03\nN40 G54\nN45 M08\nN50 G00 A30. C0.\nN55 G00 X48. Y5.\nN60 G43 Z65. H01\nN65 G00 Z55.\n"
      "N70 G01 Z50. F333.\nN75 G03 X45. Y8. I-3. J0. F1000.\nN80 G01 X-45.\nN85 G03 X-50. Y3. R5.\n"
      "N90 G01 Y-10.\nN95 G00 Z65.\nN100 M09\nN105 M05\nN110 G28 G91 Z0.\nN115 G90\nN120 G49\n"
      "N125 G28 G91 X0. Y0.\nN130 G90\nN135 M30\n%\n";
  const std::string conversational =
      "0  BEGIN PGM PART MM\n1  BLK FORM 0.1 Z X-50 Y-50 Z-20\n2  BLK FORM 0.2 X+50 Y+50 Z+0\n"
      "3  TOOL CALL 1 Z S5000 F500\n4  M126\n5  L Z+200 R0 FMAX M91\n6  L A+30 C+90 R0 FMAX M3\n"
      "7  L X+10 Y+10 R0 FMAX\n8  L Z+60 R0 FMAX M8\n9  L Z+50 R0 F500\n10 L X+20 Y+20\n12 CC X+20 Y+30\n"
      "13 C X+30 Y+30 DR+\n14 L Z+100 R0 FMAX M9\n15 M30\n16 END PGM PART MM\n";
  const std::string traori =
      "; PART\nN10 G17 G90 G40 G94 G710\nN15 RTLION\nN20 T1\nN30 M6\nN40 D1\nN50 S5000 M3\nN60 G54\n"
      "N70 G0 A30 C=DC(90)\nN80 G0 X10 Y10\nN90 G0 Z60\nN100 G1 Z50 F500\nN110 G1 X20 Y20\n"
      "N120 G2 X30 Y20 I5 J0\nN130 G0 Z100\nN140 SUPA G0 Z700 D0\nN150 M30\n";
  for (const auto& [nc, control] :
       std::initializer_list<std::pair<std::string, std::string>>{{iso, "fanuc_30i"},
                                                                  {iso, "iso"},
                                                                  {iso, "haas_ngc"},
                                                                  {conversational, "heidenhain_tnc640"},
                                                                  {traori, "siemens_840d_sl"}}) {
    const auto p = reposted(nc, {machine, control}, machine);
    ASSERT_TRUE(p.report) << control << ": " << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed()) << control;
  }
}

// Haas took G69 of its base file, alone in its line, for a word that says nothing: what came behind stayed
// turned, 42 mm beside the path.
TEST(NcInput, ATurnEndsWhereItsWordSays) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto program = [](const std::string& cuts) {
    return "%\nO1\nG21 G90 G94 G17 G40 G49 G80\nG54\nT1 M6\nS1000 M3\nG0 A0. C0.\nG0 X30. Y0.\nG43 H1 Z60.\n"
           "G1 Z10. F100.\n" +
           cuts + "X30. Y0.\nX20. Y0.\nG0 Z60.\nM30\n%\n";
  };
  for (const std::string control : {"fanuc_30i", "haas_ngc"}) {
    const auto turned = reposted(program("G68 X0. Y0. R90.\nX40. Y0.\nG69\n"), {machine, control}, machine);
    const auto plain = reposted(program("X0. Y40.\n"), {machine, control}, machine);
    ASSERT_TRUE(turned.report && plain.report) << control << said(turned) << said(plain);
    EXPECT_EQ(words_of(turned.nc), words_of(plain.nc)) << control;
  }
}

// X and Y of a tilted plane stay where they are when the length is added along the tool.
TEST(NcInput, TheLengthMayFollowXAndYInATiltedPlane) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto program = [](const std::string& approach) {
    return "%\nO1000\nG21 G17 G40 G49 G80 G90 G94\nG28 G91 Z0.\nG90\nT1 M6\nG54\nS1000 M3\n"
           "G68.2 X0. Y0. Z0. I0. J30. K0.\nG53.1\n" +
           approach + "G1 Z5. F500.\nX30.\nG0 Z60.\nG69\nM30\n%\n";
  };
  const ReadFrom from{machine, "fanuc_30i"};
  const auto behind = reposted(program("G0 X10. Y20.\nG43 H1 Z50.\n"), from, machine);
  ASSERT_TRUE(behind.report) << said(behind);
  EXPECT_TRUE(behind.report->verification->passed());
  const auto beside = reposted(program("G0 G43 H1 X10. Y20. Z50.\n"), from, machine);
  ASSERT_TRUE(beside.report) << said(beside);
  EXPECT_EQ(words_of(behind.nc), words_of(beside.nc));
  EXPECT_THAT(behind.nc, ::testing::HasSubstr("A30"));
}

// The speed of the tool before is not that of the new one, and whether M3 goes on is not known.
TEST(NcInput, ACutBehindAToolChangeWantsTheSpindleStarted) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto part = [](const std::string& of_second) {
    return "BEGIN PGM A MM\nTOOL CALL 4 Z S800\nM3\nL A+0 C+0 R0 FMAX\nL X+0 Y+0 FMAX\nL Z+50 FMAX\n"
           "L Z-1 F100\nL Z+50 FMAX\n" +
           of_second +
           "L A+0 C+0 R0 FMAX\nL X+20 Y+0 FMAX\nL Z+50 FMAX\nL Z-1 F100\nL X+30\nL Z+50 FMAX\nM30\n"
           "END PGM A MM\n";
  };
  const ReadFrom from{machine, "heidenhain_tnc640"};
  for (const char* second : {"TOOL CALL 7 Z S18000\n", "M5\nTOOL CALL 7 Z S18000\n"}) {
    const auto p = reposted(part(second), from, machine, {}, "fanuc_30i");
    EXPECT_FALSE(p.report) << second;
    EXPECT_NE(said(p).find("a cut after a tool change without a spindle start"), std::string::npos)
        << said(p);
  }
  const auto right = reposted(part("TOOL CALL 7 Z S18000\nM3\n"), from, machine, {}, "fanuc_30i");
  ASSERT_TRUE(right.report) << said(right);
  // The old tool never turns at the speed of the new one.
  EXPECT_LT(right.nc.find("T7 M6"), right.nc.find("S18000 M3"));
}

struct RefusedLines {
  const char* lines;
  const char* says;
};

TEST(NcInput, WhatIsNotUnderstoodIsRefusedByItsLine) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string head =
      "G21 G90 G17\nG54\nT1 M6\nG43 H1\nS1000 M3\nG0 A30 C0\nG0 X40 Y0\nG0 Z50\nG1 Z40 F500\n";
  for (const RefusedLines& r : std::initializer_list<RefusedLines>{
           {"G92.2\n", "G92.2"},
           {"M98 P1000\n", "M98"},
           {"G68 X0 Y0 R10\n", "G68"},
           {"G1 X#5420\n", "#5420"},
           {"/G1 X1\n", "block delete"},
           {"G41 D1\nG1 X1\n", "cutter compensation"},
           {"G2 X50 Y0\n", "centre"},
           {"G2 X50 Y0 R1\n", "radius"},
           {"G2 X50 Y0 I3 J0\n", "radius to the start"},
           {"G49\nG0 X1 Y1 Z99\nG1 X2 F100\n", "length"},
           {"T2 M6\nG43 H2\nG1 X1\n", "gives no position of these axes"},
           {"G53 G0 Z300\nG1 X1\n", "Z"},
           {"G53 G1 Z300\n", "rapid"},
           {"G18\nG81 X1 Y1 Z1 R2\n", "plane"},
           {"G91\nG81 X1 Y1 Z-1 R-2\n", "G91"},
           {"G81 X1 Y1 Z1\n", "R word"},
           {"G1 X1 B5\n", "axis B"},
           {"T1.5 M6\n", "whole"},
           {"G28 Z50\nG91\nG1 Z-5\n", "increment"},
           {"G1 X41\nG43 H2\nG1 X42 Z40\n", "length register 2"},
       }) {
    const auto p = reposted(head + r.lines + "M2\n", {machine}, machine);
    ASSERT_FALSE(p.report) << r.lines;
    EXPECT_EQ(p.report.error().code, ErrorCode::wrong_input) << r.lines << p.report.error().text();
    EXPECT_NE(p.report.error().text().find(r.says), std::string::npos) << r.lines << p.report.error().text();
    EXPECT_NE(p.report.error().text().find("part.nc:1"), std::string::npos) << p.report.error().text();
  }
  // Cut short, empty, no motion.
  for (const std::string& text : {head, std::string(), std::string("G21\nM2\n")}) {
    EXPECT_FALSE(reposted(text, {machine}, machine).report) << text;
  }
}

// Words of the gauge point, length compensation off: where it was on for the tool before, controls keep it.
TEST(NcInput, ALengthThatMayStillBeOnIsRefused) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.output_point = OutputPoint::spindle;
  const auto with = [](const std::string& before, const std::string& behind) {
    return "G21 G90 G17\nG54\nT1 M6\nS1000 M3\n" + before +
           "G0 A30 C0\nG0 X40 Y0\nG0 Z150\nG1 Z140 F500\nG0 Z300\nT2 M6\n" + behind +
           "S1000 M3\nG0 A30 C0\nG0 X40 Y0\nG0 Z150\nG1 Z145 F500\nM2\n";
  };
  const auto p = reposted(with("G43 H1\n", ""), {machine}, machine);
  ASSERT_FALSE(p.report);
  EXPECT_NE(p.report.error().text().find("with length compensation on before it"), std::string::npos)
      << p.report.error().text();
  const auto ended = reposted(with("G43 H1\nG49\n", "G49\n"), {machine}, machine);
  EXPECT_TRUE(ended.report) << ended.report.error().text();
  const auto off = reposted(with("", ""), {machine}, machine);
  EXPECT_TRUE(off.report) << off.report.error().text();
}

TEST(NcInput, ARotaryAxisMayStandAtALimitOfZero) {
  Machine machine = test::shipped_machine("trunnion_offset");
  for (Axis& axis : machine.axes) {
    if (axis.kind != AxisKind::rotary) continue;
    axis.cyclic = false;
    axis.min = 0.0;
    axis.max = axis.name == "C" ? 2.0 * M_PI : M_PI / 2;
  }
  const auto with = [&](const std::string& rotary) {
    return reposted("G21 G90 G17\nG54\nT1 M6\nS1000 M3\nG43 H1\nG0 " + rotary +
                        "\nG0 X40 Y0\nG0 Z150\nG1 Z140 F500\nG0 Z300\nM2\n",
                    {machine}, machine);
  };
  for (const std::string rotary : {"A0 C0", "A90 C360", "A0 C360"}) {
    const auto p = with(rotary);
    EXPECT_TRUE(p.report) << rotary << p.report.error().text();
  }
  const auto beyond = with("A0 C-0.01");
  ASSERT_FALSE(beyond.report);
  EXPECT_NE(beyond.report.error().text().find("beyond its travel"), std::string::npos)
      << beyond.report.error().text();
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t out = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++out;
  return out;
}

// Where tool-centre-point control ends, no position is known, and the retract behind it is one all the same;
// nor does a tool go straight to where axes lead that are said one after the other.
TEST(NcInput, ARetractBehindToolCentrePointControlIsKept) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string haas =
      "%\nO1\nG17 G21 G40 G49 G80 G90 G94\nG54\nT1 M6\nS1000 M3\nG53 G0 Z700.\nG0 A30. C0.\nG234 H1 X10. Y0. "
      "Z80.\n"
      "G0 Z50.\nG1 Z40. F500.\nX20.\nG49\nG53 G0 Z700.\nG0 A30.01 C0.\nG234 H1 X20.5 Y0. Z80.\nG0 Z50.\nG1 "
      "Z40.\nX25.\n"
      "G49\nG53 G0 Z700.\nM30\n%\n";
  const auto p = reposted(haas, {machine, "haas_ngc"}, machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_EQ(count_of(p.nc, "G53 G0 Z"), 4u) << p.nc;
  const std::string linuxcnc =
      "G21 G90 G17\nG54\nT1 M6\nG43 H1\nS1000 M3\nM428\nG0 A30 C0\nG0 X10 Y0 Z80\nG0 Z50\nG1 Z40 "
      "F500\nX20\nM429\n"
      "G0 Z100\nG0 X-60 Y0\nG0 Z90\nG1 Z85\nG0 Z150\nM2\n";
  const auto q = reposted(linuxcnc, {machine}, machine);
  ASSERT_TRUE(q.report) << q.report.error().text();
  EXPECT_EQ(count_of(q.nc, "G53 G0 Z"), 4u) << q.nc;
}

// As our own programs begin where the CL file has no rapid: straight down from the retract, at a feed.
TEST(NcInput, ACutStraightDownFromARetractBeginsAPath) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto program = [](const std::string& retract, const std::string& before, const std::string& cut) {
    return "G21 G90 G94 G17\nG54\nT1 M6\nG43 H1\n" + retract + "G0 A30 C10\nG0 X10 Y5\n" + before + "G1 " +
           cut + "F500\nX20\nG53 G0 Z700\nM2\n";
  };
  const std::string retract = "G53 G0 Z700\n";
  const auto p = reposted(program(retract, "S1000 M3\n", "Z40 "), {machine}, machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_EQ(count_of(p.nc, "X10.0000 Y5.0000\nG1 Z40.0000 F500.000"), 1u) << p.nc;
  for (const auto& refused : {program("", "", "Z40 "), program(retract, "", "X11 Z40 "),
                              program(retract, "", "A31 Z40 "), program(retract, "G55\n", "Z40 "),
                              program(retract, "", "Z40 G93 "), program(retract, "G49\nG43 H2\n", "Z40 ")}) {
    const auto q = reposted(refused, {machine}, machine);
    EXPECT_FALSE(q.report) << refused;
  }
}

TEST(NcInput, ToolsMayHaveNames) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto program = [](const std::string& lines) {
    return "N10 G17 G90 G40 G94 G710\nT=\"FR 10\" ; T=\"A\"\nM6\nD1\nS5000 "
           "M3\nG54\nCYCLE832(0.01,_FINISH,1)\nMSG(\"X5\")\nCOMPCAD\n"
           "G0 A30 C=DC(90)\nG0 X10 Y10\nG0 Z60\nG1 Z50 F500\n" +
           lines +
           "G0 Z100\nSUPA G0 Z700 D0\nT=\"FR 12\"\nM6\nD1\nS500 M3\nG0 A30 C=DC(90)\nG0 X10 Y10\nG0 Z60\nG1 "
           "Z50\nG0 Z100\nM30\n";
  };
  const auto p = reposted(program(""), {machine, "siemens_840d_sl"}, machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_EQ(count_of(p.nc, "T1001 M6"), 1u);
  EXPECT_EQ(count_of(p.nc, "T1002 M6"), 1u);
  std::size_t warned = 0;
  for (const auto& f : p.diagnostics.findings())
    warned += f.text().find("has no number: it is T100") != std::string::npos;
  EXPECT_EQ(warned, 2u);
  for (const char* lines :
       {"CYCLE832(0.01) X5\n", "MSG(\"a\") G1 X5\n", "CYCLE832(0.01\n", "AROT X5\n", "T=\"A\n"}) {
    const auto refused = reposted(program(lines), {machine, "siemens_840d_sl"}, machine);
    EXPECT_FALSE(refused.report) << lines;
  }
}

// G254: X Y Z stay along the machine's axes, their zero goes with the part. A chain of the tests' own says
// where the tip is in the part, and a program under tool-centre-point control goes there.
TEST(NcInput, AZeroThatGoesWithThePartIsThatOfThePart) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const test::OwnChain chain = test::own_chain("trunnion_offset");
  const double a = 35.0, c = 70.0;
  // The part's zero as the table stands, and a place seen from it.
  const auto part_of = [&](const Vec3& word) {
    const auto turned_back = [&](Vec3 v) {
      for (std::size_t k = 0; k < 2; ++k)
        v = test::turned(v, chain.axis[k], -(k == 0 ? a : c) * kRadPerDegree);
      return v;
    };
    return turned_back(word);
  };
  const auto text = [](const Vec3& v) {
    std::string out;
    for (int i = 0; i < 3; ++i) out += std::string(" ") + "XYZ"[i] + std::to_string(v[i]);
    return out;
  };
  const std::string head = "G21 G90 G17\nG54\nT1 M6\nS1000 M3\n";
  const Vec3 places[] = {{10, -20, 60}, {10, -20, 40}, {30, 5, 38}, {25, 15, 39}};
  std::string follows = head + "G43 H1\nG254\nG0 A35. C70.\n", tip = head + "G234 H1\nG0 A35. C70.\n";
  for (const Vec3& place : places) {
    const std::string kind = &place == places ? "G0" : "G1";
    const std::string feed = &place == places ? "\n" : " F500.\n";
    follows += kind + text(place) + feed;
    tip += kind + text(part_of(place)) + feed;
  }
  const auto p = reposted(follows + "G255\nM5\nM30\n", {machine, "haas_ngc"}, machine);
  const auto q = reposted(tip + "G49\nM5\nM30\n", {machine, "haas_ngc"}, machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  ASSERT_TRUE(q.report) << q.report.error().text();
  EXPECT_EQ(words_of(p.nc), words_of(q.nc));
  EXPECT_EQ(count_of(p.nc, "A35.0000"), 1u) << p.nc;
}

TEST(NcInput, ARemarkIsKeptAndMarked) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto p = reposted(
      "(head)\nG21 G90 G17\nG54\nT1 M6\nG43 H1\nS1000 M3\nG0 A30 C0\nG0 X40 Y0\nG0 Z50\n(WITHIN TOLERANCE: "
      "0)\nG1 Z40 F500\nM2\n",
      {machine}, machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_NE(p.nc.find("(- WITHIN TOLERANCE: 0)"), std::string::npos);
}

// The unit of a program that does not say it: mm, and a warning.
TEST(NcInput, TheUnitIsWarnedOf) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string nc = "G54\nT1 M6\nG43 H1\nS1000 M3\nG0 A30 C0\nG0 X4 Y0\nG0 Z5\nG1 Z4 F50\nM2\n";
  const auto mm = reposted(nc, {machine}, machine);
  ASSERT_TRUE(mm.report) << mm.report.error().text();
  std::size_t warned = 0;
  for (const auto& f : mm.diagnostics.findings()) warned += f.text().find("--cl-units") != std::string::npos;
  EXPECT_EQ(warned, 1u);
  PostOptions inches;
  inches.cl.units = cl::ReaderOptions::Units::inch;
  const auto inch = reposted(nc, {machine}, machine, inches);
  ASSERT_TRUE(inch.report) << inch.report.error().text();
  EXPECT_NE(inch.nc.find("Z101.6"), std::string::npos);
  const auto said = reposted("G20\n" + nc, {machine}, machine);
  ASSERT_TRUE(said.report);
  EXPECT_EQ(words_of(said.nc), words_of(inch.nc));
}

}  // namespace
}  // namespace trunnion::post
