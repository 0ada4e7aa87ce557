#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// A block in ways of the axes over their accelerations (square seconds): a place changes its speed in one
/// axis by 1 at most.
struct AxisWay {
  std::array<double, kMaxAxes> along{};  // direction, of length 1
  double length = 0.0;
  double per_length = 0.0;  // 1 / length
  double asked_s = 0.0;
  double acceleration = 0.0;  // along the block, at most
  double fastest2 = 0.0;      // square of the speed that is asked for
};

/// How a block begins: behind a stop, behind a way that is not known, or from the block before it.
enum class BlockBegin : std::uint8_t { at_rest, unknown, at_corner };

/// Takes blocks to such ways.
class AxisWays {
 public:
  /// As MotionPlan has them.
  AxisWays(const Machine& machine, const JointVector& digits);

  /// `out` is a new one.
  void put(const JointVector& from, const JointVector& to, double seconds, AxisWay& out) const;
  /// By how much of `along` the path turns from one block into the next; what rounded words turn it by is no
  /// turn.
  double turn_of(AxisId id, const AxisWay& before, const AxisWay& next) const;
  /// By how much the linear axes turn there, mm for each unit of length.
  double linear_turn(const AxisWay& before, const AxisWay& next) const;

 private:
  std::array<double, kMaxAxes> acceleration_{}, per_acceleration_{}, digits_{};
  std::array<bool, kMaxAxes> is_linear_{};
};

/// Blocks of a path that wait to be settled. `Leg`: an AxisWay that knows how it `begins`.
template <class Leg>
class BlocksAhead {
 public:
  BlocksAhead(const Machine& machine, const JointVector& digits) : ways_(machine, digits) {}

  const AxisWays& ways() const { return ways_; }
  std::size_t size() const { return legs_.size() - first_; }
  bool empty() const { return size() == 0; }
  Leg& operator[](std::size_t i) { return legs_[first_ + i]; }
  const Leg& operator[](std::size_t i) const { return legs_[first_ + i]; }
  /// The block before it: one that waits, or the last one that was settled.
  const Leg& before(std::size_t i) const { return i > 0 ? legs_[first_ + i - 1] : settled_; }
  /// The next block. True where a corner is between it and the one before.
  bool add(const JointVector& from, const JointVector& to, double seconds) {
    legs_.push_back(kNew);  // one that is made there is set to zero first, which takes longer
    Leg& leg = legs_.back();
    ways_.put(from, to, seconds, leg);
    leg.begins = begins_;
    begins_ = BlockBegin::at_corner;
    if (leg.begins != BlockBegin::at_corner) return false;
    if (leg.length > 0.0 && before(size() - 1).length > 0.0) return true;
    leg.begins = BlockBegin::at_rest;  // a block that goes nowhere
    return false;
  }
  void stop() { begins_ = BlockBegin::at_rest; }
  void lose() { begins_ = BlockBegin::unknown; }
  /// The next one goes on from the last: over a corner, where it goes on at all.
  bool goes_on() const { return begins_ == BlockBegin::at_corner; }
  /// The first `count` are settled.
  void forget(std::size_t count) {
    settled_ = (*this)[count - 1];
    first_ += count;
    if (first_ < size()) return;  // so that few are moved
    legs_.erase(legs_.begin(), legs_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
  }

 private:
  static inline const Leg kNew{};

  AxisWays ways_;
  std::vector<Leg> legs_;
  std::size_t first_ = 0;  // those before it are settled
  Leg settled_;
  BlockBegin begins_ = BlockBegin::at_rest;  // the next one
};

}  // namespace trunnion
