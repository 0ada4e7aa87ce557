#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <variant>

#include "trunnion/base/source_ref.hpp"
#include "trunnion/nc/axis_words.hpp"

/// Canonical blocks: what an NC program says, whatever words its control has for it. All values are whole
/// numbers of quanta, so that blocks -> text -> blocks is an identity. Modal: what is not said again stays.
namespace trunnion::nc {

enum class MotionKind : std::uint8_t { rapid, feed };

/// per_minute: mm/min (degrees/min where only rotary axes move, see Controller::FeedRules::path);
/// inverse_time: 1/min, the reciprocal of the duration of the block.
enum class FeedMode : std::uint8_t { per_minute, inverse_time };

/// All axes move linearly and together to `words` (absolute). A block that moves nothing is not written.
/// Written: axes that are absent stay where they are. Read: all axes whose position is known at the end of
/// the block.
struct Motion {
  MotionKind kind = MotionKind::rapid;
  FeedMode feed_mode = FeedMode::per_minute;  // of a feed move
  std::int64_t feed = 0;                      // of a feed move, > 0, in quanta of FeedFormat
  AxisWords words;
  SourceRef source;  // writing: line of the CL file, kept for messages; reading: place in the NC text
};

/// The two axes of the plane of an arc, the first towards the second against the clock, and the one across.
constexpr std::array<AxisLetter, 3> plane_axes(std::uint8_t plane) {
  constexpr std::array kXyz3 = {AxisLetter::X, AxisLetter::Y, AxisLetter::Z};
  constexpr std::array<std::array<std::uint8_t, 3>, 3> kOrder = {{{0, 1, 2}, {2, 0, 1}, {1, 2, 0}}};
  const auto& order = kOrder[plane];
  return {kXyz3[order[0]], kXyz3[order[1]], kXyz3[order[2]]};
}

/// A circular motion in the plane of X and Y, Z going on evenly with the angle (a helix). One turn at most:
/// an end at the start is a full circle.
struct Arc {
  bool clockwise = false;  // seen against Z
  /// Of programs that others wrote: 1 for Z and X, 2 for Y and Z in place of X and Y. Never written.
  std::uint8_t plane = 0;
  std::int64_t feed = 0;  // per minute, > 0, in quanta of FeedFormat
  /// Written: X and Y of the end, Z too for a helix. Read: every axis that is known at the end.
  AxisWords words;
  std::array<std::int64_t, 2> center{};  // along the plane's axes, absolute
  AxisWords from;                        // read: where it begins, X, Y and Z
  SourceRef source;
};

/// How a tap is geared to the spindle.
struct Thread {
  /// Which the words ask for; as_spindle: they leave it to the sense in which the spindle turns.
  enum class Hand : std::uint8_t { as_spindle, right, left };
  std::int64_t pitch = 0;  // that the tap goes down in one turn, 10^-kPitchDecimals mm, > 0
  std::int64_t rpm = 0;    // with which it goes down, > 0
  Hand hand = Hand::as_spindle;
  bool operator==(const Thread&) const = default;
};
inline constexpr int kPitchDecimals = 8;  // 25.4 mm over any number of threads to an inch
inline constexpr double kPitchUnit_mm = 1e-8;

/// One hole of a drilling cycle. The control goes at rapid rate to X and Y of the hole (not below `clear`),
/// down to `clear`, drills as its kind says, and leaves along Z.
struct Hole {
  enum class Kind : std::uint8_t {
    drill,       // out at rapid rate
    peck,        // out to `clear` behind every step
    chip_break,  // back a little behind every step
    feed_out,    // out to `clear` at the feed
    tap,         // feed and spindle as `thread` has them, both turned round at the bottom, out to `clear`
  };
  Kind kind = Kind::drill;
  std::int64_t feed = 0;    // per minute, > 0
  std::int64_t bottom = 0;  // Z
  std::int64_t clear = 0;   // Z at which the feed begins
  std::int64_t step = 0;    // of `peck` and `chip_break`, > 0, counted from `clear`
  std::int64_t dwell_ms = 0;
  Thread thread;  // of `tap`, whose feed is its pitch times its speed
  /// X and Y of the hole, Z that the control returns to: `clear`, or the one it came from. Read: every axis
  /// that is known at the end.
  AxisWords words;
  AxisWords from;  // read: where it begins, X, Y and Z
  SourceRef source;
};

/// First block; the setup lines of the controller (units, plane, ...) follow after the leading comments.
struct ProgramStart {
  std::string name;         // for controls that name programs; letters, digits, _ and -
  std::int64_t number = 1;  // for those that number them
};
/// Last block.
struct ProgramEnd {};
/// A remark. The writer replaces characters that the controller file does not list.
struct Comment {
  std::string text;
  /// Somebody else's text (of the CL file): each of its lines begins with the mark of the controller file, so
  /// that none can be taken for a line of the header. Reading: a comment with that mark, its text without it.
  bool foreign = false;
};
/// Line of text that goes out as it is (block number added). The reader takes it only when told to expect it.
struct Raw {
  std::string text;
};
struct Dwell {
  std::int64_t milliseconds = 0;
};
enum class SpindleTurn : std::uint8_t { off, clockwise, counterclockwise };
struct Spindle {
  SpindleTurn turn = SpindleTurn::off;
  std::int64_t rpm = 0;  // 0 when off
  bool operator==(const Spindle&) const = default;
};
enum class CoolantKind : std::uint8_t { off, flood, mist, through_tool, air };
/// Of each kind, as a controller file names it.
inline constexpr std::array kCoolantNames = {"off", "flood", "mist", "through_tool", "air"};
/// `off` ends all kinds; any other kind is added to those that run.
struct Coolant {
  CoolantKind kind = CoolantKind::off;
};
/// Tool change. It ends tool-centre-point control (the writer says so where the control needs it) and length
/// compensation, which is a block of its own, except on controls where it belongs to the tool
/// (Controller::Length).
struct ToolCall {
  std::int64_t tool = 0;
  std::int64_t length_offset = 0;  // read: the tool's number where the words do not say
};
/// The magazine gets this tool ready while the present one cuts; nothing moves at the spindle. Written only:
/// a change says its tool itself.
struct ToolSelect {
  std::int64_t tool = 0;
};
/// Clamps or frees rotary axes. The writer frees an axis by itself before it turns; the reader refuses a
/// program that turns a clamped one.
struct Clamp {
  std::uint16_t axes = 0;  // bits of AxisWords: one entry of Controller::clamps
  bool on = false;
};
/// Tool length compensation along the tool (G43 H in ISO words); number 0 ends it. 1 for controls whose words
/// hold no number.
struct LengthCompensation {
  std::int64_t number = 0;
};
/// The control shifts the path by the radius in register `number` (G41 D, G42 D), from the next motion in X
/// and Y on. The post has it add wear to paths of the tool's centre: what the program says is the path with
/// nothing in the register.
enum class CutterSide : std::uint8_t { off, left, right };
struct CutterCompensation {
  CutterSide side = CutterSide::off;
  std::int64_t number = 0;  // 0 when off
};
/// Tool-centre-point control: X Y Z are the tip in the part, which the control keeps while the rotary axes
/// move.
struct TcpControl {
  bool on = false;
  std::int64_t length_offset = 0;  // of `on`, for controls that want it there
};
/// Work offset 1 (G54), 2, ...
struct WorkOffset {
  std::int64_t index = 1;
};
/// Shift of the program's coordinates that is known beforehand (G10 L2, TRANS). `set`: the whole new value of
/// work offset `index`; `add`: what counts beside the work offset, whichever is active, until the next one.
struct OffsetShift {
  enum class Kind : std::uint8_t { set, add };
  Kind kind = Kind::add;
  std::int64_t index = 0;                // of `set`: 1 (G54), 2, ...; 0 for `add`
  std::array<std::int64_t, 3> offset{};  // X Y Z, quanta of the linear format
};
/// A motion whose X, Y and Z depend on values that the control holds at run time: word i is the motion's own
/// plus the sum of coefficient[i][k] times the k-th latched value (LatchValues), in units of
/// 10^-kCoefficientDecimals. X, Y and Z must be among the motion's words.
inline constexpr int kCoefficientDecimals = 4;  // half a unit of 0.2 mm is 10 nm
struct VariableMotion {
  Motion motion;
  std::array<std::array<std::int64_t, 3>, 3> coefficient{};
};
/// The control takes the three run-time values anew, under limits (quanta of the linear format): at most
/// `clamp` each, changed by at most `step`, and not at all by `dead_band` or less.
struct LatchValues {
  bool first = false;  // of the program: what was latched before counts as zero
  std::int64_t clamp = 0;
  std::int64_t step = 0;
  std::int64_t dead_band = 0;
};
/// One line of the calculation that makes the three values before they are latched, from temperatures that
/// the control holds: value k is what was measured last plus the sum of factor times rise of each sensor
/// since.
struct RunTimeStep {
  enum class Kind : std::uint8_t {
    reset,      // nothing was measured yet: the three measured values are zero
    read,       // the control takes the temperature of `sensor`
    reference,  // rises of `sensor` count from what it is now
    start,      // value `axis` begins as what was measured
    add         // ... and gets `factor` times the rise of `sensor`
  };
  Kind kind = Kind::reset;
  std::size_t axis = 0;     // 0, 1, 2
  std::size_t sensor = 0;   // from 0 on
  std::int64_t factor = 0;  // 10^-kFactorDecimals mm/K
};
inline constexpr int kFactorDecimals = 7;  // half a unit times 100 K is 5 nm
enum class PathModeKind : std::uint8_t { exact_path, exact_stop, continuous };
struct PathMode {
  PathModeKind kind = PathModeKind::exact_path;
  std::int64_t tolerance = 0;  // of `continuous`, quanta of the linear format; 0: what the control has set
};
/// Moves axes to a safe place in machine coordinates; their program positions are unknown afterwards.
/// Tool-centre-point control and length compensation are what they were for the next motion: the writer
/// switches them off and on where needed.
struct Retract {
  std::uint16_t axes = AxisWords::bit(AxisLetter::Z);
  /// Machine position (spindle gauge point, without tool length) of each axis whose words hold a number
  /// (Controller::names_position). Written: of each of those. Read: no others; where those go whose words
  /// hold none, as a reference point, is the machine's to say.
  AxisWords to = {};
};
/// Tilted working plane (3+2): origin in quanta of the linear format, angles in quanta of the rotary format
/// in the convention of the controller (Controller::TiltedPlane). Axis words that follow are in the plane's
/// coordinates.
struct TiltedPlane {
  bool on = false;
  std::array<std::int64_t, 3> origin{};
  std::array<std::int64_t, 3> angles{};
  /// Which of the two positions of the rotary axes it means: -1 where the outer one is negative, else 1.
  int direction = 1;
  /// Of programs that others wrote: no angles; the zero goes with the part as the rotary axes turn, X Y Z
  /// stay along the axes of the machine (G254). Never written.
  bool follows_part = false;
};
struct Stop {
  bool optional = false;
  bool axes_again = false;  // of the writer: every axis is said again behind it, wherever an operator left it
};

/// X, Y and Z move in a straight line towards `words` until the probe is touched; nothing else moves. Where
/// they stand behind it is not known.
struct Probe {
  std::int64_t feed = 0;  // per minute, > 0
  /// A motion of which nobody expects a touch: where there is one, the program stops.
  bool guards = false;
  /// The first of them, in free air, where it has words of its own (Controller::Probing::first).
  bool first = false;
  AxisWords words;  // written: X, Y and Z. Read: every axis that is known, at the end that is not reached
  AxisWords from;   // read: where it begins, as far as it is known
  SourceRef source;
};
/// The control's own file of touches: what must be declared for it, opened, the last touch put into it (on
/// controls that do so by themselves without words), closed.
struct ProbeLog {
  enum class Kind : std::uint8_t { declare, open, record, close };
  Kind kind = Kind::open;
  std::string name;  // letters, digits, - and .; read: where the words have it
};

/// A word that the controller file lets pass by its name (Controller::allowed).
struct AllowedWord {
  std::string text;
};

using Block = std::variant<Motion, ProgramStart, ProgramEnd, Comment, Raw, Dwell, Spindle, Coolant, ToolCall,
                           LengthCompensation, TcpControl, WorkOffset, PathMode, Retract, TiltedPlane, Stop,
                           OffsetShift, VariableMotion, LatchValues, RunTimeStep, Arc, Hole,
                           CutterCompensation, ToolSelect, Clamp, AllowedWord, Probe, ProbeLog>;

/// One line that says what the block is, for test output and dumps: `feed X 1 Y -2 A 30000 | G93 1250`.
/// Quanta as they are.
std::string to_text(const Block& block);

/// Equal in all that an NC text can say (Motion::source does not count).
bool same(const Block& a, const Block& b);

}  // namespace trunnion::nc
