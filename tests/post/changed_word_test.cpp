// One word of a program changed: the verification says what dense samples of the program say, made here from
// the NC text by the plain forward model, whichever side of the tolerance that is.
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"

#include "post/posting.hpp"
#include "support/cases.hpp"

namespace trunnion::post {
namespace {

constexpr double kTolerance_mm = 0.01;

struct Block {
  JointVector q;
  bool rapid = false;
};

std::vector<Block> blocks_of(const Machine& machine, const nc::Controller& c, const std::string& text) {
  std::vector<Block> out;
  JointVector words;
  std::size_t known = 0;
  for (const nc::Block& block : test::nc_blocks(c, text)) {
    const auto* motion = std::get_if<nc::Motion>(&block);
    if (motion == nullptr) continue;
    std::size_t named = 0;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      const nc::AxisLetter letter = *nc::axis_letter(machine.axes[id].name);
      if (!motion->words.has(letter)) continue;
      ++named;
      words[id] = c.numbers.axes.internal(letter, motion->words[letter]);
    }
    known = std::max(known, named);
    if (known < machine.axes.size()) continue;  // the way to the first point
    out.push_back(
        {joints_of_words(machine, words, machine.tool_vector()), motion->kind == nc::MotionKind::rapid});
  }
  return out;
}

// Largest distance of cutting motion from the CL path, and of a CL point from the motion.
struct Truth {
  double tip_mm = 0.0;
  double point_mm = 0.0;
};

Truth sampled(const Machine& machine, const std::vector<Block>& blocks, const std::vector<cl::Motion>& path) {
  constexpr int kSamples = 48;
  Truth truth;
  std::vector<double> nearest(path.size(), 1e9);
  for (std::size_t i = 1; i < blocks.size(); ++i) {
    if (blocks[i].rapid) continue;
    for (int k = 0; k <= kSamples; ++k) {
      const JointVector q =
          JointVector::interpolate(blocks[i - 1].q, blocks[i].q, static_cast<double>(k) / kSamples);
      const Vec3 tip_P = tool_pose(forward(machine, q)).tip_P;
      double distance = 1e9;
      for (std::size_t j = 1; j < path.size(); ++j) {
        if (path[j].rapid) continue;
        distance = std::min(distance, distance_to_segment(tip_P, path[j - 1].tip_P, path[j].tip_P));
      }
      truth.tip_mm = std::max(truth.tip_mm, distance);
      for (std::size_t j = 0; j < path.size(); ++j)
        nearest[j] = std::min(nearest[j], (tip_P - path[j].tip_P).norm());
    }
  }
  truth.point_mm = *std::max_element(nearest.begin(), nearest.end());
  return truth;
}

struct Count {
  int beyond = 0, within = 0, found = 0;
};

// `share` of the tolerance is added to one linear word of a cut.
Count change_words(path::Method method, double share, unsigned seed, int tries) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const nc::Controller c = test::shipped_controller("linuxcnc");
  const std::string cl = test::sample_path(seed, 24);
  Diagnostics d;
  const auto program = cl::read_program(cl, "part.cls", {}, d);
  std::vector<cl::Motion> path;
  for (const cl::Record& record : program->records) {
    if (const auto* motion = std::get_if<cl::Motion>(&record.data)) path.push_back(*motion);
  }
  PostOptions options;
  options.tolerance_mm = kTolerance_mm;
  options.nonlinear.method = method;
  const std::string nc = test::posted(cl, machine, options).nc;
  std::mt19937_64 random(seed);
  Count count;
  while (tries > 0) {
    --tries;
    const std::string text = test::with_changed_word(nc, random, share * kTolerance_mm);
    const auto v = test::verified(text, cl, machine, kTolerance_mm);
    if (!v) throw std::runtime_error(v.error().text());
    const Truth truth = sampled(machine, blocks_of(machine, c, text), path);
    constexpr double kClear = 1.01;  // of the tolerance: nearer to it, samples are no judge
    count.found += v->passed() ? 0 : 1;
    if (truth.tip_mm > kClear * kTolerance_mm) {
      ++count.beyond;
      EXPECT_FALSE(v->within_tolerance()) << "samples " << truth.tip_mm << ", tries left " << tries;
    } else if (std::max(truth.tip_mm, truth.point_mm) * kClear < kTolerance_mm) {
      ++count.within;
      EXPECT_TRUE(v->within_tolerance())
          << "samples " << truth.tip_mm << ", points " << truth.point_mm << ", verified "
          << v->certified_tip_deviation_mm << ", points " << v->max_point_deviation_mm << ", axis "
          << v->max_axis_deviation.deg();
      EXPECT_EQ(v->points_missed, 0U);
    }
  }
  return count;
}

TEST(LongChangedWord, IsFoundWhereItLeavesTheToleranceAndOnlyThere) {
  const int tries = test::cases(40);
  int beyond = 0;
  int within = 0;
  for (const path::Method method : {path::Method::reinsert, path::Method::adaptive}) {
    for (const double share : {0.1, 0.3, 1.0, 2.0, 3.0, 5.0}) {
      const Count count = change_words(method, share, 3, tries);
      beyond += count.beyond;
      within += count.within;
      std::printf("[ figures  ] %s, a word off by %.1f tolerances: %d of %d found, %d beyond the tolerance\n",
                  method == path::Method::reinsert ? "on the chord" : "two-sided", share, count.found, tries,
                  count.beyond);
    }
  }
  // Enough of both among the 480 words, or nothing was shown.
  EXPECT_GT(12 * beyond, 30 * tries);
  EXPECT_GT(12 * within, 15 * tries);
}

}  // namespace
}  // namespace trunnion::post
