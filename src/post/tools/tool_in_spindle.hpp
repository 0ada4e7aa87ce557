#pragma once
#include <utility>

#include "trunnion/base/number_text.hpp"
#include "trunnion/path/nonlinear.hpp"

#include "post/making/posting.hpp"
#include "post/tools/spindle_tool.hpp"

namespace trunnion::post {

/// The tool that motions are made with, and what of the machine depends on its length.
struct ToolInSpindle {
  ToolInSpindle(const Posting& posting, const SpindleTool& of)
      : tool(of), kinematics(posting.machine, of.vector()) {}

  void set(const Posting& posting, const SpindleTool& to) {
    tool = to;
    kinematics = TableKinematics(posting.machine, to.vector());
  }
  /// The tool's own length (TLDATA, CUTTER) is a part of its gauge length.
  void check_own_length(Posting& posting) {
    if (std::exchange(own_length_mm, 0.0) <= tool.length_mm) return;
    posting.diagnostics.warning(posting.job.cl_file, own_length_where,
                                "the tool itself is longer than its gauge length of " +
                                    shortest_text(tool.length_mm) +
                                    " mm, which must hold the tool and its holder");
  }

  SpindleTool tool;
  TableKinematics kinematics;
  std::int64_t length_register = 1;
  double own_length_mm = 0.0;  // until its first motion
  SourceRef own_length_where;
};

}  // namespace trunnion::post
