// Cuts that come exactly to the pole, go on along it and leave it elsewhere: on every kind of table C stands
// at the pole as the great circles before and behind it lead it.
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/machine/kinematics.hpp"

#include "post/posting.hpp"
#include "support/cases.hpp"

namespace trunnion::post {
namespace {

// The shipped nutating table with the outer axis elsewhere in the Y-Z or X-Z plane.
Machine nutating(double from_z_deg, bool in_xz) {
  Machine machine = test::shipped_machine("nutating_45");
  const double s = std::sin(from_z_deg * kRadPerDegree);
  const double c = std::cos(from_z_deg * kRadPerDegree);
  machine.axes[*machine.axis("B")].direction = in_xz ? Vec3(s, 0.0, c) : Vec3(0.0, s, c);
  return machine;
}

std::string into_the_pole(std::mt19937_64& random) {
  const auto any = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto some = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  Vec3 tip(any(-240.0, 240.0), any(-120.0, 120.0), any(0.0, 40.0));
  const auto step = [&] { tip += Vec3(any(-3.0, 10.0), any(-3.0, 10.0), any(-1.0, 1.0)); };
  std::string cl = "FEDRAT/250.,MMPM\nRAPID\n";
  const auto put = [&](double tilt_deg, double towards) {
    cl += test::point_text(tip, test::tilted(tilt_deg * kRadPerDegree, towards));
    step();
  };
  for (int pass = 0; pass < 2; ++pass) {
    const double largest_deg = any(0.5, 12.0);
    const double towards = any(-kPi, kPi);
    const int coming = some(1, 4);
    for (int i = coming; i > 0; --i) put(largest_deg * i / coming, towards + any(-0.05, 0.05));
    for (int i = some(1, 4); i > 0; --i) put(0.0, 0.0);
    const double away = some(0, 1) == 0 ? towards + kPi : any(-kPi, kPi);
    const int leaving = some(1, 3);
    for (int i = 1; i <= leaving; ++i) put(any(0.5, 10.0) * i / leaving, away);
  }
  return cl;
}

TEST(LongPoleEntry, CutsIntoTheExactPoleArePostedOnEveryKindOfTable) {
  const int files = test::cases(60, "TRUNNION_CASES");
  struct Kind {
    const char* name;
    Machine machine;
  };
  const std::vector<Kind> kinds = {{"A-C", test::shipped_machine("trunnion_offset")},
                                   {"45 deg", test::shipped_machine("nutating_45")},
                                   {"30 deg", nutating(30.0, false)},
                                   {"65 deg", nutating(65.0, false)},
                                   {"45 deg in X-Z", nutating(45.0, true)},
                                   {"-45 deg", nutating(-45.0, false)}};
  for (const Kind& kind : kinds) {
    int posted_files = 0;
    for (int i = 0; i < files; ++i) {
      std::mt19937_64 random(static_cast<unsigned>(i) + 77);
      const std::string cl = into_the_pole(random);
      const auto p = test::posted(cl, kind.machine);
      ASSERT_TRUE(p.report) << kind.name << " file " << i << ": " << p.report.error().text();
      const VerifyReport& v = *p.report->verification;
      EXPECT_TRUE(v.passed()) << kind.name << " file " << i << ": tip " << v.certified_tip_deviation_mm
                              << " axis " << v.max_axis_deviation.deg() << " points "
                              << v.max_point_deviation_mm << " missed " << v.points_missed << "\n"
                              << cl;
      posted_files += v.passed() ? 1 : 0;
    }
    std::printf("[ figures  ] %s: %d of %d files\n", kind.name, posted_files, files);
  }
}

// Straight into the pole: C there is what the inverse tends to along the same great circle.
TEST(PoleEntry, CComesToThePoleAsTheGreatCircleLeadsIt) {
  const Machine machine = nutating(40.0, false);
  const AxisId b = *machine.axis("B");
  const AxisId c = *machine.axis("C");
  std::mt19937_64 random(3);
  for (int i = 0; i < 20; ++i) {
    const double tilt = std::uniform_real_distribution<double>(0.05, 0.4)(random);
    const double towards = std::uniform_real_distribution<double>(-kPi, kPi)(random);
    const Vec3 tip(100.0, 20.0, 10.0);
    PostOptions options;
    options.collect = true;
    const auto p =
        test::posted("FEDRAT/250.,MMPM\nRAPID\n" + test::point_text(tip, test::tilted(tilt, towards)) +
                         test::point_text(tip + Vec3(10.0, 0.0, 0.0), Vec3::UnitZ()),
                     machine, options);
    ASSERT_TRUE(p.report) << p.report.error().text();
    const auto& blocks = p.report->verification->blocks;
    const JointVector at_pole = blocks.back().q;
    const double side = blocks[blocks.size() / 2].q[b] - at_pole[b];
    bool found = false;
    for (const auto& near : inverse(machine, {tip, test::tilted(1e-4, towards)}, {})) {
      if ((near.q[b] - at_pole[b]) * side <= 0.0) continue;
      found = true;
      EXPECT_NEAR(std::remainder(near.q[c] - at_pole[c], kTwoPi), 0.0, 1e-3) << i;
    }
    EXPECT_TRUE(found) << i;
  }
}

}  // namespace
}  // namespace trunnion::post
