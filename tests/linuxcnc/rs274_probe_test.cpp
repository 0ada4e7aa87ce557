// LinuxCNC's own interpreter runs a probing program: every touch with our coordinates, no message, the file
// of touches made.
#include <cmath>
#include <fstream>
#include <gtest/gtest.h>

#include "trunnion/machine/kinematics.hpp"
#include "trunnion/probe/strokes.hpp"

#include "linuxcnc/interpreter.hpp"
#include "probe/given.hpp"

namespace trunnion {
namespace {

// The places after STRAIGHT_PROBE( of the interpreter's calls.
std::vector<std::array<double, 6>> probes_of(const std::string& program) {
  const test::Folder folder;
  std::ofstream(folder.path / "p.ngc") << program;
  std::ofstream(folder.path / "tool.tbl") << "T99 P1 Z0\n";
  const std::string command =
      "cd " + folder.path.string() +
      " && HOME=$PWD timeout 120 rs274 -g -n 2 -t tool.tbl -v new.var p.ngc out.txt > log.txt 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << read_file((folder.path / "log.txt").string()).value_or("");
  std::vector<std::array<double, 6>> out;
  std::istringstream lines(read_file((folder.path / "out.txt").string()).value_or(""));
  for (std::string line; std::getline(lines, line);) {
    const auto at = line.find("STRAIGHT_PROBE(");
    if (at == std::string::npos) continue;
    std::string numbers = line.substr(at + 15);
    std::replace_if(
        numbers.begin(), numbers.end(), [](char c) { return c == ',' || c == ')'; }, ' ');
    std::istringstream values(numbers);
    std::array<double, 6> one{};
    for (double& v : one) values >> v;
    out.push_back(one);
  }
  return out;
}

TEST(Rs274Probe, RunsAProbingProgramAsItIsRead) {
  if (!test::has_interpreter()) GTEST_SKIP() << "rs274 is not installed";
  const test::Given given("trunnion_offset");
  const auto program = probe::make_program(given.machine, given.control, given.options());
  ASSERT_TRUE(program) << program.error().text();
  const auto run = test::interpret(program->text);
  EXPECT_EQ(run.exit_code, 0) << run.messages;
  Diagnostics diagnostics;
  const auto strokes = probe::read_strokes(given.machine, given.control, program->text, "p.nc", diagnostics);
  ASSERT_TRUE(strokes);
  const auto probes = probes_of(program->text);
  ASSERT_EQ(probes.size(), strokes->touches.size());
  for (std::size_t i = 0; i < probes.size(); ++i) {
    const JointVector words =
        words_of(given.machine, strokes->touches[i].to, {0, 0, -given.machine.tool_length_mm});
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(probes[i][k], words[k], 1e-4) << i;
    EXPECT_NEAR(probes[i][3], words[3] * kDegreePerRad, 1e-4) << i;
    EXPECT_NEAR(probes[i][5], words[4] * kDegreePerRad, 1e-4) << i;
  }
}

}  // namespace
}  // namespace trunnion
