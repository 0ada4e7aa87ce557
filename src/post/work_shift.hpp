#pragma once
#include <map>

#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/nc/blocks.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::post {

/// Words for X, Y and Z that the control adds to those of the program, mm.
using ShiftWords = Vec3;

/// Value of the work offset that the words of a program count from, by letter: the machine file's, or under
/// tool-centre-point control (`tcp`) the program zero in M, as long as M is the control's machine system.
ShiftWords work_offset_words(const Machine& machine, bool tcp);

/// The zero of P as words without tool-centre-point control count it, the rotary axes at 0: from the work
/// offset.
inline ShiftWords part_zero_in_words(const Machine& machine) {
  return work_offset_words(machine, true) - work_offset_words(machine, false);
}

/// Shifts of the work offset as a control understands them, for one program: made from deviations when it is
/// written, followed when it is read.
///
/// The frame trap: without tool-centre-point control the control adds the shift to its axes, in M. With it
/// the shift is added in P, before the control's kinematics: it turns with the table, so that what takes out
/// a drift in M at one pose does not at another.
class WorkShift {
 public:
  /// For any tool: a shift moves the axes by the same whatever the tool's length.
  WorkShift(const Machine& machine, const nc::Controller& controller)
      : machine_(machine), controller_(controller), kinematics_(machine, machine.tool_vector()) {}

  /// How the control can be told of a shift; `local`: only beside the work offset. Setting the whole offset
  /// takes the machine file's word for what it is, which a probed one ([datum]) is not.
  Result<nc::OffsetShift::Kind> kind(bool local) const;
  /// Fails with wrong_use where the words for a new value do not reach the offset that is called.
  Result<void> may_set() const;
  /// The block that takes out `deviation_P` at joint positions `q`; from then on `words` are its own.
  nc::OffsetShift take_out(const Vec3& deviation_P, const JointVector& q, bool tcp,
                           nc::OffsetShift::Kind kind);
  /// Change of the words of X, Y and Z that takes out `deviation_P` at `q`.
  ShiftWords words_against(const Vec3& deviation_P, const JointVector& q, bool tcp) const;
  /// The joint positions that words with this change mean, where those without it mean `q`.
  JointVector moved(const JointVector& q, const ShiftWords& change, bool tcp) const;
  /// The block that leaves the work offset as it was.
  nc::OffsetShift none(bool tcp, nc::OffsetShift::Kind kind) const;

  /// What a program that ends now leaves to the next one: a shift that is still added, an offset that is not
  /// the machine file's again, or one that was never called. Empty: all is as it was. `tcp`: as for `block`s
  /// that set.
  std::string left_behind(bool tcp) const;
  /// Nothing has been added or set.
  bool is_idle() const { return set_.empty() && added_.isZero(0.0); }
  void read(const nc::OffsetShift& shift);
  void read(const nc::WorkOffset& offset);
  /// What is added now.
  ShiftWords words(bool tcp) const;
  /// Motion of the tip in P that the shift makes at `q`.
  Vec3 effect_P(const JointVector& q, bool tcp) const;
  /// The same as a change of the joint positions.
  JointVector joints(const JointVector& q, bool tcp) const;

 private:
  ShiftWords internal(const nc::OffsetShift& shift) const;
  nc::OffsetShift block(const ShiftWords& words, bool tcp, nc::OffsetShift::Kind kind) const;

  const Machine& machine_;
  const nc::Controller& controller_;
  TableKinematics kinematics_;
  std::int64_t active_ = 1;
  std::map<std::int64_t, ShiftWords> set_;  // values that the program gave
  ShiftWords added_ = ShiftWords::Zero();
};

}  // namespace trunnion::post
