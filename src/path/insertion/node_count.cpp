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
// Below this share of the segment no step helps: the ends of the step are too far apart in themselves.
constexpr double kShortestStep = 1e-9;

}  // namespace

// One count, planned from the cells, then anew from what the attempt came to.
bool SegmentRefiner::insert_planned(NodeAxis how, Side side, std::size_t pieces) {
  for (int fit = 0; fit <= kRefits; ++fit) {
    if (try_pieces(pieces, how, side)) return true;
    plan_.see_attempt(nodes_);
    plan_.use_cells(how);
  }
  return false;
}

// `least` to `most` pieces. Where the plan does not hold, or asks for more than is needed, the longest steps
// decide.
bool SegmentRefiner::insert_nodes(NodeAxis how, Side side, std::size_t least, std::size_t most) {
  std::size_t pieces = std::max<std::size_t>(2, least);
  if (pieces > most) return false;
  const std::vector<Cell> planned = plan_.cells();
  if (plan_.crowded() && insert_longest_steps(how, side, pieces)) return true;
  if (insert_planned(how, side, pieces)) return true;
  std::vector<Cell> found = plan_.exchange_cells(planned);
  plan_.use_cells(how);
  if (insert_longest_steps(how, side, most)) return true;
  plan_.exchange_cells(std::move(found));
  plan_.use_cells(how);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    // One more while that is likely to do; faster where the plan is far off.
    const std::size_t asked = plan_.pieces(side);
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
  while (!judge_.within(at, *ends_.at_b, {t, 1.0})) {
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
  std::optional<Node> good;
  double bad = 1.0;
  const auto holds = [&](double to) {
    Node node = maker_.node(to, plan_.displacement(to, side, kEdge), how, true);
    if (!judge_.within(at, node.station, {t, to})) {
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
  plan_.use_cells(how);
  if (!plan_.spacing().tip_leads()) return false;
  std::vector<Cell> planned = plan_.cells();
  const bool crowded = plan_.crowded();
  const std::size_t on_chord = plan_.pieces(Side::on_chord);
  const bool found =
      insert_nodes(how, Side::two_sided, plan_.pieces(Side::two_sided), std::max<std::size_t>(2, on_chord));
  plan_.exchange_cells(std::move(planned));
  if (!found || !crowded) return found;
  // The cells do not tell which of the two is better.
  const std::vector<Node> both_sides = nodes_;
  if (!insert_longest_steps(how, Side::on_chord, both_sides.size())) nodes_ = both_sides;
  return true;
}

bool SegmentRefiner::insert_on_chord(NodeAxis how) {
  plan_.use_cells(how);
  const std::size_t least = std::max<std::size_t>(2, plan_.pieces(Side::on_chord));
  return insert_nodes(how, Side::on_chord, least, std::min(kMostInserted + 1, kHopeless * least));
}

bool SegmentRefiner::insert_around_pole(Angle least_turn) {
  const SegmentEnds whole = ends_;
  const auto leaves = pole_.turned(*whole.a, *whole.at_a, *whole.b, least_turn);
  const auto comes = pole_.turned(*whole.b, *whole.at_b, *whole.a, least_turn);
  const auto passes = leaves || comes ? std::nullopt : pole_.on_the_way(*whole.a, *whole.b);
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
    judge_.start_part({points[i].tip_P, points[i + 1].tip_P, points[i].axis_P, points[i + 1].axis_P},
                      shares[i], in_place);
    if (!judge_.within(stations[i], stations[i + 1])) {
      const NodeAxis how = in_place ? NodeAxis::joint_linear : NodeAxis::great_circle;
      plan_.see_ideal(how);
      const bool found = (both_sides() && insert_two_sided(how)) || insert_on_chord(how);
      converged = converged && found;
    }
    judge_.end_part(*whole.a, *whole.b);
    nodes.insert(nodes.end(), nodes_.begin(), nodes_.end());
    if (i + 2 < points.size())
      nodes.push_back({shares[i + 1], points[i + 1].tip_P, points[i + 1].axis_P, Vec3::Zero(),
                       points[i + 1].axis_P, stations[i + 1]});
  }
  ends_ = whole;
  maker_.start(*whole.a, *whole.b);
  nodes_ = std::move(nodes);
  return converged;
}

}  // namespace trunnion::path
