#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "trunnion/base/units.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/trace/trace.hpp"

namespace trunnion::trace {

/// One motion block of the program, as it is read back: the axes go to `q`.
struct PlannedBlock {
  JointVector q;           // at its end; mm, rad
  double length_mm = 0.0;  // gauge length of the tool
  double seconds = 0.0;    // that it lasts by its words
  double more_s =
      0.0;  // that it lasts beyond that, since axes accelerate, where the machine file says how fast
  double dwell_s = 0.0;  // that the control then stands
  std::uint32_t nc_line = 0;
  std::uint32_t cl_line = 0;
  bool rapid = false;
  bool tcp = false;      // the tip goes straight in the part, not the axes
  bool unknown = false;  // where it begins is not known: the first one, and those behind a retract
};

/// One point of the CL path, in P: the tool goes to it from the point before.
struct PathPoint {
  Vec3 tip_P = Vec3::Zero();
  Vec3 axis_P = Vec3::UnitZ();  // unit
  double flute_mm = 0.0;        // length of the tool's side that cuts; 0: the tip alone
  std::uint32_t line = 0;
  bool rapid = false;
};

/// What a trace is held against.
struct Plan {
  std::vector<PlannedBlock> blocks;
  std::vector<PathPoint> path;
  double tolerance_mm = 0.01;
  double axis_tolerance_rad = 1e-3;
  /// The tool in P with the axes at q, tool vector given (mm); nothing: of the nominal machine.
  std::function<ToolPose(const JointVector& q, const Vec3& tool_mm)> pose;
};

/// One place of the trace.
struct TracePlace {
  double time_s = 0.0;  // by the clock of the trace
  std::uint32_t nc_line = 0;
  std::uint32_t cl_line = 0;
  double tip_mm = 0.0;
  double axis_rad = 0.0;
  double flute_mm = 0.0;
  Vec3 tip_P = Vec3::Zero();
};

/// What the data show about why the machine left the path.
struct Cause {
  /// lag, corner, offset, reversal, speed_limit, acceleration_limit
  std::string kind;
  std::string axis;    // empty: of all together
  double value = 0.0;  // in `unit`
  double sigma = 0.0;  // of the value, same unit; 0: not estimated
  std::string unit;    // ms, mm, deg, mm/s, deg/s, mm/s2, deg/s2
  double share = 0.0;  // of the squared deviation from the program that it accounts for, 0 to 1
  TracePlace place;    // where it is largest, or begins
  std::string text;    // in a sentence
};

/// How long one block took.
struct BlockTime {
  std::uint32_t nc_line = 0;
  double planned_s = 0.0;
  double actual_s = 0.0;
  double time_s = 0.0;  // when it began
};

/// How much of the program the trace shows, and how well.
struct Coverage {
  double share = 0.0;     // of the feed path, 0 to 1
  bool complete = false;  // from the program's first place to its last
  std::uint32_t first_nc_line = 0, last_nc_line = 0;
  double largest_gap_s = 0.0;    // between two samples on the path
  double largest_step_mm = 0.0;  // of the tip between two samples of feed moves
  std::size_t samples = 0;       // of the trace
  std::size_t on_path = 0;       // of those, along the program
  std::size_t left_out = 0;      // rows that are no positions of a machine that moves
};

/// How far the machine was off.
struct TraceFigures {
  double max_tip_deviation_mm = 0.0;  // of feed moves
  double rms_tip_deviation_mm = 0.0;
  double max_axis_deviation_rad = 0.0;
  double max_flute_deviation_mm = 0.0;
  double flute_mm = 0.0;
  double max_rapid_deviation_mm = 0.0;  // of the axes from the program's rapids, at the tip
  /// From sample to sample the tip's place scatters by this (standard deviation of one coordinate); a largest
  /// deviation is right within `uncertainty_mm`.
  double scatter_mm = 0.0;
  double uncertainty_mm = 0.0;
};

struct TraceReport : TraceFigures {
  double duration_s = 0.0;   // from leaving the first place of the program that is seen to coming to the last
  double planned_s = 0.0;    // of the same blocks and dwells, by their words
  double more_s = 0.0;       // of the same blocks: PlannedBlock::more_s
  double elsewhere_s = 0.0;  // between them, where nobody knows the way (retracts, tool changes): in neither
  double begins_s = 0.0;     // by the clock of the trace, when the program is at its first place seen
  Coverage coverage;
  TracePlace worst;
  std::vector<TracePlace> places;    // the worst ones of different blocks, worst first
  std::vector<BlockTime> slow;       // most time lost first
  std::vector<Cause> causes;         // largest share first
  std::vector<std::string> remarks;  // what the data do not tell
  std::vector<TracePlace> course;    // of every sample of a feed move, where asked for
  bool within_tolerance = false;

  bool passed() const { return within_tolerance; }
};

struct CompareOptions {
  bool course = false;  // keep every place
  std::size_t worst_count = 10;
};

/// Where the machine really was, along the program in place and in time, against the CL path.
///
/// The trace may begin before the program, end after it, or show a part of it; its clock is its own.
/// @return wrong_input, with what speaks against it, where the trace is not of this program, its columns are
/// in other units or signs, it fits two places of the program alike, or scatters too much to tell anything.
Result<TraceReport> compare(const Trace& trace, const Machine& machine, const Plan& plan,
                            const CompareOptions& options = {});

/// Where the control wanted the axes to be: samples of feed moves along the program, with the commanded place
/// at that time and how fast the axes went; means over nine rows. Before a cut those in which an axis turns
/// round on the way there.
struct FollowedSample {
  double time_s = 0.0;
  JointVector commanded;
  JointVector actual;     // mm, rad; with the delay that all axes share taken out
  JointVector velocity;   // per second
  JointVector direction;  // sense of the axis' last motion: 1, -1 or 0
  /// By which `actual - commanded` may be wrong: independent errors, a standard deviation each.
  std::vector<JointVector> unsure;
  bool is_reading = true;                   // else it says no more than how the axes came there
  std::size_t first_row = 0, last_row = 0;  // of the trace, of which it is the mean
  double length_mm = 0.0;
  std::uint32_t nc_line = 0;
  std::size_t cut = 0;  // feed moves without a rapid between them, from 1
};
struct FollowedTrace {
  std::vector<FollowedSample> samples;
  /// That is taken out of them; 0: none is surely there, or one of less than a row.
  double lag_of_all_axes_s = 0.0;
  double sigma_s = 0.0;  // of it
};
/// The same alignment for measurements. The delay that all axes share is no error at a place: where corners
/// and curves show it, it is found and taken out.
Result<FollowedTrace> follow(const Trace& trace, const Machine& machine, const Plan& plan);

}  // namespace trunnion::trace
