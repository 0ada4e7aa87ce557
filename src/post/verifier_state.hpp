#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "trunnion/nc/reader.hpp"
#include "trunnion/post/plane_frame.hpp"
#include "trunnion/post/verify.hpp"

#include "post/deviation_meter.hpp"
#include "post/feed_plan.hpp"
#include "post/quiet_run.hpp"
#include "post/run_time_values.hpp"
#include "post/work_shift.hpp"

// Private to the verifier: where the program read back stands, and how far the CL path has been followed.

namespace trunnion::post {

// How the words of an axis are read.
struct WordOfAxis {
  std::size_t letter = 0;
  double scale = 1.0;                             // quanta in a mm or a degree
  double factor = 1.0;                            // mm, or rad in a degree
  std::uint16_t rotary = 0;                       // bit of the word, of a rotary axis
  double linear_share = 0.0, rotary_share = 0.0;  // 1 where it is one

  /// As nc::AxisFormat::internal.
  double internal(const nc::AxisWords& words) const {
    return static_cast<double>(words.quanta[letter]) / scale * factor;
  }
};

// Rounding of the evaluation of a block's time, of it.
inline constexpr double kSpeedRounding = 1e-6;

// Far more CL points than one block of a thinned program passes.
inline constexpr std::size_t kLookAhead = 1024;

struct Verifier::State {
  State(const Machine& m, const nc::Controller& c, const Vec3& tool, const VerifyOptions& o,
        std::string nc_file, Diagnostics& diagnostics)
      : machine(m),
        controller(c),
        file(nc_file),
        findings(diagnostics),
        tool_mm(tool),
        options(o),
        offsets(o.offsets != nullptr
                    ? std::optional<OffsetTracker>(std::in_place, *o.offsets, unlimited(o.offset_limits))
                    : std::nullopt),
        meter(m, tool, o.truth, offsets ? &*offsets : nullptr, o.certify, o.tolerance_mm, o.axis_tolerance),
        planner(m, c, FeedOutput::inverse),
        shift(m, c, tool),
        values(c),
        program(m.axes.size(), o.truth != nullptr ? o.truth->lags() : std::vector<LagRequest>{},
                o.temperatures),
        word_offsets(words_of(m, JointVector(), tool)),
        reader(
            c, std::move(nc_file), diagnostics,
            [this](const nc::Block& block) {
              take(block);
              if (follower != nullptr) follower->take(block);
            },
            reader_options(o),
            [this](const nc::MotionRun& run) {
              take(run);
              if (follower != nullptr) follower->take(run);
            }) {
    report.tolerance_mm = o.tolerance_mm;
    report.axis_tolerance = o.axis_tolerance;
    report.pole_tolerance = o.pole.tolerance;
    report.rapid_tolerance_mm = o.rapid_tolerance_mm;
    report.on_truth = o.truth != nullptr || o.offsets != nullptr;
    report.certified = meter.proves();
    for (AxisId id = 0; id < m.axes.size(); ++id) {
      letters[id] = *nc::axis_letter(m.axes[id].name);
      needed = static_cast<std::uint16_t>(needed | nc::AxisWords::bit(letters[id]));
      if (m.axes[id].kind == AxisKind::linear)
        linear = static_cast<std::uint16_t>(linear | nc::AxisWords::bit(letters[id]));
      word_of[id] = word_of_axis(c.numbers.axes, letters[id], m.axes[id].kind);
      least[id] = m.axes[id].min;
      most[id] = m.axes[id].max;
    }
    cone_cosine = std::cos(o.pole.cone.rad());
    has_cone = o.pole.tolerance.rad() > 0.0 && meter.kinematics().rotary_count() >= 2;
    quiet_run = QuietRun({o.tolerance_mm, o.axis_tolerance.rad(), report.on_truth, has_cone,
                          meter.kinematics().direction(1), cone_cosine});
  }

  static WordOfAxis word_of_axis(const nc::AxisFormat& format, nc::AxisLetter letter, AxisKind kind) {
    const bool rotary = kind == AxisKind::rotary;
    WordOfAxis out;
    out.letter = nc::index(letter);
    for (int i = 0; i < format.decimals(letter); ++i) out.scale *= 10.0;
    if (nc::is_rotary(letter)) out.factor = kRadPerDegree;
    if (rotary) out.rotary = nc::AxisWords::bit(letter);
    (rotary ? out.rotary_share : out.linear_share) = 1.0;
    return out;
  }

  static nc::ReaderOptions reader_options(const VerifyOptions& o) {
    nc::ReaderOptions r;
    r.raw_lines = o.raw_lines;
    return r;
  }

  void take(const nc::Block& block) {
    if (const auto* motion = std::get_if<nc::Motion>(&block)) return take(*motion, nullptr);
    if (const auto* motion = std::get_if<nc::VariableMotion>(&block)) take(motion->motion, motion);
    if (const auto* arc = std::get_if<nc::Arc>(&block)) take(*arc);
    if (const auto* hole = std::get_if<nc::Hole>(&block)) take(*hole);
    if (const auto* latch = std::get_if<nc::LatchValues>(&block)) waiting.emplace_back(*latch);
    if (const auto* run_time = std::get_if<nc::RunTimeStep>(&block)) waiting.emplace_back(*run_time);
    if (const auto* control = std::get_if<nc::TcpControl>(&block)) tcp = control->on;
    if (const auto* cutter = std::get_if<nc::CutterCompensation>(&block))
      compensates = cutter->side == nc::CutterSide::off ? std::nullopt : std::optional(rotary);
    if (const auto* offset = std::get_if<nc::WorkOffset>(&block)) shift.read(*offset);
    if (const auto* offset = std::get_if<nc::OffsetShift>(&block)) shift.read(*offset);
    // What the machine does takes its turn among the motions, which may have to wait for theirs.
    if (const auto* comment = std::get_if<nc::Comment>(&block); comment != nullptr && offsets)
      waiting.emplace_back(*comment);
    if (const auto* dwell = std::get_if<nc::Dwell>(&block)) waiting.emplace_back(*dwell);
    if (std::holds_alternative<nc::ToolCall>(block) && controller.tool_change_s > 0.0)
      waiting.emplace_back(nc::Dwell{std::llround(controller.tool_change_s * 1000.0)});
    if (const auto* spindle = std::get_if<nc::Spindle>(&block)) waiting.emplace_back(*spindle);
    if (const auto* tilted = std::get_if<nc::TiltedPlane>(&block)) take(*tilted);
  }

  struct WithTerms {
    BlockEnd end;
    nc::VariableMotion terms;
  };

  void step(const nc::RunTimeStep& line) {
    const auto* temperatures = options.run_time_temperatures;
    if (temperatures == nullptr) return values.take(line, {}, {});
    values.take(line, temperatures->at(report.duration_s), temperatures->temperature_K.front());
  }
  // The control holds the drift as it is.
  void step(const nc::LatchValues& latch) { values.latch(latch, offsets ? offsets->now() : Vec3::Zero()); }
  void step(const std::unique_ptr<WithTerms>& motion) {
    BlockEnd end = motion->end;
    end.q = shift.moved(end.q, values.change(motion->terms), end.tcp);
    step(end);
  }
  void step(const nc::Comment& comment) { offsets->comment(comment.text); }
  void step(const nc::Dwell& dwell) {
    const double seconds = static_cast<double>(dwell.milliseconds) / 1000.0;
    program.wait(seconds);
    elapse(seconds);
  }
  void step(const nc::Spindle& spindle) { program.spindle(static_cast<double>(spindle.rpm)); }

  /// `terms`: the motion with what it adds at run time, or null.
  void take(const nc::Motion& motion, const nc::VariableMotion* terms);
  void take(const BlockEnd& end);
  /// Motions that nothing stands between: those that change no figure of the report are judged from
  /// columns, the others one by one.
  void take(const nc::MotionRun& run);

  /// Where the axes stand for these words.
  BlockEnd end_at(const JointVector& words) const {
    BlockEnd v;
    v.tcp = tcp && !plane;
    if (v.tcp) v.word_tip_P = tip_of(words);
    v.q = plane ? joints_of_plane_words(words) : tcp ? joints_of_part_words(words) : joints_of_words(words);
    if (!plane && !shift.is_idle()) v.q = shift.joints(v.q, tcp);
    return v;
  }

  /// The places along the way, one block end each. False: the position is not known.
  bool words_of_shape(const nc::AxisWords& words, SourceRef source, JointVector& out);
  void take(const nc::Arc& arc);
  void take(const nc::Hole& hole);
  void put(const BlockEnd& end) {
    waiting.emplace_back(end);
    work();
  }
  static JointVector with_xyz(const State& state, const JointVector& words, const std::array<double, 3>& xyz);

  // The control turns its rotary axes until the tool stands along Z of the plane: the solution nearest to
  // where they stand.
  void take(const nc::TiltedPlane& block) {
    plane.reset();
    from_unknown = true;
    if (!block.on) return;
    plane = PlaneFrame::of(controller, block);
    const auto found = inverse(machine, {plane->X_PF.p, plane->X_PF.R.col(2)}, rotary);
    plane_q = found.empty() ? rotary : found[0].q;
  }
  JointVector joints_of_plane_words(const JointVector& words) const {
    JointVector q = plane_q;
    meter.kinematics().solve_linear(plane->X_PF * tip_of(words), meter.kinematics().sines(q), q);
    return q;
  }

  JointVector joints_of_words(const JointVector& words) const {
    JointVector q;
    for (AxisId id = 0; id < kMaxAxes; ++id) q[id] = words[id] - word_offsets[id];
    return q;
  }

  // Under tool-centre-point control X Y Z are the tip in P.
  Vec3 tip_of(const JointVector& words) const {
    Vec3 tip_P = Vec3::Zero();
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      if (machine.axes[id].kind == AxisKind::linear)
        tip_P[static_cast<Eigen::Index>(nc::index(letters[id]))] = words[id];
    }
    return tip_P;
  }
  JointVector joints_of_part_words(const JointVector& words) const {
    JointVector q = words;
    meter.kinematics().solve_linear(tip_of(words), meter.kinematics().sines(q), q);
    return q;
  }

  const PathPoints& targets() const { return *points; }
  // A block can be judged when the CL motions are known up to well beyond it.
  bool may_step() const { return all_expected || targets().size() > at.segment + kLookAhead; }
  // The same for a block to `q` that begins where the last one ends, and that cannot reach beyond the motions
  // that are known.
  bool is_within_known(const BlockEnd& end) const;
  void work();
  void forget_passed();

  void step(const BlockEnd& end);
  void elapse(double seconds) {
    report.duration_s += seconds;
    if (offsets) offsets->advance(seconds);
  }

  /// The ends of the blocks of a run, as far as the CL path and the errors of the machine have no part in it.
  /// Row 0 is where the first of them begins.
  struct RunEnds {
    explicit RunEnds(const TableKinematics& kinematics) : stations(kinematics) {}
    path::StationRun stations;
    std::vector<double> seconds, slowest_s;  // of the blocks, and what their slowest axes need
    double speed_ratio = 0.0;                // the largest
    JointVector smallest_q, largest_q;
    bool within_limits = false;  // and no axis is too fast
  };
  bool may_take(const nc::MotionRun& run) const;
  void evaluate(const nc::MotionRun& run, RunEnds& out) const;
  template <class T>
  void put_words(const nc::MotionRun& run, RunEnds& out) const;
  template <class T>
  static void find_speed(std::size_t count, RunEnds& out);
  const RunEnds& ends_of(const nc::MotionRun& run);
  /// Goes on over the blocks from `row` on, one before `end` at most, that are quiet a few at a time: how
  /// many.
  std::size_t pass_quiet(std::size_t row, std::size_t end, const KnownFigures& known);
  /// How many blocks have been judged, from the first one on.
  std::size_t step(const nc::MotionRun& run, const RunEnds& ends);
  /// As a vertex of its own, but for the errors there.
  void load(const nc::MotionRun& run, const RunEnds& ends, std::size_t row, Vertex& v) const;
  void count_blocks(const nc::MotionRun& run, const RunEnds& ends, std::size_t count);

  // Time of the block as the control runs it; its speed is looked at, too.
  double block_seconds(const Vertex& v);
  double seconds_of(const Vertex& v) const;
  // The leader, which stands where `v` is, came from where this one comes from.
  bool is_block_of_leader(const Vertex& v) const;
  double seconds_of_leader(const Vertex& v);
  void check_speed(const Vertex& v, double seconds);

  // How near a block must come to a CL point that is reached by a rapid to be that point; blocks on the way
  // may be anywhere. Above compensation and rounding, on a machine with errors above those; below the length
  // of rapids.
  double hit_tolerance() const;

  void start(const Vertex& v);

  void point_hit(double tip_mm);

  void rapid(const Vertex& v);

  // Points of a rapid may lie within reach of its end: it is met by the block that comes nearest.
  bool comes_nearer(const Vertex& v);
  void settle_rapid_end();

  // CL points at which the tool stands already ask for no block.
  void pass_repeated_points();

  // A rapid begins where the cut ended: within rounding or the tolerance of the CL point there.
  void pass_end_of_cut();

  void feed(Vertex& v);
  /// `v` ends at this place of the path. True when that is a CL point.
  bool move_on(const ToolPose& v, const Place& place);
  KnownFigures known_figures() const;
  /// What is known of a block that may change no figure.
  struct Quiet {
    bool may_be = false;
    bool tip_keeps = false, axis_keeps = false;
    bool surely() const { return tip_keeps && axis_keeps; }
  };
  /// The block from `from` to `v`, which ends at `place` and leaves its chord by `bow` at most. `axis`: by
  /// which the tool axis leaves its course at most.
  Quiet is_quiet(const ToolPose& from, const ToolPose& v, const Place& place,
                 const path::Certifier::Bows& bow, const KnownFigures& known, double& axis) const;
  void note_axis(double axis, const KnownFigures& known);
  /// The same without a look ahead: no, too, for what needs one. `place`: where the block ends.
  Quiet is_quiet(const ToolPose& from, const ToolPose& v, const path::Certifier::Bows& bow,
                 const KnownFigures& known, Place& place, double& axis) const;
  /// Neither the block to `v`, which ends at `place`, nor a CL point that it passes changes a figure of the
  /// report: from a bound that costs little.
  bool changes_no_figure(const Vertex& v, const Place& place);
  /// The block to `v` is as quiet as `is_quiet` left open. `axis`: as it says there; what is noted.
  bool proves_quiet(Quiet quiet, const Vertex& v, const Place& place, const KnownFigures& known, double axis);
  bool keeps_tip(const Vertex& v, const Place& place, double limit_mm) const;
  /// Takes the deviations of the block, and of the CL points that it passes. True when the block ends at one
  /// of them and a little beyond it.
  bool judge(const Vertex& v, const Place& place);

  // A CL point that lies between the ends of a block belongs to the nearer end when that is as near as
  // compensation, tolerance or the machine's errors explain. True when it is the end `v`.
  bool mark_nearer(const Vertex& v, const Target& target);
  double near_point_mm() const;
  void mark_programmed();

  Target place_of_path() const;

  // The tool leaves the path along its axis, away from the part, to turn elsewhere (wind-up, limits).
  bool leaves(const Vertex& v);

  // Back along the tool axis to the place that was left. Whatever else a feed move does out there is judged
  // as a motion of the path.
  bool comes_back(const Vertex& v);

  // Strokes of a drilling cycle between where the feed begins and the bottom: the control has its own steps.
  // Each must be along the hole, no rapid below what was drilled, and no step deeper than the CL file's
  // deepest. True when `v` is one.
  bool steps(const Vertex& v);

  // Place on the CL path where the block ends: the nearest one ahead, no farther along the path than the
  // block can have come.
  Place find(const Vertex& from, const Vertex& v) const;
  /// The same where nothing beyond the two next CL points has to be looked at.
  std::optional<Place> find_near(const ToolPose& from, const ToolPose& v) const;
  /// As find_ahead, where the place can only be beside one CL point, the next or the one behind it.
  /// `off_axis`: by which the axis of `v` misses that of the next.
  std::optional<Place> find_at_corner(const ToolPose& from, const ToolPose& v, double off_axis) const;
  Place find_ahead(const ToolPose& v, const Way& way) const;
  /// `v` at this fraction of a segment.
  Place placed_at(const ToolPose& v, std::size_t segment, double t) const;
  Place placed_at(const ToolPose& v, std::size_t segment, double t, double off_tip_mm) const;
  bool is_at_end(const Target& b, double off2_mm2, double chord2) const;
  /// Fraction of the segment a-b at which `v` stands, when its foot is on the way ahead and it is within the
  /// tolerances.
  std::optional<double> still_on(const ToolPose& v, const Target& a, const Target& b) const;

  // Deviations that change no figure of the report: below the last of the worst places, and below the largest
  // of the axis.
  DeviationMeter::Deviation uninteresting() const;

  // Between these two the tool axis may be off by the pole's tolerance more.
  bool near_pole(const Target& a, const Target& b) const;
  bool in_cone(const Vec3& axis_P) const;
  // Combined measure of how far `v` is from a place of the path; what the pole allows is no distance.
  double distance_to(const ToolPose& v, const Vec3& tip_P, const Vec3& axis_P) const;

  void take_deviation(const DeviationMeter::Deviation& d, bool in_cone = false) {
    block_proved = block_proved && d.proved;
    if (d.unbounded != nullptr) {
      auto& ids = report.unproved_effects;
      const std::string& id = d.unbounded->info().id;
      if (std::find(ids.begin(), ids.end(), id) == ids.end()) ids.push_back(id);
    }
    block_tip_mm = std::max(block_tip_mm, d.tip_mm.upper);
    block_axis_rad = std::max(block_axis_rad, d.axis_rad.upper);
    report.max_tip_deviation_mm = std::max(report.max_tip_deviation_mm, d.tip_mm.lower);
    report.certified_tip_deviation_mm = std::max(report.certified_tip_deviation_mm, d.tip_mm.upper);
    if (!in_cone) judged_axis_rad = std::max(judged_axis_rad, d.axis_rad.upper);
    Angle& largest = in_cone ? report.max_pole_axis_deviation : report.max_axis_deviation;
    largest = std::max(largest, Angle::radians(d.axis_rad.upper));
  }

  // A block that is not straight itself leaves its chord by so much more.
  void bows_by(double off_chord_mm) {
    block_tip_mm += off_chord_mm;
    report.certified_tip_deviation_mm = std::max(report.certified_tip_deviation_mm, block_tip_mm);
  }

  void record_feed(const Vertex& v, std::uint32_t cl_line, bool programmed) {
    auto& worst = report.worst;
    if (worst.size() < options.worst_count || (!worst.empty() && block_tip_mm > worst.back().tip_mm)) {
      const WorstPlace place{v.nc_line, cl_line, block_tip_mm, Angle::radians(block_axis_rad), v.tip_P};
      const auto by_tip = [](const WorstPlace& x, const WorstPlace& y) { return x.tip_mm > y.tip_mm; };
      worst.insert(std::upper_bound(worst.begin(), worst.end(), place, by_tip), place);
      if (worst.size() > options.worst_count) worst.pop_back();
    }
    record(v, block_tip_mm, block_axis_rad, cl_line, programmed);
    if (!block_proved) {
      ++report.sampled_blocks;
      report.certified = false;
    }
    block_proved = true;
    block_tip_mm = 0.0;
    block_axis_rad = 0.0;
  }

  void record(const Vertex& v, double tip_mm, double axis_rad, std::uint32_t cl_line, bool programmed) {
    if (!options.collect) return;
    report.blocks.push_back({v.q, v.tip_P, static_cast<float>(tip_mm), static_cast<float>(axis_rad), path_mm,
                             0.0, v.nc_line, cl_line, v.rapid, programmed, block_proved});
  }

  void check_limits(const Vertex& v);
  /// What the report says of the axes' way.
  void report_travel();

  const Machine& machine;
  const nc::Controller& controller;
  std::string file;
  Diagnostics& findings;
  Vec3 tool_mm;
  VerifyOptions options;
  std::optional<OffsetTracker> offsets;
  DeviationMeter meter;
  FeedPlanner planner;
  WorkShift shift;
  RunTimeValues values;
  ProgramState program;
  std::size_t axis_count = machine.axes.size();
  std::array<nc::AxisLetter, kMaxAxes> letters{};
  std::array<WordOfAxis, kMaxAxes> word_of{};
  JointVector least, most;            // travel of the axes
  JointVector smallest_q, largest_q;  // positions so far
  double cone_cosine = 0.0;           // of the pole's cone
  bool has_cone = false;              // it has a tolerance of its own
  JointVector word_offsets;           // word minus joint position
  std::uint16_t needed = 0;
  std::uint16_t linear = 0;                // of those
  std::optional<JointVector> compensates;  // rotary words from which cutter compensation is on
  bool tcp = false;
  std::optional<PlaneFrame> plane;
  JointVector rotary;         // as the last words had them
  JointVector plane_q;        // where the control has the rotary axes in the plane
  bool from_unknown = false;  // a motion of which not all positions were known was left out

  PathPoints own_points;
  PathPoints* points = &own_points;  // those of the leader, where there is one
  Place at;
  struct RapidEnd {
    Target target;
    double tip_mm;
    double distance;
  };
  std::optional<RapidEnd> rapid_end;  // the last CL point that a rapid has come to
  bool started = false;
  bool all_expected = false;
  double drilled_mm = 0.0;  // in the hole at hand, from where the feed begins
  bool away = false;        // the tool has left the path along its axis
  // A block with terms of its own is large and rare: the others keep their size.
  std::vector<std::variant<BlockEnd, std::unique_ptr<WithTerms>, nc::LatchValues, nc::RunTimeStep,
                           nc::Comment, nc::Dwell, nc::Spindle>>
      waiting;
  std::size_t next_waiting = 0;
  std::array<Vertex, 2> vertices;
  Vertex* previous = &vertices[0];
  Vertex* present = &vertices[1];
  bool have_previous = false;
  mutable std::array<Vertex, 2> cut_at;  // used by keeps_tip
  double path_mm = 0.0;
  double last_seconds = 0.0;  // of the last block
  double last_speed_ratio = 0.0;
  mutable std::optional<path::Certifier::Bows>
      bows;                   // of the last block on the nominal machine, where needed
  bool shares_block = false;  // its ends are those of the leader's last block
  double block_tip_mm = 0.0;
  double block_axis_rad = 0.0;
  double judged_axis_rad = 0.0;  // largest of the blocks that were judged, outside the pole's cone
  bool block_proved = true;
  VerifyReport report;
  State* follower = nullptr;  // takes the blocks that `reader` reads, too
  RunEnds run_ends{meter.kinematics()};
  bool four = lanes::four_at_a_time();
  bool has_ends = false;                      // `run_ends` are those of the run at hand
  const path::PoseRun* placed_run = nullptr;  // of the run at hand, on the machine that is verified
  path::PoseRun with_errors;
  QuietRun quiet_run;
  const State* leader = nullptr;     // whose follower this one is
  bool follows = false;              // takes those of another one's
  bool same_words = false;           // which mean the same to both
  std::optional<BlockEnd> last_end;  // of the motion at hand, for the follower
  bool stepped = false;              // and it has been judged already
  bool within_limits = false;        // the last block
  nc::Reader reader;
};

}  // namespace trunnion::post
