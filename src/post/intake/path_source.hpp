#pragma once
#include <memory>

#include "trunnion/post/path_text.hpp"
#include "trunnion/post/tools.hpp"

namespace trunnion::post {

/// What the records of a path are read with, beside what its text says.
struct PathReading {
  const ToolOptions* tools = nullptr;  // never null; must outlive the records
  Angle axis_tolerance;
  /// The rotary axes of an NC program's machine mean the same on the machine at hand: positions and turns are
  /// kept.
  bool keeps_turns = false;
};

/// The records of a path, read piece by piece. `diagnostics` and what `text` points to must outlive them.
std::unique_ptr<cl::RecordSource> records_of(PathText text, const PathReading& with,
                                             Diagnostics& diagnostics);

}  // namespace trunnion::post
