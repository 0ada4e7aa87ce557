#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trunnion/diagnosis/measurement.hpp"
#include "trunnion/effects/model.hpp"

namespace trunnion::diagnosis {

/// What can be the wrong way round, in the wrong column or in the wrong unit in a machine file or a
/// measurement file.
enum class ConventionKind : std::uint8_t {
  axis_sense,       // an axis goes the other way than its `direction`, or than its column
  reading_sense,    // readings with the opposite sign
  swapped_columns,  // two axes, or two components of n
  unit,             // a factor: 1000 (mm, um), degrees and radians
  tool_length,      // the measured point is further from, or nearer to, the spindle along the tool
  tool_offset,      // the measured point lies beside the spindle's axis, all readings show it
  ball_offset,      // the part's set-up of a run, where the model holds it fixed
  time_shift,       // temperatures and speeds were recorded by another clock
  stacking_order,   // of two rotary axes that carry the part the other one stands on the bed
  component_sense,  // one component of n has the wrong sign
  frame,            // n is given in the axes of the other frame
  motion_sense,     // the sense of motion (`dir_`) of an axis that is always the same, whichever way it goes
  position_offset,  // positions count from another zero than the machine file's
  compensated       // measured while the control took out what the model says
};
std::string_view text_of(ConventionKind kind);

/// Temperatures and speeds were recorded by another clock than readings.
struct ClockShift {
  double by_s = 0.0;  // the state of time t is the one that stands at t + by_s
  /// Of each run, the speed before the first that is recorded then; empty: that one.
  std::vector<std::optional<double>> speed_before_rpm;
};

/// One convention put right. What does not belong to its kind stays as it is here.
struct Convention {
  ConventionKind kind = ConventionKind::axis_sense;
  std::vector<AxisId> axes;        // the one that turns; the two that are swapped or stacked; in another unit
  std::vector<int> components;     // of n, 0 to 2: the two that are swapped, or the one with the wrong sign
  std::optional<std::size_t> run;  // of Dataset::context; nothing: all
  std::optional<std::size_t> file;   // of Dataset::files: all of its runs; nothing: all
  std::optional<Quantity> quantity;  // nothing: both
  /// axis_sense: the sign of the data's columns instead of the machine's `direction`; swapped_columns: the
  /// positions alone, not the senses and speeds of motion with them.
  bool in_file = false;
  bool with_uncertainty = false;    // unit: of u_random and u_common too
  bool only_uncertainty = false;    // unit: of these alone
  double factor = 1.0;              // unit: the right value is the given one times this
  Vec3 by_mm = Vec3::Zero();        // what has to be added to the tool vector, or to the part's set-up in P
  bool in_readings = false;         // tool_length: the readings show the offset itself, not its lever alone
  std::vector<double> by_position;  // position_offset: to be added to each of `axes`; mm, rad
  std::size_t effects = 0;          // compensated: the first ones of the model, which the control took out
  ClockShift clock;                 // time_shift

  /// Of the directions or the positions of one run.
  bool is_of_columns_of_one_run() const {
    const bool of_directions =
        kind == ConventionKind::component_sense || kind == ConventionKind::swapped_columns;
    const bool of_positions =
        kind == ConventionKind::axis_sense || (kind == ConventionKind::unit && !axes.empty());
    return run.has_value() && (of_directions || of_positions);
  }
  /// The file contradicts itself there: it was not chosen among many that might be wrong.
  bool shows_in_the_file() const { return kind == ConventionKind::motion_sense; }
  /// Not of all readings that were given.
  bool of_a_part() const { return run.has_value() || file.has_value(); }
};

/// A convention that explains what effects would have to.
struct Bookkeeping {
  Convention convention;
  std::string axis, run, file, quantity;  // names, as far as the kind has them
  std::vector<std::string> axes, components;
  std::vector<std::pair<std::string, double>> by_column;  // position_offset: what to add; mm, deg
  double chi2_before = 0.0, chi2_after = 0.0, dof = 0.0;
  double wandered_mm = 0.0;   // of the measured point on the part, where that proves it; else 0
  bool as_it_stands = false;  // found with the model's own values, not with fitted ones
  std::string words;          // what to put right, and where
};

/// Machine, model and data with one convention put right.
struct PutRight {
  Machine machine;
  Model model;
  Dataset data;
};
PutRight put_right(const Machine& machine, const Model& model, const Dataset& data,
                   const Convention& convention);

}  // namespace trunnion::diagnosis
