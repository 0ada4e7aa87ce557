#pragma once
#include <string>

#include "trunnion/machine/body_meshes.hpp"
#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"
#include "trunnion/report/command_pages.hpp"

namespace trunnion::report {

/// What `trunnion machine` says: {"name", "tool_chain", "part_chain", "output_point", "gauge_length_mm",
/// "program_zero": {"without_tool_centre_point", "tool_centre_point": {"work_offset",
/// "offset_at_machine", "part_zero_at_machine", "text"}}, "axes": [{"name", "motion", "travel", "rapid"}],
/// "proving_program"}; the words are post::describe_axes'.
std::string machine_json(const Machine& machine, const nc::Controller& controller,
                         const std::string& proving_program);

/// `machine`: the machine as solids whose axes the reader moves, with arrows for their + directions, what a
/// positive command does in words, program zero, and the proving program. `result.json` is machine_json's.
/// `bodies` are the shapes of the machine file.
Page machine_page(const Machine& machine, const std::vector<BodyMesh>& bodies, const ResultText& result);

}  // namespace trunnion::report
