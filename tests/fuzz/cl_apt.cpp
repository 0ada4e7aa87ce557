// CL text of any dialect, all ways of reading it.
#include "trunnion/cl/reader.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

namespace {

void check(const cl::Motion& motion) {
  fuzz::hold(motion.tip_P.allFinite(), "a tip is a number");
  fuzz::hold(std::abs(motion.axis_P.norm() - 1.0) < 1e-9, "a tool axis has length one");
  fuzz::hold(std::isfinite(motion.feed.value) && motion.feed.value >= 0.0, "a feed is a number");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const std::size_t flags = bytes.byte();
  cl::ReaderOptions options;
  options.dialect = cl::ReaderOptions::Dialect::apt;
  options.keep_arcs = (flags & 1U) != 0;
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
    if (const auto* motion = std::get_if<cl::Motion>(&record.data)) check(*motion);
  }
  return 0;
}
