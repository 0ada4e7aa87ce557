#pragma once
#include <vector>

#include "trunnion/path/nonlinear.hpp"

#include "post/making/posting.hpp"

namespace trunnion::post {

/// How points are inserted between blocks that the control runs as the options say.
inline path::NonlinearOptions nonlinear_options(const PostOptions& options) {
  path::NonlinearOptions out = options.nonlinear;
  out.straight_tip = options.rtcp;
  return out;
}

/// Points that are inserted while the text is made, where nobody prepared them: with one tool, and the room
/// in which they stand.
struct Refinement {
  Refinement(const Posting& posting, const Vec3& tool_mm, const path::Rounding& rounding)
      : cuts(posting.machine, tool_mm, rounding, nonlinear_options(posting.options)),
        rapids(posting.machine, tool_mm, rounding, {}) {}

  void set_tool(const Posting& posting, const Vec3& tool_mm, const path::Rounding& rounding) {
    cuts = path::Refiner(posting.machine, tool_mm, rounding, nonlinear_options(posting.options));
    rapids = path::Refiner(posting.machine, tool_mm, rounding, {});
  }

  path::Refiner cuts, rapids;
  std::vector<path::Point> run;       // of cuts that are refined together
  std::vector<path::Point> inserted;  // in a segment, or all points of a run
  std::vector<path::SegmentReport> reports;
};

}  // namespace trunnion::post
