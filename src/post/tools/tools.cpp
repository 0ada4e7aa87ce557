#include "trunnion/post/tools.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {
namespace {

// One length in a file of inches, written with six and with eight digits.
constexpr double kSameLength_mm = 0.001;

}  // namespace

std::string gauge_text(double mm) {
  constexpr double kDigits_per_mm = 1e4;
  return shortest_text(std::round(mm * kDigits_per_mm) / kDigits_per_mm);
}

const Tool* ToolOptions::find(std::uint32_t number) const {
  if (table == nullptr) return nullptr;
  const auto it = table->find(number);
  return it == table->end() ? nullptr : &it->second;
}

double FluteLength::found_mm() const {
  if (options_.flute_mm) return *options_.flute_mm;
  const Tool* known = tool_ ? options_.find(*tool_) : nullptr;
  if (known != nullptr && known->flute_length_mm) return *known->flute_length_mm;
  return of_cutter_mm_.value_or(0.0);
}

ProgramTools::ProgramTools(const Machine& machine, const ToolOptions& options, bool registers_hold_lengths)
    : machine_(machine), options_(options), registers_hold_lengths_(registers_hold_lengths) {
  if (options.table == nullptr) return;
  for (const auto& [number, tool] : *options.table) {
    const std::uint32_t length_register = tool.length_register.value_or(number);
    of_register_.emplace(length_register,
                         LoadedTool{number, tool.length_mm, length_register, LengthSource::tool_file});
  }
}

const LoadedTool* ProgramTools::find(std::uint32_t number) const {
  const auto it =
      std::find_if(loaded_.begin(), loaded_.end(), [&](const LoadedTool& t) { return t.number == number; });
  return it == loaded_.end() ? nullptr : &*it;
}

std::optional<double> ProgramTools::length_of(std::uint32_t number) const {
  if (const LoadedTool* tool = find(number)) return tool->length_mm;
  const Tool* known = options_.find(number);
  return known == nullptr ? std::nullopt : std::optional(known->length_mm);
}

Result<cl::ToolChange> ProgramTools::load(const cl::ToolChange& word, const std::string& cl_file,
                                          SourceRef where) {
  LoadedTool tool{word.number, length_of_nobody(), word.length_register.value_or(word.number),
                  source_of_nobody()};
  const Tool* known = options_.find(word.number);
  if (known != nullptr) {
    tool.length_mm = known->length_mm;
    tool.source = LengthSource::tool_file;
    note_other_length(word, known->length_mm);
    if (!word.length_register) tool.length_register = known->length_register.value_or(word.number);
  } else if (word.gauge_length_mm) {
    tool.length_mm = *word.gauge_length_mm;
    tool.source = LengthSource::cl_file;
  }
  if (const LoadedTool* before = find(word.number)) {
    // A tool that is loaded again keeps the length that its first word gave.
    if ((!word.gauge_length_mm && before->source == LengthSource::cl_file) ||
        std::abs(before->length_mm - tool.length_mm) <= kSameLength_mm) {
      tool.length_mm = before->length_mm;
    } else {
      return fail(ErrorCode::wrong_input,
                  "tool " + std::to_string(word.number) + " has a gauge length of " +
                      shortest_text(tool.length_mm) + " mm here and was loaded with " +
                      shortest_text(before->length_mm) + " mm before",
                  cl_file, where);
    }
  } else {
    add(tool);
  }
  if (const auto fault = take_register(tool)) return fail(ErrorCode::wrong_input, *fault, cl_file, where);
  cl::ToolChange out = word;
  out.length_register = tool.length_register;
  out.gauge_length_mm = tool.length_mm;
  return out;
}

// What a tool measures differs from what was planned; by more than this it is another tool, or in another
// unit, and what the CAM system found of collisions is not true of it.
void ProgramTools::note_other_length(const cl::ToolChange& word, double length_mm) {
  constexpr double kShare = 0.05;
  if (!word.gauge_length_mm || find(word.number) != nullptr ||
      std::abs(*word.gauge_length_mm - length_mm) <= kShare * length_mm)
    return;
  other_lengths_ += (other_lengths_.empty() ? "tool " : ", tool ") + std::to_string(word.number) + " " +
                    shortest_text(*word.gauge_length_mm) + " mm and " + shortest_text(length_mm) + " mm";
}

std::optional<std::string> ProgramTools::take_register(const LoadedTool& tool) {
  if (!registers_hold_lengths_) return std::nullopt;
  const auto [it, is_new] = of_register_.emplace(tool.length_register, tool);
  const LoadedTool& first = it->second;
  if (is_new || first.number == tool.number) return std::nullopt;
  const std::string both = "length register " + std::to_string(tool.length_register) + " is that of tool " +
                           std::to_string(*first.number) + " with " + shortest_text(first.length_mm) +
                           " mm and of tool " + std::to_string(*tool.number) + " with " +
                           shortest_text(tool.length_mm) + " mm";
  if (first.length_mm != tool.length_mm)
    return both + ": it holds one length, and the control would add it to both";
  if (share_register_.empty()) share_register_ = both;
  return std::nullopt;
}

// Most shops give a tool the register of its own number.
void ProgramTools::warn_of_crossed_registers(const std::string& cl_file, Diagnostics& diagnostics) const {
  if (!registers_hold_lengths_) return;
  for (const LoadedTool& tool : loaded_) {
    if (!tool.number || tool.length_register == *tool.number || !length_of(tool.length_register)) continue;
    diagnostics.warning_once("crossed registers", cl_file, {},
                             "tool " + std::to_string(*tool.number) + " (" + gauge_text(tool.length_mm) +
                                 " mm) takes length register " + std::to_string(tool.length_register) +
                                 ", and there is a tool of that number with " +
                                 gauge_text(*length_of(tool.length_register)) +
                                 " mm: which length does the control hold in that register?");
  }
}

void ProgramTools::warn(const std::string& cl_file, Diagnostics& diagnostics) const {
  warn_of_crossed_registers(cl_file, diagnostics);
  if (!share_register_.empty())
    diagnostics.warning(
        cl_file, {},
        share_register_ +
            ": the register holds one length, so both tools must be set to exactly this length; give each "
            "its own (LOADTL/n,ADJUST,r or the column 'register' of a tool file)");
  if (!other_lengths_.empty())
    diagnostics.warning(cl_file, {},
                        "the gauge lengths of the CL file and of the tool file (which is used) differ: " +
                            other_lengths_ + ": is it the same tool, and in mm?");
  for (const LoadedTool& tool : loaded_) {
    if (!(tool.length_mm > 0.0) || tool.length_mm >= kShortestGauge_mm) continue;
    diagnostics.warning(cl_file, {},
                        (tool.number ? "tool " + std::to_string(*tool.number) + " has" : "the tool has") +
                            std::string(" a gauge length of ") + shortest_text(tool.length_mm) +
                            " mm, shorter than tool holders are: is it in inches?" +
                            (machine_.output_point == OutputPoint::spindle
                                 ? " The words are those of the spindle's gauge point: a tool that is longer "
                                   "cuts deeper by as much"
                                 : ""));
  }
  warn_of_forgotten(cl_file, diagnostics);
  warn_of_machine_file(cl_file, diagnostics);
}

// One that the tool file leaves out has been forgotten there, sooner than it is as long as that option says.
void ProgramTools::warn_of_forgotten(const std::string& cl_file, Diagnostics& diagnostics) const {
  if (options_.table == nullptr) return;
  std::string names;
  for (const LoadedTool& tool : loaded_)
    if (tool.number && tool.source == LengthSource::option)
      names += (names.empty() ? "" : ", ") + std::to_string(*tool.number);
  if (!names.empty())
    diagnostics.warning(cl_file, {},
                        "not in the tool file, and taken to be as long as --tool-length-mm says, " +
                            shortest_text(length_of_nobody()) + " mm: tool " + names);
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
