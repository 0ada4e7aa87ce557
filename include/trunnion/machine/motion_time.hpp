#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "trunnion/machine/machine.hpp"

namespace trunnion {

/// What comes of a block on axes that accelerate no faster than they can (Axis::acceleration).
struct BlockRun {
  double pace = 1.0;  // largest speed that is reached in it, of the speed that was asked for: above 0, to 1
  double seconds = 0.0;  // that it takes; where the control looks one block ahead, until the next one begins
};

/// What is asked of a program: seconds cost as much again.
enum class PlanOf : std::uint8_t { paces, paces_and_seconds };

/// How long blocks take on a control that stops at their ends, or goes over into the next one while it slows
/// down (README, "Time"): straight from end to end in all axes, the speed a trapezoid. Give it the blocks one
/// after the other; what comes of each follows when the two behind it are known, or where it stops.
class MotionTime {
 public:
  /// @param blend_mm  the control goes over into the next block while it slows down, and leaves the corner by
  ///                  no more than this; nothing: it comes to rest at the end of every block (exact path)
  MotionTime(const Machine& machine, std::optional<double> blend_mm, PlanOf what)
      : machine_(machine), blend_mm_(blend_mm), what_(what) {}

  /// The machine file says of every axis how fast it accelerates.
  static bool is_known(const Machine& machine);

  /// A block that lasts `seconds` by its words, above 0; needs is_known. Appends to `out` what is settled.
  void go(const JointVector& from, const JointVector& to, double seconds, std::vector<BlockRun>& out);
  /// Nothing comes behind the last block that the control could go over into (a dwell, a tool change, the
  /// end): it runs as if it did, and comes to rest.
  void stop(std::vector<BlockRun>& out);
  /// It comes to rest between the last block and the next one.
  void rest(std::vector<BlockRun>& out);
  /// What it does here is not known: it does not slow down for it.
  void lose(std::vector<BlockRun>& out);

 private:
  /// What a block ends in. blends: the next begins while it slows down, each with half of the acceleration.
  /// rounds: both blocks move the linear axes alone, and the control goes along an arc between them.
  enum class End : std::uint8_t { stops, rests, blends, rounds, is_lost };
  struct Block {
    double square_s = 0.0;  // square of the time in which it is half run by all of its acceleration
    double asked_s = 0.0;
    double length = 0.0;  // of the linear axes, mm; of the rotary ones, degrees, where these stand still
    Vec3 direction = Vec3::Zero();
    bool turns = false;      // a rotary axis
    double begins_at = 0.0;  // speed in the corner before it, where that is rounded
    double ends_at = 0.0;    // in the one behind it
    End end = End::stops;
    /// Where it blends, or would if anything came, the acceleration is halved.
    double acceleration() const;
    double speed() const;  // that it reaches, at most the one asked for
    double lasts_s() const { return length / speed(); }
  };
  Block block_of(const JointVector& from, const JointVector& to, double seconds) const;
  End end_between(const Block& before, const Block& next) const;
  /// The last block ends so; all that wait are settled but the last, where it goes on.
  void end_last(End end, std::vector<BlockRun>& out);
  BlockRun run_of(const Block& block, const Block* next) const;
  /// Speed of `before` from which on the next block takes over.
  double blending_speed(const Block& before, const Block& next) const;
  /// Speed along the arc between two blocks.
  double rounding_speed(const Block& before, const Block& next) const;

  const Machine& machine_;
  std::optional<double> blend_mm_;
  PlanOf what_;
  std::array<Block, 2> waiting_;
  std::size_t count_ = 0;
};

}  // namespace trunnion
