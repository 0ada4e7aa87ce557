// Other programs' measurements and logs.
#include "trunnion/diagnosis/import.hpp"
#include "trunnion/diagnosis/iso230_lines.hpp"
#include "trunnion/thermal/import_log.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const std::size_t which = bytes.choice(7);
  const std::string text = bytes.rest();
  Diagnostics diagnostics;
  if (which == 0) static_cast<void>(diagnosis::import_map(text, "input", {}, diagnostics));
  if (which == 1) static_cast<void>(diagnosis::import_log(text, "input", {.channel = "ch1"}, diagnostics));
  if (which == 2) static_cast<void>(thermal::import_log(text, "input", {}, diagnostics));
  if (which == 3) static_cast<void>(iso230::parse_readings(text, "input", diagnostics));
  if (which == 4) static_cast<void>(iso230::parse_motion_log(text, "input", "X", diagnostics));
  if (which == 5) static_cast<void>(diagnosis::import_stage(text, "input", fuzz::machine(), {}, diagnostics));
  if (which == 6)
    static_cast<void>(diagnosis::import_pointing(text, "input", fuzz::machine(), {}, diagnostics));
  return 0;
}
