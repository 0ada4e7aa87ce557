#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/nc/reader.hpp"

#include "nc/control/patterns.hpp"
#include "nc/modal_state.hpp"
#include "nc/reading/hole_calls.hpp"
#include "nc/reading/other_words.hpp"
#include "nc/reading/reader_line.hpp"
#include "nc/reading/run_layout.hpp"
#include "nc/reading/unfolder.hpp"
#include "nc/reading/whole_program.hpp"

namespace trunnion::nc {

/// Codes and letters of the lines that nearly every program consists of.
struct SimpleWords {
  // G0 to G999.9 in tenths.
  static constexpr std::size_t kCodes = 10000;
  enum class Code : std::uint8_t { no, silent, absolute, rapid, linear, per_minute, inverse_time };
  /// What a letter begins in the lines that take_plain_motion reads.
  struct Letter {
    enum class Kind : std::uint8_t { other, axis, feed, code };
    Kind kind = Kind::other;
    AxisLetter axis = AxisLetter::X;
    std::int8_t decimals = 0;  // of the axis' quanta
  };

  std::array<Code, kCodes> g{};
  std::array<Code, kCodes> m{};
  std::array<std::uint8_t, 32> kept{};  // letter -> placeholder + 1 that later lines use
  std::array<Letter, 256> letters{};    // of each character
};

/// The words that a control understands, and how its numbers are read.
struct ControlLanguage {
  ControlLanguage(const Controller& c, const ReaderOptions& options, Diagnostics& diagnostics);
  ControlLanguage(const ControlLanguage&) = delete;  // the scanner refers to the patterns
  ControlLanguage& operator=(const ControlLanguage&) = delete;
  ~ControlLanguage() = default;

  AxisFormat format;
  std::int64_t turn;  // quanta of a rotary axis
  PatternSet patterns;
  LineScanner scanner;
  SimpleWords simple;
  std::optional<OtherWords> others;  // of programs that somebody else wrote

 private:
  void note_simple(const Pattern& p, bool whole_program);
};

/// What is wrong with the text, at its places.
struct ReadFindings {
  std::string file;
  Diagnostics& diagnostics;
  std::size_t most;  // errors
  std::string given_up_because;
  std::uint32_t line = 0;  // that is read
  std::size_t errors = 0;
  bool given_up = false;
  std::optional<Error> first = std::nullopt;

  void error(std::uint32_t column, const std::string& message);
};

/// Lines that are read as runs of motions.
struct RunLines {
  std::unique_ptr<MotionRun> run;  // where somebody takes runs
  RunLine line;
  bool four_decimals = false;  // in every word of it
  // Layouts of lines, in the feed mode at hand: the one that was met last, and the one that was learned last.
  // None where an axis is wound on from line to line.
  std::array<RunLayout, 8> layouts;
  std::size_t last = 0, next = 0;
  bool has_layouts = false;
};

/// Where the text is in a program.
struct ProgramPlace {
  std::optional<Unfolder> unfolder;   // of programs that somebody else wrote
  std::optional<HoleCalls> holes;     // the same
  std::optional<WholeProgram> frame;  // where the text is a whole program
  bool said_anything = false;         // but for its first lines
  bool started = false;
  bool ended = false;
  bool begun_by_tape = false;   // '%' in front of all
  std::uint32_t tape_line = 0;  // with a '%' of a program that did not begin with one
  bool follows_part = false;    // TiltedPlane::follows_part
  bool shift_added = false;     // OffsetShift::Kind::add that is not zero, of others
  /// Line with the words of a tilted plane that has not been entered, of programs that somebody else wrote.
  std::uint32_t plane_since = 0;
  std::uint32_t increments_since = 0;  // line from which on coordinates are increments; 0: they are absolute
};

/// What of a cycle the words of its line do not say.
struct CycleReturn {
  std::int64_t initial = 0;      // Z at which it was switched on
  std::optional<bool> to_clear;  // nothing: the program has not said, and another one may have
  std::optional<int> named;      // EventKind::cycle_name

  /// Z to which a hole with this clearance returns.
  std::int64_t of(std::int64_t clear) const {
    return to_clear.value_or(false) ? clear : std::max(initial, clear);
  }
};

/// What the control knows after the text so far.
struct Reader::State {
  State(const Controller& controller, std::string file_name, Diagnostics& found, Sink out_sink,
        ReaderOptions opts, RunSink out_runs);

  const Controller& c;
  ReadFindings findings;
  Sink sink;
  RunSink runs;
  ReaderOptions options;
  ControlLanguage language;

  // Text.
  std::string carry;  // an unfinished line
  ParsedLine parsed;

  RunLines at_once;

  // What the control knows.
  ModalState modal{c};
  Block motion_block = Motion{};
  std::int64_t feed = 0;  // 0: none
  bool latched = false;
  CycleReturn cycle_return;
  Captures kept;
  ProgramPlace program;

  // Findings.
  void error(std::uint32_t column, const std::string& message) { findings.error(column, message); }
  std::string text_of(const Word& word) const;
  void unknown_word(const Word& word);
  void emit(const Block& block);

  // Motion.
  struct LineMotion {
    AxisWords words;
    std::optional<MotionKind> kind;
    std::optional<FeedMode> mode;
    OtherWords::Means means;
    bool has_feed = false;
    Number feed;
    std::uint32_t column = 0;
    bool rapid = false;        // by a word that holds for this line only
    bool named = false;        // a motion word stands in the line
    bool absolute = false;     // coordinates are, from this line on
    bool is_resolved = false;  // OtherWords::resolve has been at its words
  };
  bool take_axis(Word& word, std::uint8_t axis, LineMotion& m);
  bool is_word_of(const Word& word, AxisLetter letter, std::int64_t quanta) const;
  /// The words from `p` on, where they are those of a motion in the form that nearly every line has: capital
  /// letters, plain numbers. False, with nothing but `m` touched, for any other line, right or wrong.
  /// @param end  of the line; the character there can be read and is no part of a word
  bool take_plain_motion(const char* begin, const char* p, const char* end, LineMotion& m);
  void note_plain_words();
  /// Reads lines from the start of `text` as a run, as far as they are motions in the form of
  /// take_plain_motion that change no mode: how many characters they have.
  std::size_t read_run(std::string_view text);
  bool may_run() const;
  /// The line from `p` on as the next of `run`: where the one behind it begins; null, with nothing changed,
  /// for any other line. A line ends before `end`.
  const char* take_run_line(const char* p, const char* end);
  /// The same for a line that has the letters of `line_of_run`, every number with four decimals.
  const char* take_same_words(const char* p, const char* end);
  /// The same for lines that are laid out as others before them: as many as follow.
  const char* take_laid_out(const char* p, const char* end);
  const char* take_of_layout(const RunLayout& layout, const char* p, const char* end);
  void learn_layout(const char* p, const char* behind, const char* end);
  const char* skip_run_number(const char* p) const;
  std::int64_t feed_of_silent_line() const;
  bool put_run_line(std::uint32_t column);
  bool unwrap_run_line();
  bool take_simple(Word& word, LineMotion& m);
  void set_kind(MotionKind kind, LineMotion& m);
  void set_feed_mode(FeedMode mode);
  void take_modes(LineMotion& m);
  void check_point_of_feed(const Number& number, std::uint32_t column);
  /// The zero goes with the part from here on, or it does not. False, with a message.
  bool follow_part(bool on);
  /// False, with a message: which way it turns is not said.
  bool wind(AxisLetter letter, const LineMotion& m, std::int64_t& value);
  std::int64_t unwrapped(AxisLetter letter, std::int64_t value) const;
  void run_motion(LineMotion& m);

  // Lines.
  void read_line(std::string_view text);
  /// The words of a line from `p` on, `begin` its first column.
  void read_words(const char* begin, const char* p, const char* end);
  /// A line with a word that stands for others, with these in its place; a line that calls a tool by its
  /// name, with a number.
  bool spell_out(std::string_view text, std::string& out) const;
  bool number_tool(std::string_view text, std::string& numbered);
  bool is_raw(std::string_view text) const;
  void run_line();
  void run_line_of_others();
  void leave_feed_of_tcp(const std::vector<FoundEvent>& events);
  void note_unit();
  /// With a message: a motion where the words of a tilted plane wait for the word that enters it.
  bool waits_for_plane();
  /// What forbids a shift or a turn of the program's coordinates here, or null.
  const char* against_frame(bool turns) const;
  /// A line of TRANS, AROT and the like, `name` of them.
  void run_frame_line(std::string_view text, std::size_t name);
  /// A line of a datum shift, or one that counts from a pole; false: it is none.
  void run_past_offsets(const std::string& line, std::size_t from);
  bool run_datum_shift(std::string_view text);
  bool run_pole_line(const char* begin, const char* p, const char* end);
  /// Feed per revolution as feed per minute at the speed that the spindle turns with.
  void follow_spindle(std::int64_t rpm);
  void follow_spindle() {
    follow_spindle(modal.spindle && modal.spindle->turn != SpindleTurn::off ? modal.spindle->rpm : 0);
  }
  bool run_by_way_of(const OtherWords::MachineMotion& motion);
  void run_machine_motion(const OtherWords::MachineMotion& motion);
  bool is_no_block_of_others(std::string_view text);
  /// False, with a message, where a line goes on in increments.
  bool counts_absolute(const LineMotion& m);
  // What is left after patterns have taken their words: motion, or not understood.
  bool take_words(LineMotion& m);
  bool take_motion(LineMotion& m);
  // T before M6, S before M3: on lines of their own.
  bool keep(const Word& word);
  /// False, with a message, where something is missing for the line to move the machine as it says.
  bool may_move(std::uint32_t column);
  void note_head();
  void note_pattern(const FoundEvent& found);
  void run_tape(const FoundEvent& found);
  std::vector<FoundEvent> find_events(LineMotion& m);
  Word* find_word(const PatternWord& wanted);
  // All words of the pattern in the line, in any order; tool and spindle speed may have come before.
  bool match_words(const Pattern& pattern, FoundEvent& found);

  // Events.
  void run_events(const std::vector<FoundEvent>& events, LineMotion& m);
  static bool excludes_motion(EventKind kind);
  std::int64_t whole(const FoundEvent& found, Placeholder p, std::int64_t fallback);
  std::int64_t scaled(const FoundEvent& found, Placeholder p, int decimals);
  void keep_captures(const FoundEvent& found);
  void run_event(const FoundEvent& found);
  void run_program_start(const FoundEvent& found);
  void run_spindle(const FoundEvent& found);
  void run_coolant(CoolantKind kind);
  void run_clamp(int argument);
  /// With a message.
  bool turns_clamped(const LineMotion& m);
  void run_tool(const FoundEvent& found);
  void run_length(std::int64_t number);
  void run_tcp(bool on, std::int64_t offset);
  void run_work_offset(std::int64_t index);
  void run_offset_shift(const FoundEvent& found);
  void run_latch(const FoundEvent& found);
  void run_run_time_step(const FoundEvent& found);
  void run_path_mode(const FoundEvent& found);
  void run_cutter(const FoundEvent& found);
  void run_plane(const FoundEvent& found);
  void check_origin(const FoundEvent& found);
  void run_dwell(const FoundEvent& found);
  void run_retract(const FoundEvent& found);
  bool kinematics_unknown(std::uint32_t column);
  bool shape_may_begin(const FoundEvent& found);
  void run_arc(const FoundEvent& found);
  void run_arcs_of_others(const FoundEvent& found);
  void run_arc_of_others(const FoundEvent& found, Arc arc);
  void run_cycle(const FoundEvent& found);
  const Template& words_of_cycle(int argument) const;
  /// Pitch, speed and feed of a tap; false, with a message, where the program does not say them.
  bool gear(const FoundEvent& found, const Template& words, Hole& hole);
  /// Axis words without a word of their own under a cycle; false where they end it.
  bool run_next_hole(const LineMotion& m);
  void run_probe(const FoundEvent& found);
  void run_hole(std::int64_t x, std::int64_t y, std::uint32_t column);
};

}  // namespace trunnion::nc
