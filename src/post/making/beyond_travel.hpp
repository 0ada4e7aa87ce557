#pragma once
#include <array>
#include <string>

#include "post/making/posting.hpp"
#include "post/tools/spindle_tool.hpp"

namespace trunnion::post {

/// Positions of a program that are beyond the travel of an axis: counted while the text is made, told at its
/// end.
class BeyondTravel {
 public:
  /// `q`: joint positions; by half a word of `quantum` they may be beyond.
  void note(const Machine& machine, const JointVector& q, const JointVector& quantum, const SpindleTool& tool,
            SourceRef where);
  /// Each axis' worst position as an error, at its place in the CL file; fails with check_failed when there
  /// is one.
  Result<void> tell(Posting& posting) const;

 private:
  struct Positions {
    std::size_t count = 0;
    SourceRef first;
    LimitViolation worst;
    SourceRef where;  // of the worst
    Vec3 tool_mm = Vec3::Zero();
  };
  static std::string text(const Axis& axis, const Positions& beyond);

  std::array<Positions, kMaxAxes> of_axis_;
};

}  // namespace trunnion::post
