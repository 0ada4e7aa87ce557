// Controller files: what is wrong in one is said with its place.
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/controllers.hpp"
#include "support/folder_test.hpp"

namespace trunnion {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ControllerFile : public test::FolderTest {
 protected:
  void SetUp() override {
    FolderTest::SetUp();
    fs::copy_file(test::controller_folder() + "/iso.toml", folder_ / "iso.toml");
  }

  // Messages without the folder, in front of each its file.
  std::vector<std::string> errors_of(const std::string& text) {
    std::ofstream(folder_ / "c.toml") << text;
    Diagnostics diagnostics;
    EXPECT_FALSE(nc::load_controller((folder_ / "c.toml").string(), diagnostics));
    std::vector<std::string> out;
    for (const auto& f : diagnostics.findings()) out.push_back(f.text().substr(folder_.string().size() + 1));
    return out;
  }
};

constexpr const char* kHead = "[controller]\nname = \"C\"\nbase = \"iso\"\n";

TEST_F(ControllerFile, TakesEverythingFromItsBase) {
  std::ofstream(folder_ / "c.toml") << kHead << "[comments]\nmax_characters = 70\n";
  Diagnostics diagnostics;
  const auto c = nc::load_controller((folder_ / "c.toml").string(), diagnostics);
  ASSERT_TRUE(c);
  EXPECT_EQ(c->name, "C");
  EXPECT_EQ(c->comments.max_length, 70U);
  EXPECT_EQ(c->motion.rapid, "G0");
}

// Such words would be in every program, and its verification takes what the file says as it is.
TEST_F(ControllerFile, ASetupChangesNoUnitPlaneOrZero) {
  for (const char* setup :
       {"G17 G20 G40 G90 G94", "G18 G21", "G17 G95", "G52 X10", "G10 L2 P1 X5", "G17 G41", "G28 Z0", "X0 Y0"})
    EXPECT_FALSE(errors_of(std::string(kHead) + "[program]\nsetup = [\"" + setup + "\"]\n").empty()) << setup;
  EXPECT_FALSE(errors_of(std::string(kHead) + "[coolant]\nflood = \"G28 X0 Y0\"\n").empty());
}

TEST_F(ControllerFile, WarnsOfAWordOfTheSetupThatNothingElseKnows) {
  std::ofstream(folder_ / "c.toml") << kHead << "[program]\nsetup = [\"G17 G21 G51.1 G90 G94\"]\n";
  Diagnostics diagnostics;
  ASSERT_TRUE(nc::load_controller((folder_ / "c.toml").string(), diagnostics));
  ASSERT_EQ(diagnostics.findings().size(), 1U);
  EXPECT_THAT(diagnostics.findings().front().text(), HasSubstr("[program] setup has 'G51.1'"));
}

TEST_F(ControllerFile, AReferencePointInIncrementsEndsAsAbsolute) {
  std::ofstream(folder_ / "c.toml") << kHead << "[retract]\nZ = [\"G91 G28 Z0.\", \"G90\"]\n";
  Diagnostics diagnostics;
  const auto c = nc::load_controller((folder_ / "c.toml").string(), diagnostics);
  ASSERT_TRUE(c);
  nc::Motion m;
  m.words.set(nc::AxisLetter::X, 1000);
  const std::string text = test::nc_text(*c, {nc::ProgramStart{}, nc::Retract{}, m, nc::ProgramEnd{}});
  EXPECT_NE(text.find("G91 G28 Z0.\nN30 G90\nN40 G0 X1.\n"), std::string::npos) << text;
  const auto blocks = test::nc_blocks(*c, text);
  ASSERT_EQ(blocks.size(), 4U);
  EXPECT_TRUE(std::holds_alternative<nc::Retract>(blocks[1]));
  // Somebody has taken the line out: X1. is an increment then.
  std::string without = text;
  without.erase(without.find("N30 G90\n"), 8);
  Diagnostics findings;
  EXPECT_FALSE(nc::read_program(*c, without, "p.nc", findings));
  EXPECT_NE(findings.findings()[0].text().find("'G91' of line 4 is still in force: 'G90' is missing"),
            std::string::npos)
      << findings.findings()[0].text();
}

TEST_F(ControllerFile, TakesABaseThatShipsWhenNoneStandsBesideIt) {
  const fs::path shop = folder_ / "shop";
  fs::create_directories(shop);
  std::ofstream(shop / "c.toml") << kHead << "[comments]\nmax_characters = 70\n";
  Diagnostics diagnostics;
  EXPECT_FALSE(nc::load_controller((shop / "c.toml").string(), diagnostics));
  Diagnostics fresh;
  const auto c = nc::load_controller((shop / "c.toml").string(), fresh, folder_.string());
  ASSERT_TRUE(c);
  EXPECT_EQ(c->motion.rapid, "G0");
  EXPECT_THAT(c->bases, ElementsAre((folder_ / "iso.toml").string()));
}

TEST_F(ControllerFile, NamesUnknownKeysAndWrongTypesWithTheirPlace) {
  EXPECT_THAT(errors_of(std::string(kHead) +
                        "[motion]\nrapidd = \"G0\"\n[numbers]\nlinear_decimals = 12\nplus_sign = 1\n"),
              ElementsAre("c.toml:7:1: error: 'linear_decimals' must be from 0 to 9, not 12",
                          "c.toml:8:1: error: 'plus_sign' must be true or false, not a whole number",
                          "c.toml:5:1: error: unknown key 'rapidd' in [motion]; did you mean 'rapid'?"));
}

TEST_F(ControllerFile, RefusesPlaceholdersWithoutMeaning) {
  EXPECT_THAT(
      errors_of(std::string(kHead) + "[dwell]\nwords = \"G4 P{second}\"\n[stop]\nprogram = \"M{tool}\"\n"),
      ElementsAre("c.toml:5:1: error: 'words': unknown placeholder {second}",
                  "c.toml:7:1: error: 'program': {tool} has no meaning here"));
}

TEST_F(ControllerFile, RefusesTemplatesThatTheReaderCouldNotTellApart) {
  EXPECT_THAT(errors_of(std::string(kHead) + "[coolant]\nmist = \"M08\"\n"),
              ElementsAre(HasSubstr("error: '[coolant] mist' and '[coolant] flood' have the same words")));
}

// The reference point as a shop's control may want it: incremental, which may not stay in force.
TEST_F(ControllerFile, TakesTheReferencePointAsARetract) {
  std::ofstream(folder_ / "c.toml") << kHead << "[retract]\nZ = [\"G91 G28 Z0.\", \"G90\"]\n";
  Diagnostics diagnostics;
  const auto c = nc::load_controller((folder_ / "c.toml").string(), diagnostics);
  ASSERT_TRUE(c);
  EXPECT_FALSE(c->names_position(nc::AxisLetter::Z));
  const std::string text = test::nc_text(*c, {nc::ProgramStart{}, nc::Retract{}, nc::ProgramEnd{}});
  EXPECT_THAT(text, HasSubstr("N20 G91 G28 Z0.\nN30 G90\n"));
  const auto blocks = test::nc_blocks(*c, text);
  ASSERT_EQ(blocks.size(), 3U);
  EXPECT_TRUE(nc::same(blocks[1], nc::Block{nc::Retract{}}));
  EXPECT_THROW(test::nc_blocks(*c, "G91\nG28 Z0.\nM30\n"), std::runtime_error);

  const std::string retract = std::string(kHead) + "[retract]\n";
  EXPECT_THAT(
      errors_of(retract + "Z = \"G91 G28 Z0.\"\n"),
      ElementsAre(HasSubstr("c.toml: error: '[retract] Z': G91 stays in force after it: a line G90 must")));
  EXPECT_THAT(errors_of(retract + "Z = [\"G91\", \"G28 Z0.\", \"G90\"]\n"),
              ElementsAre(HasSubstr("'[retract] Z': 'G91' must stand in the line that names the axis")));
  EXPECT_THAT(errors_of(retract + "Z = \"G30 P2\"\n"),
              ElementsAre(HasSubstr("'[retract] Z' must name the axis in one of its lines; it does in 0")));
}

TEST_F(ControllerFile, RefusesACircleOfBases) {
  std::ofstream(folder_ / "d.toml") << "[controller]\nname = \"D\"\nbase = \"c\"\n";
  EXPECT_THAT(errors_of("[controller]\nname = \"C\"\nbase = \"d\"\n").front(),
              HasSubstr("more than 8 bases"));
}

TEST_F(ControllerFile, IsFoundByNameOrPath) {
  EXPECT_EQ(nc::find_controller("iso", folder_.string()).value(), (folder_ / "iso.toml").string());
  EXPECT_EQ(nc::find_controller("/somewhere/x.toml", folder_.string()).value(), "/somewhere/x.toml");
  const auto missing = nc::find_controller("okuma", folder_.string());
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::io_failed);
  EXPECT_THAT(missing.error().message, HasSubstr("no controller 'okuma' in"));
  EXPECT_THAT(missing.error().message, HasSubstr("there are: iso"));
}

}  // namespace
}  // namespace trunnion
