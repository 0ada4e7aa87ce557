// Touches of a probe as blocks: to text and back, and what is known behind them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/controllers.hpp"

namespace trunnion::nc {
namespace {

using testing::HasSubstr;

AxisWords xyz(std::int64_t x, std::int64_t y, std::int64_t z) {
  AxisWords words;
  words.set(AxisLetter::X, x);
  words.set(AxisLetter::Y, y);
  words.set(AxisLetter::Z, z);
  return words;
}

std::vector<Block> program_of_touches() {
  Motion start;
  start.words = xyz(10000, 20000, 30000);
  start.words.set(AxisLetter::A, 40000);
  Probe probe;
  probe.feed = 60000;
  probe.words = xyz(10000, 20000, 10000);
  Motion back = start;
  back.kind = MotionKind::feed;
  back.feed = 1000000;
  return {ProgramStart{}, ProbeLog{ProbeLog::Kind::open, "touches.txt"}, start,       probe, back, probe,
          back,           ProbeLog{ProbeLog::Kind::close, {}},           ProgramEnd{}};
}

std::string text_of(const Controller& control, const std::vector<Block>& blocks) {
  std::string text;
  Writer writer(control, text);
  for (const Block& block : blocks) {
    const auto written = writer.write(block);
    if (!written) return written.error().text();
  }
  return text;
}

TEST(Probing, TheMotionBehindATouchSaysEverythingAnew) {
  const std::string text = text_of(test::shipped_controller("linuxcnc"), program_of_touches());
  EXPECT_THAT(text, HasSubstr("(PROBEOPEN touches.txt)\n"));
  EXPECT_THAT(text,
              HasSubstr("G38.2 X1.0000 Y2.0000 Z1.0000 F60.000\nG1 X1.0000 Y2.0000 Z3.0000 F1000.000\n"
                        "G38.2 X1.0000 Y2.0000 Z1.0000 F60.000\nG1 X1.0000 Y2.0000 Z3.0000 F1000.000\n"));
  EXPECT_THAT(text, HasSubstr("(PROBECLOSE)\n"));
}

TEST(Probing, ComesBackFromItsText) {
  const Controller control = test::shipped_controller("linuxcnc");
  Diagnostics diagnostics;
  const auto blocks = read_program(control, text_of(control, program_of_touches()), "p.nc", diagnostics);
  ASSERT_TRUE(blocks) << blocks.error().text();
  std::vector<const Probe*> probes;
  std::string names;
  for (const Block& block : *blocks) {
    if (const auto* probe = std::get_if<Probe>(&block)) probes.push_back(probe);
    if (const auto* log = std::get_if<ProbeLog>(&block)) names += log->name + ";";
  }
  ASSERT_EQ(probes.size(), 2U);
  EXPECT_EQ(probes[0]->feed, 60000);
  EXPECT_EQ(probes[0]->words[AxisLetter::Z], 10000);
  EXPECT_EQ(probes[0]->words[AxisLetter::A], 40000);
  EXPECT_EQ(probes[0]->from[AxisLetter::Z], 30000);
  EXPECT_EQ(names, "touches.txt;;");
}

TEST(Probing, RefusesWhatIsNoTouch) {
  const Controller control = test::shipped_controller("linuxcnc");
  const auto fault = [&](const std::string& line) {
    Diagnostics diagnostics;
    const auto blocks = read_program(control, "G17 G21 G40 G49 G80 G90 G94\nG0 X0 Y0 Z0\n" + line + "\nM2\n",
                                     "p.nc", diagnostics);
    return blocks ? std::string() : blocks.error().message;
  };
  EXPECT_EQ(fault("G38.2 X1 Y2 Z3 F60"), "");
  EXPECT_NE(fault("G38.2 X1 Y2 Z3"), "");
  EXPECT_NE(fault("G38.2 X1 Y2 Z3 F0"), "");
  EXPECT_NE(fault("G38.2 X1 Y2 F60"), "");
  EXPECT_NE(fault("G38.3 X1 Y2 Z3 F60"), "");
  EXPECT_NE(fault("G38.2 X1 Y2 Z3 A4 F60"), "");
  EXPECT_NE(fault("G1 G38.2 X1 Y2 Z3 F60"), "");
  EXPECT_NE(fault("G38.2 X1 Y2 Z3 F60\nG38.2 X1 Y2 Z2 F60"), "");  // from an unknown place
}

// A remark that would open a file gets the mark in front; the control's own words are no remark.
TEST(Probing, TextOfOthersOpensNoFile) {
  const Controller control = test::shipped_controller("linuxcnc");
  const std::string text =
      text_of(control, {ProgramStart{}, Comment{"PROBEOPEN x.txt"}, Comment{"PROBECLOSE"}, ProgramEnd{}});
  EXPECT_THAT(text, HasSubstr("(- PROBEOPEN x.txt)"));
  Diagnostics diagnostics;
  const auto blocks = read_program(control, text, "p.nc", diagnostics);
  ASSERT_TRUE(blocks);
  for (const Block& block : *blocks) EXPECT_FALSE(std::holds_alternative<ProbeLog>(block));
  EXPECT_THAT(text_of(control, {ProgramStart{}, ProbeLog{ProbeLog::Kind::open, "a b)"}}),
              HasSubstr("may hold letters"));
  EXPECT_THAT(text_of(test::shipped_controller("iso"), program_of_touches()), HasSubstr("[probing] touch"));
}

}  // namespace
}  // namespace trunnion::nc
