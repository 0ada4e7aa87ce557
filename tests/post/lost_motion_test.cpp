// Every placement through the whole post on random machines with errors and with lost motion in every axis:
// all programs are read back, proved, and within their tolerance. TRUNNION_CASES=60 for more than the
// default.
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/base/number_text.hpp"

#include "post/posting.hpp"
#include "support/cases.hpp"

namespace trunnion::post {
namespace {

using test::Posted;
using test::posted;

// Lost motion in every axis, and errors that bend paths: location, straightness, angles, a periodic one.
struct Kind {
  const char* name;
  path::Method method;
  bool one_sided, moves, thin;
};
constexpr Kind kKinds[] = {{"reinsert", path::Method::reinsert, false, false, false},
                           {"one-sided", path::Method::adaptive, true, false, false},
                           {"two-sided", path::Method::adaptive, false, false, false},
                           {"moved", path::Method::adaptive, false, true, false},
                           {"thinned", path::Method::adaptive, false, false, true}};

class PlacementOn : public testing::TestWithParam<std::string> {};

TEST_P(PlacementOn, MachinesWithErrorsAndLostMotionKeepTheTolerance) {
  const Machine machine = test::shipped_machine(GetParam());
  const auto count = static_cast<unsigned>(test::cases(3, "TRUNNION_CASES"));
  for (unsigned seed = 1; seed <= count; ++seed) {
    std::mt19937_64 random(seed);
    const Model model = test::random_errors(machine, random);
    const std::string cl = test::sample_path(100 + seed);
    const std::string dense = test::sample_path(100 + seed, 400);
    for (const double tolerance_mm : {0.004, 0.01, 0.002}) {
      for (const Kind& kind : kKinds) {
        PostOptions options;
        options.tolerance_mm = tolerance_mm;
        options.nonlinear.method = kind.method;
        options.nonlinear.one_sided = kind.one_sided;
        options.nonlinear.move_programmed_points = kind.moves;
        options.nonlinear.thin = kind.thin;
        const Posted p = posted(kind.thin ? dense : cl, machine, options, "linuxcnc", &model);
        ASSERT_TRUE(p.report) << p.report.error().text();
        const VerifyReport& v = *p.report->verification;
        EXPECT_TRUE(v.passed()) << kind.name << " seed " << seed << " tolerance " << tolerance_mm << ": tip "
                                << v.certified_tip_deviation_mm << " points " << v.max_point_deviation_mm
                                << " axis " << v.max_axis_deviation.deg() << " blocks " << v.feed_blocks
                                << " nominal " << p.report->nominal_verification->certified_tip_deviation_mm;
        EXPECT_TRUE(v.certified) << kind.name;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, PlacementOn, testing::ValuesIn(test::shipped_machines()));

}  // namespace
}  // namespace trunnion::post
