#include "path/insertion/pieces_of.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "support/cases.hpp"

namespace trunnion::path {
namespace {

lanes::Triple<Lanes> both(const Vec3& v) {
  return {lanes::splat<Lanes>(v.x()), lanes::splat<Lanes>(v.y()), lanes::splat<Lanes>(v.z())};
}

// Parabolas beside a chord, their ends as far off it as the rounding of words has them, one way or any.
TEST(Parabola, IsNoFartherOffThanItsQuartersSayWhichSayNoMoreThanTheWhole) {
  std::mt19937_64 random(20261128);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const auto vector = [&](double size) { return Vec3(size * u(random), size * u(random), size * u(random)); };
  int much_sharper = 0;
  const int count = test::cases(20000);
  for (int i = 0; i < count; ++i) {
    const double length = std::exp(6.0 * u(random));
    const double bow = length * std::exp(4.0 * u(random) - 6.0);
    const double off = bow * std::exp(3.0 * u(random));
    const Vec3 from = vector(100.0);
    const Vec3 to = from + vector(length);
    const Vec3 a = from + vector(off);
    const Vec3 b = to + vector(off);
    const Vec3 middle = 0.5 * (a + b) + vector(bow);
    const ChordOf<Lanes> chord(both(from), both(to));
    const double whole_mm = parabola_mm(chord, both(a), both(middle), both(b))[0];
    const double quarters_mm = parabola_in_quarters_mm(chord, both(a), both(middle), both(b))[0];
    double farthest_mm = 0.0;
    constexpr int kSamples = 64;
    for (int k = 0; k <= kSamples; ++k) {
      const double t = static_cast<double>(k) / kSamples;
      const Vec3 at = (1.0 - t) * a + t * b + 4.0 * t * (1.0 - t) * (middle - 0.5 * (a + b));
      farthest_mm = std::max(farthest_mm, distance_to_segment(at, from, to));
    }
    const double rounding_mm = 1e-12 * (100.0 + length);
    EXPECT_LE(farthest_mm, quarters_mm + rounding_mm) << i;
    EXPECT_LE(quarters_mm, whole_mm + rounding_mm) << i;
    if (quarters_mm - farthest_mm < 0.5 * (whole_mm - farthest_mm)) ++much_sharper;
  }
  EXPECT_GT(2 * much_sharper, count);
}

}  // namespace
}  // namespace trunnion::path
