#include "post/intake/chunk_in_work.hpp"

namespace trunnion::post {

// As far as the chunk reaches: an axis that turns later is freed by the writer, and a clamp that is worth its
// time holds for more than that.
std::uint16_t ChunkInWork::standing_axes(const Posting& posting, const JointWords& axis_words) const {
  const std::size_t i = motion;
  std::uint16_t out = 0;
  if (chunk == nullptr || i >= chunk->size()) return out;
  std::size_t end = i + 1;
  while (end < chunk->size() && !chunk->chosen[end].reconfigure) ++end;
  for (AxisId id = 0; id < posting.machine.axes.size(); ++id) {
    if (posting.machine.axes[id].kind != AxisKind::rotary) continue;
    const auto stands = [&](std::size_t k) {
      return chunk->joints[k][id] == chunk->joints[i][id] &&
             axis_words.rounded(id, chunk->chosen[k].q_leave[id]) == chunk->joints[i][id];
    };
    bool all = true;
    for (std::size_t k = i; k < end && all; ++k) all = stands(k);
    if (all) out = static_cast<std::uint16_t>(out | nc::AxisWords::bit(posting.letters[id]));
  }
  return out;
}

}  // namespace trunnion::post
