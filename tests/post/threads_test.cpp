// The text of a program and everything that is said about it are the same for any number of threads.
#include <cmath>
#include <gtest/gtest.h>

#include "trunnion/base/files.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/post/post.hpp"

#include "support/cl_text.hpp"
#include "support/folders.hpp"
#include "support/machines.hpp"

namespace trunnion::post {
namespace {

std::string goto_line(const Vec3& tip, double tilt, double turn) {
  const Vec3 axis(std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn), std::cos(tilt));
  std::string line = "GOTO/";
  for (const double v : {tip.x(), tip.y(), tip.z()}) line += fixed_text(v, 4) + ",";
  return line + fixed_text(axis.x(), 7) + "," + fixed_text(axis.y(), 7) + "," + fixed_text(axis.z(), 7) +
         "\n";
}

// `points` points that turn C by `turns`; the tilt goes from `tilt` by `swing` up and down.
std::string spiral(int points, double turns, double tilt, double swing) {
  std::string out = "FEDRAT/MMPM,1500\n";
  for (int i = 0; i < points; ++i) {
    const double t = static_cast<double>(i) / points;
    const double angle = kTwoPi * turns * t;
    out += goto_line({60.0 * std::cos(angle), 60.0 * std::sin(angle), 10.0 * t},
                     tilt + swing * std::sin(25.0 * t), angle);
    if (i % 997 == 400) out += "LINTOL/ON,0.004\n";
    if (i % 997 == 800) out += "LINTOL/ON,0.02\nSPINDL/RPM,9000,CLW\nPPRINT here\n";
  }
  return out + "RAPID\n" + goto_line({0.0, 0.0, 200.0}, 0.0, 0.0);
}

std::string program(const std::string& body) {
  return "UNITS/MM\nMULTAX/ON\nLOADTL/3\nSPINDL/RPM,8000,CLW\nRAPID\n" + body + "LOADTL/4\n" +
         spiral(500, 0.5, 0.9, 0.2) + "FINI\n";
}

struct ThreadsOutcome {
  std::string nc;
  std::string said;
};

ThreadsOutcome outcome(const std::string& cl, const std::string& machine_name, PostOptions options,
                       std::size_t threads, const std::string& model_toml = {}) {
  const Machine machine = test::shipped_machine(machine_name);
  Diagnostics loading;
  const auto control =
      nc::load_controller(test::source_folder() + "/postconfigs/controllers/linuxcnc.toml", loading);
  std::optional<Model> model;
  if (!model_toml.empty()) model = parse_model(model_toml, "model.toml", machine, {}, loading).value();
  PostJob job;
  job.cl_file = "part.cls";
  job.machine = &machine;
  job.controller = &*control;
  job.model = model ? &*model : nullptr;
  options.threads = threads;
  ThreadsOutcome out;
  Diagnostics diagnostics;
  const auto report = post(
      std::make_unique<test::TextOf>(cl), job, options,
      [&](std::string_view text) {
        out.nc += text;
        return Result<void>{};
      },
      diagnostics);
  for (const Finding& f : diagnostics.findings()) out.said += f.text() + "\n";
  if (!report) {
    out.nc.clear();  // of no use to anyone
    out.said += "failed: " + report.error().text();
    return out;
  }
  out.said += verdict_text(*report) + std::to_string(report->points_inserted) + " " +
              std::to_string(report->worst_predicted_mm) + " " + std::to_string(report->duration_s);
  return out;
}

void expect_the_same(const std::string& cl, const std::string& machine, const PostOptions& options = {},
                     const std::string& model = {}, const std::string& must_say = {}) {
  const ThreadsOutcome one = outcome(cl, machine, options, 1, model);
  EXPECT_NE(one.said.find(must_say), std::string::npos) << one.said;
  for (const std::size_t threads : {2U, 3U, 7U}) {
    const ThreadsOutcome more = outcome(cl, machine, options, threads, model);
    EXPECT_EQ(more.said, one.said) << threads << " threads";
    EXPECT_TRUE(more.nc == one.nc) << threads << " threads";
  }
}

TEST(Threads, DoNotChangeALongRun) {
  expect_the_same(program(spiral(6000, 6.0, 0.8, 0.15)), "trunnion_offset");
}

TEST(Threads, DoNotChangeARunWithTwoSolutionsThroughout) {
  expect_the_same(program(spiral(5000, 3.0, 0.3, 0.1)), "trunnion_offset");
}

TEST(Threads, DoNotChangeRewindsAtTheLimitsOfC) {
  // 40 turns: C has its limits there, so that the tool leaves the part and turns back.
  expect_the_same(program(spiral(4000, 40.0, 0.7, 0.05)), "xyzac_trt");
}

TEST(Threads, DoNotChangeAPathThroughThePole) {
  std::string path = "FEDRAT/MMPM,1500\n";
  for (int i = -2000; i <= 2000; ++i) {
    path += goto_line({i * 0.02, 1.0, 0.0}, std::abs(i) * 1e-4, i < 0 ? kPi : 0.0);
  }
  expect_the_same(program(path), "trunnion_offset");
}

TEST(Threads, DoNotChangeCompensation) {
  expect_the_same(
      program(spiral(2500, 2.0, 0.8, 0.15)), "trunnion_offset", {},
      "[model]\nname = \"m\"\n[[effect]]\nid = \"location:C\"\n[effect.parameters]\nX0C_um = 12.0\n"
      "[[effect]]\nid = \"backlash:X\"\n[effect.parameters]\nb_um = 3.0\n");
}

TEST(Threads, DoNotChangeSampledLocalAndThinnedPrograms) {
  const std::string cl = program(spiral(5000, 4.0, 0.8, 0.15));
  PostOptions options;
  options.nonlinear.certify = false;
  options.nonlinear.predictor = {path::Predictor::Kind::exact, 1};
  expect_the_same(cl, "trunnion_offset", options);
  options = {};
  options.choice = path::ChoiceMethod::combined;
  expect_the_same(cl, "trunnion_offset", options);
  options = {};
  options.nonlinear.method = path::Method::adaptive;
  options.nonlinear.thin = true;
  options.nonlinear.move_programmed_points = true;
  expect_the_same(program(spiral(2000, 2.0, 0.8, 0.15)), "trunnion_offset", options);
}

TEST(Threads, DoNotChangeWhatIsSaidOfAnError) {
  const std::string good = spiral(3000, 2.0, 0.8, 0.1);
  // A pose out of reach, far into the program; a fault of the file behind it.
  const std::string beyond = goto_line({0.0, 0.0, 0.0}, 2.6, 0.3);
  expect_the_same(program(good + beyond + good), "trunnion_offset", {}, {}, "cannot be reached");
  expect_the_same(program(good + "GOTO/1,2\n" + good), "trunnion_offset", {}, {}, "3 (x, y, z) or 6");
  expect_the_same(program(good + beyond + good + "GOTO/1,2\n"), "trunnion_offset", {}, {},
                  "3 (x, y, z) or 6");
  // Beyond a limit of a linear axis: found when the text is made.
  expect_the_same(program(good + goto_line({900.0, 0.0, 0.0}, 0.8, 0.3) + good), "trunnion_offset", {}, {},
                  "beyond its limits");
}

// The model gives metres beside the last points, where chunks are prepared long before their turn; the first
// points ask for a correction that is too large.
TEST(Threads, DoNotChangeWhichErrorOfAModelComesFirst) {
  const std::string near = spiral(300, 1.0, 0.8, 0.1);
  std::string far = "FEDRAT/MMPM,1500\n";
  for (int i = 0; i < 4000; ++i) far += goto_line({3000.0, 0.01 * i, 0.0}, 0.1, 0.0);
  const std::string cubic = "[effect.parameters]\nP3_um = 3e4\n";  // of the position by 100 mm
  const std::string model = "[model]\nname = \"m\"\n[[effect]]\nid = \"component:EXX\"\n" + cubic +
                            "[[effect]]\nid = \"component:EYY\"\n" + cubic;
  expect_the_same(program(near + far), "trunnion_offset", {}, model, "--largest-correction-mm");
}

}  // namespace
}  // namespace trunnion::post
