#pragma once
#include <optional>

#include "trunnion/path/point.hpp"

namespace trunnion::post {

/// ROTABL or ROTATE turned a rotary axis to this angle.
struct AskedTurn {
  AxisId axis = 0;
  double angle = 0.0;  // rad
  SourceRef where;
};

/// Where the tool is at the end of the text so far, and what the next motion has to know of it.
struct ToolPlace {
  path::Point point;                    // nominal, on the word grid
  JointVector joints;                   // that went out: corrected, where something is
  bool holds_digits = false;            // the last block left out digits that only rounding had changed
  bool known = false;                   // a first point was written
  bool approaches = true;               // the next motion starts from an unknown or safe position
  bool up = false;                      // Z is at the safe height
  bool tcp = false;                     // tool-centre-point control is on
  bool returns = false;                 // from the safe height to `point`, if the program cuts on
  std::optional<JointVector> turn_due;  // to where the rotary axes turn before they cut on
  std::optional<AskedTurn> asked_turn;  // of a word of the CL file, before the motion behind it
};

}  // namespace trunnion::post
