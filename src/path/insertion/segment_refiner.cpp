#include "path/insertion/segment_refiner.hpp"

#include <algorithm>
#include <cmath>

#include "path/bounds/closed_forms.hpp"
#include "path/bounds/convex.hpp"
#include "path/bounds/tool_segment.hpp"
#include "path/insertion/subtraction.hpp"

namespace trunnion::path {
namespace {

// Of the tolerance: farther off than any search for the nearest place ends beside it.
constexpr double kSurelyBeyond = 1.01;
// Of the tolerance: a deviation so small may have any shape.
constexpr double kWellBelow = 0.25;
// Harmonic functions describe the error up to here (README, "Predictors").
const Angle kHarmonicTurn = Angle::degrees(60.0);
// Of the inner axis at the pole: less is rounding.
const Angle kLeastPoleTurn = Angle::degrees(0.05);
// Share of the largest error that the middle of a bow has at least; less is S-shaped.
constexpr double kBowShaped = 0.9;

}  // namespace

SegmentRefiner::SegmentRefiner(const Machine& machine, const Vec3& tool_mm, const Rounding& rounding,
                               const NonlinearOptions& options)
    : machine_(machine),
      rounding_(rounding),
      options_(options),
      judge_(machine, tool_mm, options_),
      maker_(machine_, kinematics(), rounding_),
      pole_(judge_, maker_, rounding_),
      even_(both_sides()),
      predictor_is_below_truth_(options.predictor.kind == Predictor::Kind::exact ||
                                options.predictor.middle_is_largest()),
      plan_(judge_, maker_, ends_, {rounding.tip_error_mm(machine), rounding.axis_error_rad(machine)}) {}

void SegmentRefiner::start(const SegmentEnds& ends, const Tolerance& tolerance) {
  look_at(ends, tolerance);
  maker_.start(*ends.a, *ends.b);
}

void SegmentRefiner::look_at(const SegmentEnds& ends, const Tolerance& tolerance) {
  ends_ = ends;
  judge_.start(*ends.a, *ends.b, tolerance);
  plan_.start();
  nodes_.clear();
}

// Of the whole segment: its bow was seen.
bool SegmentRefiner::flute_is_beyond_half_way() const {
  const Tolerance::Flute& flute = judge_.tolerance().flute;
  return judge_.flute_part() != nullptr &&
         bow_.off.largest_mm(flute.length_mm) > kSurelyBeyond * flute.off_mm;
}

SegmentReport SegmentRefiner::decide(const SegmentEnds& ends, const Tolerance& tolerance, double known_mm,
                                     std::vector<Point>& out) {
  SegmentReport report = kept();
  const Station& a = *ends.at_a;
  const Station& b = *ends.at_b;
  const NormsOf<double> norms = piece_norms(kinematics(), a, b);
  const double rounding = tip_rounding(kinematics(), a, b);
  const double bow = norms.M2() / 8.0 + rounding;
  // Any point of the reference is at least as far as the nearest one: its ends serve.
  const double off2 =
      std::max((a.tip_P - ends.a->tip_P).squaredNorm(), (b.tip_P - ends.b->tip_P).squaredNorm());
  const double off2_axis =
      std::max((a.axis_P - ends.a->axis_P).squaredNorm(), (b.axis_P - ends.b->axis_P).squaredNorm());
  const AxisMotion<double> axis = axis_motion(kinematics(), a, b);
  const double turn = std::abs(axis.outer) + std::abs(axis.inner);
  double left = tolerance.tip_mm - bow;
  if (tolerance.flute.length_mm > 0.0)
    left = std::min(left, tolerance.flute.off_mm - (options_.straight_tip ? 0.0 : bow) -
                              tolerance.flute.length_mm * off_for_each_mm_up(axis, std::sqrt(off2_axis)));
  const double left_axis = tolerance.axis.rad() * 2.0 / kPi - turn * turn / 8.0;
  const bool surely = predictor_is_below_truth_ && left >= 0.0 && off2 <= left * left && left_axis >= 0.0 &&
                      off2_axis <= left_axis * left_axis;
  if (surely && bow <= known_mm) return report;
  look_at(ends, tolerance);
  // The exact predictor is the curve itself: where that is proved or disproved it has nothing to add, and to
  // look for its largest value takes longer than a sharper bound.
  const bool exact = options_.predictor.kind == Predictor::Kind::exact;
  std::optional<ErrorModel> model;
  if (!exact) model.emplace(kinematics(), a, b, options_.predictor);
  const Vec3 middle_P = middle_tip(kinematics(), a, b);
  report.midpoint_mm = (exact ? Vec3(middle_P - 0.5 * (a.tip_P + b.tip_P)) : model->midpoint()).norm();
  const double bow_with_middle = report.midpoint_mm + beyond_parabola(norms.M3()) + rounding;
  const bool judged_by_itself = exact && (bow <= known_mm || bow_with_middle <= known_mm ||
                                          judge_.certifier().bow_from_cubic(a, b) <= known_mm);
  const auto predicted_mm = [&] {
    if (!model) model.emplace(kinematics(), a, b, options_.predictor);
    return model->largest_distance();
  };
  if (!judged_by_itself) report.predicted_mm = predicted_mm();
  if (surely) return report;
  // Where a prediction asks for points it does not matter what else is known; the middle alone may do so.
  const bool asks = options_.method != Method::adaptive && options_.method != Method::none;
  see_bow(middle_P);
  const bool middle_asks = asks && exact && bow_.off.tip_P.norm() > tolerance.tip_mm;
  if (!middle_asks && !(asks && report.predicted_mm > tolerance.tip_mm)) {
    const Verdict verdict =
        flute_is_beyond_half_way() ? Verdict::beyond : judge_.verdict(a, b, {off2_axis, &middle_P, {}});
    report.converged = verdict != Verdict::beyond;
    const bool may_ask = bow_with_middle > tolerance.tip_mm;
    if (judged_by_itself && may_ask && verdict == Verdict::sampled) report.predicted_mm = predicted_mm();
    const bool asked = asks && report.predicted_mm > tolerance.tip_mm;
    if ((report.converged && !asked) || options_.method == Method::none) return report;
  }
  maker_.start(*ends.a, *ends.b);
  report.converged = insert(report);
  report.inserted = static_cast<std::uint32_t>(nodes_.size());
  put_nodes(ends, out);
  return report;
}

const Station& SegmentRefiner::station_at(std::size_t i) const {
  if (i == 0) return *ends_.at_a;
  return i > nodes_.size() ? *ends_.at_b : nodes_[i - 1].station;
}

void SegmentRefiner::judge_pieces(SegmentReport& report) const {
  SegmentJudge::Largest largest;
  for (std::size_t i = 0; i <= nodes_.size(); ++i) judge_.measure(station_at(i), station_at(i + 1), largest);
  report.tip_mm = largest.tip_mm;
  report.axis = Angle::radians(largest.axis_rad);
  report.flute_mm = largest.flute_mm;
}

// Fills in what is known of the segment as programmed; true when points have to be inserted.
bool SegmentRefiner::needs_points(SegmentReport& report) {
  const ErrorModel model(kinematics(), *ends_.at_a, *ends_.at_b, options_.predictor);
  report.certified = options_.certify;
  report.predicted_mm = model.largest_distance();
  report.midpoint_mm = model.midpoint().norm();
  judge_pieces(report);
  report.programmed_mm = report.tip_mm;
  see_bow(middle_tip(kinematics(), *ends_.at_a, *ends_.at_b));
  const Tolerance& tolerance = judge_.tolerance();
  const bool bowed =
      report.tip_mm <= kWellBelow * tolerance.tip_mm || bow_.off.tip_P.norm() >= kBowShaped * report.tip_mm;
  report.harmonic_fails = ends_.turn(kinematics()) > kHarmonicTurn.rad() || !bowed;
  report.converged = report.tip_mm <= tolerance.tip_mm && report.axis <= tolerance.axis &&
                     report.flute_mm <= tolerance.flute.off_mm;
  return !report.converged || (options_.method != Method::adaptive && report.predicted_mm > tolerance.tip_mm);
}

SegmentReport SegmentRefiner::measure(const SegmentEnds& ends, const Tolerance& tolerance) {
  start(ends, tolerance);
  SegmentReport report;
  needs_points(report);
  return report;
}

SegmentReport SegmentRefiner::refine(const SegmentEnds& ends, const Tolerance& tolerance,
                                     std::vector<Point>& out) {
  start(ends, tolerance);
  SegmentReport report;
  if (!needs_points(report) || options_.method == Method::none) return report;
  report.converged = insert(report);
  judge_pieces(report);
  report.inserted = static_cast<std::uint32_t>(nodes_.size());
  put_nodes(ends, out);
  return report;
}

void SegmentRefiner::put_nodes(const SegmentEnds& ends, std::vector<Point>& out) const {
  for (const Node& node : nodes_) {
    out.push_back({node.station.q, node.tip_P, node.aim_axis_P, ends.b->where, true, node.beside_P});
  }
}

NodeAxis SegmentRefiner::choose_axis(bool axis_holds) {
  return plan_.choose_axis(axis_holds, axis_holds && pole_.lies_between(*ends_.a, *ends_.b));
}

bool SegmentRefiner::insert(SegmentReport& report) {
  if (insert_evenly()) return true;
  bool holds = judge_.axis_holds(*ends_.at_a, *ends_.at_b);
  if (options_.method == Method::subtract && holds) {
    report.linear_nodes = true;
    if (Subtraction(judge_, maker_, nodes_).insert(*ends_.at_a, *ends_.at_b)) return true;
    // The rounding of the words takes what the axis has left.
    nodes_.clear();
    holds = false;
  }
  const NodeAxis how = choose_axis(holds);
  report.linear_nodes = how == NodeAxis::joint_linear;
  if (how == NodeAxis::great_circle && !holds && insert_around_pole(kSmallTurn)) return true;
  const auto insert_as = [&](NodeAxis nodes) {
    return (both_sides() && insert_two_sided(nodes)) || insert_on_chord(nodes);
  };
  if (insert_as(how)) return true;
  if (how != NodeAxis::great_circle) return false;
  // At the pole the great circle may ask for a turn at once that is more than one piece takes.
  if (insert_around_pole(kLeastPoleTurn)) return true;
  if (!holds) return false;
  report.linear_nodes = true;
  plan_.see_ideal(NodeAxis::joint_linear);
  return insert_as(NodeAxis::joint_linear);
}

void SegmentRefiner::see_bow(const Vec3& middle_P) {
  const Vec3& a_P = ends_.at_a->tip_P;
  const Vec3& b_P = ends_.at_b->tip_P;
  const Vec3 chord = b_P - a_P;
  bow_.across = EvenPieces::bends_across((middle_P - 0.5 * (a_P + b_P)).dot(chord), chord.squaredNorm());
  bow_.off = {from_segment(middle_P, a_P, b_P), Vec3::Zero()};
  const FluteSegment* part = judge_.flute_part();
  if (part == nullptr) return;
  const Vec3 axis_P = middle_axis(kinematics(), *ends_.at_a, *ends_.at_b);
  constexpr double kMiddle = 0.5;
  const Vec3 tip_P = options_.straight_tip ? Vec3(0.5 * (a_P + b_P)) : middle_P;
  double nearest = kMiddle;
  const Reference& reference = judge_.reference();
  const ToolSegmentOf<double> segment(triple_of(reference.tip0_P), triple_of(reference.tip1_P),
                                      triple_of(reference.axis0_P), triple_of(reference.axis1_P),
                                      part->flute_mm());
  if (segment.arc().holds()) {  // as EvenRun
    const auto tip = triple_of(tip_P);
    const auto axis = triple_of(axis_P);
    nearest = segment.nearest(tip, axis);
    const ToolOffOf<double> off = segment.off(tip, axis, nearest);
    bow_.off = {vector_of(off.tip_P), vector_of(off.axis_P)};
  } else {
    nearest = part->nearest(tip_P, axis_P, kMiddle);
    bow_.off = part->off(tip_P, axis_P, nearest);
  }
  bow_.across = EvenPieces::bends_across<double>(nearest);
}

// Where the axes turn little nothing more has to be known of how a segment bends than its bow.
bool SegmentRefiner::insert_evenly() {
  if (options_.method == Method::subtract || ends_.moved || ends_.turn(kinematics()) >= kSmallTurn.rad())
    return false;
  const Tube room = plan_.tube(judge_.tolerance());
  const double bow_mm = room.size_mm(bow_.off);
  const Tolerance& tolerance = judge_.tolerance();
  const double limit_mm = judge_.flute_part() != nullptr ? tolerance.flute.off_mm : tolerance.tip_mm;
  // The fewest points: a plan tells where the tip also leads along the segment, or its axis asks for them.
  if (options_.method == Method::adaptive && !(bow_.across && bow_mm > limit_mm)) return false;
  const double wanted = even_.count(bow_mm, limit_mm, room.tip_mm);
  if (!(wanted <= kMostEvenPieces)) return false;
  const auto pieces = static_cast<std::size_t>(wanted);
  const ToolOff against = -even_.beside(pieces) * bow_.off;
  nodes_.clear();
  for (std::size_t i = 1; i < pieces; ++i)
    nodes_.push_back(maker_.node(even_.share(i, pieces), against, NodeAxis::great_circle, true));
  if (all_within()) return true;
  nodes_.clear();
  return false;
}

const Spacing& SegmentRefiner::spacing_of(const SegmentEnds& ends, const Tolerance& tolerance) {
  start(ends, tolerance);
  plan_.use_cells(choose_axis(judge_.axis_holds(*ends_.at_a, *ends_.at_b)));
  return plan_.spacing();
}

SegmentReport SegmentRefiner::span_report(const Station& programmed_a, const Station& programmed_b,
                                          const Station& a, const Station& b) {
  ends_.at_a = &programmed_a;
  ends_.at_b = &programmed_b;
  SegmentReport report;
  needs_points(report);
  ends_.at_a = &a;
  ends_.at_b = &b;
  judge_pieces(report);
  report.converged = true;
  return report;
}

bool SegmentRefiner::all_within() const {
  if (judge_.flute_part() != nullptr) {
    const auto place = [&](std::size_t i) {
      return i == 0 ? 0.0 : i > nodes_.size() ? 1.0 : nodes_[i - 1].t;
    };
    for (std::size_t i = 0; i <= nodes_.size(); ++i) {
      if (!judge_.within(station_at(i), station_at(i + 1), {place(i), place(i + 1)})) return false;
    }
    return true;
  }
  double off_before2 = (ends_.at_a->axis_P - ends_.a->axis_P).squaredNorm();
  double before_mm = judge_.off_mm(ends_.at_a->tip_P);
  for (std::size_t i = 0; i <= nodes_.size(); ++i) {
    const Station& b = station_at(i + 1);
    const Vec3& programmed = i < nodes_.size() ? nodes_[i].axis_P : ends_.b->axis_P;
    const double off2 = (b.axis_P - programmed).squaredNorm();
    const double after_mm = judge_.off_mm(b.tip_P);
    const SegmentJudge::Known known{std::max(off_before2, off2), nullptr, std::max(before_mm, after_mm)};
    if (judge_.verdict(station_at(i), b, known) == Verdict::beyond) return false;
    off_before2 = off2;
    before_mm = after_mm;
  }
  return true;
}

bool SegmentRefiner::try_pieces(std::size_t pieces, NodeAxis how, Side side) {
  plan_.place(pieces, side, places_);
  nodes_.clear();
  for (const Place& place : places_) nodes_.push_back(maker_.node(place.t, place.displacement, how, true));
  return all_within();
}

}  // namespace trunnion::path
