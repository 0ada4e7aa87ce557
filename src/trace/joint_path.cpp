#include "trace/joint_path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trunnion::trace {
namespace {

constexpr std::size_t kOfBox = 16;                    // segments in a box, and boxes in a large one
constexpr double kPieceOfTurn = 0.5 * kRadPerDegree;  // between nodes under tool-centre-point control
constexpr double kMostPieces = 256.0;

}  // namespace

Scaled scaled(const Machine& machine, const JointVector& q) {
  Scaled x = Scaled::Zero();
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    x[static_cast<int>(id)] = machine.axes[id].kind == AxisKind::rotary ? q[id] * kLever_mm : q[id];
  return x;
}

JointVector unscaled(const Machine& machine, const Scaled& x) {
  JointVector q;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const double v = x[static_cast<int>(id)];
    q[id] = machine.axes[id].kind == AxisKind::rotary ? v / kLever_mm : v;
  }
  return q;
}

double JointPath::Box::distance2(const Scaled& x) const {
  return (low - x).cwiseMax(x - high).cwiseMax(0.0).squaredNorm();
}

void JointPath::Box::add(const Scaled& x) {
  low = low.cwiseMin(x);
  high = high.cwiseMax(x);
}

JointPath::JointPath(const Machine& machine, const std::vector<PlannedBlock>& blocks) {
  nodes_.push_back(scaled(machine, blocks.front().q));
  along_.push_back(0.0);
  double now_s = 0.0;
  for (std::size_t k = 1; k < blocks.size(); ++k) {
    now_s += blocks[k - 1].dwell_s;
    const std::size_t first = segments_.size();
    add_block(machine, blocks, k);
    const auto pieces = static_cast<double>(segments_.size() - first);
    for (std::size_t i = first; i < segments_.size(); ++i) {
      const auto n = static_cast<double>(i - first);
      segments_[i].begins_s = now_s + blocks[k].seconds * n / pieces;
      segments_[i].ends_s = now_s + blocks[k].seconds * (n + 1.0) / pieces;
    }
    now_s += blocks[k].seconds;
  }
  make_boxes();
}

void JointPath::add_block(const Machine& machine, const std::vector<PlannedBlock>& blocks, std::size_t k) {
  const PlannedBlock& to = blocks[k];
  const PlannedBlock& from = blocks[k - 1];
  const Segment segment{k, !to.unknown && to.length_mm == from.length_mm, 0.0, 0.0};
  if (to.tcp && from.tcp && segment.known) {
    double turn = 0.0;
    for (const AxisId id : machine.rotary_axes()) turn = std::max(turn, std::abs(to.q[id] - from.q[id]));
    const double pieces = std::clamp(std::ceil(turn / kPieceOfTurn), 1.0, kMostPieces);
    const Vec3 tool(0.0, 0.0, -to.length_mm);
    const Vec3 a = tool_pose(forward(machine, from.q, tool)).tip_P;
    const Vec3 b = tool_pose(forward(machine, to.q, tool)).tip_P;
    for (double n = 1.0; n < pieces; n += 1.0) {
      JointVector q = JointVector::interpolate(from.q, to.q, n / pieces);
      solve_linear(machine, a + n / pieces * (b - a), tool, q);
      add_node(scaled(machine, q), segment);
    }
  }
  add_node(scaled(machine, to.q), segment);
}

void JointPath::add_node(const Scaled& x, const Segment& segment) {
  along_.push_back(along_.back() + (segment.known ? (x - nodes_.back()).norm() : 0.0));
  nodes_.push_back(x);
  segments_.push_back(segment);
}

void JointPath::make_boxes() {
  constexpr double kFar = std::numeric_limits<double>::max();
  const Box none{Scaled::Constant(kFar), Scaled::Constant(-kFar)};
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    if (i % kOfBox == 0) boxes_.push_back(none);
    if (!segments_[i].known) continue;
    boxes_.back().add(nodes_[i]);
    boxes_.back().add(nodes_[i + 1]);
  }
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    if (i % kOfBox == 0) large_boxes_.push_back(none);
    large_boxes_.back().low = large_boxes_.back().low.cwiseMin(boxes_[i].low);
    large_boxes_.back().high = large_boxes_.back().high.cwiseMax(boxes_[i].high);
  }
}

double JointPath::diagonal() const {
  Box all{nodes_.front(), nodes_.front()};
  for (const Scaled& x : nodes_) all.add(x);
  return (all.high - all.low).norm();
}

Scaled JointPath::tangent(std::size_t i) const {
  const double length = along_[i + 1] - along_[i];
  if (length <= 0.0) return Scaled::Zero();
  return (nodes_[i + 1] - nodes_[i]) / length;
}

std::size_t JointPath::segment_at(double s) const {
  const auto at = std::lower_bound(along_.begin() + 1, along_.end(), s);
  const auto i = static_cast<std::size_t>(at - along_.begin()) - 1;
  return std::min(i, segments_.size() - 1);
}

Scaled JointPath::at(double s) const {
  const std::size_t i = segment_at(s);
  const double length = along_[i + 1] - along_[i];
  if (length <= 0.0) return nodes_[i + 1];
  const double t = std::clamp((s - along_[i]) / length, 0.0, 1.0);
  return nodes_[i] + t * (nodes_[i + 1] - nodes_[i]);
}

bool JointPath::is_near_hole(double s, double within) const {
  for (std::size_t i = segment_at(std::max(s - within, 0.0)); i < segments_.size(); ++i) {
    if (along_[i] > s + within) return false;
    if (!segments_[i].known) return true;
  }
  return false;
}

double JointPath::planned_s(double s) const {
  const std::size_t i = segment_at(s);
  const double length = along_[i + 1] - along_[i];
  const double t = length > 0.0 ? std::clamp((s - along_[i]) / length, 0.0, 1.0) : 1.0;
  return segments_[i].begins_s + t * (segments_[i].ends_s - segments_[i].begins_s);
}

double JointPath::leaves_s(double s) const {
  std::size_t i = segment_at(s);
  if (s < along_[i + 1]) return planned_s(s);
  while (i + 1 < segments_.size() && along_[i + 1] <= s) ++i;
  return along_[i + 1] <= s ? segments_[i].ends_s : segments_[i].begins_s;
}

JointPath::Place JointPath::on_segment(std::size_t i, const Scaled& x) const {
  const Scaled way = nodes_[i + 1] - nodes_[i];
  const double length2 = way.squaredNorm();
  const double wanted = length2 > 0.0 ? way.dot(x - nodes_[i]) / length2 : 1.0;
  const double t = std::clamp(wanted, 0.0, 1.0);
  const bool beyond = (wanted > 1.0 && !is_known(i + 1)) || (wanted < 0.0 && (i == 0 || !is_known(i - 1)));
  return {along_[i] + t * (along_[i + 1] - along_[i]), (nodes_[i] + t * way - x).norm(), i, beyond};
}

JointPath::Place JointPath::nearest(const Scaled& x, double from, double to) const {
  Place best{from, std::numeric_limits<double>::max(), 0, false};
  std::size_t i = segment_at(from);
  // Segments without length at the place itself count, too.
  while (i > 0 && along_[i] >= from) --i;
  for (; i < segments_.size() && along_[i] <= to; ++i) {
    if (!segments_[i].known) continue;
    Place at = on_segment(i, x);
    if (at.s < from || at.s > to) {
      at.s = std::clamp(at.s, from, to);
      at.beyond = false;
      const double length = along_[i + 1] - along_[i];
      const double t = length > 0.0 ? (at.s - along_[i]) / length : 1.0;
      at.distance = (nodes_[i] + t * (nodes_[i + 1] - nodes_[i]) - x).norm();
    }
    if (at.distance < best.distance) best = at;
  }
  return best;
}

std::vector<JointPath::Place> JointPath::candidates(const Scaled& x, double within, std::size_t most) const {
  std::vector<Place> out;
  const double within2 = within * within;
  Place last;
  bool have_last = false, falling = false;
  std::size_t last_i = 0;
  const auto keep_last = [&] {
    if (have_last && falling) out.push_back(last);
    have_last = false;
  };
  for (std::size_t large = 0; large < large_boxes_.size(); ++large) {
    if (large_boxes_[large].distance2(x) > within2) continue;
    const std::size_t end = std::min((large + 1) * kOfBox, boxes_.size());
    for (std::size_t box = large * kOfBox; box < end; ++box) {
      if (boxes_[box].distance2(x) > within2) continue;
      const std::size_t stop = std::min((box + 1) * kOfBox, segments_.size());
      for (std::size_t i = box * kOfBox; i < stop; ++i) {
        if (!segments_[i].known) continue;
        const Place at = on_segment(i, x);
        if (at.distance > within) continue;
        if (have_last && last_i + 1 == i) {
          if (at.distance >= last.distance) {
            if (falling) out.push_back(last);
            falling = false;
          } else {
            falling = true;
          }
        } else {
          keep_last();
          falling = true;
        }
        last = at;
        last_i = i;
        have_last = true;
      }
    }
  }
  keep_last();
  std::sort(out.begin(), out.end(), [](const Place& a, const Place& b) { return a.distance < b.distance; });
  if (out.size() > most) out.resize(most);
  return out;
}

}  // namespace trunnion::trace
