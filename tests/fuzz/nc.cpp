// NC text, read with each controller: as blocks or in runs, ours, another's, a whole program.
#include "trunnion/nc/reader.hpp"

#include "fuzz/fuzz.hpp"

using namespace trunnion;

namespace {

const nc::Controller& controller(std::size_t i) {
  static const std::vector<nc::Controller> all = [] {
    std::vector<nc::Controller> out;
    for (const std::string& name : test::shipped_controllers()) out.push_back(test::shipped_controller(name));
    return out;
  }();
  return all[i % all.size()];
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const nc::Controller& control = controller(bytes.byte());
  const std::size_t flags = bytes.byte();
  nc::ReaderOptions options;
  options.others = (flags & 1U) != 0;
  options.whole_program = !options.others && (flags & 2U) != 0;
  std::size_t blocks = 0;
  Diagnostics diagnostics;
  nc::Reader reader(
      control, "input", diagnostics, [&](const nc::Block&) { ++blocks; }, options);
  if ((flags & 4U) != 0) reader.give_runs_to([&](const nc::MotionRun& run) { blocks += run.count; });
  reader.feed(bytes.rest());
  static_cast<void>(reader.finish());
  return 0;
}
