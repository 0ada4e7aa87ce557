#pragma once
#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/search/search.hpp"

namespace trunnion::diagnosis {

/// The run of the menu that best separates `found` from its rivals per chance of a wrong name (T-optimality,
/// Atkinson and Fedorov 1975); without rivals (nothing testable) the one that excites most effects. Nothing
/// when no run helps.
std::optional<NextMeasurement> next_measurement(const Atoms& atoms, const EffectSet& found,
                                                const std::vector<EffectSet>& rivals,
                                                const NoiseScale& noise);

/// Where a fit leaves combinations of parameters more uncertain than their usual size: the runs of the menu
/// (at most two) that decide most of them. A ball on the table, at another place or with another tool, goes
/// before all else where one was measured. Nothing when no run decides any.
std::optional<NextMeasurement> next_for_open_parameters(const Observations& observations, const FitCore& fit);

/// Runs that a shop can make on this machine, with their time: laser sweeps, diagonals, ball-bar, R-test,
/// straightness and angle, warm-up, spindle ramp; noise as in the data.
std::vector<PlanRun> menu(const Observations& observations);
std::vector<PlanRun> menu(const Machine& machine, double u_mm, double u_rad);

}  // namespace trunnion::diagnosis
