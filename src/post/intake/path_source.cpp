#include "post/intake/path_source.hpp"

#include <utility>

#include "post/intake/nc_source.hpp"

namespace trunnion::post {

std::unique_ptr<cl::RecordSource> records_of(PathText text, const PathReading& with,
                                             Diagnostics& diagnostics) {
  if (text.from == nullptr)
    return std::make_unique<cl::Reader>(std::move(text.source), text.file, text.reading, diagnostics);
  constexpr double kShare = 0.1;  // as of arcs, for the course of the tool axis
  const NcWalk::Keep keep{text.reading.arc_tolerance_mm,
                          Angle::radians(kShare * with.axis_tolerance.rad()),
                          text.reading.mark_shapes,
                          with.keeps_turns,
                          text.reading.cutter_compensation,
                          text.reading.units,
                          with.tools};
  return std::make_unique<NcSource>(std::move(text.source), text.file, *text.from, keep, diagnostics);
}

}  // namespace trunnion::post
