// `trunnion probe program`, `trunnion probe read` and `trunnion machine calibrate` as a user runs them.
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "probe/hidden_machine.hpp"
#include "support/command.hpp"

namespace trunnion {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class ProbeCommand : public test::CommandTest {
 protected:
  Outcome program(const std::string& words = "-o p.nc") const {
    return run(
        "probe program -m trunnion_offset --ball-mm 60,40,30 --ball-radius-mm 12.7 --stylus-radius-mm 3 " +
        words);
  }
  // What the control logs on a machine whose C axis is a millimetre elsewhere.
  std::string log() const {
    test::HiddenMachine hidden;
    hidden.a_direction = {-1, 0, 0};
    hidden.a_point = {0, 0.4, -65};
    hidden.c_direction = {0, 0, -1};
    hidden.c_point = {1.1, 0, -30};
    hidden.ball = {60, 40, 30};
    hidden.noise_mm = 0.0005;
    return test::run_probing(text("p.nc"), hidden, 1).log;
  }
};

TEST_F(ProbeCommand, PutsAMachineFileRight) {
  ASSERT_EQ(program("--json p.json -o p.nc").code, 0) << text("messages");
  EXPECT_EQ(nlohmann::json::parse(text("p.json"))["touches"], 121);
  write("p.txt", log());
  const auto read = run("probe read p.txt -m trunnion_offset --program p.nc -o d.csv");
  ASSERT_EQ(read.code, 0) << read.messages;
  EXPECT_THAT(read.output, HasSubstr("12 poses; one touch scatters by"));
  const auto done =
      run("machine calibrate d.csv -m trunnion_offset -o new.toml --json - --parameters linuxcnc");
  ASSERT_EQ(done.code, 0) << done.messages;
  const auto json = nlohmann::json::parse(done.output);
  EXPECT_NEAR(json["parameters"]["C.point_x_mm"]["value"].get<double>(), 1.1, 0.003);
  EXPECT_NEAR(json["parameters"]["C.point_x_mm"]["was"].get<double>(), 0.1, 1e-12);
  EXPECT_THAT(json["not_seen"][0].get<std::string>(), HasSubstr("flange"));
  EXPECT_THAT(json["control_parameters"][0].get<std::string>(), HasSubstr("x-rot-point 1.1"));
  EXPECT_THAT(text("new.toml"), HasSubstr("# A trunnion whose C axis stands"));
  // The new file reads the same log with nothing left over.
  ASSERT_EQ(run("probe read p.txt -m new.toml --program p.nc -o again.csv").code, 0) << text("messages");
  const auto again = run("machine calibrate again.csv -m new.toml -o newer.toml --json -");
  EXPECT_LT(nlohmann::json::parse(again.output)["rms_before_um"].get<double>(), 3.0);
}

TEST_F(ProbeCommand, IsAFilterToo) {
  const auto shown = program("-o -");
  ASSERT_EQ(shown.code, 0) << shown.messages;
  EXPECT_THAT(shown.output, HasSubstr("G38.2"));
  write("p.nc", shown.output);
  write("p.txt", log());
  const auto read = run("probe read - -m trunnion_offset --program p.nc -o - < p.txt", "");
  ASSERT_EQ(read.code, 0) << read.messages;
  write("d.csv", read.output);
  const auto done = run("machine calibrate - -m trunnion_offset -o - < d.csv");
  ASSERT_EQ(done.code, 0) << done.messages;
  EXPECT_THAT(done.output, HasSubstr("point_mm = [1.1"));
}

TEST_F(ProbeCommand, RefusesWrongUseAndWritesNothing) {
  for (const char* words :
       {"--poses 3 -o p.nc", "--poses x -o p.nc", "", "--ball-uncertainty-mm nan -o p.nc",
        "--ball-uncertainty-mm 14 -o p.nc", "--slow-mm-min 300 -o p.nc", "--json - -o -"}) {
    EXPECT_EQ(program(words).code, 2) << words;
    EXPECT_FALSE(fs::exists(folder_ / "p.nc")) << words;
  }
  EXPECT_EQ(program("--log 'a b' -o p.nc").code, 3);
  EXPECT_EQ(program("-c hnc_8 -o p.nc").code, 3);
  EXPECT_EQ(program("-c no_such -o p.nc").code, 4);
  EXPECT_EQ(program("--ball-mm 900,0,0 -o p.nc").code, 2);  // given twice
  EXPECT_EQ(run("probe program -m trunnion_offset --ball-mm 900,0,0 --ball-radius-mm 10 --stylus-radius-mm 3 "
                "-o p.nc")
                .code,
            1);
  EXPECT_FALSE(fs::exists(folder_ / "p.nc"));
  EXPECT_EQ(run("machine").code, 2);
  EXPECT_EQ(run("probe").code, 2);
  EXPECT_EQ(run("machine trunnion_offset -o proving.nc").code, 0);
}

TEST_F(ProbeCommand, RefusesBadFilesAndWritesNothing) {
  ASSERT_EQ(program().code, 0);
  write("p.txt", log());
  write("empty", "");
  const auto empty = run("probe read empty -m trunnion_offset --program p.nc -o d.csv");
  EXPECT_EQ(empty.code, 3);
  EXPECT_THAT(empty.messages, HasSubstr("pose 1 (A0.000 C0.000)"));
  EXPECT_EQ(run("probe read missing -m trunnion_offset --program p.nc -o d.csv").code, 4);
  EXPECT_EQ(run("probe read p.txt -m trunnion_offset --program missing -o d.csv").code, 4);
  EXPECT_EQ(run("probe read p.txt -m trunnion_offset --program p.txt -o d.csv").code, 3);
  EXPECT_EQ(run("probe read p.txt -m trunnion_offset --program p.nc -o p.nc").code, 2);
  ASSERT_EQ(run("probe read p.txt -m trunnion_offset --program p.nc -o d.csv").code, 0);
  const auto other = run("machine calibrate d.csv -m xyzac_trt -o new.toml");
  EXPECT_EQ(other.code, 1);
  EXPECT_THAT(other.messages, HasSubstr("no lines of the rotary axes explain these readings"));
  fs::remove(folder_ / "d.csv");
  EXPECT_EQ(run("machine calibrate empty -m trunnion_offset -o new.toml").code, 3);
  EXPECT_EQ(run("machine calibrate missing -m trunnion_offset -o new.toml").code, 4);
  EXPECT_EQ(run("machine calibrate -m trunnion_offset -o new.toml").code, 2);
  EXPECT_FALSE(fs::exists(folder_ / "d.csv"));
  EXPECT_FALSE(fs::exists(folder_ / "new.toml"));
}

}  // namespace
}  // namespace trunnion
