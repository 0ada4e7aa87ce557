#include "trunnion/probe/calibration.hpp"

#include <cstdio>
#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <sstream>

#include "trunnion/base/files.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/probe/reading.hpp"

#include "probe/given.hpp"
#include "probe/hidden_machine.hpp"
#include "support/folders.hpp"

namespace trunnion::probe {
namespace {

using test::Given;
using test::Triple;

// Small errors of the linear axes: squareness, scale, waves of straightness and position.
struct SmallErrors {
  double square_xy = 0, square_xz = 0, square_yz = 0;  // rad
  Triple scale{};
  double wave_mm = 0;
  std::array<double, 9> phase{}, length{};
};
Triple small_error(const Triple& p, const void* data) {
  const auto& e = *static_cast<const SmallErrors*>(data);
  Triple out{e.scale[0] * p[0] - e.square_xy * p[1] + e.square_xz * p[2],
             e.scale[1] * p[1] - e.square_yz * p[2], e.scale[2] * p[2]};
  for (std::size_t i = 0; i < 9; ++i)
    out[i / 3] += e.wave_mm * std::sin(6.283185307 * p[i % 3] / e.length[i] + e.phase[i]);
  return out;
}

struct Hidden {
  Hidden(const Given& given, const ProgramOptions& options, std::uint64_t seed, double small)
      : machine(given.hidden(options.ball)) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> off(-1.0, 1.0);
    std::normal_distribution<double> normal;
    const double across = 2.0 / std::sqrt(3.0);
    for (auto* point : {&machine.a_point, &machine.c_point, &machine.ball}) {
      for (double& v : *point) v += across * off(random);
    }
    for (auto* n : {&machine.a_direction, &machine.c_direction}) {
      Triple axis{normal(random), normal(random), normal(random)};
      const double along = test::times(axis, *n);
      axis = test::plus(axis, *n, -along);
      const double length = std::sqrt(test::times(axis, axis));
      for (double& v : axis) v /= length;
      *n = test::turned(*n, axis, off(random));  // up to a degree
    }
    machine.noise_mm = 0.0008;
    machine.period_s = 0.001;
    errors.square_xy = small * 20e-6 * normal(random);
    errors.square_xz = small * 20e-6 * normal(random);
    errors.square_yz = small * 20e-6 * normal(random);
    for (double& v : errors.scale) v = small * 10e-6 * normal(random);
    errors.wave_mm = small * 0.0007;
    for (double& v : errors.phase) v = 6.3 * off(random);
    for (double& v : errors.length) v = 30.0 + 100.0 * std::abs(off(random));
    machine.error = small_error;
    machine.error_data = &errors;
  }
  Hidden(const Hidden&) = delete;
  test::HiddenMachine machine;
  SmallErrors errors;
};

// How far a found line is from the true one across it at the found point, and its direction; in sigmas.
std::vector<double> off_in_sigmas(const Calibration& found, const Machine& file,
                                  const test::HiddenMachine& hidden) {
  std::vector<double> out;
  const auto vec = [](const Triple& t) { return Vec3(t[0], t[1], t[2]); };
  std::size_t at = 0;
  for (const AxisId id : file.rotary_axes()) {
    const Axis& axis = found.machine.axes[id];
    const bool a = axis.name == "A";
    const Vec3 n = vec(a ? hidden.a_direction : hidden.c_direction);
    const Vec3 p = vec(a ? hidden.a_point : hidden.c_point);
    Eigen::Index along = 0;
    n.cwiseAbs().maxCoeff(&along);
    // The true line where it has the found point's coordinate along the axis.
    const Vec3 true_point = p + n * ((axis.point_mm - p)[along] / n[along]);
    for (const bool point : {true, false}) {
      for (Eigen::Index k = 0; k < 3; ++k) {
        if (k == along) continue;
        const Estimate& e = found.estimates[at++];
        out.push_back((e.value - (point ? true_point[k] : n[k])) / e.sigma);
        EXPECT_EQ(e.name.substr(0, 2), axis.name + ".");
        EXPECT_NE(e.name.find(point ? "point" : "direction"), std::string::npos);
        EXPECT_EQ(e.name.find(std::string("_") + "xyz"[k]),
                  e.name.rfind(point ? "_mm" : "") - (point ? 2U : 2U))
            << e.name;
      }
    }
  }
  return out;
}

struct Tally {
  int numbers = 0, within_95 = 0, within_3 = 0;
  int misfits = 0;
  double squares = 0.0, worst = 0.0, largest_factor = 1.0;
  void add(const std::optional<Misfit>& misfit) {
    misfits += misfit.has_value();
    if (misfit) largest_factor = std::max(largest_factor, misfit->factor);
  }
  void add(double sigmas) {
    ++numbers;
    within_95 += std::abs(sigmas) < 1.959964;
    within_3 += std::abs(sigmas) < 3.0;
    squares += sigmas * sigmas;
    worst = std::max(worst, std::abs(sigmas));
  }
};

Tally simulate(int count, double small, std::size_t poses, double largest_noise = 1.0) {
  const Given given("trunnion_offset");
  ProgramOptions options = given.options();
  options.poses = poses;
  options.ball.within_mm = 8.0;
  const auto program = make_program(given.machine, given.control, options).value();
  Diagnostics diagnostics;
  const auto strokes = read_strokes(given.machine, given.control, program.text, "p.nc", diagnostics).value();
  Tally tally;
  for (int i = 0; i < count; ++i) {
    Hidden hidden(given, options, static_cast<std::uint64_t>(1000 + i), small);
    hidden.machine.noise_mm *= largest_noise;
    const auto run = test::run_probing(program.text, hidden.machine, static_cast<std::uint64_t>(i));
    const auto reading = read_touches(given.machine, strokes, run.log, "log", {});
    if (!reading) {
      ADD_FAILURE() << i << ": " << reading.error().text();
      continue;
    }
    const auto found = calibrate(given.machine, reading->data);
    if (!found) {
      ADD_FAILURE() << i << ": " << found.error().text();
      continue;
    }
    for (const double sigmas : off_in_sigmas(*found, given.machine, hidden.machine)) tally.add(sigmas);
    tally.add(found->misfit);
  }
  std::printf(
      "%d machines, small errors x %.1f, %zu poses: %.2f %% within 95 %%, %.2f %% within 3 sigma, rms %.3f, "
      "worst %.2f; %d misfits, by %.2f at most\n",
      count, small, poses, 100.0 * tally.within_95 / tally.numbers, 100.0 * tally.within_3 / tally.numbers,
      std::sqrt(tally.squares / tally.numbers), tally.worst, tally.misfits, tally.largest_factor);
  return tally;
}

int machines(int usual) {
  const char* asked = std::getenv("TRUNNION_MACHINES");
  return asked != nullptr ? std::atoi(asked) : usual;
}

TEST(LongCalibration, RecoversHiddenMachinesWithinItsSigmas) {
  for (const double small : {0.0, 1.0}) {
    const Tally tally = simulate(machines(12), small, 12);
    EXPECT_GT(tally.within_95, 0.88 * tally.numbers);
    EXPECT_LT(tally.worst, 5.0);
  }
}

// The fit is exact: without noise the lines come out to what a log's six decimals leave.
TEST(Calibration, IsExactForMillimetresAndDegreesWithoutNoise) {
  const Given given("trunnion_offset");
  ProgramOptions options = given.options();
  options.ball.within_mm = 8.0;
  const auto program = make_program(given.machine, given.control, options).value();
  Diagnostics diagnostics;
  const auto strokes = read_strokes(given.machine, given.control, program.text, "p.nc", diagnostics).value();
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Hidden hidden(given, options, seed, 0.0);
    hidden.machine.noise_mm = hidden.machine.period_s = 0.0;
    const auto log = test::run_probing(program.text, hidden.machine, seed).log;
    const auto reading = read_touches(given.machine, strokes, log, "log", {});
    ASSERT_TRUE(reading) << reading.error().text();
    const auto found = calibrate(given.machine, reading->data);
    ASSERT_TRUE(found);
    EXPECT_LT(found->rms_after_mm, 2e-6);
    EXPECT_GT(found->rms_before_mm, 0.1);
    // Every place of the table, at every pose, against the hidden chain: below a tenth of a micrometre.
    for (const double a : {-30.0, 0.0, 50.0}) {
      for (const double c : {0.0, 100.0, 250.0}) {
        JointVector q;
        q[*given.machine.axis("A")] = a * kRadPerDegree;
        q[*given.machine.axis("C")] = c * kRadPerDegree;
        const auto truth = hidden.machine.ball_at(a, c);
        Vec3 at(hidden.machine.ball[0], hidden.machine.ball[1], hidden.machine.ball[2]);
        at = part_in_machine(found->machine, q) * at;
        EXPECT_LT((at - Vec3(truth[0], truth[1], truth[2])).norm(), 1e-4) << a << " " << c;
      }
    }
  }
}

TEST(Calibration, FindsAnAxisThatTurnsTheOtherWayRound) {
  Given given("trunnion_offset");
  const ProgramOptions options = given.options();
  const auto program = make_program(given.machine, given.control, options).value();
  Diagnostics diagnostics;
  const auto strokes = read_strokes(given.machine, given.control, program.text, "p.nc", diagnostics).value();
  const auto log = test::run_probing(program.text, given.hidden(options.ball), 1).log;
  const auto reading = read_touches(given.machine, strokes, log, "log", {});
  ASSERT_TRUE(reading) << reading.error().text();
  for (const char* name : {"A", "C"}) {
    // The same measurement, by a file that has the sense wrong.
    Machine wrong = given.machine;
    wrong.axes[*wrong.axis(name)].direction *= -1.0;
    diagnosis::Dataset data = reading->data;
    const Vec3 tool(0, 0, -options.ball.stylus_length_mm);
    for (auto& r : data.readings) {
      const JointVector q = data.track.state(r.row).q;
      const Vec3 d_P = options.ball.place_P - forward(wrong, q, tool).p;
      r.value = r.n.dot(part_in_machine(wrong, q).R * d_P);
    }
    const auto found = calibrate(wrong, data);
    ASSERT_TRUE(found) << found.error().text();
    EXPECT_EQ(found->turned_round, std::vector<std::string>{name});
    EXPECT_LT(
        (found->machine.axes[*wrong.axis(name)].direction + wrong.axes[*wrong.axis(name)].direction).norm(),
        1e-4);
  }
}

TEST(Calibration, SaysWhatThePosesDoNotTell) {
  const Given given("trunnion_offset");
  ProgramOptions options = given.options();
  options.poses = 6;
  const auto program = make_program(given.machine, given.control, options).value();
  Diagnostics diagnostics;
  const auto strokes = read_strokes(given.machine, given.control, program.text, "p.nc", diagnostics).value();
  auto hidden = given.hidden(options.ball);
  hidden.noise_mm = 0.001;
  const auto reading =
      read_touches(given.machine, strokes, test::run_probing(program.text, hidden, 1).log, "log", {});
  ASSERT_TRUE(reading) << reading.error().text();
  const auto all = calibrate(given.machine, reading->data);
  ASSERT_TRUE(all);
  ASSERT_EQ(all->not_seen.size(), 3U);
  EXPECT_THAT(all->not_seen[0], testing::HasSubstr("flange"));
  // Only C turns: nothing is known of A, and it stays.
  std::vector<MachineState> states;
  std::vector<diagnosis::RowOrigin> rows;
  std::vector<diagnosis::Reading> readings;
  for (int i = 0; i < 8; ++i) {
    MachineState state;
    state.q[*given.machine.axis("C")] = 0.7 * i;
    state.run = 0;
    const Vec3 tool(0, 0, -150);
    solve_linear(given.machine, options.ball.place_P, tool, state.q);
    states.push_back(state);
    rows.push_back({0, 0, tool});
    for (int k = 0; k < 3; ++k)
      readings.push_back({static_cast<std::size_t>(i), diagnosis::Quantity::displacement,
                          diagnosis::SensitivityFrame::machine, Vec3::Unit(k), 0.0, 0.001, 0.0, 0});
  }
  const auto only_c = diagnosis::make_dataset(reading->data.context, states, rows, readings);
  const auto found = calibrate(given.machine, only_c);
  ASSERT_TRUE(found) << found.error().text();
  int unseen = 0;
  for (const auto& e : found->estimates) unseen += !e.seen && e.name.starts_with("A.");
  EXPECT_EQ(unseen, 4);
  EXPECT_EQ(found->machine.axes[*given.machine.axis("A")].point_mm,
            given.machine.axes[*given.machine.axis("A")].point_mm);
}

// A ball that was knocked half way: 7 um RMS were left of readings that are known to 1 um, and not a word.
TEST(Calibration, SaysWhereTheReadingsAreNotExplained) {
  const Given given("trunnion_offset");
  const ProgramOptions options = given.options();
  const auto program = make_program(given.machine, given.control, options).value();
  Diagnostics diagnostics;
  const auto strokes = read_strokes(given.machine, given.control, program.text, "p.nc", diagnostics).value();
  auto hidden = given.hidden(options.ball);
  hidden.noise_mm = 0.001;
  const auto log = test::run_probing(program.text, hidden, 1).log;
  const auto reading = read_touches(given.machine, strokes, log, "log", {});
  ASSERT_TRUE(reading) << reading.error().text();
  const auto good = calibrate(given.machine, reading->data);
  ASSERT_TRUE(good);
  EXPECT_FALSE(good->misfit);
  diagnosis::Dataset data = reading->data;
  for (std::size_t i = data.readings.size() / 2; i < data.readings.size(); ++i) {
    auto& r = data.readings[i];
    const Mat3 R_MP = part_in_machine(given.machine, data.track.state(r.row).q).R;
    r.value += r.n.dot(R_MP * Vec3(0.03, -0.02, 0.01));
  }
  const auto found = calibrate(given.machine, data);
  ASSERT_TRUE(found) << found.error().text();
  ASSERT_TRUE(found->misfit);
  EXPECT_NEAR(found->misfit->factor, std::sqrt(found->chi2 / found->freedom), 1e-12);
  EXPECT_GT(found->misfit->factor, 3.0);
  EXPECT_EQ(found->misfit->sigma_factor, 3.0);
  EXPECT_EQ(found->misfit->worst_run, data.context.runs.front().id);
  EXPECT_GT(found->misfit->worst_rms_mm, 0.002);
  EXPECT_THAT(misfit_text(*found), testing::HasSubstr("times their stated uncertainty"));
  // What is off does not hide in a sigma that is too small.
  for (std::size_t k = 0; k < 8; ++k)
    EXPECT_LT(std::abs(found->estimates[k].value - good->estimates[k].value), 2.5 * found->estimates[k].sigma)
        << found->estimates[k].name;
}

TEST(MachineText, ChangesTheRotaryAxesAndNothingElse) {
  const std::string file = test::source_folder() + "/postconfigs/machines/trunnion_offset.toml";
  const std::string text = read_file(file).value();
  Diagnostics diagnostics;
  Machine machine = parse_machine(text, file, diagnostics).value();
  machine.axes[3].point_mm = {0.25, 0.4, -65.000001};
  machine.axes[4].direction = Vec3(0.01, -0.02, -1.0).normalized();
  const auto changed = machine_text_with_axes(text, file, machine);
  ASSERT_TRUE(changed);
  const Machine again = parse_machine(*changed, file, diagnostics).value();
  for (const AxisId id : machine.rotary_axes()) {
    EXPECT_LT((again.axes[id].point_mm - machine.axes[id].point_mm).norm(), 1e-6);
    EXPECT_LT((again.axes[id].direction - machine.axes[id].direction).norm(), 1e-9);
  }
  // Line by line: the four lines differ, remarks stand.
  std::istringstream before(text), after(*changed);
  std::string a, b;
  int differ = 0;
  while (std::getline(before, a)) {
    ASSERT_TRUE(std::getline(after, b));
    differ += a != b;
  }
  EXPECT_LE(differ, 4);
  EXPECT_GE(differ, 2);
  EXPECT_THAT(*changed, testing::HasSubstr("# A trunnion whose C axis stands"));
}

TEST(LongCalibration, CoversAThousandHiddenMachines) {
  for (const double small : {0.3, 1.0, 3.0}) {
    const Tally tally = simulate(machines(1000), small, 12);
    EXPECT_GE(tally.within_95, 0.93 * tally.numbers) << small;
    EXPECT_LE(tally.within_95, 0.97 * tally.numbers) << small;
    EXPECT_GE(tally.within_3, 0.99 * tally.numbers) << small;
  }
}

}  // namespace
}  // namespace trunnion::probe
