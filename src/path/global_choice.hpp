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
    Vec3 linear;
    RotarySines sines;
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
  /// `ahead`: what is known of the point, or null.
  bool add(const ChoicePoint& point, const Solved* ahead);
  /// Walks back from the cheapest end through the points that `add` took.
  void take(std::span<ChosenPoint> out) const;
  void put(const Trace& trace, ChosenPoint& out) const;
  void solve(const ToolPose& pose, const Candidate& seed);
  void candidates(const Candidate& seed, Layer& out) const;
  void add_turns(std::size_t solution, const Candidate& seed, Layer& out) const;
  /// A candidate of the present point as it is reached from a position before.
  struct Arrival {
    Candidate candidate;
    double way = 0.0;
    double preference = 0.0;
    std::size_t place = 0;  // candidates that are the same position have one
    double least() const { return way + preference; }
  };
  void gather(const ChoicePoint& point);
  void arrive(const ChoicePoint& point);
  double step_cost(const Candidate& a, const Candidate& b) const;
  double centre_preference(const Candidate& c) const;
  std::optional<double> only_turn(std::size_t k, double angle, double near) const;
  bool same_position(const Candidate& a, const Candidate& b) const;
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
  std::size_t now_ = 0;  // layer of the last point
  Solved solved_;
  Layer reached_;
  std::vector<Arrival> arrivals_;
  std::vector<std::size_t> order_;  // of the arrivals
  std::array<Solved, kAhead> ahead_;
  static constexpr std::uint32_t kNoTrace = 0xffffffff;
  std::vector<Trace> traces_;
  std::vector<std::uint32_t> first_;  // index of each point's first trace; kNoTrace: add_only took it
};

}  // namespace trunnion::path
