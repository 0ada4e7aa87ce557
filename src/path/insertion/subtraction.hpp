#pragma once
#include <vector>

#include "path/insertion/node_maker.hpp"
#include "path/insertion/segment_judge.hpp"

namespace trunnion::path {

/// Points of the linear interpolation, corrected by the predicted error (paper 001, Eq. 3.4).
class Subtraction {
 public:
  /// Of the segment that `judge` and `maker` have in hand. The points go to `nodes`; all must outlive this.
  Subtraction(const SegmentJudge& judge, const NodeMaker& maker, std::vector<Node>& nodes)
      : judge_(judge), maker_(maker), nodes_(nodes) {}

  /// From the start of the segment at `a` to its end at `b`; false where some piece does not keep.
  bool insert(const Station& a, const Station& b) { return halve(a, b, 0.0, 1.0, 0); }

 private:
  const TableKinematics& kinematics() const { return judge_.kinematics(); }
  bool halve(const Station& a, const Station& b, double t0, double t1, int halvings);
  bool insert_evenly(const Station& a, const Station& b, double t0, double t1, const ErrorModel& model);

  const SegmentJudge& judge_;
  const NodeMaker& maker_;
  std::vector<Node>& nodes_;
};

}  // namespace trunnion::path
