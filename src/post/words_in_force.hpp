#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/nc/controller.hpp"
#include "trunnion/post/plane_frame.hpp"

#include "post/judging/deviation_meter.hpp"
#include "post/tools/spindle_tool.hpp"
#include "post/work_shift.hpp"

// Private to the verifier: from the words of a program that is read back to where the axes stand.
namespace trunnion::post {

/// How the words of an axis are read.
struct WordOfAxis {
  std::size_t letter = 0;
  double scale = 1.0;                             // quanta in a mm or a degree
  double factor = 1.0;                            // mm, or rad in a degree
  std::uint16_t rotary = 0;                       // bit of the word, of a rotary axis
  double linear_share = 0.0, rotary_share = 0.0;  // 1 where it is one

  /// As nc::AxisFormat::internal.
  double internal(const nc::AxisWords& words) const {
    return static_cast<double>(words.quanta[letter]) / scale * factor;
  }
};

/// The words that name the axes of a machine.
struct AxisWordsOf {
  AxisWordsOf(const Machine& machine, const nc::AxisFormat& format);

  /// Positions by axis, mm or rad, as the words say them.
  JointVector internal(const nc::AxisWords& words) const {
    JointVector out;
    for (AxisId id = 0; id < count; ++id) out[id] = of[id].internal(words);
    return out;
  }
  /// `words`, but for X, Y and Z.
  JointVector with_xyz(const JointVector& words, const std::array<double, 3>& xyz) const;
  bool is_linear(AxisId id) const { return of[id].linear_share != 0.0; }

  std::size_t count;  // of axes
  std::array<nc::AxisLetter, kMaxAxes> letters{};
  std::array<WordOfAxis, kMaxAxes> of{};
  std::uint16_t all = 0;     // bits of nc::AxisWords
  std::uint16_t linear = 0;  // of those
};

/// What the words so far have switched on: tool length, tool-centre-point control, a tilted plane, shifts of
/// the work offset. With it the axes stand where the words say.
struct WordsInForce {
  WordsInForce(const Machine& machine, const nc::Controller& controller, const AxisWordsOf& axis_words,
               const SpindleTool& tool);

  void set_length(double length_mm) {
    tool.length_mm = length_mm;
    kinematics = TableKinematics(machine_, tool.vector());
  }
  /// From here on the control adds the length of the tool, or it does not.
  void add_length(bool control_adds_length);
  /// The control turns its rotary axes until the tool stands along Z of the plane: the solution nearest to
  /// where they stand. False where no plane is on.
  bool enter(const nc::TiltedPlane& block);
  void switch_cutter(nc::CutterSide side) {
    leaves_contour = compensates && side == nc::CutterSide::off;
    compensates = side == nc::CutterSide::off ? std::nullopt : std::optional(rotary);
  }
  /// The words say where X, Y and Z of the part are, not the axes.
  bool in_part() const { return plane.has_value() || tcp; }
  /// Positions of the axes are the words, but for an offset that never changes.
  bool are_joints() const { return !tcp && !plane && !follows_part && shift.is_idle(); }
  /// Without these a motion does not say where all axes stand.
  std::uint16_t wanted() const { return plane ? axis_words_.linear : axis_words_.all; }
  /// In a tilted plane the control keeps the rotary axes: words for them leave it.
  bool leaves_plane(const nc::AxisWords& words) const {
    return plane && (words.mask & axis_words_.all & ~axis_words_.linear) != 0;
  }
  void take_rotary(const nc::AxisWords& mask_of, const JointVector& words) {
    for (AxisId id = 0; id < axis_words_.count; ++id) {
      if ((mask_of.mask & axis_words_.of[id].rotary) != 0) rotary[id] = words[id];
    }
  }

  const AxisWordsOf& axis_words() const { return axis_words_; }
  /// Where the axes stand for these words.
  BlockEnd end_at(const JointVector& words) const;
  /// The same of words that are positions of the machine.
  JointVector joints_of(const JointVector& words) const {
    JointVector q;
    for (AxisId id = 0; id < kMaxAxes; ++id) q[id] = words[id] - offset[id];
    return q;
  }

  SpindleTool tool;            // as the last words had it
  TableKinematics kinematics;  // with it
  JointVector offset;          // word minus joint position
  bool tcp = false;
  bool had_tcp = false;  // somewhere in the program
  std::optional<PlaneFrame> plane;
  bool follows_part = false;               // the zero goes with the part, X Y Z do not turn
  JointVector plane_q;                     // where the control has the rotary axes in the plane
  JointVector rotary;                      // as the last words had them
  std::optional<JointVector> compensates;  // rotary words from which cutter compensation is on
  bool leaves_contour = false;             // it was switched off, and no motion has come since
  WorkShift shift;

 private:
  Vec3 tip_of(const JointVector& words) const;
  JointVector joints_of_plane_words(const JointVector& words) const {
    JointVector q = plane_q;
    kinematics.solve_linear(plane->X_PF * tip_of(words), kinematics.sines(q), q);
    return q;
  }
  JointVector joints_of_following_words(const JointVector& words) const;
  JointVector joints_of_part_words(const JointVector& words) const {
    JointVector q = words;
    kinematics.solve_linear(tip_of(words), kinematics.sines(q), q);
    return q;
  }

  const Machine& machine_;
  const nc::Controller& controller_;
  const AxisWordsOf& axis_words_;
};

}  // namespace trunnion::post
