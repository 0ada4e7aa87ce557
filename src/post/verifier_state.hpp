#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "trunnion/nc/reader.hpp"
#include "trunnion/post/verify.hpp"

#include "post/block_trail.hpp"
#include "post/deviation_meter.hpp"
#include "post/feed_plan.hpp"
#include "post/program_judge.hpp"
#include "post/quiet_run.hpp"
#include "post/run_ends.hpp"
#include "post/run_time_values.hpp"
#include "post/safe_walk.hpp"
#include "post/travel_seen.hpp"
#include "post/words_in_force.hpp"

// Private to the verifier: where the program read back stands, and how far the CL path has been followed.

namespace trunnion::post {

// Far more CL points than one block of a thinned program passes.
inline constexpr std::size_t kLookAhead = 1024;

/// The block at hand, as far as it was judged: upper bounds of its deviations.
struct BlockFigures {
  double tip_mm = 0.0;
  double axis_rad = 0.0;
  double flute_mm = 0.0;
  bool proved = true;
};

/// How far the CL path has been followed, beside the place on it.
struct PathProgress {
  struct RapidEnd {
    Target target;
    double tip_mm;
    double distance;
  };
  std::optional<RapidEnd> rapid_end;  // the last CL point that a rapid has come to
  bool started = false;
  bool all_expected = false;  // the CL file has no more points
  bool away = false;          // the tool has left the path along its axis
  bool from_unknown = false;  // a motion of which not all positions were known was left out
  double drilled_mm = 0.0;    // in the hole at hand, from where the feed begins
};

/// The machine while the program runs: what hangs on its past, its drift, the values that the control holds.
struct MachineAsRun {
  MachineAsRun(const Machine& machine, const nc::Controller& controller, const VerifyOptions& o)
      : offsets(o.offsets != nullptr
                    ? std::optional<OffsetTracker>(std::in_place, *o.offsets, unlimited(o.offset_limits))
                    : std::nullopt),
        values(controller),
        state(machine.axes.size(), o.truth != nullptr ? o.truth->lags() : std::vector<LagRequest>{},
              o.temperatures) {}

  void elapse(double seconds) {
    if (offsets) offsets->advance(seconds);
  }
  void move_to(const JointVector& q, double seconds) {
    state.move_to(q, seconds);
    elapse(seconds);
  }

  std::optional<OffsetTracker> offsets;
  RunTimeValues values;
  ProgramState state;
};

/// The tool that motions are judged with.
struct JudgedTool {
  double length_mm = 0.0;
  std::optional<DeviationMeter> meter;
};

/// The block that was judged last.
struct LastBlock {
  double seconds = 0.0;
  double speed_ratio = 0.0;
  std::optional<path::Certifier::Bows> bows;  // on the nominal machine, where they were asked for
};

/// The tools of the CL file, and those that the program has loaded so far.
struct ToolsRead {
  explicit ToolsRead(const ToolOptions& options) : flute(options) {}

  FluteLength flute;                          // of the CL motions at hand
  std::map<std::uint32_t, double> length_of;  // of the tools of the CL file
  std::optional<std::int64_t> unknown;        // that was read last, until the first motion with it
  bool any = false;

  /// Gauge length, from the CL file or else from the table, which may be null.
  std::optional<double> length_mm(std::uint32_t number, const ToolTable* table) const {
    if (const auto loaded = length_of.find(number); loaded != length_of.end()) return loaded->second;
    if (table == nullptr) return std::nullopt;
    const auto known = table->find(number);
    return known != table->end() ? std::optional(known->second.length_mm) : std::nullopt;
  }
};

/// The run of motions at hand, in columns.
struct RunAtOnce {
  std::optional<RunEnds> ends;
  bool has_ends = false;                  // of the run at hand
  const path::PoseRun* placed = nullptr;  // on the machine that is verified
  path::PoseRun with_errors;
  QuietRun quiet;

  /// Motions are made with another tool from here on.
  void begin(const TableKinematics& kinematics) {
    ends.emplace(kinematics);
    has_ends = false;
    placed = nullptr;
  }
};

struct Verifier::State {
  State(const Machine& m, const nc::Controller& c, const VerifyOptions& o, const std::string& nc_file,
        Diagnostics& diagnostics);

  static nc::ReaderOptions reader_options(const VerifyOptions& o) {
    nc::ReaderOptions r;
    r.raw_lines = o.raw_lines;
    r.whole_program = true;
    return r;
  }

  void take(const nc::Block& block) {
    if (const auto* motion = std::get_if<nc::Motion>(&block)) return take(*motion, nullptr);
    take_other(block);
  }
  void take_other(const nc::Block& block);
  /// The line that is read.
  std::uint32_t nc_line() const {
    return shared.leader != nullptr ? shared.leader->reader.line() : reader.line();
  }

  /// The words that follow are those of another tool; the motions before them are not yet judged.
  void take(const nc::ToolCall& call);
  /// Motions are judged with a tool of this gauge length.
  struct InSpindle {
    double length_mm = 0.0;
  };
  void put_in_spindle(double length_mm);
  void step(const InSpindle& next) { put_in_spindle(next.length_mm); }

  /// Words that are no motion, for the judge.
  struct Mark {
    nc::Block block;
    std::uint32_t nc_line = 0;
  };
  void mark(const nc::Block& block) {
    if (program_judge) waiting.add(std::make_unique<Mark>(Mark{block, nc_line()}));
  }
  void step(const std::unique_ptr<Mark>& mark) {
    trail.clear();
    program_judge->take(mark->block, at, mark->nc_line);
  }

  struct WithTerms {
    BlockEnd end;
    nc::VariableMotion terms;
  };

  void step(const nc::RunTimeStep& line) {
    const auto* temperatures = options.run_time_temperatures;
    if (temperatures == nullptr) return as_run.values.take(line, {}, {});
    as_run.values.take(line, temperatures->at(report.duration_s), temperatures->temperature_K.front());
  }
  // The control holds the drift as it is.
  void step(const nc::LatchValues& latch) {
    as_run.values.latch(latch, as_run.offsets ? as_run.offsets->now() : Vec3::Zero());
  }
  void step(const std::unique_ptr<WithTerms>& motion) {
    BlockEnd end = motion->end;
    end.q = in_force.shift.moved(end.q, as_run.values.change(motion->terms), end.tcp);
    step(end);
  }
  void step(const nc::Comment& comment) {
    trail.clear();
    as_run.offsets->comment(comment.text);
  }
  void step(const nc::Dwell& dwell) {
    trail.clear();
    const double seconds = static_cast<double>(dwell.milliseconds) / 1000.0;
    as_run.state.wait(seconds);
    elapse(seconds);
  }
  // Straight up is along the tool axis.
  void step(const nc::Retract&) {
    trail.clear();
    progress.away = progress.started;
  }
  void step(const nc::Spindle& spindle) {
    trail.clear();
    as_run.state.spindle(static_cast<double>(spindle.rpm));
  }

  // A block with terms of its own is large and rare: the others keep their size.
  using Waiting =
      std::variant<BlockEnd, std::unique_ptr<WithTerms>, nc::LatchValues, nc::RunTimeStep, nc::Comment,
                   nc::Dwell, nc::Spindle, InSpindle, nc::Retract, std::unique_ptr<Mark>>;
  /// Blocks that were read, and cannot be judged before more of the CL path is known.
  struct BlocksWaiting {
    std::vector<Waiting> blocks;
    std::size_t next = 0;

    template <class Block>
    void add(Block&& block) {
      blocks.emplace_back(std::forward<Block>(block));
    }
    bool is_empty() const { return next == blocks.size(); }
    /// Half at a time: what is left is moved, and in a program that had to wait for its end that may be all
    /// of it.
    void drop_judged() {
      if (is_empty()) {
        blocks.clear();
        next = 0;
      } else if (next > std::max(kLookAhead, blocks.size() / 2)) {
        blocks.erase(blocks.begin(), blocks.begin() + static_cast<std::ptrdiff_t>(next));
        next = 0;
      }
    }
  };

  /// Two verifications of one text, on the machine with its errors and on the nominal one: who reads it, and
  /// who is told.
  struct SharedText {
    State* follower = nullptr;         // takes the blocks that `reader` reads, too
    const State* leader = nullptr;     // whose follower this one is
    bool same_words = false;           // which mean the same to both
    std::optional<BlockEnd> last_end;  // of the motion at hand, for the follower
    bool stepped = false;              // and it has been judged already
    bool same_block = false;           // its ends are those of the leader's last block

    void begin_motion() {
      last_end.reset();
      stepped = false;
    }
  };

  /// `terms`: the motion with what it adds at run time, or null.
  void take(const nc::Motion& motion, const nc::VariableMotion* terms);
  void take(const BlockEnd& end);
  void take(const nc::Retract& retract);
  /// A motion at whose end not all axes are known.
  void take_partly(const nc::Motion& motion);
  /// Motions that nothing stands between: those that change no figure of the report are judged from
  /// columns, the others one by one.
  void take(const nc::MotionRun& run);

  /// The places along the way, one block end each. False: the position is not known.
  bool words_of_shape(const nc::AxisWords& words, SourceRef source, JointVector& out);
  void take(const nc::Arc& arc);
  void take(const nc::Hole& hole);
  void put(BlockEnd end) {
    end.up = walk.wholly(end.q, end.rapid, end.tcp, in_force.kinematics, end.nc_line) && walk.is_up();
    waiting.add(end);
    work();
  }
  void take(const nc::TiltedPlane& block) {
    const bool turns = in_force.enter(block);
    progress.from_unknown = true;
    if (turns) walk.turns_to(in_force.plane_q, nc_line());
  }

  const DeviationMeter& meter() const { return *judged_with.meter; }
  const PathPoints& targets() const { return *points; }
  // A block can be judged when the CL motions are known up to well beyond it.
  bool may_step() const { return progress.all_expected || targets().size() > at.segment + kLookAhead; }
  // The same for a block to `q` that begins where the last one ends, and that cannot reach beyond the motions
  // that are known.
  bool is_within_known(const BlockEnd& end) const;
  void work();
  void forget_passed();

  void step(const BlockEnd& end);
  void elapse(double seconds) {
    report.duration_s += seconds;
    as_run.elapse(seconds);
  }

  bool may_take(const nc::MotionRun& run) const;
  const RunEnds& ends_of(const nc::MotionRun& run);
  /// Goes on over the blocks from `row` on, one before `end` at most, that are quiet a few at a time: how
  /// many.
  std::size_t pass_quiet(std::size_t row, std::size_t end, const KnownFigures& known);
  /// How many blocks have been judged, from the first one on.
  std::size_t step(const nc::MotionRun& run, const RunEnds& ends);
  /// As a vertex of its own, but for the errors there.
  void load(const nc::MotionRun& run, const RunEnds& ends, std::size_t row, Vertex& v) const;
  void count_blocks(const nc::MotionRun& run, const RunEnds& ends, std::size_t count);
  /// The first row from `row` on, of `end` at most, that may end where the CL file asks for something else.
  std::size_t row_of_change(const RunEnds& ends, std::size_t row, std::size_t end) const;
  void judge_rows(const nc::MotionRun& run, const RunEnds& ends, std::size_t first, std::size_t last,
                  const Place& from);

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
  /// Of a rapid that is not at the next CL point: where it may be all the same.
  void judge_rapid(const Vertex& v);
  void judge_feed_to(const Target& target, std::uint32_t nc_line);
  /// The tool stands above this point, along its axis, or there.
  bool is_above(const ToolPose& v, const Target& target, double least_mm) const;
  bool turns_in_place(const Vertex& v) const;
  Pace pace_of(const Vertex& from, const Vertex& v, double seconds, double slowest_s) const;

  // Points of a rapid may lie within reach of its end: it is met by the block that comes nearest.
  bool comes_nearer(const Vertex& v);
  void settle_rapid_end();

  // CL points at which the tool stands already ask for no block.
  void pass_repeated_points();

  // A rapid begins where the cut ended: within rounding or the tolerance of the CL point there.
  void pass_end_of_cut();

  void feed(Vertex& v);
  bool arrives(const Vertex& v);
  /// `v` ends at this place of the path. True when that is a CL point.
  bool move_on(const ToolPose& v, const Place& place);
  KnownFigures known_figures() const;
  /// What is known of a block that may change no figure.
  struct Quiet {
    bool may_be = false;
    bool tip_keeps = false, axis_keeps = false;
    double axis_at_tip = 0.0;  // at most, as `axis`, where that keeps
    bool surely() const { return tip_keeps && axis_keeps; }
  };
  /// The block from `from` to `v`, which ends at `place` and leaves its chord by `bow` at most. `axis`: by
  /// which the tool axis leaves its course at most.
  Quiet is_quiet(const ToolPose& from, const ToolPose& v, const Place& place,
                 const path::Certifier::Bows& bow, const KnownFigures& known, double& axis) const;
  void note_axis(double axis, double at_tip, const KnownFigures& known);
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
  /// How far the tip may go back on a segment of the path, and whether a block goes back farther.
  double back_limit_mm() const;
  bool goes_back(const Vertex& v, const Place& place);
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

  void take_deviation(const DeviationMeter::Deviation& d, bool in_cone = false);
  /// What the tool is off beside the tip's place, of a piece that does not pass a CL point.
  void take_beside(const Vertex& from, const Vertex& v, std::size_t segment, double t0, double t1);
  void take_flute(const DeviationMeter::Beside& beside, const Target& to);
  std::pair<std::size_t, std::size_t> segments_about(std::size_t segment) const;
  DeviationMeter::Interval flute_about(const Vertex& from, const Vertex& v, std::size_t segment,
                                       int halvings);
  // A block that is not straight itself leaves its chord by so much more.
  void bows_by(double off_chord_mm);
  void record_feed(const Vertex& v, std::uint32_t cl_line, bool programmed);
  void record(const Vertex& v, double tip_mm, double axis_rad, std::uint32_t cl_line, bool programmed);

  // What a block is matched to is the nearest place ahead; where the path comes back along itself that may be
  // the wrong one, which only a later block shows. Then the blocks behind the last mark are matched anew, all
  // together (`match_places`), and judged where they then are.
  /// A block of the cut is about to be judged.
  void note_on_trail(const Vertex& v);
  void note_on_trail(const nc::MotionRun& run, const RunEnds& ends, std::size_t first, std::size_t last);
  void mark_trail();
  TrailMark mark() const;
  void go_back_to(const TrailMark& mark);
  /// Of the blocks on the trail; false, and nothing changed, where there is no match within the tolerances.
  /// `last_point`: at which the last of them ends.
  bool match_anew(std::optional<std::size_t> last_point = std::nullopt);
  bool judge_anew(std::span<Vertex> stands_at, std::span<const Place> places);
  /// The cut is over, and the program not at its end.
  void match_end_of_cut();
  MatchLimits match_limits() const;

  void check_limits(const Vertex& v);
  /// What the report says of the axes' way.
  void report_travel();

  const Machine& machine;
  const nc::Controller& controller;
  std::string file;
  Diagnostics& findings;
  VerifyOptions options;
  FollowLimits limits;
  AxisWordsOf axis_words{machine, controller.numbers.axes};
  WordsInForce in_force;
  ToolsRead tools{options.tools};
  JudgedTool judged_with;
  FeedPlanner planner;
  MachineAsRun as_run;
  TravelSeen travel{machine};

  PathPoints own_points;
  PathPoints* points = &own_points;           // those of the leader, where there is one
  std::optional<ProgramJudge> program_judge;  // of one that reads a text
  Place at;
  PathProgress progress;
  BlocksWaiting waiting;
  std::array<Vertex, 2> vertices;
  Vertex* previous = &vertices[0];
  Vertex* present = &vertices[1];
  bool have_previous = false;
  mutable std::array<Vertex, 2> cut_at;  // used by keeps_tip
  double path_mm = 0.0;
  LastBlock last_block;
  BlockFigures of_block;
  double judged_axis_rad = 0.0;  // largest of the blocks that were judged, outside the pole's cone
  VerifyReport report;
  SafeWalk walk{machine, controller.numbers.axes.quantum(nc::AxisLetter::Z),
                2.0 * options.offset_limits.clamp_mm, options.worst_count, report};
  RunAtOnce at_once;
  SharedText shared;
  BlockTrail trail;
  nc::Reader reader;
};

}  // namespace trunnion::post
