// `measurements import trace --model-out` and what `post` makes of such a model.
#include <gtest/gtest.h>
#include <string>

#include "support/command.hpp"

namespace trunnion {
namespace {

class TraceImportCommand : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    write("part.cls",
          "LOADTL/1,LENGTH,100\nSPINDL/RPM,8000,CLW\nFEDRAT/MMPM,2000\nRAPID\nGOTO/0,0,60\nGOTO/0,0,5\n"
          "GOTO/20,0,5\nGOTO/20,20,5\nRAPID\nGOTO/20,20,60\nFINI\n");
    write("late.toml", "[model]\nname = \"late\"\nlag_of_all_axes_ms = 6\n");
    write("trace.csv", "time_s,X_mm\n0,0\n");
  }
  Outcome post(const std::string& to, const std::string& more) const {
    return run("-q post part.cls -m trunnion_offset -c linuxcnc -o " + to + " " + more);
  }
};

// A model that has nothing else is one.
TEST_F(TraceImportCommand, PostLeadsByTheLagOfAllAxesAlone) {
  ASSERT_EQ(post("plain.nc", "").code, 0);
  const Outcome led = post("led.nc", "--model late.toml");
  ASSERT_EQ(led.code, 0) << led.messages;
  EXPECT_EQ(led.messages.find("no effect has a value"), std::string::npos) << led.messages;
  const std::string verify = " -m trunnion_offset -c linuxcnc --against part.cls --truth late.toml";
  const Outcome plain_late = run("-q verify plain.nc" + verify), led_late = run("-q verify led.nc" + verify);
  EXPECT_EQ(plain_late.code, 1) << plain_late.messages;
  EXPECT_EQ(led_late.code, 0) << led_late.messages;
  // Without the errors of the geometry and the servos nothing is led.
  ASSERT_EQ(post("not_led.nc", "--model late.toml --no-geometric").code, 0);
  const auto blocks = [&](const std::string& file) {
    const std::string nc = text(file);
    return nc.substr(nc.find("\nG"));
  };
  EXPECT_EQ(blocks("not_led.nc"), blocks("plain.nc"));
  EXPECT_NE(blocks("led.nc"), blocks("plain.nc"));
}

TEST_F(TraceImportCommand, FilesAreNotOverwritten) {
  ASSERT_EQ(post("plain.nc", "").code, 0);
  const std::string import = "measurements import trace trace.csv -m trunnion_offset -c linuxcnc ";
  const std::string held = import + "--program plain.nc --against part.cls ";
  for (const auto& [words, said] :
       {std::pair(import + "-o rows.csv --model-out m.toml", "--model-out needs --program"),
        std::pair(held + "-o rows.csv --model-out rows.csv", "-o and --model-out name the same file"),
        std::pair(held + "-o rows.csv --model-out part.cls", "--model-out would overwrite part.cls"),
        std::pair(held + "-o - --model-out -", "both want standard output"),
        std::pair(held + "-o trace.csv", "-o would overwrite trace.csv"),
        std::pair(import + "-o trace.csv", "-o would overwrite trace.csv")}) {
    const Outcome done = run(words);
    EXPECT_EQ(done.code, 2) << words << done.messages;
    EXPECT_NE(done.messages.find(said), std::string::npos) << words << done.messages;
  }
  EXPECT_EQ(text("trace.csv"), "time_s,X_mm\n0,0\n");
  EXPECT_EQ(text("rows.csv"), "");
}

}  // namespace
}  // namespace trunnion
