#pragma once
#include <string>

#include "trunnion/machine/machine.hpp"

namespace trunnion::report {

/// What `trunnion machine` says: {"name", "tool_chain", "part_chain", "output_point", "gauge_length_mm",
/// "axes": [{"name", "motion", "travel", "rapid"}], "proving_program"}; the words are post::describe_axes'.
std::string machine_json(const Machine& machine, const std::string& proving_program);

}  // namespace trunnion::report
