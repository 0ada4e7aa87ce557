#pragma once
#include "post/making/cutter_words.hpp"
#include "post/making/program_head.hpp"
#include "post/making/safe_way.hpp"

namespace trunnion::post {

/// What is not a motion: spindle, coolant, tool, texts and words for the post-processor.
class EventMaker {
 public:
  EventMaker(ProgramInWork& work, ProgramHead& head, SafeWay& safe_way, CutterWords& cutter_words)
      : work_(work), head_(head), safe_way_(safe_way), cutter_words_(cutter_words) {}

  /// Failures name the line of the CL file.
  Result<void> take(const cl::Record& record);

 private:
  Result<void> take_record(const cl::Record& record);
  Result<void> take_spindle(const cl::Spindle& spindle, SourceRef where);
  Result<void> take_diameter(const cl::ToolGeometry& tool, SourceRef where);
  Result<void> take_coolant(nc::CoolantKind kind);
  Result<void> take_stop(const cl::Stop& stop, SourceRef where);
  Result<void> take_tool_change(const cl::ToolChange& t, SourceRef where);
  Result<void> take_dwell(const cl::Dwell& d);
  Result<void> take_text(const cl::Text& t, SourceRef where);
  Result<void> take_tolerance(const cl::Tolerance& t, SourceRef where);
  /// Words for the post-processor that the intake does not act on alone.
  Result<void> take_post_word(const cl::PostWord& word, SourceRef where);

  ProgramInWork& work_;
  ProgramHead& head_;
  SafeWay& safe_way_;
  CutterWords& cutter_words_;
};

}  // namespace trunnion::post
