#pragma once
#include <optional>
#include <string>

#include "trunnion/diagnosis/measurement.hpp"

namespace trunnion::diagnosis {

/// Of the column `unit` of a measurement file, to mm or rad; nothing for a unit of another quantity.
std::optional<double> factor_of_unit(Quantity quantity, const std::string& unit);

}  // namespace trunnion::diagnosis
