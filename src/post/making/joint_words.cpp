#include "post/making/joint_words.hpp"

#include <cmath>

namespace trunnion::post {
namespace {

// Under tool-centre-point control the linear words are not joint positions: those are not rounded.
JointVector quantum_of(const Posting& posting) {
  const Machine& machine = posting.machine;
  JointVector out;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    if (posting.options.rtcp && machine.axes[id].kind == AxisKind::linear) continue;
    out[id] = posting.controller.numbers.axes.quantum(posting.letters[id]);
  }
  return out;
}

}  // namespace

JointWords::JointWords(const Posting& posting, const SpindleTool& tool)
    : posting_(posting),
      rounding_(path::Rounding::of(posting.machine, tool.in_words(), quantum_of(posting))),
      axis_count_(posting.machine.axes.size()),
      fill_runs_(axis_count_ == nc::RunBlock::kAxes && !posting.options.rtcp) {
  take_travel();
  for (AxisId id = 0; id < axis_count_; ++id) {
    motion_.words.set(posting.letters[id], 0);
    quanta_per_unit_[id] = 1.0 / posting.controller.numbers.axes.quantum(posting.letters[id]);
    if (posting.machine.axes[id].kind == AxisKind::linear)
      radius_mm_ = std::hypot(radius_mm_, 0.5 * rounding_.quantum[id]);
  }
}

void JointWords::set_tool(const SpindleTool& tool) {
  rounding_ = path::Rounding::of(posting_.machine, tool.in_words(), rounding_.quantum);
}

void JointWords::take_travel() {
  for (AxisId id = 0; id < axis_count_; ++id) {
    least_[id] = posting_.machine.axes[id].min;
    most_[id] = posting_.machine.axes[id].max;
  }
}

const nc::Motion& JointWords::motion(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed,
                                     SourceRef where) {
  motion_.kind = kind;
  motion_.feed_mode = feed.mode;
  motion_.feed = feed.quanta;
  motion_.source = where;
  for (AxisId id = 0; id < axis_count_; ++id) {
    const nc::AxisLetter letter = posting_.letters[id];
    motion_.words.quanta[nc::index(letter)] =
        posting_.controller.numbers.axes.quanta(letter, q[id] + rounding_.offset[id]);
  }
  return motion_;
}

}  // namespace trunnion::post
