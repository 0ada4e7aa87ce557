#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "nc/reading/event_reader.hpp"
#include "nc/reading/line_motion.hpp"

namespace trunnion::nc {

/// Lines of NC text one by one: their words, and the motion that they ask for.
class LineReader {
 public:
  LineReader(ReadState& state, ShapeReader& shapes, EventReader& events)
      : s_(state), shapes_(shapes), events_(events) {}

  /// The next line, without its end.
  void read(std::string_view text);
  /// A line with a word that stands for others, with these in its place. False: it has none.
  bool spell_out(std::string_view text, std::string& out) const;

 private:
  // Words.
  /// The words of a line from `p` on, `begin` its first column.
  void read_words(const char* begin, const char* p, const char* end);
  /// The words from `p` on, where they are those of a motion in the form that nearly every line has: capital
  /// letters, plain numbers. False, with nothing but `m` touched, for any other line, right or wrong.
  /// @param end  of the line; the character there can be read and is no part of a word
  bool take_plain_motion(const char* begin, const char* p, const char* end, LineMotion& m);
  bool take_axis(Word& word, std::uint8_t axis, LineMotion& m);
  bool take_simple(Word& word, LineMotion& m);
  bool take_motion(LineMotion& m);
  /// What is left after patterns have taken their words: motion, or not understood.
  bool take_words(LineMotion& m);
  /// With a message: two words for the tool, or for the speed; more M words than the control takes.
  bool says_twice();
  /// It and another word of the line cannot both hold (G0 and G1).
  bool contradicts(const Word& word, const LineMotion& m) const;
  /// T before M6, S before M3: on lines of their own.
  bool keep(const Word& word, const LineMotion& m);
  bool is_word_of(const Word& word, AxisLetter letter, std::int64_t quanta) const;
  std::string text_of(const Word& word) const;
  void unknown_word(const Word& word);
  bool is_raw(std::string_view text) const;

  // Patterns.
  void note_head();
  std::vector<FoundEvent> find_events(LineMotion& m);
  Word* find_word(const PatternWord& wanted);
  /// All words of the pattern in the line, in any order; tool and spindle speed may have come before.
  bool match_words(const Pattern& pattern, FoundEvent& found);
  /// With a message: two words of one group, of which the control takes one.
  bool contradict(const std::vector<FoundEvent>& events);
  void run_events(const std::vector<FoundEvent>& events, LineMotion& m);
  static bool excludes_motion(EventKind kind);
  /// Of programs of others: what ends with the motion of its block, and the spindle beside a tool change.
  bool acts_last(const FoundEvent& found, const LineMotion& m) const;
  /// Of our own: a spindle that may stand while its block cuts; with a message.
  bool may_start_late(const FoundEvent& found, const LineMotion& m, bool shapes);

  // Motion.
  void run_line();
  void set_kind(MotionKind kind, LineMotion& m);
  void take_modes(LineMotion& m);
  /// False, with a message: which way it turns is not said.
  bool wind(AxisLetter letter, const LineMotion& m, std::int64_t& value);
  /// With a message.
  bool turns_clamped(const LineMotion& m);
  /// False, with a message, where a line goes on in increments.
  bool counts_absolute(const LineMotion& m);
  void run_motion(LineMotion& m);

  // Lines of others.
  void run_line_of_others();
  bool is_no_block_of_others(std::string_view text);
  /// A line that calls a tool by its name, with a number.
  bool number_tool(std::string_view text, std::string& numbered);
  void leave_feed_of_tcp(const std::vector<FoundEvent>& events);
  void note_unit();
  /// The zero goes with the part from here on, or it does not. False, with a message.
  bool follow_part(bool on);
  /// What forbids a shift or a turn of the program's coordinates here, or null.
  const char* against_frame(bool turns) const;
  /// A line of TRANS, AROT and the like, `name` of them.
  void run_frame_line(std::string_view text, std::size_t name);
  void run_past_offsets(const std::string& line, std::size_t from);
  /// A line of a datum shift, or one that counts from a pole; false: it is none.
  bool run_datum_shift(std::string_view text);
  bool run_pole_line(const char* begin, const char* p, const char* end);
  bool run_by_way_of(const OtherWords::MachineMotion& motion);
  void run_machine_motion(const OtherWords::MachineMotion& motion);

  ReadState& s_;
  ShapeReader& shapes_;
  EventReader& events_;
  ParsedLine parsed_;
  Block motion_block_ = Motion{};
};

}  // namespace trunnion::nc
