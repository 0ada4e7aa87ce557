#pragma once
#include "trunnion/path/bowed_line.hpp"
#include "trunnion/path/smaller_of_two.hpp"

#include "post/judging/few_blocks.hpp"

// Private to QuietRun: the whole tool of a few blocks side by side, beside the path. T is `Lanes` or `Quads`.
namespace trunnion::post {

// A segment of the path for each of the blocks.
template <class T>
struct SegmentsOf {
  lanes::Triple<T> tip_P, axis_P, way, turn;  // where they begin, and to their ends

  SegmentsOf(const lanes::Triple<T>& tip0_P, const lanes::Triple<T>& axis0_P, const lanes::Triple<T>& tip1_P,
             const lanes::Triple<T>& axis1_P)
      : tip_P(tip0_P), axis_P(axis0_P), way(tip1_P - tip0_P), turn(axis1_P - axis0_P) {}
};

// Between these fractions, of a block or of a segment.
template <class T>
struct Between {
  T from, to;
};

// By which the tool is off the path at most: any point up to its flute length, and its axis (length of a
// vector).
template <class T>
struct OffBeside {
  T mm, axis;
};
template <class T>
OffBeside<T> larger_of(const OffBeside<T>& a, const OffBeside<T>& b) {
  return {lanes::larger(a.mm, b.mm), lanes::larger(a.axis, b.axis)};
}
template <class T>
OffBeside<T> chosen(const lanes::Mask<T>& mask, const OffBeside<T>& a, const OffBeside<T>& b) {
  return {lanes::select(mask, a.mm, b.mm), lanes::select(mask, a.axis, b.axis)};
}

// How far the tool of a block is off the path, from its tip to its flute length, while the place of the path
// runs evenly. The block goes on a parabola, its tool axis on an arc at an even pace and a parabola beside
// it, but for the rests. Less its place the tip is then on a parabola, and so is the axis but for what the
// two arcs bow apart: u'' = -turn^2 u of each, so that this is of the second order.
template <class T>
class ToolBeside {
 public:
  ToolBeside(const path::PoseRun& poses, std::size_t row, const Chords<T>& block, double flute_mm)
      : block_(block),
        flute_mm_(flute_mm),
        turn_(block.to_axis - block.from_axis),
        chord2_(length2(turn_)),
        tip_sag_(lanes::load_vectors<T>(poses.sag_mm, row)),
        axis_sag_(lanes::load_vectors<T>(poses.axis_sag, row)),
        axis_rest_(lanes::load<T>(&poses.axis_rest[row])),
        rest_mm_(lanes::load<T>(&poses.rest_mm[row]) + flute_mm * axis_rest_) {}

  // Of a part of the block, beside a part of the segment.
  OffBeside<T> off(const Between<T>& part, const SegmentsOf<T>& segment, const Between<T>& place) const {
    constexpr double kShortArc2 = 0.0625;
    constexpr double kTurn2OverChord2 = 1.02;  // up to there, and the slope of one by the other
    constexpr double kOnChord = 0.02;  // of its turn's cube a place of the arc is off that of its chord
    constexpr double kNotKnown = 1e300;
    const Tool begin = tool(part.from);
    const Tool end = tool(part.to);
    const Place at_begin = at(segment, place.from);
    const Place at_end = at(segment, place.to);
    const lanes::Triple<T> axis0 = begin.axis_P - at_begin.axis_P;
    const lanes::Triple<T> axis1 = end.axis_P - at_end.axis_P;
    const T apart2 = lanes::larger(T(length2(axis0)), T(length2(axis1)));
    const T path2 = length2(at_end.axis_P - at_begin.axis_P);
    const T arc2 = length2(end.axis_P - begin.axis_P);
    const T apart = lanes::abs(T(arc2 - path2)) + path2 * (lanes::sqrt(apart2) + (arc2 + path2) / 4.0);
    const T segment2 = length2(segment.turn);
    const T arcs = kTurn2OverChord2 * apart / 8.0 +
                   kOnChord * (segment2 * lanes::sqrt(segment2) + chord2_ * lanes::sqrt(chord2_));
    const lanes::Triple<T> tip0 = begin.tip_P - at_begin.tip_P;
    const lanes::Triple<T> tip1 = end.tip_P - at_end.tip_P;
    const T length = part.to - part.from;
    const lanes::Triple<T> tip_sag = T(length * length) * tip_sag_;
    const lanes::Triple<T> axis_sag = T(length * length) * axis_sag_;
    const T tip_off = path::farthest_bowed<T>(tip0, tip1, tip_sag);
    const lanes::Triple<T> from_axis = axis0 + begin.axis_sag;
    const lanes::Triple<T> to_axis = axis1 + end.axis_sag;
    const T end_off = path::farthest_bowed<T>(tip0 + flute_mm_ * from_axis, tip1 + flute_mm_ * to_axis,
                                              tip_sag + flute_mm_ * axis_sag);
    const T axis_off = path::farthest_bowed<T>(from_axis, to_axis, axis_sag);
    const lanes::Mask<T> known = (chord2_ <= kShortArc2) & (segment2 <= kShortArc2);
    const T none = lanes::splat<T>(kNotKnown);
    const OffBeside<T> off{lanes::larger(tip_off, end_off) + rest_mm_ + flute_mm_ * arcs,
                           axis_off + axis_rest_ + arcs};
    return chosen<T>(known, off, OffBeside<T>{none, none});
  }
  // Where on the segment the block is nearest at this fraction of it as a whole tool; `t`: about there.
  T nearest_on(const SegmentsOf<T>& segment, const T& x, const T& t) const {
    const Tool here = tool(x);
    const Place there = at(segment, t);
    const lanes::Triple<T> tip = here.tip_P - there.tip_P;
    const lanes::Triple<T> axis = here.axis_P - there.axis_P;
    return clamped<T>(t + path::smaller_of_two<T>(tip, segment.way, tip + flute_mm_ * axis,
                                                  segment.way + flute_mm_ * segment.turn),
                      T{});
  }
  // Where it passes a CL point as nearly; behind `least`.
  T nearest_to(const lanes::Triple<T>& tip_P, const lanes::Triple<T>& axis_P, const T& x,
               const T& least) const {
    const Tool here = tool(x);
    const lanes::Triple<T> tip = tip_P - here.tip_P;
    const lanes::Triple<T> axis = axis_P - here.axis_P;
    return clamped<T>(
        x + path::smaller_of_two<T>(tip, block_.way, tip + flute_mm_ * axis, block_.way + flute_mm_ * turn_),
        least);
  }

 private:
  struct Place {
    lanes::Triple<T> tip_P, axis_P;
  };
  struct Tool : Place {
    lanes::Triple<T> axis_sag;  // beside the arc
  };
  static lanes::Triple<T> unit(const lanes::Triple<T>& v) { return T(1.0 / length(v)) * v; }
  static Place at(const SegmentsOf<T>& segment, const T& t) {
    return {segment.tip_P + t * segment.way, unit(segment.axis_P + t * segment.turn)};
  }
  Tool tool(const T& x) const {
    const T bowed = 4.0 * x * (1.0 - x);
    return {{block_.from + x * block_.way + bowed * tip_sag_, unit(block_.from_axis + x * turn_)},
            bowed * axis_sag_};
  }

  const Chords<T>& block_;
  double flute_mm_;
  lanes::Triple<T> turn_;
  T chord2_;
  lanes::Triple<T> tip_sag_, axis_sag_;
  T axis_rest_, rest_mm_;
};

}  // namespace trunnion::post
