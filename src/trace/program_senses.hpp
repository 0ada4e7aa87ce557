#pragma once
#include <vector>

#include "trace/joint_path.hpp"

// Private to the layer: the senses in which the program moves the axes.
namespace trunnion::trace {

/// Senses of the axes' last motions by the program, up to a place that only goes on.
class ProgramSenses {
 public:
  explicit ProgramSenses(const JointPath& path);

  /// Goes on to the length `s` of the path, where the machine is at `time_s`; a place behind counts for
  /// nothing.
  void go_to(double s, double time_s);
  /// Of each axis: 1, -1, or 0 before it has moved, and behind a way that is not known.
  const Scaled& sign() const { return sign_; }
  /// When each axis turned round last; minus infinity where it has not yet.
  const Scaled& reversed_s() const { return reversed_s_; }
  /// When each axis was last where it turns round for some micrometres only, comes back from there, or turns
  /// round so slowly that nobody knows when its friction does.
  const Scaled& doubtful_s() const { return doubtful_s_; }
  /// It turns round, and is hardly away from there yet: it may take long.
  bool is_turning(int axis) const;

 private:
  void find_senses(int axis);

  const JointPath& path_;
  std::vector<Scaled> senses_, doubts_;  // of each segment; 1: at its begin the axis may have turned round
  std::size_t next_ = 0;                 // segment
  Scaled sign_, reversed_s_, doubtful_s_;
  Scaled turned_at_, turns_since_s_;  // infinite: it has turned
};

}  // namespace trunnion::trace
