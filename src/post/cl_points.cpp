#include "trunnion/post/cl_points.hpp"

#include "trunnion/post/verify.hpp"

namespace trunnion::post {

Result<std::vector<ClPoint>> cl_points(std::unique_ptr<cl::TextSource> cl, const std::string& cl_file,
                                       const cl::ReaderOptions& reading, double tolerance_mm,
                                       const ToolOptions& tools) {
  Diagnostics said;
  cl::Reader reader(std::move(cl), cl_file, reading_within(reading, tolerance_mm), said);
  FluteLength flute(tools);
  if (tools.tool) flute.take(cl::ToolChange{*tools.tool, std::nullopt, std::nullopt});
  std::vector<ClPoint> out;
  cl::Record record;
  while (reader.next(record)) {
    if (const auto* change = std::get_if<cl::ToolChange>(&record.data)) flute.take(*change);
    if (const auto* cutter = std::get_if<cl::ToolGeometry>(&record.data)) flute.take(*cutter);
    if (const auto* motion = std::get_if<cl::Motion>(&record.data))
      out.push_back({motion->tip_P, motion->axis_P, flute.mm(), record.where.line, motion->rapid});
  }
  if (reader.read_failure()) return tl::unexpected(*reader.read_failure());
  return out;
}

}  // namespace trunnion::post
