#pragma once
#include <array>
#include <limits>
#include <vector>

#include "path/choice/choice_in_work.hpp"

namespace trunnion::path {

/// The complete step of a choice: all ways into a point, from all positions of the point before, over all
/// branches and turns.
///
/// At most `ChoiceInWork::most_positions` positions of a point are followed, the cheapest. What is left out
/// is followed as if axes had no limits and one could change to any turn: no way through it costs less.
class LayerSearch {
 public:
  /// `work` must outlive this.
  explicit LayerSearch(ChoiceInWork& work) : work_(work) {}

  void start();
  /// Goes on to `point`; false where nothing reaches it. `ahead`: what is known of it, or null.
  bool add(const ChoicePoint& point, const SolvedPose* ahead);
  /// Something was left out so far.
  bool leaves_out() const { return leaves_out_; }
  /// What a way through what was left out costs at least, at the last point. Infinite: nothing was.
  double least_left_out() const { return std::min(left_out_[0].cost, left_out_[1].cost); }

 private:
  /// A position of the present point as it is reached from one before.
  struct Arrival {
    std::array<double, 2> angle;
    TracedStep step;
    std::uint8_t solution = 0;
    std::size_t place = 0;  // arrivals at the same position have one
    double way = 0.0;       // cost so far, but for a reconfiguration
    double preference = 0.0;
    double least() const { return way + preference; }
  };
  /// The cheapest of what was left out, by solution of the present point. No cost: nothing.
  struct LeftOut {
    ChoicePosition position;
    double cost = std::numeric_limits<double>::infinity();
  };

  void gather(const ChoicePoint& point);
  void gather_from(const ChoicePoint& point, std::uint16_t predecessor);
  void arrive(const SolvedPose& solved, TracedStep step, std::size_t solution,
              const std::array<double, 2>& angle);
  void keep_cheapest(const ChoicePoint& point);
  void keep_few();
  void leave_out(std::size_t solution, const ChoicePosition& position, double cost);
  void leave_out_turns(const ChoicePoint& point, const Candidate& from, const SolvedPose& solved,
                       std::size_t solution);
  void follow_left_out(const ChoicePoint& point);
  void go_on(const ChoicePoint& point);
  /// The present pose as the position `predecessor` before makes it.
  const SolvedPose& solved_at(std::size_t predecessor) const {
    return solved_by_.empty() ? *solved_ : solved_by_[predecessor];
  }
  std::size_t rotary_count() const { return work_.steps.rotary_count(); }

  ChoiceInWork& work_;
  const SolvedPose* solved_ = nullptr;  // the present pose
  SolvedPose own_;
  std::vector<SolvedPose> solved_by_;  // at the pole: for each position before
  std::vector<Arrival> arrivals_;
  std::vector<std::array<double, 2>> places_;
  std::vector<const Arrival*> order_;
  std::array<LeftOut, 2> left_out_;   // at the last point
  std::array<LeftOut, 2> left_here_;  // at the present one
  bool leaves_out_ = false;
  std::vector<TracedStep> steps_of_layer_;
};

}  // namespace trunnion::path
