#pragma once
#include "post/intake/chunk.hpp"
#include "post/making/joint_words.hpp"

namespace trunnion::post {

/// The chunk whose text is made, and how far it is.
struct ChunkInWork {
  Chunk* chunk = nullptr;
  std::size_t motion = 0;  // the next one, while what is said before it goes out

  /// Rotary axes that the cut from that motion on does not turn, bits of nc::AxisWords.
  std::uint16_t standing_axes(const Posting& posting, const JointWords& axis_words) const;
};

}  // namespace trunnion::post
