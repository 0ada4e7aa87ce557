#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/cl/reader.hpp"
#include "trunnion/effects/model.hpp"
#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"
#include "trunnion/path/nonlinear.hpp"
#include "trunnion/path/pole.hpp"
#include "trunnion/path/solution_choice.hpp"
#include "trunnion/post/nc_origin.hpp"
#include "trunnion/post/path_stages.hpp"
#include "trunnion/post/tools.hpp"
#include "trunnion/post/verify.hpp"

namespace trunnion::post {

enum class FeedOutput : std::uint8_t {
  inverse,     // G93 for moves in which a rotary axis turns, per minute for the others
  per_minute,  // F as the control measures it, so that the tip moves at the programmed feed
  tip          // F is the feed of the tip: what a control understands under tool-centre-point control
};

struct PostOptions {
  double tolerance_mm = 0.01;
  double rapid_tolerance_mm = 1.0;      // of the tip from the straight line of a rapid
  std::optional<Angle> axis_tolerance;  // nothing: the machine's
  path::NonlinearOptions nonlinear;
  path::ChoiceMethod choice = path::ChoiceMethod::global;
  std::string choice_axis = "C";
  FeedOutput feed = FeedOutput::inverse;
  /// F says no more than the axes reach, where the machine file says of every axis how fast it accelerates
  /// (MotionPlan); false: as the CL file asks for, and as fast as axes are.
  bool feeds_within_reach = true;
  /// For CL files without FEDRAT before their first feed move: warned about once.
  double default_feed_mm_s = 250.0 / kSecondsPerMinute;
  /// Where the rotary axes must turn back while cutting: how far the tool leaves along its axis, and how
  /// fast.
  struct Retract {
    double way_mm = 50.0;
    double feed_mm_s = 5000.0 / kSecondsPerMinute;
  } retract;
  /// Near the pole; without a tolerance no tool axis is changed.
  path::PoleOptions pole;
  /// 3+2: a run of motions with one tool axis is written in a tilted plane of the control (G68.2, CYCLE800,
  /// PLANE SPATIAL): words are the tip in the plane's frame, the control keeps the rotary axes.
  bool tilted_plane = false;
  /// Tool-centre-point control: words are the tip in P, the control moves it on a straight line.
  bool rtcp = false;
  /// Arcs and drilling cycles of the CL file in the control's own words where it can hold them; nothing: as
  /// the controller file says.
  std::optional<bool> native_arcs;
  std::optional<bool> native_cycles;
  /// Of the linear axes, for a model of the machine's errors: what asks for more is taken for a mistake.
  double largest_correction_mm = 0.5;
  bool verify = true;
  bool collect = false;  // keep what the HTML report draws
  /// Threads for this one program; the text does not depend on it.
  std::size_t threads = 1;
  ToolOptions tools;
  /// The work offset that the program calls; nothing: that of SET/OFSETL in the CL file, else the machine
  /// file's. Not called where the control has no words.
  std::optional<std::int64_t> work_offset;
  /// The control may leave the programmed path where blocks meet, beside the tolerance: by this much, or by
  /// what it has set (0). Nothing: exact path, or the controller file's [path_mode] default.
  std::optional<double> smoothing_mm;
  /// For controls that name or number programs; nothing: the name is PARTNO's, else the output file's, the
  /// number is made of the digits in the name.
  struct ProgramName {
    std::optional<std::string> text;
    std::optional<std::int64_t> number;
  } program;
  /// What changes the path before its joints are chosen.
  std::vector<PathStageAtWork> path_stages;
  cl::ReaderOptions cl;
};

/// How thermal offsets get into a program.
enum class OffsetOutput : std::uint8_t {
  axis_values,  // corrected at every point, as time goes on
  work_offset,  // one shift of the work offset for each operation, taken when it begins: the offset is set
                // anew (it must be the machine file's), or, where the control has no words for that, added to
  local_shift,  // the same, always beside the work offset
  variables  // coefficients of values that the control holds at run time and takes when an operation begins
};

/// What a control calculates the drift from (OffsetOutput::variables): mm of deviation in the frame of the
/// offsets for each K that a sensor has risen since the last measurement.
struct RunTimeDrift {
  std::vector<std::string> sensors;
  Eigen::Matrix3Xd mm_per_K;
  TemperatureHistory history;  // with which the program is verified; the first row: when the zero was taken
};

/// What is posted with what. Pointers must outlive the call.
struct PostJob {
  std::string cl_file;  // for messages
  /// The text is an NC program, and this is what it was made for; nothing: it is CL text.
  const NcOrigin* from = nullptr;
  std::string output;  // file of the program, whose name it may bear; may be empty
  const Machine* machine = nullptr;
  const nc::Controller* controller = nullptr;  // as it is set up on the machine (`with_axes_of`)
  const Model* model = nullptr;                // errors to compensate and to verify with; nothing: nominal
  /// By how much each axis follows its command late, beside what `model` says: its words are led by that.
  JointVector lag_s;
  const TemperatureHistory* temperatures = nullptr;  // of the model's sensors; nothing: at reference
  /// Thermal offsets over the program's time or for each operation; nothing: none.
  const thermal::OffsetTable* offsets = nullptr;
  thermal::OffsetLimits offset_limits;
  OffsetOutput offset_output = OffsetOutput::axis_values;
  /// Only with OffsetOutput::variables; nothing: somebody else writes the three values.
  const RunTimeDrift* run_time_drift = nullptr;
  std::vector<std::string> header;  // further comment lines (command, versions)
};

struct PostReport {
  std::size_t points_in = 0;
  std::size_t points_inserted = 0;
  std::size_t segments_with_points = 0;
  std::size_t segments_not_converged = 0;
  double worst_predicted_mm = 0.0;   // by the predictor, of the path as programmed
  double worst_programmed_mm = 0.0;  // midpoint error of the path as programmed
  path::ChoiceSummary choice;
  double duration_s = 0.0;
  double feed_time_lost_s = 0.0;  // by speed and acceleration of the axes
  /// Blocks in which rotary axes turn and from which X Y Z words were left out that only rounding had
  /// changed: no F of the control says the duration of such a path.
  std::size_t blocks_held = 0;
  /// Rapids in which a rotary axis turns by more than half a turn: made at the safe height.
  std::size_t rewinds_at_rapids = 0;
  std::size_t pole_stretches = 0;  // in which tool axes near the pole were tilted
  Angle largest_pole_tilt;
  std::size_t pole_turns_early = 0;    // C turned at a rapid that leads to the pole
  std::size_t pole_turns_cutting = 0;  // C turns by more than the least turn in the cone, while cutting
  std::size_t tilted_planes = 0;       // switched on
  std::size_t arcs = 0;                // in the control's words
  std::size_t holes = 0;               // in the control's drilling cycles
  std::size_t shapes_as_moves = 0;     // arcs and holes that were asked for in its words, and could not be
  double largest_error_mm = 0.0;       // of the machine at the points of the path, before compensation
  double largest_correction_mm = 0.0;  // of the linear axes
  std::size_t offset_shifts = 0;  // blocks that shift the work offset, without the last one that ends them
  double shift_error_mm = 0.0;    // largest error of a shift at poses other than the one it was made for
  /// What any drift within the clamp adds to the deviations that were verified: the terms of two blocks are
  /// those of their poses, and between them the control goes straight.
  double run_time_bend_mm = 0.0;
  /// Largest motion of the tip, while a block lasts, by effects that are lagged: they count as they were at
  /// its beginning.
  double lag_step_mm = 0.0;
  std::vector<LoadedTool> tools;  // in the order in which they are loaded
  struct Head {
    std::int64_t work_offset = 1;     // that the program calls
    std::int64_t program_number = 0;  // that it begins with; 0: the control knows programs by names
    double offset_sigma_mm = 0.0;     // largest standard uncertainty of the thermal offsets; in no verdict
  } head;
  std::size_t nc_lines = 0;
  std::optional<VerifyReport> verification;          // on the machine that was compensated for
  std::optional<VerifyReport> nominal_verification;  // the nominal machine, when a model was applied
};

/// Takes finished text of the program, piece by piece.
using TextSink = std::function<Result<void>(std::string_view)>;

/// A text that stands in the header until the verification is done; the caller replaces it, in what the sink
/// took, by a text of the same length (see verdict_text).
std::string verdict_placeholder();
/// The same for the tools: which ones are loaded is known in the end.
std::string tools_placeholder();
/// `GAUGE LENGTHS T1 150, T2 80.5 REGISTER 12`, padded to the placeholder's length; what does not fit is
/// counted.
std::string tools_text(const std::vector<LoadedTool>& tools);
/// `WITHIN TOLERANCE: ...` or `NOT WITHIN TOLERANCE: ...` with the figures, padded to the placeholder's
/// length.
std::string verdict_text(const PostReport& report);

/// Fails with wrong_use when the options exclude each other, the control or the machine.
Result<void> check_options(const PostOptions& options, const Machine& machine,
                           const nc::Controller& controller);

/// CL text (or an NC program: PostJob::from) in, NC text out, verified by reading the NC text back. Streams:
/// memory grows with the longest run of points between two rapids, not with the file. All findings go to
/// `diagnostics`. Fails with wrong_input (CL errors, all in diagnostics), check_failed (a pose out of reach,
/// a limit), io_failed (the sink). A verification that failed is a result, not a failure: see
/// PostReport::verification.
Result<PostReport> post(std::unique_ptr<cl::TextSource> source, const PostJob& job,
                        const PostOptions& options, const TextSink& sink, Diagnostics& diagnostics);

}  // namespace trunnion::post
