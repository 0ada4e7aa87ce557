#pragma once
#include "trunnion/geom/vec.hpp"

namespace trunnion::post {

/// What is in the spindle while motions are made.
struct SpindleTool {
  double length_mm = 0.0;  // gauge length
  /// The control adds the length where the machine's words are those of the tip. Else words are those of S.
  bool control_adds_length = true;
  double flute_mm = 0.0;  // FluteLength

  bool operator==(const SpindleTool&) const = default;
  /// From S to the tip.
  Vec3 vector() const { return {0.0, 0.0, -length_mm}; }
  /// From S to the point whose position the words are, where the machine's are those of the tip.
  Vec3 in_words() const { return control_adds_length ? vector() : Vec3::Zero(); }
};

}  // namespace trunnion::post
