#pragma once
#include <memory>
#include <span>
#include <vector>

#include "path/choice/choice_in_work.hpp"

namespace trunnion::path {

/// The way back of a choice, and forward again: which position of each point was picked, then what these
/// positions are. Of an axis that may turn for ever the turn follows from the point before.
class ChoiceReplay {
 public:
  /// Where a replay stands.
  struct Place {
    ChoicePosition position;
    Vec3 axis_P = Vec3::UnitZ();
    std::size_t next = 0;  // index of the next point
  };

  /// `work` must outlive this.
  explicit ChoiceReplay(ChoiceInWork& work) : work_(work) {}
  void start(const Place& place) {
    kept_.clear();
    place_ = place;
  }
  const Place& place() const { return place_; }
  void go_to(const Place& place) { place_ = place; }

  /// Memory for the inverse of the points from the present one of the search on, which is kept for the
  /// replay; null where it is not kept.
  SolvedBlock* block_to_keep();
  /// Reads the traces back from position `best` of the last point: the picks of all points that they hold.
  void take_picks(std::size_t best);
  std::size_t picked() const { return picks_.size(); }
  void replay(std::span<const ChoicePoint> points, std::span<ChosenPoint> out);

 private:
  void look_ahead(std::span<const ChoicePoint> points);
  const SolvedPose& solved(const ChoicePoint& point, std::size_t ahead);
  Candidate candidate(const SolvedPose& solved, std::uint16_t pick) const;
  std::size_t replay_plain(std::span<const ChoicePoint> points, std::size_t row, std::span<ChosenPoint> out);

  // The pick is the solution, in its only turn; there are two.
  static constexpr std::uint16_t kPlain = 0x8000;
  static constexpr std::uint16_t kOfTwo = 0x4000;
  // The inverse of the first points takes 170 bytes a point, and new memory more time than to solve it again:
  // that is what is done with the others.
  static constexpr std::size_t kMostKept = 64;

  ChoiceInWork& work_;
  SolvedPose own_;
  std::vector<std::uint16_t> picks_;  // of each point, once settled
  std::vector<std::unique_ptr<SolvedBlock>> kept_;
  SolvedBlock own_block_;
  const SolvedBlock* block_ = nullptr;  // of the points that are replayed
  Place place_;
};

}  // namespace trunnion::path
