#include "post/judging/match_places.hpp"

#include <utility>

namespace trunnion::post {
namespace {

// The best way that comes to the end of a block on a segment of the path.
struct WayToEnd {
  double cost = std::numeric_limits<double>::infinity();
  double t = 0.0;        // on the segment
  std::size_t left = 0;  // the segment on which the block began

  bool is_open() const { return cost < std::numeric_limits<double>::infinity(); }
};

// Of one block: the best way that comes to a segment, before the block's end.
struct WayOfBlock {
  double cost = std::numeric_limits<double>::infinity();
  double s = 0.0;  // of the block
  double t = 0.0;
  std::size_t left = 0;

  bool is_open() const { return cost < std::numeric_limits<double>::infinity(); }
};

// What is nearer its limit counts by far more: the sum of these is least where nearly the largest is.
double cost_of(double share) {
  const double square = share * share;
  return square * square;
}

class Matching {
 public:
  Matching(const PathPoints& points, const Place& from, const MatchLimits& limits, const Matched& known)
      : points_(points), limits_(limits), known_(known), first_(from.segment) {
    rows_.push_back({{0.0, from.t, from.segment}});
  }

  void add(const ToolPose& begin, const ToolPose& end) {
    const std::vector<WayToEnd>& before = rows_.back();
    std::vector<WayToEnd> row;
    WayOfBlock way;
    for (std::size_t k = first_; has_segment(k) && (k - first_ < before.size() || way.is_open()); ++k) {
      if (way.is_open()) pass(begin, end, k, way);
      if (k - first_ < before.size()) {
        const WayToEnd& there = before[k - first_];
        if (there.cost < way.cost) way = {there.cost, 0.0, there.t, k};
      }
      const bool may_end = way.is_open() && !known_.not_on.contains({rows_.size() - 1, k});
      row.push_back(may_end ? ending(end, k, way) : WayToEnd{});
    }
    rows_.push_back(std::move(row));
  }

  bool is_open() const {
    return std::any_of(rows_.back().begin(), rows_.back().end(), [](const auto& w) { return w.is_open(); });
  }

  // The segments on which the blocks end; empty where no way comes there.
  std::vector<WayToEnd> ways(const ToolPose& last) const {
    const auto& last_point = known_.last_point;
    const std::vector<WayToEnd>& row = rows_.back();
    std::size_t k = 0;
    if (last_point) {
      k = *last_point - 1 - first_;
      if (k >= row.size() || !row[k].is_open() || off_point(last.tip_P, *last_point) > 1.0) return {};
    } else {
      for (std::size_t i = 1; i < row.size(); ++i) {
        if (row[i].cost < row[k].cost) k = i;
      }
    }
    std::vector<WayToEnd> out(rows_.size() - 1);
    for (std::size_t i = rows_.size() - 1; i > 0; --i) {
      const WayToEnd& way = rows_[i][k];
      out[i - 1] = {way.cost, way.t, first_ + k};
      k = way.left - first_;
    }
    if (last_point) out.back().t = 1.0;
    return out;
  }

 private:
  bool has_segment(std::size_t k) const {
    return k + 1 < points_.size() && (k == first_ || !points_[k + 1].rapid);
  }
  double axis_limit(std::size_t k) const {
    const bool in_cone = points_[k].in_cone || points_[k + 1].in_cone;
    return limits_.axis_rad + (in_cone ? limits_.pole_axis_rad : 0.0);
  }
  // Shares of the limits.
  double off_point(const Vec3& tip_P, std::size_t point) const {
    return (tip_P - points_[point].tip_P).norm() / limits_.tip_mm;
  }
  double off_arc(const Vec3& axis_P, std::size_t k) const {
    return angle_to_arc(axis_P, points_[k].axis_P, points_[k + 1].axis_P) / axis_limit(k);
  }

  // The block goes on past the CL point between segment k - 1 and k.
  void pass(const ToolPose& begin, const ToolPose& end, std::size_t k, WayOfBlock& way) const {
    const Target& corner = points_[k];
    const Vec3 tip = end.tip_P - begin.tip_P;
    const Vec3 axis = end.axis_P - begin.axis_P;
    constexpr double kSquare = kAxisBesideTip_mm * kAxisBesideTip_mm;
    const double length2 = tip.squaredNorm() + kSquare * axis.squaredNorm();
    const double foot =
        (corner.tip_P - begin.tip_P).dot(tip) + kSquare * (corner.axis_P - begin.axis_P).dot(axis);
    double s = length2 > 0.0 ? std::clamp(foot / length2, way.s, 1.0) : 1.0;
    const auto share_at = [&](double at) {
      const Vec3 axis_P = begin.axis_P + at * axis;
      return std::max({off_point(begin.tip_P + at * tip, k), off_arc(axis_P, k - 1), off_arc(axis_P, k)});
    };
    double share = share_at(s);
    // Tip and tool axis may be nearest at different places, and both near enough between them.
    constexpr int kPlaces = 32;
    for (int i = 0; i <= kPlaces && share > 1.0; ++i) {
      const double at = way.s + (1.0 - way.s) * i / kPlaces;
      const double there = share_at(at);
      if (there >= share) continue;
      share = there;
      s = at;
    }
    if (share > 1.0)
      way = {};
    else
      way = {way.cost + cost_of(share), s, 0.0, way.left};
  }

  WayToEnd ending(const ToolPose& end, std::size_t k, const WayOfBlock& way) const {
    const Target& a = points_[k];
    const Target& b = points_[k + 1];
    const double t = std::max(fraction_of(end, a, b), way.t);
    // On one segment the tip may go to and fro a little: what counts is how far off it is.
    if (back_mm(end, a, b, way.t) > limits_.back_mm) return {};
    const double off_mm = distance_to_segment(end.tip_P, a.tip_P, b.tip_P);
    const double share = std::max(off_mm / limits_.tip_mm, off_arc(end.axis_P, k));
    return share > 1.0 ? WayToEnd{} : WayToEnd{way.cost + cost_of(share), t, way.left};
  }

  const PathPoints& points_;
  MatchLimits limits_;
  const Matched& known_;
  std::size_t first_;
  std::vector<std::vector<WayToEnd>> rows_;  // of each block, from segment first_ on
};

}  // namespace

std::vector<Place> match_places(const PathPoints& points, const Place& from, std::span<const ToolPose> poses,
                                const MatchLimits& limits, const Matched& known) {
  Matching matching(points, from, limits, known);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    matching.add(poses[i - 1], poses[i]);
    if (!matching.is_open()) return {};
  }
  const auto ways = matching.ways(poses.back());
  std::vector<Place> out(ways.size());
  for (std::size_t i = 0; i < ways.size(); ++i) {
    // A CL point ends a block where the next one begins behind it; where the tool has been there and has gone
    // back on the segment it does not.
    constexpr double kBefore = 1.0 - 1e-9;
    const bool goes_on = i + 1 < ways.size() && ways[i + 1].left == ways[i].left;
    const Vec3& point_P = points[ways[i].left + 1].tip_P;
    const bool is_there = (poses[i + 1].tip_P - point_P).norm() <= limits.tip_mm;
    out[i].segment = ways[i].left;
    out[i].t = goes_on || !is_there ? std::min(ways[i].t, kBefore) : ways[i].t;
  }
  return out;
}

}  // namespace trunnion::post
