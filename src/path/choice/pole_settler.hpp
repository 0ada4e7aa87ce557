#pragma once
#include <functional>
#include <optional>
#include <span>

#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// Gives C its positions at the points of the pole, which were chosen with C as it came: where the cut comes
/// there C stands as the great circle before leads it, and the stretch along the pole takes it to where the
/// great circle behind begins. (With axes at right angles C stands still along a great circle to the pole;
/// on a nutating table it turns.) Run by run, or piece by piece of a run.
class PoleSettler {
 public:
  /// `machine` and its `kinematics` must outlive this.
  PoleSettler(const Machine& machine, const TableKinematics& kinematics)
      : machine_(machine), kinematics_(kinematics) {}

  /// What follows a piece, as it was chosen: points at the pole, and the first one that is not of that
  /// stretch.
  struct Ahead {
    double way_mm = 0.0;  // of the tip, from the last point of the piece along the stretch
    std::size_t points = 0;
    std::optional<ChosenPoint> next;  // nothing: the run ends
    Vec3 next_axis_P = Vec3::UnitZ();
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
  double led_by(const Vec3& pole_axis_P, const JointVector& at_pole, const Vec3& axis_P,
                const JointVector& q) const;

  const Machine& machine_;
  const TableKinematics& kinematics_;
  // The last point of the piece before.
  std::optional<ChosenPoint> before_;
  Vec3 before_axis_P_ = Vec3::UnitZ();
  // The stretch that is under way.
  std::size_t left_ = 0;  // of its points; 0: none is
  bool first_ = false;    // the next one is its first
  bool by_rapid_ = false;
  double in_ = 0.0;  // C where the path comes to the pole, and by how much it has to turn
  double turn_ = 0.0;
  double way_mm_ = 0.0;
  double gone_mm_ = 0.0;
  Vec3 tip_before_P_ = Vec3::Zero();
};

}  // namespace trunnion::path
