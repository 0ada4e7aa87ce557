#include "trunnion/machine/safe_height.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/swept.hpp"

#include "machine/safe_height_keys.hpp"

namespace trunnion {
namespace {

using config::Section;

std::string mm_text(double value) {
  return fixed_text(value, 3) + " mm";
}

// The way of Z that lifts the tool off the part: by its direction, and whether it carries the tool or the
// part.
int away_of(const Axis& z) {
  constexpr double kLeast = 0.1;  // of its way
  const double rises = z.carries_part ? -z.direction.z() : z.direction.z();
  return rises > kLeast ? 1 : rises < -kLeast ? -1 : 0;
}

// Towards the spindle.
Vec3 upwards(const Axis& axis) {
  return axis.direction.z() < 0.0 ? Vec3(-axis.direction) : axis.direction;
}

Vec3 turned(const Axis& axis, double angle, const Vec3& point) {
  return axis.point_mm + Eigen::AngleAxisd(angle, axis.direction) * (point - axis.point_mm);
}

// From one end of an axis' travel to the other, once round at most.
std::pair<double, double> turns_of(const Axis& axis, SweptTurns turns) {
  if (!axis.has_limits()) return {-kPi, kPi};
  double from = axis.min;
  double to = axis.max;
  if (turns == SweptTurns::either_sense) {
    to = std::max(std::abs(from), std::abs(to));
    from = -to;
  }
  return to - from < kTwoPi ? std::pair{from, to} : std::pair{-kPi, kPi};
}

// Highest place of a disc about the innermost axis, `along_mm` up from that axis' point, while the outer axis
// turns: Z in M with the linear axes at zero.
double swept_top_mm(const Machine& machine, double radius_mm, double along_mm,
                    SweptTurns turns = SweptTurns::within_limits) {
  const auto rotary = machine.rotary_axes();
  const Axis& inner = machine.axes[rotary.back()];
  const Vec3 up = upwards(inner);
  const Vec3 center = inner.point_mm + along_mm * up;
  const auto height = [&](const Vec3& at, const Vec3& normal) {
    return at.z() + radius_mm * std::sqrt(std::max(0.0, 1.0 - normal.z() * normal.z()));
  };
  if (rotary.size() < 2) return height(center, up);
  const Axis& outer = machine.axes[rotary.front()];
  const auto [from, to] = turns_of(outer, turns);
  const auto steps = static_cast<int>(std::ceil((to - from) / (0.25 * kRadPerDegree)));
  double top = -std::numeric_limits<double>::infinity();
  for (int i = 0; i <= steps; ++i) {
    const double angle = from + (to - from) * i / steps;
    top = std::max(top, height(turned(outer, angle, center), Eigen::AngleAxisd(angle, outer.direction) * up));
  }
  return top;
}

}  // namespace

void read_part_extent(Section& part, Machine& machine) {
  const auto radius = part.find_quantity("radius_mm");
  const auto height = part.find_quantity("height_mm");
  if (radius.has_value() != height.has_value()) {
    part.error(radius ? "radius_mm" : "height_mm", "'radius_mm' and 'height_mm' go together");
    return;
  }
  if (!radius) return;
  if (*radius <= 0.0) part.error("radius_mm", "'radius_mm' must be above 0");
  if (*height <= 0.0) part.error("height_mm", "'height_mm' must be above 0");
  machine.safe.part = TableExtent{*radius, *height};
}

void read_safe_height(Section& root, Machine& machine) {
  SafeHeight& safe = machine.safe;
  const auto z = machine.axis("Z");
  if (z) {
    const Axis& axis = machine.axes[*z];
    safe.away = away_of(axis);
    if (safe.away != 0 && axis.has_limits()) safe.to_mm[2] = safe.away > 0 ? axis.max : axis.min;
  }
  if (auto s = root.find_section("retract")) {
    static constexpr std::array kKeys = {"x_mm", "y_mm", "z_mm"};
    static constexpr std::array kNames = {"X", "Y", "Z"};
    for (std::size_t i = 0; i < kKeys.size(); ++i) {
      const auto to = s->find_quantity(kKeys[i]);
      if (!to) continue;
      const auto id = machine.axis(kNames[i]);
      if (!id) {
        s->error(kKeys[i], std::string("'") + kKeys[i] + "': the machine has no axis " + kNames[i]);
        continue;
      }
      const Axis& axis = machine.axes[*id];
      if (!axis.within_limits(*to)) {
        s->error(kKeys[i], std::string("'") + kKeys[i] + "' is " + mm_text(*to) + ", beyond the travel of " +
                               kNames[i] + ", " + mm_text(axis.min) + " to " + mm_text(axis.max));
      }
      safe.to_mm[i] = *to;
      safe.z_is_given = safe.z_is_given || i == 2;
    }
    s->finish();
  }
  if (auto s = root.find_section("table")) {
    safe.table = TableExtent{s->quantity("radius_mm"), s->quantity("top_mm")};
    if (safe.table->radius_mm <= 0.0) s->error("radius_mm", "'radius_mm' must be above 0");
    if (machine.rotary_axes().empty())
      s->error("radius_mm", "a table's extent needs a rotary axis that carries the part");
    s->finish();
  }
  if (!safe.part) return;
  if (!safe.table) {
    root.error("part", "[part] radius_mm and height_mm need [table]: the part stands on its top");
    safe.part.reset();
  } else {
    safe.part->top_mm += safe.table->top_mm;
  }
}

namespace {

// By how much a tip at the safe height, taken down by `down_mm`, is below what table and part sweep, in
// words.
std::optional<std::string> below_swept(const Machine& machine, double tool_length_mm, double down_mm) {
  const auto id = machine.axis("Z");
  const SafeHeight& safe = machine.safe;
  if (!id || !safe.z_mm() || !safe.table || machine.rotary_axes().empty()) return std::nullopt;
  const double tip_mm = *safe_tip_mm(machine, tool_length_mm) - down_mm;
  double top_mm = swept_top_mm(machine, safe.table->radius_mm, safe.table->top_mm);
  const char* what = "the table";
  if (safe.part) {
    const double part_mm = swept_top_mm(machine, safe.part->radius_mm, safe.part->top_mm);
    if (part_mm > top_mm) what = "the part";
    top_mm = std::max(top_mm, part_mm);
  }
  if (tip_mm > top_mm) return std::nullopt;
  return mm_text(top_mm - tip_mm) + " below what " + what + " sweeps while the rotary axes turn";
}

}  // namespace

std::optional<std::string> safe_height_fault(const Machine& machine, double tool_length_mm) {
  const auto below = below_swept(machine, tool_length_mm, 0.0);
  if (!below) return std::nullopt;
  return "at the safe height, machine Z " + mm_text(*machine.safe.z_mm()) + ", the tip of a tool of " +
         mm_text(tool_length_mm) + " is " + *below;
}

std::optional<std::string> length_drop_fault(const Machine& machine, double tool_length_mm) {
  const auto below = below_swept(machine, tool_length_mm, tool_length_mm);
  if (!below) return std::nullopt;
  return "from the safe height, machine Z " + mm_text(*machine.safe.z_mm()) + ", Z may go down by the " +
         mm_text(tool_length_mm) + " of the tool: its tip would be " + *below;
}

double swept_top_mm(const Machine& machine, const Vec3& point_P, SweptTurns turns) {
  const Vec3 point = point_P + machine.part_zero_mm;
  const auto rotary = machine.rotary_axes();
  if (rotary.empty()) return point.z();
  const Axis& inner = machine.axes[rotary.back()];
  const Vec3 up = upwards(inner);
  const Vec3 from_axis = point - inner.point_mm;
  const double along_mm = from_axis.dot(up);
  return swept_top_mm(machine, (from_axis - along_mm * up).norm(), along_mm, turns);
}

std::optional<double> safe_tip_mm(const Machine& machine, double tool_length_mm) {
  const auto id = machine.axis("Z");
  if (!id || !machine.safe.z_mm()) return std::nullopt;
  const Axis& z = machine.axes[*id];
  return (z.carries_part ? -z.direction.z() : z.direction.z()) * *machine.safe.z_mm() - tool_length_mm;
}

std::optional<double> inside_table_mm(const Machine& machine, const Vec3& point_P) {
  const auto rotary = machine.rotary_axes();
  if (!machine.safe.table || rotary.empty()) return std::nullopt;
  const Axis& inner = machine.axes[rotary.back()];
  const Vec3 up = upwards(inner);
  const Vec3 from_axis = point_P + machine.part_zero_mm - inner.point_mm;
  const double along_mm = from_axis.dot(up);
  const double across_mm = (from_axis - along_mm * up).norm();
  if (along_mm >= machine.safe.table->top_mm || across_mm >= machine.safe.table->radius_mm)
    return std::nullopt;
  return machine.safe.table->top_mm - along_mm;
}

}  // namespace trunnion
