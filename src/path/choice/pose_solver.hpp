#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "trunnion/machine/rotary_solver.hpp"
#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/solution_choice.hpp"

namespace trunnion::path {

/// The inverse of a pose, turns aside.
struct SolvedPose {
  RotarySolutions rotary;
  std::array<RotarySines, 2> sines;  // of the angles
  std::array<Vec3, 2> linear;        // positions of the linear axes: the same for every turn
  bool follows_seed = false;         // C may be the seed's: at the pole
  bool known = false;                // of those looked up ahead
};

/// The inverse of a few poses, a column for each quantity.
struct SolvedBlock {
  static constexpr std::size_t kMost = 64;
  template <class T>
  using Column = std::array<T, kMost>;
  struct Branch {
    Column<std::int64_t> within;                    // not 0: the limits leave it
    std::array<Column<double>, 2> angle, sin, cos;  // outer and inner axis
    std::array<Column<double>, 3> linear;
  };
  SolvedBlock() {}             // its numbers come with the poses
  Column<std::int64_t> known;  // 0: it needs the general way
  std::array<Branch, 2> branch;
  Column<double> apart;  // RotarySolver::apart, on both branches
};

/// Solves poses one by one, and where the machine's chain allows it a few at a time.
class PoseSolver {
 public:
  /// `kinematics` must outlive this.
  PoseSolver(const Machine& machine, const TableKinematics& kinematics, const InverseOptions& inverse)
      : kinematics_(kinematics), inverse_(inverse), solver_(machine), way_(lanes::way()) {}

  /// C at the pole follows `seed_inner`.
  void solve(const ToolPose& pose, double seed_inner, SolvedPose& out) const;

  /// So many points can be looked up at once.
  static constexpr std::size_t kAhead = SolvedBlock::kMost;
  bool looks_ahead() const { return kinematics_.side_by_side(); }
  /// Of each point the branches that are asked for, a bit each.
  using Wanted = std::array<std::uint8_t, kAhead>;
  /// Up to kAhead points; those that need the general way are not `known`. `wanted`: null for all.
  void look_ahead(std::span<const ChoicePoint> points, SolvedBlock& out,
                  const Wanted* wanted = nullptr) const;
  /// Pose number `i` of a block, until the next one is asked for.
  const SolvedPose& ahead(const SolvedBlock& block, std::size_t i);
  const RotarySolver& rotary() const { return solver_; }

 private:
  template <class T>
  void look_at(std::span<const ChoicePoint> points, const Wanted* wanted, SolvedBlock& out) const;
  template <class T>
  void put(std::size_t row, const RotarySolver::Turned<T>& turned, unsigned wanted,
           const lanes::Triple<T>& tip_P, SolvedBlock& out) const;
  const TableKinematics& kinematics_;
  InverseOptions inverse_;
  RotarySolver solver_;
  lanes::Way way_;
  SolvedPose ahead_;
};

}  // namespace trunnion::path
