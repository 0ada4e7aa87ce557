// blocks -> text -> blocks is an identity, for every controller that ships with the project.
#include <fstream>
#include <gtest/gtest.h>
#include <random>

#include "nc/random_program.hpp"
#include "support/controllers.hpp"

namespace trunnion {
namespace {

std::string file_name(const ::testing::TestParamInfo<std::string>& tested) {
  return tested.param;
}

class EveryController : public ::testing::TestWithParam<std::string> {};

void expect_round_trip(const nc::Controller& controller, std::uint64_t seed, int length) {
  const auto blocks = test::RandomProgram(controller, seed).make(length);
  const std::string text = test::nc_text(controller, blocks);
  const auto back = test::nc_blocks(controller, text);
  for (std::size_t i = 0; i < std::min(blocks.size(), back.size()); ++i) {
    ASSERT_EQ(to_text(blocks[i]), to_text(back[i])) << "seed " << seed << ", block " << i << " of\n" << text;
  }
  ASSERT_EQ(blocks.size(), back.size()) << "seed " << seed << "\n" << text;
}

TEST_P(EveryController, GivesBackEveryBlock) {
  const auto controller = test::shipped_controller(GetParam());
  for (std::uint64_t seed = 1; seed <= 200; ++seed) expect_round_trip(controller, seed, 60);
}

TEST_P(EveryController, WritesNoMinusZeroAndNoLineBeyondTheLimit) {
  const auto controller = test::shipped_controller(GetParam());
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const auto text = test::nc_text(controller, test::RandomProgram(controller, seed).make(60));
    std::size_t begin = 0;
    for (std::size_t end = text.find('\n'); end != std::string::npos;
         begin = end + 1, end = text.find('\n', begin)) {
      const auto line = text.substr(begin, end - begin);
      EXPECT_LE(line.size(), controller.line.max_length + 1) << line;
      if (line.find(controller.comments.open) != std::string::npos) continue;  // any text
      for (const char* minus_zero : {"-0 ", "-0.0 ", "-0.00 ", "-0.000 ", "-0.0000 ", "-0. "}) {
        EXPECT_EQ((line + " ").find(minus_zero), std::string::npos) << line;
      }
    }
  }
}

// People edit programs: no block numbers, lower case, more blanks or none, comments and empty lines in
// between.
TEST_P(EveryController, ReadsHandEditedTextTheSame) {
  const auto controller = test::shipped_controller(GetParam());
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const auto blocks = test::RandomProgram(controller, seed).make(40);
    const std::string text = test::nc_text(controller, blocks);
    std::string edited;
    const auto& prefix = controller.block_numbers.prefix;
    std::size_t begin = 0;
    for (std::size_t end = text.find('\n'); end != std::string::npos;
         begin = end + 1, end = text.find('\n', begin)) {
      std::string line = text.substr(begin, end - begin);
      const bool numbered = controller.block_numbers.enabled && line.starts_with(prefix) &&
                            line.size() > prefix.size() &&
                            std::isdigit(static_cast<unsigned char>(line[prefix.size()]));
      if (numbered && seed % 2 == 0) line.erase(0, line.find(' ') + 1);
      const bool has_text = line.find(controller.comments.open) != std::string::npos ||
                            (begin == 0 && !controller.program.begin.empty()) || end + 1 == text.size();
      if (!has_text) {
        for (char& ch : line) ch = static_cast<char>(std::tolower(static_cast<unsigned char>(ch)));
        std::string spaced;
        for (const char ch : line) spaced += ch == ' ' ? "  \t" : std::string(1, ch);
        line = spaced;
      }
      edited += "  " + line + (seed % 3 == 0 ? " \r\n\n" : "\n");
    }
    const auto back = test::nc_blocks(controller, edited);
    ASSERT_EQ(blocks.size(), back.size()) << edited;
    for (std::size_t i = 0; i < blocks.size(); ++i) ASSERT_EQ(to_text(blocks[i]), to_text(back[i])) << edited;
  }
}

TEST_P(EveryController, PiecesOfTextMayEndAnywhere) {
  const auto controller = test::shipped_controller(GetParam());
  const auto blocks = test::RandomProgram(controller, 7).make(80);
  const std::string text = test::nc_text(controller, blocks);
  for (const std::size_t piece : {1U, 3U, 17U, 100U}) {
    Diagnostics diagnostics;
    std::vector<nc::Block> back;
    nc::Reader reader(controller, "test.nc", diagnostics, [&](const nc::Block& b) { back.push_back(b); });
    for (std::size_t i = 0; i < text.size(); i += piece) reader.feed(std::string_view(text).substr(i, piece));
    ASSERT_TRUE(reader.finish());
    ASSERT_EQ(back.size(), blocks.size());
    for (std::size_t i = 0; i < blocks.size(); ++i) ASSERT_TRUE(same(blocks[i], back[i]));
  }
}

// What comes as runs are the blocks that come one by one: random programs, long cuts with and without block
// numbers, fewer digits, blanks and other line ends, in pieces; findings too, where somebody spoilt a line.
class Spoilt {
 public:
  explicit Spoilt(std::uint64_t seed) : random_(seed) {}
  bool once_in(int n) { return std::uniform_int_distribution(1, n)(random_) == 1; }
  std::string text_of(const std::string& text) {
    const bool breaks = once_in(3);
    std::string out;
    for (const char ch : text) {
      if (breaks && once_in(3000)) out += "?X9.#-"[std::uniform_int_distribution(0, 5)(random_)];
      if (ch == '\n' && once_in(60)) out += once_in(2) ? " " : "\r";
      if (ch == '0' && once_in(60)) continue;
      out += ch;
      if (ch == ' ' && once_in(200)) out += ch;
    }
    return out;
  }

 private:
  std::mt19937_64 random_;
};

struct Reading {
  std::vector<std::string> blocks, findings;
  std::size_t in_runs = 0;
};

Reading read_in_pieces(const nc::Controller& controller, const std::string& text, bool runs) {
  Reading out;
  const auto take = [&](const nc::Block& block) {
    const auto* motion = std::get_if<nc::Motion>(&block);
    const SourceRef at = motion != nullptr ? motion->source : SourceRef{};
    out.blocks.push_back(to_text(block) + " @" + std::to_string(at.line) + ":" + std::to_string(at.column));
  };
  Diagnostics diagnostics;
  nc::Reader reader(controller, "test.nc", diagnostics, take);
  if (runs) {
    reader.give_runs_to([&](const nc::MotionRun& run) {
      out.in_runs += run.count;
      for (std::size_t i = 0; i < run.count; ++i) take(run.motion(i));
    });
  }
  constexpr std::size_t kPiece = 3001;
  for (std::size_t i = 0; i < text.size(); i += kPiece) reader.feed(std::string_view(text).substr(i, kPiece));
  if (!reader.finish()) out.blocks.emplace_back("failed");
  for (const auto& finding : diagnostics.findings()) out.findings.push_back(finding.text());
  return out;
}

// Every character of a line that is laid out as those before it, each by every other that may mean something
// there.
TEST(RunsOfALayout, AnotherCharacterReadsAsAlone) {
  const auto controller = test::shipped_controller("linuxcnc");
  const std::string begin = "(test)\nG21 G90\nG0 X1.0000 Y2.0000 Z3.0000 A4.0000 C5.0000\n";
  for (const std::string line :
       {"N123 X-8.3077 Y5.1162 Z115.4285 A76.6562 C-206.0143 F6027.7018\n",
        "X18.9388 Y21.9962 Z-3.6204 A25.3965 C1165.3887 F12345.6789\n", "Y1.9962 X-3.6204 C1165.3887\n"}) {
    const std::string mode = line.find('F') == std::string::npos ? "G94" : "G93";
    std::size_t in_runs = 0;
    for (std::size_t at = 0; at + 1 < line.size(); ++at) {
      for (const char c : std::string("059 -+.,/GNXF\n\x7f")) {
        std::string other = line;
        other[at] = c;
        const std::string text = begin + mode + " G1 X1.0000 F5.0000\n" + line + line + line + other + line +
                                 line + "M5\nM9\n" + std::string(100, ' ') + "\nM2\n";
        const Reading by_one = read_in_pieces(controller, text, false);
        const Reading by_runs = read_in_pieces(controller, text, true);
        ASSERT_EQ(by_one.blocks, by_runs.blocks) << text;
        ASSERT_EQ(by_one.findings, by_runs.findings) << text;
        in_runs += by_runs.in_runs;
      }
    }
    EXPECT_GT(in_runs, 3 * line.size());
  }
}

TEST_P(EveryController, GivesTheSameBlocksInRuns) {
  auto controller = test::shipped_controller(GetParam());
  std::size_t in_runs = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    controller.block_numbers.enabled = seed % 2 == 0;
    auto blocks = test::RandomProgram(controller, seed).make(40);
    // A long cut at the end.
    std::mt19937_64 random(seed);
    const auto within = [&](std::int64_t most) {
      return std::uniform_int_distribution<std::int64_t>(-most, most)(random);
    };
    nc::Motion cut;
    cut.kind = nc::MotionKind::feed;
    cut.feed = 800000;
    blocks.pop_back();
    for (const auto letter : {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z, nc::AxisLetter::C})
      cut.words.set(letter, within(1000000));
    nc::Motion start = cut;
    start.kind = nc::MotionKind::rapid;
    start.feed = 0;
    blocks.emplace_back(start);
    for (int i = 0; i < 700; ++i) {
      const bool all = within(10) > -8;
      for (const auto letter : {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z, nc::AxisLetter::C}) {
        if (all || within(1) == 0) cut.words.set(letter, cut.words[letter] + within(20000));
      }
      // In every block, in some, in none.
      if (seed % 3 == 0 || (seed % 3 == 1 && within(10) == 0)) cut.feed = 800000 + within(700000);
      blocks.emplace_back(cut);
    }
    blocks.emplace_back(nc::ProgramEnd{});
    const std::string text = Spoilt(seed).text_of(test::nc_text(controller, blocks));
    const Reading by_one = read_in_pieces(controller, text, false);
    const Reading by_runs = read_in_pieces(controller, text, true);
    ASSERT_EQ(by_one.blocks, by_runs.blocks) << seed;
    ASSERT_EQ(by_one.findings, by_runs.findings) << seed;
    in_runs += by_runs.in_runs;
  }
  if (controller.motion.modal && controller.rotary.modulo_open.empty()) {
    EXPECT_GT(in_runs, 10000U);
  }
}

INSTANTIATE_TEST_SUITE_P(Shipped, EveryController, ::testing::ValuesIn(test::shipped_controllers()),
                         file_name);

class LongEveryController : public ::testing::TestWithParam<std::string> {};

TEST_P(LongEveryController, GivesBackEveryBlockOfTenThousandPrograms) {
  const auto controller = test::shipped_controller(GetParam());
  for (std::uint64_t seed = 1000; seed < 11000; ++seed) expect_round_trip(controller, seed, 60);
}

INSTANTIATE_TEST_SUITE_P(LongShipped, LongEveryController, ::testing::ValuesIn(test::shipped_controllers()),
                         file_name);

}  // namespace
}  // namespace trunnion
