// What a shop's controller file means otherwise than the file that it stands on.
#include <fstream>
#include <gtest/gtest.h>

#include "support/controllers.hpp"
#include "support/folder_test.hpp"

namespace trunnion {
namespace {

class BaseDifferences : public test::FolderTest {
 protected:
  std::string warnings(const std::string& keys, const std::string& base = "fanuc_30i",
                       const std::string& head = "") const {
    std::ofstream(folder_ / "c.toml")
        << "[controller]\nname = \"C\"\nbase = \"" + base + "\"\n" + head + keys;
    Diagnostics diagnostics;
    EXPECT_TRUE(nc::load_controller((folder_ / "c.toml").string(), diagnostics, test::controller_folder()))
        << (diagnostics.has_errors() ? diagnostics.first_error().text() : "");
    std::string out;
    for (const Finding& f : diagnostics.findings()) out += f.text() + "\n";
    return out;
  }
};

TEST_F(BaseDifferences, FilesThatShipHaveNone) {
  for (const std::string& name : test::shipped_controllers()) {
    Diagnostics diagnostics;
    ASSERT_TRUE(nc::load_controller(test::controller_folder() + "/" + name + ".toml", diagnostics));
    EXPECT_TRUE(diagnostics.findings().empty()) << name << ": " << diagnostics.findings().front().text();
  }
}

TEST_F(BaseDifferences, AFileThatRepeatsOrAddsHasNone) {
  EXPECT_EQ(warnings("[spindle]\nclockwise = \"M3 S{rpm}\"\noff = \"M5\"\n[coolant]\nair = \"M51\"\n"), "");
  EXPECT_EQ(warnings("[program]\nsetup = [\"G90 G94 G17\", \"G21 G40 G49 G80\"]\n"), "");
}

// Each breaks a tool or a part, and a program made with it passes its own verification.
TEST_F(BaseDifferences, EachSlipIsSaid) {
  const std::vector<std::pair<std::string, std::string>> slips = {
      {"[spindle]\nclockwise = \"S{rpm} M4\"\ncounterclockwise = \"S{rpm} M3\"\n",
       "'M4' is [spindle] clockwise"},
      {"[spindle]\nclockwise = \"M4 S{rpm}\"\ncounterclockwise = \"M3 S{rpm}\"\n",
       "'M4' is [spindle] clockwise"},
      {"[coolant]\nflood = \"M9\"\noff = \"M8\"\n", "'M8' is [coolant] off"},
      {"[length]\non = \"G44 H{length_offset}\"\n", "'G44' is [length] on here"},
      {"[motion]\nrapid = \"G1\"\nlinear = \"G0\"\n", "'G1' is [motion] rapid here"},
      {"[tool]\nchange = \"T{tool}\"\n", "[tool] change leaves out 'M6'"},
      {"[program]\nsetup = [\"G17 G21 G40 G80 G90 G94\"]\n", "setup leaves out 'G49'"},
      {"[arcs]\nclockwise = \"G3 X{x} Y{y} I{i} J{j}\"\ncounterclockwise = \"G2 X{x} Y{y} I{i} J{j}\"\n",
       "'G3' is [arcs] clockwise here"},
      {"[arcs]\ncenter = \"absolute\"\n", "[arcs] center is absolute here"},
      {"[dwell]\nwords = \"G4 P{seconds}\"\n", "the value behind 'G4 P' is {seconds} here"},
      {"[cycles]\ndrill = \"G81 X{x} Y{y} Z{depth} R{clear} F{feed}\"\n",
       "the value behind 'G81 Z' is {depth}"},
      {"[numbers]\ndecimal_point_required = false\n", "decimal_point_required is false here"},
      {"[work_offset]\nwords = [\"G55\", \"G54\"]\n", "'G54' is"}};
  for (const auto& [keys, said] : slips)
    EXPECT_NE(warnings(keys).find(said), std::string::npos) << warnings(keys);
}

TEST_F(BaseDifferences, WhatIsMeantIsNotSaid) {
  const std::string keys = "[coolant]\nflood = \"M7\"\nmist = \"M8\"\n";
  EXPECT_NE(warnings(keys), "");
  EXPECT_EQ(warnings(keys, "fanuc_30i", "differs_in = [\"M7\", \"M8\"]\n"), "");
  EXPECT_EQ(warnings("[dwell]\nwords = \"G4 P{seconds}\"\n", "fanuc_30i", "differs_in = [\"G4 P\"]\n"), "");
}

}  // namespace
}  // namespace trunnion
