#pragma once
#include <string>

#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::report {

/// What `trunnion machine` says: {"name", "tool_chain", "part_chain", "output_point", "gauge_length_mm",
/// "program_zero": {"without_tool_centre_point", "tool_centre_point": {"work_offset",
/// "offset_at_machine", "part_zero_at_machine", "text"}}, "axes": [{"name", "motion", "travel", "rapid"}],
/// "proving_program"}; the words are post::describe_axes'.
std::string machine_json(const Machine& machine, const nc::Controller& controller,
                         const std::string& proving_program);

}  // namespace trunnion::report
