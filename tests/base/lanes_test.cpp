#include "trunnion/base/lanes.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <random>

#include "support/lanes.hpp"

namespace trunnion {
namespace {

// Against the standard library's long doubles: of another precision and another hand.
TEST(Lanes, ArcTangentIsThatOfLongDoubles) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> angle(-kPi, kPi);
  std::uniform_real_distribution<double> size(-30.0, 30.0);
  long double worst = 0.0L;
  for (int i = 0; i < 4'000'000; ++i) {
    const double a = angle(random);
    const double r = std::exp(size(random));
    // Near the axes and the diagonals too.
    const double share = i % 3 == 0 ? std::exp(-std::abs(size(random))) : 1.0;
    const double y = r * std::sin(a) * share;
    const double x = r * std::cos(a);
    worst = std::max(worst, std::abs(static_cast<long double>(lanes::atan2(y, x)) -
                                     std::atan2(static_cast<long double>(y), static_cast<long double>(x))));
  }
  EXPECT_LT(static_cast<double>(worst), 3.5e-16);
  EXPECT_EQ(lanes::atan2(0.0, 0.0), 0.0);
  EXPECT_EQ(lanes::atan2(0.0, -1.0), kPi);
  EXPECT_EQ(lanes::atan2(1.0, 0.0), 0.5 * kPi);
  EXPECT_EQ(lanes::atan2(-1.0, 0.0), -0.5 * kPi);
}

TEST(Lanes, SinesAreThoseOfLongDoubles) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> size(-20.0, 11.5);
  long double worst = 0.0L;
  for (int i = 0; i < 4'000'000; ++i) {
    double x = std::exp(size(random));
    if (i % 2 == 0) x = -x;
    if (i % 5 == 0) x = std::nearbyint(x) * 0.5 * kPi;  // where the sines are nothing
    if (std::abs(x) > lanes::kLargestAngle) continue;
    const auto found = lanes::sincos(x);
    const auto exact = static_cast<long double>(x);
    worst = std::max(worst, std::abs(found.sin - std::sin(exact)));
    worst = std::max(worst, std::abs(found.cos - std::cos(exact)));
  }
  EXPECT_LT(static_cast<double>(worst), 3e-16);
  EXPECT_EQ(lanes::sincos(0.0).sin, 0.0);
  EXPECT_EQ(lanes::sincos(0.0).cos, 1.0);
  EXPECT_EQ(lanes::sincos(1e7).sin, std::sin(1e7));
}

// Of each lane what one value gives.
template <class T>
void expect_as_one(std::mt19937_64& random) {
  std::uniform_real_distribution<double> number(-9.0, 9.0);
  const auto any = [&](std::size_t) { return number(random); };
  for (int i = 0; i < 50'000; ++i) {
    const T y = lanes::collect<T>(any);
    const T x = lanes::collect<T>(any);
    const T angle = lanes::atan2(y, x);
    const auto s = lanes::sincos(x);
    const T root = lanes::sqrt(lanes::abs(x));
    const T whole = lanes::nearest<T>(x);
    const T larger = lanes::larger(x, y);
    const T before = lanes::across(x, y);
    for (int k = 0; k < static_cast<int>(lanes::kCount<T>); ++k) {
      EXPECT_EQ(angle[k], lanes::atan2(y[k], x[k]));
      EXPECT_EQ(s.sin[k], lanes::sincos(x[k]).sin);
      EXPECT_EQ(s.cos[k], lanes::sincos(x[k]).cos);
      EXPECT_EQ(root[k], std::sqrt(std::abs(x[k])));
      EXPECT_EQ(whole[k], std::nearbyint(x[k]));
      EXPECT_EQ(larger[k], std::max(x[k], y[k]));
      EXPECT_EQ(before[k], k == 0 ? x[lanes::kCount<T> - 1] : y[k - 1]);
    }
  }
}

TEST(Lanes, SeveralAreAsOne) {
  std::mt19937_64 random(3);
  for (const lanes::Way most : test::kEveryWay) {
    const test::Calculating calculating(most);
    lanes::at_a_time(lanes::way(), [&]<class T>() { expect_as_one<T>(random); });
  }
  const auto far = lanes::sincos(Lanes{1e7, 1.0});
  EXPECT_EQ(far.cos[0], std::cos(1e7));
  EXPECT_EQ(far.sin[1], lanes::sincos(1.0).sin);
}

}  // namespace
}  // namespace trunnion
