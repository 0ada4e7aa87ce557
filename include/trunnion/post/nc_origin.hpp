#pragma once
#include <cstdint>

#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::post {

/// What lies between the ends of two blocks that cut, of an NC program that is read as a path. Rapids that
/// leave the straight line by more than 2 mm go as the axes of the machine take them.
enum class FromPath : std::uint8_t {
  /// As `points`, but a block whose way leaves that of a CL file by more than 0.5 mm, or whose tool axis by
  /// more than 5 deg, is rejected: a rotary axis turns the part under the tool there, and the program means
  /// it.
  near_points,
  /// The ends of the blocks are the points of the path, joined as points of a CL file are: the tip goes
  /// straight, the tool axis on the great circle.
  points,
  /// The path is what the machine does between them: its axes move linearly, and the tip of a joint program
  /// leaves its chord. It gets points, so that the path leaves the machine's by a bound that is proved.
  motion
};

/// What X Y Z of such a program are where it has changed a tool and no length compensation is on.
enum class FromWords : std::uint8_t {
  refused,  // the program does not say it
  tip,      // the control switches the length on by itself (D1), or the tool was touched off
  spindle   // the spindle's gauge point, as the words stand
};

/// An NC program that is read in place of a CL file. Pointers must outlive its use.
struct NcOrigin {
  /// That the program was made for. Under tool-centre-point control and in tilted planes only the directions
  /// of its rotary axes and its words matter; what a joint program does hangs on all of it.
  const Machine* machine = nullptr;
  const nc::Controller* controller = nullptr;  // as it is set up on that machine (`with_axes_of`)
  FromPath path = FromPath::near_points;
  FromWords words = FromWords::refused;
};

}  // namespace trunnion::post
