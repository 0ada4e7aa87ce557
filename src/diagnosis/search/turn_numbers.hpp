#pragma once
#include "diagnosis/search/search.hpp"

namespace trunnion::diagnosis {

/// Other whole numbers of periods a turn with which `member` of `set` explains these readings as well as with
/// its own, ascending, one of each that lie next to one another. Positions on a grid, N of them a turn, show
/// n as they show k N - n and k N + n. Nothing for effects that have no such number.
std::vector<double> numbers_alike(const Atoms& atoms, const EffectSet& set, std::size_t member,
                                  double variance);

/// `set` with `member` at another number.
EffectSet with_number(const Atoms& atoms, EffectSet set, std::size_t member, double number);

}  // namespace trunnion::diagnosis
