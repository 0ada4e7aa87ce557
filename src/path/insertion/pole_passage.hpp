#pragma once
#include <array>
#include <optional>

#include "path/insertion/node_maker.hpp"
#include "path/insertion/segment_judge.hpp"

namespace trunnion::path {

/// Where a segment leaves the pole, comes to it or passes it, the inner axis has to stand as the great circle
/// wants it there, whatever the point says: at the pole it turns about the tool axis.
class PolePassage {
 public:
  /// Of the segment that `judge` and `maker` have in hand; all must outlive this.
  PolePassage(const SegmentJudge& judge, const NodeMaker& maker, const Rounding& rounding)
      : judge_(judge), maker_(maker), rounding_(rounding) {}

  /// `end`, which stands at the pole, turned as the great circle to `other` wants it; nothing where it is not
  /// at the pole, or stands well but for less than `least_turn`.
  std::optional<Point> turned(const Point& end, const Station& at, const Point& other,
                              Angle least_turn) const;
  /// The great circle comes to the pole between the ends.
  bool lies_between(const Point& a, const Point& b) const;
  /// The pole between the ends of a segment, and the positions in which the axes come there and leave.
  struct OnTheWay {
    double share = 0.0;  // of the chord
    std::array<Point, 2> turned;
  };
  /// Where the axes stay on their branch: up to half a turn at one place.
  std::optional<OnTheWay> on_the_way(const Point& a, const Point& b) const;

 private:
  const TableKinematics& kinematics() const { return judge_.kinematics(); }
  bool turn_towards(const Point& end, const Vec3& pole_P, Point& turned) const;

  const SegmentJudge& judge_;
  const NodeMaker& maker_;
  const Rounding& rounding_;
};

}  // namespace trunnion::path
