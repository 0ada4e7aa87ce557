#include "path/choice/pose_solver.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

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

// As many points as T holds at a time; the last one stands for those that are not there. In two steps, so
// that the roots and divisions of one few do not wait for those of the few before.
template <class T>
void PoseSolver::look_at(std::span<const ChoicePoint> points, const Wanted* wanted, SolvedBlock& out) const {
  constexpr std::size_t kTogether = lanes::kCount<T>;
  std::array<RotarySolver::Turned<T>, kAhead / kTogether> turned;
  std::array<ChoicePoint, kTogether> last;
  const auto from = [&](std::size_t i) {
    if (i + kTogether <= points.size()) return points.data() + i;
    for (std::size_t k = 0; k < kTogether; ++k) last[k] = points[std::min(i + k, points.size() - 1)];
    return std::as_const(last).data();
  };
  const auto few = [](const ChoicePoint* first, Vec3 ToolPose::*of) {
    return lanes::collect_vectors<T>([first, of](std::size_t k) -> const Vec3& { return first[k].pose.*of; });
  };
  for (std::size_t i = 0; i < points.size(); i += kTogether)
    solver_.turn_to(few(from(i), &ToolPose::axis_P), turned[i / kTogether]);
  for (std::size_t i = 0; i < points.size(); i += kTogether) {
    unsigned bits = wanted == nullptr ? 3U : 0U;
    for (std::size_t k = 0; wanted != nullptr && k < kTogether; ++k) bits |= (*wanted)[i + k];
    put(i, turned[i / kTogether], bits, few(from(i), &ToolPose::tip_P), out);
  }
}

// `wanted`: a bit for each branch.
template <class T>
void PoseSolver::put(std::size_t row, const RotarySolver::Turned<T>& turned, unsigned wanted,
                     const lanes::Triple<T>& tip_P, SolvedBlock& out) const {
  const auto store = [&](auto& column, const auto& value) {
    std::memcpy(column.data() + row, &value, sizeof(value));
  };
  const std::array<bool, 2> of_branch = {(wanted & 1U) != 0 && lanes::any(turned.within[0]),
                                         (wanted & 2U) != 0 && lanes::any(turned.within[1])};
  RotarySolver::Positions<T> found;
  solver_.find_positions(turned, of_branch, found);
  store(out.known, turned.known);
  store(out.apart, turned.apart);
  for (std::size_t n = 0; n < 2; ++n) {
    SolvedBlock::Branch& of = out.branch[n];
    store(of.within, turned.within[n]);
    if (!of_branch[n]) continue;
    const auto& sin = found.sin[n];
    const auto& cos = found.cos[n];
    const auto linear = kinematics_.linear_positions(tip_P, TableKinematics::SinesOf<T>{sin, cos});
    for (std::size_t k = 0; k < 2; ++k) {
      store(of.angle[k], found.angle[n][k]);
      store(of.sin[k], sin[k]);
      store(of.cos[k], cos[k]);
    }
    store(of.linear[0], linear.x);
    store(of.linear[1], linear.y);
    store(of.linear[2], linear.z);
  }
}

void PoseSolver::look_ahead(std::span<const ChoicePoint> points, SolvedBlock& out,
                            const Wanted* wanted) const {
  lanes::at_a_time(way_, [&]<class T>() { look_at<T>(points, wanted, out); });
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
