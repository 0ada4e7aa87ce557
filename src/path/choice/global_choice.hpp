#pragma once
#include <array>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/solution_choice.hpp"

#include "path/choice/choice_steps.hpp"
#include "path/choice/pose_solver.hpp"
#include "path/choice/step_traces.hpp"

namespace trunnion::path {

/// The shortest path over all branches and turns (see ChoiceMethod::global). Forward, point by point, with a
/// byte a point for the way back; from the last point back, which of its positions each point takes; forward
/// again, what those positions are. Where only one position reaches a point all before it is settled there.
///
/// At most `most` positions of a point are followed, the cheapest. What is left out is followed as if axes
/// had no limits and one could change to any turn: the path found is the shortest if that costs no less.
class GlobalChoice {
 public:
  GlobalChoice(const Machine& machine, const ChoiceOptions& options);
  GlobalChoice(const GlobalChoice&) = delete;
  GlobalChoice& operator=(const GlobalChoice&) = delete;

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
  void replay(std::span<const ChoicePoint> points, std::span<ChosenPoint> out);
  /// The position at the last point, once settled.
  ChosenPoint end() const;

  /// Where a replay stands.
  struct Place {
    ChoicePosition position;
    Vec3 axis_P = Vec3::UnitZ();
    std::size_t next = 0;  // index of the next point
  };
  const Place& place() const { return place_; }
  void go_to(const Place& place) { place_ = place; }

 private:
  struct Candidate : ChoicePosition {
    RotarySines sines;  // of the angles
    double cost = 0.0;
    TracedStep step;
    std::uint8_t solution = 0;
    bool singular = false;
    bool reconfigure = false;
  };
  struct Layer {
    std::vector<Candidate> at;
    std::size_t count = 0;
  };
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

  /// Where `out` is given what is settled goes there, and only what is not is left to `settle` and `replay`.
  const ChoicePoint* advance(std::span<const ChoicePoint> points, std::span<ChosenPoint> out);
  /// Points from number `first` on that one position reaches, with one position before them; up to `end` at
  /// most, the end of what was looked up. Gives where it ends. Stretches that both branches reach, too, where
  /// staying on one is the shorter way for certain: it may end before `first` where it turns out not to be.
  std::size_t follow(std::span<const ChoicePoint> points, std::size_t first, std::size_t end,
                     std::span<ChosenPoint> out);
  void go_to_only(const ChoicePosition& position, const Vec3& axis_P);
  bool stays(const ChoicePosition& at, const ChoicePosition& next, double turn, bool rapid, std::size_t row);
  std::size_t give_up_stay(std::size_t at);
  /// What `add_both` does for points from number `first` on where each branch is reached from itself by a
  /// small step, and to come from the other one takes more for the turn alone.
  std::size_t follow_both(std::span<const ChoicePoint> points, std::size_t first, std::size_t end);
  void settle_stretch(std::span<const ChoicePoint> points, std::span<ChosenPoint> out);
  void take_picks(std::size_t best);
  /// The same where both branches reach it in one turn each, from at most two positions.
  bool add_both(const ChoicePoint& point, const SolvedPose& solved);
  /// `ahead`: what is known of the point, or null.
  bool add(const ChoicePoint& point, const SolvedPose* ahead);
  /// All arrivals at the pose that was solved. `solved_at(p)`: as the position p before makes it.
  void gather(const ChoicePoint& point);
  void gather_from(const ChoicePoint& point, std::uint16_t predecessor);
  void arrive(const SolvedPose& solved, TracedStep step, std::size_t solution,
              const std::array<double, 2>& angle);
  void leave_out_turns(const ChoicePoint& point, const Candidate& from, const SolvedPose& solved,
                       std::size_t solution);
  void leave_out(std::size_t solution, const ChoicePosition& position, double cost);
  void follow_left_out(const ChoicePoint& point);
  void keep_cheapest(const ChoicePoint& point);
  void keep_few();
  const SolvedPose& solved_at(std::size_t predecessor) const {
    return solved_by_.empty() ? *solved_ : solved_by_[predecessor];
  }
  Candidate candidate(const SolvedPose& solved, std::size_t solution, const std::array<double, 2>& angle,
                      TracedStep step) const;
  /// The layer that was made is the present one.
  void go_on(const ChoicePoint& point);
  /// Calls `visit(pick, solution, angle)` for the positions that are looked at from `from`, until it says
  /// true.
  template <class Visit>
  void visit_positions(const SolvedPose& solved, const ChoicePosition& from, const Visit& visit) const;
  void look_ahead_for_replay(std::span<const ChoicePoint> points);
  Candidate picked(const SolvedPose& solved, std::uint16_t pick) const;
  SolvedBlock* fresh_block();
  const SolvedPose& solved_for_replay(const ChoicePoint& point, std::size_t ahead);
  JointVector joints(const ChoicePosition& position) const;
  void put(const Candidate& chosen, ChosenPoint& out) const;
  /// The position on this branch that was solved in row `row`, in other turns.
  void put(const SolvedBlock::Branch& of, std::size_t row, const std::array<double, 2>& angle,
           std::uint8_t branch, bool reconfigure, ChosenPoint& out) const;
  std::size_t replay_plain(std::span<const ChoicePoint> points, std::size_t row, std::span<ChosenPoint> out);

  TableKinematics kinematics_;
  ChoiceSteps steps_;
  PoseSolver solver_;
  std::size_t rotary_count_;
  bool four_;  // rows at a time

  JointVector seed_;
  Vec3 seed_axis_P_ = Vec3::UnitZ();
  std::size_t most_ = kFewPositions;
  Vec3 axis_before_ = Vec3::UnitZ();
  std::array<Layer, 2> layers_;
  std::size_t now_ = 0;                 // layer of the last point
  const SolvedPose* solved_ = nullptr;  // the present pose
  SolvedPose own_;
  std::vector<SolvedPose> solved_by_;  // at the pole: for each position before
  std::vector<Arrival> arrivals_;
  std::vector<std::array<double, 2>> places_;
  std::vector<const Arrival*> order_;
  std::array<LeftOut, 2> left_out_;   // at the last point
  std::array<LeftOut, 2> left_here_;  // at the present one
  bool leaves_out_ = false;
  StepTraces traces_;
  std::vector<TracedStep> steps_of_layer_;

  std::size_t looked_from_ = 0;  // number of the first point that is looked up
  /// Staying on one branch where both reach the points, until one does.
  struct Stay {
    bool on = false;
    std::size_t begin = 0;  // the first point
    ChoicePosition before;  // and what came before it
    Vec3 axis_before_P = Vec3::UnitZ();
    double apart = 0.0;  // RotarySolver::apart of the last point
    double seconds = 0.0;
  };
  Stay stay_;
  std::size_t may_stay_from_ = 0;  // it did not do before

  // The pick is the solution, in its only turn; there are two.
  static constexpr std::uint16_t kPlain = 0x8000;
  static constexpr std::uint16_t kOfTwo = 0x4000;
  std::vector<std::uint16_t> picks_;  // of each point, once settled
  // The inverse of the first points, for the replay. It takes 170 bytes a point, and new memory more time
  // than to solve it again: that is what is done with the others.
  static constexpr std::size_t kMostKept = 64;
  std::vector<std::unique_ptr<SolvedBlock>> kept_;
  SolvedBlock own_block_, replay_block_;
  SolvedBlock* block_ = nullptr;           // of the points that are looked up
  const SolvedBlock* replayed_ = nullptr;  // of those that are replayed
  Candidate end_;
  Place place_;
};

}  // namespace trunnion::path
