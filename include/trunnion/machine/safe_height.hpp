#pragma once
#include <array>
#include <optional>
#include <string>

#include "trunnion/geom/pose.hpp"

namespace trunnion {

struct Machine;

/// A cylinder about the innermost rotary axis, turning with it.
struct TableExtent {
  double radius_mm = 0.0;
  /// Of its upper face: along the axis from the axis' point, upwards (to the spindle) at A = C = 0.
  double top_mm = 0.0;
};

/// Where the tool is out of the way of all that turns, as the machine file says ([retract], [table], [part]).
struct SafeHeight {
  /// Machine positions (spindle gauge point, without tool length) to which X, Y and Z go, mm. Z: before a
  /// rotary axis turns outside a cut, before a tool change and at the end; X and Y: at the end, after Z.
  std::array<std::optional<double>, 3> to_mm;
  /// Z was given, and not only taken from the end of its travel.
  bool z_is_given = false;
  /// Which way of the Z axis takes the tool away from the part: 1, -1; 0: neither.
  int away = 0;
  std::optional<TableExtent> table;
  std::optional<TableExtent> part;  // a cylinder on the table: its top is that of the part

  const std::optional<double>& z_mm() const { return to_mm[2]; }
  /// `z_mm` is as far from the part as the safe height, or farther; `slack_mm` less counts, too.
  bool is_safe(double z, double slack_mm) const {
    return z_mm() && static_cast<double>(away == 0 ? 1 : away) * (z - *z_mm()) >= -slack_mm;
  }
};

/// Why a tool of this gauge length does not clear, at the safe height, what table and part sweep while the
/// rotary axes turn through their limits: with the numbers. Nothing: it does, or their extents are not given.
std::optional<std::string> safe_height_fault(const Machine& machine, double tool_length_mm);

/// The same for a tool that goes down from the safe height by its own gauge length, as controls do that take
/// the length out at once where it is ended.
std::optional<std::string> length_drop_fault(const Machine& machine, double tool_length_mm);

/// How far a point of the part, in P, is inside the table (mm, > 0: below its upper face and within its
/// radius). Nothing: it is outside, or the table's extent is not given.
std::optional<double> inside_table_mm(const Machine& machine, const Vec3& point_P);

}  // namespace trunnion
