// NC programs as the path that is posted, of each controller.
#include "fuzz/controls_on_machine.hpp"
#include "post/intake/nc_source.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const nc::Controller& control = fuzz::control_on_machine(bytes.byte());
  const std::size_t flags = bytes.byte();
  const post::NcOrigin origin{&fuzz::machine(), &control,
                              (flags & 1U) != 0 ? post::FromPath::motion : post::FromPath::points};
  post::ToolOptions tools;
  tools.tool = 1;
  tools.length_mm = fuzz::machine().tool_length_mm;
  post::NcWalk::Keep keep;
  keep.reading.mark_shapes = (flags & 2U) != 0;
  keep.with.keeps_turns = (flags & 4U) != 0;
  keep.with.tools = &tools;
  Diagnostics diagnostics;
  post::NcSource source(std::make_unique<test::TextOf>(bytes.rest()), "input", origin, keep, diagnostics);
  cl::Record record;
  // A circle of small tolerance has many points: what matters is that it ends.
  constexpr std::size_t kMost = 2000000;
  for (std::size_t count = 0; count < kMost && source.next(record); ++count) {
    const auto* motion = std::get_if<cl::Motion>(&record.data);
    if (motion == nullptr) continue;
    fuzz::hold(motion->tip_P.allFinite(), "a tip is a number");
    fuzz::hold(std::abs(motion->axis_P.norm() - 1.0) < 1e-9, "a tool axis has length one");
    fuzz::hold(std::isfinite(motion->feed.value) && motion->feed.value >= 0.0, "a feed is a number");
  }
  return 0;
}
