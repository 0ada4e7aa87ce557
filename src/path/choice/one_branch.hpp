#pragma once
#include <span>

#include "path/choice/choice_replay.hpp"

namespace trunnion::path {

/// The first step of a choice, for nearly all points of a program: runs of points that one position reaches,
/// with one position before them. Stretches that both branches reach, too, where staying on one is the
/// shorter way for certain.
class OneBranch {
 public:
  /// Both must outlive this.
  OneBranch(ChoiceInWork& work, ChoiceReplay& replay) : work_(work), replay_(replay) {}

  void start() { stay_.on = false; }
  /// Points get new numbers, from 0.
  void begin_points() { may_stay_from_ = 0; }
  /// Points from number `first` on, up to `end` at most, the end of what was looked up. Gives where it ends:
  /// before `first` where a stretch turns out not to be the shorter way. `out`: gets what is settled; empty:
  /// the steps are traced.
  std::size_t follow(std::span<const ChoicePoint> points, std::size_t first, std::size_t end,
                     std::span<ChosenPoint> out);
  /// It stays on one branch, and no point so far said that this was right.
  bool is_staying() const { return stay_.on; }
  /// Back to where staying began; gives that point. It did not do up to point `at`.
  std::size_t give_up(std::size_t at);

 private:
  bool stays(const ChoicePosition& at, const ChoicePosition& next, double turn, bool rapid, std::size_t row);

  /// Staying on one branch where both reach the points, until one does.
  struct Stay {
    bool on = false;
    std::size_t begin = 0;  // the first point
    ChoicePosition before;  // and what came before it
    Vec3 axis_before_P = Vec3::UnitZ();
    double apart = 0.0;  // RotarySolver::apart of the last point
    double seconds = 0.0;
  };

  ChoiceInWork& work_;
  ChoiceReplay& replay_;
  Stay stay_;
  std::size_t may_stay_from_ = 0;  // points before it were tried, and staying was given up
};

}  // namespace trunnion::path
