// How a segment bends: in cells between ideal nodes, or between those of the last attempt.
#include "path/insertion/node_plan.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "path/bounds/closed_forms.hpp"
#include "path/bounds/convex.hpp"
#include "path/insertion/even_pieces.hpp"

namespace trunnion::path {
namespace {

constexpr std::size_t kFewestCells = 4;
// Rotary step that one cell may span: sqrt of the curvature changes by a few per cent within it.
const Angle kCellTurn = Angle::degrees(3.0);
constexpr std::size_t kMostCells = 128;
// Nodes on the great circle are given up when they need so many times the points of joint-linear ones.
constexpr double kCheaper = 1.1;
// A cell of the great circle that turns so many times its share is at the pole.
constexpr double kFlip = 4.0;

}  // namespace

// The great circle, unless joint-linear nodes (which hold the axis tolerance as they are) need fewer points:
// at the pole.
NodeAxis NodePlan::choose_axis(bool axis_holds, bool passes_pole) {
  see_ideal(NodeAxis::great_circle);
  if (!axis_holds) return NodeAxis::great_circle;
  const double turn = ends_.turn(kinematics());
  const bool flips = passes_pole || largest_cell_turn_ > kFlip * turn / static_cast<double>(cells_.size());
  if (!flips && turn < kSmallTurn.rad()) return NodeAxis::great_circle;
  use_cells(NodeAxis::great_circle);
  const double on_circle = spacing_.total();
  const std::vector<Cell> circle = cells_;
  see_ideal(NodeAxis::joint_linear);
  use_cells(NodeAxis::joint_linear);
  if (flips || on_circle > kCheaper * spacing_.total()) return NodeAxis::joint_linear;
  cells_ = circle;
  return NodeAxis::great_circle;
}

// Cells of the pieces between neighbouring ideal nodes, evenly spaced.
void NodePlan::see_ideal(NodeAxis how) {
  const auto by_turn = static_cast<std::size_t>(std::ceil(ends_.turn(kinematics()) / kCellTurn.rad()));
  const std::size_t count = std::clamp(by_turn, kFewestCells, kMostCells);
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
void NodePlan::see_attempt(std::span<const Node> nodes) {
  cells_.clear();
  const std::size_t pieces = nodes.size() + 1;
  const std::size_t parts = (kFewestCells + pieces - 1) / pieces;
  for (std::size_t i = 0; i < pieces; ++i) {
    const Station& a = i == 0 ? *ends_.at_a : nodes[i - 1].station;
    const Station& b = i == nodes.size() ? *ends_.at_b : nodes[i].station;
    const double t0 = i == 0 ? 0.0 : nodes[i - 1].t;
    const double t1 = i == nodes.size() ? 1.0 : nodes[i].t;
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

void NodePlan::add_cell(const Station& a, const Station& b, double t0, double t1) {
  const RotarySines middle = middle_sines(kinematics(), a, b);
  if (judge_.flute_part() != nullptr) {
    const Vec3 tip_P = judge_.options().straight_tip
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
ToolOff NodePlan::flute_bow(const Station& a, const Station& b, double t0, double t1,
                            const ToolPose& middle) {
  const FluteSegment& part = *judge_.flute_part();
  const double even = 0.5 * (t0 + t1);
  const ToolOff ends = 0.5 * (part.off(a.tip_P, a.axis_P, t0) + part.off(b.tip_P, b.axis_P, t1));
  const Vec3 tip_P = middle.tip_P - ends.tip_P;
  const Vec3 axis_P = middle.axis_P - ends.axis_P;
  const double t = part.nearest(tip_P, axis_P, even);
  ToolOff bow = part.off(tip_P, axis_P, t);
  const double ahead = t - even;
  const double room = ahead > 0.0 ? 1.0 - even : even;
  const Tube left = tube(judge_.tolerance());
  if (4.0 * std::abs(ahead) < t1 - t0 || std::abs(ahead) * left.tip_mm <= room * left.size_mm(bow))
    return bow;
  crowded_ = true;
  return part.off(tip_P, axis_P, even);
}

// A bow without its part along the programmed segment, where that leads nowhere beyond the segment's ends: of
// a piece that bows by one tolerance across it, the middle of which is the fraction `t` of the way.
Vec3 NodePlan::within_reference(const Vec3& bow, double t) {
  const Vec3 whole = judge_.reference().tip1_P - judge_.reference().tip0_P;
  const double length = whole.norm();
  if (!(length > 0.0)) return bow;
  const double along = bow.dot(whole) / length;
  Vec3 across = bow - (along / length) * whole;
  const double room = (along > 0.0 ? 1.0 - t : t) * length;
  if (std::abs(along) * tube(judge_.tolerance()).tip_mm <= room * across.norm()) return across;
  crowded_ = true;
  return bow;
}

// A displacement of the node at `t` that leaves its foot well between the ends: beyond one of them the
// control would come to the end and go back.
ToolOff NodePlan::between_ends(const ToolOff& displacement, double t) const {
  constexpr double kShare = 0.5;  // of the way to the end
  const Vec3 whole = judge_.reference().tip1_P - judge_.reference().tip0_P;
  const double length2 = whole.squaredNorm();
  if (!(length2 > 0.0)) return displacement;
  const double along = displacement.tip_P.dot(whole) / length2;
  const Vec3 back = (std::clamp(along, -kShare * t, kShare * (1.0 - t)) - along) * whole;
  return {displacement.tip_P + back, displacement.axis_P};
}

void NodePlan::use_cells(NodeAxis how) {
  const Tube room = tube(judge_.tolerance());
  spacing_.set(cells_, room, judge_.tolerance().axis.rad(),
               how == NodeAxis::great_circle && judge_.flute_part() == nullptr);
  if (!ends_.moved) return;
  const auto displaced = [&](const Station& at, const Point& p, double t) {
    const ToolOff off{at.tip_P - p.tip_P, at.axis_P - p.axis_P};
    return std::clamp(room.along(off, spacing_.against(t)) / room.tip_mm, -1.0, 1.0);
  };
  displaced_ = {displaced(*ends_.at_a, *ends_.a, 0.0), displaced(*ends_.at_b, *ends_.b, 1.0)};
}

std::vector<Cell> NodePlan::exchange_cells(std::vector<Cell> cells) {
  return std::exchange(cells_, std::move(cells));
}

void NodePlan::place(std::size_t pieces, Side side, std::vector<Place>& out) const {
  if (side == Side::on_chord) {
    spacing_.place_on_chord(pieces, out);
  } else {
    spacing_.place_two_sided(pieces, displaced_[0], displaced_[1], out);
  }
  for (Place& place : out) place.displacement = between_ends(place.displacement, place.t);
}

ToolOff NodePlan::displacement(double t, Side side, double edge) const {
  if (side == Side::on_chord) return {};
  return between_ends(edge * tube(judge_.tolerance()).tip_mm * spacing_.against(t), t);
}

}  // namespace trunnion::path
