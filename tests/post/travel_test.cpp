// What a shop sees of the choice of solutions: travel, turns while cutting, rewinds; all read off the NC
// text.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"

#include "post/posting.hpp"
#include "support/folders.hpp"

namespace trunnion::post {
namespace {

using path::ChoiceMethod;
using test::posted;
using test::verified;

Machine roomy(const std::string& name) {
  Machine machine = test::shipped_machine(name);
  for (Axis& axis : machine.axes) {
    if (axis.kind != AxisKind::linear) continue;
    axis.min = -50000.0;
    axis.max = 50000.0;
  }
  machine.safe.to_mm[2] = 50000.0;  // the end of the travel
  return machine;
}

// Sums over the motion blocks of a program, from its first CL point on.
struct Travel {
  std::array<double, kMaxAxes> way{};  // mm, rad
  double axis_time_s = 0.0;            // sum over the axes of way / rapid rate
  double largest_cut_turn_rad = 0.0;   // of C between two CL points while cutting
  std::size_t over_half_turn = 0;
};

Travel travel_of(const Machine& machine, const VerifyReport& report) {
  Travel out;
  const AxisId c = *machine.axis("C");
  double turned = 0.0;
  const VerifiedBlock* before = nullptr;
  for (const VerifiedBlock& block : report.blocks) {
    if (before != nullptr) {
      for (AxisId id = 0; id < machine.axes.size(); ++id) {
        const double way = std::abs(block.q[id] - before->q[id]);
        out.way[id] += way;
        out.axis_time_s += way / *machine.axes[id].rapid;
      }
      turned = block.rapid ? 0.0 : turned + std::abs(block.q[c] - before->q[c]);
      out.largest_cut_turn_rad = std::max(out.largest_cut_turn_rad, turned);
      if (turned > kPi * (1.0 + 1e-9) && block.programmed) ++out.over_half_turn;
      if (block.programmed) turned = 0.0;
    }
    before = &block;
  }
  return out;
}

struct Row {
  std::string name;
  Travel travel;
  PostReport report;
};

void print_table(const std::string& title, const Machine& machine, const std::vector<Row>& rows) {
  std::string out = title + "\n  choice        axis time s";
  for (const Axis& axis : machine.axes)
    out += std::string(9, ' ') + axis.name + (axis.kind == AxisKind::rotary ? " deg" : "  mm");
  out += "   branch changes  leaves part  largest C turn while cutting deg\n";
  const auto right = [](const std::string& text, std::size_t width) {
    return std::string(width > text.size() ? width - text.size() : 1, ' ') + text;
  };
  for (const Row& row : rows) {
    out += "  " + row.name + right(fixed_text(row.travel.axis_time_s, 3), 25 - row.name.size());
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      const bool rotary = machine.axes[id].kind == AxisKind::rotary;
      out += right(fixed_text(row.travel.way[id] * (rotary ? kDegreePerRad : 1.0), 2), 14);
    }
    out += right(std::to_string(row.report.choice.branch_changes), 17) +
           right(std::to_string(row.report.choice.reconfigurations), 13) +
           right(fixed_text(row.travel.largest_cut_turn_rad * kDegreePerRad, 2), 20) + "\n";
  }
  std::printf("%s", out.c_str());
}

void compare_choices(const std::string& title, const std::string& cl, const Machine& machine) {
  const std::vector<std::pair<std::string, ChoiceMethod>> methods = {{"global", ChoiceMethod::global},
                                                                     {"combined", ChoiceMethod::combined},
                                                                     {"largest", ChoiceMethod::largest},
                                                                     {"sum", ChoiceMethod::sum},
                                                                     {"axis:C", ChoiceMethod::axis}};
  std::vector<Row> rows;
  for (const auto& [name, method] : methods) {
    PostOptions options;
    options.choice = method;
    options.collect = true;
    auto p = posted(cl, machine, options);
    // A local choice may end where no path goes on within the tolerance; the global one may not.
    ASSERT_TRUE(p.report) << title << " " << name << ": " << p.report.error().text();
    if (method == ChoiceMethod::global) {
      EXPECT_TRUE(p.report->verification->passed()) << title;
      EXPECT_TRUE(p.report->verification->limits_ok()) << title;
    }
    const Travel travel = travel_of(machine, *p.report->verification);
    p.report->verification->blocks.clear();
    rows.push_back({name, travel, *p.report});
  }
  print_table(title + ", " + machine.name, machine, rows);
  for (const Row& row : rows) {
    EXPECT_LE(rows[0].travel.axis_time_s, row.travel.axis_time_s * (1.0 + 1e-6)) << title << " " << row.name;
  }
  // A turn of C by more than half a turn between two points of a cut is one that the report names.
  EXPECT_LE(rows[0].travel.over_half_turn,
            rows[0].report.choice.turns_in_place + rows[0].report.choice.reconfigurations)
      << title;
}

TEST(Travel, GlobalChoiceNeedsNoMoreThanAnyLocalOneOnTheImpellerSample) {
  const auto cl = read_file(test::source_folder() + "/samples/01_impeller/impeller.cls");
  ASSERT_TRUE(cl);
  for (const char* name : {"trunnion_offset", "paper"}) compare_choices("impeller sample", *cl, roomy(name));
}

TEST(Travel, GlobalChoiceNeedsNoMoreThanAnyLocalOneOnTheRealCreoPath) {
  const char* const folder = std::getenv("TRUNNION_REFERENCE_DATA");
  if (folder == nullptr) GTEST_SKIP() << "skipped: TRUNNION_REFERENCE_DATA is not set";
  const auto cl = read_file(std::string(folder) + "/cl/creo9_proclfile_5x_multax_cut.ncl");
  ASSERT_TRUE(cl);
  for (const char* name : {"trunnion_offset", "paper"}) compare_choices("Creo path", *cl, roomy(name));
}

// C with limits, and a path that goes round by 420 degrees; a rapid after `rapid_at` of its points
// (0: none).
Machine limited_machine() {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.axes[4].cyclic = false;
  machine.axes[4].min = -200.0 * kRadPerDegree;
  machine.axes[4].max = 200.0 * kRadPerDegree;
  machine.axes[3].min = 0.0;
  return machine;
}

std::string beyond_one_turn(int rapid_at) {
  std::string cl = "FEDRAT/MMPM,1000\nRAPID\n";
  for (int i = 0; i <= 140; ++i) {
    const double turn = i * 3.0 * kRadPerDegree;
    const auto point = [&](double height) {
      const Vec3 axis(std::sin(0.5) * std::cos(turn), std::sin(0.5) * std::sin(turn), std::cos(0.5));
      const Vec3 tip = Vec3(30 * std::cos(turn), 30 * std::sin(turn), 0.0) + height * axis;
      cl += "GOTO/" + fixed_text(tip.x(), 5) + "," + fixed_text(tip.y(), 5) + "," + fixed_text(tip.z(), 5) +
            "," + fixed_text(axis.x(), 8) + "," + fixed_text(axis.y(), 8) + "," + fixed_text(axis.z(), 8) +
            "\n";
    };
    point(0.0);
    if (i == rapid_at && i > 0) {
      cl += "RAPID\n";
      point(5.0);
    }
  }
  return cl;
}

// A block of the text with all of its joints: where the safe position of the controller file is left out of
// the words, Z stands at the end of its travel.
struct Pose5 {
  JointVector q;
  bool rapid = false;
};
std::vector<Pose5> poses_of(const Machine& machine, const std::string& text) {
  const nc::Controller c = test::shipped_controller("linuxcnc");
  std::vector<Pose5> out;
  bool up = false;
  JointVector words = words_of(machine, JointVector{}, machine.tool_vector());
  for (const nc::Block& block : test::nc_blocks(c, text)) {
    if (const auto* retract = std::get_if<nc::Retract>(&block)) {
      up = true;
      if (!out.empty()) {
        Pose5 pose = out.back();
        pose.q[*machine.axis("Z")] = machine.axes[*machine.axis("Z")].max;
        pose.rapid = true;
        out.push_back(pose);
      }
      (void)retract;
    }
    const auto* motion = std::get_if<nc::Motion>(&block);
    if (motion == nullptr) continue;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      const nc::AxisLetter letter = *nc::axis_letter(machine.axes[id].name);
      if (motion->words.has(letter)) words[id] = c.numbers.axes.internal(letter, motion->words[letter]);
    }
    if (motion->words.has(nc::AxisLetter::Z)) up = false;
    Pose5 pose{joints_of_words(machine, words, machine.tool_vector()), motion->kind == nc::MotionKind::rapid};
    if (up) pose.q[*machine.axis("Z")] = machine.axes[*machine.axis("Z")].max;
    out.push_back(pose);
  }
  return out;
}

// Wherever C turns back by more than half a turn, and on the way there and back from where the tool left the
// path: the tip stays on the tool's side of the plane through that point, across the tool axis.
void expect_no_dive(const Machine& machine, const std::string& text, std::size_t rewinds) {
  const auto poses = poses_of(machine, text);
  const AxisId c = *machine.axis("C");
  std::size_t found = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (std::abs(poses[i].q[c] - poses[i - 1].q[c]) < kPi) continue;
    if (i < 4) continue;  // the first positioning: there is no path yet
    ++found;
    // Back to where it left: the last feed block before; on to the first feed block behind.
    std::size_t first = i - 1;
    while (first > 0 && poses[first].rapid) --first;
    // The feed block out along the tool axis began a block earlier.
    if (first > 0 && tool_pose(forward(machine, poses[first].q)).tip_P.norm() > 0.0) {
      const ToolPose here = tool_pose(forward(machine, poses[first].q));
      const ToolPose earlier = tool_pose(forward(machine, poses[first - 1].q));
      const Vec3 way = here.tip_P - earlier.tip_P;
      if (way.norm() > 1.0 && way.dot(here.axis_P) > 0.999 * way.norm()) --first;
    }
    std::size_t last = i;
    while (last + 1 < poses.size() && poses[last].rapid) ++last;
    const ToolPose left = tool_pose(forward(machine, poses[first].q));
    const ToolPose back = tool_pose(forward(machine, poses[last].q));
    const double arrival = (back.tip_P - left.tip_P).dot(left.axis_P);
    double lowest = 1e9;
    for (std::size_t k = first; k < last; ++k) {
      for (int s = 0; s <= 64; ++s) {
        const JointVector q = JointVector::interpolate(poses[k].q, poses[k + 1].q, s / 64.0);
        const Vec3 tip_P = tool_pose(forward(machine, q)).tip_P;
        lowest = std::min(lowest, (tip_P - left.tip_P).dot(left.axis_P) - std::min(0.0, arrival));
        // While C turns, far from the part.
        if (std::abs(poses[k + 1].q[c] - poses[k].q[c]) > kPi) {
          EXPECT_GT((tip_P - left.tip_P).norm(), 45.0);
        }
      }
    }
    EXPECT_GT(lowest, -0.01) << "rewind at block " << i;
  }
  EXPECT_EQ(found, rewinds);
}

TEST(Rewind, TakesPlaceAtARapidWhenOneIsThere) {
  const Machine machine = limited_machine();
  const std::string cl = beyond_one_turn(30);
  const auto p = posted(cl, machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_EQ(p.report->choice.reconfigurations, 0U);
  EXPECT_EQ(p.report->rewinds_at_rapids, 1U);
  EXPECT_TRUE(p.report->verification->passed()) << p.report->verification->points_missed;
  expect_no_dive(machine, p.nc, 1);
}

TEST(Rewind, RetractsTurnsAndReengagesWhereThereIsNone) {
  const Machine machine = limited_machine();
  const auto p = posted(beyond_one_turn(0), machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_EQ(p.report->choice.reconfigurations, 1U);
  EXPECT_EQ(p.report->rewinds_at_rapids, 0U);
  EXPECT_TRUE(p.report->verification->passed());
  EXPECT_TRUE(p.report->verification->limits_ok());
  expect_no_dive(machine, p.nc, 1);
  EXPECT_FALSE(p.diagnostics.findings().empty());
}

}  // namespace
}  // namespace trunnion::post
