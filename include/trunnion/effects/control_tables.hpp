#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trunnion/effects/table.hpp"
#include "trunnion/machine/kinematics.hpp"

namespace trunnion {

/// Corrections of axes over the positions of one or two axes: what is added to the commanded position so that
/// the tool arrives where it was commanded (a correction is minus a deviation). Internal units (mm, rad).
struct CorrectionMap {
  struct Output {
    std::string axis;
    std::vector<double> up;    // input moving in its positive sense; as Grid::values over the nodes
    std::vector<double> down;  // in its negative sense; empty: the same
  };
  std::vector<std::string> inputs;         // axis names, one or two
  std::vector<std::vector<double>> nodes;  // ascending, one list per input
  std::vector<Output> outputs;

  std::size_t size() const;  // number of nodes
  const Output* output(std::string_view axis) const;
  /// Linear or bilinear between the nodes, the end value held outside: what every control of the formats here
  /// does.
  double value(const std::vector<double>& values, double u, double v = 0.0) const;
};

/// What a file of a control or of a measuring system holds: error parameters (twists, ErrorTable),
/// corrections of axes, or both.
struct ControlTables {
  std::vector<ErrorTable> errors;
  std::vector<std::pair<std::string, double>> location;  // "X0C" -> mm, "C0B" -> rad
  std::vector<CorrectionMap> corrections;
};

struct FormatOptions {
  /// Names of the control's axes 1, 2, 3, ...; empty: the axes of the machine file in its order.
  std::vector<std::string> axis_numbers;
  /// Opposite sign of every value, for a control that is set up so.
  bool negate = false;
  /// screw-compensation files with a type: 0 holds actual positions, 1 holds trims.
  int file_type = 0;
  /// What a file that does not name them is about (one axis' screw).
  std::string input_axis;
  /// Increment files: value of one unit, mm (or rad); interval for reading; number of the reference point and
  /// its coordinate.
  double unit_mm = 1e-3;
  double interval_mm = 0.0;
  int reference_number = 100;
  double reference_mm = 0.0;
};

/// One file format. `read` reports faults with file:line:column; `write` fails (wrong_input) when the format
/// cannot hold the tables, saying what is in the way.
struct TableFormat {
  std::string_view name;   // for the command line
  std::string_view what;   // one line for the help
  bool holds_corrections;  // else error parameters
  std::function<Result<ControlTables>(std::string_view text, const std::string& file, const Machine&,
                                      const FormatOptions&, Diagnostics&)>
      read;
  std::function<Result<std::string>(const ControlTables&, const Machine&, const FormatOptions&)> write;
  /// What the control does beside it that whoever writes one has to know; may be empty.
  std::string_view beside = {};
};
const std::vector<TableFormat>& table_formats();
const TableFormat* table_format(std::string_view name);

/// Where the linear axes must stand so that the tool (tool vector `tool_mm`) arrives where `q` commands it on
/// a machine with these errors: inverse of the exact chain, below 1 nm; rotary axes are left alone.
JointVector corrected_position(const Machine& machine, const JointVector& q, const Vec3& tool_mm,
                               const ChainErrors& errors);

/// Where corrections are worked out: of the linear axes `outputs`, at the nodes of `inputs` (one axis or
/// two), all other axes as in `rest`, for the tool vector `tool_mm`.
struct CorrectionGrid {
  std::vector<std::string> inputs;
  std::vector<std::vector<double>> nodes;  // of each input, mm or rad
  std::vector<std::string> outputs;
  JointVector rest;
  Vec3 tool_mm;
};
/// Corrections that bring the tool tip where it was commanded on a machine with these error tables: inverse
/// of the exact chain, below 1 nm. The orientation is not corrected.
Result<CorrectionMap> corrections_of(const Machine& machine, const std::vector<ErrorTable>& errors,
                                     const CorrectionGrid& grid);

/// Corrections around a whole turn of an axis that turns on (0 to 330 deg every 30) get their first node once
/// more, a turn on, as an ErrorTable closes: the control holds the last one outside its table.
void close_turns(const Machine& machine, CorrectionMap& corrections);

/// The error tables whose corrections these are: each output becomes a translation component
/// (E<direction><axis>) of the output axis itself when it is an input too, else of the first input axis.
/// Corrections in `up` and `down` give the mean.
Result<std::vector<ErrorTable>> errors_of(const Machine& machine, const CorrectionMap& corrections);

/// Errors of the chain from error tables (interpolated linearly or bilinearly, held outside).
class TableErrors {
 public:
  /// `one`, `two`: how tables over one and two axes are interpolated.
  static Result<TableErrors> create(const Machine& machine, const std::vector<ErrorTable>& tables,
                                    const InterpolationOptions& one, const InterpolationOptions& two);
  /// Linearly and bilinearly.
  static Result<TableErrors> create(const Machine& machine, const std::vector<ErrorTable>& tables);
  ChainErrors at(const JointVector& q) const;

 private:
  struct Entry {
    AxisId joint = 0;
    bool rotation = false;
    Eigen::Index direction = 0;
    AxisId u = 0, v = 0;
    std::shared_ptr<const Interpolant> interpolant;
  };
  std::vector<Entry> entries_;
};

/// Joint, kind and direction that a component's symbol names ("ECX": rotation about Z of joint X); nothing
/// when it is none or the machine has no such axis.
struct ComponentPlace {
  AxisId joint = 0;
  bool rotation = false;
  Eigen::Index direction = 0;  // 0 X, 1 Y, 2 Z
};
std::optional<ComponentPlace> place_of_component(const Machine& machine, std::string_view symbol);

}  // namespace trunnion
