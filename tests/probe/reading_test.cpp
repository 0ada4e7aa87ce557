#include "trunnion/probe/reading.hpp"

#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>
#include <regex>
#include <sstream>

#include "trunnion/machine/kinematics.hpp"

#include "probe/given.hpp"
#include "probe/hidden_machine.hpp"
#include "support/cases.hpp"

namespace trunnion::probe {
namespace {

using test::Given;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) out.push_back(line + "\n");
  return out;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string out;
  for (const std::string& line : lines) out += line;
  return out;
}

struct Campaign {
  explicit Campaign(std::uint64_t seed, std::size_t poses = 12, std::size_t sides = 4,
                    void (*change)(test::HiddenMachine&) = nullptr)
      : given("trunnion_offset") {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> off(-1.0, 1.0);
    options = given.options();
    options.poses = poses;
    options.sides = sides;
    program = make_program(given.machine, given.control, options).value();
    Diagnostics diagnostics;
    strokes = read_strokes(given.machine, given.control, program.text, "p.nc", diagnostics).value();
    hidden = given.hidden(options.ball);
    for (auto* place : {&hidden.a_point, &hidden.c_point, &hidden.ball}) {
      for (double& v : *place) v += off(random);
    }
    hidden.noise_mm = 0.001;
    hidden.period_s = 0.001;
    if (change != nullptr) change(hidden);
    log = test::run_probing(program.text, hidden, seed).log;
  }
  Result<ProbeReading> read(const std::string& text) const {
    return read_touches(given.machine, strokes, text, "log.txt", {});
  }

  Given given;
  ProgramOptions options;
  MadeProgram program;
  Strokes strokes;
  test::HiddenMachine hidden;
  std::string log;
};

// The touches took place, so the machine file of the program had the ball there; another file has not.
TEST(ProbeReading, RefusesAnotherMachineFile) {
  const Campaign campaign(3);
  const Given other("paper");
  const auto reading = read_touches(other.machine, campaign.strokes, campaign.log, "log.txt", {});
  ASSERT_FALSE(reading);
  EXPECT_EQ(reading.error().code, ErrorCode::wrong_input);
  EXPECT_THAT(reading.error().message, testing::HasSubstr("made with another machine file"));
}

// The centre of each pose is where the hidden machine has the ball, within what is said of it.
TEST(ProbeReading, FindsTheCentresAndKnowsHowWell) {
  double sum = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Campaign campaign(seed);
    const auto reading = campaign.read(campaign.log);
    ASSERT_TRUE(reading) << seed << ": " << reading.error().text();
    for (std::size_t i = 0; i < reading->poses.size(); ++i) {
      const auto& pose = reading->poses[i];
      const auto ball = campaign.hidden.ball_at(campaign.strokes.poses[i][3] * kDegreePerRad,
                                                campaign.strokes.poses[i][4] * kDegreePerRad);
      for (int k = 0; k < 2; ++k) {  // along Z a common offset comes in addition
        // The log has the positions of the tip, the joints are those of the spindle's gauge point.
        const double off = pose.sphere.center_mm[k] - ball[static_cast<std::size_t>(k)];
        sum += off * off / (pose.u_mm[k] * pose.u_mm[k]);
        ++count;
      }
    }
    EXPECT_NEAR(reading->radius_mm, campaign.hidden.reach_mm, 0.003);
  }
  EXPECT_NEAR(sum / count, 1.0, 0.15) << count;
}

// A displacement is that of the tool relative to the part: the forward model at the measured joints plus it
// is the ball.
// The largest distance of a centre from where the hidden machine has the ball.
double farthest_center_mm(const Campaign& campaign, const ProbeReading& reading) {
  double farthest = 0.0;
  // A shift that is the same at all poses is the probe's own, and not seen.
  Vec3 mean = Vec3::Zero();
  std::vector<Vec3> off;
  for (const PoseReading& pose : reading.poses) {
    const auto ball = campaign.hidden.ball_at(pose.q[*campaign.given.machine.axis("A")] * kDegreePerRad,
                                              pose.q[*campaign.given.machine.axis("C")] * kDegreePerRad);
    off.push_back(pose.sphere.center_mm - Vec3(ball[0], ball[1], ball[2]));
    mean += off.back() / static_cast<double>(reading.poses.size());
  }
  for (const Vec3& one : off) farthest = std::max(farthest, (one - mean).norm());
  return farthest;
}

// Three lobes of 4 um: with eight sides they are found and taken out, with four they move the centres and may
// leave no trace.
TEST(ProbeReading, FindsThreeLobesOfTheProbeWithEightSides) {
  const auto lobed = [](test::HiddenMachine& m) {
    m.lobe_mm = 0.004;
    m.lobe_phase = 0.7;
    m.noise_mm = 0.0003;
    m.period_s = 0.0;
  };
  int unseen = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Campaign eight(seed, 12, 8, lobed);
    const auto reading = eight.read(eight.log);
    ASSERT_TRUE(reading) << reading.error().text();
    ASSERT_EQ(reading->lobes.size(), 1U);
    const Lobes& found = reading->lobes.front();
    EXPECT_EQ(found.count, 3);
    EXPECT_NEAR(found.cos_mm, 0.004 * std::cos(0.7), 4.0 * found.u_mm);
    EXPECT_NEAR(found.sin_mm, -0.004 * std::sin(0.7), 4.0 * found.u_mm);
    EXPECT_LT(found.u_mm, 1e-4);
    EXPECT_LT(farthest_center_mm(eight, *reading), 0.001);
    EXPECT_NEAR(reading->scatter_mm, 0.0003, 0.0001);
    const Campaign four(seed, 12, 4, lobed);
    const auto blind = four.read(four.log);
    ASSERT_TRUE(blind) << blind.error().text();
    // Where the ball lies beside its place the four are not a quarter turn apart, and may tell a little.
    unseen += blind->lobes.empty();
    EXPECT_EQ(farthest_center_mm(four, *blind) > 0.002, blind->lobes.empty());
  }
  EXPECT_GE(unseen, 1);
}

TEST(ProbeReading, TwoAndFourLobesAreToldFromNone) {
  for (const int count : {2, 4}) {
    Campaign campaign(7, 12, 8);
    campaign.hidden.lobes = count;
    campaign.hidden.lobe_mm = 0.003;
    const auto reading = campaign.read(test::run_probing(campaign.program.text, campaign.hidden, 3).log);
    ASSERT_TRUE(reading) << reading.error().text();
    ASSERT_EQ(reading->lobes.size(), 1U) << count;
    EXPECT_EQ(reading->lobes.front().count, count);
    EXPECT_NEAR(reading->lobes.front().cos_mm, 0.003, 4.0 * reading->lobes.front().u_mm);
  }
}

// Noise alone is no lobe: at most 1 in 100.
TEST(ProbeReading, FindsNoLobesInNoise) {
  int found = 0;
  const int runs = test::cases(200);
  for (const std::size_t sides : {std::size_t{4}, std::size_t{8}}) {
    Campaign campaign(3, 8, sides);
    for (int i = 0; i < runs / 2; ++i) {
      const auto seed = static_cast<std::uint64_t>(100 + i);
      const auto reading = campaign.read(test::run_probing(campaign.program.text, campaign.hidden, seed).log);
      ASSERT_TRUE(reading) << reading.error().text();
      found += !reading->lobes.empty();
    }
  }
  std::printf("[ figures  ] lobes found in noise: %d of %d\n", found, runs);
  EXPECT_LE(found, runs / 100);
}

TEST(ProbeReading, GivesDeviationsOfTheToolRelativeToThePart) {
  const Campaign campaign(3);
  const auto reading = campaign.read(campaign.log);
  ASSERT_TRUE(reading);
  const std::string text = diagnosis::measurements_text(reading->data, campaign.given.machine);
  Diagnostics diagnostics;
  const auto again = diagnosis::parse_measurements(std::vector<diagnosis::NamedText>{{"d.csv", text}},
                                                   campaign.given.machine, diagnostics);
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(again->readings.size(), 3 * reading->poses.size());
  for (const auto& pose : reading->poses) {
    // Shifted by the deviation, the nominal machine has the stylus at the assumed ball.
    const Vec3 tool(0, 0, -campaign.options.ball.stylus_length_mm);
    const Vec3 d_P = part_in_machine(campaign.given.machine, pose.q).R.transpose() * pose.deviation_M;
    EXPECT_LT((forward(campaign.given.machine, pose.q, tool).p + d_P - campaign.options.ball.place_P).norm(),
              1e-9);
  }
}

// Which pose the message names, from 1; 0: none.
std::size_t pose_named(const Error& error) {
  std::smatch found;
  const std::string text = error.text();
  return std::regex_search(text, found, std::regex("pose (\\d+) \\(")) ? std::stoul(found[1]) : 0;
}

Vec3 linear(const Campaign& campaign, const JointVector& q) {
  return {q[*campaign.given.machine.axis("X")], q[*campaign.given.machine.axis("Y")],
          q[*campaign.given.machine.axis("Z")]};
}

struct Spoiled {
  std::string text;
  std::size_t pose = 0;  // that must be named, from 1
  std::string what;
};

// One of the six ways in which a log is spoiled, at a random place.
Spoiled spoil(const Campaign& campaign, int way, std::mt19937_64& random) {
  auto lines = lines_of(campaign.log);
  const auto& touches = campaign.strokes.touches;
  const auto any = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  const std::size_t i = any(lines.size());
  const std::size_t pose = touches[i].pose + 1;
  switch (way) {
    case 0:
      lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(i), lines[i]);
      return {joined(lines), pose, "doubled line " + std::to_string(i + 1)};
    case 1:
      lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(i));
      return {joined(lines), pose, "lost line " + std::to_string(i + 1)};
    case 2: {
      // Along the stroke, or along an axis of the machine, there or back.
      std::istringstream words(lines[i]);
      std::array<double, 9> at{};
      for (double& v : at) words >> v;
      const Vec3 way_mm = linear(campaign, touches[i].to) - linear(campaign, touches[i].from);
      const std::size_t axis = any(4);
      const Vec3 by =
          (any(2) == 0 ? 0.05 : -0.05) *
          (axis == 3 ? Vec3(way_mm.normalized()) : Vec3(Vec3::Unit(static_cast<Eigen::Index>(axis))));
      for (std::size_t k = 0; k < 3; ++k) at[k] += by[static_cast<Eigen::Index>(k)];
      std::ostringstream out;
      out.precision(6);
      out << std::fixed;
      for (std::size_t k = 0; k < 9; ++k) out << (k > 0 ? " " : "") << at[k];
      lines[i] = out.str() + "\n";
      return {joined(lines), pose, "shifted line " + std::to_string(i + 1)};
    }
    case 3: {
      // From one pose on, or at one pose, another ball is touched.
      test::HiddenMachine other = campaign.hidden;
      other.reach_mm += any(2) == 0 ? 0.5 : -0.2;
      const auto others = lines_of(test::run_probing(campaign.program.text, other, 9).log);
      const std::size_t at = any(campaign.strokes.poses.size());
      for (std::size_t k = 0; k < lines.size(); ++k) {
        if (touches[k].pose == at) lines[k] = others[k];
      }
      return {joined(lines), at + 1, "other ball at pose " + std::to_string(at + 1)};
    }
    case 4: {
      const std::size_t a = any(campaign.strokes.poses.size() - 1);
      std::vector<std::string> out;
      const auto add = [&](std::size_t which) {
        for (std::size_t k = 0; k < lines.size(); ++k) {
          if (touches[k].pose == which) out.push_back(lines[k]);
        }
      };
      for (std::size_t p = 0; p < campaign.strokes.poses.size(); ++p)
        add(p == a ? a + 1 : p == a + 1 ? a : p);
      return {joined(out), a + 1, "poses in another order from " + std::to_string(a + 1)};
    }
    default: {
      const std::size_t length = any(campaign.log.size());
      const std::string cut = campaign.log.substr(0, length);
      const auto whole = static_cast<std::size_t>(std::count(cut.begin(), cut.end(), '\n'));
      return {cut, touches[whole].pose + 1, "cut behind " + std::to_string(length) + " characters"};
    }
  }
}

TEST(LongProbeReading, RefusesEverySpoiledLogAndNamesThePose) {
  const char* asked = std::getenv("TRUNNION_SPOILED_LOGS");
  const int count = asked != nullptr ? std::atoi(asked) : 600;
  std::mt19937_64 random(20);
  for (int i = 0; i < count; ++i) {
    const Campaign campaign(100 + static_cast<std::uint64_t>(i / 60));
    const Spoiled spoiled = spoil(campaign, i % 6, random);
    const auto reading = campaign.read(spoiled.text);
    ASSERT_FALSE(reading) << i << ": " << spoiled.what;
    EXPECT_EQ(reading.error().code, ErrorCode::wrong_input);
    EXPECT_EQ(pose_named(reading.error()), spoiled.pose) << i << ": " << spoiled.what << "\n"
                                                         << reading.error().text();
  }
}

TEST(ProbeReading, TakesEveryLogThatIsNotSpoiled) {
  const char* asked = std::getenv("TRUNNION_SPOILED_LOGS");
  const int count = asked != nullptr ? std::atoi(asked) : 60;
  for (int i = 0; i < count; ++i) {
    const Campaign campaign(5000 + static_cast<std::uint64_t>(i));
    const auto reading = campaign.read(campaign.log);
    EXPECT_TRUE(reading) << i << ": " << reading.error().text();
  }
}

TEST(ProbeReading, RefusesALogOfAnotherBallAltogether) {
  Campaign campaign(7);
  for (const double by : {0.1, -0.2, 1.0}) {
    auto other = campaign.hidden;
    other.reach_mm += by;
    const auto reading = campaign.read(test::run_probing(campaign.program.text, other, 3).log);
    ASSERT_FALSE(reading) << by;
    EXPECT_EQ(pose_named(reading.error()), 1U);
    EXPECT_THAT(reading.error().message, testing::HasSubstr("another ball"));
  }
}

TEST(ProbeReading, RefusesAnEmptyLogAndAnyOtherText) {
  const Campaign campaign(8);
  for (const std::string text : {"", "\n\n", "hello\n", "1 2\n", ",\n", "= ;,\n", "nan nan nan 0 0 0 0 0 0\n",
                                 "1,2,3;x\n", "X1 Y2 Z\n", "X1 X2 Z3\n", "1e308 1e308 1e308 0 0 0 0 0 0\n"}) {
    const auto reading = campaign.read(text);
    ASSERT_FALSE(reading) << text;
    EXPECT_EQ(pose_named(reading.error()), 1U) << reading.error().text();
  }
}

// As other controls write it: letters, the linear axes alone.
TEST(ProbeReading, TakesLinesWithLetters) {
  const Campaign campaign(9);
  std::string text = "%\n";
  for (const std::string& line : lines_of(campaign.log)) {
    std::istringstream words(line);
    std::string x, y, z;
    words >> x >> y >> z;
    text += "X " + x + "Y" + y + " Z=" + z + "\r\n";
  }
  const auto lettered = campaign.read(text + "%\n");
  ASSERT_TRUE(lettered) << lettered.error().text();
  const auto plain = campaign.read(campaign.log);
  ASSERT_TRUE(plain);
  for (std::size_t i = 0; i < plain->poses.size(); ++i)
    EXPECT_LT((plain->poses[i].deviation_M - lettered->poses[i].deviation_M).norm(), 1e-9);
}

}  // namespace
}  // namespace trunnion::probe
