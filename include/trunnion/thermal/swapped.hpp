#pragma once
#include <optional>
#include <string>

#include "trunnion/thermal/model.hpp"

namespace trunnion::thermal {

/// Two sensors of a run whose readings look exchanged (a plug in the wrong socket).
struct SwappedSensors {
  std::string one, other;
  /// Root mean square distance of the run from the training (Guard), as it is and with the two exchanged.
  double distance = 0.0, exchanged = 0.0;
};

/// Looks at a run that lies outside what a channel's model was taught, and tries each pair of sensors
/// exchanged: told is the pair that brings the run back to where the model is trusted, at less than half the
/// distance. Sensors that move alike cannot be told apart, and cost little.
std::optional<SwappedSensors> find_swapped(const ThermalModel& model, const Log& log, const LogRun& run);

}  // namespace trunnion::thermal
