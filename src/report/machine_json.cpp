#include "trunnion/report/machine_json.hpp"

#include <nlohmann/json.hpp>

#include "trunnion/post/program_zero.hpp"
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

std::string machine_json(const Machine& machine, const nc::Controller& controller,
                         const std::string& proving_program) {
  ordered_json axes = ordered_json::array();
  for (const post::AxisWords& axis : post::describe_axes(machine))
    axes.push_back(
        {{"name", axis.name}, {"motion", axis.motion}, {"travel", axis.limits}, {"rapid", axis.rapid}});
  const auto zero_of = [&](post::WordsOf words) {
    const auto zero = post::program_zero(machine, controller, machine.work_offset, words);
    const auto place = [](const post::ProgramZero::Place& p) {
      ordered_json at = ordered_json::object();
      for (std::size_t i = 0; i < p.axes.size(); ++i) at[p.axes[i] + "_mm"] = p.at_mm[i];
      return at;
    };
    return ordered_json{{"work_offset", zero.offset_name},
                        {"offset_at_machine", place(zero.offset)},
                        {"part_zero_at_machine", place(zero.part_zero)},
                        {"text", post::zero_lines(zero)}};
  };
  ordered_json zero = {
      {"without_tool_centre_point",
       zero_of(machine.output_point == OutputPoint::tip ? post::WordsOf::tip : post::WordsOf::spindle)}};
  if (controller.has_tcp()) zero["tool_centre_point"] = zero_of(post::WordsOf::part);
  const ordered_json out = {{"name", machine.name},
                            {"tool_chain", names_of(machine, machine.tool_chain)},
                            {"part_chain", names_of(machine, machine.part_chain)},
                            {"output_point", machine.output_point == OutputPoint::tip ? "tip" : "spindle"},
                            {"gauge_length_mm", machine.tool_length_mm},
                            {"program_zero", zero},
                            {"axes", axes},
                            {"proving_program", proving_program}};
  return json_text(out);
}

}  // namespace trunnion::report
