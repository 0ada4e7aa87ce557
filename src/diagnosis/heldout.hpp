#pragma once
#include <optional>

#include "diagnosis/search.hpp"

namespace trunnion::diagnosis {

/// Leave-one-run-out: every run is predicted by the parameters that the others give; its own set-up is
/// fitted.
struct HeldOut {
  double rms_um = 0.0;             // over all runs that the others can predict; rotations as um at 1 m
  std::vector<double> run_rms_um;  // of each run
};
/// Nothing with fewer than two runs.
std::optional<HeldOut> held_out(const Atoms& atoms, const std::vector<Atom>& set);

}  // namespace trunnion::diagnosis
