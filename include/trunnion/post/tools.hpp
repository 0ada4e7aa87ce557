#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/cl/record.hpp"
#include "trunnion/machine/machine.hpp"

namespace trunnion::post {

/// No holder is shorter: a gauge length below it is in inches, or none.
inline constexpr double kShortestGauge_mm = 20.0;

/// A tool of the shop.
struct Tool {
  double length_mm = 0.0;  // gauge length: from the spindle gauge point S to the tip
  std::optional<double> radius_mm;
  std::optional<double> flute_length_mm;
  std::optional<std::uint32_t> length_register;  // nothing: the tool's number
};
using ToolTable = std::map<std::uint32_t, Tool>;  // by tool number

/// Reads a tool file: CSV with the columns `tool`, `length_mm` and, where they are given, `radius_mm`,
/// `flute_length_mm`, `register`; or, where the name ends in `.tbl`, LinuxCNC's tool table (T, Z, D; mm).
/// Tools of such a table without Z, or with Z0, were never measured and are left out. Errors with
/// file:line:column: unknown columns, a tool twice, a length that is not above 0, offsets in other axes.
Result<ToolTable> parse_tools(std::string_view text, const std::string& file, Diagnostics& diagnostics);
Result<ToolTable> load_tools(const std::string& path, Diagnostics& diagnostics);

/// A gauge length as the operator reads it, mm: to the fourth digit, since a file of inches has any number.
std::string gauge_text(double mm);

/// What is known of the tools of a program beside its CL file.
struct ToolOptions {
  const ToolTable* table = nullptr;  // must outlive its use; nothing: no tool file
  /// The program begins as if LOADTL with this number stood in front of the CL file, where that loads no tool
  /// before its first motion.
  std::optional<std::uint32_t> tool;
  std::optional<double> length_mm;  // in place of the machine file's
  /// Of every tool; nothing: of each what the tool file says, else the CL file.
  std::optional<double> flute_mm;

  /// Of the tool file; null: it has no such tool, or there is none.
  const Tool* find(std::uint32_t number) const;
};

/// The flute length of the tool in the spindle, mm: from its tip up its axis, as far as the tolerance holds
/// for every point of it; 0: for the tip alone. It is that of the options, else of the tool file, else the
/// height h of the CL file's last CUTTER/d,r,e,f,alpha,beta,h.
class FluteLength {
 public:
  /// `options` must outlive the object.
  explicit FluteLength(const ToolOptions& options) : options_(options), mm_(found_mm()) {}
  void take(const cl::ToolChange& change) {
    tool_ = change.number;
    mm_ = found_mm();
  }
  void take(const cl::ToolGeometry& cutter) {
    of_cutter_mm_ = cutter.flute_length_mm;
    mm_ = found_mm();
  }
  double mm() const { return mm_; }

 private:
  double found_mm() const;

  const ToolOptions& options_;
  std::optional<std::uint32_t> tool_;
  std::optional<double> of_cutter_mm_;
  double mm_;
};

/// Who says how long a tool is: the first of these that does.
enum class LengthSource : std::uint8_t { tool_file, cl_file, option, machine_file };

/// A tool that a program loads.
struct LoadedTool {
  std::optional<std::uint32_t> number;  // nothing: the CL file loads none
  double length_mm = 0.0;
  std::uint32_t length_register = 0;
  LengthSource source = LengthSource::machine_file;
};

/// The tools of one program, in the order in which its CL file loads them, and their gauge lengths.
class ProgramTools {
 public:
  /// References must outlive the object. `registers_hold_lengths`: the control adds the length that stands in
  /// the register of the program's words, not one that belongs to the tool.
  ProgramTools(const Machine& machine, const ToolOptions& options, bool registers_hold_lengths);

  /// The word with its length register and gauge length filled in. Fails with wrong_input when it gives a
  /// tool another length than it was loaded with before, or where a tool of another length, loaded or of the
  /// tool file, has its register.
  Result<cl::ToolChange> load(const cl::ToolChange& word, const std::string& cl_file, SourceRef where);
  /// The CL file moves and has loaded no tool.
  void move_without_tool() { add({std::nullopt, length_of_nobody(), 0, source_of_nobody()}); }
  /// Gauge length of whatever is in the spindle before a tool is loaded.
  double length_of_nobody() const { return options_.length_mm.value_or(machine_.tool_length_mm); }
  /// Of a tool that was loaded, or that the tool file has.
  std::optional<double> length_of(std::uint32_t number) const;

  const std::vector<LoadedTool>& loaded() const { return loaded_; }
  /// One warning that names the tools whose gauge length is the machine file's for want of another, one that
  /// names those that share a register, one of a tool whose register has the number of another tool, one that
  /// names those that are much longer or shorter in the CL file.
  void warn(const std::string& cl_file, Diagnostics& diagnostics) const;

 private:
  LengthSource source_of_nobody() const {
    return options_.length_mm ? LengthSource::option : LengthSource::machine_file;
  }
  const LoadedTool* find(std::uint32_t number) const;
  void add(const LoadedTool& tool) { loaded_.push_back(tool); }
  /// What is wrong with the tool's register beside those that are known; nothing: it is right.
  std::optional<std::string> take_register(const LoadedTool& tool);
  void note_other_length(const cl::ToolChange& word, double length_mm);
  void warn_of_crossed_registers(const std::string& cl_file, Diagnostics& diagnostics) const;
  void warn_of_forgotten(const std::string& cl_file, Diagnostics& diagnostics) const;
  void warn_of_machine_file(const std::string& cl_file, Diagnostics& diagnostics) const;

  const Machine& machine_;
  const ToolOptions& options_;
  bool registers_hold_lengths_;
  std::map<std::uint32_t, LoadedTool> of_register_;  // the first tool with it, of the tool file or loaded
  std::string share_register_;                       // tools of one length that do, for the warning
  std::string other_lengths_;                        // of the CL file, for the warning
  std::vector<LoadedTool> loaded_;
};

}  // namespace trunnion::post
