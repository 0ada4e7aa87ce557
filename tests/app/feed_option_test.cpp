// `post --feed`: which words, and whether F is cut to what the axes reach.
#include <gtest/gtest.h>
#include <regex>
#include <string>

#include "support/command.hpp"

namespace trunnion {
namespace {

class FeedOption : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    const std::string file = test::source_folder() + "/postconfigs/machines/trunnion_offset.toml";
    const std::string machine = read_file(file).value();
    write("without.toml", machine);
    const std::string linear = std::regex_replace(machine, std::regex("(\nrapid_mm_min[^\n]*)"),
                                                  std::string("$1\nacceleration_mm_s2 = 20"));
    write("with.toml", std::regex_replace(linear, std::regex("(\nrapid_deg_min[^\n]*)"),
                                          std::string("$1\nacceleration_deg_s2 = 20")));
  }
  // The program without its head, which names files and options.
  std::string blocks(const std::string& machine, const std::string& more) const {
    const Outcome done =
        run("-q post " + test::source_folder() + "/samples/01_impeller/table_3_2.cls -m " + machine +
            " -c fanuc_30i --tool 1 --tool-length-mm 100 -o out.nc --json out.json " + more);
    EXPECT_EQ(done.code, 0) << done.messages;
    const std::string nc = text("out.nc");
    return nc.substr(std::min(nc.find("\nG"), nc.find("\nN")));
  }
};

TEST_F(FeedOption, AsProgrammedIsWhatMachinesWithoutAccelerationsGet) {
  for (const std::string words : {"inverse", "per-minute"}) {
    const std::string without = blocks("without.toml", "--feed " + words);
    EXPECT_EQ(text("out.json").find("feeds_not_reached"), std::string::npos);
    const std::string with = blocks("with.toml", "--feed " + words);
    EXPECT_NE(text("out.json").find("\"feeds_not_reached\": 0"), std::string::npos) << text("out.json");
    EXPECT_NE(with, without);
    EXPECT_EQ(blocks("with.toml", "--feed " + words + ",as-programmed"), without);
    EXPECT_EQ(text("out.json").find("\"feeds_not_reached\": 0"), std::string::npos);
  }
  EXPECT_EQ(blocks("with.toml", "--feed as-programmed"), blocks("without.toml", ""));
}

TEST_F(FeedOption, OtherWordsAreWrongUse) {
  const Outcome done = run("post part.cls -m with.toml -o out.nc --feed as-programmed,inverse");
  EXPECT_EQ(done.code, 2) << done.messages;
  EXPECT_NE(done.messages.find("--feed"), std::string::npos) << done.messages;
}

}  // namespace
}  // namespace trunnion
