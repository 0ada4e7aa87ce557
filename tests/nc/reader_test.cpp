// What the reader takes, what it refuses, and where it says the fault is.
#include <array>
#include <cctype>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "support/controllers.hpp"

namespace trunnion {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> read(const std::string& controller, const std::string& text) {
  std::vector<std::string> out;
  for (const auto& block : test::nc_blocks(test::shipped_controller(controller), text))
    out.push_back(to_text(block));
  return out;
}

std::vector<std::string> errors_of(const std::string& name, const std::string& text) {
  const auto controller = test::shipped_controller(name);
  Diagnostics diagnostics;
  const auto blocks = nc::read_program(controller, text, "p.nc", diagnostics);
  EXPECT_FALSE(blocks);
  std::vector<std::string> out;
  for (const auto& f : diagnostics.findings()) out.push_back(f.text());
  return out;
}

std::string first_error_of(const std::string& name, const std::string& text) {
  const auto errors = errors_of(name, text);
  return errors.empty() ? std::string() : errors.front();
}

TEST(Reader, GivesEveryAxisThatIsKnown) {
  EXPECT_THAT(read("linuxcnc", "G0 X1\nY2 Z-.5\ng1c90.5f100\nM2"),
              ElementsAre("program start  1", "rapid X 10000", "rapid X 10000 Y 20000 Z -5000",
                          "feed X 10000 Y 20000 Z -5000 C 905000 | per min 100000", "program end"));
}

TEST(Reader, TakesWordsInAnyOrderAndAnySpelling) {
  EXPECT_THAT(read("linuxcnc", "F100.0Z+2.X01G01;move\n\n  ( a comment ) \nN7 m30"),
              ElementsAre("program start  1", "comment move", "feed X 10000 Z 20000 | per min 100000",
                          "comment a comment", "program end"));
}

// Lines in capital letters have a way of their own: it takes and refuses what the other one does.
TEST(Reader, ReadsCapitalLettersAsItReadsSmallOnes) {
  std::mt19937_64 random(20261121);
  const std::array<std::string, 14> pieces = {"X", "Y", "Z", "A", "C", "F",  "G",
                                              "M", "-", ".", " ", "1", "25", "0"};
  for (const std::string& name :
       {std::string("linuxcnc"), std::string("fanuc_30i"), std::string("heidenhain_tnc640")}) {
    const auto controller = test::shipped_controller(name);
    std::size_t understood = 0;
    for (int i = 0; i < 500; ++i) {
      std::string line = name == "heidenhain_tnc640" ? "L X+1. F100. "
                         : i % 2 == 0                ? "G1 F100. "
                                                     : "G94 G1 X1. F30. ";
      for (int n = 0; n < 8; ++n) {
        line += pieces[random() % 5];
        for (std::size_t k = random() % 8 == 0 ? 2 : 0; k > 0; --k) line += pieces[5 + random() % 9];
        line += std::to_string(random() % 1000) +
                (random() % 8 != 0 ? "." + std::to_string(random() % 2000) : "");
        if (random() % 3 == 0) break;
      }
      std::string small = line;
      for (char& c : small) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
      const auto outcome = [&](const std::string& text) {
        Diagnostics diagnostics;
        const auto blocks = nc::read_program(controller, text + "\n", "p.nc", diagnostics);
        std::vector<std::string> out;
        for (const auto& f : diagnostics.findings()) {
          std::string found = f.text();
          for (char& c : found) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
          out.push_back(found);
        }
        std::vector<std::string> motions;
        nc::Reader reader(controller, "p.nc", diagnostics,
                          [&](const nc::Block& block) { motions.push_back(to_text(block)); });
        reader.feed(text + "\n");
        if (motions.size() > 1) ++understood;
        out.insert(out.end(), motions.begin(), motions.end());
        return out;
      };
      EXPECT_EQ(outcome(line), outcome(small)) << name << ": " << line;
    }
    EXPECT_GT(understood, 20U) << name;
  }
}

TEST(Reader, ResolvesTheFeedMode) {
  EXPECT_THAT(read("linuxcnc", "G93 G1 X1 F2.5\nX2 F3\nG94 X3 F100\nX4\nM2"),
              ElementsAre("program start  1", "feed X 10000 | 1/min 25000", "feed X 20000 | 1/min 30000",
                          "feed X 30000 | per min 100000", "feed X 40000 | per min 100000", "program end"));
}

TEST(Reader, KeepsToolAndSpeedForALaterLine) {
  EXPECT_THAT(
      read("linuxcnc", "T5\nS900\nM6\nM3\nG43 H7\nM2"),
      ElementsAre("program start  1", "tool 5 offset 5", "spindle clockwise 900", "length 7", "program end"));
}

TEST(Reader, RunsStopsAfterTheMotionOfTheirLine) {
  EXPECT_THAT(read("linuxcnc", "M8 G0 X1 M0\nM2"),
              ElementsAre("program start  1", "coolant flood", "rapid X 10000", "stop", "program end"));
}

TEST(Reader, ForgetsPositionsThatAToolChangeOrAnOffsetMakesUnknown) {
  EXPECT_THAT(read("linuxcnc", "G0 X1 Y1 Z1 A1\nT1 M6\nA2\nG43 H1\nX1\nG55\nY3\nM2"),
              ElementsAre("program start  1", "rapid X 10000 Y 10000 Z 10000 A 10000", "tool 1 offset 1",
                          "rapid A 20000", "length 1", "rapid X 10000 A 20000", "work offset 2",
                          "rapid Y 30000", "program end"));
}

TEST(Reader, TurnsAModuloAxisTheShorterWay) {
  EXPECT_THAT(read("heidenhain_tnc640",
                   "0 BEGIN PGM A MM\n1 L C+350 FMAX\n2 L C+10 F100\n3 L C+350\n4 L C+180 A-30\n5 M30\n6 END "
                   "PGM A MM"),
              ElementsAre("program start A 1", "rapid C 3500000", "feed C 3700000 | per min 100000",
                          "feed C 3500000 | per min 100000", "feed A -300000 C 1800000 | per min 100000",
                          "program end"));
}

TEST(Reader, KnowsThatG49EndsWhicheverIsActive) {
  EXPECT_THAT(read("fanuc_30i", "%\nO12\nG0 G43 H1 Z5.\nG49\nG0 G43.4 H2 Z6.\nG49\nG49\nM30\n%"),
              ElementsAre("program start  12", "length 1", "rapid Z 5000", "length 0", "tcp on offset 2",
                          "rapid Z 6000", "tcp off", "program end"));
}

TEST(Reader, GivesBackRawLinesItIsToldOf) {
  nc::ReaderOptions options;
  options.raw_lines = {"M123 Q7"};
  const auto blocks = test::nc_blocks(test::shipped_controller("linuxcnc"), "M123 Q7 \nM2\n", options);
  ASSERT_EQ(blocks.size(), 3U);
  EXPECT_EQ(to_text(blocks[1]), "raw M123 Q7");
}

TEST(Reader, ReadsMoreDecimalsWhenAsked) {
  auto controller = test::shipped_controller("linuxcnc");
  controller.numbers.axes = nc::AxisFormat(7, 7);
  const auto blocks = test::nc_blocks(controller, "G0 X1.2345678 C-0.5\nM2");
  EXPECT_EQ(to_text(blocks[1]), "rapid X 12345678 C -5000000");
}

TEST(Reader, SaysWhatIsWrongAndWhere) {
  const auto one = [](const std::string& text) {
    const auto errors = errors_of("linuxcnc", text);
    return errors.empty() ? std::string() : errors.front();
  };
  EXPECT_THAT(one("G0 X1\nG68.2 X1\nM2"), HasSubstr("p.nc:2:1: error: 'G68.2' is not known to LinuxCNC ("));
  EXPECT_EQ(one("G0 X1\n G91 X1\nM2"), "p.nc:2:2: error: G91: incremental programs are not read");
  EXPECT_EQ(one("G20\nM2"), "p.nc:1:1: error: G20: inch programs are not read");
  EXPECT_EQ(one("X1\nM2"), "p.nc:1:1: error: axis words before any G0 or G1");
  EXPECT_EQ(one("G1 X1\nM2"), "p.nc:1:4: error: feed move without feed");
  EXPECT_EQ(one("G93 G1 X1 F1\nX2\nM2"),
            "p.nc:2:1: error: feed move without F, which inverse time needs in every block");
  EXPECT_EQ(one("G0 X1 Y2 X3\nM2"), "p.nc:1:10: error: two X words in one block");
  EXPECT_EQ(one("G0 X1.23456\nM2"), "p.nc:1:4: error: 'X1.23456' has more decimals than 4, or is too large");
  EXPECT_THAT(one("G0 X1e5\nM2"), HasSubstr("p.nc:1:6: error: 'e5' is not known to LinuxCNC"));
  EXPECT_EQ(one("G0 X--1\nM2"), "p.nc:1:4: error: no number after 'X'");
  EXPECT_EQ(one("G0 X1 (open\nM2"), "p.nc:1:7: error: a comment without its end");
  EXPECT_EQ(one("/G0 X1\nM2"),
            "p.nc:1:1: error: block delete '/' is not evaluated: it is unknown whether the control runs this "
            "block");
  EXPECT_EQ(one("#1=5\nM2"), "p.nc:1:1: error: '#' is not understood");
  EXPECT_EQ(one(std::string("G0 \x01\nM2")), "p.nc:1:4: error: byte 0x01 is not understood");
  EXPECT_EQ(one("TRAORI\nM2"), "p.nc:1:1: error: 'TRAORI' is not understood");
  EXPECT_EQ(one("G0 X1\n"), "p.nc:2: error: the program has no end (M2)");
  EXPECT_EQ(one("M2\nG0 X1"), "p.nc:2:1: error: text after the end of the program");
  EXPECT_EQ(one("G4 P1 X5\nM2"),
            "p.nc:1:7: error: axis words stand in one block with words that exclude motion");
  EXPECT_EQ(one("M3\nM2"), "p.nc:1:1: error: the spindle is to turn without a speed");
}

TEST(Reader, RefusesNumbersWithoutPointWhereTheyMeanIncrements) {
  EXPECT_THAT(first_error_of("fanuc_30i", "%\nO1\nG0 X10\nM30\n%"),
              HasSubstr("p.nc:3:4: error: 'X10' has no decimal point"));
  EXPECT_THAT(read("fanuc_30i", "%\nO1\nG0 X0 Y10.\nM30\n%"),
              ElementsAre("program start  1", "rapid X 0 Y 10000", "program end"));
}

// Block by block, and in runs of blocks that are read together.
TEST(Reader, RefusesAnFThatTheControlDoesNotTake) {
  std::string many = "G90\nG0 X0. Y0. Z50.\nG93 G1 Z20. F400.\n";
  for (int i = 1; i <= 40; ++i)
    many += "X" + std::to_string(i) + ".125 Y" + std::to_string(i) + ".250 F9999.999\n";
  EXPECT_FALSE(read("fanuc_30i", many + "M30\n").empty());
  EXPECT_THAT(first_error_of("fanuc_30i", many + "X1.125 Y1.250 F10000.000\nX2.125 Y2.250 F9999.999\nM30\n"),
              HasSubstr("p.nc:44:1: error: F is larger than the control takes, 9999.999"));
  EXPECT_THAT(first_error_of("fanuc_30i", "G90\nG0 X0. Y0. Z50.\nG93 G1 Z20. F10000.\nM30\n"),
              HasSubstr("error: F is larger than the control takes, 9999.999"));
}

// So they do in cycles, arcs, dwells, planes and shifts, and F where the control file says so. What counts
// things is whole.
TEST(Reader, RefusesNumbersWithoutPointInEveryKindOfBlock) {
  const auto all_of = [](const std::string& name, const std::string& line) {
    return first_error_of(name, "G90\nG0 X0. Y0. Z50.\nG1 Z20. F400.\n" + line + "\nM30\n");
  };
  for (const auto& [line, what] : {std::pair{"G99 G83 X0. Y0. Z-2. R13 Q5. F100.", "{clear}"},
                                   {"G99 G83 X0. Y0. Z-2 R13. Q5. F100.", "{bottom}"},
                                   {"G99 G83 X0. Y0. Z-2. R13. Q5 F100.", "{step}"},
                                   {"G99 G81 X5 Y0. Z-2. R13. F100.", "{x}"},
                                   {"S500\nM29 S500\nG99 G84 X0. Y0. Z-2. R13 F500.", "{clear}"},
                                   {"G2 X10 Y0. I5. J0.", "{x}"},
                                   {"G2 X10. Y0. I5 J0.", "{i}"},
                                   {"G4 X2", "{seconds}"},
                                   {"G68.2 X0. Y0. Z0. I90 J30. K0.\nG53.1", "{a}"},
                                   {"G68.2 X5 Y0. Z0. I90. J30. K0.\nG53.1", "{x}"},
                                   {"G52 X5 Y0. Z0.", "{x}"}}) {
    EXPECT_THAT(all_of("fanuc_30i", line), HasSubstr(std::string(what) + " has no decimal point")) << line;
  }
  // The turn of a whole minute, or of a thousandth of it: bit 0 of parameter 3401.
  EXPECT_THAT(all_of("fanuc_30i", "G93 X10. F75"), HasSubstr("F has no decimal point"));
  EXPECT_THAT(all_of("fanuc_30i", "G93 X10. F75.\nX11. F75"),
              HasSubstr("p.nc:5:1: error: F has no decimal point"));
  for (const char* line : {"G1 X10. F100", "X10. F100", "G99 G81 X0. Y0. Z-2. R13. F100"})
    EXPECT_THAT(all_of("haas_ngc", line), HasSubstr("F has no decimal point")) << line;
  const auto reads = [](const std::string& name, const std::string& line) {
    EXPECT_NO_THROW(
        test::nc_blocks(test::shipped_controller(name),
                        "G90\nT4 M6\nS500 M3\nG0 X0. Y0. Z50.\nG1 Z20. F400.\n" + line + "\nM30\n"))
        << name << " " << line;
  };
  for (const char* line : {"G99 G82 X0 Y0. Z-2. R13. P500 F100", "M29 S500\nG99 G84 X0. Y0. Z-2. R13. F500",
                           "G68.2 X0 Y0 Z0 I90. J30. K0\nG53.1\nG69", "G54.1 P2", "G4 X0.5", "X10. F100"})
    reads("fanuc_30i", line);
  // There it is milliseconds.
  EXPECT_EQ(read("haas_ngc", "G4 P2.\nM30"), read("haas_ngc", "G4 P2000\nM30"));
  for (const char* line : {"G2 X10 Y0 I5 J0", "G4 P2", "G99 G83 X0 Y0 Z-2 R13 Q5 F100"})
    reads("linuxcnc", line);
}

TEST(Reader, RefusesTwoToolsOrSpeedsInOneBlock) {
  for (const std::string name : {"fanuc_30i", "haas_ngc", "linuxcnc", "siemens_840d_sl", "iso"}) {
    for (const char* line : {"S8000 M3 S100", "S100 S8000 M3", "S8000 S100"})
      EXPECT_THAT(first_error_of(name, std::string(line) + "\nM30\n"), HasSubstr("two S words in one block"))
          << name << " " << line;
    for (const char* line : {"T4 T5", "T5 T4\nM6"})
      EXPECT_THAT(first_error_of(name, std::string(line) + "\nM30\n"), HasSubstr("two T words in one block"))
          << name << " " << line;
  }
  EXPECT_THAT(first_error_of("fanuc_30i", "T4 M6 T5\nM30\n"), HasSubstr("p.nc:1:7: error: two T words"));
}

// Fanuc runs the last one, LinuxCNC and Siemens stop: a reader that takes either is wrong somewhere.
TEST(Reader, RefusesTwoWordsOfAGroupInOneBlock) {
  struct Pair {
    const char *control, *one, *other;
  };
  for (const Pair& pair : {Pair{"fanuc_30i", "G54", "G55"},
                           {"fanuc_30i", "G54", "G54.1 P2"},
                           {"fanuc_30i", "G98", "G99"},
                           {"fanuc_30i", "G40", "G41 D1"},
                           {"fanuc_30i", "G43 H1", "G49"},
                           {"fanuc_30i", "G43.4 H1", "G49"},
                           {"fanuc_30i", "G43 H1", "G43.4 H1"},
                           {"fanuc_30i", "G80", "G81 X0. Y0. Z1. R9. F100."},
                           {"fanuc_30i", "G2 X1. Y0. I5. J0. F90.", "G3"},
                           {"haas_ngc", "G49", "G234 H1"},
                           {"linuxcnc", "G61", "G64"},
                           {"linuxcnc", "M8", "M9"},
                           {"linuxcnc", "M428", "M429"},
                           {"siemens_840d_sl", "D1", "D0"},
                           {"siemens_840d_sl", "TRAORI", "TRAFOOF"},
                           {"siemens_840d_sl", "S100 M3", "M5"},
                           {"heidenhain_tnc640", "M128", "M129"},
                           {"heidenhain_tnc640", "M8", "M9"},
                           {"iso", "G0", "G1"},
                           {"siemens_840d_sl", "G0", "G1"},
                           {"haas_ngc", "G93", "G94"}}) {
    for (const std::string& line :
         {std::string(pair.one) + " " + pair.other, std::string(pair.other) + " " + pair.one})
      EXPECT_NE(first_error_of(pair.control, line + "\nM30\n"), "") << pair.control << " " << line;
  }
  EXPECT_THAT(
      first_error_of("siemens_840d_sl", "G54 G55\nM30\n"),
      HasSubstr(
          "p.nc:1:5: error: '[work_offset] words' and another word of the same modal group in one block"));
  EXPECT_THAT(first_error_of("siemens_840d_sl", "G1 X5 F90 G0\nM30\n"),
              HasSubstr("p.nc:1:11: error: 'G0' and another word of the same modal group in one block"));
  // Each holds.
  EXPECT_NO_THROW(read("linuxcnc", "G17 G21 G40 G49 G54 G61 G80 G90 G94\nS100 M3 M7 M8\nG1 G93 X1 F9\nM2"));
}

// A rapid that cuts an arc.
TEST(Reader, RefusesARapidWordBesideAnArc) {
  EXPECT_THAT(first_error_of("heidenhain_tnc640", "L X+0 Y+0 F90\nCC X+5 Y+0\nC X+10 Y+0 DR+ FMAX\nM30\n"),
              HasSubstr("p.nc:3:1: error: 'FMAX' in a block that cuts"));
}

// Its cycle took the first, and the second went to the motions behind it.
TEST(Reader, RefusesASecondFeedBesideThatOfACycle) {
  for (const char* control : {"fanuc_30i", "haas_ngc", "linuxcnc"})
    EXPECT_THAT(first_error_of(control, "G99 G81 X0. Y0. Z-2. R13. F100. F9000.\nM30\n"),
                HasSubstr("p.nc:1:33: error: two F words in one block"))
        << control;
}

// A Fanuc runs the last one alone, unless a parameter says otherwise: no spindle.
TEST(Reader, TakesAsManyMWordsInABlockAsTheControl) {
  for (const char* control : {"fanuc_30i", "haas_ngc", "iso", "hnc_8"}) {
    EXPECT_THAT(first_error_of(control, "S100 M3 M8\nM30\n"),
                HasSubstr("p.nc:1:9: error: 'M8': the control takes 1 M word in a block"))
        << control;
  }
  for (const char* control : {"linuxcnc", "siemens_840d_sl"})
    EXPECT_NO_THROW(read(control, "S100 M3 M8\nM30")) << control;
}

// Haas does what M words say when the block is done.
TEST(Reader, RefusesASpindleThatStartsInTheBlockOfACut) {
  const std::string to = "G94 G0 X0. Y0. Z10.\n";
  for (const char* control : {"haas_ngc", "fanuc_30i"}) {
    EXPECT_THAT(first_error_of(control, to + "S100 G1 Z5. F100. M3\nM30\n"),
                HasSubstr("the spindle is started in the block of a cut"))
        << control;
    EXPECT_THAT(first_error_of(control, to + "S100 G17 G3 X10. Y10. I0. J10. F100. M3\nM30\n"),
                HasSubstr("the spindle is started in the block of a cut"))
        << control;
    EXPECT_NO_THROW(read(control, to + "S100 M3\nG1 Z5. F100. M3\nM30\n")) << control;  // it turns already
    EXPECT_NO_THROW(read(control, to + "S100 G0 Z5. M3\nM30\n")) << control;
    EXPECT_THAT(first_error_of(control, to + "S100 M3\nG1 Z5. F100. M4\nM30\n"),
                HasSubstr("the spindle is started in the block of a cut"))
        << control;
  }
  EXPECT_NO_THROW(read("linuxcnc", to + "S100 G1 Z5. F100. M3\nM30\n"));  // before the motion
}

// Where the control wants tool-centre-point control to be off.
TEST(Reader, RefusesARetractUnderToolCentrePointControl) {
  EXPECT_THAT(
      first_error_of("fanuc_30i", "G0 A0. C0.\nG43.4 H1 X0. Y0. Z600.\nG53 G0 Z700.\nM30\n"),
      HasSubstr("p.nc:3:8: error: a retract under tool-centre-point control: end that first ('G49')"));
  EXPECT_THAT(first_error_of("fanuc_30i", "G0 A0. C0.\nG43.4 H1 X0. Y0. Z600.\nT2 M6\nM30\n"),
              HasSubstr("a tool change under tool-centre-point control"));
  EXPECT_THAT(first_error_of("linuxcnc", "M428\nG53 G0 Z700\nM2\n"),
              HasSubstr("a retract under tool-centre-point control: end that first ('M429')"));
  nc::Controller c = test::shipped_controller("fanuc_30i");
  c.tcp.off_for_tool_change = false;
  EXPECT_NO_THROW(test::nc_blocks(c, "G0 A0. C0.\nG43.4 H1 X0. Y0. Z600.\nG53 G0 Z700.\nM30\n"));
}

TEST(Reader, WantsAMotionWordInEveryBlockWhereTheControlDoes) {
  EXPECT_THAT(
      first_error_of("heidenhain_tnc640", "0 BEGIN PGM A MM\n1 L X+1 FMAX\n2 X+2\n3 M30\n4 END PGM A MM"),
      HasSubstr("p.nc:3:3: error: axis words without 'L'"));
}

// A retract says to which machine position.
TEST(Reader, ReadsWhereARetractGoes) {
  for (const auto& [name, line, quanta] : {std::tuple{"linuxcnc", "G53 G0 Z610", 6100000L},
                                           {"fanuc_30i", "G0 G53 Z-12.5", -12500L},
                                           {"siemens_840d_sl", "SUPA G0 Z610.25 D0", 6102500L},
                                           {"hnc_8", "N5 G53 G0 Z0.", 0L}}) {
    const auto blocks = test::nc_blocks(test::shipped_controller(name), std::string(line) + "\nM30\n");
    nc::Retract wanted;
    wanted.to.set(nc::AxisLetter::Z, quanta);
    ASSERT_EQ(blocks.size(), 3U) << name;
    EXPECT_EQ(nc::to_text(blocks[1]), nc::to_text(nc::Block{wanted})) << name;
  }
  // 610 increments are 0.61 mm.
  EXPECT_THAT(first_error_of("fanuc_30i", "G53 G0 Z610\nM30\n"),
              HasSubstr("the position of Z has no decimal point"));
}

// A control that can switch its kinematics starts in those that it was left in.
TEST(Reader, WantsTheKinematicsToBeSaid) {
  nc::Controller c = test::shipped_controller("linuxcnc");
  c.tcp.unknown_at_start = true;
  for (const std::string motion : {"G0 A10", "G53 G0 Z610", "G0 X1 Y2 Z3 A4 C5"}) {
    Diagnostics diagnostics;
    EXPECT_FALSE(nc::read_program(c, motion + "\nM2\n", "p.nc", diagnostics));
    EXPECT_THAT(diagnostics.findings().front().text(),
                HasSubstr("error: the program has not said which kinematics are active: 'M429' or 'M428'"));
    EXPECT_NO_THROW(test::nc_blocks(c, "M429\n" + motion + "\nM2\n"));
  }
}

TEST(Reader, GivesUpOnTheWrongLanguage) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "L X+1 Y+2 FMAX\n";
  const auto errors = errors_of("linuxcnc", text);
  EXPECT_EQ(errors.size(), 21U);
  EXPECT_THAT(errors.back(), HasSubstr("too many errors: is it a program for LinuxCNC?"));
}

// Whatever bytes come: an error or blocks, never a crash.
TEST(Reader, SurvivesAnyBytes) {
  std::mt19937_64 random(17);
  const std::string alphabet = "GMXYZABCFSTHNLDQ0123456789.-+ ()\n;%/=\"\t\rFMAXCYCLDEFTOOLCALL\xff\x80";
  for (const auto& name : test::shipped_controllers()) {
    const auto controller = test::shipped_controller(name);
    for (int i = 0; i < 300; ++i) {
      std::string text;
      for (std::size_t n = random() % 400; n > 0; --n) text += alphabet[random() % alphabet.size()];
      Diagnostics diagnostics;
      static_cast<void>(nc::read_program(controller, text, "p.nc", diagnostics));
    }
  }
}

}  // namespace
}  // namespace trunnion
