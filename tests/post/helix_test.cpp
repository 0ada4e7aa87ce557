// A helix about the axis of C, the tool axis turning with it: the machine holds the tool nearly still and
// turns the table, so that one block goes through many CL points and far from the chord between its ends.
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/base/number_text.hpp"

#include "post/posting.hpp"
#include "support/cases.hpp"

namespace trunnion::post {
namespace {

struct Helix {
  int points = 0;
  double step = 0.0, tilt = 0.0, ahead = 0.0;  // rad
  double radius_mm = 0.0, pitch_mm = 0.0;      // the latter from point to point

  std::string cl() const {
    std::string out = "FEDRAT/MMPM,3000\nRAPID\n";
    for (int k = 0; k < points; ++k) {
      const double turn = step * k;
      out += test::point_text({radius_mm * std::cos(turn), radius_mm * std::sin(turn), pitch_mm * k},
                              test::tilted(tilt, turn + ahead));
    }
    return out;
  }
};

Helix random_helix(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  Helix out;
  out.points = 40 + static_cast<int>(160.0 * u(random));
  out.step = (1.5 + 5.0 * u(random)) * kRadPerDegree;
  out.tilt = 0.1 + 0.2 * u(random);
  out.ahead = kTwoPi * u(random);
  out.radius_mm = 4.0 + 20.0 * u(random);
  // Half of them climb so little that X Y Z nearly stand: F says the turn then, at the speed of the axis.
  out.pitch_mm = u(random) < 0.5 ? 0.05 * u(random) : 1e-4 * u(random);
  return out;
}

PostOptions thinned() {
  PostOptions options;
  options.tolerance_mm = 0.1;
  options.axis_tolerance = Angle::degrees(0.2);
  options.nonlinear.thin = true;
  return options;
}

double largest_turn(const std::string& nc) {
  double last = 0.0;
  double out = 0.0;
  bool cuts = false;
  for (const nc::Block& block : test::nc_blocks(test::shipped_controller("linuxcnc"), nc)) {
    const auto* motion = std::get_if<nc::Motion>(&block);
    if (motion == nullptr || !motion->words.has(nc::AxisLetter::C)) continue;
    const auto quanta = motion->words[nc::AxisLetter::C];
    const double c = test::shipped_controller("linuxcnc").numbers.axes.internal(nc::AxisLetter::C, quanta);
    if (cuts && motion->kind == nc::MotionKind::feed) out = std::max(out, std::abs(c - last));
    cuts = true;
    last = c;
  }
  return out;
}

class HelixOn : public testing::TestWithParam<std::string> {};

TEST_P(HelixOn, ThinnedBlocksTurnFarAndNeverByHalfATurn) {
  const Machine machine = test::shipped_machine(GetParam());
  std::mt19937_64 random(91);
  double largest = 0.0;
  for (int i = 0; i < test::cases(40, "TRUNNION_CASES"); ++i) {
    const Helix helix = random_helix(random);
    const auto p = test::posted(helix.cl(), machine, thinned());
    ASSERT_TRUE(p.report) << p.report.error().text();
    const VerifyReport& v = *p.report->verification;
    EXPECT_TRUE(v.passed()) << v.certified_tip_deviation_mm << " mm, " << v.max_axis_deviation.deg()
                            << " deg, speed " << v.max_speed_ratio << ", missed " << v.points_missed << "\n"
                            << helix.cl();
    EXPECT_EQ(v.points_missed, 0U);
    const double turn = largest_turn(p.nc);
    EXPECT_LT(turn, kPi);
    largest = std::max(largest, turn);
  }
  EXPECT_GT(largest, 2.0);
}

TEST_P(HelixOn, AWrongWordOfAFarTurnIsFound) {
  const Machine machine = test::shipped_machine(GetParam());
  std::mt19937_64 random(92);
  for (int i = 0; i < test::cases(40, "TRUNNION_CASES"); ++i) {
    const std::string cl = random_helix(random).cl();
    const auto p = test::posted(cl, machine, thinned());
    ASSERT_TRUE(p.report) << p.report.error().text();
    constexpr double kWrong_mm = 0.4;
    const auto v = test::verified(test::with_changed_word(p.nc, random, kWrong_mm), cl, machine, 0.1);
    ASSERT_TRUE(v) << v.error().text();
    EXPECT_FALSE(v->passed());
  }
}

// A comma that was lost: neither a wait nor a program.
TEST_P(HelixOn, AWordOfMillionsOfTurnsIsRefusedAtOnce) {
  const Machine machine = test::shipped_machine(GetParam());
  std::mt19937_64 random(93);
  const std::string cl = random_helix(random).cl();
  std::string nc = test::posted(cl, machine, thinned()).nc;
  const auto at = nc.find('C', nc.find("G1")) + 1;
  nc.replace(at, nc.find_first_of(" \n", at) - at, "-99999999999");
  const auto v = test::verified(nc, cl, machine, 0.1);
  ASSERT_TRUE(v) << v.error().text();
  EXPECT_FALSE(v->passed());
}

INSTANTIATE_TEST_SUITE_P(Machines, HelixOn, testing::ValuesIn(test::shipped_machines()));

}  // namespace
}  // namespace trunnion::post
