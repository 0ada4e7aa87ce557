#pragma once
#include <functional>
#include <optional>
#include <span>

#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// Gives C its positions at the points of the pole, which were chosen with C as it came: the stretch of one
/// cut along the pole takes C to where the path leaves it. Run by run, or piece by piece of a run.
class PoleSettler {
 public:
  /// `kinematics` must outlive this.
  explicit PoleSettler(const TableKinematics& kinematics) : kinematics_(kinematics) {}

  /// What follows a piece, as it was chosen: points at the pole, and the first one that is not of that
  /// stretch.
  struct Ahead {
    double way_mm = 0.0;  // of the tip, from the last point of the piece along the stretch
    std::size_t points = 0;
    std::optional<ChosenPoint> next;  // nothing: the run ends
    bool next_rapid = false;
  };
  /// All points of a run, or the next ones. `look_ahead` is asked where a stretch goes on behind them.
  void settle(std::span<const ChoicePoint> points, std::span<ChosenPoint> chosen, ChoiceSummary& summary,
              const std::function<Ahead()>& look_ahead);
  /// Whether a point belongs to the stretch of the point before it: a rapid within the pole begins a new one,
  /// C may turn there.
  static bool goes_on(const ChoicePoint& point, const ChosenPoint& chosen) {
    return chosen.singular && !point.rapid;
  }

 private:
  void begin(std::span<const ChoicePoint> points, std::span<const ChosenPoint> chosen,
             const std::function<Ahead()>& look_ahead);
  void place(const ChoicePoint& point, ChosenPoint& chosen, ChoiceSummary& summary);
  JointVector at(const ChoicePoint& point, const JointVector& q, double inner) const;

  const TableKinematics& kinematics_;
  // The stretch that is under way.
  std::size_t left_ = 0;  // of its points; 0: none is
  bool first_ = false;    // the next one is its first
  bool by_rapid_ = false;
  double in_ = 0.0;  // C as it came, and by how much it has to turn
  double turn_ = 0.0;
  double way_mm_ = 0.0;
  double gone_mm_ = 0.0;
  Vec3 tip_before_P_ = Vec3::Zero();
};

}  // namespace trunnion::path
