#pragma once
#include "diagnosis/search/search.hpp"

namespace trunnion::diagnosis {

/// Other whole numbers of periods a turn with which `member` of `set` explains these readings as well as with
/// its own, ascending, one of each that lie next to one another. Positions on a grid, N of them a turn, show
/// n as they show k N - n and k N + n. Nothing for effects that have no such number.
std::vector<double> numbers_alike(const Atoms& atoms, const EffectSet& set, std::size_t member,
                                  double variance);

/// Other periods (mm) with which a `periodic:` member explains these readings as well, the longest first, one
/// of each line. Positions on a grid of step d show p as they show 1/(k/d + 1/p) and 1/(k/d - 1/p). Nothing
/// where the period is a known one of the screw.
std::vector<double> periods_alike(const Atoms& atoms, const EffectSet& set, std::size_t member,
                                  double variance);

/// Whether a wave longer than any period of the library does what a `periodic:` member does: then it is a
/// smooth error that these positions see through the member.
bool may_be_smooth(const Atoms& atoms, const EffectSet& set, std::size_t member, double variance);

/// `set` with `member` at another number or period.
EffectSet with_number(const Atoms& atoms, EffectSet set, std::size_t member, double number);

}  // namespace trunnion::diagnosis
