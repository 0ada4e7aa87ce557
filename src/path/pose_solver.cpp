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

void PoseSolver::look_ahead(std::span<const ChoicePoint> points, SolvedBlock& out,
                            std::span<const std::uint8_t> wanted) const {
  const auto store = [](auto& column, std::size_t row, const auto& two) {
    std::memcpy(column.data() + row, &two, sizeof(two));
  };
  for (std::size_t i = 0; i < points.size(); i += 2) {
    // An odd last one stands for two.
    const std::size_t j = std::min(i + 1, points.size() - 1);
    const ToolPose& a = points[i].pose;
    const ToolPose& b = points[j].pose;
    const unsigned bits = wanted.empty() ? 3U : unsigned{wanted[i]} | wanted[j];
    const std::array<bool, 2> of_branch = {(bits & 1U) != 0, (bits & 2U) != 0};
    const RotarySolver::Pair solved = solver_.solve_pair(lanes::side_by_side(a.axis_P, b.axis_P), of_branch);
    const auto tip_P = lanes::side_by_side(a.tip_P, b.tip_P);
    store(out.known, i, solved.known);
    store(out.apart, i, solved.apart);
    for (std::size_t n = 0; n < 2; ++n) {
      SolvedBlock::Branch& of = out.branch[n];
      store(of.within, i, solved.within[n]);
      if (!of_branch[n] || !lanes::any(solved.within[n])) continue;
      const auto& sin = solved.sin[n];
      const auto& cos = solved.cos[n];
      const auto linear = kinematics_.linear_positions(tip_P, TableKinematics::SinesOf<Lanes>{sin, cos});
      for (std::size_t k = 0; k < 2; ++k) {
        store(of.angle[k], i, solved.angle[n][k]);
        store(of.sin[k], i, sin[k]);
        store(of.cos[k], i, cos[k]);
      }
      store(of.linear[0], i, linear.x);
      store(of.linear[1], i, linear.y);
      store(of.linear[2], i, linear.z);
    }
  }
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
