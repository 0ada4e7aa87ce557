#include "path/insertion/spacing.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "path/insertion/even_pieces.hpp"

namespace trunnion::path {
namespace {

// I-length of a piece between ends displaced by x and y tolerances (README of the layer, "Placement").
double piece_length(double x, double y) {
  const double m = 1.0 + 0.5 * (x + y);
  return std::sqrt(4.0 * (m + std::sqrt(std::max(0.0, m * m - 0.25 * (y - x) * (y - x)))));
}

// The narrowest tube w^2 that `count` pieces with ends on the chord cover, found by halving.
double narrowest(std::size_t count, double total) {
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < 40; ++i) {
    const double w = 0.5 * (low + high);
    const double covers = w * (2.0 * piece_length(0.0, 1.0) + 4.0 * static_cast<double>(count - 2));
    (covers < total ? low : high) = w;
  }
  return high;
}

// Where the ends stay on the chord the tube is calculated and not looked for.
TEST(Spacing, NarrowestTubeIsWhereHalvingEnds) {
  std::mt19937_64 random(20261123);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  constexpr double kTolerance_mm = 0.005;
  constexpr double kHalfStep = 0x1p-41;  // of the halvings
  Spacing spacing;
  std::vector<Place> places;
  std::size_t wide = 0;
  for (int i = 0; i < 5000; ++i) {
    std::vector<Cell> cells;
    const double size = std::exp(8.0 * u(random) - 4.0);
    for (int k = 0; k < 4; ++k)
      cells.push_back(
          {0.25 * k, 0.25 * (k + 1), {Vec3(0.0, 0.001 * size * (0.5 + u(random)), 0.0), Vec3::Zero()}, 0.0});
    spacing.set(cells, Tube{kTolerance_mm}, 1e-3, true);
    const auto count = 2 + static_cast<std::size_t>(u(random) * 6.0);
    spacing.place_two_sided(count, 0.0, 0.0, places);
    ASSERT_EQ(places.size(), count - 1);
    const double w = narrowest(count, spacing.total());
    wide += w == 1.0 ? 1 : 0;
    for (const Place& place : places)
      EXPECT_NEAR(std::sqrt(place.displacement.tip_P.norm() / kTolerance_mm), w, kHalfStep);
  }
  EXPECT_GT(wide, 100U);
  EXPECT_LT(wide, 4900U);
}

// Nodes of an attempt that came to one place leave a part without width; where it leads the integral too.
TEST(Spacing, PartsWithoutWidthGiveNoPlaceThatIsNoNumber) {
  Spacing spacing;
  std::vector<Place> places;
  for (const double bow_mm : {0.0, 1e-9, 0.02}) {
    const std::vector<Cell> cells = {{0.0, 0.5, {Vec3(0.0, 0.01, 0.0), Vec3::Zero()}, 0.0},
                                     {0.5, 0.5, {Vec3(0.0, bow_mm, 0.0), Vec3::Zero()}, 0.0},
                                     {0.5, 0.5, {Vec3(0.0, bow_mm, 0.0), Vec3::Zero()}, 0.0},
                                     {0.5, 1.0, {Vec3(0.0, 0.003, 0.0), Vec3::Zero()}, 0.0}};
    spacing.set(cells, Tube{0.005}, 1e-3, true);
    for (std::size_t count = 2; count < 6; ++count) {
      spacing.place_two_sided(count, 0.0, 0.0, places);
      for (const Place& place : places) {
        EXPECT_TRUE(place.t >= 0.0 && place.t <= 1.0) << place.t;
        EXPECT_TRUE(place.displacement.tip_P.allFinite());
      }
    }
  }
}

// The parabola that bows by one, against which the ends of the pieces stand: all pieces leave the chord of
// the segment by as much, to the one side in their middle and to the other at their ends.
TEST(EvenPieces, OnBothSidesAllLeaveTheChordByTheSame) {
  const EvenPieces even(true);
  const auto parabola = [](double t) { return 4.0 * t * (1.0 - t); };
  for (std::size_t count = 2; count <= 16; ++count) {
    const double beside = even.beside(count);
    double t0 = 0.0;
    double y0 = 0.0;
    for (std::size_t i = 1; i <= count; ++i) {
      const double t1 = i < count ? even.share(i, count) : 1.0;
      const double y1 = i < count ? -beside : 0.0;
      double largest = 0.0;
      for (int k = 0; k <= 1000; ++k) {
        const double s = k / 1000.0;
        const double bow = parabola(t0 + s * (t1 - t0)) - (1.0 - s) * parabola(t0) - s * parabola(t1);
        largest = std::max(largest, (1.0 - s) * y0 + s * y1 + bow);
      }
      EXPECT_NEAR(largest, beside, 1e-6) << count << ' ' << i;
      t0 = t1;
      y0 = y1;
    }
  }
}

TEST(EvenPieces, AreTheFewestThatStayWithinTheTube) {
  std::mt19937_64 random(20261122);
  std::uniform_real_distribution<double> bow(0.0001, 1.0);
  int left_to_plans = 0;
  for (const bool two_sided : {false, true}) {
    const EvenPieces even(two_sided);
    const auto left_mm = [&](double bow_mm, double count) {
      return bow_mm * (two_sided ? even.beside(static_cast<std::size_t>(count)) : 1.0 / (count * count));
    };
    for (int i = 0; i < 10000; ++i) {
      const double bow_mm = bow(random);
      const double tube_mm = 0.001;
      const double count = even.count(bow_mm, tube_mm, tube_mm);
      if (std::isinf(count)) {
        ++left_to_plans;
        continue;
      }
      EXPECT_EQ(count, std::floor(count));
      EXPECT_LE(left_mm(bow_mm, count), tube_mm * (1.0 + 1e-12));
      if (count > 2.0) {
        EXPECT_GT(left_mm(bow_mm, count - 1.0), tube_mm);
      }
    }
  }
  EXPECT_GT(left_to_plans, 0);
  EXPECT_LT(left_to_plans, 200);  // kCountSlack of them
}

}  // namespace
}  // namespace trunnion::path
