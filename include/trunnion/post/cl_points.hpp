#pragma once
#include <memory>
#include <string>
#include <vector>

#include "trunnion/cl/reader.hpp"
#include "trunnion/post/tools.hpp"

namespace trunnion::post {

/// A point of a CL path, as the verification reads it.
struct ClPoint {
  Vec3 tip_P = Vec3::Zero();
  Vec3 axis_P = Vec3::UnitZ();
  double flute_mm = 0.0;  // FluteLength of the tool that goes there
  std::uint32_t line = 0;
  bool rapid = false;
};

/// All motions of a CL file, arcs as chords within a tenth of `tolerance_mm`. What the file has to say beside
/// them was said when it was verified: nothing is reported twice.
Result<std::vector<ClPoint>> cl_points(std::unique_ptr<cl::TextSource> cl, const std::string& cl_file,
                                       const cl::ReaderOptions& reading, double tolerance_mm,
                                       const ToolOptions& tools);

}  // namespace trunnion::post
