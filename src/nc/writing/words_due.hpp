#pragma once
#include <optional>
#include <string>

#include "trunnion/nc/blocks.hpp"

namespace trunnion::nc {

/// Words of a program that wait for a later block.
struct WordsDue {
  bool setup = false;  // what a program begins with
  // What a retract switched off, to be switched on again before the next motion.
  std::optional<LengthCompensation> length;
  std::optional<TcpControl> tcp;
  std::string in_motion;          // length or TCP words that belong into the next motion block
  bool in_motion_is_tcp = false;  // they switch tool-centre-point control on
  std::string cutter;             // that belong into the next motion block with X or Y

  bool none() const { return !setup && !restores() && in_motion.empty() && cutter.empty(); }
  bool restores() const { return length || tcp; }
  /// A tool change leaves nothing to be switched on again.
  void change_tool() {
    in_motion.clear();
    length.reset();
    tcp.reset();
  }
};

}  // namespace trunnion::nc
