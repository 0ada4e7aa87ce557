#pragma once
#include <memory>
#include <span>
#include <vector>

#include "trunnion/path/held_run.hpp"

#include "post/intake/joint_choice.hpp"

namespace trunnion::post {

/// Motions after which a long run is cut where the choice allows it: all that is on its way stays in a cache
/// of 2 MB (with twice as many the default takes 2 to 6 % more time), and the costs of a chunk itself do not
/// count.
inline constexpr std::size_t kLongRun = 512;

inline path::ChoicePoint point_of(const cl::PlainCut& cut) {
  return {{cut.tip_P, cut.axis_P}, cut.where, false};
}

/// A long run that can only be chosen as a whole: held, packed, up to its end, and then handed on in pieces.
/// So is one that was chosen as a whole and is too long for one chunk.
class LongRun {
 public:
  LongRun(const PostJob& job, const PostOptions& options, JointChoice& choice, ChunkStore& store)
      : job_(job), options_(options), choice_(choice), store_(store) {}

  bool is_held() const { return held_ != nullptr; }
  /// What is said of the pole, planes and runs in which points are dropped look at a run as a whole.
  bool may_hold() const;
  /// From here on motions come to it, these the first.
  void hold(std::span<const path::ChoicePoint> points, const std::vector<WordsFrom>& words);
  void add(const path::ChoicePoint& point, const MotionWords& words);
  void add(std::span<const cl::PlainCut> cuts, const cl::Feed& feed);
  /// Of the motions that are held.
  std::size_t size() const { return held_->size() + points_.size(); }
  const ToolPose& last_pose() const { return points_.empty() ? last_.pose : points_.back().pose; }
  /// No more come: their joints are chosen, or the chunk has failed. It says what goes with them.
  void finish(Chunk& chunk);

  /// A chunk whose motions are held, or too many, goes on in pieces: the first. One that has failed goes on
  /// as it is.
  std::unique_ptr<Chunk> hand_on(std::unique_ptr<Chunk> whole);
  /// Before anything else is taken; null: none.
  std::unique_ptr<Chunk> next_piece();
  /// As for a run that is held; shapes too.
  bool may_divide(const Chunk& chunk) const;

 private:
  void pack();
  void pack_where_many();
  void take_held(std::size_t count, Chunk& piece);
  std::size_t end_of_piece() const;

  const PostJob& job_;
  const PostOptions& options_;
  JointChoice& choice_;
  ChunkStore& store_;
  std::unique_ptr<path::HeldRun> held_;  // the present run, up to points_
  std::vector<WordsFrom> words_;         // of the run that is held
  path::ChoicePoint last_;
  std::vector<path::ChoicePoint> points_;  // that are not packed yet
  std::unique_ptr<Chunk> whole_;           // that goes on in pieces
  std::unique_ptr<path::HeldRun> unheld_;  // its motions, where they were held
  std::size_t whole_size_ = 0;
  std::size_t piece_begin_ = 0;  // of its motions, the next piece
  std::size_t piece_event_ = 0;  // the first of its events that is not handed on
};

}  // namespace trunnion::post
