// Runs of motions that are written together: the text of one motion after the other.
#include <gtest/gtest.h>
#include <random>

#include "support/controllers.hpp"

namespace trunnion {
namespace {

constexpr std::array<nc::AxisLetter, nc::RunBlock::kAxes> kLetters = {
    nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z, nc::AxisLetter::A, nc::AxisLetter::C};

nc::Motion motion_of(const nc::RunBlock& block, nc::FeedMode mode) {
  nc::Motion m;
  m.kind = nc::MotionKind::feed;
  m.feed_mode = mode;
  m.feed = block.feed;
  for (std::size_t k = 0; k < kLetters.size(); ++k) m.words.set(kLetters[k], block.words[k]);
  return m;
}

// Walks whose words have one to eleven digits, some of which stay, and feeds of which some cannot be.
std::vector<nc::RunBlock> random_blocks(std::mt19937_64& random, std::size_t count) {
  const auto number = [&](int low, int high) {
    return std::uniform_int_distribution<std::int32_t>(low, high)(random);
  };
  std::vector<nc::RunBlock> out;
  out.reserve(count);
  nc::RunBlock at{};
  at.feed = 1500000;
  const int largest = number(0, 20) == 0 ? 2'000'000'000 : 99'999'999;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::int32_t& word : at.words) {
      if (number(0, 4) == 0) continue;
      const int size = std::array{9, 9999, 10000, 1'000'000, largest}[static_cast<std::size_t>(number(0, 4))];
      word = number(-size, size);
    }
    if (number(0, 2) == 0) at.feed = number(1, number(0, 3) == 0 ? 2'000'000'000 : 9'999'999);
    if (number(0, 99) == 0) at.feed = 0;
    out.push_back(at);
  }
  return out;
}

TEST(LongWriterRuns, AreTheTextOfOneMotionAfterTheOther) {
  std::mt19937_64 random(91);
  std::size_t together = 0;
  std::size_t alone = 0;
  for (const std::string name : {"linuxcnc", "fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640"}) {
    for (int program = 0; program < 200; ++program) {
      nc::Controller controller = test::shipped_controller(name);
      controller.block_numbers.enabled = program % 2 == 0;
      controller.block_numbers.max = program % 4 == 0 ? 1990 : controller.block_numbers.max;
      if (program % 3 == 0) controller.line.end = "\r\n";
      if (program % 5 == 0) controller.numbers.feed.per_minute_decimals = program % 10;
      if (program % 7 == 0) controller.line.max_length = 60;
      const bool inverse = program % 8 > 4 && controller.has_inverse_time();
      const auto mode = inverse ? nc::FeedMode::inverse_time : nc::FeedMode::per_minute;
      std::string expected;
      std::string text;
      nc::Writer one(controller, expected);
      nc::Writer runs(controller, text);
      ASSERT_TRUE(one.write(nc::Block{nc::ProgramStart{}}));
      ASSERT_TRUE(runs.write(nc::Block{nc::ProgramStart{}}));
      const auto blocks = random_blocks(random, 300);
      for (std::size_t i = 0; i < blocks.size();) {
        const std::size_t most = std::min<std::size_t>(blocks.size() - i, random() % 150);
        const std::size_t done = runs.write_run(kLetters, mode, {blocks.data() + i, most});
        ASSERT_LE(done, most);
        EXPECT_TRUE(done == 0 || runs.takes_run(kLetters, mode));
        for (std::size_t k = 0; k < done; ++k)
          ASSERT_TRUE(one.write(motion_of(blocks[i + k], mode))) << name << ' ' << program;
        together += done;
        i += done;
        if (i == blocks.size()) break;
        // The next one, which may be refused: by both.
        const auto a = one.write(motion_of(blocks[i], mode));
        const auto b = runs.write(motion_of(blocks[i], mode));
        ASSERT_EQ(a.has_value(), b.has_value());
        ++i;
        ++alone;
      }
      EXPECT_EQ(text, expected) << name << ' ' << program;
      EXPECT_EQ(runs.lines(), one.lines());
      EXPECT_EQ(runs.motions(), one.motions());
    }
  }
  EXPECT_GT(together, 10000U);
  EXPECT_GT(alone, 10000U);
}

}  // namespace
}  // namespace trunnion
