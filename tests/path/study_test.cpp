#include "trunnion/path/study.hpp"

#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>
#include <map>

#include "path/table_3_2.hpp"
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

// What the placements promise, on any file.
void expect_counts(const StudyResult& result) {
  std::size_t many_chord = 0;
  std::size_t many_sides = 0;
  for (const ToleranceStudy& t : result.tolerances) {
    if (t.over == 0) continue;
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
    many_chord += chord.inserted_many;
    many_sides += sides.inserted_many;
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
  const auto runs = runs_of(machine, TRUNNION_SOURCE_DIR "/samples/01_impeller/impeller.cls");
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

class LongStudyOf : public testing::TestWithParam<std::string> {};

TEST_P(LongStudyOf, MeetsTheCountsOfEveryPlacement) {
  std::string file = GetParam();
  if (file.find('/') == std::string::npos) {
    const char* data = std::getenv("TRUNNION_REFERENCE_DATA");
    if (data == nullptr) GTEST_SKIP() << "TRUNNION_REFERENCE_DATA is not set";
    file = std::string(data) + "/cl/" + file;
  } else {
    file = std::string(TRUNNION_SOURCE_DIR) + "/" + file;
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
