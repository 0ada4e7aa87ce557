#include "trunnion/geom/pose.hpp"

#include <gtest/gtest.h>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

#include "trunnion/geom/direction.hpp"

namespace trunnion {
namespace {

using namespace literals;

Vec3 random_vector(std::mt19937_64& random, double size) {
  std::uniform_real_distribution<double> value(-size, size);
  return {value(random), value(random), value(random)};
}

TEST(Pose, RightAnglesAreExact) {
  const Mat3 R = rotation_about(Vec3::UnitZ(), 90_deg);
  EXPECT_EQ(R(0, 0), 0.0);
  EXPECT_EQ(R(1, 0), 1.0);
  EXPECT_EQ(rotation_about(Vec3::UnitX(), -Angle::degrees(90))(2, 1), -1.0);
  EXPECT_EQ(rotation_about(Vec3::UnitX(), Angle::degrees(360 * 7)), Mat3::Identity());
}

TEST(Pose, ExponentialAgreesWithTheMatrixExponential) {
  std::mt19937_64 random(1);
  for (const double size : {1e-9, 1e-5, 5e-3, 2e-2, 1.0, 3.0}) {
    for (int i = 0; i < 50; ++i) {
      const Twist twist{random_vector(random, 1.0), random_vector(random, size)};
      Eigen::Matrix4d xi = Eigen::Matrix4d::Zero();
      xi.topLeftCorner<3, 3>() = cross_matrix(twist.rot_rad);
      xi.topRightCorner<3, 1>() = twist.trans_mm;
      const Eigen::Matrix4d expected = xi.exp();
      const Pose X = exp(twist);
      EXPECT_LT((X.R - expected.topLeftCorner<3, 3>()).norm(), 1e-14 * 10);
      EXPECT_LT((X.p - expected.topRightCorner<3, 1>()).norm(), 1e-14 * 10);
    }
  }
}

TEST(Pose, RotationVectorInvertsTheExponential) {
  std::mt19937_64 random(2);
  for (const double size : {1e-12, 1e-6, 1e-2, 1.0, 1.8}) {
    for (int i = 0; i < 50; ++i) {
      const Vec3 r = random_vector(random, size);
      if (r.norm() >= kPi) continue;
      EXPECT_LT((rotation_vector(exp(Twist{Vec3::Zero(), r}).R) - r).norm(),
                1e-14 + 1e-10 * r.norm() * (size > 1.0 ? 1e-3 : 1e-5));
    }
  }
}

TEST(Pose, DistanceToSegment) {
  const Vec3 a(0, 0, 0);
  const Vec3 b(10, 0, 0);
  EXPECT_DOUBLE_EQ(distance_to_segment({5, 3, 4}, a, b), 5.0);
  EXPECT_DOUBLE_EQ(distance_to_segment({-3, 0, 4}, a, b), 5.0);
  EXPECT_DOUBLE_EQ(distance_to_segment({13, 4, 0}, a, b), 5.0);
  EXPECT_DOUBLE_EQ(distance_to_segment({3, 4, 0}, a, a), 5.0);
}

TEST(Pose, SlerpStaysOnTheGreatCircle) {
  const Vec3 u0 = Vec3::UnitX();
  const Vec3 u1 = Vec3::UnitY();
  EXPECT_NEAR(angle_between(slerp(u0, u1, 0.25), u0).deg(), 22.5, 1e-12);
  EXPECT_EQ(slerp(u0, u0, 0.3), u0);
}

// Small arcs go by series; long doubles have three digits more than these need.
TEST(Pose, AnglesAndArcsOfAnySizeAgreeWithLongDoubles) {
  using Long = Eigen::Matrix<long double, 3, 1>;
  std::mt19937_64 random(3);
  for (const double size :
       {1e-11, 1e-8, 1e-5, 1e-3, 9e-3, 1.1e-2, 3.1e-2, 3.3e-2, 6e-2, 8.9e-2, 9.0e-2, 0.5, 3.0}) {
    for (int i = 0; i < 200; ++i) {
      const Vec3 u0 = random_vector(random, 1.0).normalized();
      const Vec3 side = u0.cross(random_vector(random, 1.0)).normalized();
      const Vec3 u1 = (std::cos(size) * u0 + std::sin(size) * side).normalized();
      const Long a = u0.cast<long double>();
      const Long b = u1.cast<long double>();
      const long double angle = std::atan2(a.cross(b).norm(), a.dot(b));
      // The rounding of the cross product in doubles.
      EXPECT_NEAR(angle_between(u0, u1).rad(), static_cast<double>(angle), 4e-16 + 4e-16 * size);
      for (const double t : {0.0, 0.125, 0.5, 0.8, 1.0}) {
        const auto share = [&](long double part) { return std::sin(part * angle) / std::sin(angle); };
        const Long expected = share(1.0L - static_cast<long double>(t)) * a + share(t) * b;
        EXPECT_LT((slerp(u0, u1, t).cast<long double>() - expected).norm(), 4e-15L) << size << ' ' << t;
      }
    }
  }
}

TEST(Direction, TakesFourDecimalsAndRefusesMore) {
  EXPECT_TRUE(Direction::from(Vec3(0.8259, -0.0720, 0.5592)));
  EXPECT_FALSE(Direction::from(Vec3(0.006393, -0.068922, 0.99960)));  // length 1.0020: the paper's misprint
  EXPECT_FALSE(Direction::from(Vec3(std::numeric_limits<double>::quiet_NaN(), 0, 1)));
  EXPECT_FALSE(Direction::normalised(Vec3::Zero()));
}

}  // namespace
}  // namespace trunnion
