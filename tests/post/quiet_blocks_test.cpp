// Blocks whose cheap bound says that they change no figure are not evaluated further. Beside a verification
// that evaluates every block (it keeps them all): the same verdict, the same points, and figures between what
// was found on the path and what was proved for every block.
#include <algorithm>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/base/number_text.hpp"

#include "post/judging/path_follower.hpp"
#include "post/posting.hpp"
#include "support/cases.hpp"
#include "support/lanes.hpp"

namespace trunnion::post {
namespace {

// Blocks are looked at together only where so many points are known ahead at the first of them.
constexpr std::size_t kEnough = kLookAhead + 100;
constexpr double kQuietTolerance_mm = 0.004;
constexpr double kQuietFlute_mm = 40.0;

Model standing_errors(const Machine& machine) {
  Diagnostics d;
  const auto model = parse_model(
      "[model]\nname = \"m\"\n"
      "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 12.0\nY0C_um = -9.0\nA0C_urad = 30.0\n"
      "[[effect]]\nid = \"component:EXX\"\n[effect.parameters]\nP1_um = 8.0\nP3_um = -5.0\n"
      "[[effect]]\nid = \"component:EAC\"\n[effect.parameters]\ncos1_urad = 25.0\nsin2_urad = -15.0\n",
      "m.toml", machine, {}, d);
  if (!model) throw std::runtime_error(model.error().text());
  return *model;
}

void expect_same_figures(const std::string& nc, const std::string& cl, const Machine& machine,
                         VerifyOptions options, const std::string& what) {
  const nc::Controller c = test::shipped_controller("linuxcnc");
  const auto verify_with = [&](bool collect) {
    Diagnostics d;
    options.collect = collect;
    auto report = verify({std::make_unique<test::TextOf>(cl), "part.cls"},
                         {std::make_unique<test::TextOf>(nc), "part.nc"}, {machine, c, options}, d);
    if (!report) throw std::runtime_error(report.error().text());
    return *report;
  };
  const VerifyReport quiet = verify_with(false);
  const VerifyReport every = verify_with(true);
  constexpr double kRounding = 1e-9;
  EXPECT_EQ(quiet.passed(), every.passed()) << what;
  EXPECT_EQ(quiet.points_missed, every.points_missed) << what;
  EXPECT_EQ(quiet.certified, every.certified) << what;
  EXPECT_NEAR(quiet.max_point_deviation_mm, every.max_point_deviation_mm, 1e-6) << what;
  EXPECT_NEAR(quiet.max_speed_ratio, every.max_speed_ratio, kRounding) << what;
  EXPECT_NEAR(quiet.duration_s, every.duration_s, kRounding * every.duration_s) << what;
  EXPECT_EQ(quiet.beyond_limits_count, every.beyond_limits_count) << what;
  // What was found on the path is not above what is proved, and that not above what is proved of every block.
  EXPECT_GE(quiet.certified_tip_deviation_mm, every.max_tip_deviation_mm - kRounding) << what;
  EXPECT_LE(quiet.certified_tip_deviation_mm, every.certified_tip_deviation_mm + kRounding) << what;
  EXPECT_GE(1.06 * quiet.max_axis_deviation.rad(), every.max_axis_deviation.rad()) << what;
  EXPECT_LE(quiet.max_axis_deviation.rad(), every.max_axis_deviation.rad() + kRounding) << what;
  if (every.passed()) {  // else a tip that leads far has places that do not run evenly
    const double at_tip = every.max_axis_deviation_at_tip.rad();
    constexpr double kBound_rad = 1e-5;                         // what a bound may be above the figure
    const double enough = 1e-3 * options.axis_tolerance.rad();  // as sharp as that it is told
    EXPECT_GE(1.06 * quiet.max_axis_deviation_at_tip.rad() + enough, at_tip) << what;
    EXPECT_LE(quiet.max_axis_deviation_at_tip.rad(), 1.06 * at_tip + kBound_rad) << what;
  }
  EXPECT_GE(quiet.certified_flute_deviation_mm, every.max_flute_deviation_mm - kRounding) << what;
  EXPECT_LE(quiet.certified_flute_deviation_mm, 1.06 * every.certified_flute_deviation_mm + kRounding)
      << what;
  ASSERT_EQ(quiet.worst.size(), every.worst.size()) << what;
  for (std::size_t i = 0; i < quiet.worst.size(); ++i) {
    EXPECT_LE(quiet.worst[i].tip_mm, every.worst[i].tip_mm + kRounding) << what;
    EXPECT_GE(1.06 * quiet.worst[i].tip_mm + kRounding, every.worst[i].tip_mm) << what;
  }
}

class QuietBlocks : public testing::TestWithParam<std::string> {};

using LongQuietBlocks = QuietBlocks;

TEST_P(LongQuietBlocks, ChangeNoFigure) {
  const Machine machine = test::shipped_machine(GetParam());
  const Model model = standing_errors(machine);
  const ModelEvaluator truth(model);
  std::mt19937_64 random(21);
  for (int i = 0; i < test::cases(8); ++i) {
    const std::string cl =
        test::sample_path(static_cast<unsigned>(40 + i % 4), static_cast<int>(kEnough) + 300 * (i % 2));
    PostOptions options;
    options.tolerance_mm = kQuietTolerance_mm;
    options.nonlinear.thin = i % 4 == 3;  // CL points in the middle of blocks
    if (i % 8 >= 4) options.tools.flute_mm = kQuietFlute_mm;
    const test::Posted corrected = test::posted(cl, machine, options, "linuxcnc", &model);
    ASSERT_TRUE(corrected.report) << corrected.report.error().text();
    const test::Posted plain = test::posted(cl, machine, options);
    for (const double share : {0.0, 0.2, 0.7, 1.5, 6.0}) {
      for (const auto* nc : {&plain.nc, &corrected.nc}) {
        const std::string text =
            share == 0.0 ? *nc : test::with_changed_word(*nc, random, share * kQuietTolerance_mm);
        for (const ModelEvaluator* errors : {static_cast<const ModelEvaluator*>(nullptr), &truth}) {
          VerifyOptions v;
          v.tolerance_mm = kQuietTolerance_mm;
          v.truth = errors;
          v.tools = options.tools;
          // With one place in the list a single wrong word makes all that comes behind it quiet.
          v.worst_count = share > 1.0 ? 1 : 10;
          expect_same_figures(text, cl, machine, v,
                              GetParam() + " " + std::to_string(i) + " " + std::to_string(share) +
                                  (nc == &plain.nc ? " plain" : " corrected") +
                                  (errors == nullptr ? " nominal" : " with errors"));
        }
      }
    }
  }
}

// Two that read the same text say what each says alone.
void expect_follower_as_alone(const Machine& machine, const std::string& cl) {
  const Model model = standing_errors(machine);
  PostOptions options;
  options.tolerance_mm = kQuietTolerance_mm;
  const test::Posted p = test::posted(cl, machine, options, "linuxcnc", &model);
  ASSERT_TRUE(p.report) << p.report.error().text();
  VerifyReport follower = *p.report->nominal_verification;
  const auto alone = test::verified(p.nc, cl, machine, kQuietTolerance_mm);
  ASSERT_TRUE(alone);
  EXPECT_EQ(follower.certified_tip_deviation_mm, alone->certified_tip_deviation_mm);
  EXPECT_EQ(follower.max_point_deviation_mm, alone->max_point_deviation_mm);
  EXPECT_EQ(follower.max_axis_deviation, alone->max_axis_deviation);
  EXPECT_EQ(follower.max_speed_ratio, alone->max_speed_ratio);
  EXPECT_EQ(follower.duration_s, alone->duration_s);
  EXPECT_EQ(follower.points_out, alone->points_out);
  EXPECT_EQ(follower.feed_blocks, alone->feed_blocks);
  EXPECT_EQ(follower.rapid_blocks, alone->rapid_blocks);
  EXPECT_EQ(follower.points_missed, alone->points_missed);
  ASSERT_EQ(follower.travel.size(), alone->travel.size());
  for (std::size_t i = 0; i < follower.travel.size(); ++i) {
    EXPECT_EQ(follower.travel[i].smallest, alone->travel[i].smallest);
    EXPECT_EQ(follower.travel[i].largest, alone->travel[i].largest);
  }
  ASSERT_EQ(follower.worst.size(), alone->worst.size());
  for (std::size_t i = 0; i < follower.worst.size(); ++i)
    EXPECT_EQ(follower.worst[i].tip_mm, alone->worst[i].tip_mm);
}

TEST_P(QuietBlocks, FollowerSaysWhatItSaysAlone) {
  expect_follower_as_alone(test::shipped_machine(GetParam()), test::sample_path(50, 900));
}

// Points that both have passed are forgotten on the way.
TEST_P(QuietBlocks, FollowerOfALongProgramSaysWhatItSaysAlone) {
  expect_follower_as_alone(test::shipped_machine(GetParam()), test::sample_path(51, 16000));
}

// As many as the processor takes at a time, or two: the same blocks go through, and every figure is the same.
TEST_P(QuietBlocks, SayTheSameTwoAtATime) {
  const Machine machine = test::shipped_machine(GetParam());
  const Model model = standing_errors(machine);
  const ModelEvaluator truth(model);
  std::mt19937_64 random(33);
  for (unsigned i = 0; i < 8; ++i) {
    const std::string cl = test::sample_path(60 + i / 2, static_cast<int>(kEnough) + 300);
    PostOptions options;
    options.tolerance_mm = kQuietTolerance_mm;
    options.tools.flute_mm = i % 2 == 0 ? 0.0 : kQuietFlute_mm;
    const test::Posted p = test::posted(cl, machine, options, "linuxcnc", i < 4 ? &model : nullptr);
    ASSERT_TRUE(p.report) << p.report.error().text();
    const std::string nc = i % 4 < 2 ? p.nc : test::with_changed_word(p.nc, random, kQuietTolerance_mm);
    for (const ModelEvaluator* errors : {static_cast<const ModelEvaluator*>(nullptr), &truth}) {
      const auto verify_with = [&](lanes::Way way) {
        Diagnostics d;
        VerifyOptions v;
        v.tolerance_mm = kQuietTolerance_mm;
        v.truth = errors;
        v.tools = options.tools;
        const test::Calculating lanes(way);
        auto report = verify({std::make_unique<test::TextOf>(cl), "part.cls"},
                             {std::make_unique<test::TextOf>(nc), "part.nc"},
                             {machine, test::shipped_controller("linuxcnc"), v}, d);
        if (!report) throw std::runtime_error(report.error().text());
        return *report;
      };
      const VerifyReport two = verify_with(lanes::Way::two);
      for (const lanes::Way way : {lanes::Way::four, lanes::Way::four_in_32}) {
        const VerifyReport four = verify_with(way);
        EXPECT_EQ(two.certified_tip_deviation_mm, four.certified_tip_deviation_mm);
        EXPECT_EQ(two.max_tip_deviation_mm, four.max_tip_deviation_mm);
        EXPECT_EQ(two.max_point_deviation_mm, four.max_point_deviation_mm);
        EXPECT_EQ(two.max_axis_deviation, four.max_axis_deviation);
        EXPECT_EQ(two.certified_flute_deviation_mm, four.certified_flute_deviation_mm);
        EXPECT_EQ(two.max_speed_ratio, four.max_speed_ratio);
        EXPECT_EQ(two.duration_s, four.duration_s);
        EXPECT_EQ(two.points_missed, four.points_missed);
        ASSERT_EQ(two.worst.size(), four.worst.size());
        for (std::size_t k = 0; k < two.worst.size(); ++k) {
          EXPECT_EQ(two.worst[k].tip_mm, four.worst[k].tip_mm);
          EXPECT_EQ(two.worst[k].nc_line, four.worst[k].nc_line);
        }
      }
    }
  }
}

std::string text_of(const std::vector<ToolPose>& path) {
  std::string out = "LOADTL/1,LENGTH,100\nFEDRAT/MMPM,1200\nRAPID\n";
  for (const ToolPose& p : path) {
    out += "GOTO/" + fixed_text(p.tip_P.x(), 5) + "," + fixed_text(p.tip_P.y(), 5) + "," +
           fixed_text(p.tip_P.z(), 5) + "," + fixed_text(p.axis_P.x(), 9) + "," +
           fixed_text(p.axis_P.y(), 9) + "," + fixed_text(p.axis_P.z(), 9) + "\n";
  }
  return out + "FINI\n";
}

// Whatever is known already, the next block adds to it: each cuts a corner of the path by more than the one
// before. `before_mm`: the tip was off by so much, but not where it passed the corners.
void expect_corners(const std::string& name, double before_mm) {
  const Machine machine = test::shipped_machine(name);
  constexpr int kCorners = static_cast<int>(kEnough) + 500;
  constexpr double kMost_mm = 0.0015;
  constexpr double kOfCircle_mm = 0.25 / 120.0;  // steps of 0.5 mm, radius 30 mm
  std::vector<ToolPose> path, way;
  for (int i = 0; i <= kCorners; ++i) {
    // Far enough apart that the tip tells the place, and all axes have words in every block.
    const double tilted = 0.6 + 1e-4 * i, turned = 2e-4 * i, around = i / 60.0;
    const double radius_mm = 30.0 + (i % 2 == 0 ? kMost_mm : -kMost_mm) * i / kCorners;
    path.push_back(
        {{radius_mm * std::cos(around), radius_mm * std::sin(around), 1e-3 * i},
         {std::sin(tilted) * std::cos(turned), std::sin(tilted) * std::sin(turned), std::cos(tilted)}});
  }
  way.push_back(path.front());
  for (std::size_t i = 1; i < path.size(); ++i)
    way.push_back(
        {0.5 * (path[i - 1].tip_P + path[i].tip_P), (path[i - 1].axis_P + path[i].axis_P).normalized()});
  way.push_back(path.back());
  for (std::size_t i = 1; i <= 20; ++i) way[i].tip_P.z() += i % 2 == 0 ? before_mm : -before_mm;
  const test::Posted p = test::posted(text_of(way), machine);
  ASSERT_TRUE(p.report) << p.report.error().text();
  VerifyOptions v;
  v.tolerance_mm = kQuietTolerance_mm;
  expect_same_figures(p.nc, text_of(path), machine, v, name);
  const auto found = test::verified(p.nc, text_of(path), machine, kQuietTolerance_mm);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->certified_tip_deviation_mm, std::max(before_mm, kMost_mm + kOfCircle_mm), 2e-4);
  EXPECT_NEAR(found->max_point_deviation_mm, kMost_mm + kOfCircle_mm, 2e-4);
}

TEST_P(QuietBlocks, TellOfCornersThatAreCutMoreAndMore) {
  expect_corners(GetParam(), 0.0);
  expect_corners(GetParam(), 0.0038);
}

// Each turns the tool farther than the one before, and its axis leaves the path by more on the way. The tip
// was off by more before.
TEST_P(QuietBlocks, TellOfTurnsThatGrow) {
  const Machine machine = test::shipped_machine(GetParam());
  constexpr int kPoints = static_cast<int>(kEnough) + 400;
  std::vector<ToolPose> path;
  double turned = -0.7;
  for (int i = 0; i <= kPoints; ++i) {
    turned += (i / 8 % 2 == 0 ? 1e-4 : -1e-4) * std::max(1, i - static_cast<int>(kEnough));
    const double tilted = 0.5 + 0.2 * std::sin(2.0 * turned);
    path.push_back(
        {{30.0 * std::cos(i / 60.0), 30.0 * std::sin(i / 60.0), 1e-3 * i},
         {std::sin(tilted) * std::cos(turned), std::sin(tilted) * std::sin(turned), std::cos(tilted)}});
  }
  std::vector<ToolPose> way = path;
  for (std::size_t i = kEnough; i < kEnough + 20; ++i) way[i].tip_P.z() += 0.2;
  PostOptions options;
  options.tolerance_mm = 5.0;  // no points are inserted
  options.axis_tolerance = Angle::degrees(5.0);
  const test::Posted p = test::posted(text_of(way), machine, options);
  ASSERT_TRUE(p.report) << p.report.error().text();
  VerifyOptions v;
  v.tolerance_mm = options.tolerance_mm;
  v.axis_tolerance = *options.axis_tolerance;
  expect_same_figures(p.nc, text_of(path), machine, v, GetParam());
  const auto found = test::verified(p.nc, text_of(path), machine, 5.0);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->certified_tip_deviation_mm, 0.2, 0.01);
}

// CL points that a block passes at less than what other blocks miss the path by still tell how far they are.
TEST(QuietBlock, CountsThePointsThatItPasses) {
  const auto text_of = [](const std::vector<std::pair<double, double>>& points) {
    std::string out = "FEDRAT/MMPM,1200\nRAPID\n";
    for (const auto& [x, y] : points)
      out += "GOTO/" + fixed_text(x, 4) + "," + fixed_text(y, 4) + ",0,0,0.6,0.8\n";
    return out + "FINI\n";
  };
  std::vector<std::pair<double, double>> path;
  for (int i = 0; i <= 100; ++i) path.emplace_back(i, 0.0);
  // Beside the path between the first points, then past the others in one block.
  std::vector<std::pair<double, double>> way;
  for (int i = 0; i < 20; ++i) {
    way.emplace_back(i, 0.0);
    way.emplace_back(i + 0.5, 0.003);
  }
  way.emplace_back(20.0, 0.0);
  way.emplace_back(20.5, 0.001);
  way.emplace_back(99.5, 0.001);
  way.emplace_back(100.0, 0.0);
  const Machine machine = test::shipped_machine("trunnion_offset");
  const test::Posted p = test::posted(text_of(way), machine);
  ASSERT_TRUE(p.report);
  const auto v = test::verified(p.nc, text_of(path), machine, kQuietTolerance_mm);
  ASSERT_TRUE(v);
  EXPECT_EQ(v->points_missed, 0U);
  EXPECT_NEAR(v->certified_tip_deviation_mm, 0.003, 2e-4);
  EXPECT_NEAR(v->max_point_deviation_mm, 0.001, 2e-4);
}

INSTANTIATE_TEST_SUITE_P(Machines, QuietBlocks, testing::Values("trunnion_offset", "paper", "xyzac_trt"));
INSTANTIATE_TEST_SUITE_P(LongMachines, LongQuietBlocks,
                         testing::Values("trunnion_offset", "paper", "xyzac_trt"));

}  // namespace
}  // namespace trunnion::post
