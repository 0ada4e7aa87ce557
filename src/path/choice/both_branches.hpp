#pragma once
#include <span>

#include "path/choice/choice_in_work.hpp"

namespace trunnion::path {

// The second step of a choice, for what a run at small tilts consists of: points that both branches reach in
// one turn each. Nothing was left out before them.

/// Goes on to a point that is reached from at most two positions. False, and nothing done: another case.
bool add_both(ChoiceInWork& work, const ChoicePoint& point, const SolvedPose& solved);

/// The same for points from number `first` on where each branch is reached from itself by a small step, and
/// to come from the other one takes more for the turn alone. Gives where it ends, `end` at most.
std::size_t follow_both(ChoiceInWork& work, std::span<const ChoicePoint> points, std::size_t first,
                        std::size_t end);

}  // namespace trunnion::path
