#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

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
  /// False, with `error`: two words of one letter, of which controls take the first, the last or none.
  bool has_each_once(const ParsedLine& line);
  /// False, with `error`: two words of one group that stay in force, as G90 and G91, of which controls take
  /// the last or none.
  bool has_one_of_each_group(const ParsedLine& line);
  /// Takes the words of the line that stay in force, whatever their order. True where they change the unit.
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
    /// Place over which the way to a reference point leads, as the line has it (resolve); none: at once.
    AxisWords by_way_of;
  };
  std::optional<MachineMotion> take_machine_motion(ParsedLine& line);
  /// Takes the name that makes the places of a line those of the machine out of it, where there is one.
  bool has_place_name() const {
    const std::string& name = c_.input.machine_position;
    return name.size() > 1 && is_letter(name[1]);
  }
  bool take_place_name(std::string& line, std::size_t from) const;

  /// A motion in this line is a rapid; `so_far`: that of the line before was.
  bool is_rapid(const ParsedLine& line, bool so_far) const;
  /// Arcs run and holes are drilled in another plane than X Y.
  bool in_other_plane() const { return said_.plane != 0; }
  bool zero_follows() const { return said_.zero_follows; }
  bool in_increments() const { return said_.increments; }
  /// Axes whose words are places, or ways, whatever is in force: bits.
  struct Means {
    std::uint16_t places = 0, ways = 0;
    std::uint16_t straight = 0;  // of axes that count modulo one turn: not the shorter way
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
  const ProgramFrame& frame() const { return frames_.now; }
  /// F is mm in a turn of the spindle.
  bool per_revolution() const { return said_.per_revolution; }
  void end_per_revolution() { said_.per_revolution = false; }
  /// A billionth of a mm in a turn of the spindle; 0: none was said.
  std::int64_t& feed_of_turn() { return said_.feed_of_turn; }
  /// As the text has it, with an F word.
  void set_feed_of_turn(const Number& feed) {
    std::int64_t quanta = 0;
    said_.feed_of_turn = to_rounded_quanta(feed, kTurnDecimals, quanta) ? length(quanta) : 0;
  }
  static constexpr int kTurnDecimals = 9;  // of a feed per revolution, mm
  /// A length that stands in the text, in quanta.
  std::int64_t length(std::int64_t quanta) const;
  bool in_inches() const { return said_.inches; }
  void set_inches(bool inches) { said_.inches = inches; }
  /// Of a tool that has a name, and whether it was not met before.
  std::pair<std::int64_t, bool> number_of(const std::string& tool);
  /// The unit was neither said nor told of before.
  bool wants_unit();
  /// Of the circle that `take_shape` or `take_pole_line` found: end in all axes, centre and plane; several of
  /// a helix of several turns.
  const std::vector<Arc>& arcs() const { return arcs_; }
  /// A rotary axis that counts modulo one turn goes the shorter way; nothing: the program has not said.
  std::optional<bool> shorter_way() const { return said_.shorter_way; }
  /// A motion of another kind ends a circle's words.
  void end_circle() { circle_.reset(); }

  /// Which of [input] pole words begins a line.
  enum class PoleWord : std::uint8_t { none, set, about, by_radius, circle, line };
  PoleWord pole_word(std::string_view text) const;
  /// Words of such a line that no other has.
  struct PoleLine {
    PoleWord word = PoleWord::none;
    std::optional<bool> clockwise;
    std::optional<std::int64_t> radius;         // quanta of a length
    std::optional<double> angle_rad, more_rad;  // from the plane's first axis; from where the tool is
    AxisWords end;                              // of the other words, resolved
  };
  /// Other coordinates than those in which it was set.
  void forget_pole() { pole_.reset(); }
  /// Takes them out of the text: blanks stand in their place. False, with `error`.
  bool take_pole_words(std::string& line, std::size_t from, PoleLine& out);
  /// The pole, the arcs of the line (`arcs`), or the end of a straight line (`out.end`).
  bool take_pole_line(PoleLine& out, const AxisWords& position);
  /// A line of [input] datum_shift: its number's digits and what stands behind them, or nothing.
  std::optional<std::string_view> datum_shift_in(std::string_view text) const;
  bool take_datum_shift(ParsedLine& line, const char* why_not);
  /// A tilted plane counts from the shift, which is back in force when the plane ends.
  std::array<std::int64_t, 3> set_frame_aside();
  void take_frame_back();
  bool frame_moved_aside() const { return frames_.aside && frames_.aside_moved; }

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
    per_revolution,
    shorter_way,
    straight_way,
    zero_follows,
    zero_stays
  };
  static std::optional<Code> code_of(const std::string& word);
  void note(const std::string& word, Mode mode);
  static int group_of(Mode mode);
  void set(Mode mode);
  bool fail(std::uint32_t column, const std::string& message);
  std::nullopt_t refuse(std::uint32_t column, const std::string& message) {
    fail(column, message);
    return std::nullopt;
  }
  bool is_code(const Word& word, const std::string& text) const;
  bool is_beyond(std::int64_t quanta) const;
  bool has_its_point(const Word& word, std::int64_t quanta);
  bool quanta_of(const Word& word, std::int64_t& out);
  std::optional<FoundEvent> take_circle(ParsedLine& line, const AxisWords& position);
  bool is_relative(const Word& word) const {
    return word.means == Word::Means::way || (said_.increments && word.means != Word::Means::place);
  }
  bool take_shift(ParsedLine& line, const AxisWords& position, bool sets_position);
  bool take_turn(ParsedLine& line);
  bool angle_of(const Word& word, double& rad);
  void set_turns(const AxisWords& from, std::int64_t turns);
  bool place_center(const AxisWords& position, std::int64_t radius, std::uint32_t column);
  std::optional<FoundEvent> take_cycle(ParsedLine& line, const PatternSet& patterns, bool in_cycle);

  const Controller& c_;
  const AxisFormat& format_;
  std::vector<std::pair<Code, Mode>> modes_;
  std::vector<std::pair<Code, int>> groups_;  // these words, and those of the other feeds
  struct Said {
    bool inches = false, unit_known = false;
    bool increments = false;
    bool centers_absolute = false;
    bool per_revolution = false;
    std::int64_t feed_of_turn = 0;
    std::optional<bool> shorter_way;
    bool zero_follows = false;       // the part as it turns
    std::uint8_t plane = 0;          // Arc::plane
    std::uint16_t stale_places = 0;  // axes of which no place was said since the frame moved
  } said_;
  struct Frames {
    ProgramFrame now, below_turn;       // below G68: what G69 comes back to
    std::optional<ProgramFrame> aside;  // while a tilted plane is on
    bool aside_moved = false;           // by a line in the plane
  } frames_;
  struct Pole {
    std::uint8_t plane = 0;
    std::array<std::int64_t, 2> at{};  // along its axes, in the coordinates of the work offset
  };
  std::optional<Pole> pole_;
  std::optional<bool> circle_;  // in force; clockwise
  Arc arc_;
  std::vector<Arc> arcs_;
  Captures cycle_;  // of the cycle in force
  std::vector<std::string> tools_;
};

}  // namespace trunnion::nc
