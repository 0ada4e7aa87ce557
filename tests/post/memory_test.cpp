// Errors with memory along a program: lags follow the time that the program takes.
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trunnion/base/number_text.hpp"
#include "trunnion/post/post.hpp"

#include "support/cl_text.hpp"
#include "support/controllers.hpp"
#include "support/machines.hpp"

namespace trunnion::post {
namespace {

using Text = test::TextOf;

constexpr double kWait_s = 600.0;

// The same cut twice, with a dwell between; 15 s of cutting each.
const std::string kTwice = [] {
  std::string out = "PARTNO TEST\nMULTAX/ON\nLOADTL/3\nSPINDL/RPM,10000,CLW\nFEDRAT/MMPM,120\n";
  for (int i = 0; i < 2; ++i) {
    out += "RAPID\nGOTO/0,0,50,0,0,1\nGOTO/0,0,0\nGOTO/30,0,0\nRAPID\nGOTO/30,0,50\n";
    if (i == 0) out += "DELAY/" + fixed_text(kWait_s, 1) + "\n";
  }
  return out + "FINI\n";
}();

Model model(const std::string& text, const Machine& machine, const EffectContext& context = {}) {
  Diagnostics d;
  auto out = parse_model("[model]\nname = \"m\"\n" + text, "m.toml", machine, context, d);
  if (!out) throw std::runtime_error(out.error().text());
  return *out;
}

struct MemoryPost {
  Result<PostReport> report;
  std::vector<double> x_of_cuts, z_of_cuts;  // end of each feed block
};

MemoryPost posted(const Machine& machine, const Model& model,
                  const TemperatureHistory* temperatures = nullptr, const std::string& cl = kTwice,
                  double tool_change_s = 0.0) {
  nc::Controller c = test::shipped_controller("linuxcnc");
  c.tool_change_s = tool_change_s;
  PostJob job;
  job.cl_file = "part.cls";
  job.machine = &machine;
  job.controller = &c;
  job.model = &model;
  job.temperatures = temperatures;
  PostOptions options;
  options.tolerance_mm = 0.001;
  Diagnostics d;
  std::string nc;
  MemoryPost out{post(
                     std::make_unique<Text>(cl), job, options,
                     [&](std::string_view text) {
                       nc += text;
                       return Result<void>{};
                     },
                     d),
                 {},
                 {}};
  for (const auto& block : test::nc_blocks(c, nc)) {
    const auto* m = std::get_if<nc::Motion>(&block);
    if (m == nullptr || m->kind != nc::MotionKind::feed) continue;
    out.x_of_cuts.push_back(static_cast<double>(m->words[nc::AxisLetter::X]) / 1e4);
    out.z_of_cuts.push_back(static_cast<double>(m->words[nc::AxisLetter::Z]) / 1e4);
  }
  return out;
}

// Cold at the start: after t seconds at 10 000 rpm a growth of 3 um per 1000 rpm with tau is 30 um (1 -
// exp(-t/tau)).
TEST(Memory, TheSpindleGrowsWhileTheProgramRuns) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  constexpr double kTau_s = 900.0;
  const Model growing = model(
      "[[effect]]\nid = \"spindle_growth\"\n[effect.parameters]\nZ_um_per_krpm = 3.0\nY_um_per_krpm = "
      "0.0\ntau_s = " +
          fixed_text(kTau_s, 1) + "\n",
      machine);
  ASSERT_FALSE(lag_requests(growing).empty());
  const MemoryPost p = posted(machine, growing);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed()) << p.report->verification->certified_tip_deviation_mm;
  ASSERT_GE(p.z_of_cuts.size(), 4U);
  const double first = p.z_of_cuts[p.z_of_cuts.size() / 2 - 1];
  const double second = p.z_of_cuts.back();
  // Each pass is 50 mm down and 30 mm across at 2 mm/s: 25 s and 15 s; rapids take below a second. A block is
  // corrected for the growth at its start; the last one lasts 7.5 s.
  const auto grown_mm = [&](double t) { return 0.030 * (1.0 - std::exp(-t / kTau_s)); };
  EXPECT_NEAR(std::abs(second - first), grown_mm(72.5 + kWait_s) - grown_mm(32.5), 2e-4);
  EXPECT_NEAR(p.report->largest_error_mm, grown_mm(80.0 + kWait_s), 2e-4);  // at the last rapid
  EXPECT_NEAR(p.report->duration_s, 80.0 + kWait_s, 3.0);
  EXPECT_NEAR(p.report->verification->duration_s, p.report->duration_s, 3.0);
}

// A cut of 250 s in one CL motion, a lag of 300 s: in pieces, each corrected for the growth at its start,
// which is never older than 10 s. Against the closed form at the end of every block.
TEST(Memory, LongBlocksAreDividedInTime) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const Model growing = model(
      "[[effect]]\nid = \"spindle_growth\"\n[effect.parameters]\nZ_um_per_krpm = 3.0\nY_um_per_krpm = "
      "0.0\ntau_s = 300.0\n",
      machine);
  const MemoryPost p =
      posted(machine, growing, nullptr,
             "PARTNO TEST\nMULTAX/ON\nLOADTL/3\nSPINDL/RPM,10000,CLW\nFEDRAT/MMPM,60\nRAPID\n"
             "GOTO/0,0,10,0,0,1\nGOTO/0,0,0\nGOTO/250,0,0\nRAPID\nGOTO/250,0,50\nFINI\n");
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed());
  const double largest_mm = 0.030 * (1.0 - std::exp(-10.0 / 300.0));
  EXPECT_LE(p.report->lag_step_mm, largest_mm + 1e-9);
  EXPECT_GT(p.report->lag_step_mm, 0.2 * largest_mm);
  ASSERT_GE(p.z_of_cuts.size(), 27U);
  const auto grown_mm = [](double t) { return 0.030 * (1.0 - std::exp(-t / 300.0)); };
  std::size_t down = 0;  // the last block of the way down
  while (std::abs(p.x_of_cuts[down + 1] - p.x_of_cuts[0]) < 1e-6) ++down;
  for (std::size_t i = down + 1; i < p.z_of_cuts.size(); ++i) {
    const double seconds = 10.0 + std::abs(p.x_of_cuts[i] - p.x_of_cuts[0]);  // 1 mm/s, after 10 mm down
    EXPECT_NEAR(std::abs(p.z_of_cuts[i] - p.z_of_cuts[down]), grown_mm(seconds) - grown_mm(5.0),
                largest_mm + grown_mm(5.0) + 1e-4)
        << p.x_of_cuts[i];
  }
}

// The line of C moves by 2 um/K of the sensor `table`, with a lag of 300 s.
Model moved_by_the_table(const Machine& machine, const EffectContext& context) {
  return model(
      "[[effect]]\nid = \"thermal_location:C\"\nsensor = \"table\"\n[effect.parameters]\nX_um_per_K = "
      "0.0\nY_um_per_K = 2.0\ntau_s = 300.0\n",
      machine, context);
}

// The spindle grows cold before the first tool and while a tool is changed: here the change takes as long as
// a lag, with a sensor that is warm all the time.
TEST(Memory, ToolChangesTakeTime) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  EffectContext context;
  context.names.temperatures = {"table"};
  const Model moving = moved_by_the_table(machine, context);
  TemperatureHistory history;
  history.time_s = {0.0, 1.0};
  history.temperature_K = {{0.0}, {10.0}};
  const double short_s = posted(machine, moving, &history).report->duration_s;
  const MemoryPost p = posted(machine, moving, &history, kTwice, 300.0);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed());
  EXPECT_NEAR(p.report->duration_s, short_s + 300.0, 1.0);
  EXPECT_NEAR(p.report->verification->duration_s, short_s + 300.0, 3.0);
}

// A machine without that memory is another machine: the verification sees it.
TEST(Memory, TheVerificationFollowsTheLagOnItsOwn) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const auto with_tau = [&](const char* tau) {
    return model(std::string("[[effect]]\nid = \"spindle_growth\"\n[effect.parameters]\nZ_um_per_krpm = "
                             "3.0\nY_um_per_krpm = 0.0\ntau_s = ") +
                     tau + "\n",
                 machine);
  };
  const Model slow = with_tau("900.0");
  const Model quick = with_tau("300.0");
  const nc::Controller c = test::shipped_controller("linuxcnc");
  PostJob job;
  job.cl_file = "part.cls";
  job.machine = &machine;
  job.controller = &c;
  job.model = &slow;
  std::string nc;
  Diagnostics d;
  ASSERT_TRUE(post(
      std::make_unique<Text>(kTwice), job, {},
      [&](std::string_view text) {
        nc += text;
        return Result<void>{};
      },
      d));
  VerifyOptions options;
  const auto deviation_mm = [&](const Model& truth) {
    const ModelEvaluator evaluator(truth);
    options.truth = &evaluator;
    return verify({std::make_unique<Text>(kTwice), "part.cls"}, {std::make_unique<Text>(nc), "p.nc"},
                  {machine, c, options}, d)
        ->certified_tip_deviation_mm;
  };
  EXPECT_LT(deviation_mm(slow), 0.001);
  EXPECT_NEAR(deviation_mm(quick), 0.030 * (std::exp(-640.0 / 900.0) - std::exp(-640.0 / 300.0)), 0.002);
}

// A sensor's history: 10 K above reference from 300 s on, a line of C that moves by 2 um/K without a lag to
// speak of.
TEST(Memory, TemperaturesOfTheProgramCount) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  EffectContext context;
  context.names.temperatures = {"room", "table"};
  const Model moving = moved_by_the_table(machine, context);
  TemperatureHistory history;
  history.time_s = {0.0, 300.0};
  history.temperature_K = {{0.0, 0.0}, {50.0, 10.0}};
  const MemoryPost p = posted(machine, moving, &history);
  ASSERT_TRUE(p.report) << p.report.error().text();
  EXPECT_TRUE(p.report->verification->passed()) << p.report->verification->certified_tip_deviation_mm;
  // The last block begins after 672.5 s, 372.5 s of them at 10 K, with a lag of 300 s; the last rapid later.
  EXPECT_NEAR(p.report->largest_error_mm, 0.020 * (1.0 - std::exp(-375.0 / 300.0)), 3e-4);
  EXPECT_EQ(posted(machine, moving).report->largest_error_mm, 0.0);
}

}  // namespace
}  // namespace trunnion::post
