#pragma once
#include "post/making/plain_run.hpp"
#include "post/making/segment_maker.hpp"

namespace trunnion::post {

/// Plain motions: what nearly all of a program is, without what concerns other programs only. Their blocks go
/// out in runs; a block that leaves anything to be asked goes the general way, to the same text.
class PlainMotions {
 public:
  PlainMotions(ProgramInWork& work, CorrectedPlace& places, BlockBend& bend, BlockMaker& blocks,
               SegmentMaker& segments)
      : work_(work), places_(places), bend_(bend), blocks_(blocks), segments_(segments) {}

  /// Words are positions of the axes, and nothing but the place decides where those go: on the nominal
  /// machine, or on one whose errors hang on the position alone.
  bool serve() const;
  /// As SegmentMaker::make for the motions from `first` on, up to `end`: those that were prepared, cut at a
  /// feed per minute and leave nothing to be asked. Gives the first other one. Nothing is said between them,
  /// so that the tolerance of the first one holds for all.
  Result<std::size_t> make(std::size_t first, std::size_t end);

 private:
  std::size_t add_kept(PlainRun& run, std::size_t i, std::size_t end) const;
  Result<void> add(PlainRun& run, std::size_t i);
  std::size_t add_known(PlainRun& run, std::size_t i, std::size_t end);
  bool goes_on(std::size_t i) const;
  /// The path's tool axis is the same before motion `i` and behind it.
  bool axis_stands(std::size_t i) const;
  /// Such a motion turns the axes by its correction alone.
  bool turns_idly(std::size_t i, const JointVector& from, const JointVector& to) const;
  const JointVector* known_correction(std::size_t number) const;
  Result<void> add_corrected(PlainRun& run, const path::Point& to, const Vec3& tip_P, std::size_t i,
                             std::size_t number);
  path::Point point_of(const FeedPlanner::Stop& stop, std::size_t i) const;
  Result<void> write_run(PlainRun& run);
  std::size_t write_together(const PlainRun& run, std::size_t done);
  Result<void> write_one(const PlainRun& run, std::size_t block);

  ProgramInWork& work_;
  CorrectedPlace& places_;
  BlockBend& bend_;
  BlockMaker& blocks_;
  SegmentMaker& segments_;
};

}  // namespace trunnion::post
