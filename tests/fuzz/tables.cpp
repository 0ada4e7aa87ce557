// Error tables, and those of controls and measuring systems.
#include <algorithm>

#include "trunnion/effects/control_tables.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

namespace {

bool rises(const std::vector<double>& nodes) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!std::isfinite(nodes[i]) || (i > 0 && nodes[i] <= nodes[i - 1])) return false;
  }
  return !nodes.empty();
}
bool are_numbers(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

// What every user of a table takes for granted.
void hold_map(const CorrectionMap& map) {
  fuzz::hold(map.inputs.size() == map.nodes.size(), "an input has its nodes");
  for (const auto& nodes : map.nodes) fuzz::hold(rises(nodes), "nodes rise");
  for (const auto& output : map.outputs) {
    fuzz::hold(fuzz::machine().axis(output.axis).has_value(), "an output is an axis");
    fuzz::hold(output.up.size() == map.size() && (output.down.empty() || output.down.size() == map.size()),
               "a node has its value");
    fuzz::hold(are_numbers(output.up) && are_numbers(output.down), "values are numbers");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const auto& formats = table_formats();
  const std::size_t which = bytes.choice(formats.size() + 1);
  const std::string text = bytes.rest();
  Diagnostics diagnostics;
  if (which < formats.size()) {
    FormatOptions options;
    options.input_axis = "X";
    options.interval_mm = 10.0;
    const TableFormat& format = formats[which];
    const auto tables = format.read(text, "input", fuzz::machine(), options, diagnostics);
    if (!tables) return 0;
    for (const CorrectionMap& map : tables->corrections) hold_map(map);
    // What the format does not hold is refused.
    const auto written = format.write(*tables, fuzz::machine(), options);
    if (!written) return 0;
    Diagnostics again;
    fuzz::hold(format.read(*written, "written", fuzz::machine(), options, again).has_value(),
               "what is written reads back\n" + *written);
    return 0;
  }
  const auto table = parse_error_table(text, "input.csv", fuzz::machine(), diagnostics);
  if (!table) return 0;
  Diagnostics again;
  fuzz::hold(parse_error_table(error_table_text(*table, fuzz::machine()), "input.csv", fuzz::machine(), again)
                 .has_value(),
             "a table reads back");
  return 0;
}
