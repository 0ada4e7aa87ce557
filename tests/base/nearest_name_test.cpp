#include "trunnion/base/nearest_name.hpp"

#include <gtest/gtest.h>

namespace trunnion {
namespace {

// Distances counted by hand: one insertion, one omission, one change, one swap.
TEST(NearestName, FindsOneMistake) {
  const std::vector<std::string> names = {"post", "batch", "verify", "machine"};
  EXPECT_EQ(nearest_name("posst", names), "post");
  EXPECT_EQ(nearest_name("pst", names), "post");
  EXPECT_EQ(nearest_name("bitch", names), "batch");
  EXPECT_EQ(nearest_name("vreify", names), "verify");
  EXPECT_EQ(nearest_name("MACHINE", names), "machine");
}

TEST(NearestName, TakesTheNearest) {
  EXPECT_EQ(nearest_name("--tolerance", {"--rapid-tolerance-mm", "--tolerance-mm"}), "--tolerance-mm");
  EXPECT_EQ(nearest_name("abcdef", {"abxyef", "abxdef"}), "abxdef");
}

TEST(NearestName, SaysNothingOfAnotherWord) {
  EXPECT_EQ(nearest_name("xy", {"post"}), "");
  EXPECT_EQ(nearest_name("", {"a"}), "");
  EXPECT_EQ(nearest_name("simulate", {"machine", "verify"}), "");
  EXPECT_EQ(nearest_name(std::string(100000, 'a'), {"post"}), "");
}

TEST(NearestName, MakesAQuestion) {
  EXPECT_EQ(did_you_mean("posst", {"post"}), "; did you mean 'post'?");
  EXPECT_EQ(did_you_mean("anything", {"post"}), "");
}

}  // namespace
}  // namespace trunnion
