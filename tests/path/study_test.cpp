#include "trunnion/path/study.hpp"

#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>
#include <map>
#include <random>

#include "path/table_3_2.hpp"
#include "support/cases.hpp"
#include "support/folders.hpp"
#include "support/machines.hpp"

namespace trunnion::path {
namespace {

std::vector<StudyRun> runs_of(const Machine& machine, const std::string& file) {
  Diagnostics diagnostics;
  const auto program = cl::load_program(file, {}, diagnostics);
  if (!program) throw std::runtime_error(diagnostics.first_error().text());
  auto runs = study_runs(machine, machine.tool_vector(), *program);
  if (!runs) throw std::runtime_error(runs.error().text());
  return *runs;
}

const PlacementStudy& placement(const ToleranceStudy& study, const std::string& name) {
  for (const PlacementStudy& p : study.placements) {
    if (p.placement == name) return p;
  }
  throw std::runtime_error(name);
}

double ratio(std::size_t a, std::size_t b) {
  return static_cast<double>(a) / static_cast<double>(b);
}

// What the placements promise, on any file: counts against those of the law.
void expect_law(const ToleranceStudy& t) {
  if (t.over == 0) return;
  SCOPED_TRACE(std::to_string(t.tolerance_mm) + (t.links ? " links" : ""));
  const PlacementStudy& chord = placement(t, "on_chord");
  const PlacementStudy& sides = placement(t, "two_sided");
  const PlacementStudy& moved = placement(t, "moved");
  EXPECT_EQ(chord.unconverged + sides.unconverged + moved.unconverged, 0U);
  EXPECT_LE(ratio(chord.inserted, t.greedy), t.links ? 1.02 : 1.003);
  EXPECT_LE(ratio(sides.inserted, t.two_sided_law), t.links ? 1.03 : 1.01);
  EXPECT_EQ(sides.more_than_on_chord, 0U);
  EXPECT_LE(moved.inserted, sides.inserted);
  for (const PlacementStudy& p : t.placements) EXPECT_LE(p.largest_certified_mm, t.tolerance_mm);
}

// And where many points are needed, of both sides against those on the chord.
void expect_counts(const StudyResult& result) {
  std::size_t many_chord = 0;
  std::size_t many_sides = 0;
  for (const ToleranceStudy& t : result.tolerances) {
    expect_law(t);
    many_chord += placement(t, "on_chord").inserted_many;
    many_sides += placement(t, "two_sided").inserted_many;
  }
  if (many_chord > 0) {
    EXPECT_LE(ratio(many_sides, many_chord), 0.73);
  }
}

TEST(Study, ImpellerSampleMeetsTheCountsOfEveryPlacement) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  StudyOptions options;
  options.tolerances_mm = {0.005, 0.001};
  options.axis_tolerance = Angle::degrees(0.2);
  const auto runs = runs_of(machine, test::source_folder() + "/samples/01_impeller/impeller.cls");
  const StudyResult result = study_nonlinear(machine, machine.tool_vector(), runs, options);
  expect_counts(result);
  const ToleranceStudy& at_5um = result.tolerances.front();
  ASSERT_FALSE(at_5um.links);
  EXPECT_LE(ratio(placement(at_5um, "moved").inserted, placement(at_5um, "on_chord").inserted), 0.65);
}

TEST(Study, Table32Predictors) {
  const Machine machine = test::shipped_machine("paper");
  const std::vector<StudyRun> runs{{test::table_3_2_path(machine), false}};
  StudyOptions options;
  options.tolerances_mm = {0.001};
  const StudyResult result = study_nonlinear(machine, machine.tool_vector(), runs, options);
  std::map<std::string, double> worst;
  for (const PredictorStudy& p : result.predictors) worst[predictor_text(p.predictor)] = p.worst;
  EXPECT_NEAR(worst["harmonic"], 0.056, 0.001);
  EXPECT_LE(worst["parabola"], 0.0015);
  EXPECT_LE(worst["quartic"], 1e-5);
  ASSERT_FALSE(result.worst.empty());
  EXPECT_GE(result.worst.front().certified_mm, 4.589e-3 - 1e-6);
}

// Far from the rotary axes a turn of a few degrees takes the tip a long way beside and along a step of 1 mm,
// so that the place of the path that is nearest half way is not half way.
std::vector<StudyRun> short_steps_far_out(const Machine& machine, std::uint64_t seed, int count) {
  const TableKinematics kinematics(machine, machine.tool_vector());
  std::mt19937_64 random(seed);
  const auto any = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto direction = [&] { return Vec3(any(-1.0, 1.0), any(-1.0, 1.0), any(-1.0, 1.0)).normalized(); };
  const double most_turn = Angle::degrees(4.9).rad();
  std::vector<StudyRun> runs;
  for (int i = 0; i < count; ++i) {
    Point a;
    Point b;
    for (std::size_t k = 0; k < 2; ++k) {
      const AxisId axis = kinematics.rotary(k);
      a.q[axis] = k == 0 ? any(0.3, 0.8) : any(-3.0, 3.0);
      b.q[axis] = a.q[axis] + any(-most_turn, most_turn);
    }
    a.tip_P = 1000.0 * direction();
    b.tip_P = a.tip_P + any(0.5, 2.0) * direction();
    for (Point* p : {&a, &b}) {
      const RotarySines sines = kinematics.sines(p->q);
      p->axis_P = kinematics.axis_P(sines);
      kinematics.solve_linear(p->tip_P, sines, p->q);
    }
    runs.push_back({{a, b}, false});
  }
  return runs;
}

TEST(LongStudy, AFluteThatLeadsAlongThePathNeedsNoMoreThanTheLaw) {
  for (const char* name : {"trunnion_offset", "xyzac_trt", "xyzbc_trt_sample"}) {
    SCOPED_TRACE(name);
    const Machine machine = test::shipped_machine(name);
    StudyOptions options;
    options.flute_mm = 10.0;
    options.tolerances_mm = {0.005};
    options.axis_tolerance = Angle::degrees(0.2);
    const auto runs = short_steps_far_out(machine, test::seed(3), test::cases(200));
    const StudyResult result = study_nonlinear(machine, machine.tool_vector(), runs, options);
    const ToleranceStudy& t = result.tolerances.front();
    const PlacementStudy& sides = placement(t, "two_sided");
    std::printf("[ figures  ] placed / law: %zu / %zu\n", sides.inserted, t.two_sided_law);
    EXPECT_LE(ratio(sides.inserted, t.two_sided_law), 1.001);
    EXPECT_EQ(sides.unconverged, 0U);
    EXPECT_LE(sides.largest_certified_mm, t.tolerance_mm);
  }
}

class LongStudyOf : public testing::TestWithParam<std::string> {};

TEST_P(LongStudyOf, MeetsTheCountsOfEveryPlacement) {
  std::string file = GetParam();
  if (file.find('/') == std::string::npos) {
    const char* data = std::getenv("TRUNNION_REFERENCE_DATA");
    if (data == nullptr) GTEST_SKIP() << "TRUNNION_REFERENCE_DATA is not set";
    file = std::string(data) + "/cl/" + file;
  } else {
    file = test::source_folder() + "/" + file;
  }
  const Machine machine = test::shipped_machine("trunnion_offset");
  StudyOptions options;
  options.axis_tolerance = Angle::degrees(0.2);
  expect_counts(study_nonlinear(machine, machine.tool_vector(), runs_of(machine, file), options));
}

INSTANTIATE_TEST_SUITE_P(LongFiles, LongStudyOf,
                         testing::Values("samples/01_impeller/impeller.cls", "impeller_yelun_goto6.cls",
                                         "creo9_proclfile_5x_multax_cut.ncl",
                                         "nx_clsf_5x_variable_contour_large.cls"),
                         [](const auto& file) {
                           std::string name = std::filesystem::path(file.param).stem().string();
                           std::replace_if(
                               name.begin(), name.end(), [](char c) { return !std::isalnum(c); }, '_');
                           return name;
                         });

}  // namespace
}  // namespace trunnion::path
