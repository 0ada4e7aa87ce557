#include "post/making/servo_lead.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::post {
namespace {

// In one measure: mm, and rad times a lever of the size of parts.
constexpr double kLever_mm = 100.0;
// Share of the tolerance by which the lead of all axes together may jump from one block to the next.
constexpr double kJumpShare = 0.25;
// What an axis accelerates by for certain where the machine file does not say: mm/s2, and a tenth of it in
// rad/s2; of what it says a third.
constexpr double kSure_mm_s2 = 1000.0;
constexpr double kSureShare = 1.0 / 3.0;
// Where a change of pace begins, the lead begins to move: at this speed at most, which an axis has at once.
constexpr double kAtOnce_mm_s = 4.0;
constexpr double kShortest_s = 0.002;  // of a block
constexpr double kRestOfLag = 2.0;     // in which, of the longest lag, what is left of a way falls to 1 / e
// A control stops at sharp corners, or nearly so, whichever axis turns there; which ones it takes for sharp
// nobody knows here: rad, of the way of all axes.
constexpr double kSharp = 0.26;

}  // namespace

struct ServoLead::Run {
  Block block;
  JointVector velocity;             // at the pace 1
  double change = 0.0;              // of the pace, per second
  double begin2 = 0.0, end2 = 0.0;  // squares of the paces at its ends
  // Of a way to rest, seconds, else 0: as a pace that changes evenly falls x + tau dx/dt goes past the end
  // and comes back; where dx/dt falls in proportion to what is left, in more than tau, it does not.
  double rests_s = 0.0;

  double pace(double u) const {  // u: seconds at the pace 1 from its beginning
    const double left = block.seconds - u;
    const double up = begin2 + 2.0 * change * u, down = end2 + 2.0 * change * left;
    const double even = std::sqrt(std::min({1.0, up, down}));
    return rests_s > 0.0 ? std::min(even, std::sqrt(end2) + left / rests_s) : even;
  }
  // Seconds at the pace 1 before its end at which it has that pace.
  double before_end(double pace) const {
    return std::max((pace * pace - end2) / (2.0 * change), rests_s * (pace - std::sqrt(end2)));
  }
};

ServoLead::ServoLead(const Machine& machine, const JointVector& lag_s, double tolerance_mm)
    : machine_(machine), lag_s_(lag_s), jump_mm_(kJumpShare * tolerance_mm) {
  for (AxisId id = 0; id < machine.axes.size(); ++id) is_on_ = is_on_ || lag_s[id] != 0.0;
}

double ServoLead::led_mm(const JointVector& velocity) const {
  double sum2 = 0.0;
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const double by =
        lag_s_[id] * velocity[id] * (machine_.axes[id].kind == AxisKind::linear ? 1.0 : kLever_mm);
    sum2 += by * by;
  }
  return std::sqrt(sum2);
}

// No axis is asked for more than it accelerates by, and the lead moves off gently.
double ServoLead::pace_change(const JointVector& velocity) const {
  double out = kAtOnce_mm_s / std::max(led_mm(velocity), 1e-9);
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const Axis& axis = machine_.axes[id];
    const double sure = axis.acceleration               ? kSureShare * *axis.acceleration
                        : axis.kind == AxisKind::linear ? kSure_mm_s2
                                                        : kSure_mm_s2 / kLever_mm;
    out = std::min(out, sure / std::max(std::abs(velocity[id]), 1e-9));
  }
  return out;
}

bool ServoLead::is_sharp(const Run& before, const Run& behind) const {
  double along = 0.0, before2 = 0.0, behind2 = 0.0;
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const double unit = machine_.axes[id].kind == AxisKind::linear ? 1.0 : kLever_mm;
    const double a = unit * before.velocity[id], b = unit * behind.velocity[id];
    along += a * b;
    before2 += a * a;
    behind2 += b * b;
  }
  return along < std::cos(kSharp) * std::sqrt(before2 * behind2);
}

// Paces at the ends of all blocks: what corners leave, come to and left no faster than axes can.
void ServoLead::plan(std::vector<Run>& runs) const {
  const auto at_jump2 = [&](double led) { return led > jump_mm_ ? jump_mm_ * jump_mm_ / (led * led) : 1.0; };
  const auto at_rest2 = [&](const Run& run) { return at_jump2(2.0 * led_mm(run.velocity)); };
  // In a corner half of the jump is behind, at rest all of it.
  const auto at_corner2 = [&](const Run& before, const Run& behind) {
    if (is_sharp(before, behind)) return std::min(at_rest2(before), at_rest2(behind));
    JointVector jump;
    for (AxisId id = 0; id < machine_.axes.size(); ++id) jump[id] = behind.velocity[id] - before.velocity[id];
    return at_jump2(led_mm(jump));
  };
  for (std::size_t k = 0; k < runs.size(); ++k) {
    runs[k].begin2 = k > 0 ? at_corner2(runs[k - 1], runs[k]) : at_rest2(runs[k]);
    runs[k].end2 = k + 1 < runs.size() ? at_corner2(runs[k], runs[k + 1]) : at_rest2(runs[k]);
  }
  for (std::size_t k = 0; k < runs.size(); ++k) {
    if (k > 0) runs[k].begin2 = runs[k - 1].end2;
    runs[k].end2 = std::min(runs[k].end2, runs[k].begin2 + 2.0 * runs[k].change * runs[k].block.seconds);
  }
  for (std::size_t k = runs.size(); k-- > 0;) {
    if (k + 1 < runs.size()) runs[k].end2 = runs[k + 1].begin2;
    runs[k].begin2 = std::min(runs[k].begin2, runs[k].end2 + 2.0 * runs[k].change * runs[k].block.seconds);
    if (k + 1 == runs.size()) runs[k].begin2 = std::min(runs[k].begin2, std::pow(runs[k].pace(0.0), 2));
  }
}

// The block in pieces: where its pace changes, each changes the lead by a jump's size at most.
void ServoLead::lead(const Run& run, const std::optional<JointVector>& velocity_behind,
                     std::vector<Led>& out) const {
  const double seconds = run.block.seconds;
  const double step = std::max(jump_mm_ / std::max(led_mm(run.velocity), 1e-9), run.change * kShortest_s);
  std::vector<double> ends;
  const auto ramp = [&](double from2, bool at_end) {
    const double most2 = std::min(1.0, 0.5 * (run.begin2 + run.end2) + run.change * seconds);
    const double from = std::sqrt(from2), rise = std::sqrt(most2) - from;
    const int pieces = static_cast<int>(std::ceil(rise / step - 1e-9));
    for (int j = 1; j <= pieces; ++j) {
      const double pace = from + rise * j / pieces;
      ends.push_back(at_end ? seconds - run.before_end(pace) : (pace * pace - from2) / (2.0 * run.change));
    }
  };
  ramp(run.begin2, false);
  ramp(run.end2, true);
  std::sort(ends.begin(), ends.end());
  double last = 0.0;
  ends.push_back(seconds);
  // Where it goes slowly little of the block takes long.
  const auto takes = [&](double from, double to) {
    return 2.0 * (to - from) / std::max(run.pace(from) + run.pace(to), 1e-9);
  };
  const Led end = led_at(run, seconds, velocity_behind);
  for (const double u : ends) {
    const bool is_end = u == seconds;
    const double lasts = takes(last, u);
    if (!is_end && (lasts < kShortest_s || takes(u, seconds) < kShortest_s)) continue;
    if (u <= last) continue;
    Led led = is_end ? end : led_at(run, u, run.velocity);
    led.seconds = lasts;
    out.push_back(led);
    last = u;
  }
}

// Where its velocity becomes another one in the middle of both; nothing is led where it comes to rest.
ServoLead::Led ServoLead::led_at(const Run& run, double u,
                                 const std::optional<JointVector>& velocity_behind) const {
  Led out;
  out.to = u < run.block.seconds
               ? JointVector::interpolate(run.block.from, run.block.to, u / run.block.seconds)
               : run.block.to;
  out.where = run.block.where;
  if (!velocity_behind) return out;
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    out.by[id] = lag_s_[id] * run.pace(u) * 0.5 * (run.velocity[id] + (*velocity_behind)[id]);
    out.to[id] += out.by[id];
  }
  return out;
}

std::vector<ServoLead::Led> ServoLead::take() {
  if (blocks_.empty()) return {};
  std::vector<Run> runs;
  runs.reserve(blocks_.size());
  for (const Block& block : blocks_) {
    Run run{block, {}};
    for (AxisId id = 0; id < machine_.axes.size(); ++id)
      run.velocity[id] = (block.to[id] - block.from[id]) / block.seconds;
    run.change = pace_change(run.velocity);
    runs.push_back(run);
  }
  blocks_.clear();
  for (AxisId id = 0; id < machine_.axes.size(); ++id)
    runs.back().rests_s = std::max(runs.back().rests_s, kRestOfLag * lag_s_[id]);
  plan(runs);
  std::vector<Led> out;
  for (std::size_t k = 0; k < runs.size(); ++k)
    lead(runs[k], k + 1 < runs.size() ? std::optional(runs[k + 1].velocity) : std::nullopt, out);
  return out;
}

}  // namespace trunnion::post
