// Bounds on the whole tool, held against samples of the pose with a search of their own for the place of the
// path.
#include "trunnion/path/flute.hpp"

#include <algorithm>
#include <cstdio>
#include <gtest/gtest.h>
#include <random>

#include "path/bounds/closed_forms.hpp"
#include "path/random_segments.hpp"
#include "support/cases.hpp"
#include "support/machines.hpp"

namespace trunnion::path {
namespace {

using test::Family;
using test::kFamilies;
using test::RandomSegments;
using Segment = RandomSegments::Segment;

const Angle kTurnSteps[] = {Angle::degrees(5.0), Angle::degrees(30.0), Angle::degrees(120.0)};
constexpr double kLengths_mm[] = {5.0, 20.0, 100.0};
// The search of the tests stands no nearer to the best place than a way of the tool by this.
constexpr double kSearched_mm = 2e-8;

// The path's tool at the fraction t: Rodrigues' rotation about the normal of both axes.
ToolPose path_tool(const Reference& r, double t) {
  const Vec3 n = r.axis0_P.cross(r.axis1_P);
  Vec3 axis = r.axis0_P;
  if (n.norm() > 1e-14) {
    const double angle = t * std::atan2(n.norm(), r.axis0_P.dot(r.axis1_P));
    const Vec3 k = n.normalized();
    axis = r.axis0_P * std::cos(angle) + k.cross(r.axis0_P) * std::sin(angle) +
           k * (k.dot(r.axis0_P) * (1.0 - std::cos(angle)));
  }
  return {r.tip0_P + t * (r.tip1_P - r.tip0_P), axis};
}

// Of sixteen points of the tool, the largest distance from the same points of the path's at t.
double off_mm(const ToolPose& tool, const Reference& r, double flute_mm, double t) {
  const ToolPose path = path_tool(r, t);
  double largest = 0.0;
  for (int i = 0; i <= 15; ++i) {
    const double up = flute_mm * i / 15.0;
    largest = std::max(largest, (tool.tip_P + up * tool.axis_P - path.tip_P - up * path.axis_P).norm());
  }
  return largest;
}

// At the best place: a grid, then golden section about its best point.
double least_off_mm(const ToolPose& tool, const Reference& r, double flute_mm) {
  constexpr int kGrid = 24;
  double best = off_mm(tool, r, flute_mm, 0.0);
  double at = 0.0;
  for (int i = 1; i <= kGrid; ++i) {
    const double t = static_cast<double>(i) / kGrid;
    const double off = off_mm(tool, r, flute_mm, t);
    if (!(off < best)) continue;
    best = off;
    at = t;
  }
  double low = std::max(0.0, at - 1.0 / kGrid);
  double high = std::min(1.0, at + 1.0 / kGrid);
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  for (int i = 0; i < 40; ++i) {
    const double a = high - golden * (high - low);
    const double b = low + golden * (high - low);
    if (off_mm(tool, r, flute_mm, a) < off_mm(tool, r, flute_mm, b)) {
      high = b;
    } else {
      low = a;
    }
  }
  return std::min(best, off_mm(tool, r, flute_mm, 0.5 * (low + high)));
}

// The same points are within the limit at some place: between the feet of the tip and of the flute's end the
// two distances cross, so that halving finds a good place at once; only where that fails are all looked at.
bool is_within(const ToolPose& tool, const Reference& r, double flute_mm, double limit_mm) {
  constexpr int kHalvings = 30;
  const Vec3 chord = r.tip1_P - r.tip0_P;
  const double turn = std::atan2(r.axis0_P.cross(r.axis1_P).norm(), r.axis0_P.dot(r.axis1_P));
  if (turn < 1.0 && chord.norm() + flute_mm * turn > 0.0) {
    const Vec3 slope = r.axis1_P - r.axis0_P;
    const auto foot = [&](const Vec3& way, double up_mm) {
      const double way2 = way.squaredNorm();
      const Vec3 off = tool.tip_P - r.tip0_P + up_mm * (tool.axis_P - r.axis0_P);
      return way2 > 0.0 ? std::clamp(off.dot(way) / way2, 0.0, 1.0) : 0.5;
    };
    double low = foot(chord, 0.0);
    double high = foot(chord + flute_mm * slope, flute_mm);
    for (int i = 0; i < kHalvings; ++i) {
      const double t = 0.5 * (low + high);
      const ToolPose path = path_tool(r, t);
      const Vec3 tip = tool.tip_P - path.tip_P;
      const Vec3 end = tip + flute_mm * (tool.axis_P - path.axis_P);
      const double tip2 = tip.squaredNorm();
      const double end2 = end.squaredNorm();
      if (std::max(tip2, end2) <= limit_mm * limit_mm && off_mm(tool, r, flute_mm, t) <= limit_mm)
        return true;
      (tip2 > end2 ? high : low) = t;
    }
  }
  return least_off_mm(tool, r, flute_mm) <= limit_mm;
}

class FluteOf : public testing::TestWithParam<std::string> {};

// A path that the piece follows about: its ends beside it, in place and direction.
Reference beside(RandomSegments& random, const Segment& s) {
  const auto any = [&](double size) -> Vec3 {
    return size * Vec3(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
  };
  const double off_mm = std::exp(random.uniform(std::log(1e-5), std::log(0.05)));
  return {s.a.tip_P + any(off_mm), s.b.tip_P + any(off_mm), (s.a.axis_P + any(off_mm / 50.0)).normalized(),
          (s.b.axis_P + any(off_mm / 50.0)).normalized()};
}

// Without a sine: the axis of a motion beside an arc whose ends stand a little off its own.
TEST_P(FluteOf, AxisIsNoFartherFromItsArcThanTheTurnsTell) {
  RandomSegments segments(test::shipped_machine(GetParam()), test::seed(20261126));
  double tilted = 0.0;  // bound over the square of the turn, where the outer axis turns alone
  for (int i = 0; i < test::cases(60000); ++i) {
    const Segment s = segments.next(kFamilies[static_cast<std::size_t>(i) % kFamilies.size()],
                                    kTurnSteps[static_cast<std::size_t>(i / 5) % 2]);
    const TableKinematics& k = segments.kinematics();
    const double most_off = std::pow(10.0, segments.uniform(-7.0, -2.0));
    const auto beside = [&](const Vec3& u) {
      const Vec3 by(segments.uniform(-1.0, 1.0), segments.uniform(-1.0, 1.0), segments.uniform(-1.0, 1.0));
      return Vec3((u + most_off * by).normalized());
    };
    const Reference r{s.a.tip_P, s.b.tip_P, beside(s.a.axis_P), beside(s.b.axis_P)};
    const double off = std::max((s.a.axis_P - r.axis0_P).norm(), (s.b.axis_P - r.axis1_P).norm());
    const AxisMotion<double> motion = axis_motion(k, s.a, s.b);
    const double bound = off_for_each_mm_up(motion, off);
    const double turn = std::abs(motion.outer) + std::abs(motion.inner);
    for (int j = 1; j < 16; ++j) {
      const double t = j / 16.0;
      const Vec3 u = k.pose(JointVector::interpolate(s.a.q, s.b.q, t)).axis_P;
      ASSERT_LE((u - path_tool(r, t).axis_P).norm(), bound + 1e-13) << GetParam() << " " << i;
    }
    const AxisMotion<double> tilt{motion.outer, 0.0, motion.along_outer, motion.along_inner, motion.between};
    const bool tilts = std::abs(motion.along_outer) < 1e-6;  // the tool, at right angles
    if (tilts && std::abs(motion.outer) > 1e-3 && std::abs(motion.outer) < 0.05)
      tilted = std::max(tilted, off_for_each_mm_up(tilt, 0.0) / (motion.outer * motion.outer));
    // Two norms, that of the motion and that of the arc: a quarter of the square of the turn.
    if (turn < 0.02) {
      ASSERT_LE(bound, 1.05 * off + 0.25 * turn * turn + 1e-13);
    }
  }
  // What is left of a tilt of an axis at right angles to the tool: here the norms are 0.25.
  EXPECT_LT(tilted, 0.02);
}

// 1e8 with TRUNNION_SEGMENTS=100000000, or in smaller numbers with as many values of TRUNNION_SEED.
TEST_P(FluteOf, NoSampleLiesAboveTheBound) {
  RandomSegments random(test::shipped_machine(GetParam()), test::seed(20261123));
  const FluteCertifier certifier(random.kinematics());
  const int count = test::cases(200000, "TRUNNION_SEGMENTS") / 4;
  int wrong = 0;
  for (int i = 0; i < count && wrong < 5; ++i) {
    const Family family = kFamilies[static_cast<std::size_t>(i) % kFamilies.size()];
    const Segment s = random.next(family, kTurnSteps[(i / 5) % 3]);
    const Reference r = i % 2 == 0 ? s.own() : beside(random, s);
    const FluteSegment segment(r, kLengths_mm[(i / 15) % 3]);
    const Bound bound = certifier.deviation(s.a, s.b, segment);
    EXPECT_LE(bound.lower, bound.upper);
    for (int k = 0; k < 3; ++k) {
      const double t = random.uniform(0.0, 1.0);
      const ToolPose tool = random.kinematics().pose(JointVector::interpolate(s.a.q, s.b.q, t));
      // Where the place that the bound stands for is at least as good as any that the samples find.
      if (is_within(tool, r, segment.flute_mm(), bound.upper * (1.0 + 1e-9) + kSearched_mm)) continue;
      ++wrong;
      ADD_FAILURE() << "case " << i << " at " << t << ": " << least_off_mm(tool, r, segment.flute_mm())
                    << " above " << bound.upper;
    }
  }
}

using LongFluteOf = FluteOf;

TEST_P(LongFluteOf, BoundIsWithinFivePercentOfTheTruth) {
  RandomSegments random(test::shipped_machine(GetParam()), test::seed(7));
  const FluteCertifier certifier(random.kinematics());
  double worst = 0.0;
  for (int i = 0; i < test::cases(600, "TRUNNION_CASES"); ++i) {
    const Family family = kFamilies[static_cast<std::size_t>(i) % kFamilies.size()];
    const Segment s = random.next(family, kTurnSteps[(i / 5) % 2]);
    const Reference r = i % 2 == 0 ? s.own() : beside(random, s);
    const FluteSegment segment(r, kLengths_mm[(i / 15) % 3]);
    const Bound bound = certifier.deviation(s.a, s.b, segment);
    double truth = 0.0;
    for (int k = 0; k <= 200; ++k) {
      const ToolPose tool = random.kinematics().pose(JointVector::interpolate(s.a.q, s.b.q, k / 200.0));
      truth = std::max(truth, least_off_mm(tool, r, segment.flute_mm()));
    }
    if (truth < 1e-4) continue;
    worst = std::max(worst, bound.upper / truth);
    EXPECT_LE(bound.upper, 1.05 * truth) << "case " << i << " of " << GetParam();
  }
  std::printf("[ figures  ] bound over the largest of 201 samples: %.4f at most\n", worst);
}

// Across the equator of A a turn of both axes leaves the great circle on one side before it and on the other
// behind: nothing in the middle, and nothing at the ends. The tip stands where the path has it, or goes its
// own way. Beside a path that is off to one side only what a bound adds for third derivatives tells of it.
TEST_P(FluteOf, BoundHoldsWhereTheAxisIsOffOnBothSidesOfItsArc) {
  const Machine machine = test::shipped_machine(GetParam());
  const TableKinematics kinematics(machine, machine.tool_vector());
  const FluteCertifier straight(kinematics, FluteCertifier::Tip::straight);
  std::mt19937_64 random(31);
  const auto any = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  // The equator: the tool axis is farthest from the axis of C.
  const AxisId outer = kinematics.rotary(0);
  double equator = 0.0;
  double least = 1.0;
  for (int i = 0; i < 3600; ++i) {
    JointVector q;
    q[outer] = i * kTwoPi / 3600.0;
    const double cosine = std::abs(kinematics.axis_P(kinematics.sines(q)).dot(kinematics.direction(1)));
    if (cosine >= least) continue;
    least = cosine;
    equator = q[outer];
  }
  int told = 0;
  for (int i = 0; i < test::cases(100); ++i) {
    JointVector q0;
    JointVector q1;
    const double tilt = any(0.05, 0.3);
    const double turn = any(0.2, 0.8);
    q0[outer] = equator - tilt;
    q1[outer] = equator + tilt;
    q0[kinematics.rotary(1)] = -turn;
    q1[kinematics.rotary(1)] = turn;
    const Vec3 tip(any(-50.0, 50.0), any(-50.0, 50.0), any(-50.0, 50.0));
    const Vec3 way = Vec3(any(-1.0, 1.0), any(-1.0, 1.0), any(-1.0, 1.0));
    kinematics.solve_linear(tip, kinematics.sines(q0), q0);
    kinematics.solve_linear(tip + way, kinematics.sines(q1), q1);
    const Station a = station(kinematics, q0);
    const Station b = station(kinematics, q1);
    const double flute_mm = any(20.0, 100.0);
    const Vec3 across = a.axis_P.cross(b.axis_P).normalized();
    // As far off as the course itself leaves its arc, or a few times that.
    const double beside = any(0.0, 0.03);
    const Reference r{a.tip_P, b.tip_P, (a.axis_P - beside * across).normalized(),
                      (b.axis_P - beside * across).normalized()};
    const FluteSegment segment(r, flute_mm);
    const Bound bound = straight.deviation(a, b, segment);
    double truth = 0.0;
    double of_three = 0.0;
    for (int k = 0; k <= 64; ++k) {
      const double t = k / 64.0;
      const Vec3 axis_P = kinematics.axis_P(kinematics.sines(JointVector::interpolate(q0, q1, t)));
      const double off = least_off_mm({tip + t * way, axis_P}, r, flute_mm);
      truth = std::max(truth, off);
      if (k % 32 == 0) of_three = std::max(of_three, off);
    }
    told += truth > 1.1 * of_three;
    EXPECT_GE(bound.upper, truth - kSearched_mm) << GetParam() << " " << i << " " << of_three;
    EXPECT_LE(bound.upper, 1.05 * truth) << GetParam() << " " << i;
    EXPECT_EQ(straight.within(a, b, segment, 0.98 * truth), Within::no) << GetParam() << " " << i;
    EXPECT_EQ(straight.within(a, b, segment, 1.05 * truth), Within::yes) << GetParam() << " " << i;
  }
  // Where the outer axis is not square to the inner one the axis turns back there.
  const bool is_square = std::abs(kinematics.direction(0).dot(kinematics.direction(1))) < 1e-9;
  EXPECT_TRUE(told > test::cases(100) / 10 || !is_square) << told;
}

// What the decision says is what the bound says.
TEST_P(FluteOf, DecisionsAgreeWithBounds) {
  RandomSegments random(test::shipped_machine(GetParam()), 11);
  const FluteCertifier certifier(random.kinematics());
  int undecided = 0;
  for (int i = 0; i < test::cases(20000); ++i) {
    const Segment s =
        random.next(kFamilies[static_cast<std::size_t>(i) % kFamilies.size()], kTurnSteps[(i / 5) % 2]);
    const FluteSegment segment(beside(random, s), kLengths_mm[(i / 15) % 3]);
    const Bound bound = certifier.deviation(s.a, s.b, segment);
    const double tolerance = bound.upper * random.uniform(0.5, 1.5) + 1e-9;
    const Within within = certifier.within(s.a, s.b, segment, tolerance);
    if (tolerance < bound.lower) {
      EXPECT_EQ(within, Within::no) << i;
    }
    if (tolerance > bound.upper) {
      EXPECT_EQ(within, Within::yes) << i;
    }
    undecided += within == Within::unknown ? 1 : 0;
  }
  EXPECT_LE(undecided, test::cases(20000) / 1000);
}

INSTANTIATE_TEST_SUITE_P(Machines, FluteOf, testing::ValuesIn(test::shipped_machines()));
INSTANTIATE_TEST_SUITE_P(LongMachines, LongFluteOf, testing::ValuesIn(test::shipped_machines()));

}  // namespace
}  // namespace trunnion::path
