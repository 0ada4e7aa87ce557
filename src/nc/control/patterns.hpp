#pragma once
#include <string>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/nc/controller.hpp"

#include "nc/control/templates.hpp"
#include "nc/reading/lexer.hpp"

// The templates of a controller file turned round: what the reader looks for in a line.
namespace trunnion::nc {

/// Argument of run_time_step: `add` with a negative factor.
inline constexpr int kSubtract = static_cast<int>(RunTimeStep::Kind::add) + 1;

/// Argument of cycle: the tap of a left-hand thread.
inline constexpr int kTapLeft = static_cast<int>(Hole::Kind::tap) + 1;

/// Arguments of probe: a touch, a motion that stops where there is one, the first of those.
inline constexpr int kTouches = 0;
inline constexpr int kGuards = 1;
inline constexpr int kGuardsFirst = 2;

/// What a pattern means. The order is the order in which the events of one line take place.
enum class EventKind : std::uint8_t {
  silent,        // no effect
  tape,          // a line of symbols at the ends of a program, as `%`
  allowed,       // a word that the controller file lets pass by its name
  remember,      // holds a value that a later line uses (T before M6)
  cycle_name,    // argument: as of cycle, of the call that follows where several cycles share their call
  rapid_suffix,  // makes the motion of its line a rapid
  motion,        // argument: MotionKind
  feed_mode,     // argument: FeedMode
  program_start,
  spindle,  // argument: SpindleTurn
  clamp,    // argument: twice its place in Controller::clamps, and 1 where it clamps
  coolant,  // argument: CoolantKind
  tool,
  length_on,
  length_off,
  tcp_on,
  tcp_off,
  length_or_tcp_off,  // one word ends both
  work_offset,        // argument: index
  offset_shift,       // argument: OffsetShift::Kind
  latch_begin,        // argument: its line
  latch,
  run_time_step,  // argument: RunTimeStep::Kind, or kSubtract
  path_mode,      // argument: PathModeKind
  plane_on,
  plane_off,
  cutter,        // argument: CutterSide
  cycle_return,  // argument: 1 to the clearance, 0 to where the tool came from
  cycle_off,
  arc,    // argument: 1 clockwise
  cycle,  // argument: Hole::Kind, or kTapLeft
  probe,
  probe_log,  // argument: ProbeLog::Kind
  dwell,
  retract,  // argument: AxisLetter
  stop,     // argument: 1 optional
  program_end,
};

struct Event {
  EventKind kind = EventKind::silent;
  int argument = 0;
  bool operator==(const Event&) const = default;
};

/// Smallest piece of a line. A letter before a number or a numeric placeholder is an address word.
struct PatternToken {
  enum class Type : std::uint8_t { letters, number, symbol, placeholder };
  Type type = Type::symbol;
  std::string text;  // letters, symbol
  Number number;
  Placeholder placeholder = Placeholder::tool;
};

/// Address word of a pattern whose words may stand in any order.
struct PatternWord {
  char letter = ' ';
  bool is_fixed = true;
  Number number;
  Placeholder placeholder = Placeholder::tool;
};

/// What coordinates behind a pattern are.
enum class Counts : std::uint8_t { as_before, increments, absolute };

struct Pattern {
  Event event;
  std::string origin;                // key of the controller file, for messages
  std::vector<PatternToken> tokens;  // in the order of the template
  std::vector<PatternWord>
      words;  // when it consists of address words only; else the tokens must stand as they are
  Counts counts = Counts::as_before;
  /// Key of its words, the same however they are written.
  std::string key;
  /// It is a line of templates of several lines, and none that means something alone.
  bool is_part = false;
  /// It is a line of such templates, whatever else it means.
  bool is_other = false;
  /// Of the line that means a template's event: the keys of its other lines, before it and behind it, one set
  /// for each template that has this line.
  struct Others {
    std::vector<std::string> before, after;
  };
  std::vector<Others> others;
};

/// Origin of words that stand in the setup and nowhere else.
inline constexpr const char* kSetup = "[program] setup";

/// One text for equal words, whatever blanks and zeros they are written with.
std::string pattern_key(std::string_view line);
/// The address words of a line, or the line where it is none of these.
std::vector<std::string> setup_words(std::string_view line);

/// Longest first within each kind.
struct PatternSet {
  std::vector<Pattern> words;
  std::vector<Pattern> phrases;
};

/// All patterns of a controller. Two templates with the same words are an error (file only: they may stand in
/// two files), but for one word that ends both length compensation and tool-centre-point control.
PatternSet compile_patterns(const Controller& controller, Diagnostics& diagnostics);

}  // namespace trunnion::nc
