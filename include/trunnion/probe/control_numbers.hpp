#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::probe {

/// The control's own numbers for the rotary axes of `machine`, line by line as its file ([axis_numbers]) has
/// them, mm: {outer.x} {inner.x} a point of the first and the second axis from the bed outwards,
/// {minus_inner.x} its negative, {inner_from_outer.x} {outer_from_inner.x} from one to the other, {outer.nx}
/// the way about which the table turns, {outer.against_x} its negative, {outer.left_hand} 1 where it points
/// against the machine axis beside it, else 0, {outer.axis} 1, 2 or 3 for that axis; the same with y and z,
/// and with inner. Of each axis its point is the one nearest to the other axis' line, so that what is left of
/// the choice of points does not come in. Last comes a line for each axis whose direction these numbers do
/// not hold, with its angle to the machine axis. Fails with wrong_input where the control's file has none for
/// these axes, or an unknown placeholder, where its lines for these letters hold no directions and an axis is
/// meant oblique, and where they have one sense for both axes and these have two.
/// Lines with {crossing.x}, the point in which a control takes both axes to cross, are for `axis_places`
/// only.
Result<std::vector<std::string>> control_numbers(const Machine& machine, const nc::Controller& controller);

/// What a control's own numbers say of two rotary axes.
struct AxisPlaces {
  std::map<char, Vec3> points_mm;              // of the axes whose points they tell
  std::optional<bool> table_turns_positively;  // about X, Y, Z for a positive command, both axes
};

/// A list of a control's numbers, as it stands in the file.
struct ControlNumbers {
  std::string file;
  std::string_view text;
  double mm_per_unit = 1.0;
};

/// The way back from `control_numbers`: takes from the text the lines that look like those of the control's
/// file ([axis_numbers]), blanks apart; others are left alone. `letters`: the rotary axes from the bed
/// outwards. Fails with wrong_input, naming the line, where two lines contradict each other, no line is one
/// of the control's, or the axes turn in opposite senses; notes in `diagnostics` an axis that is not square.
Result<AxisPlaces> axis_places(const ControlNumbers& numbers, const std::string& letters,
                               const nc::Controller& controller, Diagnostics& diagnostics);

}  // namespace trunnion::probe
