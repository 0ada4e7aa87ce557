// Error tables, and those of controls and measuring systems.
#include "trunnion/effects/control_tables.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const auto& formats = table_formats();
  const std::size_t which = bytes.choice(formats.size() + 1);
  const std::string text = bytes.rest();
  Diagnostics diagnostics;
  if (which < formats.size()) {
    FormatOptions options;
    options.input_axis = "X";
    options.output_axis = "X";
    options.interval_mm = 10.0;
    static_cast<void>(formats[which].read(text, "input", fuzz::machine(), options, diagnostics));
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
