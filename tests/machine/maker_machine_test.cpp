// What is public of machines that are sold: every file that ships, and files that are wrong.
#include "trunnion/machine/maker_machine.hpp"

#include <cmath>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/units.hpp"

#include "support/machines.hpp"

namespace trunnion {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

Result<MakerMachine> parse(const std::string& text, Diagnostics& diagnostics) {
  return parse_maker_machine(text, "maker.toml", diagnostics);
}

constexpr const char* kHead = "name = \"M\"\nrotary = \"BC\"\nsources = [\"a sheet\"]\n";

// With the rest answered each becomes a machine file that can be read; nothing that was published gets lost.
TEST(MakerMachine, EveryFileThatShipsBecomesAMachine) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(test::source_folder() + "/postconfigs/makers")) {
    SCOPED_TRACE(entry.path().string());
    Diagnostics diagnostics;
    const auto text = read_file(entry.path().string());
    ASSERT_TRUE(text);
    const auto like = parse(*text, diagnostics);
    ASSERT_TRUE(like) << like.error().text();
    EXPECT_FALSE(like->sources.empty());
    NewMachine machine = like->machine;
    EXPECT_TRUE(machine.points_mm.empty()) << "no maker publishes where the axes lie";
    for (const char letter : machine.rotary) {
      machine.points_mm[letter] = Vec3(0.0, 0.0, -100.0);
      machine.travel.try_emplace(letter, NewMachine::Travel{-kPi, kPi, false});
    }
    for (const char letter : std::string_view("XYZ")) {
      const auto length = like->length_mm.find(letter);
      if (length == like->length_mm.end()) {
        EXPECT_TRUE(machine.travel.contains(letter)) << letter;
        continue;
      }
      EXPECT_FALSE(machine.travel.contains(letter)) << "only its length is known";
      machine.travel[letter] = {0.0, length->second, false};
    }
    const auto read = parse_machine(machine_file_text(machine, "a test"), "new.toml", diagnostics);
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_EQ(read->name, like->machine.name);
    for (const auto& [letter, travel] : like->machine.travel) {
      const Axis& axis = read->axes[*read->axis(std::string(1, letter))];
      EXPECT_EQ(axis.cyclic, travel.cyclic);
      EXPECT_TRUE(travel.cyclic || std::abs(axis.max - axis.min - (travel.max - travel.min)) < 1e-9);
    }
    for (const auto& [letter, speed] : like->machine.rapid)
      EXPECT_NEAR(*read->axes[*read->axis(std::string(1, letter))].rapid, speed, 1e-6);
    ++files;
  }
  EXPECT_GE(files, 8);
}

TEST(MakerMachine, SaysWhatAFileHasWrong) {
  struct Case {
    std::string text;
    const char* says;
  };
  const std::string head = kHead;
  for (const Case& c :
       {Case{"name = \"M\"\nrotary = \"XC\"\nsources = []\n", "'rotary' must be"},
        Case{head + "[[axis]]\nname = \"A\"\n", "must be one of XYZBC"},
        Case{head + "[[axis]]\nname = \"XY\"\n", "must be one of XYZBC"},
        Case{head + "[[axis]]\nname = \"X\"\nmin_mm = 3\n", "its lower end, then its upper end"},
        Case{head + "[[axis]]\nname = \"X\"\nmin_mm = 3\nmax_mm = 1\n", "its lower end"},
        Case{head + "[[axis]]\nname = \"X\"\nlength_mm = -3\n", "must be above 0"},
        Case{head + "rapid_mm_min = 0\n", "must be above 0"},
        Case{head + "[[axis]]\nname = \"X\"\nmin_deg = 3\nmax_deg = 4\n", "unknown key"},
        Case{head + "point_mm = [0, 0, 0]\n", "unknown key"}, Case{"name = ", "maker.toml"}}) {
    Diagnostics diagnostics;
    EXPECT_FALSE(parse(c.text, diagnostics)) << c.text;
    std::string said;
    for (const auto& message : diagnostics.findings()) said += message.text();
    EXPECT_THAT(said, HasSubstr(c.says)) << c.text;
  }
}

}  // namespace
}  // namespace trunnion
