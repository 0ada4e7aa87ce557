// Text of the CL file must not act on LinuxCNC: its interpreter executes some comments.
#include <gtest/gtest.h>

#include "linuxcnc/interpreter.hpp"
#include "nc/hostile_text.hpp"
#include "support/controllers.hpp"

namespace trunnion {
namespace {

std::string calls(const test::Interpreted& run) {
  std::string out = "exit " + std::to_string(run.exit_code) + "\n";
  for (const auto& m : run.motions) {
    for (const auto& coordinate : m.xyzabc) out += coordinate + " ";
    out += std::to_string(m.feed_rate) + "\n";
  }
  return out;
}

TEST(LongRs274Comments, ExecutesNothingThatACommentSays) {
  if (!test::has_interpreter()) GTEST_SKIP() << "LinuxCNC's rs274 is not installed";
  const auto c = test::shipped_controller("linuxcnc");
  const auto plain = test::interpret(test::nc_text(c, test::program_with_comments(c, {})));
  ASSERT_EQ(plain.exit_code, 0) << plain.messages;
  ASSERT_EQ(plain.motions.size(), 4U);
  std::mt19937_64 random(9);
  for (int i = 0; i < 60; ++i) {
    const std::string text = test::nc_text(c, test::program_with_comments(c, test::hostile_texts(random)));
    const auto run = test::interpret(text);
    ASSERT_EQ(calls(run), calls(plain)) << run.messages << text;
    ASSERT_TRUE(run.made.empty()) << run.made.front() << "\n" << text;
  }
}

// The test above would notice.
TEST(Rs274Comments, AnUnguardedCommentIsExecuted) {
  if (!test::has_interpreter()) GTEST_SKIP() << "LinuxCNC's rs274 is not installed";
  const auto run = test::interpret("G21 G90\n;py,open('made','w')\nG0 X1\nM2\n");
  EXPECT_EQ(run.made, std::vector<std::string>{"made"});
}

}  // namespace
}  // namespace trunnion
