#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "machine/axis_ways.hpp"

namespace trunnion {

/// A corner that the path may pass as fast as both of its blocks ask for it (README, "Jerk", steady ways).
/// Speeds are squares.
struct SteadyCorner {
  /// The smaller of both; 0 where the path turns over less than the halves of both blocks.
  double asked2 = 0.0;
  double curve = 0.0;    // SmoothLeg::curve of the axis that has the most
  double curve_s = 0.0;  // the most of these, each times its axis' time from no acceleration to the largest
  double line2 = 0.0;    // where lines from corner to corner turn, which the speed rounds
  double speed2 = 0.0, slope = 0.0;
  bool is_steady = false;
};

/// A block of a path whose curvature jumps nowhere, and the corner at its begin (README, "Jerk").
struct SmoothLeg : AxisWay {
  BlockBegin begins = BlockBegin::at_rest;
  /// The path turns over so much of the block before it and of its own begin.
  double turns_before = 0.0, turns_behind = 0.0;
  /// The corner has all of that half of the block, whose middle need not be straight then.
  bool joins_before = false, joins_behind = false;
  std::array<double, kMaxAxes> curve{};   // the corner's turn for each length, on average
  std::array<double, kMaxAxes> middle{};  // curvature in the middle of the block
  bool is_shaped = false;                 // what is settled rests upon `middle`
  /// Square of the largest speed in it, where the machine stands at the begin or the end that is not known.
  double standing2 = 0.0;
  SteadyCorner corner;
};

/// What a piece of the path asks of each axis at most, without signs: speed s' moves it at steep s', the
/// acceleration s'' and the jerk s''' accelerate it by steep s'' + curved s'^2 and change that at the rate of
/// steep s''' + 3 curved s' s'' + twisted s'^3. The last takes from what is left for a jerk upwards where it
/// has the sign of the direction, from that for one downwards where it has the other.
struct SmoothShape {
  std::array<double, kMaxAxes> steep{}, curved{}, twisted_up{}, twisted_down{};
  bool is_straight = false;
  double most2 = 0.0;  // square of the speed
};

/// Along a piece no axis is asked for too much if speed, acceleration and jerk keep to three bounds of their
/// own.
struct SmoothBounds {
  double acceleration = 0.0;
  double jerk_up = 0.0, jerk_down = 0.0;  // the speed's own jerk, s'''
};

/// A piece of a block.
struct SmoothCell {
  double length = 0.0;
  std::size_t shape = 0;
  bool ends_block = false;
};

/// The pieces of a window of blocks, short enough that the speed changes little along each.
class SmoothPath {
 public:
  /// @param per_jerk  of each axis, its acceleration over its jerk, seconds
  explicit SmoothPath(const std::array<double, kMaxAxes>& per_jerk) : per_jerk_(per_jerk) {}

  const std::array<double, kMaxAxes>& per_jerk() const { return per_jerk_; }
  void clear();
  /// @param next  the block behind it, if the path goes on into it
  void add(const SmoothLeg* before, const SmoothLeg& leg, const SmoothLeg* next);
  const std::vector<SmoothCell>& cells() const { return cells_; }
  const SmoothShape& shape(const SmoothCell& cell) const { return shapes_[cell.shape]; }
  /// For speeds up to the root of `most2`, and accelerations up to `most_acceleration` and `more` of the
  /// largest: the less these are, the more is left for the jerk.
  SmoothBounds bounds(const SmoothShape& shape, double most2, double most_acceleration, double more) const;

 private:
  using PerAxis = std::array<double, kMaxAxes>;
  /// One half of a corner: direction and curvature run from its outer end to the corner itself.
  struct Half {
    PerAxis along{}, at_corner{};         // direction
    PerAxis curve_outside{}, curve_at{};  // curvature
    PerAxis fastest{};                    // speed of each axis
    double length = 0.0;
    double fastest2 = 0.0;  // square of the speed that is asked for
  };
  Half half(const SmoothLeg& before, const SmoothLeg& leg, bool is_before) const;
  void add_half(const Half& half, bool outwards, double ramp_s);
  void add_straight(const SmoothLeg& leg, double length, double ends2[2]);
  double most2(const SmoothShape& shape, double fastest2) const;

  PerAxis per_jerk_;
  std::vector<SmoothShape> shapes_;
  std::vector<SmoothCell> cells_;
};

}  // namespace trunnion
