// Options that contradict each other or the CL file, and numbers of a machine file that are possible and
// unusual.
#include <gtest/gtest.h>
#include <regex>
#include <string>

#include "support/command.hpp"

namespace trunnion {
namespace {

class ContradictingOptions : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    write("part.cls",
          "UNITS/MM\nLOADTL/4\nSPINDL/3000,CLW\nRAPID\nGOTO/0,0,60\nFEDRAT/100,MMPM\nGOTO/0,0,20\nFINI\n");
    write("tools.csv", "tool,length_mm\n5,90\n");
  }
  Outcome posted(const std::string& more) const {
    return run("post part.cls -m trunnion_offset -c linuxcnc " + more);
  }
};

TEST_F(ContradictingOptions, AreWrongUse) {
  for (const char* more : {"--filter -o out.nc", "-o out.nc --msys apply --ignore-msys"}) {
    const Outcome done = posted(more);
    EXPECT_EQ(done.code, 2) << more << done.messages;
    EXPECT_NE(done.messages.find("error:"), std::string::npos) << more << done.messages;
  }
}

TEST_F(ContradictingOptions, WithoutEffectAreTold) {
  for (const auto& [more, said] : {std::pair{"--cl-units inch", "UNITS/MM holds"},
                                   {"--no-geometric", "--no-geometric has no effect without --model"},
                                   {"--tools tools.csv --tool-length-mm 120", "not in the tool file"}}) {
    const Outcome done = posted(std::string("-o out.nc ") + more);
    EXPECT_EQ(done.code, 0) << more << done.messages;
    EXPECT_NE(done.messages.find(said), std::string::npos) << more << done.messages;
  }
  for (const char* right : {"--cl-units mm", "--tool-length-mm 120", "--tools tools.csv"}) {
    const Outcome done = posted(std::string("-o out.nc ") + right);
    EXPECT_EQ(done.messages.find("holds"), std::string::npos) << right << done.messages;
    EXPECT_EQ(done.messages.find("not in the tool file"), std::string::npos) << right << done.messages;
  }
}

class UnusualNumbers : public test::CommandTest {
 protected:
  std::string said(const std::string& old, const std::string& now) const {
    const std::string file = test::source_folder() + "/postconfigs/machines/trunnion_offset.toml";
    std::string machine = read_file(file).value();
    const auto at = machine.find(old);
    EXPECT_NE(at, std::string::npos) << old;
    write("machine.toml", machine.replace(at, old.size(), now));
    const Outcome done = run("machine check machine.toml");
    EXPECT_EQ(done.code, 0) << done.messages;
    return done.output + done.messages;
  }
};

TEST_F(UnusualNumbers, AreToldByTheCheck) {
  EXPECT_EQ(said("[machine]", "[machine]").find("unusual"), std::string::npos);
  EXPECT_NE(said("min_deg = -30\nmax_deg = 120", "min_deg = -0.52\nmax_deg = 2.09").find("is it in radians?"),
            std::string::npos);
  EXPECT_NE(said("min_deg = -30", "min_deg = 10").find("axis A cannot stand at 0 degrees"),
            std::string::npos);
  EXPECT_NE(
      said("min_mm = -500\nmax_mm = 500", "min_mm = -0.3\nmax_mm = 0.3").find("is it in metres or inches?"),
      std::string::npos);
  EXPECT_NE(said("[tool]", "[retract]\nz_mm = 10\n\n[tool]").find("nearer to the table"), std::string::npos);
}

}  // namespace
}  // namespace trunnion
