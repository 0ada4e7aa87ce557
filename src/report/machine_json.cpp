#include "trunnion/report/machine_json.hpp"

#include <nlohmann/json.hpp>

#include "trunnion/post/proving.hpp"

#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;

ordered_json names_of(const Machine& machine, const std::vector<AxisId>& chain) {
  ordered_json out = ordered_json::array();
  for (const AxisId id : chain) out.push_back(machine.axes[id].name);
  return out;
}

}  // namespace

std::string machine_json(const Machine& machine, const std::string& proving_program) {
  ordered_json axes = ordered_json::array();
  for (const post::AxisWords& axis : post::describe_axes(machine))
    axes.push_back(
        {{"name", axis.name}, {"motion", axis.motion}, {"travel", axis.limits}, {"rapid", axis.rapid}});
  const ordered_json out = {{"name", machine.name},
                            {"tool_chain", names_of(machine, machine.tool_chain)},
                            {"part_chain", names_of(machine, machine.part_chain)},
                            {"output_point", machine.output_point == OutputPoint::tip ? "tip" : "spindle"},
                            {"gauge_length_mm", machine.tool_length_mm},
                            {"axes", axes},
                            {"proving_program", proving_program}};
  return json_text(out);
}

}  // namespace trunnion::report
