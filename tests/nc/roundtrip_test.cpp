// blocks -> text -> blocks is an identity, for every controller that ships with the project.
#include <fstream>
#include <gtest/gtest.h>

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
