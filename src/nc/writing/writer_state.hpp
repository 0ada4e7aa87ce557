#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "trunnion/nc/writer.hpp"

#include "nc/control/number_forms.hpp"
#include "nc/control/templates.hpp"
#include "nc/digits.hpp"
#include "nc/modal_state.hpp"
#include "nc/writing/words_due.hpp"

namespace trunnion::nc {

/// What the control knows after the text so far, and how blocks become text. The reader follows the same
/// state.
struct Writer::State {
  State(const Controller& controller, std::string& text);

  const Controller& c;
  std::string& out;
  NumberForms forms{c};

  // What the control knows.
  ModalState modal{c};
  std::array<std::int64_t, 2> feed = {kUnknown, kUnknown};
  std::uint16_t freed = 0;  // rotary axes of which it is known, bits of AxisWords

  // What this program has said.
  std::string program_name;
  std::int64_t program_number = 0;
  bool started = false;
  WordsDue due;
  bool ended = false;

  std::int64_t block_number;
  std::size_t lines = 0;
  std::size_t motions = 0;

  tl::unexpected<Error> refuse(const std::string& message, SourceRef where = {}) const;

  // Lines.
  char* put_separator(char* p) const;
  char* put_block_number(char* p);
  bool wants_number(const std::string& line) const;
  Result<void> put_line(const std::string& line);
  Result<void> put_template(const Template& lines_of_template, const Values& values);
  // `what` in words, and the key of the controller file, for the message where there are none.
  tl::unexpected<Error> no_words(const char* what, const std::string& key) const;
  Result<void> put_words(const Template& words, const Values& values, const char* what,
                         const std::string& key);
  // Words that the control wants in the block of the motion they belong to.
  Result<void> put_with_motion(const Template& words, const Values& values, const char* what,
                               const std::string& key);
  std::string number_text(std::int64_t quanta, const NumberStyle& style) const;

  // Motion.
  std::uint16_t changed_axes(const AxisWords& words) const;

  // A control that counts modulo one turn takes the shorter way: half a turn or more cannot be told by the
  // angle.
  Result<void> check_turns(const Motion& m, std::uint16_t changed) const;
  Result<void> refuse_feed(const Motion& m) const;
  char* put_axis(char* p, std::size_t i, std::int64_t quanta) const {
    const AxisLetter letter = kAllAxisLetters[i];
    *p++ = letter_of(letter);
    if (c.rotary.modulo_axes == 0 || !c.rotary.is_modulo(letter))
      return put_number(p, quanta, forms.of_axis(letter));
    quanta %= forms.turn;
    if (quanta < 0) quanta += forms.turn;
    p = std::copy(c.rotary.modulo_open.begin(), c.rotary.modulo_open.end(), p);
    p = put_number(p, quanta, forms.rotary);
    return std::copy(c.rotary.modulo_close.begin(), c.rotary.modulo_close.end(), p);
  }
  char* put_axes(char* p, const AxisWords& words, unsigned axes);
  char* put_plain_axes(char* p, const AxisWords& words, unsigned axes);

  // Motion word, words that wait for a motion, feed mode: in this order in front of the axis words.
  char* put_leading(char* p, const Motion& m, bool with_pending);
  char* put_feed(char* p, const Motion& m);
  Result<void> write_motion(const Motion& m);

  // Runs of them.
  struct Run;
  bool run_goes(const std::array<AxisLetter, RunBlock::kAxes>& letters, FeedMode mode) const;
  Run begin_run(const std::array<AxisLetter, RunBlock::kAxes>& letters, FeedMode mode) const;
  std::size_t put_together(Run& run, std::span<const RunBlock> blocks);

  // Everything else.
  Result<void> flush_setup(bool with_default_path_mode);
  Result<void> restore_after_retract(std::uint16_t changed);
  Result<void> switch_tcp_off();
  // Off now, on again with the next motion that it matters to.
  Result<void> suspend_tcp(bool must_be_off);
  Result<void> step(AxisLetter axis, std::int64_t distance, std::int64_t feed_quanta);
  Result<void> write(const ProgramStart& b);
  Values program_values() const;
  Result<void> write(const ProgramEnd&);
  Result<void> write(const Comment& b);
  Result<void> write(const Raw& b);
  Result<void> write(const CutterCompensation& b);
  Result<void> write(const AllowedWord& b);
  // Before what needs the tool where the program says.
  Result<void> end_cutter_compensation(const char* before);
  Result<void> write(const Dwell& b);
  Result<void> write(const Spindle& b);
  Result<void> write(const Coolant& b);
  Result<void> write(const ToolSelect& b);
  Result<void> write(const Clamp& b);
  /// Before these axes turn.
  Result<void> free_axes(std::uint16_t axes);
  Result<void> write(const ToolCall& b);
  Result<void> write(const LengthCompensation& b);
  Result<void> write(const TcpControl& b);
  Result<void> write(const WorkOffset& b);
  Result<void> write(const PathMode& b);
  Result<void> write(const Retract& b);
  Result<void> write(const TiltedPlane& b);
  Result<void> write(const Stop& b);
  Result<void> write(const OffsetShift& b);
  Result<void> write(const VariableMotion& b);
  Result<void> write(const LatchValues& b);
  Result<void> write(const RunTimeStep& b);
  Result<void> write(const Arc& b);
  Result<void> write(const Hole& b);
  Result<void> write(const Probe& b);
  Result<void> write(const ProbeLog& b);
  std::string per_minute_words(std::int64_t quanta, bool with_number);
  Result<void> check_shape(std::int64_t feed_quanta, SourceRef where) const;
  bool continues_cycle(const Hole& b) const;
  Result<void> put_cycle(const Template& words, const Hole& b, const Template* in_front);
  Result<void> put_next_hole(const Hole& b);
  Result<void> end_cycle();
  std::string variable_word(AxisLetter letter, std::int64_t quanta,
                            const std::array<std::int64_t, 3>& coefficient) const;
  Result<void> write_block(const Block& block);
};

}  // namespace trunnion::nc
