#pragma once
#include <optional>
#include <utility>

#include "trunnion/post/plane_frame.hpp"

#include "post/making/posting.hpp"

namespace trunnion::post {

/// The tilted plane of the control in which words are written, and the one that the next approach enters.
class TiltedPlanes {
 public:
  explicit TiltedPlanes(Posting& posting) : posting_(posting) {}

  const std::optional<PlaneFrame>& in_force() const { return in_force_; }
  /// In force, or planned before, with these words.
  bool has_words_of(const nc::TiltedPlane& block) const {
    return block.angles == block_.angles && block.direction == block_.direction;
  }
  void plan(const PlaneFrame& frame, const nc::TiltedPlane& block) {
    planned_ = frame;
    block_ = block;
  }
  /// The plane that was left, or none: its words are known.
  void plan_again(const std::optional<PlaneFrame>& frame) { planned_ = frame; }
  void plan_none() { planned_.reset(); }
  /// The rotary axes stand where the planned one wants them: the control has nothing to turn.
  Result<void> enter() {
    if (!planned_) return {};
    if (auto r = posting_.write(block_); !r) return r;
    in_force_ = std::exchange(planned_, std::nullopt);
    ++posting_.report.tilted_planes;
    return {};
  }
  Result<void> leave() {
    if (!in_force_) return {};
    in_force_.reset();
    return posting_.write(nc::TiltedPlane{});
  }

 private:
  Posting& posting_;
  std::optional<PlaneFrame> in_force_, planned_;
  nc::TiltedPlane block_;
};

}  // namespace trunnion::post
