#include "trunnion/path/certificate.hpp"

#include <algorithm>
#include <cstdlib>
#include <gtest/gtest.h>

#include "trunnion/geom/pose.hpp"

#include "path/random_segments.hpp"
#include "support/cases.hpp"
#include "support/machines.hpp"

namespace trunnion::path {
namespace {

using test::Family;
using test::kFamilies;
using test::RandomSegments;
using Segment = RandomSegments::Segment;

// Independent of the certificate: the arc's nearest point is inside when the foot lies between the ends, else
// an end.
double angle_to_arc(const Vec3& u, const Vec3& u0, const Vec3& u1) {
  const double to_ends = std::min(angle_between(u, u0).rad(), angle_between(u, u1).rad());
  const Vec3 n = u0.cross(u1 - u0);
  if (n.norm() < 1e-14) return to_ends;
  const Vec3 m = n.normalized();
  const Vec3 foot = u - m.dot(u) * m;
  const bool inside = u0.cross(foot).dot(m) >= 0.0 && foot.cross(u1).dot(m) >= 0.0;
  return inside ? std::asin(std::min(1.0, std::abs(m.dot(u - u0)))) : to_ends;
}

struct Truth {
  double tip = 0.0;
  double axis = 0.0;
};
Truth sampled(const TableKinematics& kinematics, const Segment& s, const Reference& r, int samples,
              double phase) {
  Truth truth;
  for (int i = 0; i < samples; ++i) {
    const double t = (i + phase) / samples;
    const ToolPose pose = kinematics.pose(JointVector::interpolate(s.a.q, s.b.q, t));
    truth.tip = std::max(truth.tip, distance_to_segment(pose.tip_P, r.tip0_P, r.tip1_P));
    truth.axis = std::max(truth.axis, angle_to_arc(pose.axis_P, r.axis0_P, r.axis1_P));
  }
  return truth;
}

constexpr const char* kSegments = "TRUNNION_SEGMENTS";  // of all machines together

const Angle kSteps[] = {Angle::degrees(5.0), Angle::degrees(30.0), Angle::degrees(180.0)};

// No sample may lie above a bound of any form.
void expect_no_sample_above(const Machine& machine, int count, unsigned seed) {
  RandomSegments random(machine, seed);
  const TableKinematics& kinematics = random.kinematics();
  const Certifier certifier(kinematics);
  int violations = 0;
  for (int i = 0; i < count; ++i) {
    const Family family = kFamilies[static_cast<std::size_t>(i) % kFamilies.size()];
    const Segment s = random.next(family, kSteps[(i / 5) % 3]);
    const Reference r = s.own();
    const Truth truth = sampled(kinematics, s, r, 12, random.uniform(0.0, 1.0));
    const double tip = std::min({certifier.tip(s.a, s.b, r).upper, certifier.bow_from_norms(s.a, s.b),
                                 certifier.bow_from_cubic(s.a, s.b)});
    const double axis = certifier.axis(s.a, s.b, r).upper;
    if (truth.tip > tip || truth.axis > axis + 1e-15) {
      ++violations;
      ADD_FAILURE() << "case " << i << ": tip " << truth.tip << " above " << tip << ", axis " << truth.axis
                    << " above " << axis;
      if (violations > 5) return;
    }
  }
}

class CertificateOf : public testing::TestWithParam<std::string> {};

TEST_P(CertificateOf, NoSampleLiesAboveTheBound) {
  expect_no_sample_above(test::shipped_machine(GetParam()), test::cases(1000000, kSegments) / 4, 20261121);
}

// What the verification settles nearly every block by: tip and tool axis are nowhere farther from the chord
// of their ends, place by place.
TEST_P(CertificateOf, NothingIsFartherFromItsChordThanTheBowsFromNorms) {
  RandomSegments random(test::shipped_machine(GetParam()), 9);
  const TableKinematics& kinematics = random.kinematics();
  const Certifier certifier(kinematics);
  for (int i = 0; i < test::cases(20000); ++i) {
    const Family family = kFamilies[static_cast<std::size_t>(i) % kFamilies.size()];
    const Segment s = random.next(family, kSteps[(i / 5) % 3]);
    const Certifier::Bows bows = certifier.bows_from_norms(s.a, s.b);
    EXPECT_NEAR(bows.tip_mm, certifier.bow_from_norms(s.a, s.b), 1e-12 * (1.0 + bows.tip_mm));
    double tip = 0.0;
    double axis = 0.0;
    for (int k = 1; k < 16; ++k) {
      const double t = k / 16.0;
      const ToolPose pose = kinematics.pose(JointVector::interpolate(s.a.q, s.b.q, t));
      tip = std::max(tip, (pose.tip_P - (1.0 - t) * s.a.tip_P - t * s.b.tip_P).norm());
      axis = std::max(axis, (pose.axis_P - (1.0 - t) * s.a.axis_P - t * s.b.axis_P).norm());
    }
    ASSERT_LE(tip, bows.tip_mm) << "case " << i;
    ASSERT_LE(axis, bows.axis) << "case " << i;
  }
}

TEST(Certificate, SineIsNotBelowItsBound) {
  for (int i = 0; i <= 1570; ++i) {
    const double angle = 1e-3 * i;
    EXPECT_LE(sine_at_least(angle), std::sin(angle) + 1e-16);
    EXPECT_GE(sine_at_least(angle), std::min(0.83, 0.98 * std::sin(angle)));
  }
}

TEST_P(CertificateOf, BoundIsWithinFivePercentOfTheTruth) {
  RandomSegments random(test::shipped_machine(GetParam()), 7);
  const Certifier certifier(random.kinematics());
  double worst_tip = 0.0;
  double worst_axis = 0.0;
  for (int i = 0; i < test::cases(3000); ++i) {
    const Family family = kFamilies[static_cast<std::size_t>(i) % kFamilies.size()];
    const Segment s = random.next(family, kSteps[(i / 5) % 3]);
    const Reference r = s.own();
    const Truth truth = sampled(random.kinematics(), s, r, 1000, 0.5);
    const Bound tip = certifier.tip(s.a, s.b, r);
    const Bound axis = certifier.axis(s.a, s.b, r);
    EXPECT_LE(tip.lower, truth.tip + 2e-6 * truth.tip + 1e-9);
    EXPECT_LE(axis.lower, truth.axis + 1e-4 * truth.axis + 1e-9);
    if (truth.tip > 1e-4) worst_tip = std::max(worst_tip, tip.upper / truth.tip);
    if (truth.axis > 1e-6 && truth.axis < 1.57) worst_axis = std::max(worst_axis, axis.upper / truth.axis);
  }
  // The samples themselves miss the largest value by up to 1e-4 of it.
  EXPECT_LE(worst_tip, 1.0501);
  EXPECT_LE(worst_axis, 1.0501);
  RecordProperty("worst_tip_ratio", std::to_string(worst_tip));
  RecordProperty("worst_axis_ratio", std::to_string(worst_axis));
}

// Ends that are off the reference, as the nodes of two-sided placement and rounded words are.
TEST_P(CertificateOf, HoldsAgainstAnyReference) {
  RandomSegments random(test::shipped_machine(GetParam()), 8);
  const Certifier certifier(random.kinematics());
  const auto offset = [&](double size) {
    return Vec3(random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size));
  };
  for (int i = 0; i < 3000; ++i) {
    const Family family = kFamilies[static_cast<std::size_t>(i) % kFamilies.size()];
    const Segment s = random.next(family, kSteps[(i / 5) % 3]);
    const double size = std::pow(10.0, random.uniform(-4.0, 0.5));
    // One end may be much nearer than the other.
    const double at_a = i % 3 == 0 ? 1e-3 : 1.0;
    const double at_b = i % 3 == 1 ? 1e-3 : 1.0;
    const Reference r{s.a.tip_P + offset(size * at_a), s.b.tip_P + offset(size * at_b),
                      (s.a.axis_P + offset(1e-2 * size)).normalized(),
                      (s.b.axis_P + offset(1e-2 * size)).normalized()};
    const Truth truth = sampled(random.kinematics(), s, r, 400, 0.5);
    const Bound tip = certifier.tip(s.a, s.b, r);
    const Bound axis = certifier.axis(s.a, s.b, r);
    ASSERT_LE(truth.tip, tip.upper) << i;
    ASSERT_LE(truth.axis, axis.upper) << i;
    for (const double share : {0.3, 0.6, 0.9, 0.99, 0.9999}) {
      if (truth.tip > 1e-6) {
        ASSERT_NE(certifier.tip_within(s.a, s.b, r, share * truth.tip), Within::yes) << i;
      }
      if (truth.axis > 1e-6) {
        ASSERT_NE(certifier.axis_within(s.a, s.b, r, Angle::radians(share * truth.axis)), Within::yes) << i;
      }
    }
    ASSERT_NE(certifier.tip_within(s.a, s.b, r, 1.0001 * tip.upper + 1e-9), Within::no) << i;
    if (truth.tip > 1e-4) {
      ASSERT_LE(tip.upper, 1.051 * std::max(truth.tip, tip.lower)) << i;
    }
    if (truth.axis > 1e-6 && truth.axis < 1.57) {
      ASSERT_LE(axis.upper, 1.051 * std::max(truth.axis, axis.lower)) << i;
    }
  }
}

TEST_P(CertificateOf, DecisionAgreesWithTheTruthOnBothSidesOfIt) {
  RandomSegments random(test::shipped_machine(GetParam()), 9);
  const Certifier certifier(random.kinematics());
  int undecided = 0;
  for (int i = 0; i < 5000; ++i) {
    const Family family = kFamilies[static_cast<std::size_t>(i) % kFamilies.size()];
    const Segment s = random.next(family, kSteps[(i / 5) % 3]);
    const Reference r = s.own();
    const Bound tip = certifier.tip(s.a, s.b, r, 1.001);
    const Bound axis = certifier.axis(s.a, s.b, r, 1.001);
    if (tip.lower < 1e-6 || axis.lower < 1e-8 || axis.upper > 1.5) continue;
    for (const double factor : {0.5, 0.95, 0.999}) {
      EXPECT_EQ(certifier.tip_within(s.a, s.b, r, tip.lower * factor), Within::no);
      EXPECT_EQ(certifier.axis_within(s.a, s.b, r, Angle::radians(axis.lower * factor)), Within::no);
    }
    for (const double factor : {1.0001, 1.01, 1.5, 3.0}) {
      undecided += certifier.tip_within(s.a, s.b, r, tip.upper * factor) != Within::yes;
      undecided += certifier.axis_within(s.a, s.b, r, Angle::radians(axis.upper * factor)) != Within::yes;
    }
  }
  EXPECT_EQ(undecided, 0);
}

TEST(Certificate, ArcOfAHalfTurnAtThePoleIsOvershot) {
  const Machine machine = test::shipped_machine("paper");
  const TableKinematics kinematics(machine, machine.tool_vector());
  JointVector q0;
  q0[*machine.axis("A")] = Angle::degrees(10.0).rad();
  JointVector q1 = q0;
  q1[*machine.axis("C")] = kPi - 1e-3;
  const Station a = station(kinematics, q0);
  const Station b = station(kinematics, q1);
  const Bound axis = Certifier(kinematics).axis(a, b, {a.tip_P, b.tip_P, a.axis_P, b.axis_P});
  // The axis stays on its cone of 10 degrees; the arc passes the pole, which is farthest from the middle of
  // the cone's half circle.
  EXPECT_NEAR(axis.lower, Angle::degrees(10.0).rad(), 1e-3);
  EXPECT_GE(axis.upper, axis.lower);
}

TEST(Certificate, OppositeAxesHaveNoArc) {
  const Machine machine = test::shipped_machine("paper");
  const Certifier certifier(TableKinematics(machine, machine.tool_vector()));
  const Station a = station(certifier.kinematics(), JointVector());
  EXPECT_EQ(certifier.axis(a, a, {a.tip_P, a.tip_P, Vec3::UnitX(), -Vec3::UnitX()}).upper, kPi);
}

class LongCertificateOf : public testing::TestWithParam<std::string> {};

// 1e8 in all with TRUNNION_SEGMENTS=100000000, or in smaller numbers with as many values of TRUNNION_SEED;
// ten times the default otherwise.
TEST_P(LongCertificateOf, NoSampleLiesAboveTheBound) {
  const char* seed = std::getenv("TRUNNION_SEED");
  expect_no_sample_above(test::shipped_machine(GetParam()), test::cases(10000000, kSegments) / 4,
                         4711 + (seed ? static_cast<unsigned>(std::atol(seed)) : 0U));
}

INSTANTIATE_TEST_SUITE_P(LongMachines, LongCertificateOf, testing::ValuesIn(test::shipped_machines()));

INSTANTIATE_TEST_SUITE_P(Machines, CertificateOf, testing::ValuesIn(test::shipped_machines()));

}  // namespace
}  // namespace trunnion::path
