// Text of the CL file must never act on the control: what a comment says changes nothing that a program does.
#include <algorithm>
#include <cctype>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>

#include "nc/hostile_text.hpp"
#include "support/controllers.hpp"

namespace trunnion {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string to_text(const std::vector<nc::Block>& blocks) {
  std::string out;
  for (const auto& block : blocks) {
    if (!std::holds_alternative<nc::Comment>(block)) out += nc::to_text(block) + "\n";
  }
  return out;
}

TEST(Comments, HostileTextDoesNothingOnAnyControl) {
  for (const std::string& name : test::shipped_controllers()) {
    const auto c = test::shipped_controller(name);
    const auto plain = test::nc_blocks(c, test::nc_text(c, test::program_with_comments(c, {})));
    std::mt19937_64 random(7);
    for (int i = 0; i < 300; ++i) {
      const std::vector<std::string> said = test::hostile_texts(random);
      const std::string text = test::nc_text(c, test::program_with_comments(c, said));
      ASSERT_EQ(to_text(test::nc_blocks(c, text)), to_text(plain)) << name << "\n" << text;
    }
  }
}

// By rules of this test alone: the lines of comments in the text, one by one.
TEST(Comments, HoldListedCharactersOnlyAndBeginWithNothingActive) {
  for (const std::string& name : test::shipped_controllers()) {
    const auto c = test::shipped_controller(name);
    std::mt19937_64 random(8);
    for (int i = 0; i < 300; ++i) {
      const bool foreign = i % 2 == 0;
      std::vector<nc::Block> blocks = {nc::ProgramStart{}};
      for (const auto& text : test::hostile_texts(random)) blocks.emplace_back(nc::Comment{text, foreign});
      std::istringstream lines(test::nc_text(c, blocks));
      for (std::string line; std::getline(lines, line);) {
        const auto open = line.find(c.comments.open);
        if (open == std::string::npos) continue;  // of the start of the program
        std::string said = line.substr(open + c.comments.open.size());
        if (!c.comments.close.empty()) {
          ASSERT_TRUE(said.ends_with(c.comments.close)) << line;
          said.resize(said.size() - c.comments.close.size());
        } else if (!said.empty()) {
          said.erase(0, 1);
        }
        ASSERT_LE(said.size(), c.comments.max_length) << line;
        ASSERT_EQ(said.find_first_of("%;(){}#$~\\\"|^`"), std::string::npos) << line;
        ASSERT_TRUE(std::all_of(said.begin(), said.end(), [](char ch) { return ch >= ' ' && ch <= '~'; }))
            << line;
        if (foreign) {
          ASSERT_TRUE(said.starts_with("-")) << line;
        }
        std::string start;  // up to its second word
        for (const char ch : said) {
          const bool in_word = std::isalnum(static_cast<unsigned char>(ch)) != 0;
          if (in_word && start.ends_with(" ")) break;
          if (ch != ' ' || !start.empty())
            start += static_cast<char>(std::toupper(static_cast<unsigned char>(ch)));
        }
        start.erase(std::remove(start.begin(), start.end(), ' '), start.end());
        for (const char* word : {"PY", "LOGOPEN", "LOGAPPEND", "LOGCLOSE", "PROBEOPEN", "PROBECLOSE"}) {
          ASSERT_FALSE(name == "linuxcnc" && start.starts_with(word)) << line;
        }
        const auto word = static_cast<std::size_t>(
            std::find_if(start.begin(), start.end(), [](char ch) { return std::isalnum(ch) == 0; }) -
            start.begin());
        ASSERT_FALSE(word < start.size() && start[word] == ',') << line;
      }
    }
  }
}

TEST(Comments, OneCharacterStandsForEachThatTheControlHasNot) {
  const auto c = test::shipped_controller("fanuc_30i");
  const std::string text = test::nc_text(
      c, {nc::ProgramStart{}, nc::Comment{"/\xfft\xfe 100% caf\xc3\xa9 \xe4\xbd\xa0 {d} \"q\"", true}});
  EXPECT_THAT(text, HasSubstr("(- /?T? 100? CAF? ? [D] 'Q')\n"));
}

TEST(Comments, NamesOfProgramsHoldNoWords) {
  const auto c = test::shipped_controller("heidenhain_tnc640");
  std::string text;
  nc::Writer writer(c, text);
  EXPECT_FALSE(writer.write(nc::ProgramStart{"A MM\n1 L Z-100 FMAX"}));
}

}  // namespace
}  // namespace trunnion
