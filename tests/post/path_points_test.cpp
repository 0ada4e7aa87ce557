// The points of a CL path stand in columns as each of them does alone, however they come and go.
#include "post/judging/path_points.hpp"

#include <gtest/gtest.h>
#include <random>

#include "post/judging/path_place.hpp"
#include "support/lanes.hpp"

namespace trunnion::post {
namespace {

class RandomMotions {
 public:
  explicit RandomMotions(std::uint64_t seed) : random_(seed) {}
  double within(double most) { return std::uniform_real_distribution<>(-most, most)(random_); }
  std::size_t up_to(std::size_t most) { return std::uniform_int_distribution<std::size_t>(0, most)(random_); }
  // Now and then the tip stands, the axis turns far, or it is a rapid.
  const cl::Motion& next() {
    if (up_to(40) > 0) motion_.tip_P += Vec3(within(2.0), within(2.0), within(2.0));
    const double turn = up_to(30) == 0 ? 3.0 : 0.02;
    motion_.axis_P = (motion_.axis_P + Vec3(within(turn), within(turn), within(turn))).normalized();
    motion_.rapid = up_to(50) == 0;
    motion_.step = up_to(9) == 0 ? cl::Motion::Step::stays : cl::Motion::Step::none;
    return motion_;
  }

 private:
  std::mt19937_64 random_;
  cl::Motion motion_;
};

// As the Target behind `before`.
Target target_of(const cl::Motion& motion, std::uint32_t line, bool in_cone, const Target* before) {
  Target out{motion.tip_P, motion.axis_P, line, motion.rapid, motion.step};
  out.in_cone = in_cone;
  if (before == nullptr) return out;
  out.way_mm = (motion.tip_P - before->tip_P).norm();
  out.along_mm = before->along_mm + out.way_mm;
  out.turn = turn_between(motion.axis_P, before->axis_P);
  return out;
}

bool is_plain(const Target& target) {
  return !target.in_cone && !target.rapid && target.turn <= 0.5 * kPi && target.way_mm > 1.001 * kTipTells_mm;
}

// `all`: those since the beginning.
void expect_same(const PathPoints& points, const std::vector<Target>& all) {
  ASSERT_LE(points.size(), all.size());
  ASSERT_EQ(points.rows(), points.size() + 1);
  const std::size_t forgotten = all.size() - points.size();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Target& is = points[i];
    const Target& one = all[forgotten + i];
    ASSERT_EQ(is.tip_P, one.tip_P);
    ASSERT_EQ(is.axis_P, one.axis_P);
    ASSERT_EQ(is.line, one.line);
    ASSERT_EQ(is.rapid, one.rapid);
    ASSERT_EQ(is.step, one.step);
    ASSERT_EQ(is.in_cone, one.in_cone);
    ASSERT_EQ(is.way_mm, one.way_mm);
    ASSERT_EQ(is.along_mm, one.along_mm);
    ASSERT_EQ(is.turn, one.turn);
    const std::size_t row = i + 1;
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_EQ(points.tip_P[k][row], one.tip_P[static_cast<Eigen::Index>(k)]);
      ASSERT_EQ(points.axis_P[k][row], one.axis_P[static_cast<Eigen::Index>(k)]);
    }
    ASSERT_EQ(points.way_mm[row], one.way_mm);
    ASSERT_EQ(points.turn[row], one.turn);
    ASSERT_EQ(points.along_mm[row], one.along_mm);
    bool plain = true;
    for (std::size_t k = i; k < std::min(i + 4, points.size()); ++k) plain = plain && is_plain(points[k]);
    ASSERT_EQ(points.special[row] == 0.0, plain);
    if (i + 1 < points.size()) {
      ASSERT_EQ(points.passed_mm[row], one.along_mm + 0.125 * points[i + 1].way_mm);
    }
  }
}

TEST(PathPoints, StandInColumnsAsAlone) {
  for (const lanes::Way way : test::kEveryWay) {
    const test::Calculating lanes(way);
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      RandomMotions random(seed);
      FollowLimits limits;
      limits.has_cone = true;
      limits.cone_cosine = 0.99;
      PathPoints points;
      std::vector<Target> all;
      for (int piece = 0; piece < 60; ++piece) {
        std::vector<path::ChoicePoint> expected;
        std::vector<Vec3> programmed_P;
        const auto step = random.up_to(1) == 0 ? cl::Motion::Step::leaves : cl::Motion::Step::none;
        const bool is_tilted = random.up_to(1) == 0;
        for (std::size_t left = random.up_to(70); left > 0; --left) {
          const auto line = static_cast<std::uint32_t>(all.size());
          cl::Motion motion = random.next();
          motion.step = step;
          expected.push_back({{motion.tip_P, motion.axis_P}, SourceRef{line}, motion.rapid});
          if (is_tilted) {
            programmed_P.push_back(motion.axis_P);
            expected.back().pose.axis_P = Vec3::UnitX();
          }
          const bool in_cone = std::abs(motion.axis_P.z()) >= limits.cone_cosine;
          all.push_back(target_of(motion, line, in_cone, all.empty() ? nullptr : &all.back()));
        }
        points.add({expected, programmed_P, {}, step}, limits, 0.0);
        points.settle();
        if (points.empty()) continue;
        if (random.up_to(3) == 0) points.forget(random.up_to(points.size() - 1));
        expect_same(points, all);
        ASSERT_FALSE(HasFatalFailure()) << seed;
      }
    }
  }
}

}  // namespace
}  // namespace trunnion::post
