#include "machine/smooth_speeds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trunnion {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr double kLook = 1.25;                             // whether rounds are worth it:
constexpr double kLittle = 1e-3;                           // not for this share of the time
constexpr double kWider[] = {3.0, 1.7, 1.25, 1.09, 1.03};  // in one round after the other
constexpr double kSteeper = 1.3;
constexpr double kAlike = 1.0 + 1e-9;
constexpr double kFlat = 1e-3;  // a series of four terms has 13 digits

}  // namespace

double SpeedPiece::most2() const {
  double out = std::max(begin2, end2);
  if (kind == Kind::between && slope > 0.0 && end_slope() < 0.0)
    out = std::max(out, begin2 - 0.5 * slope * slope / bend);
  return out;
}

double SpeedPiece::seconds() const {
  if (kind != Kind::between) return 3.0 * length / std::sqrt(std::max(begin2, end2));
  // s'' = slope / 2 + w s; with r = sqrt(w) it takes 2 / r atanh(r length / (sum of the speeds at both
  // ends)).
  const double evenly = length / (std::sqrt(begin2) + std::sqrt(end2));
  const double w = 0.5 * bend;
  const double y2 = w * evenly * evenly;
  if (std::abs(y2) < kFlat) return 2.0 * evenly * (1.0 + y2 * (1.0 / 3.0 + y2 * (0.2 + y2 / 7.0)));
  const double r = std::sqrt(std::abs(w));
  return 2.0 / r * (w > 0.0 ? std::atanh(r * evenly) : std::atan(r * evenly));
}

// Beside a rest the control point stands where the line from it touches s^(4/3) at the end of the piece.
void SmoothSpeeds::lay(const SmoothPath& path) {
  const auto& [begin, end] = ends_;
  nodes_.clear();
  knots_.clear();
  const auto& cells = path.cells();
  double at = 0.0;
  first_ = begin.kind == SpeedEnd::Kind::rest ? 0 : 1;
  if (first_ == 1) {
    nodes_.push_back({0.0, begin.at2});
    knots_.push_back({0.0, 0.0, kUnbounded});
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const double most2 = path.shape(cells[i]).most2;
    nodes_.push_back({at + 0.5 * cells[i].length, most2});
    at += cells[i].length;
    if (i + 1 < cells.size()) knots_.push_back({at, 0.0, std::min(most2, path.shape(cells[i + 1]).most2)});
  }
  if (begin.kind == SpeedEnd::Kind::rest) {
    nodes_.front().at = 0.25 * cells.front().length;
    nodes_.front().most2 = 0.0;
  }
  if (begin.kind == SpeedEnd::Kind::going) nodes_[1].most2 = begin.at2 + begin.slope * nodes_[1].at;
  if (end.kind == SpeedEnd::Kind::going) {
    nodes_.back().most2 = end.at2 - end.slope * (at - nodes_.back().at);
    knots_.push_back({at, 0.0, kUnbounded});
    nodes_.push_back({at, end.at2});
  } else {
    nodes_.back().at = at - 0.25 * cells.back().length;
    nodes_.back().most2 = 0.0;
  }
  for (std::size_t i = 0; i < knots_.size(); ++i) {
    Knot& knot = knots_[i];
    knot.share = std::clamp((knot.at - nodes_[i].at) / (nodes_[i + 1].at - nodes_[i].at), 0.0, 1.0);
  }
}

void SmoothSpeeds::bound(const SmoothPath& path) {
  const auto& cells = path.cells();
  const std::size_t count = nodes_.size();
  // Slopes that nobody can exceed, and with them speeds.
  for (Knot& knot : knots_) knot.steepest = knot.from_rest = kUnbounded;
  const auto straight = [&](std::size_t i) {
    const SmoothShape& shape = path.shape(cells[i]);
    double steepest = 0.0;
    for (const double steep : shape.steep) steepest = std::max(steepest, steep);
    return 2.0 / steepest;
  };
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const double most = straight(i);
    const std::size_t node = first_ + i;
    if (node > 0) knots_[node - 1].steepest = std::min(knots_[node - 1].steepest, most);
    if (node < knots_.size()) knots_[node].steepest = std::min(knots_[node].steepest, most);
  }
  for (Node& node : nodes_) node.reach2 = std::min(node.most2, node.trust.speed2);
  // The first two are where it is, the last two where it goes to.
  const std::size_t fixed = ends_.begin.kind == SpeedEnd::Kind::going ? 2 : 0;
  const std::size_t free_to = count - (ends_.end.kind == SpeedEnd::Kind::going ? 2 : 0);
  for (std::size_t i = 0; i < fixed; ++i) nodes_[i].reach2 = nodes_[i].most2;
  for (std::size_t i = free_to; i < count; ++i) nodes_[i].reach2 = nodes_[i].most2;
  const auto reach = [&](const Node& from, Node& to, const Knot& knot) {
    to.reach2 = std::min(to.reach2, from.reach2 + knot.steepest * std::abs(to.at - from.at));
  };
  for (std::size_t i = std::max<std::size_t>(fixed, 1); i < free_to; ++i)
    reach(nodes_[i - 1], nodes_[i], knots_[i - 1]);
  for (std::size_t i = std::min(free_to, count - 1); i > fixed; --i)
    reach(nodes_[i], nodes_[i - 1], knots_[i - 1]);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t k = first_ + i;
    Node& node = nodes_[k];
    const SmoothShape& shape = path.shape(cells[i]);
    double most2 = node.reach2;
    if (k > 0)
      most2 =
          std::max(most2, nodes_[k - 1].reach2 + knots_[k - 1].share * (node.reach2 - nodes_[k - 1].reach2));
    if (k < knots_.size())
      most2 = std::max(most2, node.reach2 + knots_[k].share * (nodes_[k + 1].reach2 - node.reach2));
    most2 = std::min(most2, shape.most2);
    const SmoothBounds bounds = path.bounds(shape, most2, 0.5 * node.trust.slope, node.trust.more);
    node.per_bend = 2.0 * bounds.jerk_up * cells[i].length;
    node.per_fall = 2.0 * bounds.jerk_down * cells[i].length;
    node.speed = std::sqrt(most2);
    if (k > 0) knots_[k - 1].steepest = std::min(knots_[k - 1].steepest, 2.0 * bounds.acceleration);
    if (k < knots_.size()) knots_[k].steepest = std::min(knots_[k].steepest, 2.0 * bounds.acceleration);
    // From rest the jerk lets the acceleration get to (6 jerk^2 way)^(1/3).
    if (k > 0 && k + 1 < count) continue;
    const double from_rest = 2.0 * std::cbrt(6.0 * bounds.jerk_up * bounds.jerk_up * cells[i].length);
    (k == 0 ? knots_.front() : knots_.back()).from_rest = from_rest;
  }
  double fall = 0.0;
  nodes_[0].summed = 0.0;
  for (std::size_t i = 0; i + 1 < count; ++i) {
    if (i > 0) fall += nodes_[i].per_fall / nodes_[i].speed;
    nodes_[i + 1].summed = nodes_[i].summed + fall * (nodes_[i + 1].at - nodes_[i].at);
  }
  // The slope needs its way to change to what the next piece allows.
  for (std::size_t i = 1; i < knots_.size(); ++i)
    knots_[i].steepest =
        std::min(knots_[i].steepest, knots_[i - 1].steepest + nodes_[i].per_fall / nodes_[i].speed);
  for (std::size_t i = knots_.size(); i-- > 1;)
    knots_[i - 1].steepest =
        std::min(knots_[i - 1].steepest, knots_[i].steepest + nodes_[i].per_fall / nodes_[i].speed);
}

// The most that can be reached from `from` on (down to the begin, or up to the end) with the largest jerk.
// Where a bound lets it no higher it goes on from there, as steeply as it comes there on the way that
// round_tops leaves to it.
void SmoothSpeeds::sweep(bool forward, std::size_t from, double slope) {
  double Node::*const reached = forward ? &Node::up2 : &Node::down2;
  const std::size_t last = forward ? nodes_.size() - 1 : 0;
  nodes_[from].*reached = nodes_[from].reach2;
  stack_.assign(1, from);
  bool is_lowered = false;  // the node, by a bound of its own
  for (std::size_t i = from; i != last;) {
    const std::size_t j = forward ? i + 1 : i - 1;
    const Knot& knot = knots_[std::min(i, j)];
    const Node& node = nodes_[i];
    Node& next = nodes_[j];
    const double way = std::abs(next.at - node.at);
    const double at2 = node.*reached;
    double steepest = std::min(knot.steepest, knot.from_rest);
    if (slope < kUnbounded) {
      // Behind a fall it stands at a slow place: half of the change lies on either side, if that is more. But
      // not where it falls as it begins.
      const bool may_stand = slope < 0.0 && is_lowered;
      const auto most = [&](double speed2) {
        const double change = node.per_bend / std::sqrt(speed2);
        return std::min(steepest, may_stand ? std::max(slope + change, 0.5 * change) : slope + change);
      };
      double fastest2 = std::max(at2, std::min(next.reach2, at2 + way * most(at2)));
      if (slope < 0.0 && !is_lowered)
        fastest2 = std::max(fastest2, at2 - slope * std::abs(node.at - knots_[forward ? i - 1 : i].at));
      steepest = most(fastest2);
    }
    const double free2 = at2 + steepest * way;
    double to2 = std::min(free2, next.reach2);
    // Where the pieces meet the spline is between the two.
    const double share = forward ? knot.share : 1.0 - knot.share;
    if (share > 0.0 && at2 <= knot.most2) to2 = std::min(to2, at2 + (knot.most2 - at2) / share);
    is_lowered = to2 < free2;
    next.*reached = to2;
    const double rise = push(j, reached) - (next.summed - node.summed) / (next.at - node.at);
    slope = forward ? rise : -rise;
    i = j;
  }
}

// Adds a node to the lower convex hull of `value` and the possible changes summed up twice; its last slope.
double SmoothSpeeds::push(std::size_t i, double Node::*value) {
  const auto slope = [&](std::size_t a, std::size_t b) {
    return (nodes_[b].*value + nodes_[b].summed - nodes_[a].*value - nodes_[a].summed) /
           (nodes_[b].at - nodes_[a].at);
  };
  const bool forward = i > stack_.back();
  double last = slope(stack_.back(), i);
  while (stack_.size() >= 2) {
    const double before = slope(stack_[stack_.size() - 2], stack_.back());
    if (forward ? before < last : before > last) break;
    stack_.pop_back();
    last = slope(stack_.back(), i);
  }
  stack_.push_back(i);
  return last;
}

// The largest values below those of both sweeps whose slope changes downwards by what the jerk allows: with
// the possible changes summed up twice they are a lower convex hull.
void SmoothSpeeds::round_tops() {
  for (Node& node : nodes_) node.value2 = std::min(node.up2, node.down2);
  stack_.assign(1, 0);
  for (std::size_t i = 1; i < nodes_.size(); ++i) push(i, &Node::value2);
  for (std::size_t k = 0; k + 1 < stack_.size(); ++k) {
    const Node& a = nodes_[stack_[k]];
    const Node& b = nodes_[stack_[k + 1]];
    const double height = a.value2 + a.summed;
    const double rise = (b.value2 + b.summed - height) / (b.at - a.at);
    for (std::size_t i = stack_[k] + 1; i < stack_[k + 1]; ++i)
      nodes_[i].value2 = height + rise * (nodes_[i].at - a.at) - nodes_[i].summed;
  }
}

void SmoothSpeeds::put(const SmoothPath& path, std::vector<SpeedPiece>& out) const {
  const auto& cells = path.cells();
  const auto slope = [&](std::size_t k) {
    return (nodes_[k + 1].value2 - nodes_[k].value2) / (nodes_[k + 1].at - nodes_[k].at);
  };
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t k = first_ + i;
    SpeedPiece piece;
    piece.length = cells[i].length;
    piece.ends_block = cells[i].ends_block;
    if (k == 0) {
      piece.kind = SpeedPiece::Kind::from_rest;
      piece.end2 = slope(0) * 0.75 * piece.length;
      piece.slope = slope(0);
    } else if (k + 1 == nodes_.size()) {
      piece.kind = SpeedPiece::Kind::to_rest;
      piece.begin2 = -slope(k - 1) * 0.75 * piece.length;
      piece.slope = slope(k - 1);
    } else {
      piece.slope = slope(k - 1);
      piece.bend = (slope(k) - piece.slope) / piece.length;
      piece.begin2 = nodes_[k].value2 - 0.5 * piece.length * piece.slope;
      piece.end2 = nodes_[k].value2 + 0.5 * piece.length * slope(k);
    }
    out.push_back(piece);
  }
}

bool SmoothSpeeds::run(const SmoothPath& path) {
  bound(path);
  const auto& [begin, end] = ends_;
  const std::size_t last = nodes_.size() - 1;
  const bool goes_before = begin.kind == SpeedEnd::Kind::going, goes_on = end.kind == SpeedEnd::Kind::going;
  sweep(true, goes_before ? 1 : 0, goes_before ? begin.slope : kUnbounded);
  sweep(false, goes_on ? last - 1 : last, goes_on ? -end.slope : kUnbounded);
  if (goes_before) nodes_[0].up2 = nodes_[0].down2 = begin.at2;
  if (goes_on) nodes_[last].up2 = nodes_[last].down2 = end.at2;
  round_tops();
  const auto is_kept = [](const Node& node) { return node.value2 >= (1.0 - 1e-9) * node.most2; };
  // One that begins by slowing down for a stop may not be able to do else than stop.
  const auto goes_on_way = [](const Node& node) { return node.value2 > 0.0; };
  if (!std::all_of(nodes_.begin() + 1, nodes_.end() - 1, goes_on_way)) return false;
  return (!goes_before || is_kept(nodes_[1])) && (!goes_on || is_kept(nodes_[last - 1]));
}

// Keeps what is found, if anything is. By which share of the time it is faster than what was found before.
double SmoothSpeeds::improve(const SmoothPath& path) {
  if (!run(path)) return kUnbounded;
  double seconds = 0.0;
  double gain = found_.empty() ? kUnbounded : 0.0;
  found_.resize(nodes_.size());
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const double now2 = nodes_[k].value2;
    if (k > 0 && now2 > 0.0) {
      const double here = (nodes_[k].at - nodes_[k - 1].at) / std::sqrt(now2);
      seconds += here;
      gain += 0.5 * here * (1.0 - found_[k] / now2);
    }
    found_[k] = now2;
  }
  return seconds > 0.0 ? gain / seconds : 0.0;
}

// The next bounds need to hold not far above what was found with the last ones.
void SmoothSpeeds::trust(double wider) {
  double before = 0.0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    Node& node = nodes_[k];
    double behind = 0.0;
    if (k < knots_.size())
      behind = std::abs(nodes_[k + 1].value2 - node.value2) / (nodes_[k + 1].at - node.at);
    if (!node.is_kept) {
      node.trust.speed2 = wider * std::max(node.value2, node.known2);
      node.trust.slope = kSteeper * std::max({before, behind, node.known_slope});
    }
    before = behind;
  }
}

// What was planned before from where it is, over the same pieces. For the time in which an acceleration
// changes its sign it can go on so, and shall not be asked for less than that takes.
void SmoothSpeeds::remember(const SmoothPath& path, const KnownSpeeds& known) {
  const auto& cells = path.cells();
  double seconds = 0.0;
  for (std::size_t i = 0; i < std::min(cells.size(), known.pieces.size()); ++i) {
    const SpeedPiece& piece = known.pieces[i];
    if (piece.length != cells[i].length || piece.kind != SpeedPiece::Kind::between) return;
    Node& node = nodes_[first_ + i];
    node.known2 = piece.begin2 + 0.5 * piece.length * piece.slope;
    node.known_slope = std::max(std::abs(piece.slope), std::abs(piece.end_slope()));
    node.is_kept = seconds < remembers_s_;
    seconds += piece.seconds();
    if (!node.is_kept) continue;
    node.trust.speed2 = kAlike * node.known2;
    node.trust.slope = kAlike * node.known_slope;
    if (!known.are_steady) node.trust.more = 0.0;
  }
}

bool SmoothSpeeds::plan(const SmoothPath& path, const Ends& ends, const KnownSpeeds& known,
                        std::vector<SpeedPiece>& out) {
  ends_ = ends;
  lay(path);
  if (ends.begin.kind == SpeedEnd::Kind::going) remember(path, known);
  found_.clear();
  improve(path);
  trust(kLook);
  if (improve(path) > kLittle) {
    for (const double wider : kWider) {
      trust(wider);
      improve(path);
    }
  }
  if (found_.empty()) return false;
  for (std::size_t k = 0; k < nodes_.size(); ++k) nodes_[k].value2 = found_[k];
  put(path, out);
  return true;
}

}  // namespace trunnion
