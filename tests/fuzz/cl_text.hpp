#pragma once
#include "trunnion/cl/reader.hpp"

#include "fuzz/fuzz.hpp"

namespace trunnion::fuzz {

/// Reads CL text to its end: the first byte says in which of the ways that the options know.
inline void read_cl(Bytes bytes, cl::ReaderOptions::Dialect dialect) {
  const std::size_t flags = bytes.byte();
  cl::ReaderOptions options;
  options.dialect = dialect;
  options.mark_shapes = (flags & 2U) != 0;
  options.frames =
      (flags & 4U) != 0 ? cl::ReaderOptions::Frames::apply : cl::ReaderOptions::Frames::automatic;
  options.cutter_compensation = (flags & 8U) != 0 ? cl::ReaderOptions::CutterCompensation::wear
                                                  : cl::ReaderOptions::CutterCompensation::tool_center;
  Diagnostics diagnostics;
  const std::string text = bytes.rest();
  cl::Reader reader(text, "input", options, diagnostics);
  cl::Record record;
  // A circle of small tolerance has many points: what matters is that it ends.
  constexpr std::size_t kMost = 2000000;
  for (std::size_t count = 0; count < kMost && reader.next(record); ++count) {
    const auto* motion = std::get_if<cl::Motion>(&record.data);
    if (motion == nullptr) continue;
    hold(motion->tip_P.allFinite(), "a tip is a number");
    hold(std::abs(motion->axis_P.norm() - 1.0) < 1e-9, "a tool axis has length one");
    hold(std::isfinite(motion->feed.value) && motion->feed.value >= 0.0, "a feed is a number");
  }
}

}  // namespace trunnion::fuzz
