#pragma once
#include "nc/reading/other_words.hpp"
#include "nc/reading/reader_line.hpp"

namespace trunnion::nc {

/// The motion that the words of a line ask for.
struct LineMotion {
  AxisWords words;
  std::optional<MotionKind> kind;
  std::optional<FeedMode> mode;
  OtherWords::Means means;
  bool has_feed = false;
  Number feed;
  std::uint32_t column = 0;
  bool rapid = false;         // by a word that holds for this line only
  bool named = false;         // a motion word stands in the line
  bool absolute = false;      // coordinates are, from this line on
  bool is_resolved = false;   // OtherWords::resolve has been at its words
  bool begins_shape = false;  // an arc, a cycle or a touch begins beside them
  bool changes_tool = false;  // a speed beside it is that of the new tool
};

}  // namespace trunnion::nc
