#include "trunnion/post/cl_points.hpp"

#include <utility>

#include "trunnion/post/verify.hpp"

#include "post/intake/path_source.hpp"

namespace trunnion::post {

Result<std::vector<ClPoint>> cl_points(PathText path, const PathTolerance& tolerance,
                                       const ToolOptions& tools, Diagnostics& said) {
  path.reading = reading_within(path.reading, tolerance.mm);
  const auto records = records_of(std::move(path), {&tools, tolerance.axis}, said);
  FluteLength flute(tools);
  if (tools.tool) flute.take(cl::ToolChange{*tools.tool, std::nullopt, std::nullopt});
  std::vector<ClPoint> out;
  cl::Record record;
  while (records->next(record)) {
    if (const auto* change = std::get_if<cl::ToolChange>(&record.data)) flute.take(*change);
    if (const auto* cutter = std::get_if<cl::ToolGeometry>(&record.data)) flute.take(*cutter);
    if (const auto* motion = std::get_if<cl::Motion>(&record.data))
      out.push_back({motion->tip_P, motion->axis_P, flute.mm(), record.where.line, motion->rapid});
  }
  if (records->read_failure()) return tl::unexpected(*records->read_failure());
  if (said.has_errors()) return tl::unexpected(said.first_error());
  return out;
}

}  // namespace trunnion::post
