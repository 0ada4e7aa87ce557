#pragma once
#include "post/making/block_bend.hpp"
#include "post/making/corrected_place.hpp"

namespace trunnion::post {

/// Writes motions block by block, with the points between them that the machine's errors ask for.
class BlockMaker {
 public:
  static constexpr std::uint16_t kAllWords = 0xFFFF;
  /// Halvings of one piece for the bend of the errors: beyond this the errors change faster than any
  /// machine's.
  static constexpr int kMaxBends = 6;
  /// What a motion is cut with: `rate_mm_s` is that of the tip, `depth` how often it was halved.
  struct Cut {
    double rate_mm_s;
    const cl::Feed& feed;
    SourceRef where;
    int depth;
  };

  BlockMaker(ProgramInWork& work, const PlaceWords& words, const LostMotion& lost_motion,
             CorrectedPlace& places, BlockBend& bend)
      : work_(work), words_(words), lost_motion_(lost_motion), places_(places), bend_(bend) {
    if (work_.lead.is_on()) work_.posting.before_block = [this] { return write_led(); };
  }
  BlockMaker(const BlockMaker&) = delete;
  BlockMaker& operator=(const BlockMaker&) = delete;
  ~BlockMaker() = default;

  Result<void> rapid_to(const path::Point& to);
  Result<void> cut_to(const path::Point& to, const cl::Feed& feed, SourceRef where, int depth);
  /// The same from where its place `q` is found on.
  Result<void> cut_to_place(const path::Point& to, JointVector q, const Cut& cut);
  /// F per minute: of a motion whose length is not known, or that only leaves or enters.
  Result<void> feed_per_minute(const JointVector& q, double rate_mm_s, SourceRef where);
  /// Before the motion to `q`: true when a block went out that takes up lost motion.
  Result<bool> take_up(const JointVector& q, SourceRef where);
  /// `only`: the words of these axes.
  Result<void> write(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed, SourceRef where,
                     std::uint16_t only = kAllWords);
  /// Words that are positions of the machine, all of them.
  Result<void> write_plain(const JointVector& q, nc::MotionKind kind, const BlockFeed& feed, SourceRef where);
  /// The motion from the last emitted position to `q`, for the planner.
  FeedPlanner::Move move_to(const JointVector& q, double tip_mm, double pace = 1.0) const;
  /// Of the tip, mm/s; `segment_mm` is its way, for feeds given as an inverse time.
  Result<double> rate_of(const cl::Feed& feed, double segment_mm, SourceRef where);

  /// What is written from here on is on this segment of the CL path.
  void begin_segment(const path::Point& from, const path::Point& to);
  /// The one that ends at motion `i` of the chunk.
  void begin_segment(std::size_t i);

 private:
  /// Feed blocks are held back, to be led in time.
  bool leads() const;
  /// Those that are held back, led; the machine is at rest behind them.
  Result<void> write_led();
  void note_lead(const ServoLead::Led& led);
  bool lasts_long(const FeedPlanner::Move& move, double rate_mm_s) const;

  ProgramInWork& work_;
  const PlaceWords& words_;
  const LostMotion& lost_motion_;
  CorrectedPlace& places_;
  BlockBend& bend_;
};

}  // namespace trunnion::post
