#pragma once
#include <optional>
#include <string>

#include "trunnion/machine/machine.hpp"
#include "trunnion/probe/program.hpp"

namespace trunnion::probe {

/// Why, while the joints go straight from one place to another, the stylus or the body of the probe comes
/// nearer than Ball::within_mm and the clearance to what stands beside the ball as far as it is given: to its
/// stem, to the table, the body also to the ball. Nothing: it does not. The stylus is a cylinder of its
/// ball's radius.
std::optional<std::string> obstructed_move(const Machine& machine, const Ball& ball, const JointVector& from,
                                           const JointVector& to);
/// The same for a touch, up to where it meets the ball, wherever within Ball::within_mm that is: nothing but
/// the ball is met before it.
std::optional<std::string> obstructed_touch(const Machine& machine, const Ball& ball, const JointVector& from,
                                            const JointVector& to);

/// Why the stylus at the safe height does not clear the ball, its stem or the probe's body the ball in every
/// position of the rotary axes within their limits.
std::optional<std::string> swept_ball_fault(const Machine& machine, const Ball& ball);
/// The same for one turn, X and Y standing: `from` has them. The axes may arrive one after the other, in any
/// order. Moves along X and Y, too.
std::optional<std::string> turn_fault(const Machine& machine, const Ball& ball, const JointVector& from,
                                      const JointVector& to);

/// Above this height of the stylus ball's centre, along Z of M over the part, mm, nothing that belongs to the
/// ball is ever met, even where the machine file has the sense of a rotary axis wrong.
double never_met_above_mm(const Machine& machine, const Ball& ball);

}  // namespace trunnion::probe
