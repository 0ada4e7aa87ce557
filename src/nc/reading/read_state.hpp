#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/nc/reader.hpp"

#include "nc/control/number_forms.hpp"
#include "nc/modal_state.hpp"
#include "nc/reading/control_language.hpp"
#include "nc/reading/whole_program.hpp"

namespace trunnion::nc {

/// What is wrong with the text, at its places.
struct ReadFindings {
  std::string file;
  Diagnostics& diagnostics;
  std::string given_up_because;
  std::uint32_t line = 0;  // that is read
  std::size_t errors = 0;
  bool given_up = false;
  std::optional<Error> first = std::nullopt;

  void error(std::uint32_t column, const std::string& message);
};

/// Where the text is in a program.
struct ProgramPlace {
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

/// What the control knows after the text so far, and what every part of the reader asks of it.
struct ReadState {
  ReadState(const Controller& controller, std::string file, Diagnostics& diagnostics, Reader::Sink out,
            ReaderOptions opts);

  const Controller& c;
  ReadFindings findings;
  Reader::Sink sink;
  ReaderOptions options;
  ControlLanguage language;
  ModalState modal{c};
  NumberForms forms{c};
  std::int64_t feed = 0;  // 0: none
  CycleReturn cycle_return;
  Captures kept;  // values that later lines use
  ProgramPlace program;

  void error(std::uint32_t column, const std::string& message) { findings.error(column, message); }
  void error(const FoundEvent& found, const std::string& message) {
    error(std::max(found.column, 1U), message);
  }
  void emit(const Block& block);

  // Values of the placeholders of a template, in this line or kept from one before.
  const Number* value(const FoundEvent& found, Placeholder p) const;  // null: none
  std::int64_t whole(const FoundEvent& found, Placeholder p, std::int64_t fallback);
  std::int64_t scaled(const FoundEvent& found, Placeholder p, int decimals);
  /// With a message: a number without its point, where the control would count it in increments.
  void check_point(const FoundEvent& found, Placeholder p, const Number& number);

  void set_feed_mode(FeedMode mode);
  /// The control would take this F for another one: it has no decimal point.
  bool wants_point_of_feed(const Number& number) const;
  void check_point_of_feed(const Number& number, std::uint32_t column);
  /// With a message: F is larger than the control takes.
  void check_size_of_feed(std::int64_t quanta, std::uint32_t column);
  void check_size_of_feeds(const MotionRun& run);
  /// Feed per revolution as feed per minute at the speed that the spindle turns with.
  void follow_spindle(std::int64_t rpm);
  void follow_spindle() {
    follow_spindle(modal.spindle && modal.spindle->turn != SpindleTurn::off ? modal.spindle->rpm : 0);
  }
  /// A speed alone: that of a spindle that turns changes. Whether it does behind a tap is not known.
  void change_speed(const Number& rpm);
  /// Where a modulo axis stands behind a word, in turns that go on from where it stood.
  std::int64_t unwrapped(AxisLetter letter, std::int64_t value) const;

  void note_pattern(const FoundEvent& found);
  /// False, with a message, where something is missing for the line to move the machine as it says.
  bool may_move(std::uint32_t column);
  /// A cut of a program of others, and S0 was the last word of the spindle that turns: told as an error.
  bool spindle_turns_at_nothing(std::uint32_t column);
  /// With a message: a motion where the words of a tilted plane wait for the word that enters it.
  bool waits_for_plane();
  /// With a message, once: the program has not said which kinematics are active.
  bool kinematics_unknown(std::uint32_t column);
};

}  // namespace trunnion::nc
