#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/cl/reader.hpp"
#include "trunnion/effects/model.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/nc/controller.hpp"
#include "trunnion/path/pole.hpp"
#include "trunnion/path/solution_choice.hpp"
#include "trunnion/post/checks.hpp"
#include "trunnion/post/path_text.hpp"
#include "trunnion/post/tools.hpp"
#include "trunnion/thermal/offsets.hpp"

namespace trunnion::post {

/// Temperatures while a program runs, above the machine's reference temperature.
struct TemperatureHistory {
  std::vector<double> time_s;                      // since the program's start, increasing, at least one
  std::vector<std::vector<double>> temperature_K;  // [row][sensor], sensors as in Model::context

  /// The last row at or before `seconds`; the first one before it.
  std::span<const double> at(double seconds) const {
    const auto after = std::upper_bound(time_s.begin(), time_s.end(), seconds);
    return temperature_K[static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - time_s.begin() - 1, 0))];
  }
};

/// What sensors say while the program runs.
struct VerifyTemperatures {
  /// Of the sensors of VerifyOptions::truth; nothing: at reference.
  const TemperatureHistory* of_truth = nullptr;
  /// Of the sensors from which a program calculates its own offsets, the first row when the part's zero was
  /// taken; nothing: they stand still.
  const TemperatureHistory* of_program = nullptr;
};

struct VerifyOptions {
  double tolerance_mm = 0.01;
  double rapid_tolerance_mm = 1.0;
  Angle axis_tolerance = Angle::degrees(0.05);
  /// Tool axes inside this cone may be off by its tolerance more (PostOptions::pole).
  path::PoleOptions pole;
  bool certify = true;  // prove the bound of every piece (nominal machine); else it is sampled
  /// Errors of the machine on which the program is evaluated; nothing: the nominal machine.
  const ModelEvaluator* truth = nullptr;
  /// By how much each axis follows its command late, s: the program is judged where they come to, between
  /// the ends of blocks on straight ways.
  JointVector lag_s;
  bool has_lags() const { return !(lag_s == JointVector()); }
  VerifyTemperatures temperatures;
  /// Thermal offsets that the machine has while the program runs; nothing: none.
  const thermal::OffsetTable* offsets = nullptr;
  /// That values which the control adds at run time may not exceed. A machine's own drift knows no clamp and
  /// no slew: only the dead band counts for `offsets`.
  thermal::OffsetLimits offset_limits;
  std::vector<std::string> raw_lines;  // lines that the controller's templates did not make
  std::size_t worst_count = 10;        // places listed in the report
  ToolOptions tools;                   // those that the program was posted with
  /// In which the program is to move; nothing: that of SET/OFSETL, else the machine file's.
  std::optional<std::int64_t> work_offset;
  std::optional<double> smoothing_mm;  // PostOptions::smoothing_mm
  /// Of CL motions before the first FEDRAT; nothing: their feeds are not compared.
  std::optional<double> default_feed_mm_s;
  bool collect = false;  // keep one VerifiedBlock per motion block
};

/// How far a block is off its path, at most.
struct BlockDeviations {
  float tip_deviation_mm = 0.0F;
  float axis_deviation_rad = 0.0F;
  /// Of the tool from its tip to its flute length; 0 without one. In the pole's cone the tilt that is allowed
  /// there is in it.
  float flute_deviation_mm = 0.0F;
};

/// One motion block of the NC program, as verified.
struct VerifiedBlock : BlockDeviations {
  JointVector q;
  Vec3 tip_P = Vec3::Zero();
  double path_mm = 0.0;  // of the tip, from the start of the program
  double seconds = 0.0;  // that the block lasts, as the control runs it
  std::uint32_t nc_line = 0;
  std::uint32_t cl_line = 0;
  bool rapid = false;
  bool programmed = false;  // ends at a point of the CL file (the nearest block to it, within the tolerance)
  bool proved = true;       // its deviations are proved bounds, not samples
  bool tcp = false;         // under tool-centre-point control: the tip goes straight in P, not the axes
  bool unknown = false;     // where it begins is not known: the first one, and those behind a retract
  double length_mm = 0.0;   // gauge length of the tool
  double dwell_s = 0.0;     // that the control stands behind it, before the next one
};

struct WorstPlace {
  std::uint32_t nc_line = 0;
  std::uint32_t cl_line = 0;
  double tip_mm = 0.0;
  Angle axis;
  Vec3 tip_P = Vec3::Zero();
};

/// A block beyond the travel of an axis.
struct BeyondLimit {
  std::uint32_t nc_line = 0;
  std::uint32_t cl_line = 0;
  std::string axis;
  AxisKind kind = AxisKind::linear;
  double value = 0.0;  // mm or rad
  double by = 0.0;
};

/// Smallest and largest position of an axis over all blocks, rapids included.
struct AxisTravel {
  Axis axis;
  double smallest = 0.0;  // mm or rad
  double largest = 0.0;
};

/// A feed block in which an axis would have to be faster than it can.
struct TooFast {
  std::uint32_t nc_line = 0;
  std::uint32_t cl_line = 0;
  std::string axis;
  double ratio = 0.0;  // of its largest velocity, > 1
};

struct PlaceInFiles {
  std::uint32_t nc_line = 0;
  std::uint32_t cl_line = 0;
};

/// A rotary axis that turns below the safe height outside a cut, a tool that comes down while it goes
/// sideways, a retract to elsewhere, a tip inside the table.
struct UnsafeMove {
  std::uint32_t nc_line = 0;
  std::string what;  // with the numbers
};

/// How far a program is off its CL path while it cuts.
struct CutFigures {
  double max_tip_deviation_mm = 0.0;  // feed moves: largest that was found on the path
  double certified_tip_deviation_mm =
      0.0;                         // feed moves: proved upper bound; the sampled one when not `certified`
  bool certified = true;           // every feed block's deviation was proved
  std::size_t sampled_blocks = 0;  // feed blocks whose deviation was sampled
  Angle max_axis_deviation;        // feed moves outside the pole's cone
  Angle max_pole_axis_deviation;   // inside it, where a tolerance for it was given
  /// Feed moves outside the pole's cone, at most: the tool axis from that of the path at the place where the
  /// tip is. (The tool axis may keep to its great circle and be behind the tip, or before it.) Of blocks that
  /// their ends and bows settle the places of the tip are taken to run evenly.
  Angle max_axis_deviation_at_tip;
  /// There, of the tool from its tip to its flute length (FluteLength): largest that was found, and the
  /// bound.
  double max_flute_deviation_mm = 0.0;
  double certified_flute_deviation_mm = 0.0;
  PlaceInFiles worst_flute;  // where that is
  /// Inside the cone, where a tolerance for it was given: the bound, against the path as it is programmed,
  /// and the tolerance there, which is that of the tip and what the tilt moves the flute's end by; of the
  /// place that takes the largest share of it.
  double certified_pole_flute_deviation_mm = 0.0;
  double pole_flute_tolerance_mm = 0.0;
  PlaceInFiles worst_pole_flute;
  double max_point_deviation_mm = 0.0;  // largest distance of a CL point from the path
  std::vector<WorstPlace> worst;        // feed moves, worst first
};

/// What the words of a program tell without its CL path.
struct WordFigures {
  std::size_t points_out = 0;  // motion blocks of the NC program
  std::size_t feed_blocks = 0;
  std::size_t rapid_blocks = 0;
  /// What is not safe on the way between the cuts: the first places of it.
  std::vector<UnsafeMove> unsafe;
  std::size_t unsafe_count = 0;
};

struct RunTimes {
  double duration_s = 0.0;  // of the blocks, read back from their feeds and the rapid rates
  /// The same where the axes need time to get up and down (MotionPlan); nothing: the machine file does not
  /// say of every axis how fast it accelerates. Ways that nobody knows (behind a retract) count as
  /// `duration_s` has them.
  std::optional<double> estimated_s;
  /// Feed blocks whose F asks for more speed than the axes reach in them, accelerating as they can: by more
  /// than 3 %. None where `estimated_s` is not known.
  std::size_t feeds_not_reached = 0;
  /// Largest speed that an F asks for over the speed that the axes reach in its block; 1 where they reach it.
  double max_feed_excess = 1.0;
  std::uint32_t max_feed_excess_nc_line = 0;  // 0: no F asks for more
};

struct VerifyReport : CutFigures, WordFigures, RunTimes {
  std::size_t points_in = 0;  // motions of the CL file
  /// Effects of the model that know no bound on their course: ids, each once.
  std::vector<std::string> unproved_effects;
  double max_rapid_deviation_mm = 0.0;  // of the tip in rapids, from the line between their CL points
  PlaceInFiles worst_rapid;             // where
  std::size_t points_missed = 0;        // CL points that the program never comes to
  std::vector<BeyondLimit> beyond_limits;
  std::size_t beyond_limits_count = 0;
  std::vector<AxisTravel> travel;  // of every axis; none for a program without a block
  std::vector<VerifiedBlock> blocks;
  bool on_truth = false;  // evaluated on a machine with errors
  /// Largest axis velocity of a feed block over what the axis can (1 is its limit), from the words and F as
  /// the control runs them. At most 1 is asked for: beyond it a control stops, or runs slower than it says.
  double max_speed_ratio = 0.0;
  std::vector<TooFast> too_fast;  // the first of them
  std::size_t too_fast_count = 0;
  double tolerance_mm = 0.0;
  double flute_mm = 0.0;
  Angle axis_tolerance;
  Angle pole_tolerance;  // what the pole's cone allows beyond it
  double rapid_tolerance_mm = 0.0;
  /// What was compared, in a table: of the program that was read; a verification that shares its text with
  /// another one leaves it to that.
  Checks checks;
  std::vector<AllowedUse> allowed;

  /// How far the tip is off its path at most, and CL points off the tip's.
  double largest_tip_deviation_mm() const {
    return std::max(certified_tip_deviation_mm, max_point_deviation_mm);
  }
  /// That, or of a tool with a flute all of it.
  double largest_deviation_mm() const {
    const double tip_mm = largest_tip_deviation_mm();
    return flute_mm > 0.0 ? std::max(tip_mm, certified_flute_deviation_mm) : tip_mm;
  }
  bool limits_ok() const { return beyond_limits_count == 0; }
  bool speeds_ok() const { return too_fast_count == 0; }
  /// The feed moves are within the tolerances of tip and tool axis.
  bool cuts_within_tolerance() const;
  bool within_tolerance() const;  // and the rapids within theirs
  bool checks_ok() const {
    return std::none_of(checks.begin(), checks.end(),
                        [](const Check& check) { return check.state == Check::State::failed; });
  }
  bool passed() const {
    return within_tolerance() && limits_ok() && speeds_ok() && points_missed == 0 && unsafe_count == 0 &&
           checks_ok();
  }
};

/// Straight motions of the CL file, as a program is held against them: one behind the other with nothing
/// between them, in columns. The file says the same of all of them beside their points.
struct ExpectedMotions {
  std::span<const path::ChoicePoint> points;
  std::span<const Vec3> axes_P;  // of the tool as programmed; empty: those of `points`
  cl::Feed feed;
  cl::Motion::Step step = cl::Motion::Step::none;
};

/// Evaluates NC text as the control will run it and compares it with the CL file's motions, knowing nothing
/// of how the program was made: blocks are matched to CL segments by geometry alone, in order. Streaming:
/// motions and text may come in pieces, in step.
///
/// Tip deviation: distance of the tip's curve (q linear between blocks, words as rounded) from the CL
/// segments between the places that the two blocks match. Axis deviation: angle of the tool axis from the
/// great circle of the segment; at the tip: from the tool axis that the path has where the tip is. Flute
/// deviation: distance of a point of the tool from the same point of the tool there.
class Verifier {
 public:
  /// References must outlive the verifier.
  Verifier(const Machine& machine, const nc::Controller& controller, const VerifyOptions& options,
           const std::string& nc_file, Diagnostics& diagnostics);
  Verifier(const Verifier&) = delete;
  Verifier& operator=(const Verifier&) = delete;
  ~Verifier();

  /// The next motions of the CL file, with nothing between them.
  void expect(const ExpectedMotions& motions);
  /// The next record of the CL file that is no motion, a tool change with its length register.
  void expect(const cl::Record& record);
  /// The CL file loads this tool, of this gauge length: before any text that loads it.
  void expect_tool(std::uint32_t number, double length_mm);
  /// The program is made for words of the gauge point where it loads no tool: before any text.
  void expect_no_length();
  /// Any piece of the NC text, in order. Blocks whose CL motions are not known yet wait.
  void text(std::string_view piece);
  /// The program is judged on the nominal machine, too, without its errors and its drift. Before any motion.
  void judge_nominal_too();
  struct Found {
    VerifyReport report;
    std::optional<VerifyReport> nominal;  // where that was asked for
  };
  /// All motions and all text have been given. Fails when the text could not be read.
  Result<Found> finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// What the verdict means for the tool above its tip, in words.
std::string flute_text(const VerifyReport& report);

/// How a CL file is read that is held within `tolerance_mm`: the chords of its arcs take a tenth of it at
/// most.
cl::ReaderOptions reading_within(cl::ReaderOptions reading, double tolerance_mm);

/// What a program is verified for; all of it must outlive the call.
struct VerifySetup {
  const Machine& machine;
  const nc::Controller& controller;
  const VerifyOptions& options;
};

/// Verifies a whole program against a whole path: the program is read piece by piece, so that memory holds
/// the motions of the path only.
Result<VerifyReport> verify(PathText path, ProgramText program, const VerifySetup& setup,
                            Diagnostics& diagnostics);

}  // namespace trunnion::post
