#include "trunnion/probe/sphere.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace trunnion::probe {
namespace {

// Worked example of the documentation of Beckhoff TF5245 ("Direct input of measurement data", "Sphere centre
// points already calculated"), pose A20 B0: it prints 102.545449, 258.949268, 125.6186118.
const std::vector<Vec3>& published_touches() {
  static const std::vector<Vec3> points = {{101.807, 273.174, 130.068}, {116.795, 258.750, 130.068},
                                           {104.246, 244.524, 129.024}, {89.606, 257.804, 132.980},
                                           {96.606, 269.804, 133.957},  {102.780, 264.366, 139.522}};
  return points;
}

TEST(Sphere, EqualsThePublishedExampleToItsLastDigit) {
  const auto sphere = algebraic_sphere(published_touches());
  ASSERT_TRUE(sphere);
  EXPECT_NEAR(sphere->center_mm.x(), 102.545449, 0.5e-6);
  EXPECT_NEAR(sphere->center_mm.y(), 258.949268, 0.5e-6);
  EXPECT_NEAR(sphere->center_mm.z(), 125.6186118, 0.5e-7);
}

// The least squares of the distances: no centre nearby has a smaller sum, and that one lies 0.01 um beside
// the other.
TEST(Sphere, IsTheLeastSquaresOfTheDistances) {
  const auto sphere = fit_sphere(published_touches());
  ASSERT_TRUE(sphere);
  EXPECT_LT((sphere->center_mm - Vec3(102.545449, 258.949268, 125.6186118)).norm(), 2e-5);
  const auto cost = [&](const Vec3& center) {
    double mean = 0.0;
    for (const Vec3& p : published_touches()) mean += (p - center).norm() / 6.0;
    double sum = 0.0;
    for (const Vec3& p : published_touches()) sum += std::pow((p - center).norm() - mean, 2);
    return sum;
  };
  for (int i = 0; i < 3; ++i) {
    for (const double by : {-1e-5, 1e-5})
      EXPECT_GT(cost(sphere->center_mm + by * Vec3::Unit(i)), cost(sphere->center_mm));
  }
}

std::vector<Vec3> touched(const Vec3& center, double radius, std::size_t count, double noise_mm,
                          std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<Vec3> out;
  while (out.size() < count) {
    Vec3 n(normal(random), normal(random), normal(random));
    n.normalize();
    if (n.z() < -0.2) continue;
    out.push_back(center + (radius + noise_mm * normal(random)) * n);
  }
  return out;
}

TEST(Sphere, FindsExactSpheresAnywhere) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> place(-800.0, 800.0), size(2.0, 60.0);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 center(place(random), place(random), place(random));
    const double radius = size(random);
    const auto points = touched(center, radius, 9, 0.0, random);
    const auto free = fit_sphere(points);
    ASSERT_TRUE(free) << i;
    EXPECT_LT((free->center_mm - center).norm(), 1e-8) << i;
    EXPECT_NEAR(free->radius_mm, radius, 1e-8) << i;
    const auto held = fit_sphere(points, radius);
    ASSERT_TRUE(held) << i;
    EXPECT_LT((held->center_mm - center).norm(), 1e-8) << i;
  }
}

TEST(Sphere, IsNoneWhereThePointsDoNotFixOne) {
  EXPECT_FALSE(fit_sphere({}));
  EXPECT_FALSE(fit_sphere({{1, 2, 3}, {1, 2, 3}, {1, 2, 3}, {1, 2, 3}, {1, 2, 3}}));
  EXPECT_FALSE(fit_sphere({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}));
  EXPECT_FALSE(fit_sphere({{10, 0, 0}, {0, 10, 0}, {-10, 0, 0}, {0, -10, 0}}));
  EXPECT_FALSE(fit_sphere({{10, 0, 0}, {0, 10, 0}, {-10, 0, 0}}));
}

// The cofactor times the variance is the scatter of the centre over many fits.
TEST(Sphere, SaysHowFarItsCentreIsOff) {
  std::mt19937_64 random(2);
  const Vec3 center(10, 20, 30);
  std::vector<Vec3> normals = {{0, 0, 1}};
  for (int i = 0; i < 4; ++i)
    normals.emplace_back(std::cos(i * 1.5707963267948966) * 0.94, std::sin(i * 1.5707963267948966) * 0.94,
                         0.342);
  Mat3 scatter = Mat3::Zero();
  Mat3 said = Mat3::Zero();
  constexpr int kFits = 4000;
  constexpr double kNoise = 1e-3;
  std::normal_distribution<double> normal(0.0, kNoise);
  for (int i = 0; i < kFits; ++i) {
    std::vector<Vec3> points;
    for (const Vec3& n : normals) points.push_back(center + (15.0 + normal(random)) * n.normalized());
    const auto one = fit_sphere(points);
    ASSERT_TRUE(one);
    const Vec3 off = one->center_mm - center;
    scatter += off * off.transpose() / kFits;
    said = one->center_cofactor * kNoise * kNoise;
  }
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(scatter(i, i) / said(i, i), 1.0, 0.12) << i;
}

TEST(Sphere, OneRadiusOverSeveralIsTheLeastSquaresOfAll) {
  std::mt19937_64 random(3);
  std::vector<std::vector<Vec3>> sets;
  for (int i = 0; i < 6; ++i) sets.push_back(touched(Vec3(20.0 * i, 5.0, -7.0 * i), 15.7, 6, 2e-3, random));
  const auto all = fit_common_radius(sets);
  ASSERT_TRUE(all);
  const auto cost = [&](double radius) {
    double sum = 0.0;
    for (const auto& set : sets) {
      const auto one = fit_sphere(set, radius);
      for (const double r : one->residuals_mm) sum += r * r;
    }
    return sum;
  };
  const double least = cost(all->radius_mm);
  for (const double by : {-1e-5, 1e-5}) EXPECT_GT(cost(all->radius_mm + by), least);
  EXPECT_NEAR(all->radius_mm, 15.7, 3e-3);
}

}  // namespace
}  // namespace trunnion::probe
