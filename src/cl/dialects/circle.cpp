// Arcs. What the number of values tells:
//   11 (NX)         center, axis, radius, tolerance, its share inside, tool diameter, tool corner radius
//   [,TIMES,turns].
//                   Siemens documents the axis "assuming a clockwise direction": the tool turns about minus
//                   the axis.
//   11 (CAMplete)   center, axis, radius, degrees, 0, 0, 0: the same sense.
//   6 (SolidWorks)  center, axis. The tool turns about the axis by the right-hand rule, and comes back to its
//   start for a
//                   full circle: seen from the tangents of the lines before and after in that system's files.
//   4, 7 (Creo)     center [, axis], radius: the GOTOs behind it are points on the arc, and where the arc
//   ends the file does not say: refused.
// MOVARC (ISO 4343 as Fusion and HSMWorks write it): center, normal, radius, ANGLE, degrees. Right hand about
// the normal; older posts leave the normal of clockwise arcs as it is, which the angle shows. The next GOTO
// is the end.
#include <cmath>
#include <string>

#include "trunnion/cl/arc.hpp"

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

constexpr double kUnitNormal = 1e-3;  // the axis of an arc is a rounded unit vector
// How far the two radii may differ, mm: the rounding of center and ends, each at most half of the third
// decimal.
constexpr double kSameRadius_mm = 5e-3;
constexpr double kClosed_mm = 1e-6;
constexpr double kSmallestRadius_mm = 1e-4;
constexpr double kMostTurns = 10000.0;
// How far the end may lie along the arc from where its angle leads: the rounding of the angle and of both
// ends.
constexpr double kSameAngle_rad = 1e-4;

/// Center and unit axis, the first six values; nothing and an error when they are none.
std::optional<PendingArc> center_and_axis(Context& context, const Statement& statement) {
  const std::string word(statement.word);
  if (context.modal.pending_arc) {
    context.error(statement.where, word + ": the end (GOTO) of the arc before is missing");
    return std::nullopt;
  }
  if (!context.modal.has_position) {
    context.error(statement.where, word + " before any position: there is nothing to go on from");
    return std::nullopt;
  }
  const auto center_A = context.point(statement, 0);
  double axis[3];
  if (!context.numbers(statement, 3, 3, axis) || !center_A) return std::nullopt;
  const Vec3 normal_A(axis[0], axis[1], axis[2]);
  if (!(std::abs(normal_A.norm() - 1.0) <= kUnitNormal)) {
    context.error(statement.fields[3].where, word + ": its axis is no unit vector");
    return std::nullopt;
  }
  PendingArc arc;
  arc.word = statement.word == "MOVARC" ? "MOVARC" : "CIRCLE";
  arc.where = statement.where;
  arc.center_A = *center_A;
  arc.normal_A = normal_A.normalized();
  return arc;
}

/// The sweep in degrees at `index`, > 0 and at most kMostTurns turns.
std::optional<Angle> sweep_of(Context& context, const Statement& statement, std::size_t index) {
  const auto degrees = context.positive(statement, index);
  if (!degrees) return std::nullopt;
  const Angle sweep = Angle::degrees(*degrees);
  if (sweep.rad() <= kTwoPi * kMostTurns) return sweep;
  context.error(statement.fields[index].where,
                std::string(statement.word) + ": more than " + short_text(kMostTurns) + " turns");
  return std::nullopt;
}

// The radius, and what stands behind it.
bool read_nx_values(Context& context, const Statement& statement, bool turns, PendingArc& arc) {
  const auto radius = context.positive(statement, 6);
  if (!radius) return false;
  arc.radius_mm = *radius * context.modal.mm_per_unit;
  if (turns) {
    const auto number = context.whole(statement, 12);
    if (!number) return false;
    if (*number < 1 || *number > kMostTurns) {
      context.error(statement.fields[12].where, "CIRCLE: TIMES," + std::to_string(*number) +
                                                    " is not from 1 to " + short_text(kMostTurns));
      return false;
    }
    arc.turns = *number;
    return true;
  }
  double rest[3];
  if (!context.numbers(statement, 8, 3, rest)) return false;
  if (rest[0] != 0.0 || rest[1] != 0.0 || rest[2] != 0.0) return true;
  arc.sweep = sweep_of(context, statement, 7);
  arc.full_when_closed = true;
  return arc.sweep.has_value();
}

void read_circle(Context& context, const Statement& statement) {
  const std::size_t count = statement.fields.size();
  const bool turns = count == 13 && statement.fields[11].text == "TIMES";
  const bool nx = count == 11 || turns;
  if (count == 4 || count == 7) {
    return context.error(
        statement.where,
        "CIRCLE with " + std::to_string(count) +
            " values changes the geometry and is not understood by this program: where it ends "
            "is not known (Creo: CIRC_INTERPOLATION POINTS_ONLY or APT_FORMAT)");
  }
  if (!nx && count != 6) {
    return context.error(statement.where,
                         "CIRCLE: " + std::to_string(count) +
                             " values; 6 (center, axis) or 11 (center, axis, radius, ...) are needed");
  }
  auto arc = center_and_axis(context, statement);
  if (!arc) return;
  if (nx) arc->normal_A = -arc->normal_A;
  arc->full_when_closed = !nx || turns;
  if (nx && !read_nx_values(context, statement, turns, *arc)) return;
  context.modal.pending_arc = *arc;
}

void read_movarc(Context& context, const Statement& statement) {
  if (statement.fields.size() != 9 || statement.fields[7].text != "ANGLE") {
    return context.error(statement.where,
                         "MOVARC changes the geometry and is not understood by this program; center, normal, "
                         "radius, ANGLE, degrees are");
  }
  auto arc = center_and_axis(context, statement);
  if (!arc) return;
  const auto radius = context.positive(statement, 6);
  if (!radius) return;
  arc->radius_mm = *radius * context.modal.mm_per_unit;
  arc->full_when_closed = true;
  arc->sweep = sweep_of(context, statement, 8);
  if (arc->sweep) context.modal.pending_arc = *arc;
}

constexpr WordReading kCircleWords[] = {{"CIRCLE", read_circle}, {"MOVARC", read_movarc}};

std::string radii_text(double start, double end) {
  return "radius to its start " + short_text(start, 9) + " mm, to its end " + short_text(end, 9) + " mm";
}

}  // namespace

std::span<const WordReading> circle_words() {
  return kCircleWords;
}

void finish_arc(Context& context, SourceRef where, const Vec3& end_A, const Vec3& axis_A) {
  const PendingArc pending = *context.modal.pending_arc;
  context.modal.pending_arc.reset();
  const Vec3 start_A = context.modal.tip_A;
  const Vec3& n = pending.normal_A;
  const Vec3 from = (start_A - pending.center_A) - n * n.dot(start_A - pending.center_A);
  const Vec3 to = (end_A - pending.center_A) - n * n.dot(end_A - pending.center_A);
  const double radius = from.norm();
  const bool radius_fits = pending.radius_mm == 0.0 || std::abs(radius - pending.radius_mm) <= kSameRadius_mm;
  if (!(radius > kSmallestRadius_mm) || !(std::abs(radius - to.norm()) <= kSameRadius_mm) || !radius_fits) {
    std::string message = std::string(pending.word) + ": " + radii_text(radius, to.norm());
    if (pending.radius_mm != 0.0) message += ", as given " + short_text(pending.radius_mm, 9) + " mm";
    return context.error(pending.where, message);
  }
  if ((axis_A - context.modal.axis_A).norm() > kUnitNormal) {
    return context.error(
        where, "the tool axis turns along a " + std::string(pending.word) + ": only the tip's way is known");
  }
  const bool closed = (to - from).norm() <= kClosed_mm;
  if (closed && !pending.full_when_closed) {
    return context.error(pending.where, "CIRCLE: it ends where it starts: a full circle or none?");
  }
  // Start and end rounded by half a digit each, in two directions: 1.4 digits. `coordinate_mm` is half of
  // one.
  const double rounding_mm = 4.0 * context.resolution().coordinate_mm;
  if (!closed && !pending.sweep && (to - from).norm() <= rounding_mm) {
    return context.error(pending.where, std::string(pending.word) + ": it ends " +
                                            short_text((to - from).norm(), 3) +
                                            " mm from where it starts, which may be rounding: a full circle, "
                                            "or none?");
  }
  if (!closed && pending.turns > 1) {
    return context.error(pending.where,
                         "CIRCLE: TIMES with an end that is not at the start's angle: how the rest of a turn "
                         "counts is documented nowhere (NX: Motion Output Type, Line)");
  }
  double sweep = std::atan2(n.dot(from.cross(to)), from.dot(to));
  if (closed) {
    sweep = kTwoPi * pending.turns;
  } else if (sweep <= 0.0) {
    sweep += kTwoPi;
  }
  if (pending.sweep) {
    const double given = pending.sweep->rad();
    const double whole_turns = std::round((given - sweep) / kTwoPi);
    const double apart = std::abs(given - sweep - whole_turns * kTwoPi);
    if (whole_turns < 0.0 || !(apart * radius <= kSameRadius_mm + kSameAngle_rad * radius)) {
      return context.error(
          pending.where, std::string(pending.word) + ": it turns by " + short_text(pending.sweep->deg(), 9) +
                             " deg, but the way to its end, right-handed about its normal, is " +
                             short_text(Angle::radians(sweep).deg(), 9) + " deg: the sense is not known");
    }
    sweep += whole_turns * kTwoPi;
  }
  context.add_arc(where, end_A, pending.center_A, n, Angle::radians(sweep));
}

}  // namespace trunnion::cl
