// `trunnion batch` and `trunnion post` as a user runs them: wrong use, names, pipes, signals, limits.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include "trunnion/base/files.hpp"

#include "support/command.hpp"

namespace trunnion {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kBatchProgram = test::binary_folder() + "/trunnion";

class BatchCommand : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    fs::create_directory(folder_ / "in");
    for (const char* part : {"a", "b", "c"}) write_part(std::string("in/") + part + ".cls");
  }

  void write_part(const std::string& name, const std::string& end = "") const {
    std::ofstream(folder_ / name) << "LOADTL/1\nFEDRAT/500\nRAPID\nGOTO/0,0,50,0,0,1\nGOTO/1,0,10,0,0.6,0.8\n"
                                     "GOTO/10,1,8,0,0.28,0.96\n"
                                  << end;
  }
  Outcome batch(const std::string& words, const std::string& before = "") const {
    return run("batch in -m paper -o out " + words, before);
  }
};

// Another build may be a mended one, whatever version it says.
TEST_F(BatchCommand, AnotherBuildOfTheProgramMakesAllAgain) {
  const std::string machine = test::source_folder() + "/postconfigs/machines/paper.toml";
  const std::string words = "batch in -m '" + machine + "' -o out";
  // It looks for its data beside it, as an installed one does.
  const std::string other = (folder_ / "bin" / "trunnion").string();
  fs::create_directories(folder_ / "bin");
  fs::create_directories(folder_ / "share" / "trunnion");
  fs::create_directory_symlink(test::source_folder() + "/postconfigs",
                               folder_ / "share" / "trunnion" / "postconfigs");
  fs::copy_file(kBatchProgram, other);
  ASSERT_EQ(run(words).code, 0);
  EXPECT_THAT(run(words, "", other).messages, HasSubstr("3 unchanged"));
  std::ofstream(other, std::ios::app) << "another build";
  EXPECT_THAT(run(words, "", other).messages, HasSubstr("3 posted"));
  EXPECT_THAT(run(words, "", other).messages, HasSubstr("3 unchanged"));
}

TEST_F(BatchCommand, WrongUseIsSaidOnceBeforeAnyFile) {
  for (const char* words :
       {"--rtcp --tilted-plane", "--rtcp --thin", "--choice axis:Q", "--temperatures log.csv", "--shard ''",
        "--shard 0/3", "--shard 4/3", "-j 0", "-j 1000000000", "--pole-tolerance-deg nan",
        "--thermal-dead-band-um nan", "--tolerance-mm 1e300", "--json in/a.cls", "--json out/a.nc",
        "--json r --report ./r", "--json - --report -"}) {
    const Outcome outcome = batch(words);
    EXPECT_EQ(outcome.code, 2) << words << "\n" << outcome.messages;
    EXPECT_THAT(outcome.messages, Not(HasSubstr("defect"))) << words;
    EXPECT_FALSE(fs::exists(folder_ / "out")) << words;
  }
  for (const char* folder : {"''", "-"})
    EXPECT_EQ(run("batch in -m paper -o " + std::string(folder)).code, 2) << folder;
  EXPECT_EQ(run("batch in -m paper -o in/a.cls").code, 4);
}

TEST_F(BatchCommand, WarningsOfPostedFilesAreShown) {
  write_part("in/b.cls", "INSERT G4 P1\nFINI\n");
  const Outcome outcome = batch("--json r.json");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.messages, HasSubstr("in/b.cls:7:1: warning: the text of INSERT goes"));
  const auto json = nlohmann::json::parse(text("r.json"));
  EXPECT_EQ(json["items"][1]["warnings"].size(), json["items"][0]["warnings"].size() + 1);
}

TEST_F(BatchCommand, FailedVerificationNamesItsReason) {
  const Outcome outcome = batch("--axis-tolerance-deg 1e-9");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.messages, HasSubstr("in/a.cls: error: the tool axis deviates by "));
  EXPECT_THAT(outcome.messages, HasSubstr("the tolerance is 1e-09 deg"));
}

TEST_F(BatchCommand, ProgramOfAnEarlierRunIsNotTakenForTheNewOne) {
  EXPECT_EQ(batch("").code, 0);
  write_part("in/b.cls", "GOTO/1,2\n");
  const Outcome outcome = batch("");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_THAT(outcome.messages, HasSubstr("out/b.nc: warning: the program of an earlier run is still there"));
  EXPECT_THAT(outcome.messages, Not(HasSubstr("out/a.nc: warning")));
}

TEST_F(BatchCommand, HeaderNamesTolerance) {
  EXPECT_EQ(batch("--tolerance-mm 0.004 -c linuxcnc").code, 0);
  EXPECT_THAT(text("out/a.nc"), HasSubstr("(errors none compensated)"));
  EXPECT_THAT(text("out/a.nc"), HasSubstr("(nonlinear error adaptive, tolerance 0.004 mm)"));
}

// As the interface promises of post; the programs of a batch have the same line.
TEST_F(BatchCommand, VerifySaysThatTheHeaderNamesAModel) {
  std::ofstream(folder_ / "model.toml") << "[[effect]]\nid = \"location:C\"\n"
                                           "[effect.parameters]\nX0C_um = 12.0\n";
  for (const char* control : {"linuxcnc", "fanuc_30i"}) {
    EXPECT_EQ(batch(std::string("--model model.toml -c ") + control).code, 0);
    const std::string words = std::string("verify out/a.nc -m paper --against in/a.cls -c ") + control;
    EXPECT_THAT(run(words).messages, HasSubstr("out/a.nc: warning: its header names a model")) << control;
    const Outcome on_truth = run(words + " --truth model.toml");
    EXPECT_EQ(on_truth.code, 0) << on_truth.messages;
    EXPECT_THAT(on_truth.messages, Not(HasSubstr("its header")));
  }
}

TEST_F(BatchCommand, ReportDoesNotCallVerifiedWhatIsNot) {
  EXPECT_EQ(batch("--no-verify --report r.html").code, 0);
  EXPECT_THAT(text("r.html"), HasSubstr("3 posted, 0 unchanged, 0 failed, not verified"));
}

TEST_F(BatchCommand, NamesThatAreNoTextDoNotStopTheSummary) {
  write_part("in/\xfc\xff.cls");
  const Outcome outcome = batch("--json -");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(nlohmann::json::parse(outcome.output)["posted"], 4);
}

// Read a second time it would be empty, whatever machine it was.
TEST_F(BatchCommand, MachineFromAPipeIsRefused) {
  const std::string shipped = test::source_folder() + "/postconfigs/machines/paper.toml";
  const Outcome outcome = run("batch in -m - -o out", "cat '" + shipped + "' |");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.messages, HasSubstr("cannot be a pipe"));
}

TEST_F(BatchCommand, FileBeyondTheLimitOfTheShellFailsAlone) {
  std::ofstream(folder_ / "in" / "long.cls") << [&] {
    std::string out = text("in/a.cls");
    for (int i = 0; i < 400; ++i) out += "GOTO/" + std::to_string(i % 20) + ",1,8,0,0.28,0.96\n";
    return out;
  }();
  const Outcome outcome = batch("", "ulimit -f 8 &&");
  EXPECT_EQ(outcome.code, 4);
  EXPECT_THAT(outcome.messages, HasSubstr("long.nc: error: cannot write: File too large"));
  EXPECT_THAT(outcome.messages, HasSubstr("4 files: 3 posted, 0 unchanged, 1 failed"));
}

TEST_F(BatchCommand, NoOutputGoesOverAnInput) {
  const std::string before = text("in/a.cls");
  for (const char* words :
       {"post in/a.cls -m paper -o in/a.cls", "post in/a.cls -m paper -o x.nc --json ./in/../in/a.cls",
        "post in/a.cls -m paper -o x.nc --report x.nc", "post in/a.cls -m paper -o - --report -"}) {
    EXPECT_EQ(run(words).code, 2) << words;
  }
  EXPECT_EQ(text("in/a.cls"), before);
  EXPECT_FALSE(fs::exists(folder_ / "x.nc"));
  EXPECT_EQ(run("post in/a.cls -m paper -o /dev/null --json /dev/null").code, 0);
}

// The first signal lets what has begun end, the second one does not.
TEST_F(BatchCommand, SecondSignalEndsAtOnce) {
  std::ofstream large(folder_ / "in" / "a.cls");
  large << "LOADTL/1\nFEDRAT/500\n";
  for (int i = 0; i < 2000000; ++i) large << "GOTO/" << i % 200 << ",1,8,0,0.28,0.96\n";
  large.close();
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const std::string in = (folder_ / "in").string();
    const std::string out = (folder_ / "out").string();
    ::execl(kBatchProgram.c_str(), "trunnion", "-q", "batch", in.c_str(), "-m", "paper", "-o", out.c_str(),
            "-j", "1", nullptr);
    ::_exit(127);
  }
  while (!fs::exists(folder_ / "out")) ::usleep(1000);  // the handlers are set next
  ::usleep(100000);
  ::kill(child, SIGTERM);
  ::usleep(50000);
  ::kill(child, SIGTERM);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_TRUE(fs::is_empty(folder_ / "out"));
}

}  // namespace
}  // namespace trunnion
