#include "trunnion/path/compensation.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <unistd.h>

#include "trunnion/base/number_text.hpp"
#include "trunnion/effects/state_track.hpp"
#include "trunnion/effects/table.hpp"

#include "support/effect_cases.hpp"

namespace trunnion::path {
namespace {

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  double sign() { return uniform(0, 1) < 0.5 ? -1.0 : 1.0; }
  double normal() { return std::normal_distribution<double>(0.0, 1.0)(random_); }
  Vec3 vector(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }

 private:
  std::mt19937_64 random_;
};

// An A-C trunnion with its axes somewhere, either sense of rotation, X over or under the table.
Machine random_machine(Draw& draw) {
  Machine machine = test::effect_machine(draw.uniform(0, 1) < 0.3 ? "x_table" : "trunnion_offset");
  machine.tool_length_mm = draw.uniform(80, 220);
  machine.part_zero_mm = draw.vector(60);
  for (const char* name : {"A", "C"}) {
    Axis& axis = machine.axes[*machine.axis(name)];
    axis.point_mm = draw.vector(80) + Vec3(0, 0, -100);
    if (draw.uniform(0, 1) < 0.5) axis.direction = -axis.direction;
  }
  return machine;
}

// The 41 errors of a trunnion machine: 30 components and 11 location errors, all parameters random, scaled to
// a mean deviation.
Model random_model(const Machine& machine, Draw& draw) {
  Model model;
  for (const EffectFamily& family : effect_library(machine, {})) {
    const std::string kind = family.id().substr(0, family.id().find(':'));
    if (kind != "component" && kind != "location" && kind != "squareness") continue;
    ModelEffect entry = model_effect(family.variants.front());
    for (std::size_t k = 0; k < entry.parameters.size(); ++k) {
      entry.parameters[k].value = draw.normal() * entry.effect->info().parameters[k].usual;
    }
    model.effects.push_back(std::move(entry));
  }
  EXPECT_EQ(model.effects.size(), 30u + 3u + 2u);
  return model;
}

struct Pose5 {
  Vec3 tip_P, axis_P;
  MachineState state;
};

std::vector<Pose5> random_poses(const Machine& machine, Draw& draw, int count) {
  std::vector<Pose5> out;
  while (static_cast<int>(out.size()) < count) {
    Pose5 p;
    p.tip_P = draw.vector(80);
    const AxisId A = *machine.axis("A"), C = *machine.axis("C");
    p.state.q[A] = draw.uniform(machine.axes[A].min, machine.axes[A].max);
    p.state.q[C] = draw.uniform(-kPi, kPi);
    for (AxisId id = 0; id < machine.axes.size(); ++id)
      p.state.direction[id] = draw.uniform(0, 1) < 0.5 ? -1 : 1;
    solve_linear(machine, p.tip_P, machine.tool_vector(), p.state.q);
    p.axis_P = tool_pose(forward(machine, p.state.q)).axis_P;
    out.push_back(p);
  }
  return out;
}

// The tip on the machine with the errors of `truth`, from the forward model itself.
double tip_error(const Machine& machine, const ModelEvaluator& truth, const Pose5& p, const JointVector& q) {
  MachineState state = p.state;
  state.q = q;
  return (forward(machine, q, machine.tool_vector(), truth.errors(state)).p - p.tip_P).norm();
}

double mean_error(const Machine& machine, const Model& model, const std::vector<Pose5>& poses) {
  const ModelEvaluator truth(model);
  double sum = 0.0;
  for (const Pose5& p : poses) sum += tip_error(machine, truth, p, p.state.q);
  return sum / static_cast<double>(poses.size());
}

Model scaled(Model model, double factor) {
  for (ModelEffect& e : model.effects) {
    for (ParameterValue& p : e.parameters) p.value *= factor;
  }
  return model;
}

// A random machine with random errors that move the tip by so much on an average over these poses.
struct RandomCase {
  RandomCase(Draw& draw, int count, double mean_mm)
      : machine(random_machine(draw)),
        poses(random_poses(machine, draw, count)),
        model(random_model(machine, draw)) {
    model = scaled(model, mean_mm / mean_error(machine, model, poses));
  }
  Machine machine;
  std::vector<Pose5> poses;
  Model model;
};

// What the control runs: words of 4 decimals, XYZ computed from the rounded angles.
JointVector through_nc_text(const Machine& machine, const Compensator& compensator, const Pose5& p) {
  const Vec3 tool = machine.tool_vector();
  MachineState state = p.state;
  const auto digits = [](double v) { return parse_number(fixed_text(v, 4)).value; };
  for (const AxisId id : machine.rotary_axes())
    state.q[id] = Angle::degrees(digits(Angle::radians(state.q[id]).deg())).rad();
  const auto corrected = compensator.corrected(p.tip_P, p.axis_P, state);
  EXPECT_TRUE(corrected);
  JointVector words = words_of(machine, corrected->q, tool);
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    if (machine.axes[id].kind == AxisKind::linear) words[id] = digits(words[id]);
  }
  return joints_of_words(machine, words, tool);
}

TEST(Compensation, TwentyRandomMachinesWithTheTrueModel) {
  Draw draw(20261121);
  double before = 0.0, worst = 0.0, worst_text = 0.0;
  int most_steps = 0, first_two = 0, all = 0;
  constexpr int kMachines = 20;
  for (int m = 0; m < kMachines; ++m) {
    const Machine machine = random_machine(draw);
    const auto poses = random_poses(machine, draw, 100);
    Model model = random_model(machine, draw);
    constexpr double kMean = 0.150;  // mm
    model = scaled(model, kMean / mean_error(machine, model, poses));
    before += mean_error(machine, model, poses) / 20.0;
    const ModelEvaluator truth(model);
    const Compensator compensator(machine, model, machine.tool_vector());
    for (const Pose5& p : poses) {
      const auto corrected = compensator.corrected(p.tip_P, p.axis_P, p.state);
      ASSERT_TRUE(corrected) << corrected.error().message;
      worst = std::max(worst, tip_error(machine, truth, p, corrected->q));
      most_steps = std::max(most_steps, corrected->steps);
      first_two += corrected->steps <= 2 ? 1 : 0;
      ++all;
      EXPECT_NEAR(corrected->before_mm, tip_error(machine, truth, p, p.state.q), 1e-9);
      worst_text =
          std::max(worst_text, tip_error(machine, truth, p, through_nc_text(machine, compensator, p)));
    }
  }
  std::printf(
      "[ figures  ] before %.1f um mean; after %.3f nm at most; in NC text of 4 decimals %.3f um at most; "
      "steps <= %d (2 in %d of %d)\n",
      before * 1e3, worst * 1e6, worst_text * 1e3, most_steps, first_two, all);
  EXPECT_NEAR(before, 0.150, 1e-3);
  EXPECT_LT(worst, 2e-6);
  EXPECT_LT(worst_text, 0.4e-3);
  EXPECT_LE(most_steps, 3);
}

// Tests run side by side, and so do builds of two working copies.
std::filesystem::path own_folder() {
  return std::filesystem::temp_directory_path() /
         (std::string("trunnion_compensation_") +
          testing::UnitTest::GetInstance()->current_test_info()->name() + "_" + std::to_string(::getpid()));
}

// Component tables from simulated measurements of every component, five runs averaged, straight into a model:
// over one axis, or (`planar`) those of X and Y over the grid of both.
class GridMeasurement {
 public:
  GridMeasurement(const Machine& machine, Draw& draw, bool planar = false)
      : machine_(machine), draw_(draw), planar_(planar), folder_(own_folder()) {
    std::filesystem::create_directories(folder_);
  }
  ~GridMeasurement() { std::filesystem::remove_all(folder_); }
  GridMeasurement(const GridMeasurement&) = delete;
  GridMeasurement& operator=(const GridMeasurement&) = delete;

  // `signal` 1 measures the truth, 0 only the noise.
  Model model_of(const Model& truth, double signal, double sigma_mm, double sigma_rad) {
    const ModelEvaluator evaluator(truth);
    std::string toml;
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const Axis& axis = machine_.axes[id];
      const bool planar = planar_ && (axis.name == "X" || axis.name == "Y");
      const std::vector<AxisId> arguments =
          planar ? std::vector{*machine_.axis("X"), *machine_.axis("Y")} : std::vector{id};
      ErrorTable table;
      for (const AxisId argument : arguments) {
        table.arguments.push_back(machine_.axes[argument].name);
        table.nodes.push_back(nodes_of(machine_.axes[argument], planar ? kGridNodes : kNodes));
      }
      const std::vector<double> second = planar ? table.nodes[1] : std::vector{0.0};
      for (std::size_t c = 0; c < 6; ++c) {
        const std::string name = std::string("E") + "XYZABC"[c] + axis.name;
        table.components.push_back({name, {}});
        for (const double u : table.nodes[0]) {
          for (const double v : second) {
            MachineState state;
            if (planar) state.q[arguments[1]] = v;
            state.q[arguments[0]] = u;
            const Twist twist = evaluator.errors(state).joint[id];
            const double value = c < 3 ? twist.trans_mm[static_cast<Eigen::Index>(c)]
                                       : twist.rot_rad[static_cast<Eigen::Index>(c - 3)];
            const double noise = (c < 3 ? sigma_mm : sigma_rad) / std::sqrt(kRuns) * draw_.normal();
            table.components.back().values.push_back(signal * value + noise);
          }
        }
        toml += "[[effect]]\nid = \"component:" + name + "\"\ntable = \"" + axis.name +
                ".csv\"\ninterpolation = \"spline\"\n";
      }
      std::ofstream(folder_ / (axis.name + ".csv")) << error_table_text(table, machine_);
    }
    Diagnostics diagnostics;
    auto model = parse_model(toml, (folder_ / "tables.toml").string(), machine_, {}, diagnostics);
    EXPECT_TRUE(model) << (model ? "" : model.error().text());
    return model.value_or(Model{});
  }

 private:
  static std::vector<double> nodes_of(const Axis& axis, int count) {
    const double min = axis.has_limits() ? axis.min : -kPi;
    const double max = axis.has_limits() ? axis.max : kPi;
    std::vector<double> out;
    for (int i = 0; i < count; ++i) out.push_back(min + (max - min) * i / (count - 1));
    return out;
  }
  static constexpr int kNodes = 25;
  static constexpr int kGridNodes = 11;
  static constexpr double kRuns = 5.0;
  const Machine& machine_;
  Draw& draw_;
  bool planar_;
  std::filesystem::path folder_;
};

// Mean square of what a compensation with `tables` leaves at poses of a machine with `errors`, mm2.
double square_left(const Machine& machine, const std::vector<Pose5>& poses, const Model& errors,
                   const Model& tables) {
  const Compensator compensator(machine, tables, machine.tool_vector());
  const ModelEvaluator evaluator(errors);
  double sum = 0.0;
  for (const Pose5& p : poses) {
    const auto corrected = compensator.corrected(p.tip_P, p.axis_P, p.state);
    EXPECT_TRUE(corrected);
    sum += std::pow(tip_error(machine, evaluator, p, corrected->q), 2);
  }
  return sum / static_cast<double>(poses.size());
}

// A random machine whose C axis has limits, so that tables cover it.
Machine machine_for_tables(Draw& draw) {
  Machine machine = random_machine(draw);
  Axis& c = machine.axes[*machine.axis("C")];
  c.min = -kPi;
  c.max = kPi;
  return machine;
}

TEST(Compensation, WithMeasuredTablesWhatIsLeftIsTheNoise) {
  Draw draw(7);
  const Machine machine = machine_for_tables(draw);
  const auto poses = random_poses(machine, draw, 400);
  Model truth = random_model(machine, draw);
  truth = scaled(truth, 0.150 / mean_error(machine, truth, poses));
  constexpr double kSigma_mm = 1e-3, kSigma_rad = 2e-6;
  GridMeasurement grid(machine, draw);
  // Mean over measurements: one draw of the tables is one draw of their errors at all poses.
  double left = 0.0, floor = 0.0;
  constexpr int kCampaigns = 10;
  const Model none = scaled(truth, 0.0);
  for (int i = 0; i < kCampaigns; ++i) {
    left += square_left(machine, poses, truth, grid.model_of(truth, 1.0, kSigma_mm, kSigma_rad)) / kCampaigns;
    floor += square_left(machine, poses, none, grid.model_of(truth, 0.0, kSigma_mm, kSigma_rad)) / kCampaigns;
  }
  std::printf(
      "[ figures  ] 150 um before; with measured tables %.3f um RMS; noise floor of the measurement %.3f "
      "um\n",
      1e3 * std::sqrt(left), 1e3 * std::sqrt(floor));
  EXPECT_LT(std::sqrt(left), 1.1 * std::sqrt(floor));
}

// X and Y that bend each other: waves of 700 to 1400 mm over both axes in every component of both.
void add_cross_talk(const Machine& machine, Model& model, Draw& draw) {
  std::string toml;
  for (const char carrier : {'X', 'Y'}) {
    for (const char what : std::string("XYZABC")) {
      const bool length = what <= 'Z' && what >= 'X';
      const auto wave = [&](char axis) {
        return "sin(6.283185307179586*" + std::string(1, axis) + "/" +
               fixed_text(draw.uniform(700, 1400), 3) + "+" + fixed_text(draw.uniform(0, 6), 3) + ")";
      };
      toml += std::string("[[effect]]\nid = \"user:wave_") + what + carrier + "\"\njoint = \"" + carrier +
              "\"\ncomponent = \"E" + what + carrier + "\"\nexpression = \"k*" + wave('X') + "*" + wave('Y') +
              "\"\n[effect.parameters]\n" + (length ? "k_um = " : "k_urad = ") +
              fixed_text(draw.uniform(5, 15) * (length ? 1.0 : 2.0), 3) + "\n";
    }
  }
  Diagnostics diagnostics;
  const auto waves = parse_model(toml, "waves.toml", machine, {}, diagnostics);
  ASSERT_TRUE(waves) << waves.error().text();
  model.effects.insert(model.effects.end(), waves->effects.begin(), waves->effects.end());
}

// Twenty machines, each with its own errors and one campaign, the components of X and Y over the grid of both
// (11 x 11), the others over 25 nodes of their axis. What is left at 100 poses a machine is what the noise of
// the readings makes of a perfect machine; tables over one axis leave the cross-talk.
TEST(Compensation, TwentyRandomMachinesWithGridTablesAreAtTheNoiseFloor) {
  Draw draw(22);
  constexpr double kSigma_mm = 1e-3, kSigma_rad = 2e-6;
  double before = 0.0, left = 0.0, left_lines = 0.0, floor = 0.0;
  constexpr int kMachines = 20;
  for (int m = 0; m < kMachines; ++m) {
    const Machine machine = machine_for_tables(draw);
    const auto poses = random_poses(machine, draw, 100);
    Model truth = random_model(machine, draw);
    add_cross_talk(machine, truth, draw);
    truth = scaled(truth, 0.150 / mean_error(machine, truth, poses));
    before += mean_error(machine, truth, poses) / kMachines;
    GridMeasurement grid(machine, draw, true);
    left += square_left(machine, poses, truth, grid.model_of(truth, 1.0, kSigma_mm, kSigma_rad)) / kMachines;
    floor +=
        square_left(machine, poses, scaled(truth, 0.0), grid.model_of(truth, 0.0, kSigma_mm, kSigma_rad)) /
        kMachines;
    GridMeasurement lines(machine, draw);
    left_lines +=
        square_left(machine, poses, truth, lines.model_of(truth, 1.0, kSigma_mm, kSigma_rad)) / kMachines;
  }
  std::printf(
      "[ figures  ] %.1f um mean before; rms left: %.3f um with grid tables, %.3f um with lines only; noise "
      "floor of the measurement %.3f um\n",
      before * 1e3, 1e3 * std::sqrt(left), 1e3 * std::sqrt(left_lines), 1e3 * std::sqrt(floor));
  EXPECT_LT(std::sqrt(left), 1.1 * std::sqrt(floor));
  EXPECT_GT(std::sqrt(left_lines), 3.0 * std::sqrt(floor));
}

Model one_effect(const Machine& machine, const char* id, const char* key, double value) {
  Model model;
  const auto effect = make_effect(machine, model.context, id);
  EXPECT_TRUE(effect) << (effect ? "" : effect.error().message);
  model.effects.push_back(model_effect(*effect));
  model.effects[0].parameters[*model.effects[0].find(key)].value = value;
  return model;
}

TEST(Compensation, MovesAgainstTheError) {
  // The X scale carries the tool 10 um too far: 10 um less is commanded.
  const Machine machine = test::effect_machine("paper");
  const Model model = one_effect(machine, "tool_length", "Z0S", 0.010);
  const Compensator compensator(machine, model, machine.tool_vector());
  MachineState state;
  solve_linear(machine, Vec3(1, 2, 3), machine.tool_vector(), state.q);
  const auto c = compensator.corrected(Vec3(1, 2, 3), Vec3::UnitZ(), state);
  ASSERT_TRUE(c);
  EXPECT_NEAR(c->q[2], state.q[2] - 0.010, 1e-9);
  EXPECT_NEAR(c->q[0], state.q[0], 1e-12);
  EXPECT_EQ(c->steps, 1);
}

// What a neighbour was corrected by saves a step and changes nothing; the bound that ends the iteration
// holds.
TEST(Compensation, BeginsFromItsNeighbour) {
  Draw draw(12);
  int one_step = 0;
  for (int m = 0; m < 5; ++m) {
    const RandomCase at(draw, 200, 0.050);
    const Machine& machine = at.machine;
    const ModelEvaluator truth(at.model);
    const Compensator compensator(machine, at.model, machine.tool_vector());
    for (const Pose5& p : at.poses) {
      const auto far = compensator.corrected(p.tip_P, p.axis_P, p.state);
      ASSERT_TRUE(far) << far.error().message;
      const auto near = compensator.corrected(p.tip_P, p.axis_P, p.state, {}, far->aim_P + draw.vector(5e-4));
      ASSERT_TRUE(near) << near.error().message;
      EXPECT_LT(near->left_mm, 1e-6);
      EXPECT_LE(tip_error(machine, truth, p, near->q), near->left_mm + 1e-10);
      EXPECT_LE(tip_error(machine, truth, p, far->q), far->left_mm + 1e-10);
      EXPECT_NEAR(near->before_mm, far->before_mm, 1e-3 * far->before_mm + 1e-6);
      EXPECT_NEAR(far->before_mm, tip_error(machine, truth, p, p.state.q), 1e-12);
      EXPECT_LE(near->steps, far->steps);
      one_step += near->steps == 1;
    }
  }
  EXPECT_GT(one_step, 900);
}

// Away from the pole whole; near to it what lies in the plane in which A tilts the tool, and of the rest as
// much as C takes out with a turn by the sine of the tilt.
TEST(Compensation, OrientationIsCorrectedAsFarAsTheRotaryAxesReach) {
  Draw draw(11);
  int near_the_pole = 0;
  for (int m = 0; m < 10; ++m) {
    const RandomCase at(draw, 100, 0.150);
    const Machine& machine = at.machine;
    const ModelEvaluator truth(at.model);
    const CompensationOptions options{.orientation = true};
    const Compensator compensator(machine, at.model, machine.tool_vector(), options);
    const AxisId A = *machine.axis("A");
    const AxisId C = *machine.axis("C");
    std::vector<Pose5> poses = at.poses;
    // The same with A nearer to its zero, down to it.
    for (const Pose5& p : at.poses) {
      Pose5 near = p;
      near.state.q[A] = poses.size() % 10 == 0 ? 0.0 : std::pow(10.0, draw.uniform(-6.0, -1.0)) * draw.sign();
      solve_linear(machine, near.tip_P, machine.tool_vector(), near.state.q);
      near.axis_P = tool_pose(forward(machine, near.state.q)).axis_P;
      poses.push_back(near);
    }
    for (const Pose5& p : poses) {
      const auto c = compensator.corrected(p.tip_P, p.axis_P, p.state);
      ASSERT_TRUE(c) << c.error().message;
      MachineState state = p.state;
      state.q = c->q;
      const ToolPose actual = tool_pose(forward(machine, c->q, machine.tool_vector(), truth.errors(state)));
      EXPECT_LT((actual.tip_P - p.tip_P).norm(), 2e-6);
      const double left = angle_between(actual.axis_P, p.axis_P).rad();
      EXPECT_NEAR(left, angle_between(c->axis_P, p.axis_P).rad(), 1e-12);
      // Across the plane of the tilt: the way that A's axis points in P.
      const double sin_tilt = std::abs(std::sin(p.state.q[A]));
      const Vec3 across_P =
          Eigen::AngleAxisd(-p.state.q[C], machine.axes[C].direction) * machine.axes[A].direction;
      // What the errors do where the machine then stands.
      const Vec3 error_P = actual.axis_P - tool_pose(forward(machine, c->q)).axis_P;
      const double across = std::abs(error_P.dot(across_P));
      const double stays = std::max(0.0, across - sin_tilt * sin_tilt);
      near_the_pole += stays > 0.0;
      // The turn of C turns that way, too.
      EXPECT_NEAR(left, stays, stays > 0.0 ? error_P.norm() * (sin_tilt + 1e-3) : 1e-9) << sin_tilt;
      EXPECT_LE(std::abs(c->q[C] - p.state.q[C]), sin_tilt * (1.0 + 1e-9)) << sin_tilt;
      const Vec3 left_P = actual.axis_P - p.axis_P;
      EXPECT_LT((left_P - left_P.dot(across_P) * across_P).norm(), 1e-3 * across + 1e-9) << sin_tilt;
    }
  }
  EXPECT_GT(near_the_pole, 50);
}

TEST(Compensation, TheProbedDatumIsNotCorrectedTwice) {
  // X0C = 20 um, program zero probed at A = C = 0: nothing to correct there; half a turn on, twice the error.
  Machine machine = test::effect_machine("paper");
  machine.probed_at = JointVector{};
  const Model model = one_effect(machine, "location:C", "X0C", 0.020);
  const Compensator compensator(machine, model, machine.tool_vector());
  for (const double C : {0.0, kPi / 2, kPi}) {
    MachineState state;
    state.q[4] = C;
    solve_linear(machine, Vec3::Zero(), machine.tool_vector(), state.q);
    const auto c = compensator.corrected(Vec3::Zero(), Vec3::UnitZ(), state);
    ASSERT_TRUE(c);
    // The part stands at +20 um in X whatever C; where it was probed moved with the table to +20 um (cos C,
    // sin C).
    const Vec3 expected(0.020 - 0.020 * std::cos(C), -0.020 * std::sin(C), 0);
    const Vec3 moved(c->q[0] - state.q[0], c->q[1] - state.q[1], c->q[2] - state.q[2]);
    EXPECT_LT((moved - expected).norm(), 1e-9) << C;
  }
}

TEST(Compensation, BacklashGoesByTheSenseOfMotion) {
  const Machine machine = test::effect_machine("paper");
  const Model model = one_effect(machine, "backlash:X", "b", 0.010);
  const Compensator compensator(machine, model, machine.tool_vector());
  MachineState state;
  for (const int sense : {-1, 1}) {
    state.direction[0] = static_cast<std::int8_t>(sense);
    const auto c = compensator.corrected(Vec3(0, 0, -150), Vec3::UnitZ(), state);
    ASSERT_TRUE(c);
    EXPECT_NEAR(c->q[0], 0.005 * sense, 1e-9);
  }
}

TEST(Compensation, EffectsWithMemoryFollowTheProgram) {
  const Machine machine = test::effect_machine("paper");
  Model model = one_effect(machine, "spindle_growth", "Z", 2e-6);  // 2 um per 1000 rpm
  const Compensator compensator(machine, model, machine.tool_vector());
  LagFollower lags(compensator.evaluator().lags());
  MachineState state;
  state.spindle_rpm = 9000.0;
  solve_linear(machine, Vec3::Zero(), machine.tool_vector(), state.q);
  const auto at_start = compensator.corrected(Vec3::Zero(), Vec3::UnitZ(), state, lags.values());
  ASSERT_TRUE(at_start);
  EXPECT_NEAR(at_start->q[2], state.q[2], 1e-9);
  for (int i = 0; i < 2000; ++i) lags.hold(state, 1.0);  // one time constant
  const auto warm = compensator.corrected(Vec3::Zero(), Vec3::UnitZ(), state, lags.values());
  ASSERT_TRUE(warm);
  EXPECT_NEAR(warm->q[2] - state.q[2], -0.018 * (1.0 - std::exp(-1.0)), 1e-6);
}

TEST(Compensation, OutsideATableItHoldsOrStops) {
  const Machine machine = test::effect_machine("paper");
  const auto folder = own_folder();
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "t.csv") << "X_mm,EXX_um\n-50,1\n50,2\n";
  Diagnostics d;
  for (const char* outside : {"hold", "error"}) {
    const auto model = parse_model(
        std::string("[[effect]]\nid = \"component:EXX\"\ntable = \"t.csv\"\noutside = \"") + outside + "\"\n",
        (folder / "m.toml").string(), machine, {}, d);
    ASSERT_TRUE(model);
    const Compensator compensator(machine, *model, machine.tool_vector());
    MachineState state;
    state.q[0] = 80.0;
    const auto c = compensator.corrected(Vec3(80, 0, -150), Vec3::UnitZ(), state);
    if (std::string(outside) == "hold") {
      ASSERT_TRUE(c);
      EXPECT_TRUE(c->held);
      EXPECT_THAT(compensator.range_message(state), testing::HasSubstr("ends at 50 mm of X"));
      EXPECT_NEAR(c->q[0], 80.0 - 0.002, 1e-9);
    } else {
      ASSERT_FALSE(c);
      EXPECT_EQ(c.error().code, ErrorCode::check_failed);
    }
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace trunnion::path
