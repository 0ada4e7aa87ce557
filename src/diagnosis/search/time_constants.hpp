#pragma once
#include "diagnosis/search/atoms.hpp"

namespace trunnion::diagnosis {

/// Whether the effect follows something with a lag whose time constant is
/// searched.
bool has_lag(const EffectInfo& info);

/// The members of a set with the time constants that fit best, all moved
/// together: two that show the same error give way to each other, so that one
/// after the other stops far short. The members themselves where none has a
/// lag.
std::vector<Atom> with_best_lags(const Atoms& atoms, std::vector<Atom> members, double variance);

}  // namespace trunnion::diagnosis
