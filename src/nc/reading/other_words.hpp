#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "nc/control/patterns.hpp"
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
  bool in_other_plane() const { return plane_ != 0; }
  /// The words of a motion as absolute positions in mm. False, with `error`: an increment from nowhere.
  bool resolve(AxisWords& words, const AxisWords& position, std::uint32_t column);
  /// A length that stands in the text, in quanta.
  std::int64_t length(std::int64_t quanta) const;
  bool in_inches() const { return inches_; }
  void set_inches(bool inches) { inches_ = inches; }
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
    centers_from_start
  };
  static std::optional<Code> code_of(const std::string& word);
  void note(const std::string& word, Mode mode);
  void set(Mode mode);
  bool fail(std::uint32_t column, const std::string& message);
  bool is_code(const Word& word, const std::string& text) const;
  bool is_beyond(std::int64_t quanta) const;
  bool quanta_of(const Word& word, std::int64_t& out);
  std::optional<FoundEvent> take_circle(ParsedLine& line, const AxisWords& position);
  bool place_center(const AxisWords& position, std::int64_t radius, std::uint32_t column);
  std::optional<FoundEvent> take_cycle(ParsedLine& line, const PatternSet& patterns, bool in_cycle);

  const Controller& c_;
  const AxisFormat& format_;
  std::vector<std::pair<Code, Mode>> modes_;
  bool inches_ = false, unit_known_ = false;
  bool increments_ = false;
  bool centers_absolute_ = false;
  std::uint8_t plane_ = 0;      // Arc::plane
  std::optional<bool> circle_;  // in force; clockwise
  Arc arc_;
  Captures cycle_;  // of the cycle in force
  std::vector<std::string> tools_;
};

}  // namespace trunnion::nc
