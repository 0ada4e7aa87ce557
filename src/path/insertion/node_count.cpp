// How many points a segment gets: the count that the integral asks for, or what the longest steps need.
#include <algorithm>
#include <cmath>
#include <utility>

#include "path/insertion/even_pieces.hpp"
#include "path/insertion/segment_refiner.hpp"

namespace trunnion::path {
namespace {

// Plans anew from the pieces of the last attempt before the count is given up.
constexpr int kRefits = 2;
// Attempts, each with more pieces, before a segment is left unconverged.
constexpr int kAttempts = 40;
// So many times the pieces that the integral asks for, and still not within: more will not help.
constexpr std::size_t kHopeless = 8;
// A step is the longest one but for this share of it: 50 of them lose a fortieth of a piece.
constexpr double kStepShare = 1e-3;
// Nodes stand so much of the tube beside the chord: at its very edge rounding decides.
constexpr double kEdge = 0.9995;
// Steps grow and shrink by this until the longest one lies between two of them.
constexpr double kStepRatio = 1.25;
// Tilt of a tool axis that stands at the pole, of the axis tolerance: turning the inner axis moves it by
// twice that at most.
constexpr double kPoleShare = 0.25;
// Below this share of the segment no step helps: the ends of the step are too far apart in themselves.
constexpr double kShortestStep = 1e-9;

}  // namespace

// One count, planned from the cells, then anew from what the attempt came to.
bool SegmentRefiner::insert_planned(NodeAxis how, Side side, std::size_t pieces) {
  for (int fit = 0; fit <= kRefits; ++fit) {
    if (try_pieces(pieces, how, side)) return true;
    cells_of_nodes(kFewestCells);
    use_cells(how);
  }
  return false;
}

// `least` to `most` pieces. Where the plan does not hold, or asks for more than is needed, the longest steps
// decide.
bool SegmentRefiner::insert_nodes(NodeAxis how, Side side, std::size_t least, std::size_t most) {
  std::size_t pieces = std::max<std::size_t>(2, least);
  if (pieces > most) return false;
  const std::vector<Cell> planned = cells_;
  if (crowded_ && insert_longest_steps(how, side, pieces)) return true;
  if (insert_planned(how, side, pieces)) return true;
  const std::vector<Cell> found = std::exchange(cells_, planned);
  use_cells(how);
  if (insert_longest_steps(how, side, most)) return true;
  cells_ = found;
  use_cells(how);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    // One more while that is likely to do; faster where the plan is far off.
    const std::size_t asked = side == Side::on_chord
                                  ? spacing_.on_chord_pieces()
                                  : spacing_.two_sided_pieces(displaced_[0], displaced_[1]);
    const std::size_t step = 1 + (attempt < 3 ? 0 : pieces / 4);
    pieces = std::max(pieces + step, std::min(asked, 2 * pieces));
    if (pieces > most) return false;
    if (insert_planned(how, side, pieces)) return true;
  }
  return false;
}

// From node to node as far as a piece keeps within the tolerance: no placement on the chord with the same
// kind of nodes has fewer points. Two-sided nodes stand at the edge of the tube.
bool SegmentRefiner::insert_longest_steps(NodeAxis how, Side side, std::size_t most) {
  nodes_.clear();
  Station at = *ends_.at_a;
  double t = 0.0;
  double step = 1.0 / static_cast<double>(most);
  while (!piece_within(at, *ends_.at_b, {t, 1.0})) {
    if (nodes_.size() + 1 >= most) return false;
    const auto node = longest_step(at, t, step, how, side);
    if (!node) return false;
    step = node->t - t;
    t = node->t;
    at = node->station;
    nodes_.push_back(*node);
  }
  return true;
}

std::optional<Node> SegmentRefiner::longest_step(const Station& at, double t, double first, NodeAxis how,
                                                 Side side) const {
  const double beside = kEdge * tube(tolerance_).tip_mm;
  std::optional<Node> good;
  double bad = 1.0;
  const auto holds = [&](double to) {
    const ToolOff displacement =
        side == Side::on_chord ? ToolOff{} : between_ends(beside * spacing_.against(to), to);
    Node node = maker_.node(to, displacement, how, true);
    if (!piece_within(at, node.station, {t, to})) {
      bad = to;
      return false;
    }
    good = node;
    return true;
  };
  double step = first;
  if (t + step < bad && holds(t + step)) {
    while (t + kStepRatio * step < bad && holds(t + kStepRatio * step)) step *= kStepRatio;
  } else {
    do {
      step /= kStepRatio;
    } while (step > kShortestStep && !holds(t + step));
  }
  while (good && bad - good->t > kStepShare * (good->t - t)) holds(0.5 * (good->t + bad));
  return good;
}

bool SegmentRefiner::insert_two_sided(NodeAxis how) {
  use_cells(how);
  if (!spacing_.tip_leads()) return false;
  const std::vector<Cell> planned = cells_;
  const bool crowded = crowded_;
  const std::size_t on_chord = spacing_.on_chord_pieces();
  const bool found =
      insert_nodes(how, Side::two_sided, spacing_.two_sided_pieces(displaced_[0], displaced_[1]),
                   std::max<std::size_t>(2, on_chord));
  cells_ = planned;
  if (!found || !crowded) return found;
  // The cells do not tell which of the two is better.
  const std::vector<Node> both_sides = nodes_;
  if (!insert_longest_steps(how, Side::on_chord, both_sides.size())) nodes_ = both_sides;
  return true;
}

bool SegmentRefiner::insert_on_chord(NodeAxis how) {
  use_cells(how);
  const std::size_t least = std::max<std::size_t>(2, spacing_.on_chord_pieces());
  return insert_nodes(how, Side::on_chord, least, std::min(options_.max_inserted + 1, kHopeless * least));
}

// Where a segment leaves the pole, or comes to it, the inner axis has to stand as the great circle wants it
// there, whatever the point says: at the pole it turns about the tool axis.
std::optional<Point> SegmentRefiner::turned_at_pole(const Point& end, const Station& at,
                                                    const Point& other) const {
  if (kinematics().rotary_count() < 2) return std::nullopt;
  const Vec3& n = kinematics().direction(1);
  if (at.axis_P.cross(n).norm() > kPoleShare * tolerance_.axis_room().rad()) return std::nullopt;
  Point turned = end;
  turned.inserted = true;
  const Vec3 pole_P = at.axis_P.dot(n) >= 0.0 ? n : Vec3(-n);
  if (!turn_towards(other, pole_P, turned)) return std::nullopt;
  double turn = 0.0;
  for (std::size_t k = 0; k < 2; ++k)
    turn = std::max(turn, std::abs(kinematics().angle(turned.q, k) - kinematics().angle(at.q, k)));
  if (turn < kSmallTurn.rad()) return std::nullopt;
  return turned;
}

// Puts the rotary axes of `turned` to the pole as they come there straight from `end`; how, is seen a little
// beside it.
bool SegmentRefiner::turn_towards(const Point& end, const Vec3& pole_P, Point& turned) const {
  const double whole = angle_between(end.axis_P, pole_P).rad();
  if (!(whole > 0.0)) return false;
  const double beside = std::min(kPoleShare * tolerance_.axis_room().rad() / whole, 0.5);
  const auto q = maker_.followed(end, slerp(end.axis_P, pole_P, 1.0 - beside));
  if (!q) return false;
  turned.axis_P = pole_P;
  turned.q = *q;
  const AxisId outer = kinematics().rotary(0);
  turned.q[outer] = maker_.at_pole(pole_P, *q)[outer];
  round_to_words(kinematics(), rounding_, turned.tip_P, turned.q);
  return true;
}

// The great circle comes to the pole between the ends.
bool SegmentRefiner::passes_pole() const {
  if (kinematics().rotary_count() < 2) return false;
  const Vec3& a_P = ends_.a->axis_P;
  const Vec3& b_P = ends_.b->axis_P;
  const Vec3& n = kinematics().direction(1);
  const Vec3 normal = a_P.cross(b_P);
  const Vec3 pole_P = n.dot(a_P) + n.dot(b_P) >= 0.0 ? n : Vec3(-n);
  const double near = kPoleShare * tolerance_.axis_room().rad();
  return normal.norm() > 0.0 && std::abs(normal.dot(pole_P)) <= near * normal.norm() &&
         a_P.cross(pole_P).dot(normal) > 0.0 && pole_P.cross(b_P).dot(normal) > 0.0;
}

// The same where the great circle passes the pole between the ends, and the axes stay on their branch: up to
// half a turn at one place.
std::optional<SegmentRefiner::AtPole> SegmentRefiner::turned_on_the_way() const {
  if (kinematics().rotary_count() < 2) return std::nullopt;
  const Vec3& a_P = ends_.a->axis_P;
  const Vec3& b_P = ends_.b->axis_P;
  const Vec3& n = kinematics().direction(1);
  if (!passes_pole()) return std::nullopt;
  const Vec3 pole_P = n.dot(a_P) + n.dot(b_P) >= 0.0 ? n : Vec3(-n);
  AtPole out;
  out.share = angle_between(a_P, pole_P).rad() / angle_between(a_P, b_P).rad();
  const Node pole = maker_.node(out.share, {}, NodeAxis::great_circle, true);
  const std::array<const Point*, 2> ends = {ends_.a, ends_.b};
  for (std::size_t side = 0; side < 2; ++side) {
    Point& turned = out.turned[side];
    turned = *ends_.b;
    turned.inserted = true;
    turned.tip_P = pole.tip_P;
    turned.beside_P = Vec3::Zero();
    if (!turn_towards(*ends[side], pole_P, turned)) return std::nullopt;
  }
  return out;
}

bool SegmentRefiner::insert_around_pole() {
  const SegmentEnds whole = ends_;
  const auto leaves = turned_at_pole(*whole.a, *whole.at_a, *whole.b);
  const auto comes = turned_at_pole(*whole.b, *whole.at_b, *whole.a);
  const auto passes = leaves || comes ? std::nullopt : turned_on_the_way();
  if (!leaves && !comes && !passes) return false;
  std::vector<Point> points{*whole.a};
  std::vector<Station> stations{*whole.at_a};
  std::vector<double> shares{0.0};
  const auto add = [&](const Point& p, const Station& at, double share) {
    points.push_back(p);
    stations.push_back(at);
    shares.push_back(share);
  };
  if (leaves) add(*leaves, station(kinematics(), leaves->q), 0.0);
  if (passes) {
    for (const Point& p : passes->turned) add(p, station(kinematics(), p.q), passes->share);
  }
  if (comes) add(*comes, station(kinematics(), comes->q), 1.0);
  add(*whole.b, *whole.at_b, 1.0);
  std::vector<Node> nodes;
  bool converged = true;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    ends_ = {&points[i], &points[i + 1], &stations[i], &stations[i + 1], false};
    maker_.start(points[i], points[i + 1]);
    nodes_.clear();
    const bool in_place = (leaves && i == 0) || (comes && i + 2 == points.size()) || (passes && i == 1);
    // To swing along the path and back is no course of it: at its end the next segment may have begun.
    if (in_place) reference_.tip0_P = reference_.tip1_P = points[i].tip_P;
    if (flute_) {
      const double length_mm = tolerance_.flute.length_mm;
      flute_->part = FluteSegment(
          {points[i].tip_P, points[i + 1].tip_P, points[i].axis_P, points[i + 1].axis_P}, length_mm);
      const FluteSegment path(reference_, length_mm);
      const Vec3 axis_P = path.axis_P(shares[i]);
      flute_->whole =
          in_place ? FluteSegment({points[i].tip_P, points[i].tip_P, axis_P, axis_P}, length_mm) : path;
    }
    if (!piece_within(stations[i], stations[i + 1])) {
      const NodeAxis how = in_place ? NodeAxis::joint_linear : NodeAxis::great_circle;
      cells_along(how, kFewestCells);
      const bool found = (both_sides() && insert_two_sided(how)) || insert_on_chord(how);
      converged = converged && found;
    }
    reference_.tip0_P = whole.a->tip_P;
    reference_.tip1_P = whole.b->tip_P;
    nodes.insert(nodes.end(), nodes_.begin(), nodes_.end());
    if (i + 2 < points.size())
      nodes.push_back({shares[i + 1], points[i + 1].tip_P, points[i + 1].axis_P, Vec3::Zero(),
                       points[i + 1].axis_P, stations[i + 1]});
  }
  ends_ = whole;
  if (flute_) {
    const FluteSegment path(reference_, tolerance_.flute.length_mm);
    flute_ = Flute{path, path};
  }
  maker_.start(*whole.a, *whole.b);
  nodes_ = std::move(nodes);
  return converged;
}

}  // namespace trunnion::path
