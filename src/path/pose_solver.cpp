#include "path/pose_solver.hpp"

#include <algorithm>

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

void PoseSolver::look_ahead(std::span<const ChoicePoint> points, std::span<const std::uint8_t> wanted) {
  for (std::size_t i = 0; i < points.size(); i += 2) {
    // An odd last one stands for two.
    const std::size_t j = std::min(i + 1, points.size() - 1);
    const std::array<const ToolPose*, 2> pose = {&points[i].pose, &points[j].pose};
    const unsigned bits = wanted.empty() ? 3U : unsigned{wanted[i]} | wanted[j];
    const std::array<bool, 2> of_branch = {(bits & 1U) != 0, (bits & 2U) != 0};
    const auto side_by_side = [&](const auto& of) {
      const Vec3& a = of(*pose[0]);
      const Vec3& b = of(*pose[1]);
      return lanes::Triple<Lanes>{{a.x(), b.x()}, {a.y(), b.y()}, {a.z(), b.z()}};
    };
    const RotarySolver::Pair solved = solver_.solve_pair(
        side_by_side([](const ToolPose& p) -> const Vec3& { return p.axis_P; }), of_branch);
    const auto tip_P = side_by_side([](const ToolPose& p) -> const Vec3& { return p.tip_P; });
    const std::size_t lanes_used = std::min<std::size_t>(2, points.size() - i);
    for (std::size_t lane = 0; lane < lanes_used; ++lane) {
      ahead_[i + lane].rotary.count = 0;
      ahead_[i + lane].known = solved.known[static_cast<int>(lane)] != 0;
    }
    for (std::uint8_t branch = 0; branch < 2; ++branch) {
      if (!lanes::any(solved.within[branch])) continue;
      if (!of_branch[branch]) {
        for (std::size_t lane = 0; lane < lanes_used; ++lane)
          ahead_[i + lane].rotary.count += solved.within[branch][static_cast<int>(lane)] != 0 ? 1U : 0U;
        continue;
      }
      const auto& sin = solved.sin[branch];
      const auto& cos = solved.cos[branch];
      const auto linear = kinematics_.linear_positions(tip_P, TableKinematics::SinesOf<Lanes>{sin, cos});
      for (std::size_t lane = 0; lane < lanes_used; ++lane) {
        const int l = static_cast<int>(lane);
        if (solved.within[branch][l] == 0) continue;
        SolvedPose& of = ahead_[i + lane];
        const std::size_t n = of.rotary.count++;
        of.sines[n] = {{sin[0][l], sin[1][l]}, {cos[0][l], cos[1][l]}};
        of.linear[n] = {linear.x[l], linear.y[l], linear.z[l]};
        of.rotary.at[n] = {
            {solved.angle[branch][0][l], solved.angle[branch][1][l]}, of.sines[n], true, branch, false};
      }
    }
  }
}

}  // namespace trunnion::path
