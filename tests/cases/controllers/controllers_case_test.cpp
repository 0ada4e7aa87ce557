// One part posted for every controller file that ships. The programs in expected/ show what a change of the
// writer or of a controller file does to them (TRUNNION_UPDATE_GOLDEN=1 writes them again); whether they are
// right is checked apart from that: each program, as the reader understands it, brings the tip to every point
// of the CL file, in order, within one digit.
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <gtest/gtest.h>
#include <sstream>

#include "trunnion/base/files.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/post/axes_of.hpp"
#include "trunnion/post/post.hpp"

#include "support/controllers.hpp"
#include "support/machines.hpp"

namespace trunnion {
namespace {

class Text final : public cl::TextSource {
 public:
  explicit Text(std::string text) : text_(std::move(text)) {}
  Result<std::size_t> read(char* buffer, std::size_t capacity) override {
    const std::size_t n = std::min(capacity, text_.size() - at_);
    std::memcpy(buffer, text_.data() + at_, n);
    at_ += n;
    return n;
  }

 private:
  std::string text_;
  std::size_t at_ = 0;
};

std::string part() {
  return read_file(std::string(CASE_DIR) + "/part.cls").value();
}

struct Posted {
  std::string text;
  post::PostReport report;
};

Posted posted(const Machine& machine, const nc::Controller& controller) {
  post::PostJob job;
  job.cl_file = "part.cls";
  job.machine = &machine;
  job.controller = &controller;
  job.header = {"part.cls on " + machine.name + " for " + controller.name};
  post::PostOptions options;
  options.tolerance_mm = 0.01;
  Posted out;
  Diagnostics diagnostics;
  auto report = post::post(
      std::make_unique<Text>(part()), job, options,
      [&](std::string_view piece) {
        out.text += piece;
        return Result<void>{};
      },
      diagnostics);
  if (!report) throw std::runtime_error(report.error().text());
  out.report = *report;
  return out;
}

// Points of the CL file, read without the CL layer: this must not go through the code under test.
std::vector<Vec3> cl_points() {
  std::vector<Vec3> out;
  std::istringstream lines(part());
  for (std::string line; std::getline(lines, line);) {
    Vec3 p;
    if (std::sscanf(line.c_str(), "GOTO/%lf,%lf,%lf", &p.x(), &p.y(), &p.z()) == 3) out.push_back(p);
  }
  return out;
}

// The tip in the part at the end of every block whose axes are all known.
std::vector<Vec3> tip_path(const Machine& machine, const nc::Controller& controller,
                           const std::string& text) {
  std::vector<Vec3> out;
  for (const auto& block : test::nc_blocks(controller, text)) {
    const auto* motion = std::get_if<nc::Motion>(&block);
    if (motion == nullptr) continue;
    JointVector words;
    bool known = true;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      const auto letter = *nc::axis_letter(machine.axes[id].name);
      known = known && motion->words.has(letter);
      if (known) words[id] = controller.numbers.axes.internal(letter, motion->words[letter]);
    }
    if (!known) continue;
    out.push_back(tool_pose(forward(machine, joints_of_words(machine, words, machine.tool_vector()))).tip_P);
  }
  return out;
}

void expect_every_point(const Machine& machine, const nc::Controller& controller, const std::string& text) {
  const auto tips = tip_path(machine, controller, text);
  const double digit = controller.numbers.axes.quantum(nc::AxisLetter::X);
  std::size_t at = 0;
  std::size_t met = 0;
  for (const Vec3& point : cl_points()) {
    while (at < tips.size() && (tips[at] - point).norm() > digit) ++at;
    ASSERT_LT(at, tips.size()) << "point " << met << " of the CL file is not met";
    ++met;
  }
  EXPECT_EQ(met, 30U);
}

std::string folder_file(const std::string& name) {
  return std::string(CASE_DIR) + "/expected/" + name + ".nc";
}

// As it is set up on the machine of these programs.
nc::Controller control_of(const std::string& name) {
  return post::with_axes_of(test::shipped_machine("trunnion_offset"), test::shipped_controller(name));
}

class EveryControl : public ::testing::TestWithParam<std::string> {};

std::string file_name(const ::testing::TestParamInfo<std::string>& tested) {
  return tested.param;
}

TEST_P(EveryControl, IsPostedWithinToleranceAndMeetsEveryPoint) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto controller = control_of(GetParam());
  const Posted p = posted(machine, controller);
  ASSERT_TRUE(p.report.verification);
  EXPECT_TRUE(p.report.verification->passed());
  expect_every_point(machine, controller, p.text);
  if (std::getenv("TRUNNION_UPDATE_GOLDEN") != nullptr) {
    ASSERT_TRUE(write_file(folder_file(GetParam()), p.text));
  }
}

TEST_P(EveryControl, ProgramInTheFolderMeetsEveryPoint) {
  const auto text = read_file(folder_file(GetParam()));
  ASSERT_TRUE(text);
  expect_every_point(test::shipped_machine("trunnion_offset"), control_of(GetParam()), *text);
}

// The blocks that the reader finds in the program in the folder are written again as exactly that program.
TEST_P(EveryControl, ProgramInTheFolderIsWhatTheWriterWrites) {
  const auto controller = control_of(GetParam());
  const auto text = read_file(folder_file(GetParam()));
  ASSERT_TRUE(text);
  EXPECT_EQ(test::nc_text(controller, test::nc_blocks(controller, *text)), *text);
}

INSTANTIATE_TEST_SUITE_P(Shipped, EveryControl, ::testing::ValuesIn(test::shipped_controllers()), file_name);

}  // namespace
}  // namespace trunnion
