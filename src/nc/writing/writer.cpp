#include "trunnion/nc/writer.hpp"

#include "nc/writing/block_writer.hpp"
#include "nc/writing/run_writer.hpp"

namespace trunnion::nc {

struct Writer::State {
  State(const Controller& controller, std::string& text) : state(controller, text) {}

  WriteState state;
  ShapeWriter shapes{state};
  BlockWriter blocks{state, shapes};
  RunWriter runs{state};
};

Writer::Writer(const Controller& controller, std::string& out)
    : state_(std::make_unique<State>(controller, out)) {}
Writer::Writer(Writer&&) noexcept = default;
Writer::~Writer() = default;

Result<void> Writer::write(const Motion& motion) {
  return state_->blocks.write(motion);
}
Result<void> Writer::write(const Block& block) {
  return state_->blocks.write_block(block);
}
Result<void> Writer::step(AxisLetter axis, std::int64_t distance, std::int64_t feed) {
  return state_->blocks.step(axis, distance, feed);
}
bool Writer::takes_run(const std::array<AxisLetter, RunBlock::kAxes>& letters, FeedMode mode) const {
  return state_->runs.takes(letters, mode);
}
std::size_t Writer::write_run(const std::array<AxisLetter, RunBlock::kAxes>& letters, FeedMode mode,
                              std::span<const RunBlock> blocks) {
  return state_->runs.write(letters, mode, blocks);
}
std::size_t Writer::lines() const {
  return state_->state.lines;
}
std::size_t Writer::motions() const {
  return state_->state.motions;
}

}  // namespace trunnion::nc
