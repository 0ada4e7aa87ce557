#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/nc/axis_words.hpp"
#include "trunnion/nc/blocks.hpp"

namespace trunnion::nc {

/// Lines of text with `{placeholders}`; empty: the control has no words for it.
using Template = std::vector<std::string>;
/// One of the lines has the placeholder of this name.
bool holds(const Template& lines, std::string_view name);

/// Decimals of the F word. Conversions round to nearest; `quanta` never gives 0 for a feed > 0.
struct FeedFormat {
  int per_minute_decimals = 3;
  int inverse_time_decimals = 4;

  /// `internal`: mm/s in mode per_minute, 1/s in mode inverse_time.
  std::int64_t quanta(FeedMode mode, double internal) const;
  double internal(FeedMode mode, std::int64_t quanta) const {
    return static_cast<double>(quanta) / scale(mode) / kSecondsPerMinute;
  }
  /// The same for a per-minute feed of rotary axes alone: rad/s <-> degrees/min.
  std::int64_t rotary_quanta(double rad_s) const;
  double rotary_internal(std::int64_t quanta) const;
  int decimals(FeedMode mode) const {
    return mode == FeedMode::inverse_time ? inverse_time_decimals : per_minute_decimals;
  }
  /// Quanta of one unit.
  double scale(FeedMode mode) const {
    constexpr std::array<double, 10> kPowers = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
    return kPowers[static_cast<std::size_t>(decimals(mode))];
  }
};

/// How the control measures the path that a per-minute F refers to when rotary axes move too.
enum class FeedPath : std::uint8_t {
  linear_first,  // length of X Y Z alone if one of them moves (mm/min), else of the rotary axes (deg/min)
  all_axes,      // root of the squares of all axes, 1 degree counting as 1 mm
};

/// Convention of the three angles of a tilted plane.
enum class PlaneAngles : std::uint8_t {
  euler_zxz,  // about Z, then the new X, then the new Z
  euler_xyz,  // about X, then the new Y, then the new Z
  fixed_xyz,  // about the fixed X, then the fixed Y, then the fixed Z
};

/// A control, as its TOML file describes it (postconfigs/README.md lists every key). Data only: nothing here
/// depends on which control it is.
struct Controller {
  std::string file;                // where it was read from
  std::vector<std::string> bases;  // files that it stands on, nearest first
  Template differs_in;             // words that mean something else in the nearest of them, on purpose
  std::string name;                // "LinuxCNC 2.9"

  struct Numbers {
    AxisFormat axes;
    FeedFormat feed;
    bool trailing_zeros = true;  // X1.5000 rather than X1.5
    bool point_required =
        false;               // a number without point means something else to the control (X10 = 0.010 mm)
    bool plus_sign = false;  // X+1.5
  } numbers;

  struct Line {
    std::size_t max_length = 255;  // characters without the line end
    std::string separator = " ";   // between words
    std::string end = "\n";
    std::size_t m_words = 0;  // M words that the control takes in one block; 0: as many as stand there
    /// M3, M5 and M9 beside a motion act before it. Else nobody knows: in programs of others M5 and M9 act
    /// behind it, and of our own none starts the spindle in the block of a cut.
    bool m_words_before_motion = false;
  } line;

  struct BlockNumbers {
    bool enabled = false;
    std::string prefix = "N";
    std::int64_t start = 10;
    std::int64_t step = 10;
    std::int64_t max = 99999;             // starts again at `start` after it
    std::vector<std::string> not_before;  // lines that begin so carry no number
  } block_numbers;

  struct Comments {
    std::string open = "(";
    std::string close = ")";  // empty: to the end of the line
    std::vector<std::string>
        also_read;                // other marks that begin a comment to the end of the line, when reading
    std::size_t max_length = 80;  // of the text; longer comments are broken at a blank
    bool upper_case = false;
    /// Characters that a comment may hold: anything else is replaced. Nothing that ends a comment or a
    /// program.
    std::string characters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789 .,:+-*/=_?";
    /// In front of lines that the control might execute or a reader might take for a line of the header.
    std::string mark = "- ";
    std::vector<std::string> active_words;  // capital letters: the control executes comments that begin so
  } comments;

  struct MotionWords {
    std::string rapid = "G0";
    std::string linear = "G1";
    bool modal = true;         // written only when it changes
    std::string rapid_suffix;  // a word that makes a block rapid, as FMAX
    /// What must be set on the control so that rapids are straight lines; empty: they always are.
    std::string straight_rapids_need;
  } motion;

  struct FeedRules {
    std::string per_minute = "G94";
    std::string inverse_time = "G93";      // empty: the control has none
    bool inverse_time_every_block = true;  // F in every feed block while inverse time is active
    FeedPath path = FeedPath::all_axes;
    /// What must be set on the control so that F per minute is of the length that `path` says, where rotary
    /// axes turn and no tool-centre-point control is on; empty: it always is.
    std::string per_minute_needs;
    std::optional<double> max_per_minute;    // largest F that the control takes, mm/min
    std::optional<double> max_inverse_time;  // 1/min
    /// Lowest rate of X Y Z that the control keeps in inverse time, mm/s: slower blocks run faster than told.
    std::optional<double> min_linear_rate_mm_s;
    /// Where it goes on from block to block it slows down in time for what many blocks ahead ask for
    /// (MotionPlan); false: it looks one block ahead.
    bool looks_ahead = true;
  } feed;

  /// Coordinates as distances from where the axis stands.
  struct Incremental {
    std::string on, off;  // modal words, as G91 and G90; may be empty
    Template move;        // {axis} {distance} {feed}: one axis, at a feed per minute; ends as absolute
  } incremental;

  struct Rotary {
    /// Rotary axes (bits of AxisWords) whose angles are written in [0, 360) and which turn the shorter way:
    /// without limits, as a rule C.
    std::uint16_t modulo_axes = 0;
    /// Round the angle of such an axis, behind its letter: `=DC(` and `)`. Empty: the angle alone.
    std::string modulo_open, modulo_close;
    /// Whether such an axis turns the shorter way at all, in programs of others (M126, M127); empty: it does.
    std::string shorter_way, straight_way;
    bool is_modulo(AxisLetter letter) const { return (modulo_axes & AxisWords::bit(letter)) != 0; }
    bool has_modulo_word(AxisLetter letter) const { return !modulo_open.empty() && is_modulo(letter); }
  } rotary;

  struct Length {
    Template on;  // {length_offset}
    Template off;
    bool automatic = false;      // belongs to the tool: no words of its own
    bool with_motion = false;    // `on` stands in the next motion block, which then has a Z word
    bool moves_at_once = false;  // a word of the length alone may move Z by it, as the control is set
  } length;

  struct Tcp {
    Template on;  // {length_offset}
    Template off;
    bool with_motion = false;  // as for length
    bool off_for_tool_change =
        true;                      // switched off before a tool change, a retract and the end of the program
    bool replaces_length = false;  // `on` takes the place of length compensation, `off` ends both
    /// The words switch between kinematics of the control, on machines whose file says that it has both
    /// ([machine] switchable_kinematics).
    bool switches_kinematics = false;
    bool off_at_start = false;  // a program that was aborted may have left it on: `off` where programs begin
    /// Which of the two is active where a program begins is not known: it must say so. No key of the file;
    /// follows from the machine.
    bool unknown_at_start = false;
    bool has_one_kinematics = false;  // on a machine that does not say the control can switch them
  } tcp;

  struct Plane {
    Template on;  // {x} {y} {z} {a} {b} {c}
    Template off;
    PlaneAngles angles = PlaneAngles::euler_zxz;
    bool needs_length = false;     // length compensation must be on before it
    bool off_at_start = false;     // as for tcp
    bool off_before_next = false;  // `off` stands before another `on`
  } tilted_plane;

  struct Program {
    Template begin;  // {number} {name}
    Template setup;
    /// Of the words of `setup` those that switch nothing but modes: they stand again behind each tool change,
    /// where an operator begins after a reset.
    Template modes;
    /// Ends what a program that was aborted may have left in force: behind `setup`, and where an operator may
    /// begin.
    Template ends_earlier;
    Template end;                                        // {number} {name}
    Template also_end;                                   // other words that end a program, when reading
    std::int64_t first_reserved = 0, last_reserved = 0;  // numbers of the maker's macros; 0: none are known
    /// The control knows programs by numbers: `begin` has one.
    bool is_numbered() const;
    /// A program with this number would stand in the place of a macro.
    bool reserves(std::int64_t number) const;
  } program;

  Template tool_change;        // {tool} {length_offset}
  Template tool_preselect;     // {tool}; may be empty: the magazine gets no tool ready beforehand
  double tool_change_s = 0.0;  // that a change takes: for what follows the time (thermal effects)
  Template spindle_clockwise, spindle_counterclockwise, spindle_off;  // {rpm}
  bool speed_not_under_tcp = false;  // a new speed ends tool-centre-point control: the tool leaves the part
  std::array<Template, 5> coolant;   // by CoolantKind
  Template dwell;                    // {seconds} or {milliseconds}
  int dwell_decimals = 3;
  struct Clamp {
    std::uint16_t axes = 0;  // bits of AxisWords: rotary axes that these words clamp and free together
    Template on, off;
  };
  std::vector<Clamp> clamps;  // none: the control clamps by itself, or never
  struct Stops {
    Template program, optional;
    bool end_spindle = false;  // and the coolant, as ISO 6983-1 has M00 and M01; else both go on
  } stops;
  std::vector<Template> work_offsets;  // 1, 2, ...
  struct Shift {
    Template set;  // {index} {x} {y} {z}: the new value of a work offset
    Template add;  // {x} {y} {z}: beside the work offset, replacing what was added before
    /// Neither is allowed under tool-centre-point control: it is switched off before and on again by the next
    /// motion.
    bool not_under_tcp = true;
    /// The last offset whose number stands in {index}; those behind it are set by other words. 0: all are.
    std::int64_t last_set = 0;
  } offset_shift;
  /// Values that the control holds while the program runs, in words such as X[12.3-#511*.5].
  struct RunTime {
    std::string open, close;                // round an expression; `close` may be empty
    std::string variable;                   // before its number: "#", "R"
    std::array<std::int64_t, 3> source{};   // written by whoever measures: deviations, mm
    std::array<std::int64_t, 3> latched{};  // what the program uses
    Template begin;                         // once, before the first latch
    Template latch;                         // {clamp} {step} {dead_band}
  } run_time;
  /// How `source` is calculated from temperatures (RunTimeStep).
  struct RunTimeTemperatures {
    std::int64_t first = 0;                  // variable of the first sensor, the next ones after it
    std::int64_t first_reference = 0;        // the same of what they were at the last measurement
    std::int64_t count = 0;                  // sensors at most
    std::array<std::int64_t, 3> measured{};  // deviations as measured last, mm
    Template reset;
    Template read;           // {channel} {temperature}; may be empty: somebody else writes them
    Template reference;      // {reference} {temperature}
    Template start;          // {target} {measured}
    Template add, subtract;  // {target} {temperature} {reference} {factor}
  } run_time_temperatures;
  std::array<Template, 3> path_modes;             // by PathModeKind
  Template continuous_within;                     // {tolerance}
  Template continuous_off;                        // ends both at the end of the program
  std::optional<PathModeKind> default_path_mode;  // written by the setup when the program does not choose
  std::array<Template, kAxisLetters> retract;     // by axis, {position}
  bool retract_ends_length =
      false;  // a retract ends length compensation too: written again before the next motion
  /// Circular motions in the plane of X and Y, {x} {y} of the end, {i} {j} of the centre, {z} of a helix's
  /// end; F follows. No words: arcs go out as straight moves.
  struct Arcs {
    Template clockwise, counterclockwise;
    Template helix_clockwise, helix_counterclockwise;
    bool center_absolute = false;      // {i} {j} are coordinates, not distances from the start
    double radius_tolerance_mm = 0.0;  // by which the radii to start and end may differ
    bool native = false;               // `post` writes these words where it is not told otherwise
    const Template& words(bool is_clockwise, bool is_helix) const {
      if (is_helix) return is_clockwise ? helix_clockwise : helix_counterclockwise;
      return is_clockwise ? clockwise : counterclockwise;
    }
  } arcs;
  /// Words of CutterCompensation, by CutterSide; empty: it has none that adds what a register holds and
  /// nothing else.
  std::array<Template, 3> cutter_compensation;
  bool wear_register_is_tool = false;  // the number is that of a tool, whose whole diameter counts
  /// Drilling cycles. {x} {y} of the hole (without them: where the tool stands), {clear} {bottom} as
  /// coordinates of Z, {depth} from the first to the second (negative), {back} to which the tool returns,
  /// {rise} to it from {clear}, {step}, {seconds} or {milliseconds}, {feed} (without it: the F in force). No
  /// words for a kind: such holes go out as moves.
  struct Cycles {
    std::array<Template, 4> plain;  // by Hole::Kind
    std::array<Template, 4> dwell;  // with a dwell at the bottom
    /// Taps: {rpm}, and {feed} or {pitch} or {lead} (the pitch, below 0 for a left-hand thread). Without
    /// {clear} they begin and end where the tool stands. `tap_left`: empty where `tap` cuts both hands.
    Template tap, tap_left;
    int pitch_decimals = 6;              // of {pitch} and {lead}
    Template to_clear, to_initial;       // which Z the tool returns to, in front of the cycle's words
    bool initial_at_start = false;       // a program that says neither has `to_initial`
    Template off;                        // empty: a cycle is one hole; else it holds until this
    bool dwell_feeds_to_return = false;  // feed_out with a dwell feeds as far as the tool returns
    bool native = false;                 // as for arcs
    double back_mm = 0.0;  // above the last bottom: where a peck's feed begins, how far chip breaking backs
    const Template& words(const Hole& hole) const {
      if (hole.kind == Hole::Kind::tap)
        return hole.thread.hand == Thread::Hand::left && !tap_left.empty() ? tap_left : tap;
      return (hole.dwell_ms > 0 ? dwell : plain)[static_cast<std::size_t>(hole.kind)];
    }
    bool modal() const { return !off.empty(); }
  } cycles;
  /// Touches of a probe, and the control's file of them. No words: the control cannot be given such programs.
  struct Probing {
    /// A motion that ends where the probe is touched: {feed}, and {x} {y} {z} its end or {dx} {dy} {dz} the
    /// way to it, {distance} how long that is.
    Template touch;
    /// {x} {y} {z} {feed}: a straight motion that stops where the probe is touched, and the program with it.
    /// Empty: a control that watches the probe in any motion, or one that has no words for it.
    Template guarded;
    /// The same for the first of them, in free air at the safe height: the control learns there how the place
    /// that it keeps of a touch is counted. Empty: as `guarded`.
    Template first;
    Template declare;              // at the very beginning of a program
    Template open, record, close;  // with {name} where it is said there; any of them may be empty
    std::string suffix = ".txt";   // of the file of touches, where nobody names it
    bool confirmed = false;        // somebody has run these words on the control
  } probing;
  /// What the control's own numbers for the lines of two rotary axes are called: lines with placeholders of
  /// layer probe (control_numbers.hpp), by the letters of the axes from the bed outwards ("AC"), or "any".
  std::map<std::string, Template> axis_numbers;
  /// Words of programs that others wrote (ReaderOptions::others), beside all that stands above.
  struct Input {
    Template inch, millimetre;
    Template planes;                                   // X Y, Z X, Y Z: three of them, or none
    std::string clockwise, counterclockwise;           // circles, their other words in any number
    bool arc_radius = false;                           // R is the radius of a circle, below 0 the long way
    bool unit_keeps_speed = false;                     // F means the same speed behind another unit
    std::string centers_absolute, centers_from_start;  // what I, J, K are from there on
    /// Lines and words that are no places.
    struct Lines {
      Template skipped;                     // lines that begin so say nothing of the path
      Template silent;                      // words that say nothing of it
      std::string rapid_suffix;             // another spelling of [motion] rapid_suffix
      Template stands_for;                  // "M13 = M3 M8": a word for several
      Template dwell;                       // another spelling of [dwell] words
      bool dwell_without_point_ms = false;  // {seconds} without its point counts thousandths
      Template away;          // lines that take the tool along its axis to the end of the travel
      std::string tool_name;  // what stands before the name of a tool in quotes
    } lines;
    Template reference;            // the axes of the line go to a reference point
    std::string machine_position;  // the axes of the line go to a place of the machine
    /// Places that are spelled in another way, and what coordinates count from.
    struct Places {
      std::string per_revolution;                   // F is mm in a turn of the spindle
      std::string radius_name;                      // CR= where R is no radius
      std::string absolute_value, increment_value;  // AC, IC: X=AC(12) whatever is in force
      std::string increment_prefix;                 // I of IX+12
      std::string shift;                            // the program's zero in the axes of the line
      std::string set_position;                     // what the coordinates of this place are from here on
      Template end_shift;                           // of both
      std::string turn, end_turn;                   // about X and Y of the line, by R degrees
      Template frames;  // TRANS, ATRANS, ROT, AROT: shift anew and further, turn anew and further; or none
      std::string zero_follows, zero_stays;  // G254, G255: the zero goes with the part, X Y Z do not turn
      std::string datum_shift;  // CYCL DEF 7.: a line each, X, Y or Z of the shift behind its number
      std::string more_turns;   // TURN= of a helix; or a word that counts all of them (P)
    } places;
    /// Circles and lines about a pole: CC X Y, C X Y DR+, CR X Y R DR+, CP PA Z DR+, LP PR PA.
    struct Pole {
      std::string set, about, by_radius, circle, line;
      std::string clockwise, counterclockwise;  // DR-, DR+
    } pole;
    /// Lines that run in another order than they stand in, and what they calculate with.
    struct Flow {
      std::string variables;  // # of #101 and [#101+2], R, Q
      std::string define;     // DEF: variables have names, and words are X=R1
      std::string formula;    // FN of FN 0: Q1 = +5, and words are X+Q1
      /// Variables between these numbers are the control's own: what they hold, and what setting them does,
      /// the program does not say.
      std::array<std::int64_t, 2> control_variables{};
      bool o_words = false;                    // subprograms, loops and all functions as LinuxCNC has them
      std::string call, call_line, end_call;   // M98 P L, M97 P L, M99: subprograms of the same file
      std::int64_t largest_program = 9999;     // P beyond it says something else
      std::string label, call_label, repeats;  // LBL 1, CALL LBL 1 REP 3
      /// Drilling cycles with a safety distance of their own, and calls of them at one place after another.
      struct Holes {
        struct Cycle {
          std::string begins;  // CYCLE81( or CYCL DEF 200
          Hole::Kind kind = Hole::Kind::drill;
          /// What its values mean, by their place or as Q200=above (reading/hole_calls.hpp).
          std::vector<std::string> values;
          Template lines;  // what it stands for; empty: the words of [cycles]
          bool is_begun_by(std::string_view line) const;
        };
        std::vector<Cycle> cycles;
        std::string call, call_word;  // CYCL CALL, and M99 behind a motion: of the cycle that was said last
        std::string modal_call;       // MCALL: behind every motion, until it stands alone
      } holes;
    } flow;
  } input;

  Template silent;  // words that the reader takes and that move nothing and change nothing here

  Template allowed;  // words that the user lets pass by name: what they do is not known here
  std::map<std::string, std::string> refused;  // words that are known and not read, as G91, and why

  /// The words of a retract of this axis hold the machine position it goes to.
  bool names_position(AxisLetter letter) const;
  /// The length that it adds is that of a register in the program's words, not one that belongs to the tool.
  bool adds_length_of_register() const;
  /// By which the radii of a circle in somebody else's program may differ.
  double arc_radii_may_differ_mm() const {
    return arcs.radius_tolerance_mm > kRadii_mm ? arcs.radius_tolerance_mm : kRadii_mm;
  }
  static constexpr double kRadii_mm = 0.01;  // words of three decimals, or of four in inches, with room
  bool has_inverse_time() const { return !feed.inverse_time.empty(); }
  bool has_tcp() const { return !tcp.on.empty(); }
  bool has_run_time_values() const { return !run_time.latch.empty(); }
  bool has_run_time_temperatures() const { return !run_time_temperatures.add.empty(); }
  bool has_probing() const { return !probing.touch.empty(); }
  bool has_tilted_plane() const { return !tilted_plane.on.empty(); }
};

/// Reads a controller file with its bases (`base = "iso"` is iso.toml in the same folder, else in
/// `base_folder`: a shop's file may stand on one that ships with the program). Every finding goes to
/// `diagnostics` with file:line:column; unknown keys, unknown placeholders, templates that the reader could
/// not tell apart and missing motion words are errors.
Result<Controller> load_controller(const std::string& path, Diagnostics& diagnostics,
                                   const std::string& base_folder = {});

/// The file that `name_or_path` means: itself when it names a file that exists or ends in `.toml`, else
/// `<folder>/<name>.toml`. Fails with io_failed and the names that the folder does have.
Result<std::string> find_controller(const std::string& name_or_path, const std::string& folder);

}  // namespace trunnion::nc
