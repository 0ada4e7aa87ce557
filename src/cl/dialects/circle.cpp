// Arcs. What the number of values tells:
//   11 (NX)         center, axis, radius, tolerance, its share inside, tool diameter, tool corner radius
//   [,TIMES,turns].
//                   Siemens documents the axis "assuming a clockwise direction": the tool turns about minus
//                   the axis.
//   6 (SolidWorks)  center, axis. The tool turns about the axis by the right-hand rule, and comes back to its
//   start for a
//                   full circle: seen from the tangents of the lines before and after in that system's files.
//   4, 7 (Creo)     center [, axis], radius: the sense is documented nowhere that we know: refused.
// The next GOTO is the end.
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

void read_circle(Context& context, const Statement& statement) {
  const std::size_t count = statement.fields.size();
  const bool turns = count == 13 && statement.fields[11].text == "TIMES";
  const bool nx = count == 11 || turns;
  if (context.modal.pending_arc) {
    return context.error(statement.where, "CIRCLE: the end (GOTO) of the arc before is missing");
  }
  if (count == 4 || count == 7) {
    return context.error(
        statement.where,
        "CIRCLE with " + std::to_string(count) +
            " values changes the geometry and is not understood by this program: its sense is not known");
  }
  if (!nx && count != 6) {
    return context.error(statement.where,
                         "CIRCLE: " + std::to_string(count) +
                             " values; 6 (center, axis) or 11 (center, axis, radius, ...) are needed");
  }
  if (!context.modal.has_position) {
    return context.error(statement.where, "CIRCLE before any position: there is nothing to go on from");
  }
  const auto center_A = context.point(statement, 0);
  double axis[3];
  if (!context.numbers(statement, 3, 3, axis) || !center_A) return;
  Vec3 normal_A(axis[0], axis[1], axis[2]);
  if (!(std::abs(normal_A.norm() - 1.0) <= kUnitNormal)) {
    return context.error(statement.fields[3].where, "CIRCLE: its axis is no unit vector");
  }
  normal_A.normalize();
  PendingArc arc;
  arc.where = statement.where;
  arc.center_A = *center_A;
  arc.normal_A = nx ? Vec3(-normal_A) : normal_A;
  arc.full_when_closed = !nx || turns;
  if (nx) {
    const auto radius = context.positive(statement, 6);
    if (!radius) return;
    arc.radius_mm = *radius * context.modal.mm_per_unit;
  }
  if (turns) {
    const auto number = context.whole(statement, 12);
    if (!number) return;
    if (*number < 1) return context.error(statement.fields[12].where, "CIRCLE: TIMES,0");
    arc.turns = *number;
  }
  context.modal.pending_arc = arc;
}

constexpr WordReading kCircleWords[] = {{"CIRCLE", read_circle}};

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
    std::string message = "CIRCLE: " + radii_text(radius, to.norm());
    if (pending.radius_mm != 0.0) message += ", as given " + short_text(pending.radius_mm, 9) + " mm";
    return context.error(pending.where, message);
  }
  if ((axis_A - context.modal.axis_A).norm() > kUnitNormal) {
    return context.error(where, "the tool axis turns along a CIRCLE: only the tip's way is known");
  }
  const bool closed = (to - from).norm() <= kClosed_mm;
  if (closed && !pending.full_when_closed) {
    return context.error(pending.where, "CIRCLE: it ends where it starts: a full circle or none?");
  }
  if (!closed && pending.turns > 1) {
    return context.error(pending.where, "CIRCLE: TIMES with an end that is not at the start's angle");
  }
  double sweep = std::atan2(n.dot(from.cross(to)), from.dot(to));
  if (closed) {
    sweep = kTwoPi * pending.turns;
  } else if (sweep <= 0.0) {
    sweep += kTwoPi;
  }
  context.add_arc(where, end_A, pending.center_A, n, Angle::radians(sweep));
}

}  // namespace trunnion::cl
