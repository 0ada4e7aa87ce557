#include "path/insertion/segment_refiner.hpp"

#include <algorithm>
#include <cmath>

#include "path/bounds/closed_forms.hpp"
#include "path/bounds/convex.hpp"
#include "path/bounds/tool_segment.hpp"
#include "path/insertion/even_pieces.hpp"

namespace trunnion::path {
namespace {

// Of the tolerance: farther off than any search for the nearest place ends beside it.
constexpr double kSurelyBeyond = 1.01;
// Rotary step that one cell may span: sqrt of the curvature changes by a few per cent within it.
const Angle kCellTurn = Angle::degrees(3.0);
constexpr std::size_t kMostCells = 128;
// Nodes on the great circle are given up when they need so many times the points of joint-linear ones.
constexpr double kCheaper = 1.1;
// A cell of the great circle that turns so many times its share is at the pole.
constexpr double kFlip = 4.0;
// A bound this far below the tolerance is reported as the cheap form gives it.
constexpr double kWellBelow = 0.25;
// Interior samples of a piece when proof was declined.
constexpr int kSamples = 9;
// Harmonic functions describe the error up to here (README, "Predictors").
const Angle kHarmonicTurn = Angle::degrees(60.0);
// Share of the largest error that the middle of a bow has at least; less is S-shaped.
constexpr double kBowShaped = 0.9;

}  // namespace

SegmentRefiner::SegmentRefiner(const Machine& machine, const Vec3& tool_mm, const Rounding& rounding,
                               const NonlinearOptions& options)
    : machine_(machine),
      rounding_(rounding),
      options_(options),
      certifier_(TableKinematics(machine, tool_mm)),
      maker_(machine_, certifier_.kinematics(), rounding_),
      even_(both_sides()),
      word_error_{rounding.tip_error_mm(machine), rounding.axis_error_rad(machine)},
      predictor_is_below_truth_(options.predictor.kind == Predictor::Kind::exact ||
                                options.predictor.middle_is_largest()) {}

void SegmentRefiner::start(const SegmentEnds& ends, const Tolerance& tolerance) {
  look_at(ends, tolerance);
  maker_.start(*ends.a, *ends.b);
}

void SegmentRefiner::look_at(const SegmentEnds& ends, const Tolerance& tolerance) {
  ends_ = ends;
  tolerance_ = tolerance;
  reference_ = {ends.a->tip_P, ends.b->tip_P, ends.a->axis_P, ends.b->axis_P};
  flute_.reset();
  if (tolerance.flute.length_mm > 0.0) {
    const FluteSegment whole(reference_, tolerance.flute.length_mm);
    flute_ = Flute{whole, whole};
  }
  nodes_.clear();
  displaced_ = {};
}

// Rotary axes that run straight keep the tool axis where it has to be.
bool SegmentRefiner::axis_holds() const {
  constexpr double kShareOfFlute = 0.25;  // of the tolerance, at the end of the flute
  const Angle limit =
      flute_ ? std::min(tolerance_.axis, tolerance_.axis_room() * kShareOfFlute) : tolerance_.axis;
  return certifier_.axis_within(*ends_.at_a, *ends_.at_b, reference_, limit) == Within::yes;
}

double SegmentRefiner::largest_turn() const {
  double turn = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    turn =
        std::max(turn, std::abs(kinematics().angle(ends_.at_b->q, k) - kinematics().angle(ends_.at_a->q, k)));
  }
  return turn;
}

SegmentRefiner::Verdict SegmentRefiner::piece_verdict(const Station& a, const Station& b, double off_axis2,
                                                      const Vec3* known_middle_P,
                                                      std::optional<double> ends_mm) const {
  if (flute_) return flute_verdict(a, b, {0.0, 1.0});
  if (options_.certify) {
    return certifier_.tip_within(a, b, reference_, tolerance_.tip_mm) == Within::yes &&
                   certifier_.axis_within(a, b, reference_, tolerance_.axis) == Within::yes
               ? Verdict::proved
               : Verdict::beyond;
  }
  // Sampled, where the cheap proofs and the middle do not answer.
  if (!ends_mm) ends_mm = std::max(off_mm(a.tip_P), off_mm(b.tip_P));
  const Verdict tip = tip_verdict(a, b, known_middle_P, *ends_mm);
  if (tip == Verdict::beyond) return tip;
  if (tip == Verdict::proved && (axis_surely_within(a, b, off_axis2) ||
                                 certifier_.axis_within(a, b, reference_, tolerance_.axis) == Within::yes))
    return tip;
  Largest largest;
  judge(a, b, largest);
  return largest.tip_mm <= tolerance_.tip_mm && largest.axis_rad <= tolerance_.axis.rad() ? Verdict::sampled
                                                                                          : Verdict::beyond;
}

// Of the whole segment: its bow was seen.
bool SegmentRefiner::flute_is_beyond_half_way() const {
  if (!flute_) return false;
  const double flute_mm = tolerance_.flute.length_mm;
  return bow_.off.largest_mm(flute_mm) > kSurelyBeyond * tolerance_.flute.off_mm;
}

// A proof for the flute is one for its tip; sampled it would not be any cheaper.
SegmentRefiner::Verdict SegmentRefiner::flute_verdict(const Station& a, const Station& b,
                                                      const FluteCertifier::Places& about) const {
  const bool keeps =
      flute_surely_within(a, b) ||
      (flute_certifier().within(a, b, flute_->whole, tolerance_.flute.off_mm, about) == Within::yes &&
       certifier_.axis_within(a, b, reference_, tolerance_.axis) == Within::yes);
  return keeps ? Verdict::proved : Verdict::beyond;
}

// `sampled`: samples have to tell.
SegmentRefiner::Verdict SegmentRefiner::tip_verdict(const Station& a, const Station& b,
                                                    const Vec3* known_middle_P, double ends) const {
  if (ends > tolerance_.tip_mm) return Verdict::beyond;
  const NormsOf<double> norms = piece_norms(kinematics(), a, b);
  const double left_mm = tolerance_.tip_mm - ends - tip_rounding(kinematics(), a, b);
  if (norms.M2() / 8.0 <= left_mm) return Verdict::proved;
  const Vec3 middle_P = known_middle_P != nullptr ? *known_middle_P : middle_tip(kinematics(), a, b);
  if (off_mm(middle_P) > tolerance_.tip_mm) return Verdict::beyond;
  const Vec3 bow = middle_P - 0.5 * (a.tip_P + b.tip_P);
  const double beyond = beyond_parabola(norms.M3());
  if (bow.norm() + beyond <= left_mm) return Verdict::proved;
  // Rounded ends stand off where the bow is not at its largest, and what leads along the segment is no error;
  // nor is it from the straight course of the ends, which is what a prediction is held against.
  const double room_mm = left_mm + ends;
  const Reference straight = {a.tip_P, b.tip_P, a.axis_P, b.axis_P};
  const double parabola_mm = std::max(ParabolaForm(reference_, a, b, middle_P).largest(),
                                      ParabolaForm(straight, a, b, middle_P).largest());
  if (parabola_mm + beyond <= room_mm) return Verdict::proved;
  if (parabola_mm <= room_mm &&
      parabola_mm + beyond_parabola(expand(tip_curve(kinematics(), a, b))) <= room_mm)
    return Verdict::proved;
  return ends + certifier_.bow_from_cubic(a, b) <= tolerance_.tip_mm ? Verdict::proved : Verdict::sampled;
}

// A unit vector turned about two axes bends by at most (|dA| + |dC|)^2 / 8 off its chord; a chord is no
// longer than pi/2 times the sine of its angle up to a right angle.
bool SegmentRefiner::axis_surely_within(const Station& a, const Station& b, double off_axis2) const {
  double turn = 0.0;
  for (std::size_t k = 0; k < 2; ++k)
    turn += std::abs(kinematics().angle(b.q, k) - kinematics().angle(a.q, k));
  const double bow = turn * turn / 8.0;
  const double limit = tolerance_.axis.rad() * 2.0 / kPi;  // below its sine
  if (bow > limit) return false;
  if (off_axis2 <= (limit - bow) * (limit - bow)) return true;
  const ArcShape arc(reference_.axis0_P, reference_.axis1_P);
  return std::max(ArcShape::distance(arc.foot(a.axis_P)), ArcShape::distance(arc.foot(b.axis_P))) + bow <=
         limit;
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
  double turn = 0.0;
  for (std::size_t k = 0; k < 2; ++k)
    turn += std::abs(kinematics().angle(b.q, k) - kinematics().angle(a.q, k));
  double left = tolerance.tip_mm - bow;
  if (tolerance.flute.length_mm > 0.0)
    left = std::min(left, tolerance.flute.off_mm - (options_.straight_tip ? 0.0 : bow) -
                              tolerance.flute.length_mm * off_for_each_mm_up(turn, std::sqrt(off2_axis)));
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
                                          certifier_.bow_from_cubic(a, b) <= known_mm);
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
        flute_is_beyond_half_way() ? Verdict::beyond : piece_verdict(a, b, off2_axis, &middle_P);
    report.converged = verdict != Verdict::beyond;
    if (judged_by_itself && verdict == Verdict::sampled) report.predicted_mm = predicted_mm();
    const bool asked = asks && report.predicted_mm > tolerance.tip_mm;
    if ((report.converged && !asked) || options_.method == Method::none) return report;
  }
  maker_.start(*ends.a, *ends.b);
  report.converged = insert(report);
  report.inserted = static_cast<std::uint32_t>(nodes_.size());
  put_nodes(ends, out);
  return report;
}

// Ends as they stand and motion in norms: what is far below the tolerance needs no more.
bool SegmentRefiner::flute_surely_within(const Station& a, const Station& b) const {
  const double off2 =
      std::max((a.tip_P - reference_.tip0_P).squaredNorm(), (b.tip_P - reference_.tip1_P).squaredNorm());
  const double limit_mm = tolerance_.flute.off_mm;
  if (off2 > limit_mm * limit_mm) return false;
  const double off2_axis =
      std::max((a.axis_P - reference_.axis0_P).squaredNorm(), (b.axis_P - reference_.axis1_P).squaredNorm());
  double turn = 0.0;
  for (std::size_t k = 0; k < 2; ++k)
    turn += std::abs(kinematics().angle(b.q, k) - kinematics().angle(a.q, k));
  const double off_axis = std::sqrt(off2_axis);
  const double off_mm = std::sqrt(off2) + (options_.straight_tip ? 0.0 : certifier_.bow_from_norms(a, b)) +
                        tolerance_.flute.length_mm * off_for_each_mm_up(turn, off_axis);
  return off_mm <= limit_mm && off_axis + turn * turn / 8.0 <= tolerance_.axis.rad() * 2.0 / kPi;
}

void SegmentRefiner::judge(const Station& a, const Station& b, Largest& largest) const {
  const SegmentShape segment(reference_.tip0_P, reference_.tip1_P);
  const ArcShape arc(reference_.axis0_P, reference_.axis1_P);
  const auto tip_of = [&](const Vec3& p) { return SegmentShape::distance(segment.foot(p)); };
  const auto axis_of = [&](const Vec3& u) { return ArcShape::measure(ArcShape::distance(arc.foot(u))); };
  double tip = std::max(tip_of(a.tip_P), tip_of(b.tip_P));
  double axis = std::max(axis_of(a.axis_P), axis_of(b.axis_P));
  if (!options_.certify) {
    for (int i = 1; i <= kSamples; ++i) {
      const JointVector q = JointVector::interpolate(a.q, b.q, static_cast<double>(i) / (kSamples + 1));
      const ToolPose pose = kinematics().pose(q);
      tip = std::max(tip, tip_of(pose.tip_P));
      axis = std::max(axis, axis_of(pose.axis_P));
    }
  } else {
    tip += certifier_.bow_from_norms(a, b);
    if (tip > kWellBelow * tolerance_.tip_mm) tip = certifier_.tip(a, b, reference_).upper;
    // The bound is within 5 % of the truth; in between the decision is the sharper proof.
    if (tip > tolerance_.tip_mm && certifier_.tip_within(a, b, reference_, tolerance_.tip_mm) == Within::yes)
      tip = tolerance_.tip_mm;
    double turn = 0.0;
    for (std::size_t k = 0; k < 2; ++k)
      turn += std::abs(kinematics().angle(b.q, k) - kinematics().angle(a.q, k));
    // sin x >= 2x/pi up to a right angle.
    axis += 0.5 * kPi * turn * turn / 8.0;
    if (axis > kWellBelow * tolerance_.axis.rad()) axis = certifier_.axis(a, b, reference_).upper;
    if (axis > tolerance_.axis.rad() &&
        certifier_.axis_within(a, b, reference_, tolerance_.axis) == Within::yes)
      axis = tolerance_.axis.rad();
  }
  largest.tip_mm = std::max(largest.tip_mm, tip);
  largest.axis_rad = std::max(largest.axis_rad, axis);
  if (!flute_) return;
  double flute_mm = flute_certifier().deviation(a, b, flute_->whole).upper;
  // As above.
  const double limit_mm = tolerance_.flute.off_mm;
  if (flute_mm > limit_mm && flute_certifier().within(a, b, flute_->whole, limit_mm) == Within::yes)
    flute_mm = limit_mm;
  largest.flute_mm = std::max(largest.flute_mm, flute_mm);
}

const Station& SegmentRefiner::station_at(std::size_t i) const {
  if (i == 0) return *ends_.at_a;
  return i > nodes_.size() ? *ends_.at_b : nodes_[i - 1].station;
}

void SegmentRefiner::judge_pieces(SegmentReport& report) const {
  Largest largest;
  for (std::size_t i = 0; i <= nodes_.size(); ++i) judge(station_at(i), station_at(i + 1), largest);
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
  const bool bowed =
      report.tip_mm <= kWellBelow * tolerance_.tip_mm || bow_.off.tip_P.norm() >= kBowShaped * report.tip_mm;
  report.harmonic_fails = largest_turn() > kHarmonicTurn.rad() || !bowed;
  report.converged = report.tip_mm <= tolerance_.tip_mm && report.axis <= tolerance_.axis &&
                     report.flute_mm <= tolerance_.flute.off_mm;
  return !report.converged ||
         (options_.method != Method::adaptive && report.predicted_mm > tolerance_.tip_mm);
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

bool SegmentRefiner::insert(SegmentReport& report) {
  if (insert_evenly()) return true;
  bool holds = axis_holds();
  if (options_.method == Method::subtract && holds) {
    report.linear_nodes = true;
    if (subtract(*ends_.at_a, *ends_.at_b, 0.0, 1.0, 0)) return true;
    // The rounding of the words takes what the axis has left.
    nodes_.clear();
    holds = false;
  }
  const NodeAxis how = choose_axis(holds);
  report.linear_nodes = how == NodeAxis::joint_linear;
  if (how == NodeAxis::great_circle && !holds && insert_around_pole()) return true;
  return (both_sides() && insert_two_sided(how)) || insert_on_chord(how);
}

void SegmentRefiner::see_bow(const Vec3& middle_P) {
  const Vec3& a_P = ends_.at_a->tip_P;
  const Vec3& b_P = ends_.at_b->tip_P;
  const Vec3 chord = b_P - a_P;
  bow_.across = EvenPieces::bends_across((middle_P - 0.5 * (a_P + b_P)).dot(chord), chord.squaredNorm());
  bow_.off = {from_segment(middle_P, a_P, b_P), Vec3::Zero()};
  if (!flute_) return;
  const Vec3 axis_P = middle_axis(kinematics(), *ends_.at_a, *ends_.at_b);
  constexpr double kMiddle = 0.5;
  const Vec3 tip_P = options_.straight_tip ? Vec3(0.5 * (a_P + b_P)) : middle_P;
  double nearest = kMiddle;
  const ToolSegmentOf<double> segment(triple_of(reference_.tip0_P), triple_of(reference_.tip1_P),
                                      triple_of(reference_.axis0_P), triple_of(reference_.axis1_P),
                                      flute_->part.flute_mm());
  if (segment.arc().holds()) {  // as EvenRun
    const auto tip = triple_of(tip_P);
    const auto axis = triple_of(axis_P);
    nearest = segment.nearest(tip, axis);
    const ToolOffOf<double> off = segment.off(tip, axis, nearest);
    bow_.off = {vector_of(off.tip_P), vector_of(off.axis_P)};
  } else {
    nearest = flute_->part.nearest(tip_P, axis_P, kMiddle);
    bow_.off = flute_->part.off(tip_P, axis_P, nearest);
  }
  bow_.across = EvenPieces::bends_across<double>(nearest);
}

// Where the axes turn little nothing more has to be known of how a segment bends than its bow.
bool SegmentRefiner::insert_evenly() {
  if (options_.method == Method::subtract || ends_.moved || largest_turn() >= kSmallTurn.rad()) return false;
  const Tube room = tube(tolerance_);
  const double bow_mm = room.size_mm(bow_.off);
  const double limit_mm = flute_ ? tolerance_.flute.off_mm : tolerance_.tip_mm;
  // The fewest points: a plan tells where the tip also leads along the segment, or its axis asks for them.
  if (options_.method == Method::adaptive && !(bow_.across && bow_mm > limit_mm)) return false;
  const double wanted = even_.count(bow_mm, limit_mm, room.tip_mm);
  if (!(wanted <= kMostEvenPieces) || wanted - 1.0 > static_cast<double>(options_.max_inserted)) return false;
  const auto pieces = static_cast<std::size_t>(wanted);
  const ToolOff against = -even_.beside(pieces) * bow_.off;
  nodes_.clear();
  for (std::size_t i = 1; i < pieces; ++i)
    nodes_.push_back(maker_.node(even_.share(i, pieces), against, NodeAxis::great_circle, true));
  if (all_within()) return true;
  nodes_.clear();
  return false;
}

// The great circle, unless joint-linear nodes (which hold the axis tolerance as they are) need fewer points:
// at the pole.
NodeAxis SegmentRefiner::choose_axis(bool axis_holds) {
  cells_along(NodeAxis::great_circle, kFewestCells);
  if (!axis_holds) return NodeAxis::great_circle;
  const bool flips =
      passes_pole() || largest_cell_turn_ > kFlip * largest_turn() / static_cast<double>(cells_.size());
  if (!flips && largest_turn() < kSmallTurn.rad()) return NodeAxis::great_circle;
  use_cells(NodeAxis::great_circle);
  const double on_circle = spacing_.total();
  const std::vector<Cell> circle = cells_;
  cells_along(NodeAxis::joint_linear, kFewestCells);
  use_cells(NodeAxis::joint_linear);
  if (flips || on_circle > kCheaper * spacing_.total()) return NodeAxis::joint_linear;
  cells_ = circle;
  return NodeAxis::great_circle;
}

// Cells of the pieces between neighbouring ideal nodes, evenly spaced.
void SegmentRefiner::cells_along(NodeAxis how, std::size_t least) {
  const auto by_turn = static_cast<std::size_t>(std::ceil(largest_turn() / kCellTurn.rad()));
  const std::size_t count = std::clamp(by_turn, least, kMostCells);
  cells_.clear();
  crowded_ = false;
  largest_cell_turn_ = 0.0;
  Station before = maker_.node(0.0, {}, NodeAxis::joint_linear, false).station;
  for (std::size_t i = 1; i <= count; ++i) {
    const double t1 = static_cast<double>(i) / static_cast<double>(count);
    const NodeAxis kind = i == count ? NodeAxis::joint_linear : how;
    const Station after = maker_.node(t1, {}, kind, false).station;
    add_cell(before, after, static_cast<double>(i - 1) / static_cast<double>(count), t1);
    for (std::size_t k = 0; k < 2; ++k) {
      const double turn = kinematics().angle(after.q, k) - kinematics().angle(before.q, k);
      largest_cell_turn_ = std::max(largest_cell_turn_, std::abs(turn));
    }
    before = after;
  }
}

// Cells of the pieces as they came out of the last attempt.
void SegmentRefiner::cells_of_nodes(std::size_t least) {
  cells_.clear();
  const std::size_t pieces = nodes_.size() + 1;
  const std::size_t parts = (least + pieces - 1) / pieces;
  for (std::size_t i = 0; i < pieces; ++i) {
    const Station& a = station_at(i);
    const Station& b = station_at(i + 1);
    const double t0 = i == 0 ? 0.0 : nodes_[i - 1].t;
    const double t1 = i == nodes_.size() ? 1.0 : nodes_[i].t;
    Station before = a;
    for (std::size_t k = 1; k <= parts; ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(parts);
      const Station after = k == parts ? b : station(kinematics(), JointVector::interpolate(a.q, b.q, share));
      const double from = t0 + (t1 - t0) * static_cast<double>(k - 1) / static_cast<double>(parts);
      add_cell(before, after, from, t0 + (t1 - t0) * share);
      before = after;
    }
  }
}

void SegmentRefiner::add_cell(const Station& a, const Station& b, double t0, double t1) {
  const RotarySines middle = middle_sines(kinematics(), a, b);
  if (flute_) {
    const Vec3 tip_P = options_.straight_tip
                           ? Vec3(0.5 * (a.tip_P + b.tip_P))
                           : kinematics().tip_P(JointVector::interpolate(a.q, b.q, 0.5), middle);
    cells_.push_back({t0, t1, flute_bow(a, b, t0, t1, {tip_P, kinematics().axis_P(middle)}), 0.0});
    return;
  }
  const Vec3 chord = b.tip_P - a.tip_P;
  const double length = chord.norm();
  Vec3 bow = kinematics().tip_P(JointVector::interpolate(a.q, b.q, 0.5), middle) - 0.5 * (a.tip_P + b.tip_P);
  const double along = length > 0.0 ? bow.dot(chord) / length : 0.0;
  // While the foot stays on the chord, motion along it is no error.
  if (4.0 * std::abs(along) < length) {
    bow -= (along / length) * chord;
  } else {
    bow = within_reference(bow, 0.5 * (t0 + t1));
  }
  const ArcShape arc(a.axis_P, b.axis_P);
  const double axis = ArcShape::measure(ArcShape::distance(arc.foot(kinematics().axis_P(middle))));
  cells_.push_back({t0, t1, {bow, Vec3::Zero()}, axis});
}

// What the tool leaves the course between its ends by half way, from the place of the path where that is
// least: to be ahead of the path or behind it is no error, unless that leads beyond an end of the segment.
ToolOff SegmentRefiner::flute_bow(const Station& a, const Station& b, double t0, double t1,
                                  const ToolPose& middle) {
  const double even = 0.5 * (t0 + t1);
  const ToolOff ends =
      0.5 * (flute_->part.off(a.tip_P, a.axis_P, t0) + flute_->part.off(b.tip_P, b.axis_P, t1));
  const Vec3 tip_P = middle.tip_P - ends.tip_P;
  const Vec3 axis_P = middle.axis_P - ends.axis_P;
  const double t = flute_->part.nearest(tip_P, axis_P, even);
  ToolOff bow = flute_->part.off(tip_P, axis_P, t);
  const double ahead = t - even;
  const double room = ahead > 0.0 ? 1.0 - even : even;
  const Tube left = tube(tolerance_);
  if (4.0 * std::abs(ahead) < t1 - t0 || std::abs(ahead) * left.tip_mm <= room * left.size_mm(bow))
    return bow;
  crowded_ = true;
  return flute_->part.off(tip_P, axis_P, even);
}

// A bow without its part along the programmed segment, where that leads nowhere beyond the segment's ends: of
// a piece that bows by one tolerance across it, the middle of which is the fraction `t` of the way.
Vec3 SegmentRefiner::within_reference(const Vec3& bow, double t) {
  const Vec3 whole = reference_.tip1_P - reference_.tip0_P;
  const double length = whole.norm();
  if (!(length > 0.0)) return bow;
  const double along = bow.dot(whole) / length;
  Vec3 across = bow - (along / length) * whole;
  const double room = (along > 0.0 ? 1.0 - t : t) * length;
  if (std::abs(along) * tube(tolerance_).tip_mm <= room * across.norm()) return across;
  crowded_ = true;
  return bow;
}

// A displacement of the node at `t` that leaves its foot well between the ends: beyond one of them the
// control would come to the end and go back.
ToolOff SegmentRefiner::between_ends(const ToolOff& displacement, double t) const {
  constexpr double kShare = 0.5;  // of the way to the end
  const Vec3 whole = reference_.tip1_P - reference_.tip0_P;
  const double length2 = whole.squaredNorm();
  if (!(length2 > 0.0)) return displacement;
  const double along = displacement.tip_P.dot(whole) / length2;
  const Vec3 back = (std::clamp(along, -kShare * t, kShare * (1.0 - t)) - along) * whole;
  return {displacement.tip_P + back, displacement.axis_P};
}

void SegmentRefiner::use_cells(NodeAxis how) {
  const Tube room = tube(tolerance_);
  spacing_.set(cells_, room, tolerance_.axis.rad(), how == NodeAxis::great_circle && !flute_);
  if (!ends_.moved) return;
  const auto displaced = [&](const Station& at, const Point& p, double t) {
    const ToolOff off{at.tip_P - p.tip_P, at.axis_P - p.axis_P};
    return std::clamp(room.along(off, spacing_.against(t)) / room.tip_mm, -1.0, 1.0);
  };
  displaced_ = {displaced(*ends_.at_a, *ends_.a, 0.0), displaced(*ends_.at_b, *ends_.b, 1.0)};
}

Tube SegmentRefiner::tube(const Tolerance& tolerance) const {
  return Tube::within(tolerance, word_error_.tip_mm, word_error_.axis_rad);
}

const Spacing& SegmentRefiner::spacing_of(const SegmentEnds& ends, const Tolerance& tolerance) {
  start(ends, tolerance);
  use_cells(choose_axis(axis_holds()));
  return spacing_;
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
  if (flute_) {
    const auto place = [&](std::size_t i) {
      return i == 0 ? 0.0 : i > nodes_.size() ? 1.0 : nodes_[i - 1].t;
    };
    for (std::size_t i = 0; i <= nodes_.size(); ++i) {
      if (!piece_within(station_at(i), station_at(i + 1), {place(i), place(i + 1)})) return false;
    }
    return true;
  }
  double off_before2 = (ends_.at_a->axis_P - ends_.a->axis_P).squaredNorm();
  double before_mm = off_mm(ends_.at_a->tip_P);
  for (std::size_t i = 0; i <= nodes_.size(); ++i) {
    const Station& b = station_at(i + 1);
    const Vec3& programmed = i < nodes_.size() ? nodes_[i].axis_P : ends_.b->axis_P;
    const double off2 = (b.axis_P - programmed).squaredNorm();
    const double after_mm = off_mm(b.tip_P);
    if (piece_verdict(station_at(i), b, std::max(off_before2, off2), nullptr,
                      std::max(before_mm, after_mm)) == Verdict::beyond)
      return false;
    off_before2 = off2;
    before_mm = after_mm;
  }
  return true;
}

bool SegmentRefiner::try_pieces(std::size_t pieces, NodeAxis how, Side side) {
  if (side == Side::on_chord) {
    spacing_.place_on_chord(pieces, places_);
  } else {
    spacing_.place_two_sided(pieces, displaced_[0], displaced_[1], places_);
  }
  nodes_.clear();
  for (const Place& place : places_)
    nodes_.push_back(maker_.node(place.t, between_ends(place.displacement, place.t), how, true));
  return all_within();
}

}  // namespace trunnion::path
