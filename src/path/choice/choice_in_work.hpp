#pragma once
#include <array>
#include <span>
#include <vector>

#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/solution_choice.hpp"

#include "path/choice/choice_steps.hpp"
#include "path/choice/pose_solver.hpp"
#include "path/choice/step_traces.hpp"

namespace trunnion::path {

/// A position of a point, and the cheapest way to it.
struct Candidate : ChoicePosition {
  Candidate() = default;
  /// Solution number `of` of the inverse, in these turns of its angles.
  Candidate(const SolvedPose& solved, std::size_t of, const std::array<double, 2>& turned, TracedStep by)
      : sines(solved.sines[of]),
        step(by),
        solution(static_cast<std::uint8_t>(of)),
        singular(solved.rotary.at[of].singular) {
    angle = turned;
    linear = solved.linear[of];
    branch = solved.rotary.at[of].branch;
  }

  RotarySines sines;  // of the angles
  double cost = 0.0;
  TracedStep step;
  std::uint8_t solution = 0;
  bool singular = false;
  bool reconfigure = false;
};

/// The positions of the last point, and those of the next one as they are found.
class ChoiceFront {
 public:
  struct Layer {
    std::vector<Candidate> at;
    std::size_t count = 0;
  };
  Layer& before() { return layers_[now_]; }
  const Layer& before() const { return layers_[now_]; }
  Layer& after() { return layers_[1 - now_]; }
  /// Tool axis at the last point.
  const Vec3& axis_P() const { return axis_P_; }

  void start(const ChoicePosition& seed, const Vec3& axis_P) {
    for (Layer& layer : layers_) layer.at.resize(std::max<std::size_t>(2, layer.at.size()));
    before().count = 1;
    go_to_only(seed, axis_P);
  }
  /// The last point has this position, and what it took to come there decides nothing.
  void go_to_only(const ChoicePosition& position, const Vec3& axis_P) {
    Candidate& at = before().at[0];
    at = {};
    static_cast<ChoicePosition&>(at) = position;
    axis_P_ = axis_P;
  }
  /// The layer that was made is that of the last point.
  void go_on(const Vec3& axis_P) {
    now_ = 1 - now_;
    axis_P_ = axis_P;
  }
  void stay(const Vec3& axis_P) { axis_P_ = axis_P; }

 private:
  std::array<Layer, 2> layers_;
  std::size_t now_ = 0;
  Vec3 axis_P_ = Vec3::UnitZ();
};

/// Positions as joints. Axes that the choice does not know stay where the seed has them.
class ChosenJoints {
 public:
  /// `kinematics` must outlive this.
  explicit ChosenJoints(const TableKinematics& kinematics) : kinematics_(kinematics) {}
  void start(const JointVector& seed) { seed_ = seed; }

  ChoicePosition seed() const {
    ChoicePosition out;
    for (std::size_t k = 0; k < kinematics_.rotary_count(); ++k) out.angle[k] = seed_[kinematics_.rotary(k)];
    for (std::size_t k = 0; k < 3; ++k)
      out.linear[static_cast<Eigen::Index>(k)] = seed_[kinematics_.linear(k)];
    return out;
  }
  void put(const Candidate& chosen, ChosenPoint& out) const {
    JointVector q = seed_;
    for (std::size_t k = 0; k < kinematics_.rotary_count(); ++k) q[kinematics_.rotary(k)] = chosen.angle[k];
    for (std::size_t k = 0; k < 3; ++k)
      q[kinematics_.linear(k)] = chosen.linear[static_cast<Eigen::Index>(k)];
    out.q = out.q_leave = q;
    out.branch = chosen.branch;
    out.singular = chosen.singular;
    out.reconfigure = chosen.reconfigure;
    out.sines = {chosen.sines, chosen.angle};
  }
  /// The position of row `row` on this branch that was solved, in other turns; all but `reconfigure`.
  void put(const SolvedBlock::Branch& of, std::size_t row, const std::array<double, 2>& angle,
           std::uint8_t branch, ChosenPoint& out) const {
    for (std::size_t k = 0; k < 2; ++k) {
      const AxisId id = kinematics_.rotary(k);
      out.q[id] = out.q_leave[id] = out.sines.angle[k] = angle[k];
      out.sines.sines.sin[k] = of.sin[k][row];
      out.sines.sines.cos[k] = of.cos[k][row];
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const AxisId id = kinematics_.linear(k);
      out.q[id] = out.q_leave[id] = of.linear[k][row];
    }
    out.branch = branch;
    out.singular = false;
  }

 private:
  const TableKinematics& kinematics_;
  JointVector seed_;
};

/// What the parts of a choice share: the machine, and how far the search has come.
struct ChoiceInWork {
  ChoiceInWork(const Machine& machine, const ChoiceOptions& options)
      : kinematics(machine, options.tool_mm),
        steps(machine, kinematics, options),
        solver(machine, kinematics, options.inverse),
        joints(kinematics) {}
  // Its parts know each other's places.
  ChoiceInWork(const ChoiceInWork&) = delete;
  ChoiceInWork& operator=(const ChoiceInWork&) = delete;
  ~ChoiceInWork() = default;

  TableKinematics kinematics;
  ChoiceSteps steps;
  PoseSolver solver;
  ChosenJoints joints;
  std::size_t most_positions = 0;  // of a point, that are followed
  ChoiceFront front;
  StepTraces traces;
  // The inverse of the next points, from point number `block_from` on.
  SolvedBlock* block = nullptr;
  std::size_t block_from = 0;
};

/// Calls `visit(pick, solution, angle)` for the positions that are looked at from `from`, until it says true.
template <class Visit>
void visit_positions(const ChoiceInWork& work, const SolvedPose& solved, const ChoicePosition& from,
                     const Visit& visit) {
  const ChoiceSteps& steps = work.steps;
  std::size_t pick = 0;
  for (std::size_t n = 0; n < solved.rotary.count; ++n) {
    const RotarySolution& solution = solved.rotary.at[n];
    std::array<double, 2> angle = solution.angle;
    std::array<std::optional<Turns>, 2> several;
    std::array<std::size_t, 2> counts = {1, 1};
    for (std::size_t k = 0; k < steps.rotary_count(); ++k) {
      if (const auto only = steps.only_turn(k, solution.angle[k], from.angle[k])) {
        angle[k] = *only;
      } else {
        several[k].emplace(steps.turns(k, solution.angle[k], from.angle[k], work.most_positions / 2));
        counts[k] = several[k]->count();
      }
    }
    for (std::size_t i = 0; i < counts[0]; ++i) {
      if (several[0]) angle[0] = several[0]->at(i);
      for (std::size_t j = 0; j < counts[1]; ++j) {
        if (several[1]) angle[1] = several[1]->at(j);
        if (visit(pick++, n, angle)) return;
      }
    }
  }
}

}  // namespace trunnion::path
