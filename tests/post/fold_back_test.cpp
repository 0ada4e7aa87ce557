// Cuts that come back along themselves, in steps of some hundredths of a millimetre: which place of the path
// a block is to be held against, no distance tells. A right program passes on every control, and one word
// that leaves the tolerance is found. What is right says a chain of this file's own.
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "post/own_chain.hpp"
#include "post/posting.hpp"
#include "support/cases.hpp"
#include "support/controllers.hpp"

namespace trunnion::post {
namespace {

using test::Cut;
using test::cut_of;
using test::off_arc;
using test::PlacedTool;
using test::tool_of;

constexpr double kFoldTolerance_mm = 0.01;

// Steps of 0.047 to 1.2 mm to and fro, with turns of several degrees.
std::vector<PlacedTool> folding_path(unsigned seed, int points) {
  std::mt19937_64 random(seed);
  const auto one_of = [&](const auto& values) {
    return values[std::uniform_int_distribution<std::size_t>(0, std::size(values) - 1)(random)];
  };
  constexpr std::array kSteps = {0.047, 0.05, 0.1, 0.7, 1.2};
  constexpr std::array kTurns = {-6.0, -5.0, -1.0, 1.0, 5.0, 6.0};
  constexpr std::array kMostlyOn = {1.0, 1.0, 1.0, -1.0};
  constexpr std::array kEither = {1.0, -1.0};
  Vec3 tip(300.0, 200.0, 60.0);
  double tilt = 60.0;
  double turn = 170.0;
  std::vector<PlacedTool> path;
  for (int i = 0; i < points; ++i) {
    const double a = tilt * kRadPerDegree;
    const double b = turn * kRadPerDegree;
    path.push_back({tip, {std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)}});
    const double step = one_of(kSteps);
    tip.y() += 0.3 * step * one_of(kMostlyOn);
    tip.z() += 0.9 * step * one_of(kEither);
    if (std::uniform_real_distribution<double>(0.0, 1.0)(random) > 0.7) continue;
    const double by = one_of(kTurns);
    if (tilt + by <= 20.0 || tilt + by >= 85.0) continue;
    tilt += by;
    turn += 0.1 * by;
  }
  return path;
}

std::string fold_cl(const std::vector<PlacedTool>& path) {
  std::string out = "UNITS/MM\nLOADTL/1\nFEDRAT/250.,MMPM\n";
  for (const PlacedTool& p : path) {
    out += "GOTO/";
    for (const double x : {p.tip.x(), p.tip.y(), p.tip.z()}) out += fixed_text(x, 4) + ",";
    out +=
        fixed_text(p.axis.x(), 7) + "," + fixed_text(p.axis.y(), 7) + "," + fixed_text(p.axis.z(), 7) + "\n";
  }
  return out + "FINI\n";
}

// The range of x in which |p - (a + x (b - a))| <= limit; empty where low > high.
struct Range {
  double low = 1.0, high = 0.0;
  bool is_empty() const { return low > high; }
};

Range range_of(const Vec3& p, const Vec3& a, const Vec3& b, double limit) {
  const Vec3 d = b - a;
  const double d2 = d.squaredNorm();
  if (d2 == 0.0) return (p - a).norm() <= limit ? Range{0.0, 1.0} : Range{};
  const double middle = (p - a).dot(d) / d2;
  const double half2 = limit * limit / d2 - (p - a).squaredNorm() / d2 + middle * middle;
  if (half2 < 0.0) return {};
  return {std::max(0.0, middle - std::sqrt(half2)), std::min(1.0, middle + std::sqrt(half2))};
}

// The tool follows the path's segments in their order, never farther off than the limit, and passes each of
// its points within it (Alt and Godau, 1995: the free space of two polygons, and what of it a way comes to;
// on one segment the tool may go to and fro).
bool follows(const std::vector<PlacedTool>& tool, const std::vector<PlacedTool>& path, double limit_mm,
             double limit_rad) {
  const std::size_t segments = path.size() - 1;
  std::vector<Range> left(segments);  // of segment j, at the tool's place i
  double first = (tool[0].tip - path[0].tip).norm();
  if (first > limit_mm) return false;
  for (std::size_t j = 0; j < segments; ++j) {
    const Range free = range_of(tool[0].tip, path[j].tip, path[j + 1].tip, limit_mm);
    if (free.is_empty() || free.low > 0.0) break;
    left[j] = free;
    if (free.high < 1.0) break;
  }
  for (std::size_t i = 0; i + 1 < tool.size(); ++i) {
    std::vector<Range> right(segments);
    Range bottom;  // of the tool's piece, at path point j
    for (std::size_t j = 0; j < segments; ++j) {
      if (left[j].is_empty() && bottom.is_empty()) continue;
      const Range end = off_arc(tool[i + 1].axis, path[j].axis, path[j + 1].axis) <= limit_rad
                            ? range_of(tool[i + 1].tip, path[j].tip, path[j + 1].tip, limit_mm)
                            : Range{};
      if (!bottom.is_empty() || !left[j].is_empty()) right[j] = end;
      const Range top = range_of(path[j + 1].tip, tool[i].tip, tool[i + 1].tip, limit_mm);
      if (!left[j].is_empty()) {
        bottom = top;
      } else if (!bottom.is_empty() && !top.is_empty()) {
        bottom = {std::max(top.low, bottom.low), top.high};
      } else {
        bottom = {};
      }
    }
    left = right;
  }
  return !left.back().is_empty() && left.back().high >= 1.0;
}

enum class Verdict { right, wrong, too_near_to_tell };

Verdict verdict_on(const std::string& nc, const std::vector<PlacedTool>& path) {
  constexpr double kNear = 1.02;
  constexpr double kAxis_rad = 0.05 * kRadPerDegree;
  const auto tool = tool_of(cut_of(nc));
  if (!follows(tool, path, kNear * kFoldTolerance_mm, kNear * kAxis_rad)) return Verdict::wrong;
  return follows(tool, path, kFoldTolerance_mm / kNear, kAxis_rad / kNear) ? Verdict::right
                                                                           : Verdict::too_near_to_tell;
}

// One X, Y or Z of a cut, by three tolerances.
std::string spoiled(const std::string& nc, std::mt19937_64& random) {
  const Cut cut = cut_of(nc);
  for (;;) {
    const std::size_t line =
        cut.line[std::uniform_int_distribution<std::size_t>(1, cut.line.size() - 1)(random)];
    std::size_t begin = 0;
    for (std::size_t i = 0; i < line; ++i) begin = nc.find('\n', begin) + 1;
    const std::size_t at = nc.find("XYZ"[std::uniform_int_distribution<std::size_t>(0, 2)(random)], begin);
    if (at == std::string::npos || at > nc.find('\n', begin)) continue;
    const std::size_t from = nc.find_first_of("-0123456789.", at);
    const std::size_t end = nc.find_first_not_of("-0123456789.", from);
    const std::string word = nc.substr(from, end - from);
    const std::size_t point = word.find('.');
    if (from > at + 2 || point == std::string::npos) continue;
    const double by = (random() % 2 == 0 ? 3.0 : -3.0) * kFoldTolerance_mm;
    std::string out = nc;
    const double sign = nc[from - 1] == '-' ? -1.0 : 1.0;
    const std::string moved = fixed_text(sign * parse_number(word).value + by, 4);
    return out.replace(from, end - from, moved);
  }
}

TEST(LongFoldBack, RightProgramsPassAndWrongWordsAreFoundOnEveryControl) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const int seeds = test::cases(4, "TRUNNION_CASES");
  int right = 0;
  int wrong = 0;
  for (const std::string& control : test::shipped_controllers()) {
    for (int seed = test::cases(0, "TRUNNION_FIRST_CASE"); seed < seeds; ++seed) {
      const auto path = folding_path(static_cast<unsigned>(seed), 300);
      const std::string cl = fold_cl(path);
      const std::string what = control + ", seed " + std::to_string(seed);
      PostOptions options;
      options.tolerance_mm = kFoldTolerance_mm;
      const auto p = test::posted(cl, machine, options, control);
      ASSERT_TRUE(p.report) << what << " " << p.report.error().text();
      ASSERT_NE(verdict_on(p.nc, path), Verdict::wrong) << what;
      const VerifyReport& v = *p.report->verification;
      EXPECT_TRUE(v.passed()) << what << ": tip " << v.certified_tip_deviation_mm << ", points "
                              << v.max_point_deviation_mm << ", missed " << v.points_missed << ", axis "
                              << v.max_axis_deviation.deg();
      ++right;
      std::mt19937_64 random(static_cast<unsigned>(seed) + 1000);
      const std::string text = spoiled(p.nc, random);
      const auto read = test::verified(text, cl, machine, kFoldTolerance_mm, control);
      ASSERT_TRUE(read) << what << " " << read.error().text();
      const Verdict verdict = verdict_on(text, path);
      wrong += verdict == Verdict::wrong ? 1 : 0;
      if (verdict == Verdict::wrong) {
        EXPECT_FALSE(read->passed()) << what << ": a word changed by three tolerances";
      }
      if (verdict == Verdict::right) {
        EXPECT_TRUE(read->passed()) << what << ": a word changed within the tolerance, tip "
                                    << read->certified_tip_deviation_mm << ", points "
                                    << read->max_point_deviation_mm << ", missed " << read->points_missed;
      }
    }
  }
  std::printf("[ figures  ] %d right programs, %d with a wrong word\n", right, wrong);
  EXPECT_GT(2 * wrong, right);
}

}  // namespace
}  // namespace trunnion::post
