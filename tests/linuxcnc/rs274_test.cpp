// LinuxCNC's own interpreter reads what we write, and what we read.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <optional>
#include <sstream>
#include <sys/wait.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"

#include "linuxcnc/interpreter.hpp"
#include "nc/random_program.hpp"
#include "support/controllers.hpp"

namespace trunnion {
namespace {

namespace fs = std::filesystem;
using test::has_interpreter;
using test::interpret;
using test::Interpreted;

// Our number, by integers only: this must not go through the code under test.
std::string four_decimals(std::int64_t quanta) {
  std::string digits = std::to_string(std::abs(quanta));
  if (digits.size() < 5) digits.insert(0, 5 - digits.size(), '0');
  digits.insert(digits.size() - 4, ".");
  return (quanta < 0 ? "-" : "") + digits;
}

// Nothing stands for a retract: the interpreter shows it in coordinates of its own offsets.
// Terms of run-time values are left out: the interpreter alone knows no machine, reads zero from it, and they
// are zero.
std::vector<std::optional<nc::Motion>> motions_of(const std::vector<nc::Block>& blocks) {
  std::vector<std::optional<nc::Motion>> out;
  for (const auto& block : blocks) {
    if (const auto* motion = std::get_if<nc::Motion>(&block)) out.emplace_back(*motion);
    if (const auto* motion = std::get_if<nc::VariableMotion>(&block)) out.emplace_back(motion->motion);
    if (std::holds_alternative<nc::Retract>(block)) out.emplace_back();
  }
  return out;
}

// The interpreter starts at zero and knows all axes; we know those that were said.
void expect_same_coordinates(const std::vector<std::optional<nc::Motion>>& ours, const Interpreted& theirs,
                             const std::string& text) {
  ASSERT_EQ(theirs.exit_code, 0) << theirs.messages << text.substr(0, 2000);
  ASSERT_EQ(ours.size(), theirs.motions.size()) << text.substr(0, 2000);
  for (std::size_t i = 0; i < ours.size(); ++i) {
    if (!ours[i]) continue;
    ASSERT_EQ(ours[i]->kind == nc::MotionKind::feed, theirs.motions[i].feed) << "motion " << i;
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const auto letter = static_cast<nc::AxisLetter>(axis);
      if (ours[i]->words.has(letter)) {
        ASSERT_EQ(four_decimals(ours[i]->words[letter]), theirs.motions[i].xyzabc[axis]) << "motion " << i;
      }
    }
  }
}

// Blocks that move no axis or none that stands for the interpreter's own frame changes.
std::vector<nc::Block> five_axis_program(std::uint64_t seed, int points) {
  std::mt19937_64 random(seed);
  std::uniform_int_distribution<std::int64_t> step(-20000, 20000);
  std::uniform_int_distribution<std::int64_t> feed(1, 60000000);
  std::vector<nc::Block> blocks = {
      nc::ProgramStart{}, nc::Comment{"seed " + std::to_string(seed)},    nc::WorkOffset{1},
      nc::ToolCall{4, 4}, nc::Spindle{nc::SpindleTurn::clockwise, 12000}, nc::LengthCompensation{4}};
  nc::Motion motion;
  for (const auto letter :
       {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z, nc::AxisLetter::A, nc::AxisLetter::C}) {
    motion.words.set(letter, 0);
  }
  for (int i = 0; i < points; ++i) {
    for (const auto letter :
         {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z, nc::AxisLetter::A, nc::AxisLetter::C}) {
      if (random() % 3 != 0) motion.words.set(letter, motion.words[letter] + step(random));
    }
    const auto choice = random() % 8;
    motion.kind = i == 0 || choice == 0 ? nc::MotionKind::rapid : nc::MotionKind::feed;
    motion.feed_mode = choice < 5 ? nc::FeedMode::inverse_time : nc::FeedMode::per_minute;
    motion.feed = motion.kind == nc::MotionKind::feed ? feed(random) : 0;
    blocks.push_back(motion);
  }
  blocks.push_back(nc::Coolant{nc::CoolantKind::off});
  blocks.push_back(nc::Spindle{});
  blocks.push_back(nc::ProgramEnd{});
  return blocks;
}

TEST(Rs274, ReadsOurProgramsAndFindsOurCoordinates) {
  if (!has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  const auto controller = test::shipped_controller("linuxcnc");
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto text = test::nc_text(controller, five_axis_program(seed, 3000));
    expect_same_coordinates(motions_of(test::nc_blocks(controller, text)), interpret(text), text);
  }
}

// Every word that the controller file has: dwell, coolant, offsets, path modes, ... in random order.
TEST(Rs274, TakesEveryWordOfTheControllerFile) {
  if (!has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  const auto controller = test::shipped_controller("linuxcnc");
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    auto blocks = test::RandomProgram(controller, seed).make(80);
    // Retract goes to machine coordinates, which the interpreter shows as program coordinates of its own
    // offsets; the words for tool-centre-point control are user codes of some configurations.
    std::erase_if(blocks, [](const nc::Block& b) {
      // Arcs and holes: rs274_shapes_test.cpp.
      return std::holds_alternative<nc::Retract>(b) || std::holds_alternative<nc::TcpControl>(b) ||
             std::holds_alternative<nc::Arc>(b) || std::holds_alternative<nc::Hole>(b);
    });
    const auto text = test::nc_text(controller, blocks);
    const auto theirs = interpret(text);
    ASSERT_EQ(theirs.exit_code, 0) << theirs.messages << text;
    expect_same_coordinates(motions_of(test::nc_blocks(controller, text)), theirs, text);
  }
}

// F under G93 is the reciprocal of the duration: the interpreter multiplies it with the length of the move (X
// Y Z if one of them moves, else degrees).
TEST(Rs274, FindsTheDurationThatInverseTimeFeedMeans) {
  if (!has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  const auto controller = test::shipped_controller("linuxcnc");
  std::mt19937_64 random(11);
  std::uniform_int_distribution<std::int64_t> position(-1000000, 1000000);
  std::vector<nc::Block> blocks = {nc::ProgramStart{}};
  std::vector<double> rates;
  std::array<std::int64_t, 5> last{};
  nc::Motion motion;
  for (int i = 0; i < 500; ++i) {
    std::array<std::int64_t, 5> now{};
    const bool rotary_only = i % 4 == 3;
    for (std::size_t k = 0; k < 5; ++k) now[k] = rotary_only && k < 3 ? last[k] : position(random);
    const std::array letters = {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z, nc::AxisLetter::A,
                                nc::AxisLetter::C};
    double linear = 0.0;
    double rotary = 0.0;
    for (std::size_t k = 0; k < 5; ++k) {
      motion.words.set(letters[k], now[k]);
      const double way = static_cast<double>(now[k] - last[k]) / 1e4;
      (k < 3 ? linear : rotary) += way * way;
    }
    last = now;
    motion.kind = nc::MotionKind::feed;
    motion.feed_mode = nc::FeedMode::inverse_time;
    motion.feed = 10000 + 37 * i;
    blocks.push_back(motion);
    rates.push_back(static_cast<double>(motion.feed) / 1e4 * std::sqrt(rotary_only ? rotary : linear));
  }
  blocks.push_back(nc::ProgramEnd{});
  const auto theirs = interpret(test::nc_text(controller, blocks));
  ASSERT_EQ(theirs.exit_code, 0) << theirs.messages;
  ASSERT_EQ(theirs.motions.size(), rates.size());
  for (std::size_t i = 0; i < rates.size(); ++i)
    EXPECT_NEAR(theirs.motions[i].feed_rate, rates[i], 1e-4) << "motion " << i;
}

// G10 L2 and G52: the interpreter keeps the program's coordinates and moves where they are.
TEST(Rs274, AddsTheShiftsOfTheWorkOffset) {
  if (!has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  const auto controller = test::shipped_controller("linuxcnc");
  std::mt19937_64 random(5);
  std::uniform_int_distribution<std::int64_t> position(-1000000, 1000000);
  std::uniform_int_distribution<std::int64_t> drift(-2000, 2000);
  std::vector<nc::Block> blocks = {nc::ProgramStart{}, nc::WorkOffset{1}};
  std::vector<std::array<double, 3>> expected;
  std::array<std::int64_t, 3> set{};
  std::array<std::int64_t, 3> added{};
  for (int i = 0; i < 300; ++i) {
    if (i % 10 == 3 || i % 10 == 7) {
      nc::OffsetShift shift;
      shift.kind = i % 10 == 3 ? nc::OffsetShift::Kind::set : nc::OffsetShift::Kind::add;
      shift.index = i % 10 == 3 ? 1 : 0;
      for (auto& v : shift.offset) v = drift(random);
      (i % 10 == 3 ? set : added) = shift.offset;
      blocks.push_back(shift);
    }
    nc::Motion motion;
    for (const auto letter :
         {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z, nc::AxisLetter::A, nc::AxisLetter::C})
      motion.words.set(letter, position(random));
    motion.kind = i % 10 == 3 || i == 0 ? nc::MotionKind::rapid : nc::MotionKind::feed;
    motion.feed = motion.kind == nc::MotionKind::feed ? 500000 : 0;
    blocks.push_back(motion);
    std::array<double, 3> at{};
    for (std::size_t k = 0; k < 3; ++k)
      at[k] = static_cast<double>(motion.words.quanta[k] + set[k] + added[k]) / 1e4;
    expected.push_back(at);
  }
  blocks.push_back(nc::ProgramEnd{});
  const auto text = test::nc_text(controller, blocks);
  const auto theirs = interpret(text);
  expect_same_coordinates(motions_of(test::nc_blocks(controller, text)), theirs, text);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_NEAR(theirs.motions[i].machine_xyz[k], expected[i][k], 1e-9) << "motion " << i;
  }
}

// Terms of run-time values: what the interpreter makes of expression and latch is what the words say.
TEST(Rs274, EvaluatesTermsAndLatchesOfRunTimeValues) {
  if (!has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  const auto controller = test::shipped_controller("linuxcnc");
  std::mt19937_64 random(6);
  std::uniform_int_distribution<std::int64_t> position(-1000000, 1000000);
  std::uniform_int_distribution<std::int64_t> factor(-10000, 10000);
  std::vector<nc::Block> blocks = {nc::ProgramStart{}};
  // 30 um is clamped to 20 um, then followed by 5 um a latch; -1 um and 0.4 um stand.
  std::vector<std::array<double, 3>> expected;
  std::array<double, 3> latched{};
  for (int i = 0; i < 40; ++i) {
    if (i % 5 == 0) {
      blocks.push_back(nc::LatchValues{i == 0, 200, 50, 5});
      latched[0] = std::min(0.020, latched[0] + 0.005);
      latched[1] = -0.001;
      latched[2] = 0.0;
    }
    nc::VariableMotion m;
    for (const auto letter :
         {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z, nc::AxisLetter::A, nc::AxisLetter::C})
      m.motion.words.set(letter, position(random));
    m.motion.kind = i == 0 ? nc::MotionKind::rapid : nc::MotionKind::feed;
    m.motion.feed = i == 0 ? 0 : 500000;
    std::array<double, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) {
      at[k] = static_cast<double>(m.motion.words.quanta[k]) / 1e4;
      for (std::size_t v = 0; v < 3; ++v) {
        m.coefficient[k][v] = (i + static_cast<int>(k + v)) % 4 == 0 ? 10000 : factor(random);
        at[k] += static_cast<double>(m.coefficient[k][v]) / 1e4 * latched[v];
      }
    }
    expected.push_back(at);
    blocks.push_back(m);
  }
  blocks.push_back(nc::ProgramEnd{});
  const auto text = test::nc_text(controller, blocks);
  const auto again = test::nc_blocks(controller, text);
  EXPECT_EQ(test::nc_text(controller, again), text);
  const auto theirs = interpret("#501=0.030\n#502=-0.001\n#503=0.0004\n" + text);
  ASSERT_EQ(theirs.exit_code, 0) << theirs.messages;
  ASSERT_EQ(theirs.motions.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_NEAR(theirs.motions[i].machine_xyz[k], expected[i][k], 0.6e-4) << "motion " << i;
  }
}

// A program that calculates its offsets from temperatures: the sums that the interpreter makes of the lines
// are those of the words, and our reader reads the same lines as the same words.
TEST(Rs274, CalculatesOffsetsFromTemperatures) {
  if (!has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  auto controller = test::shipped_controller("linuxcnc");
  controller.run_time_temperatures.read.clear();  // here the temperatures are written below
  using Kind = nc::RunTimeStep::Kind;
  std::mt19937_64 random(7);
  std::uniform_int_distribution<std::int64_t> factor(
      -6000000, 6000000);  // up to 0.6 mm/K: large beside the digits that are printed
  std::uniform_real_distribution<double> kelvin(-4.0, 6.0);
  constexpr std::size_t kSensors = 3;
  std::vector<nc::Block> blocks = {nc::ProgramStart{}};
  std::string given;  // before the program: the cold machine
  std::array<double, kSensors> cold{};
  for (std::size_t s = 0; s < kSensors; ++s) {
    cold[s] = 20.0 + std::round(kelvin(random) * 10.0) / 10.0;
    given += "#" + std::to_string(531 + s) + "=" + fixed_text(cold[s], 1) + "\n";
  }
  blocks.push_back(nc::RunTimeStep{Kind::reset, 0, 0, 0});
  for (std::size_t s = 0; s < kSensors; ++s) blocks.push_back(nc::RunTimeStep{Kind::reference, 0, s, 0});
  std::vector<std::array<double, 3>> expected;
  std::array<double, 3> latched{};
  constexpr double kClamp_mm = 1.2;
  for (int operation = 0; operation < 12; ++operation) {
    std::array<double, kSensors> now{};
    for (std::size_t s = 0; s < kSensors; ++s) {
      now[s] = cold[s] + std::round(kelvin(random) * 10.0) / 10.0;
      blocks.push_back(nc::Raw{"#" + std::to_string(531 + s) + "=" + fixed_text(now[s], 1)});
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double sum_mm = 0.0;
      blocks.push_back(nc::RunTimeStep{Kind::start, axis, 0, 0});
      for (std::size_t s = 0; s < kSensors; ++s) {
        const std::int64_t f = factor(random);
        blocks.push_back(nc::RunTimeStep{Kind::add, axis, s, f});
        sum_mm += static_cast<double>(f) * 1e-7 * (now[s] - cold[s]);
      }
      latched[axis] = std::clamp(sum_mm, -kClamp_mm, kClamp_mm);
    }
    blocks.push_back(nc::LatchValues{operation == 0, 12000, 1000000, 0});
    nc::VariableMotion m;
    for (const auto letter : {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z})
      m.motion.words.set(letter, operation * 10000);
    m.motion.kind = nc::MotionKind::rapid;
    std::array<double, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) {
      m.coefficient[k][k] = -10000;
      at[k] = operation - latched[k];
    }
    expected.push_back(at);
    blocks.push_back(m);
  }
  blocks.push_back(nc::ProgramEnd{});
  const auto text = test::nc_text(controller, blocks);
  const auto theirs = interpret(given + text);
  ASSERT_EQ(theirs.exit_code, 0) << theirs.messages;
  ASSERT_EQ(theirs.motions.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      ASSERT_NEAR(theirs.motions[i].machine_xyz[k], expected[i][k], 0.6e-4) << "motion " << i;
  }
  std::erase_if(blocks, [](const nc::Block& b) { return std::holds_alternative<nc::Raw>(b); });
  const auto plain = test::nc_text(controller, blocks);
  EXPECT_EQ(test::nc_text(controller, test::nc_blocks(controller, plain)), plain);
  // The shipped file reads analog inputs; the interpreter alone, without a machine, takes the words.
  const auto shipped = test::shipped_controller("linuxcnc");
  const auto reading =
      test::nc_text(shipped, {nc::ProgramStart{}, nc::RunTimeStep{Kind::read, 0, 2, 0}, nc::ProgramEnd{}});
  EXPECT_NE(reading.find("M66 E2 L0"), std::string::npos) << reading;
  EXPECT_EQ(interpret(reading).exit_code, 0) << interpret(reading).messages;
}

// Issue 2410: below 0.1 a minute, G93 runs at 0.1, in millimetres or degrees. The controller file says so,
// and the verification counts with it.
TEST(Rs274, KeepsTheLowestRateThatTheControllerFileStates) {
  if (!has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  const auto controller = test::shipped_controller("linuxcnc");
  ASSERT_TRUE(controller.feed.min_linear_rate_mm_s);
  const auto theirs = interpret(
      "G90 G94\nG0 X0 Y0 Z0 A0 C0\nG93\nG1 A178.6 F5\nG1 A0 Z-0.0002 F5\nG1 A0.5 F0.01\nG1 Z1 F0.2\nM2\n");
  ASSERT_EQ(theirs.exit_code, 0) << theirs.messages;
  ASSERT_EQ(theirs.motions.size(), 5U);
  const double lowest = 60.0 * *controller.feed.min_linear_rate_mm_s;
  EXPECT_NEAR(theirs.motions[1].feed_rate, 893.0, 1e-4);
  EXPECT_NEAR(theirs.motions[2].feed_rate, lowest, 1e-9);
  EXPECT_NEAR(theirs.motions[3].feed_rate, lowest, 1e-9);
  EXPECT_NEAR(theirs.motions[4].feed_rate, 0.2 * 1.0002, 1e-4);
}

// The programs that the samples wrote; ctest runs this after them.
TEST(Rs274, ReadsEveryProgramOfTheSamples) {
  if (!has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  const char* const folder = std::getenv("TRUNNION_SAMPLE_PROGRAMS");
  if (folder == nullptr || !fs::is_directory(folder))
    GTEST_SKIP() << "TRUNNION_SAMPLE_PROGRAMS names no folder of programs";
  const auto controller = test::shipped_controller("linuxcnc");
  std::size_t programs = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".nc") continue;
    SCOPED_TRACE(entry.path().string());
    const auto text = read_file(entry.path().string());
    ASSERT_TRUE(text);
    if (text->find("controller LinuxCNC)") == std::string::npos) continue;
    expect_same_coordinates(motions_of(test::nc_blocks(controller, *text)), interpret(*text), *text);
    ++programs;
  }
  EXPECT_GT(programs, 0U);
}

// A program that LinuxCNC brings along, read by both: our reader must understand what others wrote.
TEST(Rs274, AgreesOnTheImpellerThatLinuxCncShips) {
  if (!has_interpreter()) GTEST_SKIP() << "rs274 (linuxcnc-uspace) is not installed";
  const fs::path folder =
      "/usr/share/doc/linuxcnc/examples/sample-configs/sim/axis/vismach/5axis/table-rotary-tilting/demos";
  std::string text = read_file((folder / "impeller-7bl-xyzac.ngc").string()).value_or("");
  if (text.empty()) GTEST_SKIP() << "no impeller-7bl-xyzac.ngc in " << folder;
  // Words of that configuration alone, which neither its interpreter without the configuration nor we know.
  std::istringstream lines(text);
  std::string plain;
  for (std::string line; std::getline(lines, line);) {
    for (const char* word : {"M428", "M429", "M430", "m428", "m429", "m430"}) {
      if (const auto at = line.find(word); at != std::string::npos) line.erase(at, 4);
    }
    plain += line + "\n";
  }
  auto controller = test::shipped_controller("linuxcnc");
  controller.numbers.axes = nc::AxisFormat(8, 8);
  auto ours = motions_of(test::nc_blocks(controller, plain));
  const auto theirs = interpret(plain);
  ASSERT_EQ(theirs.exit_code, 0) << theirs.messages;
  ASSERT_EQ(ours.size(), theirs.motions.size());
  EXPECT_GT(ours.size(), 4000U);
  for (std::size_t i = 0; i < ours.size(); ++i) {
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const auto letter = static_cast<nc::AxisLetter>(axis);
      if (!ours[i] || !ours[i]->words.has(letter)) continue;
      ASSERT_NEAR(static_cast<double>(ours[i]->words[letter]) / 1e8,
                  std::stod(theirs.motions[i].xyzabc[axis]), 0.5001e-4)
          << "motion " << i;
    }
  }
}

}  // namespace
}  // namespace trunnion
