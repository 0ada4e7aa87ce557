#pragma once
#include <string>

#include "post/making/segment_maker.hpp"

namespace trunnion::post {

/// Arcs and drilling cycles in the control's own words.
class ShapeMaker {
 public:
  ShapeMaker(ProgramInWork& work, const PlaceWords& words, CorrectedPlace& places, BlockMaker& blocks,
             SegmentMaker& segments)
      : work_(work), words_(words), places_(places), blocks_(blocks), segments_(segments) {}

  /// An arc or a hole whose motions begin with number `i` of the chunk; false where the control's words
  /// cannot hold it: then its motions go out. Fails for a tap that they cannot hold.
  Result<bool> make(const cl::Shape& shape, std::size_t i);

 private:
  bool may_make(std::size_t i, std::size_t count) const;
  Result<bool> make_arc(const cl::Arc& arc, std::size_t i, std::size_t count);
  Result<bool> make_hole(const cl::Hole& hole, std::size_t i, std::size_t count);
  Result<void> go_across(const cl::Hole& hole, std::size_t i, bool cycle_goes);
  Result<nc::Thread> thread_of(const cl::Hole& hole, SourceRef where);
  /// Why a tap is not written.
  std::string no_tap(const cl::Hole& hole) const;
  /// The tool over the hole at `height`; the words where it then stands.
  Result<nc::AxisWords> rise_over(const cl::Hole& hole, double height_mm, const path::Point& end);
  double feed_word(double rate_mm_s, double length_mm, std::int64_t& feed);
  double seconds_of(const nc::Hole& hole, const JointVector& at) const;

  ProgramInWork& work_;
  const PlaceWords& words_;
  CorrectedPlace& places_;
  BlockMaker& blocks_;
  SegmentMaker& segments_;
};

}  // namespace trunnion::post
