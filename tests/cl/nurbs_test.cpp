#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <string>
#include <vector>

#include "cl/support.hpp"

namespace trunnion::cl {
namespace {

using test::joined;
using test::read;

// De Boor's recursion, straight from the definition of the basis functions.
double basis(const std::vector<double>& t, std::size_t i, int degree, double u) {
  if (degree == 0) return u >= t[i] && u < t[i + 1] ? 1.0 : 0.0;
  const auto part = [](double above, double below) { return below > 0.0 ? above / below : 0.0; };
  const auto d = static_cast<std::size_t>(degree);
  return part(u - t[i], t[i + d] - t[i]) * basis(t, i, degree - 1, u) +
         part(t[i + d + 1] - u, t[i + d + 1] - t[i + 1]) * basis(t, i + 1, degree - 1, u);
}

Vec3 on_curve(const std::vector<double>& knots, const std::vector<Vec3>& points, double u) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) sum += basis(knots, i, 3, u) * points[i];
  return sum;
}

double off_the_chords(const Vec3& point, const Vec3& start, const std::vector<Motion>& motions) {
  double least = INFINITY;
  Vec3 from = start;
  for (const Motion& motion : motions) {
    const Vec3 way = motion.tip_P - from;
    const double t =
        way.squaredNorm() > 0.0 ? std::clamp((point - from).dot(way) / way.squaredNorm(), 0.0, 1.0) : 0.0;
    least = std::min(least, (from + way * t - point).norm());
    from = motion.tip_P;
  }
  return least;
}

TEST(Nurbs, ChordsKeepToTheCurveOfItsKnotsAndPoints) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> coordinate(-40.0, 40.0);
  std::uniform_real_distribution<double> step(0.05, 1.0);
  for (int round = 0; round < 40; ++round) {
    const std::size_t inner = random() % 6;
    std::vector<double> inner_knots(inner + 1);
    double sum = 0.0;
    for (double& knot : inner_knots) knot = sum += step(random);
    std::string text = "FEDRAT/600\nGOTO/1,2,3,0.6,0,0.8\nNURBS/\nKNOT/";
    std::vector<double> knots(4, 0.0);
    char number[40];
    for (std::size_t i = 0; i <= inner; ++i) {
      std::snprintf(number, sizeof(number), i == 0 ? "%.7f" : ",%.7f", inner_knots[i] / sum);
      text += number;
      if (i < inner) knots.push_back(std::stod(number + (i == 0 ? 0 : 1)));
    }
    knots.insert(knots.end(), 4, 1.0);
    text += "\n";
    std::vector<Vec3> points = {Vec3(1, 2, 3)};
    for (std::size_t i = 0; i < inner + 3; ++i) {
      points.emplace_back(std::round(coordinate(random)), std::round(coordinate(random)),
                          std::round(coordinate(random)));
      char line[100];
      std::snprintf(line, sizeof(line), "CNTRL/%.4f,%.4f,%.4f\n", points.back().x(), points.back().y(),
                    points.back().z());
      text += line;
    }
    ReaderOptions options = test::in_mm();
    options.arc_tolerance_mm = 0.02;
    const auto reading = read(text + "PAINT/COLOR,31\nGOTO/0,0,0\n", options);
    ASSERT_EQ(joined(reading.findings), "") << text;
    auto motions = reading.motions();
    ASSERT_GT(motions.size(), 4U);
    motions.erase(motions.begin());  // the GOTO before, and behind
    motions.pop_back();
    EXPECT_EQ(motions.back().tip_P, points.back());
    EXPECT_EQ(motions.back().axis_P, reading.motions()[0].axis_P);
    EXPECT_EQ(motions[0].feed, (Feed{FeedMode::per_minute, 10.0}));
    double worst = 0.0;
    for (int k = 0; k < 400; ++k)
      worst = std::max(worst, off_the_chords(on_curve(knots, points, k / 400.0), points[0], motions));
    EXPECT_LE(worst, 0.02 + 1e-9) << text;
    EXPECT_GT(worst, 0.002) << text;  // no finer than needed
  }
}

TEST(Nurbs, ADefinitionThatIsNotACubicFromThePositionIsRefused) {
  const auto verdict = [](const std::string& text) {
    return joined(read("GOTO/0,0,0\n" + text + "GOTO/9,0,0\n").findings);
  };
  const std::string points = "CNTRL/1,0,0\nCNTRL/2,1,0\nCNTRL/3,0,0\n";
  EXPECT_EQ(verdict("NURBS/\nKNOT/1.0\n" + points), "");
  EXPECT_EQ(verdict("NURBS/\nKNOT/0.5,1.0\n" + points).substr(0, 42),
            "2:1: error: NURBS: 3 points and 2 knots; o");
  EXPECT_EQ(verdict("NURBS/\nKNOT/0.9\n" + points),
            "2:1: error: NURBS: its knots do not rise from above 0 to 1\n");
  EXPECT_EQ(verdict("NURBS/\nKNOT/0.6,0.4,1.0\n" + points + "CNTRL/4,0,0\nCNTRL/5,0,0\n"),
            "2:1: error: NURBS: its knots do not rise from above 0 to 1\n");
  EXPECT_EQ(
      verdict("NURBS/\nKNOT/1.0\nCNTRL/1,0,0,0,0,1\nCNTRL/2,0,0,0,0,1\n"),
      "4:1: error: CNTRL: 6 values; 3 (x, y, z), the tool axis held, are understood (NX: Motion Output Type, "
      "Line)\n");
  EXPECT_EQ(verdict("KNOT/1.0\n"), "2:1: error: KNOT without NURBS before it\n");
  EXPECT_EQ(joined(read("NURBS/\nKNOT/1.0\n" + points).findings),
            "1:1: error: NURBS before any position: there is nothing to go on from\n");
}

// The file ends with the curve, and a plain GOTO comes at once behind another one.
TEST(Nurbs, ACurveEndsWithTheStatementBehindItOrTheFile) {
  const std::string curve = "NURBS/\nKNOT/1.0\nCNTRL/1,0,0\nCNTRL/2,1,0\nCNTRL/3,0,0\n";
  EXPECT_EQ(read("GOTO/0,0,0\n" + curve).motions().back().tip_P, Vec3(3, 0, 0));
  std::size_t in_runs = 0;
  const std::string line = "GOTO/10.0000,20.0000,30.0000,0.0000,0.0000,1.0000\n";
  const std::string text = line + line + line + curve + line + line;
  EXPECT_EQ(test::read_in_runs(text, 32, in_runs).motions().size(), read(text).motions().size());
  const auto motions = read(text).motions();
  EXPECT_EQ(motions[motions.size() - 3].tip_P, Vec3(3, 0, 0));
}

}  // namespace
}  // namespace trunnion::cl
