#include "post/judging/late_axes.hpp"

#include <cmath>
#include <optional>

namespace trunnion::post {

JointVector LateAxes::follow(const BlockEnd& end, const ControlTimes& times) {
  from_ = commanded_;
  commanded_ = end.q;
  const bool is_known = started_ && !end.rapid && !end.from_unknown && end.tcp == tcp_;
  const auto tip_way = end.tcp ? std::optional((end.word_tip_P - word_tip_P_).norm()) : std::nullopt;
  started_ = true;
  tcp_ = end.tcp;
  word_tip_P_ = end.word_tip_P;
  const double seconds =
      is_known ? times.seconds(times.way(from_, end.q, tip_way), end.feed_mode, end.feed) : 0.0;
  if (seconds <= 0.0) {
    rest();
    return end.q;
  }
  JointVector out = end.q;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double tau = lag_s_[id];
    if (tau == 0.0) continue;
    const double steady = -tau * (end.q[id] - from_[id]) / seconds;
    // An axis that is ahead of the others is so at once.
    behind_[id] = tau > 0.0 ? steady + (behind_[id] - steady) * std::exp(-seconds / tau) : steady;
    out[id] += behind_[id];
  }
  return out;
}

}  // namespace trunnion::post
