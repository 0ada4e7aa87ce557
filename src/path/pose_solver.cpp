#include "path/pose_solver.hpp"

#include <algorithm>
#include <cstring>

namespace trunnion::path {

void PoseSolver::solve(const ToolPose& pose, double seed_inner, SolvedPose& out) const {
  out.rotary = solver_.solve_within_limits(pose.axis_P, seed_inner, inverse_);
  out.follows_seed = false;
  for (std::size_t i = 0; i < out.rotary.count; ++i) {
    const RotarySolution& solution = out.rotary.at[i];
    out.follows_seed = out.follows_seed || !solution.sines_known;
    if (solution.sines_known) {
      out.sines[i] = solution.sines;
    } else {
      JointVector q;
      for (std::size_t k = 0; k < kinematics_.rotary_count(); ++k)
        q[kinematics_.rotary(k)] = solution.angle[k];
      out.sines[i] = kinematics_.sines(q);
    }
    out.linear[i] = kinematics_.linear_positions(pose.tip_P, out.sines[i]);
  }
}

// As many points as T holds, from `begin` on; the last one stands for those that are not there.
template <class T>
void PoseSolver::look_at(std::span<const ChoicePoint> points, std::size_t begin,
                         std::span<const std::uint8_t> wanted, SolvedBlock& out) const {
  const auto store = [&](auto& column, const auto& value) {
    std::memcpy(column.data() + begin, &value, sizeof(value));
  };
  std::array<const ToolPose*, lanes::kCount<T>> pose;
  unsigned bits = wanted.empty() ? 3U : 0U;
  for (std::size_t k = 0; k < pose.size(); ++k) {
    const std::size_t i = std::min(begin + k, points.size() - 1);
    pose[k] = &points[i].pose;
    if (!wanted.empty()) bits |= wanted[i];
  }
  const std::array<bool, 2> of_branch = {(bits & 1U) != 0, (bits & 2U) != 0};
  RotarySolver::Together<T> solved;
  solver_.solve_together(
      lanes::collect_vectors<T>([&](std::size_t k) -> const Vec3& { return pose[k]->axis_P; }), of_branch,
      solved);
  const auto tip_P = lanes::collect_vectors<T>([&](std::size_t k) -> const Vec3& { return pose[k]->tip_P; });
  store(out.known, solved.known);
  store(out.apart, solved.apart);
  for (std::size_t n = 0; n < 2; ++n) {
    SolvedBlock::Branch& of = out.branch[n];
    store(of.within, solved.within[n]);
    if (!of_branch[n] || !lanes::any(solved.within[n])) continue;
    const auto& sin = solved.sin[n];
    const auto& cos = solved.cos[n];
    const auto linear = kinematics_.linear_positions(tip_P, TableKinematics::SinesOf<T>{sin, cos});
    for (std::size_t k = 0; k < 2; ++k) {
      store(of.angle[k], solved.angle[n][k]);
      store(of.sin[k], sin[k]);
      store(of.cos[k], cos[k]);
    }
    store(of.linear[0], linear.x);
    store(of.linear[1], linear.y);
    store(of.linear[2], linear.z);
  }
}

void PoseSolver::look_ahead(std::span<const ChoicePoint> points, SolvedBlock& out,
                            std::span<const std::uint8_t> wanted) const {
  lanes::at_a_time(four_, [&]<class T>() {
    for (std::size_t i = 0; i < points.size(); i += lanes::kCount<T>) look_at<T>(points, i, wanted, out);
  });
}

const SolvedPose& PoseSolver::ahead(const SolvedBlock& block, std::size_t i) {
  ahead_.known = block.known[i] != 0;
  ahead_.rotary.count = 0;
  for (std::uint8_t branch = 0; branch < 2; ++branch) {
    const SolvedBlock::Branch& of = block.branch[branch];
    if (of.within[i] == 0) continue;
    const std::size_t n = ahead_.rotary.count++;
    ahead_.sines[n] = {{of.sin[0][i], of.sin[1][i]}, {of.cos[0][i], of.cos[1][i]}};
    ahead_.linear[n] = {of.linear[0][i], of.linear[1][i], of.linear[2][i]};
    ahead_.rotary.at[n] = {{of.angle[0][i], of.angle[1][i]}, ahead_.sines[n], true, branch, false};
  }
  return ahead_;
}

}  // namespace trunnion::path
