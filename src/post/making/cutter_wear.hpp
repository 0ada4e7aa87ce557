#pragma once
#include "trunnion/nc/blocks.hpp"

namespace trunnion::post {

/// Cutter compensation of the control, which adds the wear of the tool.
struct CutterWear {
  nc::CutterSide side = nc::CutterSide::off;
  bool changes = false;  // with the next motion

  bool is_on() const { return side != nc::CutterSide::off; }
  bool is_idle() const { return !is_on() && !changes; }
};

}  // namespace trunnion::post
