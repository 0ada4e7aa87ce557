#pragma once
#include "trunnion/post/axes_of.hpp"

#include "fuzz/fuzz.hpp"

namespace trunnion::fuzz {

/// The shipped controllers as they are set up on the machine of the targets; one for any number.
inline const nc::Controller& control_on_machine(std::size_t i) {
  static const std::vector<nc::Controller> all = [] {
    std::vector<nc::Controller> out;
    for (const std::string& name : test::shipped_controllers())
      out.push_back(post::with_axes_of(machine(), test::shipped_controller(name)));
    return out;
  }();
  return all[i % all.size()];
}

}  // namespace trunnion::fuzz
