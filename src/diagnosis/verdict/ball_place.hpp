#pragma once
#include "trunnion/diagnosis/bookkeeping.hpp"

namespace trunnion::diagnosis {

/// A run with displacements in which a rotary axis turns by half a degree and more.
struct TurningRun {
  std::size_t run = 0;
  std::vector<std::size_t> rows;  // in the order of the readings
  double wanders_mm = 0.0;        // of the measured point on the part (P, nominal), at most from its middle
  /// Linear axes go along by more than `kBallWanders_mm`. One that measures the turning table from a fixed
  /// place has no ball that could stand still.
  bool follows = false;
};
/// A ball that stands on the table has one place, so positions, tools and machine that are right let it
/// wander by nearly nothing, whatever the readings are.
std::vector<TurningRun> turning_runs(const Machine& machine, const Dataset& data);

/// Whether the convention changes positions, tools or the machine that they go through.
bool moves_the_ball(const Convention& convention);

inline constexpr double kBallStands_mm = 0.05;  // digits of positions and of the ball's own place
inline constexpr double kBallWanders_mm = 1.0;

/// Positions that hold the ball still as they are, and would not with this convention put right.
bool refuted_by_the_ball(const Machine& machine, const Model& model, const Dataset& data,
                         const Convention& convention);
/// Positions that lead the ball about in a run that follows it as they are, and hold it still in every such
/// run with this put right; of a convention of one run, in that one.
bool proved_by_the_ball(const Machine& machine, const Model& model, const Dataset& data,
                        const Convention& convention);

/// A sentence about runs that lead the measured point about while it stands still in another run; empty: none
/// does. It may be no ball: then nothing is wrong.
std::string wandering_text(const Machine& machine, const Dataset& data);

}  // namespace trunnion::diagnosis
