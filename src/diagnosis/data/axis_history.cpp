#include "diagnosis/data/axis_history.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::diagnosis {
namespace {

constexpr double kStandsStill = 1e-9;  // mm, rad

struct Follower {
  double q = 0.0, turned_at = 0.0, turned_q = 0.0, sense = 0.0, step = 0.0;
  void move(double to, double time_before) {
    const double by = to - q;
    if (std::abs(by) < kStandsStill) return;
    const double way = by > 0.0 ? 1.0 : -1.0;
    if (way != sense) turned_at = time_before, turned_q = q, sense = way;
    step = by;
    q = to;
  }
};

std::vector<AxisHistory> of_all(const Observations& o) {
  const auto& axes = o.machine().axes;
  const VectorXd none = VectorXd::Zero(o.size());
  std::vector<AxisHistory> out(axes.size(), {none, none, none, none});
  for (auto rows : o.runs()) {
    std::stable_sort(rows.begin(), rows.end(),
                     [&](Eigen::Index a, Eigen::Index b) { return o.state(a).time_s < o.state(b).time_s; });
    for (AxisId axis = 0; axis < axes.size() && !rows.empty(); ++axis) {
      Follower f;
      f.q = f.turned_q = o.state(rows.front()).q[axis];
      f.turned_at = o.state(rows.front()).time_s;
      double before = f.turned_at;
      for (const Eigen::Index i : rows) {
        const MachineState& s = o.state(i);
        f.move(s.q[axis], before);
        before = s.time_s;
        const double stated = s.direction[axis];
        out[axis].sense[i] = stated != 0.0 ? stated : f.sense;
        out[axis].since_turn_s[i] = s.time_s - f.turned_at;
        out[axis].since_turn_distance[i] = std::abs(s.q[axis] - f.turned_q);
        out[axis].last_step[i] = f.step;
      }
    }
  }
  return out;
}

}  // namespace

std::vector<AxisHistory> axis_histories(const Observations& o) {
  std::vector<AxisHistory> out = of_all(o.whole());
  for (AxisHistory& h : out)
    for (VectorXd* part : {&h.sense, &h.since_turn_s, &h.since_turn_distance, &h.last_step})
      *part = o.means(*part);
  return out;
}

}  // namespace trunnion::diagnosis
