// Random paths on every machine and every control: what the program asks of the axes, read back from its
// words by formulas of the tests' own.
#include <array>
#include <gtest/gtest.h>
#include <iostream>
#include <random>

#include "trunnion/base/units.hpp"

#include "post/axis_speeds.hpp"
#include "post/posting.hpp"
#include "support/cases.hpp"

namespace trunnion::post {
namespace {

struct RandomPost {
  Machine machine;
  std::string cl;
  PostOptions options;
};

// Speeds of a small machine, travel of the rotary axes that most of the paths fit into, a path that crosses
// the pole or keeps away from it, at a feed that the axes follow or do not.
RandomPost random_post(const std::string& name, std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  RandomPost out{test::shipped_machine(name), {}, {}};
  for (Axis& axis : out.machine.axes) {
    if (axis.kind == AxisKind::linear) {
      axis.min = -900.0;
      axis.max = 1500.0;
      axis.max_feed = 20.0 + 300.0 * u(random);
    } else {
      axis.max_feed = 0.1 + 3.0 * u(random);
    }
  }
  Axis& inner = out.machine.axes[out.machine.rotary_axes()[1]];
  if (u(random) < 0.5) {
    inner.cyclic = false;
    inner.min = -(3.3 + 3.0 * u(random));
    inner.max = 3.3 + 3.0 * u(random);
  }
  constexpr std::array kFeeds = {FeedOutput::inverse, FeedOutput::per_minute};
  out.options.feed = kFeeds[random() % kFeeds.size()];
  const double radius = 10.0 + 50.0 * u(random);
  const double least = 0.7 * u(random) * u(random);
  const double most = least + 0.2 * u(random);
  const double turns = 0.02 + 0.4 * u(random);
  const double start = kTwoPi * u(random);
  out.cl = "FEDRAT/MMPM," + fixed_text(100.0 + 8000.0 * u(random), 1) + "\nRAPID\n";
  for (int k = 0; k < 40; ++k) {
    if (k == 20) out.cl += "RAPID\n";
    const double turn = start + turns * k;
    const double tilt = least + (most - least) * (0.5 + 0.5 * std::sin(0.3 * k));
    out.cl += test::point_text(Vec3(radius * std::cos(turn), radius * std::sin(turn), 0.5 * k),
                               test::tilted(tilt, turn * (least < 0.2 ? 0.5 : 1.0)));
  }
  return out;
}

// Position of the axis that a word means: the joint itself of a rotary axis; of a linear one, words are the
// tool tip's place (or the spindle's) from the work offset on, and the axis carries the tool along its
// direction.
double joint_of(const Machine& machine, const Axis& axis, double word) {
  if (axis.kind == AxisKind::rotary) return word;
  const Vec3 tool = machine.output_point == OutputPoint::tip ? machine.tool_vector() : Vec3::Zero();
  Eigen::Index along = 0;
  axis.direction.cwiseAbs().maxCoeff(&along);
  return (word + machine.work_offset_mm[along] - tool[along]) * axis.direction[along];
}

// How far any word of a move is beyond the travel of its axis.
double beyond_travel(const Machine& machine, const nc::Controller& c, const std::string& text) {
  double worst = 0.0;
  for (const nc::Block& block : test::nc_blocks(c, text)) {
    const auto* motion = std::get_if<nc::Motion>(&block);
    if (motion == nullptr) continue;
    for (const Axis& axis : machine.axes) {
      const nc::AxisLetter letter = *nc::axis_letter(axis.name);
      if (!motion->words.has(letter) || axis.cyclic) continue;
      const double q = joint_of(machine, axis, c.numbers.axes.internal(letter, motion->words[letter]));
      worst = std::max({worst, axis.min - q, q - axis.max});
    }
  }
  return worst;
}

void random_posts(int each) {
  std::mt19937_64 random(71);
  std::size_t programs = 0;
  std::size_t refused = 0;
  std::size_t limited = 0;
  for (const std::string& name : test::shipped_machines()) {
    for (const std::string& control : test::shipped_controllers()) {
      const nc::Controller shipped = test::shipped_controller(control);
      for (int i = 0; i < each; ++i) {
        const RandomPost job = random_post(name, random);
        const auto p = test::posted(job.cl, job.machine, job.options, control);
        SCOPED_TRACE(name + " " + control + " " + std::to_string(i));
        if (!p.report) {
          ++refused;
          const std::string text = p.report.error().text();
          const bool named = text.find("beyond its limits") != std::string::npos ||
                             text.find("miss it by") != std::string::npos;
          const bool no_way_out =
              shipped.retract[2].empty() && text.find("no safe position") != std::string::npos;
          EXPECT_TRUE(named || no_way_out) << text;
          continue;
        }
        ++programs;
        const nc::Controller c = with_axes_of(job.machine, shipped);
        EXPECT_TRUE(p.report->verification->passed());
        const auto speeds = test::speeds_of(job.machine, c, p.nc);
        EXPECT_GT(speeds.blocks, 30U);
        EXPECT_LE(speeds.worst_ratio, 1.0 + 1e-9);
        limited += speeds.worst_ratio > 0.98;
        EXPECT_LE(beyond_travel(job.machine, c, p.nc), 1e-9);
      }
    }
  }
  std::cout << programs << " programs, " << limited << " at the speed of an axis, " << refused
            << " refused by their travel\n";
  EXPECT_GT(programs, 10 * refused);
  EXPECT_GT(limited, programs / 4);
}

TEST(EveryMachine, RandomPathsOnEveryControlKeepTravelAndSpeed) {
  random_posts(test::cases(10));
}

TEST(LongEveryMachine, RandomPathsOnEveryControlKeepTravelAndSpeed) {
  random_posts(100);
}

}  // namespace
}  // namespace trunnion::post
