// Every placement of points through the whole post: the program read back and proved.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/base/number_text.hpp"
#include "trunnion/geom/pose.hpp"
#include "trunnion/post/post.hpp"

#include "support/cl_text.hpp"
#include "support/folders.hpp"
#include "support/machines.hpp"

namespace trunnion::post {
namespace {

struct ClPoint {
  Vec3 tip, axis;
};

std::string cl_text(const std::vector<ClPoint>& points) {
  std::string out = "FEDRAT/MMPM,1200\nRAPID\n";
  for (const ClPoint& p : points) {
    out += "GOTO/";
    for (const Vec3* v : {&p.tip, &p.axis}) {
      for (Eigen::Index i = 0; i < 3; ++i)
        out += fixed_text((*v)[i], 7) + (v == &p.axis && i == 2 ? "\n" : ",");
    }
  }
  return out + "FINI\n";
}

// A smooth five-axis path, tilt 10 to 60 deg.
std::vector<ClPoint> placed_path(unsigned seed, int count) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(0.0, 6.0);
  const double a = u(random);
  const double b = u(random);
  std::vector<ClPoint> out;
  for (int i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / count;
    const double tilt = 0.6 + 0.4 * std::sin(5.0 * t + a);
    const double turn = 3.0 * t + b;
    out.push_back({{40.0 * std::cos(3.0 * t), 40.0 * std::sin(3.0 * t), 20.0 * t},
                   {std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn), std::cos(tilt)}});
  }
  return out;
}

struct Placed {
  PostReport report;
  std::string nc;
};

class Poster {
 public:
  explicit Poster(const std::string& machine) : machine_(test::shipped_machine(machine)) {
    Diagnostics d;
    controller_ = *nc::load_controller(test::source_folder() + "/postconfigs/controllers/linuxcnc.toml", d);
  }
  const Machine& machine() const { return machine_; }
  Machine& machine() { return machine_; }

  Placed post(const std::vector<ClPoint>& points, PostOptions options, const Model* model = nullptr) const {
    options.collect = true;
    options.tools.tool = 1;
    PostJob job;
    job.cl_file = "part.cls";
    job.machine = &machine_;
    job.controller = &controller_;
    job.model = model;
    Diagnostics d;
    Placed out;
    auto report = post::post(
        std::make_unique<test::TextOf>(cl_text(points)), job, options,
        [&](std::string_view text) {
          out.nc += text;
          return Result<void>{};
        },
        d);
    if (!report) throw std::runtime_error(report.error().text());
    out.report = std::move(*report);
    return out;
  }

  VerifyReport verify(const Placed& posted, const std::vector<ClPoint>& points, VerifyOptions options) const {
    options.tools.tool = 1;
    Diagnostics d;
    auto report = post::verify({std::make_unique<test::TextOf>(cl_text(points)), "part.cls"},
                               {std::make_unique<test::TextOf>(posted.nc), "part.nc"},
                               {machine_, controller_, options}, d);
    if (!report) throw std::runtime_error(report.error().text());
    return *report;
  }

 private:
  Machine machine_;
  nc::Controller controller_;
};

PostOptions options_of(path::Method method, double tolerance_mm) {
  PostOptions options;
  options.tolerance_mm = tolerance_mm;
  options.nonlinear.method = method;
  return options;
}

// Largest distance of the ends of cutting blocks from the programmed path.
double farthest_block_end(const Placed& p, const std::vector<ClPoint>& points) {
  double largest = 0.0;
  for (const VerifiedBlock& block : p.report.verification->blocks) {
    if (block.rapid) continue;
    double nearest = 1e9;
    for (std::size_t i = 0; i + 1 < points.size(); ++i)
      nearest = std::min(nearest, distance_to_segment(block.tip_P, points[i].tip, points[i + 1].tip));
    largest = std::max(largest, nearest);
  }
  return largest;
}

// Half a unit of the last place in each of three words of four decimals.
constexpr double kWords_mm = 0.000087;

TEST(Placement, EveryPlacementIsProvedWithinItsTolerance) {
  for (const char* name : {"trunnion_offset", "paper"}) {
    const Poster poster(name);
    for (const unsigned seed : {1U, 2U}) {
      const auto path = placed_path(seed, 60);
      std::size_t reinserted = 0;
      for (const path::Method method :
           {path::Method::reinsert, path::Method::subtract, path::Method::adaptive}) {
        for (const char* predictor : {"harmonic", "harmonic3", "quartic"}) {
          PostOptions options = options_of(method, 0.002);
          options.nonlinear.predictor = *path::predictor_from_text(predictor);
          const Placed p = poster.post(path, options);
          const VerifyReport& v = *p.report.verification;
          EXPECT_TRUE(v.passed()) << name << " " << seed << " " << predictor << " "
                                  << v.certified_tip_deviation_mm;
          EXPECT_TRUE(v.certified);
          EXPECT_GT(p.report.points_inserted, 0U);
          EXPECT_EQ(p.report.segments_not_converged, 0U);
          // Programmed points stay where the CL file has them.
          EXPECT_LE(v.max_point_deviation_mm, kWords_mm);
          if (method == path::Method::reinsert) reinserted = p.report.points_inserted;
          if (method == path::Method::adaptive) {
            EXPECT_LE(p.report.points_inserted, reinserted);
          }
        }
      }
    }
  }
}

TEST(Placement, TwoSidedSavesPointsAndOneSidedStaysOnTheChord) {
  const Poster poster("trunnion_offset");
  const auto path = placed_path(3, 60);
  PostOptions options = options_of(path::Method::adaptive, 0.0005);
  const Placed both = poster.post(path, options);
  options.nonlinear.one_sided = true;
  const Placed chord = poster.post(path, options);
  EXPECT_TRUE(both.report.verification->passed());
  EXPECT_TRUE(chord.report.verification->passed());
  EXPECT_LT(both.report.points_inserted, chord.report.points_inserted);
  EXPECT_LE(farthest_block_end(chord, path), kWords_mm);
  EXPECT_GT(farthest_block_end(both, path), 0.25 * options.tolerance_mm);
  EXPECT_LE(farthest_block_end(both, path), options.tolerance_mm);
}

TEST(Placement, MovedPointsSavePointsAndStayInTheTube) {
  const Poster poster("trunnion_offset");
  for (const unsigned seed : {4U, 5U}) {
    const auto path = placed_path(seed, 80);
    // Segments as programmed stray by up to worst: most then need one point, which displaced ends save.
    const double worst = poster.post(path, options_of(path::Method::none, 0.01)).report.worst_predicted_mm;
    PostOptions options = options_of(path::Method::adaptive, 0.6 * worst);
    const Placed fixed = poster.post(path, options);
    options.nonlinear.move_programmed_points = true;
    const Placed moved = poster.post(path, options);
    const VerifyReport& v = *moved.report.verification;
    EXPECT_TRUE(v.passed()) << v.certified_tip_deviation_mm;
    EXPECT_TRUE(v.certified);
    EXPECT_LT(moved.report.points_inserted, fixed.report.points_inserted);
    EXPECT_LE(fixed.report.verification->max_point_deviation_mm, kWords_mm);
    EXPECT_LE(v.max_point_deviation_mm, options.tolerance_mm);
    EXPECT_EQ(v.points_missed, 0U);
  }
}

TEST(Placement, ThinningLeavesPointsOutOfADensePathOnly) {
  const Poster poster("trunnion_offset");
  const auto dense = placed_path(6, 3000);
  for (const path::Method method : {path::Method::adaptive, path::Method::reinsert}) {
    PostOptions options = options_of(method, 0.01);
    const Placed all = poster.post(dense, options);
    options.nonlinear.thin = true;
    const Placed thinned = poster.post(dense, options);
    const VerifyReport& v = *thinned.report.verification;
    EXPECT_TRUE(v.passed()) << v.certified_tip_deviation_mm << " missed " << v.points_missed;
    EXPECT_TRUE(v.certified);
    EXPECT_LT(v.feed_blocks, all.report.verification->feed_blocks / 3);
    EXPECT_LE(v.max_point_deviation_mm, options.tolerance_mm);
    EXPECT_EQ(v.points_in, dense.size());
  }
}

// A shallow dome through its top, 3.6 mm beside the axis of C, on a machine whose A ends at zero: C turns by
// half a turn there.
TEST(Placement, HalfTurnOfCAtThePoleMeetsItsToleranceWithTwentyPoints) {
  Poster poster("trunnion_offset");
  poster.machine().axes[*poster.machine().axis("A")].min = 0.0;
  const double tilt = Angle::degrees(0.05).rad();
  const auto dome = [&](double x, double angle) {
    return ClPoint{{3.0 + x, -2.0, 0.0}, {std::sin(angle), 0.0, std::cos(angle)}};
  };
  const std::vector<ClPoint> path{dome(-0.51, -3.0 * tilt), dome(-0.17, -tilt), dome(0.17, tilt),
                                  dome(0.51, 3.0 * tilt)};
  for (const bool one_sided : {false, true}) {
    PostOptions options = options_of(path::Method::adaptive, 0.01);
    options.axis_tolerance = Angle::degrees(0.1);
    options.nonlinear.one_sided = one_sided;
    const Placed p = poster.post(path, options);
    const VerifyReport& v = *p.report.verification;
    EXPECT_TRUE(v.passed()) << v.certified_tip_deviation_mm << " mm " << v.max_axis_deviation.deg() << " deg";
    EXPECT_TRUE(v.certified);
    EXPECT_LE(p.report.points_inserted, 20U);
    EXPECT_LE(v.max_axis_deviation.deg(), 0.1);
    EXPECT_LE(v.certified_tip_deviation_mm, 0.01);
    double turned = 0.0;
    const AxisId C = *poster.machine().axis("C");
    for (std::size_t i = 1; i < v.blocks.size(); ++i)
      turned = std::max(turned, std::abs(v.blocks[i].q[C] - v.blocks[0].q[C]));
    EXPECT_NEAR(Angle::radians(turned).deg(), 180.0, 1e-3);
    RecordProperty(one_sided ? "on_chord" : "two_sided", static_cast<int>(p.report.points_inserted));
  }
}

Model errors_of(const Machine& machine, const std::string& more, const std::string& file) {
  Diagnostics d;
  const auto model = parse_model(
      "[model]\nname = \"m\"\n"
      "[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 60.0\nY0C_um = -45.0\nA0C_urad = 80.0\n"
      "[[effect]]\nid = \"component:EXX\"\n[effect.parameters]\nP1_um = 8.0\nP3_um = -5.0\n"
      "[[effect]]\nid = \"component:EAC\"\n[effect.parameters]\ncos1_urad = 25.0\nsin2_urad = -15.0\n"
      "[[effect]]\nid = \"periodic:Y\"\n[effect.parameters]\nsin_um = 1.5\np_mm = 10.0\n"
      "[[effect]]\nid = \"backlash:X\"\n[effect.parameters]\nb_um = 5.0\n" +
          more,
      file, machine, {}, d);
  if (!model) throw std::runtime_error(model.error().text());
  return *model;
}

// On a machine with errors the bound is proved too: never below the samples, and not far above them.
TEST(Placement, BoundOnTheMachineWithErrorsIsProved) {
  for (const char* name : {"trunnion_offset", "xyzac_trt"}) {
    const Poster poster(name);
    const Model model = errors_of(poster.machine(), "", "m.toml");
    const ModelEvaluator truth(model);
    for (const unsigned seed : {7U, 8U, 9U}) {
      const auto path = placed_path(seed, 60);
      const Placed p = poster.post(path, options_of(path::Method::reinsert, 0.004), &model);
      const VerifyReport& proved = *p.report.verification;
      EXPECT_TRUE(proved.passed()) << name << " " << seed << " " << proved.certified_tip_deviation_mm;
      EXPECT_TRUE(proved.on_truth);
      EXPECT_TRUE(proved.certified);
      EXPECT_EQ(proved.sampled_blocks, 0U);
      VerifyOptions options;
      options.tolerance_mm = 0.004;
      options.truth = &truth;
      options.certify = false;
      options.collect = true;
      const VerifyReport sampled = poster.verify(p, path, options);
      EXPECT_FALSE(sampled.certified);
      EXPECT_GT(sampled.sampled_blocks, 0U);
      EXPECT_LE(sampled.certified_tip_deviation_mm, proved.certified_tip_deviation_mm + 1e-9);
      EXPECT_GE(1.05 * sampled.certified_tip_deviation_mm + 4e-5, proved.certified_tip_deviation_mm);
      // The uncorrected program on the same machine: large errors, the same two ways.
      const Placed plain = poster.post(path, options_of(path::Method::reinsert, 0.004));
      const VerifyReport wrong_sampled = poster.verify(plain, path, options);
      options.certify = true;
      const VerifyReport wrong_proved = poster.verify(plain, path, options);
      EXPECT_TRUE(wrong_proved.certified);
      ASSERT_EQ(wrong_proved.blocks.size(), wrong_sampled.blocks.size());
      for (std::size_t i = 0; i < wrong_proved.blocks.size(); ++i) {
        const double samples = wrong_sampled.blocks[i].tip_deviation_mm;
        EXPECT_LE(samples, wrong_proved.blocks[i].tip_deviation_mm * (1.0F + 1e-6F) + 1e-9F);
        EXPECT_GE(1.06 * samples + 4e-5, wrong_proved.blocks[i].tip_deviation_mm);
      }
    }
  }
}

// Nothing is called proved that is not: a table whose interpolation has no bound is sampled, and named.
TEST(Placement, AnEffectWithoutABoundIsSampledAndNamed) {
  const Poster poster("trunnion_offset");
  const auto folder = std::filesystem::path(testing::TempDir()) / "trunnion_placement";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "eyy.csv") << "Y_mm,EYY_um\n-300,2\n-100,-3\n100,4\n300,-1\n";
  const auto path = placed_path(10, 40);
  for (const bool nurbs : {false, true}) {
    const Model model =
        errors_of(poster.machine(),
                  std::string("[[effect]]\nid = \"component:EYY\"\ntable = \"eyy.csv\"\ninterpolation = \"") +
                      (nurbs ? "nurbs" : "linear") + "\"\n",
                  (folder / "m.toml").string());
    const Placed p = poster.post(path, options_of(path::Method::reinsert, 0.004), &model);
    const VerifyReport& v = *p.report.verification;
    EXPECT_TRUE(v.passed()) << v.certified_tip_deviation_mm;
    EXPECT_EQ(v.certified, !nurbs);
    EXPECT_EQ(v.sampled_blocks > 0, nurbs);
    EXPECT_EQ(v.unproved_effects,
              nurbs ? std::vector<std::string>{"component:EYY"} : std::vector<std::string>{});
    // On the nominal machine the same program is proved.
    EXPECT_TRUE(p.report.nominal_verification->certified);
  }
}

// Straight along X with a straightness error EYX, um at positions of X from where the tip is at zero.
Model straightness(const Poster& poster, const char* name,
                   const std::vector<std::pair<double, double>>& nodes) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "trunnion_placement" / name;
  std::filesystem::create_directories(folder);
  const double zero = inverse(poster.machine(), {Vec3::Zero(), Vec3::UnitZ()}, {})[0].q[0];
  std::ofstream file(folder / "eyx.csv");
  file << "X_mm,EYX_um\n";
  for (const auto& [x, um] : nodes) file << fixed_text(zero + x, 9) << "," << fixed_text(um, 3) << "\n";
  file.close();
  Diagnostics d;
  const auto model =
      parse_model("[model]\nname = \"m\"\n[[effect]]\nid = \"component:EYX\"\ntable = \"eyx.csv\"\n",
                  (folder / "m.toml").string(), poster.machine(), {}, d);
  if (!model) throw std::runtime_error(model.error().text());
  return *model;
}

std::vector<ClPoint> along_x(const std::vector<double>& at) {
  std::vector<ClPoint> out;
  for (const double x : at) out.push_back({{x, 0.0, 0.0}, Vec3::UnitZ()});
  return out;
}

// The ends of the block are right, the error between them is not: 5 um beside it in the middle.
TEST(Placement, WhatATableDoesBetweenTheBlocksGetsPoints) {
  const Poster poster("trunnion_offset");
  const Model model = straightness(poster, "between", {{-200.0, 0.0}, {0.0, 20.0}, {200.0, 0.0}});
  const auto path = along_x({-60.0, -50.0, 50.0, 60.0});
  const Placed p = poster.post(path, options_of(path::Method::adaptive, 0.002), &model);
  EXPECT_TRUE(p.report.verification->passed()) << p.report.verification->certified_tip_deviation_mm;
  EXPECT_GT(p.report.points_inserted, 0U);
  // With twice and a half of that there is room.
  EXPECT_EQ(poster.post(path, options_of(path::Method::adaptive, 0.0055), &model).report.points_inserted, 0U);
}

// A block whose ends are nearer to the path than the worst one so far may be the worst one between them.
TEST(Placement, TheWorstPlaceIsFoundBetweenTheEndsOfABlock) {
  const Poster poster("trunnion_offset");
  const Model model = straightness(
      poster, "worst",
      {{-200.0, 100.0}, {-50.0, 100.0}, {-40.0, 99.5}, {0.0, 104.5}, {40.0, 99.5}, {200.0, 99.5}});
  const ModelEvaluator truth(model);
  auto path = along_x({-60.0, -50.0, -40.0, 40.0});
  const Placed plain = poster.post(path, options_of(path::Method::none, 0.2));
  // The tool axis errs most in the first block, so that the last one changes no figure of it.
  path[0].axis = path[1].axis = Vec3(0.001, 0.0, 1.0).normalized();
  VerifyOptions options;
  options.tolerance_mm = 0.2;
  options.axis_tolerance = Angle::degrees(0.2);
  options.truth = &truth;
  for (const std::size_t worst_count : {10U, 1U}) {
    options.worst_count = worst_count;
    const VerifyReport v = poster.verify(plain, path, options);
    EXPECT_TRUE(v.certified);
    EXPECT_GE(v.certified_tip_deviation_mm, 0.1045 - 1e-9);
    EXPECT_LE(v.certified_tip_deviation_mm, 0.1045 * 1.05);
  }
}

}  // namespace
}  // namespace trunnion::post
