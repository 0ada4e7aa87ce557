// Controller files, bases among them.
#include "trunnion/nc/controller.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Diagnostics diagnostics;
  const std::string path = fuzz::file_of({reinterpret_cast<const char*>(data), size}, ".toml");
  static_cast<void>(nc::load_controller(path, diagnostics, test::controller_folder()));
  return 0;
}
