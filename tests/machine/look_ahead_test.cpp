// Speeds along a path: closed forms, and random paths against a solver of this file's own.
#include "machine/look_ahead.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "trunnion/machine/motion_plan.hpp"

#include "support/cases.hpp"
#include "support/machines.hpp"

namespace trunnion {
namespace {

using test::accelerating;
using test::xy;

// A path at `mm_s`, lengths of the linear axes.
std::vector<BlockRun> runs_of(const Machine& machine, const std::vector<JointVector>& path, double mm_s,
                              const BlockEnds& ends, const JointVector& digits = {}) {
  MotionPlan plan(machine, ends, digits, PlanOf::paces_and_seconds);
  for (std::size_t i = 1; i < path.size(); ++i) {
    double way = 0.0;
    for (AxisId id = 0; id < 3; ++id) way = std::hypot(way, path[i][id] - path[i - 1][id]);
    plan.add({path[i - 1], path[i], way / mm_s});
  }
  std::vector<BlockRun> out;
  plan.settle(plan.waiting(), out);
  return out;
}

double seconds_of(const std::vector<BlockRun>& runs) {
  double out = 0.0;
  for (const BlockRun& run : runs) out += run.seconds;
  return out;
}

// 100 mm at 50 mm/s and 1000 mm/s2: 0.05 s and 1.25 mm each for getting up and down.
TEST(LookAhead, AStraightPathIsATrapezoidHoweverItIsDivided) {
  const Machine machine = accelerating(1000.0, 10.0);
  for (const int blocks : {1, 2, 7, 1000}) {
    std::vector<JointVector> path;
    for (int i = 0; i <= blocks; ++i) path.push_back(xy(100.0 * i / blocks, 0.0));
    const auto runs = runs_of(machine, path, 50.0, {});
    EXPECT_NEAR(seconds_of(runs), 0.05 + 97.5 / 50.0 + 0.05, 1e-9) << blocks;
    // 0.1 mm from rest: sqrt(2 1000 0.1) mm/s.
    if (blocks == 1000) {
      EXPECT_NEAR(runs[0].pace, std::sqrt(200.0) / 50.0, 1e-9);
    }
    EXPECT_EQ(runs[static_cast<std::size_t>(blocks) / 2].pace, 1.0) << blocks;
  }
}

// X turns into Y over 5 mm on either side: at most sqrt(1000 10) mm/s, twice 50; within 0.01 mm over
// 0.02 sqrt(2) mm, at sqrt(1000 0.04 sqrt(2)) mm/s.
TEST(LookAhead, ACornerIsTakenAsFastAsItsToleranceAllows) {
  const Machine machine = accelerating(1000.0, 10.0);
  const std::vector<JointVector> path = {xy(0.0, 0.0), xy(10.0, 0.0), xy(10.0, 10.0)};
  BlockEnds ends;
  EXPECT_NEAR(seconds_of(runs_of(machine, path, 50.0, ends)), 0.4 + 0.05, 1e-9);
  ends.blend_mm = 0.01;
  const double zone = 0.04 / std::sqrt(2.0);
  const double corner = std::sqrt(1000.0 * 2.0 * zone);
  const double down = (50.0 * 50.0 - corner * corner) / 2000.0;
  const double one = 0.05 + (10.0 - zone - 1.25 - down) / 50.0 + (50.0 - corner) / 1000.0 + zone / corner;
  EXPECT_NEAR(seconds_of(runs_of(machine, path, 50.0, ends)), 2.0 * one, 1e-9);
}

// A circle of 5 mm: sqrt(1000 5) mm/s where the path goes along an axis, and the other one turns it alone.
TEST(LookAhead, ACircleIsAsFastAsItsCurvatureAllows) {
  const Machine machine = accelerating(1000.0, 10.0);
  std::vector<JointVector> path;
  for (int i = 0; i <= 4000; ++i) path.push_back(xy(5.0 * std::cos(0.005 * i), 5.0 * std::sin(0.005 * i)));
  const auto runs = runs_of(machine, path, 200.0, {});
  double slowest = 1.0;
  for (std::size_t i = 1000; i < 3000; ++i) slowest = std::min(slowest, runs[i].pace);
  EXPECT_NEAR(200.0 * slowest, std::sqrt(5000.0), 0.01 * std::sqrt(5000.0));
}

// Words of 0.001 mm every 0.01 mm: what they are rounded by is no corner.
TEST(LookAhead, RoundedWordsAskForNoAcceleration) {
  const Machine machine = accelerating(1000.0, 10.0);
  std::vector<JointVector> path;
  for (int i = 0; i <= 2000; ++i) path.push_back(xy(1e-3 * std::round(9.3 * i), 1e-3 * std::round(3.7 * i)));
  JointVector digits;
  for (AxisId id = 0; id < 3; ++id) digits[id] = 1e-3;
  EXPECT_EQ(runs_of(machine, path, 20.0, {}, digits)[1000].pace, 1.0);
  EXPECT_LT(runs_of(machine, path, 20.0, {})[1000].pace, 0.9);
}

TEST(LookAhead, StopsAreStops) {
  const Machine machine = accelerating(1000.0, 10.0);
  MotionPlan plan(machine, {}, {}, PlanOf::paces_and_seconds);
  const JointVector a = xy(0.0, 0.0), b = xy(10.0, 0.0), c = xy(20.0, 0.0);
  std::vector<BlockRun> runs;
  plan.add({a, b, 0.2});
  plan.stop();
  plan.add({b, c, 0.2});
  plan.add({c, a, 0.1, true});  // apart
  plan.add({a, b, 0.2});
  plan.settle(4, runs);
  for (const std::size_t i : {0U, 1U, 3U}) EXPECT_NEAR(runs[i].seconds, 0.2 + 0.05, 1e-9) << i;
  EXPECT_NEAR(runs[2].seconds, 2.0 * std::sqrt(20.0 / 1000.0), 1e-9);
}

// 100 mm, a way that nobody knows, 100 mm: neither gets up to speed behind it nor slows down before it.
TEST(LookAhead, WhatIsNotKnownSlowsNothingDown) {
  const Machine machine = accelerating(1000.0, 10.0);
  MotionPlan plan(machine, {}, {}, PlanOf::paces_and_seconds);
  const JointVector a = xy(0.0, 0.0), b = xy(100.0, 0.0), c = xy(100.0, 100.0);
  plan.lose();
  plan.add({a, b, 2.0});
  plan.lose();
  plan.add({b, c, 2.0});
  std::vector<BlockRun> runs;
  plan.settle(2, runs);
  EXPECT_NEAR(runs[0].seconds, 2.0, 1e-12);
  EXPECT_NEAR(runs[1].seconds, 2.025, 1e-12);
}

// The other two kinds of control: MotionTime, and the pace at which a block gets to its speed.
TEST(MotionPlan, OfAControlThatStopsIsThatOfEachBlock) {
  const Machine machine = accelerating(1000.0, 10.0);
  const std::vector<JointVector> path = {xy(0.0, 0.0), xy(10.0, 0.0), xy(10.1, 0.0)};
  BlockEnds ends;
  ends.stops = true;
  const auto runs = runs_of(machine, path, 50.0, ends);
  EXPECT_EQ(runs[0].pace, 1.0);
  EXPECT_NEAR(runs[0].seconds, 0.25, 1e-12);
  EXPECT_NEAR(runs[1].pace, 0.002 / std::sqrt(1e-4), 1e-12);
  EXPECT_NEAR(runs[1].seconds, 0.02, 1e-12);
  ends.stops = false;
  ends.looks_ahead = false;
  // It stops behind the second, with half of its acceleration.
  EXPECT_NEAR(runs_of(machine, {path[1], path[2]}, 50.0, ends)[0].pace, 0.002 / std::sqrt(2e-4), 1e-12);
}

// --- random paths ---

struct RandomPath {
  std::vector<JointVector> q;
  std::vector<double> seconds;  // of the block behind it, by its feed
};

// Steps of all sizes, smooth pieces among corners and ways back.
RandomPath random_path(std::mt19937_64& random, const Machine& machine, std::size_t blocks) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  RandomPath out;
  out.q.emplace_back();
  JointVector along;
  const double bend = std::pow(10.0, 1.5 * u(random) - 1.0);
  const double spread = u(random) > 0.0 ? 0.1 : 1.0;
  const double size = std::pow(10.0, u(random));
  for (std::size_t i = 0; i < blocks; ++i) {
    const bool corner = i == 0 || u(random) > 0.9;
    JointVector next = out.q.back();
    double way = 0.0;
    const double step = size * std::pow(10.0, spread * u(random));
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      along[id] = corner ? u(random) : along[id] + bend * u(random);
      const bool linear = machine.axes[id].kind == AxisKind::linear;
      next[id] += (linear ? 1.0 : 0.01) * step * along[id];
      if (linear) way = std::hypot(way, next[id] - out.q.back()[id]);
    }
    out.q.push_back(next);
    out.seconds.push_back(way / 80.0);
  }
  return out;
}

using PerAxis = std::array<double, kMaxAxes>;

// A piece of the rounded path: its direction runs evenly from one to the other, in ways over accelerations.
struct Piece {
  PerAxis from{}, to{};
  double length = 0.0;
  double fastest2 = 0.0;
};

std::vector<Piece> pieces_of(const Machine& machine, const RandomPath& path, std::optional<double> blend_mm) {
  const std::size_t count = path.seconds.size();
  const std::size_t axes = machine.axes.size();
  std::vector<PerAxis> along(count);
  std::vector<double> length(count), before(count), behind(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < axes; ++k) {
      along[i][k] = (path.q[i + 1][k] - path.q[i][k]) / *machine.axes[k].acceleration;
      length[i] = std::hypot(length[i], along[i][k]);
    }
    for (double& a : along[i]) a /= length[i];
  }
  std::vector<PerAxis> middle(count);
  for (std::size_t i = 1; i < count; ++i) {
    double turn_mm = 0.0;
    for (std::size_t k = 0; k < 3; ++k)
      turn_mm = std::hypot(turn_mm, (along[i][k] - along[i - 1][k]) * *machine.axes[k].acceleration);
    const double most = blend_mm ? 4.0 * *blend_mm / turn_mm : 1e30;
    before[i - 1] = std::min(length[i - 1] / 2, most);
    behind[i] = std::min(length[i] / 2, most);
    const double share = before[i - 1] / (before[i - 1] + behind[i]);
    for (std::size_t k = 0; k < axes; ++k)
      middle[i][k] = along[i - 1][k] + share * (along[i][k] - along[i - 1][k]);
  }
  std::vector<Piece> out;
  for (std::size_t i = 0; i < count; ++i) {
    const double fastest = length[i] / path.seconds[i];
    const double straight = length[i] - behind[i] - before[i];
    if (behind[i] > 0.0) out.push_back({middle[i], along[i], behind[i], fastest * fastest});
    if (straight > 1e-12 * length[i]) out.push_back({along[i], along[i], straight, fastest * fastest});
    if (before[i] > 0.0) out.push_back({along[i], middle[i + 1], before[i], fastest * fastest});
  }
  return out;
}

// The least time: the pieces in small steps, the largest speed from which the end can be
// reached found by halving, with the signs of all accelerations.
class OwnSolver {
 public:
  explicit OwnSolver(const std::vector<Piece>& pieces) {
    for (const Piece& piece : pieces) {
      const int count = piece.from == piece.to ? 80 : 24;
      for (int i = 0; i < count; ++i) {
        Piece step = piece;
        for (std::size_t k = 0; k < kMaxAxes; ++k) {
          const double turn = piece.to[k] - piece.from[k];
          step.from[k] = piece.from[k] + turn * i / count;
          step.to[k] = piece.from[k] + turn * (i + 1) / count;
        }
        step.length /= count;
        steps_.push_back(step);
      }
    }
    most2_.assign(steps_.size() + 1, 0.0);
    for (std::size_t i = steps_.size(); i-- > 1;) {
      double least = 0.0;
      double most = std::min(steps_[i].fastest2, steps_[i - 1].fastest2);
      for (int k = 0; k < 60; ++k) {
        const double half = 0.5 * (least + most);
        (reachable(i, half).first <= most2_[i + 1] ? least : most) = half;
      }
      most2_[i] = least;
    }
    double at2 = 0.0;
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const double next2 = std::clamp(reachable(i, at2).second, 0.0, most2_[i + 1]);
      seconds += 2.0 * steps_[i].length / (std::sqrt(at2) + std::sqrt(next2));
      at2 = next2;
    }
  }

  double seconds = 0.0;

 private:
  // Squares of the speed at the end of a step that the axes allow from this one at its begin; first above
  // second where they allow none.
  std::pair<double, double> reachable(std::size_t i, double from2) const {
    const Piece& step = steps_[i];
    std::pair out(0.0, 1e30);
    for (std::size_t k = 0; k < kMaxAxes; ++k) {
      // With b = along / 2 length: |b (to2 - from2) + turn speed2| <= 1, at both ends of the step.
      const double turn = (step.to[k] - step.from[k]) / step.length;
      for (const double along : {step.from[k], step.to[k]}) {
        const double b = along / (2.0 * step.length);
        for (const bool at_begin : {true, false}) {
          const double slope = at_begin ? b : b + turn;
          const double rest = at_begin ? (turn - b) * from2 : -b * from2;
          if (std::abs(slope) < 1e-300) {
            if (std::abs(rest) > 1.0) out.first = 1e30;
            continue;
          }
          const double x = (-1.0 - rest) / slope, y = (1.0 - rest) / slope;
          out.first = std::max(out.first, std::min(x, y));
          out.second = std::min(out.second, std::max(x, y));
        }
      }
    }
    if (out.first > out.second) out.first = 1e30;
    return out;
  }

  std::vector<Piece> steps_;
  std::vector<double> most2_;
};

// Velocities sampled along the path with the speeds of the plan: the largest acceleration between two
// samples over what the axis can, and the largest speed over what is asked for.
struct Largest {
  double acceleration = 0.0, speed = 0.0;
};
Largest sampled(const std::vector<Piece>& pieces, const std::vector<SpeedProfile>& profiles) {
  Largest out;
  PerAxis before{};
  double at2 = 0.0;
  const auto go = [&](const Piece& piece, double begin, double end, double to2) {
    constexpr int kSamples = 40;
    const double from2 = at2;
    if (end - begin < 1e-9) {  // the difference of two samples would be rounding
      at2 = to2;
      return;
    }
    for (int i = 1; i <= kSamples; ++i) {
      const double share = static_cast<double>(i) / kSamples;
      const double next2 = from2 + share * (to2 - from2);
      const double seconds =
          2.0 * (end - begin) * piece.length / kSamples / (std::sqrt(at2) + std::sqrt(next2));
      for (std::size_t k = 0; k < kMaxAxes; ++k) {
        const double along = piece.from[k] + (begin + share * (end - begin)) * (piece.to[k] - piece.from[k]);
        const double velocity = along * std::sqrt(next2);
        out.acceleration = std::max(out.acceleration, std::abs(velocity - before[k]) / seconds);
        before[k] = velocity;
      }
      out.speed = std::max(out.speed, std::sqrt(next2 / piece.fastest2));
      at2 = next2;
    }
  };
  std::size_t p = 0;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const SpeedProfile& profile = profiles[i];
    EXPECT_NEAR(profile.begin2, at2, 1e-9 * profile.fastest2);
    if (profile.behind > 0.0) go(pieces[p++], 0.0, 1.0, profile.behind2);
    if (profile.straight() > 1e-12 * profile.length) {
      const double length = pieces[p].length;
      const double up = 0.5 * (profile.middle2 - profile.behind2) / profile.acceleration / length;
      const double down = 0.5 * (profile.middle2 - profile.before2) / profile.acceleration / length;
      go(pieces[p], 0.0, std::min(up, 1.0), profile.middle2);
      go(pieces[p], std::min(up, 1.0), std::max(up, 1.0 - down), profile.middle2);
      go(pieces[p++], std::max(up, 1.0 - down), 1.0, profile.before2);
    }
    if (profile.before > 0.0) go(pieces[p++], 0.0, 1.0, profile.end2);
  }
  EXPECT_EQ(p, pieces.size());
  EXPECT_NEAR(at2, 0.0, 1e-12);
  return out;
}

TEST(LongLookAhead, RandomPathsKeepEveryLimitAndAreNearlyAsFastAsCanBe) {
  std::mt19937_64 random(28);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  Largest largest;
  double slower = 0.0, all = 0.0;
  const int cases = test::cases(200, "TRUNNION_CASES");
  for (int i = 0; i < cases; ++i) {
    Machine machine = accelerating(1000.0, 10.0);
    for (Axis& axis : machine.axes) *axis.acceleration *= std::pow(10.0, 0.5 * u(random));
    const RandomPath path = random_path(random, machine, 20);
    const std::optional<double> blend =
        i % 2 == 0 ? std::optional(std::pow(10.0, u(random) - 2.0)) : std::nullopt;
    LookAhead plan(machine, blend, {}, PlanOf::paces);
    std::vector<SpeedProfile> profiles;
    std::vector<BlockRun> runs;
    for (std::size_t k = 0; k < path.seconds.size(); ++k) plan.add(path.q[k], path.q[k + 1], path.seconds[k]);
    plan.settle(plan.waiting(), runs, &profiles);
    const auto pieces = pieces_of(machine, path, blend);
    const Largest here = sampled(pieces, profiles);
    EXPECT_LT(here.acceleration, 1.0 + 1e-6) << "path " << i;
    EXPECT_LT(here.speed, 1.0 + 1e-9) << "path " << i;
    largest.acceleration = std::max(largest.acceleration, here.acceleration);
    largest.speed = std::max(largest.speed, here.speed);
    double planned_s = 0.0;
    for (const SpeedProfile& profile : profiles) planned_s += profile.seconds();
    const double own_s = OwnSolver(pieces).seconds;
    EXPECT_GT(planned_s, 0.98 * own_s) << "path " << i;  // whose steps make it cautious
    slower = std::max(slower, planned_s / own_s - 1.0);
    all += (planned_s / own_s - 1.0) / cases;
  }
  EXPECT_GT(largest.acceleration, 0.999);  // and they are used
  EXPECT_GT(largest.speed, 0.999);
  EXPECT_LT(slower, 0.2);
  EXPECT_LT(all, 0.03);
  std::printf("%d paths: slower than can be by %.4f at most, %.4f on average\n", cases, slower, all);
}

// Blocks that are settled early, with enough behind them, are what they are where all are known.
TEST(LookAhead, PiecesAreAsTheWhole) {
  std::mt19937_64 random(29);
  const Machine machine = accelerating(1000.0, 10.0);
  for (int i = 0; i < test::cases(50); ++i) {
    const RandomPath path = random_path(random, machine, 400);
    LookAhead whole(machine, std::nullopt, {}, PlanOf::paces),
        pieces(machine, std::nullopt, {}, PlanOf::paces);
    std::vector<BlockRun> a, b;
    for (std::size_t k = 0; k < path.seconds.size(); ++k) {
      whole.add(path.q[k], path.q[k + 1], path.seconds[k]);
      pieces.add(path.q[k], path.q[k + 1], path.seconds[k]);
      if (pieces.waiting() == 200) pieces.settle(50, b);
    }
    whole.settle(whole.waiting(), a);
    pieces.settle(pieces.waiting(), b);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) ASSERT_NEAR(a[k].pace, b[k].pace, 1e-9) << i << " " << k;
  }
}

}  // namespace
}  // namespace trunnion
