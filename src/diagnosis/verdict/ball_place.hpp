#pragma once
#include "trunnion/diagnosis/bookkeeping.hpp"

namespace trunnion::diagnosis {

/// How far the measured point wanders on the part (P, nominal), at most from its middle, mm: of each run with
/// displacements in which a rotary axis turns by half a degree and more; one value each. A ball that stands
/// on the table has one place, so positions, tools and machine that are right give nearly nothing, whatever
/// the readings are.
std::vector<double> ball_wanders_mm(const Machine& machine, const Dataset& data);

/// Whether the convention changes positions, tools or the machine that they go through.
bool moves_the_ball(const Convention& convention);

inline constexpr double kBallStands_mm = 0.05;  // digits of positions and of the ball's own place
inline constexpr double kBallWanders_mm = 1.0;

/// Positions that hold the ball still as they are, and would not with this convention put right.
bool refuted_by_the_ball(const Machine& machine, const Model& model, const Dataset& data,
                         const Convention& convention);
/// Positions that lead the ball about in a run as they are, and hold it still in every run with this put
/// right.
bool proved_by_the_ball(const Machine& machine, const Model& model, const Dataset& data,
                        const Convention& convention);

}  // namespace trunnion::diagnosis
