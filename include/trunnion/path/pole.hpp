#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// What is done where the tool stands nearly along the inner rotary axis (C) and small changes of the tool
/// axis ask for large turns of it.
struct PoleOptions {
  Angle cone = Angle::degrees(5.0);       // tilt below which the tool axis may be changed
  Angle min_turn = Angle::degrees(10.0);  // C must turn by more between two points for that
  Angle tolerance;  // largest change of the tool axis, the tip unchanged; 0: none is changed
};

/// A stretch of points inside the cone whose tool axes were changed.
struct PoleStretch {
  std::size_t first = 0;  // index of its first and last point
  std::size_t last = 0;
  Angle tilted_by;    // largest change of a tool axis
  Angle turn_before;  // largest turn of C between two points of the stretch and its neighbours
  Angle turn_after;
  bool early = false;  // C stands for what comes at the rapid that leads to the stretch
};

/// Angle of `axis_P` from the direction in which the inner rotary axis is free; nothing for a machine without
/// two rotary axes.
Angle tilt_from_pole(const Machine& machine, const Vec3& axis_P);

/// Where the tool stands before the first of these points when that is cut to.
struct PoleStart {
  JointVector q;
  ToolPose pose;
};

/// True when C turns by more than `min_turn` between two points of one cut inside the cone. `from`: nothing
/// where the first point is not cut to.
bool turns_near_pole(const Machine& machine, const PoleOptions& options, std::span<const ChoicePoint> points,
                     std::span<const ChosenPoint> chosen, const std::optional<PoleStart>& from);

/// The points with tool axes that pass the pole within the tolerance led straight through it: there a choice
/// may go through the pole (the outer axis to the other side) instead of round it.
std::vector<ChoicePoint> put_on_pole(const Machine& machine, const PoleOptions& options,
                                     std::span<const ChoicePoint> points);

/// A run of points, as programmed and as it is led through the pole.
struct PoleRun {
  std::span<const ChoicePoint> programmed;  // as the CL file gives them
  std::span<const ChosenPoint> before;      // their joints
  std::span<ChoicePoint> points;            // of `put_on_pole`
  std::span<ChosenPoint> chosen;            // their joints
  const std::optional<PoleStart>& from;     // as turns_near_pole has it
};

/// Makes C turn less in the cone. At every point C may leave its place as far as the tool axis, with the best
/// outer angle there, stays within the tolerance of `programmed`; through these windows C takes the
/// straightest way (a string pulled tight over the length of the path). Changes `points[i].pose.axis_P` and
/// `chosen[i].q` (linear axes solved for the tip, which stays). Points between which the axes would not
/// follow then, within `axis_tolerance` as the choice has it, keep what was chosen.
std::vector<PoleStretch> tilt_near_pole(const Machine& machine, const Vec3& tool_mm,
                                        const PoleOptions& options, Angle axis_tolerance, const PoleRun& run);

}  // namespace trunnion::path
