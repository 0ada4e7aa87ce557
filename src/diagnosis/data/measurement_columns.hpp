#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/config/csv.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion::diagnosis {

/// Which column of a measurement file holds what. Names and defaults: README of this layer, "Measurement
/// file".
struct MeasurementColumns {
  struct PerAxis {
    std::optional<std::size_t> position, direction, velocity;
  };
  struct Sensor {
    std::string name;
    std::size_t column = 0;
  };
  std::optional<std::size_t> run_id, time, rpm, quantity, frame, value, unit, u_random, u_common;
  std::array<std::optional<std::size_t>, 3> n, tool;
  std::vector<PerAxis> axes;  // as Machine::axes
  std::vector<Sensor> temperatures, states;
};

/// Column names of an axis.
std::string position_column(const Axis& axis);
std::string direction_column(const Axis& axis);
std::string velocity_column(const Axis& axis);

/// Sorts the header's columns; unknown ones (a misspelt column is never ignored), those of axes that the
/// machine lacks, and missing ones go to `diagnostics` as errors.
MeasurementColumns measurement_columns(const config::CsvTable& table, const Machine& machine,
                                       Diagnostics& diagnostics);

}  // namespace trunnion::diagnosis
