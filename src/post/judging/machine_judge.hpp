#pragma once
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "trunnion/post/verify.hpp"

#include "post/feeds/control_times.hpp"
#include "post/judging/block_trail.hpp"
#include "post/judging/blocks_waiting.hpp"
#include "post/judging/cut_judge.hpp"
#include "post/judging/machine_as_run.hpp"
#include "post/judging/path_follower.hpp"
#include "post/judging/program_judge.hpp"
#include "post/judging/quiet_run.hpp"
#include "post/judging/run_ends.hpp"
#include "post/judging/travel_seen.hpp"
#include "post/words_in_force.hpp"

// Private to the verifier.
namespace trunnion::post {

/// On which machine a program is judged, and how.
struct JudgedMachine {
  const Machine& machine;
  const nc::Controller& controller;
  VerifyOptions options;
};

/// Follows the axes of a program along the CL path on one machine, with its errors or nominal, and judges
/// where the tool goes. It is handed the blocks in their order; they wait until enough of the CL path is
/// known.
class MachineJudge {
 public:
  /// @param words   of the program that is replayed, as they stand when a block is read
  /// @param points  the CL path, added to while the program is read
  /// References must outlive the judge.
  MachineJudge(JudgedMachine judged, const WordsInForce& words, PathPoints& points);
  MachineJudge(const MachineJudge&) = delete;
  MachineJudge& operator=(const MachineJudge&) = delete;

  /// The other machine is handed each block after this one, which may take over what this one has found.
  void lead(MachineJudge& other);
  /// This one holds the words beside the path against the CL file, too.
  void judge_program();
  ProgramJudge* program_judge() { return program_judge_ ? &*program_judge_ : nullptr; }
  const PathFollower& path() const { return path_; }
  const JudgedMachine& judged() const { return judged_; }
  /// A motion of the CL file.
  void expect_motions(std::size_t count) { record_.report.points_in += count; }

  /// The end of a motion.
  void take(const BlockEnd& end);
  /// A place on the way of an arc or a cycle.
  void put(const BlockEnd& end);
  void add(WithTerms motion);
  void add(const nc::LatchValues& latch) { waiting_.add(latch); }
  void add(const nc::RunTimeStep& step) { waiting_.add(step); }
  void add(const nc::Dwell& dwell) { waiting_.add(dwell); }
  void add(const nc::Spindle& spindle) { waiting_.add(spindle); }
  void add(const nc::Retract& retract) { waiting_.add(retract); }
  void add(const nc::Comment& comment);
  /// The words that follow are those of another tool; the motions before them may still wait.
  void add(const InSpindle& tool);
  void mark(const nc::Block& block, std::uint32_t nc_line);
  void take_axes(std::uint16_t mask, std::uint32_t nc_line);
  /// What the program leaves of shifted offsets is not as it should be.
  void find_offset(const std::string& what, std::uint32_t nc_line);
  /// Motions that nothing stands between: those that change no figure of the report are judged from columns.
  /// How many have been taken, from the first one on; the others are to be taken one by one.
  /// @param may  their words say where all axes stand, on the CL path
  std::size_t take(const nc::MotionRun& run, bool may);

  /// The program has been read to its end, which is `nc_line`.
  VerifyReport finish(const WordFigures& words, std::uint32_t nc_line);

 private:
  /// The tool that motions are judged with.
  struct Tool {
    double length_mm = 0.0;
    std::optional<DeviationMeter> meter;
  };
  /// How far the CL path has been followed, beside the place on it.
  struct Progress {
    struct RapidEnd {
      Target target;
      double tip_mm;
      double distance;
    };
    std::optional<RapidEnd> rapid_end;  // the last CL point that a rapid has come to
    bool started = false;
    bool all_expected = false;  // the CL file has no more points
    bool away = false;          // the tool has left the path along its axis
    bool stopped_away = false;  // the program has said something since it left
    double drilled_mm = 0.0;    // in the hole at hand, from where the feed begins
    double latched_s = 0.0;     // when the control took its values last
  };
  /// The block that was judged last.
  struct LastBlock {
    double seconds = 0.0;
    double speed_ratio = 0.0;
    std::optional<path::Certifier::Bows> bows;  // on the nominal machine, where they were asked for
  };
  /// The ends of the block at hand, and what is known of the last one.
  struct Ends {
    std::array<Vertex, 2> vertices;
    Vertex* previous = &vertices[0];
    Vertex* present = &vertices[1];
    bool has_previous = false;
    LastBlock last;

    void go_on() {
      std::swap(previous, present);
      has_previous = true;
    }
  };
  /// How fast the axes are, and how far they go.
  struct AxisMotion {
    ControlTimes times;
    TravelSeen travel;
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
  /// Two judges of the same blocks: each block goes to the leader before it goes to the follower.
  struct Sharing {
    const MachineJudge* leader = nullptr;
    MachineJudge* follower = nullptr;
    bool same_words = false;  // words mean the same to both
    bool same_block = false;  // the block at hand has the ends of the leader's last block
    bool stepped = false;     // the motion at hand has been judged already
  };
  struct RunAtHand;
  struct RowsAtHand;

  const VerifyOptions& options() const { return judged_.options; }
  const DeviationMeter& meter() const { return *tool_.meter; }
  const PathPoints& points() const { return path_.points(); }
  const Place& at() const { return path_.at(); }
  const AxisWordsOf& axis_words() const { return words_.axis_words(); }
  bool words_are_positions() const {
    return !as_run_.offsets && options().temperatures.of_program == nullptr;
  }

  // What the machine does, in its turn.
  void step(const BlockEnd& end);
  void step(const std::unique_ptr<WithTerms>& motion);
  void step(const nc::LatchValues& latch);
  void step(const nc::RunTimeStep& line);
  void step(const nc::Comment& comment);
  void step(const nc::Dwell& dwell);
  void step(const nc::Spindle& spindle);
  void step(const nc::Retract& retract);
  void step(const InSpindle& next) { put_in_spindle(next.length_mm); }
  void step(const std::unique_ptr<Mark>& mark);
  void put_in_spindle(double length_mm);
  void work();
  void forget_passed();
  std::size_t settled() const {
    return trail_.marks().empty() ? at().segment : trail_.marks().front().at.segment;
  }
  void forget(std::size_t count);
  // A block can be judged when the CL motions are known up to well beyond it.
  bool may_step() const { return progress_.all_expected || points().size() > at().segment + kLookAhead; }
  /// The same for a block that begins where the last one ends, and that cannot reach beyond the motions that
  /// are known.
  bool is_within_known(const BlockEnd& end) const;

  // Time, speed and travel of a block.
  void elapse(double seconds);
  double block_seconds(const Vertex& v);
  /// Where the words of the present block lead to, and of the one before: not where late axes come to.
  const JointVector& commanded(const Vertex& v) const;
  const JointVector& commanded_before() const;
  double seconds_of(const Vertex& v) const;
  bool is_block_of_leader(const Vertex& v) const;
  double seconds_of_leader(const Vertex& v);
  void check_speed(const Vertex& v, double seconds);
  void check_limits(const Vertex& v);
  void report_travel();
  /// The block at hand, which lasts so long, on axes that accelerate.
  void reach(const Vertex& v, double seconds, bool apart);
  void reach(const ReachedFeeds::Block& block);
  Pace pace_of(const Vertex& from, const Vertex& v, double seconds, double slowest_s) const;

  // Along the CL path.
  void start(const Vertex& v);
  void rapid(const Vertex& v);
  /// Of a rapid that is not at the next CL point: where it may be all the same.
  bool is_back_at_rapid(const Vertex& v);
  void judge_rapid(const Vertex& v);
  void judge_feed_to(const Target& target, std::uint32_t nc_line);
  bool turns_in_place(const Vertex& v) const;
  /// A rapid straight up to the safe height, where tool-centre-point control ends: a retract.
  bool rises(const Vertex& v) const;
  /// Points of a rapid may lie within reach of its end: it is met by the block that comes nearest.
  bool comes_nearer(const Vertex& v);
  /// A rapid under tool-centre-point control: the part may not swing below the safe height.
  void judge_swing(const Vertex& v);
  void judge_whole_turn(const Vertex& v);
  /// Both ends of the motion are at the safe height.
  bool stands_safe(const Vertex& from, const Vertex& to) const;
  void settle_rapid_end();
  /// By which rounding of the words takes the tip off a point.
  double words_rounding_mm() const;
  /// CL points at which the tool stands already ask for no block.
  void pass_repeated_points(const Vertex& v);
  bool is_repeated(const Target& next, const Vertex& v) const;
  /// A rapid begins where the cut ended: within rounding or the tolerance of the CL point there.
  void pass_end_of_cut(const Vertex& v);
  bool comes_from_stop(const Vertex& v) const;
  bool ends_cut(std::size_t point) const;
  static bool repeats(const Target& point) {
    constexpr double kSameAxis_rad = 1e-7;  // rounding of a unit vector
    return point.way_mm <= kSamePoint_mm && point.turn <= kSameAxis_rad;
  }
  void hit_point(std::size_t point, const ToolPose& v);
  void feed(Vertex& v);
  void feed_beyond_end(const Vertex& v);
  /// From the safe height down to the next CL point.
  bool may_begin_cut() const;
  bool comes_with_new_tool(const Vertex& v) const;
  bool arrives(const Vertex& v);
  /// The tool leaves the path along its axis, away from the part, to turn elsewhere (wind-up, limits).
  bool leaves(const Vertex& v);
  /// Back along the tool axis to the place that was left. Whatever else a feed move does out there is judged
  /// as a motion of the path.
  Target place_left() const;
  bool comes_back(const Vertex& v);
  /// A stroke of a drilling cycle between where the feed begins and the bottom: the control has its own
  /// steps. Each must be along the hole, no rapid below what was drilled, and no step deeper than the CL
  /// file's deepest. True when `v` is one.
  bool drills(const Vertex& v);
  /// `v` ends at this place of the path. True when that is a CL point.
  bool move_on(const ToolPose& v, const Place& place);

  // How far the tool is off it.
  CutJudge cut_judge() { return {meter(), path_, as_run_.state, record_}; }
  bool changes_no_figure(const CutBlock& block);
  /// How far the tip may go back on a segment of the path, and whether a block goes back farther.
  double back_limit_mm() const;
  bool goes_back(const Vertex& v, const Place& place);

  // Runs of blocks (machine_judge_runs.cpp).
  bool may_take_run() const;
  const RunEnds& ends_of(const nc::MotionRun& run);
  std::size_t step(const nc::MotionRun& run, const RunEnds& ends);
  /// Goes on over the blocks from `row` on, one before `end` at most, that are quiet a few at a time: how
  /// many.
  std::size_t pass_quiet(std::size_t row, std::size_t end, const KnownFigures& known);
  /// As a vertex of its own, but for the errors there.
  void load(const RunAtHand& run, std::size_t row, Vertex& v) const;
  void count_blocks(const RunAtHand& run, std::size_t count);
  /// The first row from `row` on, of `end` at most, that may end where the CL file asks for something else.
  std::size_t row_of_change(const RunEnds& ends, std::size_t row, std::size_t end) const;
  void judge_rows(const RunAtHand& run, std::size_t first, std::size_t last, const Place& from);

  // What a block is matched to is the nearest place ahead; where the path comes back along itself that may be
  // the wrong one, which only a later block shows. Then the blocks behind the last mark are matched anew, all
  // together (`match_places`), and judged where they then are (machine_judge_runs.cpp).
  /// A block of the cut is about to be judged.
  void note_on_trail(const Vertex& v);
  void mark_trail();
  TrailMark trail_mark() const;
  void go_back_to(const TrailMark& mark);
  /// Of the blocks on the trail; false, and nothing changed, where there is no match within the tolerances.
  /// `last_point`: at which the last of them ends.
  enum class LastBlockIs : std::uint8_t { at_hand, judged };
  bool match_anew(LastBlockIs last, std::optional<std::size_t> last_point = std::nullopt);
  std::vector<Vertex> trail_from(const TrailMark& mark);
  /// The first block of which a figure is beyond its tolerance there.
  std::optional<std::size_t> judge_anew(std::span<Vertex> stands_at, std::span<const Place> places,
                                        LastBlockIs last);
  /// The last CL point before the next rapid.
  std::size_t end_of_cut() const;
  std::optional<std::size_t> stands_ahead() const;
  bool may_match_anew() const;
  /// Something stands between the blocks before and those behind.
  void end_trail();
  /// The cut is over, and the program not at its end.
  void match_end_of_cut();

  JudgedMachine judged_;
  const WordsInForce& words_;
  PathPoints& expected_;
  PathFollower path_;
  Progress progress_;
  BlocksWaiting waiting_;
  Tool tool_;
  AxisMotion axes_;
  MachineAsRun as_run_;
  Ends ends_;
  RunAtOnce at_once_;
  CutRecord record_;
  BlockTrail trail_;
  Sharing sharing_;
  std::optional<ProgramJudge> program_judge_;
};

}  // namespace trunnion::post
