// Random paths on every machine and every control: what the program asks of the axes, read back from its
// words by formulas of the tests' own.
#include <array>
#include <gtest/gtest.h>
#include <iomanip>
#include <iostream>
#include <map>
#include <random>
#include <sstream>
#include <string>

#include "trunnion/base/units.hpp"
#include "trunnion/path/predictor.hpp"

#include "post/axis_speeds.hpp"
#include "post/posting.hpp"
#include "support/cases.hpp"
#include "support/lanes.hpp"

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

bool named_by_word(const std::string& error, const nc::Controller& c) {
  const auto says = [&](const char* what) { return error.find(what) != std::string::npos; };
  return says("beyond its limits") || says("the limit of") || says("miss it by") ||
         (c.retract[2].empty() && says("no safe position"));
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
          EXPECT_TRUE(named_by_word(text, shipped)) << text;
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

// Any options that can stand together; `--nonlinear none` alone is left out, whose programs are meant to
// fail.
PostOptions random_options(const nc::Controller& c, std::mt19937_64& random) {
  const auto chance = [&](double p) { return std::uniform_real_distribution<double>(0.0, 1.0)(random) < p; };
  PostOptions o;
  constexpr std::array kTolerances = {0.05, 0.01, 0.003};
  o.tolerance_mm = kTolerances[random() % kTolerances.size()];
  if (chance(0.3)) o.rapid_tolerance_mm = 5.0 * o.tolerance_mm;
  constexpr std::array kMethods = {path::Method::reinsert, path::Method::subtract, path::Method::adaptive};
  o.nonlinear.method = kMethods[random() % kMethods.size()];
  o.nonlinear.predictor.kind = static_cast<path::Predictor::Kind>(random() % 5);
  o.nonlinear.predictor.order =
      o.nonlinear.predictor.kind == path::Predictor::Kind::harmonic ? 1 + static_cast<int>(random() % 3) : 1;
  o.nonlinear.one_sided = chance(0.3);
  o.nonlinear.thin = o.nonlinear.method == path::Method::adaptive && chance(0.3);
  o.nonlinear.move_programmed_points = o.nonlinear.method == path::Method::adaptive && chance(0.2);
  o.nonlinear.certify = chance(0.8);
  o.choice = static_cast<path::ChoiceMethod>(random() % 5);
  if (chance(0.3)) o.pole.tolerance = Angle::degrees(0.5);
  o.rtcp = c.has_tcp() && chance(0.3);
  if (o.rtcp) o.nonlinear.thin = o.nonlinear.move_programmed_points = false;  // refused by word
  o.tilted_plane = !o.rtcp && c.has_tilted_plane() && chance(0.3);
  constexpr std::array kFeeds = {FeedOutput::inverse, FeedOutput::per_minute, FeedOutput::tip};
  o.feed = kFeeds[random() % (o.rtcp ? 3 : 2)];
  o.threads = chance(0.2) ? 2 : 1;
  return o;
}

TEST(EveryMachine, RandomPathsOnEveryControlKeepTravelAndSpeed) {
  random_posts(test::cases(10));
}

// Pieces that were sampled instead of proved (`--no-certify`) may leave the tube between two samples, on a
// machine with errors by more than on the nominal one: nobody promised anything.
bool only_sampled_short(const VerifyReport& v, const PostOptions& options) {
  return !options.nonlinear.certify && v.points_missed == 0 && v.speeds_ok() && v.limits_ok() &&
         v.max_point_deviation_mm <= options.tolerance_mm && v.max_axis_deviation <= v.axis_tolerance &&
         v.certified_tip_deviation_mm < 1.5 * options.tolerance_mm;
}

std::string text_of(const PostOptions& o, const Machine& machine) {
  const Axis& inner = machine.axes[machine.rotary_axes()[1]];
  std::ostringstream out;
  out << std::setprecision(15) << "one-sided " << o.nonlinear.one_sided << ", thin " << o.nonlinear.thin
      << ", moves " << o.nonlinear.move_programmed_points << ", certify " << o.nonlinear.certify
      << ", choice " << static_cast<int>(o.choice) << ", pole " << o.pole.tolerance.deg() << ", rtcp "
      << o.rtcp << ", tilted plane " << o.tilted_plane << ", feed " << static_cast<int>(o.feed)
      << ", threads " << o.threads << ", rapids " << o.rapid_tolerance_mm << ", inner axis "
      << inner.min * kDegreePerRad << " to " << inner.max * kDegreePerRad << " deg";
  return out.str();
}

// The blocks of the program about its worst place, for whoever looks into a refusal.
std::string around_worst(const VerifyReport& v, const std::string& nc) {
  if (v.worst.empty()) return {};
  const std::size_t worst = v.worst.front().nc_line;
  std::string out = "worst at block " + std::to_string(worst) + "\n";
  std::size_t line = 0;
  std::istringstream text(nc);
  for (std::string block; std::getline(text, block);) {
    if (++line + 6 >= worst && line <= worst + 3) out += block + "\n";
  }
  return out;
}

// Slow and fast machines: ramps of many blocks, and of none; and whose axes take 3 to 300 ms for getting to
// their acceleration.
void accelerate(Machine& machine, bool jerk, std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  for (Axis& axis : machine.axes) {
    const double slowest = axis.kind == AxisKind::linear ? 50.0 : 0.5;
    axis.acceleration = slowest * std::pow(100.0, u(random));
    if (jerk) axis.jerk = *axis.acceleration / (0.003 * std::pow(100.0, u(random)));
  }
}

void random_options_everywhere(int each, bool errors, bool accelerates) {
  std::mt19937_64 random(72);
  std::size_t feeds = 0, feeds_not_reached = 0;
  std::size_t programs = 0;
  std::size_t refused_by_verification = 0;
  std::map<std::string, std::size_t> refused;
  for (const std::string& name : test::shipped_machines()) {
    for (const std::string& control : test::shipped_controllers()) {
      const nc::Controller shipped = test::shipped_controller(control);
      for (int i = 0; i < each; ++i) {
        RandomPost job = random_post(name, random);
        PostOptions options = random_options(shipped, random);
        if (accelerates) accelerate(job.machine, i % 2 > 0, random);
        if (accelerates && i % 4 == 0 && !shipped.continuous_within.empty())
          options.smoothing_mm = options.tolerance_mm;
        if (errors) {
          // Lost motion is the control's own to take up under tool-centre-point control, and rapids are not
          // divided for errors: both are refused where the tolerance does not hold them.
          options.rtcp = false;
          options.feed = FeedOutput::inverse;
          options.rapid_tolerance_mm = 1e9;
        }
        const auto model = errors ? std::optional(test::random_errors(job.machine, random)) : std::nullopt;
        const auto p = test::posted(job.cl, job.machine, options, control, model ? &*model : nullptr);
        SCOPED_TRACE(name + " " + control + " " + std::to_string(i));
        if (!p.report) {
          const std::string text = p.report.error().text();
          ++refused[text.substr(text.find("error:"))];
          EXPECT_TRUE(named_by_word(text, shipped)) << text;
          continue;
        }
        ++programs;
        const VerifyReport& v = *p.report->verification;
        const bool taken = v.passed();
        feeds += v.feed_blocks;
        feeds_not_reached += v.feeds_not_reached;
        refused_by_verification += !taken;
        // Nobody has edited it: what is not its path is as the CL file asks for it.
        for (std::size_t k = 0; k < kChecks; ++k) {
          const auto of = static_cast<CheckOf>(k);
          if (of == CheckOf::path || of == CheckOf::rapids) continue;
          EXPECT_NE(v.checks[k].state, Check::State::failed)
              << name_of(of) << (v.checks[k].places.empty() ? "" : " " + v.checks[k].places[0].what);
        }
        EXPECT_TRUE(taken || only_sampled_short(v, options))
            << job.cl << "tip " << v.certified_tip_deviation_mm << " of " << options.tolerance_mm
            << ", method " << static_cast<int>(options.nonlinear.method) << ", predictor "
            << path::predictor_text(options.nonlinear.predictor) << ", " << v.points_missed
            << " missed, axis " << v.max_axis_deviation.deg() << ", in the cone "
            << v.max_pole_axis_deviation.deg() << ", speed " << v.max_speed_ratio << ", travel "
            << v.limits_ok() << ", rapids " << v.max_rapid_deviation_mm << ", points "
            << v.max_point_deviation_mm << "\n"
            << text_of(options, job.machine) << "\n"
            << around_worst(v, p.nc);
      }
    }
  }
  for (const auto& [why, count] : refused) std::cout << count << "  " << why << "\n";
  std::cout << programs << " programs, " << refused_by_verification << " refused by their verification\n";
  if (accelerates) std::cout << feeds_not_reached << " of " << feeds << " feeds not reached\n";
  EXPECT_GT(programs, test::shipped_machines().size() * test::shipped_controllers().size() *
                          static_cast<std::size_t>(each) * 9 / 10);
}

// Options are chosen by people, each for its own reason: whatever they combine is a program that its
// verification takes, or an error by name.
TEST(EveryMachine, RandomOptionsMakeProgramsThatVerify) {
  random_options_everywhere(test::cases(10), false, false);
  random_options_everywhere(test::cases(5), true, false);
}

// Feeds that the axes reach, whatever else is asked for.
TEST(EveryMachine, RandomOptionsOnAxesThatAccelerateMakeProgramsThatVerify) {
  random_options_everywhere(test::cases(10), false, true);
  random_options_everywhere(test::cases(5), true, true);
}

// Words of a micrometre and a thousandth of a degree, the tip 200 mm away from A: a digit of A is more at the
// tip, 3.5 micrometres, than what machines lose.
TEST(LongEveryMachine, CoarseWordsTakeUpLostMotion) {
  std::mt19937_64 random(97);
  std::size_t programs = 0;
  std::size_t refused = 0;
  for (int i = 0; i < test::cases(200, "TRUNNION_CASES"); ++i) {
    const RandomPost job = random_post("paper", random);
    const Model model = test::random_errors(job.machine, random);
    PostOptions options;
    options.tolerance_mm = 0.006;
    const auto p = test::posted(job.cl, job.machine, options, "iso", &model);
    if (!p.report) {
      EXPECT_TRUE(named_by_word(p.report.error().text(), test::shipped_controller("iso")));
      continue;
    }
    ++programs;
    const VerifyReport& v = *p.report->verification;
    refused += !v.passed();
    EXPECT_LE(v.certified_tip_deviation_mm, 1.1 * options.tolerance_mm) << i << "\n" << around_worst(v, p.nc);
  }
  EXPECT_LE(100 * refused, programs);
}

// The bytes do not hang on what the processor can.
TEST(LongEveryMachine, FourLanesWriteWhatTwoWrite) {
  std::mt19937_64 random(73);
  std::size_t written = 0;
  for (const std::string& name : test::shipped_machines()) {
    for (const std::string control : {"linuxcnc", "heidenhain_tnc640"}) {
      for (int i = 0; i < test::cases(60); ++i) {
        const RandomPost job = random_post(name, random);
        PostOptions options = random_options(test::shipped_controller(control), random);
        if (i % 3 > 0) options.rtcp = false;
        const auto model =
            i % 3 == 2 ? std::optional(test::random_errors(job.machine, random)) : std::nullopt;
        const auto post_with = [&](lanes::Way way) {
          const test::Calculating lanes(way);
          return test::posted(job.cl, job.machine, options, control, model ? &*model : nullptr);
        };
        const test::Posted two = post_with(lanes::Way::two);
        written += two.report ? 1U : 0U;
        for (const lanes::Way way : {lanes::Way::four, lanes::Way::four_in_32}) {
          const test::Posted four = post_with(way);
          SCOPED_TRACE(name + " " + control + " " + std::to_string(i));
          ASSERT_EQ(four.report.has_value(), two.report.has_value());
          ASSERT_EQ(four.nc, two.nc);
          if (!four.report) continue;
          EXPECT_EQ(four.report->duration_s, two.report->duration_s);
          EXPECT_EQ(four.report->verification->certified_tip_deviation_mm,
                    two.report->verification->certified_tip_deviation_mm);
        }
      }
    }
  }
  EXPECT_GT(written, test::shipped_machines().size() * 2 * static_cast<std::size_t>(test::cases(40)));
}

TEST(LongEveryMachine, RandomOptionsMakeProgramsThatVerify) {
  random_options_everywhere(test::cases(200, "TRUNNION_CASES"), false, false);
}

TEST(LongEveryMachine, RandomOptionsAndErrorsMakeProgramsThatVerify) {
  random_options_everywhere(test::cases(50, "TRUNNION_CASES"), true, false);
}

TEST(LongEveryMachine, RandomOptionsOnAxesThatAccelerateMakeProgramsThatVerify) {
  random_options_everywhere(test::cases(100, "TRUNNION_CASES"), false, true);
  random_options_everywhere(test::cases(50, "TRUNNION_CASES"), true, true);
}

TEST(LongEveryMachine, RandomPathsOnEveryControlKeepTravelAndSpeed) {
  random_posts(100);
}

}  // namespace
}  // namespace trunnion::post
