#include "trunnion/post/tools.hpp"

#include <algorithm>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {

double FluteLength::found_mm() const {
  if (options_.flute_mm) return *options_.flute_mm;
  if (tool_ && options_.table != nullptr) {
    const auto known = options_.table->find(*tool_);
    if (known != options_.table->end() && known->second.flute_length_mm)
      return *known->second.flute_length_mm;
  }
  return of_cutter_mm_.value_or(0.0);
}

const LoadedTool* ProgramTools::find(std::uint32_t number) const {
  const auto it =
      std::find_if(loaded_.begin(), loaded_.end(), [&](const LoadedTool& t) { return t.number == number; });
  return it == loaded_.end() ? nullptr : &*it;
}

std::optional<double> ProgramTools::length_of(std::uint32_t number) const {
  if (const LoadedTool* tool = find(number)) return tool->length_mm;
  if (options_.table == nullptr) return std::nullopt;
  const auto it = options_.table->find(number);
  return it == options_.table->end() ? std::nullopt : std::optional(it->second.length_mm);
}

Result<cl::ToolChange> ProgramTools::load(const cl::ToolChange& word, const std::string& cl_file,
                                          SourceRef where) {
  LoadedTool tool{word.number, length_of_nobody(), word.length_register.value_or(word.number),
                  source_of_nobody()};
  const Tool* known = nullptr;
  if (options_.table != nullptr) {
    const auto it = options_.table->find(word.number);
    if (it != options_.table->end()) known = &it->second;
  }
  if (known != nullptr) {
    tool.length_mm = known->length_mm;
    tool.source = LengthSource::tool_file;
    if (!word.length_register) tool.length_register = known->length_register.value_or(word.number);
  } else if (word.gauge_length_mm) {
    tool.length_mm = *word.gauge_length_mm;
    tool.source = LengthSource::cl_file;
  }
  if (const LoadedTool* before = find(word.number)) {
    // A tool that is loaded again keeps the length that its first word gave.
    if (!word.gauge_length_mm && before->source == LengthSource::cl_file) {
      tool.length_mm = before->length_mm;
    } else if (before->length_mm != tool.length_mm) {
      return fail(ErrorCode::wrong_input,
                  "tool " + std::to_string(word.number) + " has a gauge length of " +
                      shortest_text(tool.length_mm) + " mm here and was loaded with " +
                      shortest_text(before->length_mm) + " mm before",
                  cl_file, where);
    }
  } else {
    add(tool);
  }
  cl::ToolChange out = word;
  out.length_register = tool.length_register;
  out.gauge_length_mm = tool.length_mm;
  return out;
}

void ProgramTools::warn_of_machine_file(const std::string& cl_file, Diagnostics& diagnostics) const {
  std::string names;
  std::size_t count = 0;
  for (const LoadedTool& tool : loaded_) {
    if (tool.source != LengthSource::machine_file) continue;
    if (!tool.number) {
      diagnostics.warning(cl_file, {},
                          "no tool is loaded: its gauge length is taken to be that of the machine file, " +
                              shortest_text(tool.length_mm) + " mm (--tool-length-mm gives another)");
      return;
    }
    ++count;
    names += (names.empty() ? "" : ", ") + std::to_string(*tool.number);
  }
  if (count == 0) return;
  diagnostics.warning(
      cl_file, {},
      std::string(count == 1 ? "tool " : "tools ") + names + (count == 1 ? " has" : " have") +
          " the gauge length of the machine file, " + shortest_text(machine_.tool_length_mm) +
          " mm: neither a tool file (--tools) nor LOADTL/n,LENGTH,l says how long " +
          (count == 1 ? "it is" : "they are") +
          (machine_.tool_length_mm > 0.0
               ? ""
               : "; limits and retracts count as if there were no tool between spindle and tip"));
}

}  // namespace trunnion::post
