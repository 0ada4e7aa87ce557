// Configurations of an open control: what is taken becomes a machine file that reads.
#include "trunnion/machine/machine.hpp"
#include "trunnion/machine/new_machine.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Diagnostics diagnostics;
  const auto read =
      machine_of_ini({reinterpret_cast<const char*>(data), size}, "/nonexistent/input.ini", diagnostics);
  if (!read) return 0;
  Diagnostics again;
  static_cast<void>(parse_machine(machine_file_text(*read, "input.ini"), "new.toml", again));
  return 0;
}
