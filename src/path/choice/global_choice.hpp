#pragma once
#include <span>
#include <vector>

#include "path/choice/choice_in_work.hpp"
#include "path/choice/choice_replay.hpp"
#include "path/choice/layer_search.hpp"
#include "path/choice/one_branch.hpp"

namespace trunnion::path {

/// The shortest path over all branches and turns (see ChoiceMethod::global). Forward, point by point, with a
/// byte a point for the way back; from the last point back, which of its positions each point takes; forward
/// again, what those positions are. Where only one position reaches a point all before it is settled there.
///
/// A point is taken by the first of these steps that can: `OneBranch`, `follow_both` and `add_both`, and
/// `LayerSearch`, which takes all.
class GlobalChoice {
 public:
  GlobalChoice(const Machine& machine, const ChoiceOptions& options);

  /// Leaves one ChosenPoint for each point in `out`. Gives the first point that nothing reaches, or none.
  const ChoicePoint* choose(std::span<const ChoicePoint> points, const JointVector& seed,
                            std::vector<ChosenPoint>& out);

  /// The same in pieces: start, all points by `advance`, `settle`, all points by `replay`. Where `settle`
  /// says that more positions have to be followed, all of it again with those.
  static constexpr std::size_t kFewPositions = 16;
  static constexpr std::size_t kMostPositions = 1024;
  void start(const JointVector& seed, std::size_t most = kFewPositions);
  /// Gives the first point that nothing reaches, or none.
  const ChoicePoint* advance(std::span<const ChoicePoint> points) { return advance(points, {}); }
  /// After the last point: how many positions to follow for the shortest path; 0: it is found.
  std::size_t settle();
  void replay(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) {
    replay_.replay(points, out);
  }
  /// The position at the last point, once settled.
  ChosenPoint end() const;

  using Place = ChoiceReplay::Place;
  const Place& place() const { return replay_.place(); }
  void go_to(const Place& place) { replay_.go_to(place); }

 private:
  /// Where `out` is given what is settled goes there, and only what is not is left to `settle` and `replay`.
  const ChoicePoint* advance(std::span<const ChoicePoint> points, std::span<ChosenPoint> out);
  void look_up(std::span<const ChoicePoint> points, std::size_t from, std::size_t to, bool keep);
  std::size_t follow(std::span<const ChoicePoint> points, std::size_t first, std::size_t end,
                     std::span<ChosenPoint> out);
  void settle_stretch(std::span<const ChoicePoint> points, std::span<ChosenPoint> out);

  ChoiceInWork work_;
  LayerSearch search_;
  ChoiceReplay replay_;
  OneBranch one_branch_;
  SolvedBlock own_block_;
  Candidate end_;
};

}  // namespace trunnion::path
