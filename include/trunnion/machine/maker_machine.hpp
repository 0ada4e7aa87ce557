#pragma once
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/machine/new_machine.hpp"

namespace trunnion {

/// What is public of a machine that a maker sells (postconfigs/makers). No program can be posted with it:
/// nobody publishes where the axes of rotation lie, which is measured at each machine.
struct MakerMachine {
  NewMachine machine;                // what of it is known
  std::map<char, double> length_mm;  // of axes whose ends are not published: from end to end
  std::vector<std::string> sources;
  std::string differs;  // between the sources, or what none of them has
};

/// Reports what is wrong with the text to `diagnostics`; fails with wrong_input.
Result<MakerMachine> parse_maker_machine(std::string_view toml, const std::string& file,
                                         Diagnostics& diagnostics);

}  // namespace trunnion
