// No option of any command writes over a file that another one names; numbers are finite; messages end.
#include <algorithm>
#include <gtest/gtest.h>
#include <string>

#include "support/command.hpp"

namespace trunnion {
namespace {

class FilesApart : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    write("part.cls",
          "LOADTL/1,LENGTH,100\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,2000\nRAPID\nGOTO/0,0,60\nGOTO/0,0,5\n"
          "GOTO/20,0,5\nRAPID\nGOTO/20,0,60\nFINI\n");
    std::filesystem::copy_file(test::source_folder() + "/postconfigs/machines/trunnion_offset.toml",
                               folder_ / "mill.toml");
    for (const char* name :
         {"data.csv", "log.csv", "plan.toml", "known.toml", "part.nc", "table.csv", "th.toml"})
      write(name, "as it was\n");
  }
};

TEST_F(FilesApart, NoOutputGoesOverAFileThatTheCommandReads) {
  const std::vector<std::pair<std::string, std::string>> uses = {
      {"machine mill.toml -o mill.toml", "mill.toml"},
      {"machine mill.toml --json mill.toml", "mill.toml"},
      {"machine check mill.toml --report mill.toml", "mill.toml"},
      {"verify part.nc --against part.cls -m mill.toml --report part.nc", "part.nc"},
      {"verify part.nc --against part.cls -m mill.toml --json ./part.cls", "part.cls"},
      {"post part.cls -m mill.toml -o part.cls", "part.cls"},
      {"study nonlinear part.cls -m mill.toml --json part.cls", "part.cls"},
      {"model fit data.csv -m mill.toml --model known.toml -o data.csv", "data.csv"},
      {"model diagnose data.csv -m mill.toml --model known.toml --json data.csv", "data.csv"},
      {"model diagnose data.csv -m mill.toml --model known.toml --formula known.toml", "known.toml"},
      {"model plan data.csv -m mill.toml --model known.toml -o known.toml", "known.toml"},
      {"simulate plan.toml -m mill.toml --truth known.toml -o plan.toml", "plan.toml"},
      {"thermal fit log.csv --target dx -o log.csv", "log.csv"},
      {"thermal predict th.toml log.csv -o th.toml", "th.toml"},
      {"thermal import log.csv -o log.csv", "log.csv"},
      {"table export linuxcnc table.csv -m mill.toml -o table.csv", "table.csv"},
      {"measurements template laser -m mill.toml -o mill.toml", "mill.toml"}};
  for (const auto& [words, file] : uses) {
    const std::string before = text(file);
    const Outcome done = run(words);
    EXPECT_EQ(done.code, 2) << words << done.messages;
    EXPECT_NE(done.messages.find("would overwrite"), std::string::npos) << words << done.messages;
    EXPECT_EQ(text(file), before) << words;
  }
  EXPECT_EQ(run("thermal simulate -o a.csv --truth a.csv").code, 2);
  EXPECT_EQ(run("post part.cls -m mill.toml -o o.nc --json o.nc").code, 2);
  EXPECT_EQ(run("thermal predict th.toml log.csv --json -").code, 2);  // both want standard output
}

// A program may have the name of its file.
TEST_F(FilesApart, OwnOutputIsWrittenAnew) {
  for (int i = 0; i < 2; ++i) {
    const Outcome done =
        run("post part.cls -m mill.toml -c siemens_840d_sl -o PART --program-name PART --json r.json");
    EXPECT_EQ(done.code, 0) << done.messages;
  }
}

TEST_F(FilesApart, TwoInputsAreNotBothStandardInput) {
  const Outcome done = run("verify - --against - -m mill.toml <part.cls");
  EXPECT_EQ(done.code, 2);
  EXPECT_NE(done.messages.find("standard input"), std::string::npos) << done.messages;
}

TEST_F(FilesApart, NumbersAreFinite) {
  for (const char* words : {"post part.cls -m mill.toml -o o.nc --flute-length-mm nan",
                            "post part.cls -m mill.toml -o o.nc --tolerance-mm inf",
                            "thermal import log.csv -o x.csv --seconds-per-count nan",
                            "measurements import map data.csv -o x.csv --u-random-um NaN"}) {
    const Outcome done = run(words);
    EXPECT_EQ(done.code, 2) << words << done.messages;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "o.nc")) << words;
  }
}

TEST_F(FilesApart, OptionsThatDoNothingAreTold) {
  for (const auto& [words, needs] : {std::pair{"--pole-cone-deg 3", "--pole-tolerance-deg"},
                                     std::pair{"--thermal-clamp-um 20", "--offsets or --thermal"},
                                     std::pair{"--largest-correction-mm 1", "--model"}}) {
    const Outcome done = run("post part.cls -m mill.toml -o o.nc " + std::string(words));
    EXPECT_EQ(done.code, 0) << words << done.messages;
    EXPECT_NE(done.messages.find(std::string("has no effect without ") + needs), std::string::npos)
        << words << done.messages;
  }
  EXPECT_EQ(run("post part.cls -m mill.toml -o o.nc --pole-cone-deg 3 --pole-tolerance-deg 0.1")
                .messages.find("no effect"),
            std::string::npos);
}

// The program bounds the values that it reads: by more than is asked for it is not what was posted.
TEST_F(FilesApart, VerifyKnowsTheThermalLimitsThatAProgramWasPostedWith) {
  write("drift.csv", "time_s,dx_um,dy_um,dz_um\n0,5,0,0\n100,9,0,0\n");
  const std::string limits = " --thermal-clamp-um 300";
  const Outcome done =
      run("post part.cls -m mill.toml -o warm.nc --offsets drift.csv --thermal-output variables" + limits);
  ASSERT_EQ(done.code, 0) << done.messages;
  const std::string verify = "verify warm.nc --against part.cls -m mill.toml";
  for (const char* drift : {"", " --offsets drift.csv"}) {
    const Outcome with = run(verify + drift + limits);
    EXPECT_EQ(with.code, 0) << drift << with.messages;
    EXPECT_EQ(with.messages.find("no effect"), std::string::npos) << with.messages;
    const Outcome without = run(verify + drift);
    EXPECT_EQ(without.code, 1) << drift << without.messages;
    EXPECT_NE(without.messages.find("--thermal-clamp-um"), std::string::npos) << without.messages;
  }
}

TEST_F(FilesApart, WrongUseIsAnErrorInEveryWording) {
  for (const char* words :
       {"post part.cls -m mill.toml -o o.nc --tolerance-mm 0", "machine mill.toml -o ''",
        "post part.cls -m mill.toml -o o.nc --tool-length-mm 1 2", "thermal serve th.toml --port 99999",
        "model plan data.csv -m mill.toml --model known.toml -o ''",
        "model improve data.csv -m mill.toml --model known.toml -o -"}) {
    const Outcome done = run(words);
    EXPECT_EQ(done.code, 2) << words << done.messages;
    EXPECT_TRUE(done.messages.starts_with("error: ")) << words << done.messages;
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "-"));
}

// The model that has it twice could not be read again.
TEST_F(FilesApart, AnEffectIsAddedOnce) {
  write("known.toml", "[model]\nname = \"m\"\n[[effect]]\nid = \"worm:C\"\n");
  const Outcome twice = run("model add worm:C --model known.toml -m mill.toml -o new.toml");
  EXPECT_EQ(twice.code, 2) << twice.messages;
  EXPECT_NE(twice.messages.find("'worm:C' is in known.toml already, line 4"), std::string::npos)
      << twice.messages;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "new.toml"));
  EXPECT_EQ(run("model add worm:A --model known.toml -m mill.toml -o new.toml").code, 0);
}

TEST_F(FilesApart, AFileOfTheWrongKindHasTwentyMessagesAndNoMore) {
  std::string rows = "run_id,time_s,X_mm\n";
  for (int i = 0; i < 1000; ++i) rows += "a;b\n";
  write("data.csv", rows);
  write("known.toml", "[model]\nname = \"none\"\n");
  const Outcome done = run("model evaluate data.csv -m mill.toml --model known.toml");
  EXPECT_EQ(done.code, 3);
  EXPECT_LE(std::count(done.messages.begin(), done.messages.end(), '\n'), 25) << done.messages;
}

TEST_F(FilesApart, MarksOfEditorsAreNoText) {
  ASSERT_EQ(run("post part.cls -m mill.toml -o right.nc").code, 0);
  write("marked.nc", "\xEF\xBB\xBF" + text("right.nc"));
  const Outcome done = run("verify marked.nc --against part.cls -m mill.toml");
  EXPECT_EQ(done.code, 0) << done.messages;
  write("wide.csv", std::string("\xFF\xFE") + "r\0u\0n\0");
  const Outcome wide = run("model evaluate wide.csv -m mill.toml --model known.toml");
  EXPECT_EQ(wide.code, 3);
  EXPECT_NE(wide.messages.find("UTF-16"), std::string::npos) << wide.messages;
  EXPECT_EQ(run("verify /dev/zero --against part.cls -m mill.toml").code, 4);
}

// What editors and other systems leave beside a file.
TEST_F(FilesApart, ABatchLeavesHiddenFilesAlone) {
  std::filesystem::create_directory(folder_ / "in");
  std::filesystem::copy_file(folder_ / "part.cls", folder_ / "in/part.cls");
  write("in/._part.cls", "no CL file");
  const Outcome done = run("batch in -m mill.toml -o out");
  EXPECT_EQ(done.code, 0) << done.messages;
}

}  // namespace
}  // namespace trunnion
