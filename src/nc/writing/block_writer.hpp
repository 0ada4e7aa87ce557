#pragma once
#include "nc/writing/shape_writer.hpp"
#include "nc/writing/write_state.hpp"

namespace trunnion::nc {

/// Blocks one by one, and what has to stand in front of them.
class BlockWriter {
 public:
  BlockWriter(WriteState& state, ShapeWriter& shapes) : s_(state), shapes_(shapes) {}

  Result<void> write(const Motion& m);
  Result<void> write_block(const Block& block);
  /// As Writer::step.
  Result<void> step(AxisLetter axis, std::int64_t distance, std::int64_t feed_quanta);

 private:
  Result<void> write(const ProgramStart& b);
  Result<void> write(const ProgramEnd&);
  Result<void> write(const Comment& b);
  Result<void> write(const Raw& b);
  Result<void> write(const CutterCompensation& b);
  Result<void> write(const AllowedWord& b);
  Result<void> write(const Dwell& b);
  Result<void> write(const Spindle& b);
  Result<void> write(const Coolant& b);
  Result<void> write(const ToolSelect& b);
  Result<void> write(const Clamp& b);
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

  Values program_values() const;
  Result<void> flush_setup(bool with_default_path_mode);
  /// Behind a tool change, what the control has forgotten by then if it was reset.
  Result<void> restate_modes();
  Result<void> restore_after_retract(std::uint16_t changed);
  Result<void> switch_tcp_off();
  /// Off now, on again with the next motion that it matters to.
  Result<void> suspend_tcp(bool must_be_off);
  /// Before what needs the tool where the program says.
  Result<void> end_cutter_compensation(const char* before);
  /// Before these axes turn.
  Result<void> free_axes(std::uint16_t axes);
  /// Words that the control wants in the block of the motion they belong to.
  Result<void> put_with_motion(const Template& words, const Values& values, const char* what,
                               const std::string& key);
  /// A control that counts modulo one turn takes the shorter way: half a turn or more cannot be told by the
  /// angle.
  Result<void> check_turns(const Motion& m, std::uint16_t changed) const;
  std::string variable_word(AxisLetter letter, std::int64_t quanta,
                            const std::array<std::int64_t, 3>& coefficient) const;

  WriteState& s_;
  ShapeWriter& shapes_;
  std::string program_name_;
  std::int64_t program_number_ = 0;
  std::uint16_t freed_ = 0;           // rotary axes of which it is known, bits of AxisWords
  std::optional<OffsetShift> shift_;  // beside the work offset, not zero
};

}  // namespace trunnion::nc
