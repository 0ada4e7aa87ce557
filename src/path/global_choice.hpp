#pragma once
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "trunnion/machine/rotary_solver.hpp"
#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/solution_choice.hpp"

#include "path/rotary_connection.hpp"

namespace trunnion::path {

/// Travel over rate: seconds that an axis takes for a unit of its motion. Where the machine file gives no
/// rate it is that of a small trunnion: only ratios matter for the choice.
double seconds_per_unit(const Axis& axis);

/// Turns of `angle` within the limits of an axis; one, the nearest to `near`, when it is free to count turns.
std::size_t turns_within(const Axis& axis, double angle, double near, std::array<double, 8>& out);

/// The shortest path over all branches and turns (see ChoiceMethod::global), point by point.
class GlobalChoice {
 public:
  GlobalChoice(const Machine& machine, const ChoiceOptions& options);

  /// Appends one ChosenPoint for each point to `out`. Gives the first point that nothing reaches, or none.
  const ChoicePoint* choose(std::span<const ChoicePoint> points, const JointVector& seed,
                            std::vector<ChosenPoint>& out);

 private:
  static constexpr std::size_t kMaxCandidates = 16;

  struct Candidate {
    std::array<double, 2> angle{};
    Vec3 linear = Vec3::Zero();  // positions of the linear axes, by linear_
    RotarySines sines;           // of the angles
    double cost = 0.0;
    std::uint8_t from = 0;  // index of the best predecessor
    std::uint8_t branch = 0;
    bool singular = false;
    bool reconfigure = false;
  };
  struct Layer {
    std::array<Candidate, kMaxCandidates> at;
    std::size_t count = 0;
  };
  // What must be kept of a candidate to walk back.
  struct Trace {
    std::array<double, 2> angle;
    std::uint8_t from;
    std::uint8_t branch;
    bool singular;
    bool reconfigure;
  };

  /// The inverse of a pose, turns aside.
  struct Solved {
    RotarySolutions rotary;
    std::array<RotarySines, 2> sines;  // of the angles
    std::array<Vec3, 2> linear;        // positions of the linear axes: the same for every turn
    bool follows_seed = false;         // C may be the seed's: at the pole
    bool known = false;                // of those looked up ahead
  };
  static constexpr std::size_t kAhead = 64;

  void start(const JointVector& seed, std::size_t count);
  void look_ahead(std::span<const ChoicePoint> points);
  /// The next point, where one position came before and one reaches it; false where that is not so.
  bool add_only(const ChoicePoint& point, const Solved& solved, ChosenPoint& out);
  /// The same where both branches reach it in one turn each, from at most two positions.
  bool add_both(const ChoicePoint& point, const Solved& solved);
  /// `ahead`: what is known of the point, or null.
  bool add(const ChoicePoint& point, const Solved* ahead);
  /// Walks back from the cheapest end through the points that `add` took.
  void take(std::span<const ChoicePoint> points, std::span<ChosenPoint> out) const;
  void put(const Candidate& chosen, ChosenPoint& out) const;
  void solve(const ToolPose& pose, const Candidate& seed, Solved& out) const;
  /// A position of the present point as it is reached from one before.
  struct Arrival {
    std::array<double, 2> angle;
    std::uint8_t solution = 0;
    std::uint8_t from = 0;   // the position before
    std::uint8_t place = 0;  // arrivals at the same position have one
    double way = 0.0;        // cost so far, but for a reconfiguration
    double preference = 0.0;
    double least() const { return way + preference; }
  };
  /// All arrivals at the pose that was solved. `solved_at(p)`: as the position p before makes it.
  void gather(const ChoicePoint& point);
  void gather_from(std::size_t predecessor);
  void arrive(const Solved& solved, std::size_t predecessor, std::size_t solution,
              const std::array<double, 2>& angle);
  void keep_cheapest(const ChoicePoint& point);
  const Solved& solved_at(std::size_t predecessor) const {
    return solved_by_.empty() ? *solved_ : solved_by_[predecessor];
  }
  Candidate candidate(const Arrival& arrival) const;
  /// The layer that was made is the present one.
  void go_on(const ChoicePoint& point);
  double step_cost(const Candidate& from, const std::array<double, 2>& angle, const Vec3& linear) const;
  double centre_preference(const std::array<double, 2>& angle) const;
  std::optional<double> only_turn(std::size_t k, double angle, double near) const;
  bool same_position(const std::array<double, 2>& a, const std::array<double, 2>& b) const;
  bool reconfigures(const ChoicePoint& point, const Candidate& a, const Candidate& b) const;
  bool way_within_limits(const Candidate& a, const Vec3& axis_b_P) const;
  bool holds_on_the_way(const Candidate& a, const Vec3& axis_P) const;
  JointVector joints(const std::array<double, 2>& angle, const Vec3& linear) const;

  const ChoiceOptions& options_;
  TableKinematics kinematics_;
  RotarySolver solver_;
  RotaryConnection connection_;
  std::size_t rotary_count_;
  std::array<AxisId, 2> rotary_{};
  std::array<const Axis*, 2> rotary_axis_{};
  std::array<AxisId, 3> linear_{};
  std::array<double, 2> rotary_seconds_{};
  bool reaches_pole_ = false;  // within the limits
  bool oblique_ = false;       // the rotary axes are not square to each other
  std::array<double, 3> linear_seconds_{};

  JointVector seed_;
  Vec3 axis_before_ = Vec3::UnitZ();
  std::array<Layer, 2> layers_;
  std::size_t now_ = 0;             // layer of the last point
  const Solved* solved_ = nullptr;  // the present pose
  Solved own_;
  std::vector<Solved> solved_by_;  // at the pole: for each position before
  std::vector<Arrival> arrivals_;
  std::size_t places_ = 0;
  std::vector<const Arrival*> order_;
  std::array<Solved, kAhead> ahead_;
  static constexpr std::uint32_t kNoTrace = 0xffffffff;
  std::vector<Trace> traces_;
  std::vector<std::uint32_t> first_;  // index of each point's first trace; kNoTrace: add_only took it
};

}  // namespace trunnion::path
