#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "nc/control/patterns.hpp"
#include "nc/reading/program_frame.hpp"
#include "nc/reading/reader_line.hpp"

namespace trunnion::nc {

/// Words of programs that somebody else wrote ([input] of the controller file): inches, increments, planes,
/// circles by their radius or without the words that stay what they were, reference points. They are resolved
/// before the rest of a line is looked at: what comes out is absolute and in mm.
class OtherWords {
 public:
  /// Both must outlive the object.
  OtherWords(const Controller& controller, const AxisFormat& format);

  /// The word is one of these: no other meaning of it counts.
  bool claims(char letter, const Number& number) const;
  /// Takes the words of the line that stay in force, whatever their order. False, with `error`, where one of
  /// them cannot be followed.
  bool take_modes(ParsedLine& line);
  /// A circle or a drilling cycle that begins in this line: its words are used. Nothing where there is none,
  /// or with `error`.
  std::optional<FoundEvent> take_shape(ParsedLine& line, const PatternSet& patterns,
                                       const AxisWords& position, bool in_cycle);
  /// Axes that the line sends to a place of the machine, past all offsets: `to` where that is known.
  struct MachineMotion {
    AxisWords axes;
    bool to_position = false;
    std::uint32_t column = 0;
  };
  std::optional<MachineMotion> take_machine_motion(ParsedLine& line);

  /// A motion in this line is a rapid; `so_far`: that of the line before was.
  bool is_rapid(const ParsedLine& line, bool so_far) const;
  /// Arcs run and holes are drilled in another plane than X Y.
  bool in_other_plane() const { return said_.plane != 0; }
  /// Axes whose words are places, or ways, whatever is in force: bits.
  struct Means {
    std::uint16_t places = 0, ways = 0;
  };
  /// The words of a motion as absolute positions in mm. False, with `error`: an increment from nowhere.
  bool resolve(AxisWords& words, Means means, const AxisWords& position, std::uint32_t column);
  /// A shift or a turn of the program's coordinates in this line: its words are used. `why_not`: what is in
  /// force and forbids it, or null. False, with `error`, where it cannot be followed.
  bool take_frame(ParsedLine& line, const AxisWords& position, const char* why_not);
  /// The same where a name begins the line: which of [input] frames, or nothing.
  std::optional<std::size_t> frame_named(std::string_view text) const;
  bool take_named_frame(ParsedLine& line, std::size_t name, std::optional<Number> turn_in_plane,
                        const char* why_not);
  const ProgramFrame& frame() const { return frame_; }
  /// F is mm in a turn of the spindle.
  bool per_revolution() const { return said_.per_revolution; }
  void end_per_revolution() { said_.per_revolution = false; }
  /// A billionth of a mm in a turn of the spindle; 0: none was said.
  std::int64_t& feed_of_turn() { return said_.feed_of_turn; }
  /// A length that stands in the text, in quanta.
  std::int64_t length(std::int64_t quanta) const;
  bool in_inches() const { return said_.inches; }
  void set_inches(bool inches) { said_.inches = inches; }
  /// Of a tool that has a name, and whether it was not met before.
  std::pair<std::int64_t, bool> number_of(const std::string& tool);
  /// The unit was neither said nor told of before.
  bool wants_unit();
  /// Of the circle that `take_shape` found: end in all axes, centre and plane.
  const Arc& arc() const { return arc_; }
  /// A motion of another kind ends a circle's words.
  void end_circle() { circle_.reset(); }

  std::string error;  // of what was taken last
  std::uint32_t error_column = 0;

 private:
  struct Code {
    char letter = ' ';
    Number number;
    bool is(const Word& word) const { return word.letter == letter && equal(word.number, number); }
  };
  enum class Mode : std::uint8_t {
    inches,
    millimetres,
    increments,
    absolute,
    plane_xy,
    plane_zx,
    plane_yz,
    centers_absolute,
    centers_from_start,
    per_revolution
  };
  static std::optional<Code> code_of(const std::string& word);
  void note(const std::string& word, Mode mode);
  void set(Mode mode);
  bool fail(std::uint32_t column, const std::string& message);
  bool is_code(const Word& word, const std::string& text) const;
  bool is_beyond(std::int64_t quanta) const;
  bool quanta_of(const Word& word, std::int64_t& out);
  std::optional<FoundEvent> take_circle(ParsedLine& line, const AxisWords& position);
  bool is_relative(const Word& word) const {
    return word.means == Word::Means::way || (said_.increments && word.means != Word::Means::place);
  }
  bool take_shift(ParsedLine& line, const AxisWords& position, bool sets_position);
  bool take_turn(ParsedLine& line);
  bool angle_of(const Word& word, double& rad);
  bool place_center(const AxisWords& position, std::int64_t radius, std::uint32_t column);
  std::optional<FoundEvent> take_cycle(ParsedLine& line, const PatternSet& patterns, bool in_cycle);

  const Controller& c_;
  const AxisFormat& format_;
  std::vector<std::pair<Code, Mode>> modes_;
  struct Said {
    bool inches = false, unit_known = false;
    bool increments = false;
    bool centers_absolute = false;
    bool per_revolution = false;
    std::int64_t feed_of_turn = 0;
    std::uint8_t plane = 0;          // Arc::plane
    std::uint16_t stale_places = 0;  // axes of which no place was said since the frame moved
  } said_;
  ProgramFrame frame_, below_turn_;  // below G68: what G69 comes back to
  std::optional<bool> circle_;       // in force; clockwise
  Arc arc_;
  Captures cycle_;  // of the cycle in force
  std::vector<std::string> tools_;
};

}  // namespace trunnion::nc
