#pragma once
#include <string>

#include "diagnosis/fit/observations.hpp"

namespace trunnion::diagnosis {

/// " T_screw_X_degC and ... stand at one value ...": thermometers that say the same in all rows while a run
/// lasts half an hour or more were hardly read, and what follows them cannot be found. Empty where there are
/// none.
std::string constant_sensors_text(const Observations& o);

}  // namespace trunnion::diagnosis
