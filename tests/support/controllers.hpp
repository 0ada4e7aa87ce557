#pragma once
#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "trunnion/nc/controller.hpp"
#include "trunnion/nc/reader.hpp"
#include "trunnion/nc/writer.hpp"

#include "support/folders.hpp"

namespace trunnion::test {

inline std::string controller_folder() {
  return test::source_folder() + "/postconfigs/controllers";
}

/// Names of all controller files that ship with the project.
inline std::vector<std::string> shipped_controllers() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(controller_folder())) {
    const std::string name = entry.path().stem().string();
    // default.toml is another name of one of the others.
    if (entry.path().extension() == ".toml" && name != "default") names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

inline nc::Controller shipped_controller(const std::string& name) {
  Diagnostics diagnostics;
  auto controller = nc::load_controller(controller_folder() + "/" + name + ".toml", diagnostics);
  if (!controller) {
    std::string all;
    for (const auto& f : diagnostics.findings()) all += f.text() + "\n";
    throw std::runtime_error(all);
  }
  return *controller;
}

/// Z to this machine position, where the control's words hold one.
inline nc::Retract retract_to(const nc::Controller& controller, double position_mm,
                              nc::AxisLetter letter = nc::AxisLetter::Z) {
  nc::Retract block{nc::AxisWords::bit(letter), {}};
  if (controller.names_position(letter))
    block.to.set(letter, controller.numbers.axes.quanta(letter, position_mm));
  return block;
}

/// Text of `blocks`; throws what the writer refuses.
inline std::string nc_text(const nc::Controller& controller, const std::vector<nc::Block>& blocks) {
  std::string text;
  nc::Writer writer(controller, text);
  for (const auto& block : blocks) {
    if (auto done = writer.write(block); !done) throw std::runtime_error(done.error().message);
  }
  return text;
}

/// Blocks of `text`; throws all findings when there is an error.
inline std::vector<nc::Block> nc_blocks(const nc::Controller& controller, const std::string& text,
                                        const nc::ReaderOptions& options = {}) {
  Diagnostics diagnostics;
  auto blocks = nc::read_program(controller, text, "test.nc", diagnostics, options);
  if (!blocks) {
    std::string all;
    for (const auto& f : diagnostics.findings()) all += f.text() + "\n";
    throw std::runtime_error(all);
  }
  return *blocks;
}

}  // namespace trunnion::test
