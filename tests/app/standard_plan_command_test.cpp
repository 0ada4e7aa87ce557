// `trunnion measurements plan path` as a user runs it: what the CL file has wrong is said, and no plan is
// written.
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/command.hpp"

namespace trunnion {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class PlanOfAPath : public test::CommandTest {
 protected:
  int plan(const std::string& cl) const {
    write("part.cls", cl);
    return run("measurements plan path -m trunnion_offset --against part.cls --poses 5 -o plan.toml").code;
  }
};

// 30 mm are cut, from where the rapid ends.
TEST_F(PlanOfAPath, LeadsTheTipAlongWhatIsCut) {
  ASSERT_EQ(
      plan("UNITS/MM\nRAPID\nGOTO/0,0,30,0,0,1\nGOTO/30,0,30,0,0,1\nRAPID\nGOTO/200,0,90,0,0,1\nFINI\n"), 0)
      << text("messages");
  EXPECT_THAT(text("plan.toml"), HasSubstr("[[0.0, 0.0, 180.0, 0.0, 0.0], [7.5, 0.0, 180.0, 0.0, 0.0], "
                                           "[15.0, 0.0, 180.0, 0.0, 0.0], [22.5, 0.0, 180.0, 0.0, 0.0], "
                                           "[30.0, 0.0, 180.0, 0.0, 0.0]]"));
}

TEST_F(PlanOfAPath, SaysWhatTheFileHasWrong) {
  struct Case {
    const char* cl;
    const char* says;
  };
  for (const Case& c :
       {Case{"FEDRAT/10,IPM\nGOTO/0,0,3\nGOTO/1,0,3\nFINI\n", "inch"},
        Case{"UNITS/MM\nGOTO/0,0,30\nTURRET/1\nGOTO/30,0,30\nFINI\n", "TURRET"},
        Case{"UNITS/MM\nGOTO/0,0,30\nCUTCOM/LEFT\nGOTO/30,0,30\nFINI\n", "CUTCOM"},
        Case{"UNITS/MM\nGOTO/0,0,30\nGOTO/30,x,30\nFINI\n", "part.cls:3"},
        Case{"UNITS/MM\nRAPID\nGOTO/0,0,30\nFINI\n", "nothing that is cut"}, Case{"", "no motion"}}) {
    EXPECT_EQ(plan(c.cl), 3) << c.cl << text("messages");
    EXPECT_THAT(text("messages"), HasSubstr(c.says)) << c.cl;
    EXPECT_FALSE(fs::exists(folder_ / "plan.toml")) << c.cl;
  }
}

}  // namespace
}  // namespace trunnion
