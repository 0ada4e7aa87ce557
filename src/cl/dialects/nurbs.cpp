// NX, Motion Output Type Nurbs: NURBS/, KNOT/k,... and CNTRL/x,y,z: a cubic of the tip, the tool axis held.
// It is documented nowhere that we know; a real file tells:
//   There are two points more than knots, and the last knot is 1. So the first point is the position before
//   it, the first four knots are 0 and the last four 1, of which one is written. With these the speed along
//   the control polygon, 3 |P(i+1) - P(i)| / (t(i+4) - t(i+1)), is even, or the same from both
//   ends, in the curves looked at.
// Each span becomes chords that keep to it within the tolerance: over the step h one is off by h^2 / 8 max
// |C''|.
#include <algorithm>
#include <cmath>
#include <string>
#include <unsupported/Eigen/Splines>

#include "cl/words.hpp"

namespace trunnion::cl {

namespace {

constexpr int kDegree = 3;
using CubicCurve = Eigen::Spline<double, 3, kDegree>;
constexpr std::size_t kMostCurveValues = 100000;
constexpr double kMostCurveChords = 250000.0;
constexpr double kLastKnot = 1e-6;  // seven decimals

constexpr std::string_view kLines = " (NX: Motion Output Type, Line)";

void read_nurbs(Context& context, const Statement& statement) {
  NurbsCurve curve;
  curve.where = statement.where;
  const bool plain =
      !statement.has_fields() || (statement.fields.size() == 1 && statement.fields[0].text.empty());
  if (!plain) {
    context.error(
        statement.where,
        "NURBS with values changes the geometry and is not understood by this program" + std::string(kLines));
  } else if (context.modal.pending_arc || context.modal.cycle) {
    context.error(statement.where, "NURBS behind CIRCLE or under CYCLE: a GOTO is needed");
  } else if (!context.modal.has_position) {
    context.error(statement.where, "NURBS before any position: there is nothing to go on from");
  } else {
    curve.good = true;
  }
  context.modal.nurbs = std::move(curve);
}

/// The curve that the statement belongs to; null when there is none to be read.
NurbsCurve* curve_of(Context& context, const Statement& statement) {
  auto& curve = context.modal.nurbs;
  if (!curve) {
    context.error(statement.where, std::string(statement.word) + " without NURBS before it");
    return nullptr;
  }
  if (!curve->good) return nullptr;
  if (curve->knots.size() + curve->points_A.size() <= kMostCurveValues) return &*curve;
  context.error(curve->where, "NURBS: more than " + std::to_string(kMostCurveValues) + " knots and points");
  curve->good = false;
  return nullptr;
}

void read_knot(Context& context, const Statement& statement) {
  NurbsCurve* curve = curve_of(context, statement);
  if (curve == nullptr) return;
  for (std::size_t i = 0; i < statement.fields.size(); ++i) {
    const auto value = context.number(statement, i);
    if (!value) {
      curve->good = false;
      return;
    }
    curve->knots.push_back(*value);
  }
}

void read_cntrl(Context& context, const Statement& statement) {
  NurbsCurve* curve = curve_of(context, statement);
  if (curve == nullptr) return;
  if (statement.fields.size() != 3) {
    context.error(statement.where, "CNTRL: " + std::to_string(statement.fields.size()) +
                                       " values; 3 (x, y, z), the tool axis held, are understood" +
                                       std::string(kLines));
    curve->good = false;
    return;
  }
  const auto point_A = context.point(statement, 0);
  curve->good = point_A.has_value();
  if (point_A) curve->points_A.push_back(*point_A);
}

bool knots_rise(const std::vector<double>& knots) {
  return std::is_sorted(knots.begin(), knots.end()) && knots.front() > 0.0 &&
         std::abs(knots.back() - 1.0) <= kLastKnot &&
         std::all_of(knots.begin(), knots.end() - 1, [](double knot) { return knot < 1.0; });
}

CubicCurve curve_from(const NurbsCurve& given, const Vec3& start_A) {
  const auto inner = static_cast<Eigen::Index>(given.knots.size()) - 1;
  const auto count = static_cast<Eigen::Index>(given.points_A.size()) + 1;
  CubicCurve::KnotVectorType knots(inner + Eigen::Index{2} * (kDegree + 1));
  knots.head(kDegree + 1).setZero();
  for (Eigen::Index i = 0; i < inner; ++i) knots[kDegree + 1 + i] = given.knots[static_cast<std::size_t>(i)];
  knots.tail(kDegree + 1).setOnes();
  CubicCurve::ControlPointVectorType points(3, count);
  points.col(0) = start_A;
  for (Eigen::Index i = 1; i < count; ++i) points.col(i) = given.points_A[static_cast<std::size_t>(i - 1)];
  return {knots, points};
}

/// Chords within `tolerance_mm` of the curve between the knots a and b; C'' is linear there.
double chords_of_span(const CubicCurve& curve, double a, double b, double tolerance_mm) {
  const auto bend = [&](double t) -> Vec3 { return curve.derivatives(a + (b - a) * t, 2).col(2).matrix(); };
  const Vec3 early = bend(1.0 / 3.0), late = bend(2.0 / 3.0);
  const double most = std::max((2.0 * early - late).norm(), (2.0 * late - early).norm());
  return std::max(1.0, std::ceil((b - a) * std::sqrt(most / (8.0 * tolerance_mm))));
}

constexpr WordReading kNurbsWords[] = {{"NURBS", read_nurbs}, {"KNOT", read_knot}, {"CNTRL", read_cntrl}};

}  // namespace

std::span<const WordReading> nurbs_words() {
  return kNurbsWords;
}

void finish_nurbs(Context& context) {
  const NurbsCurve given = std::move(*context.modal.nurbs);
  context.modal.nurbs.reset();
  if (!given.good) return;
  if (given.points_A.size() < kDegree || given.knots.size() + 2 != given.points_A.size()) {
    return context.error(given.where,
                         "NURBS: " + std::to_string(given.points_A.size()) + " points and " +
                             std::to_string(given.knots.size()) +
                             " knots; of a cubic from the position before it two points more than "
                             "knots are needed" +
                             std::string(kLines));
  }
  if (!knots_rise(given.knots))
    return context.error(given.where, "NURBS: its knots do not rise from above 0 to 1");
  const CubicCurve curve = curve_from(given, context.modal.tip_A);
  const double tolerance_mm = context.options().arc_tolerance_mm;
  const auto& knots = curve.knots();
  double all = 0.0;
  std::vector<double> chords;
  for (Eigen::Index i = kDegree; i + kDegree + 1 < knots.size(); ++i) {
    chords.push_back(knots[i] < knots[i + 1] ? chords_of_span(curve, knots[i], knots[i + 1], tolerance_mm)
                                             : 0.0);
    all += chords.back();
  }
  if (!(all <= kMostCurveChords)) {
    return context.error(given.where, "NURBS: a curve of " + short_text(all, 3) + " chords within " +
                                          short_text(tolerance_mm, 3) + " mm; at most " +
                                          short_text(kMostCurveChords) + " are taken");
  }
  const bool rapid = context.modal.rapid_next;
  for (std::size_t s = 0; s < chords.size(); ++s) {
    const double a = knots[static_cast<Eigen::Index>(s) + kDegree];
    const double b = knots[static_cast<Eigen::Index>(s) + kDegree + 1];
    for (double k = 1.0; k <= chords[s]; ++k) {
      const bool end = s + 1 == chords.size() && k == chords[s];
      const Vec3 tip_A = end ? given.points_A.back() : Vec3(curve(a + (b - a) * k / chords[s]).matrix());
      context.add_motion(given.where, {tip_A, context.modal.axis_A, context.modal.feed, rapid});
    }
  }
  context.modal.rapid_next = false;
}

}  // namespace trunnion::cl
