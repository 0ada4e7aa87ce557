#pragma once
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

 private:
  const JointPath& path_;
  std::size_t next_ = 0;  // segment
  Scaled sign_, reversed_s_;
};

}  // namespace trunnion::trace
