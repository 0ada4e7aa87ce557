#pragma once
#include <array>
#include <string>

#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/nc/blocks.hpp"
#include "trunnion/post/verify.hpp"

namespace trunnion::post {

/// Follows a program from where the tool leaves the part (or is at a place that nobody knows) to where it is
/// back, in machine positions, and finds what is not safe on the way: outside a cut rotary axes turn at the
/// safe height only, X and Y move there only, and the tool comes down along Z.
class SafeWalk {
 public:
  /// Findings go to `figures`. `quantum_mm`: of the words of Z. `room_mm`: how far from the safe height X and
  /// Y may move all the same (a shift of the work offset asks for room at the end of the travel).
  SafeWalk(const Machine& machine, double quantum_mm, double room_mm, std::size_t most_findings,
           WordFigures& figures);

  using Known = std::array<bool, kMaxAxes>;

  /// The tool is on such a way.
  bool goes_on() const { return walks_; }
  /// Where it is now is the safe height.
  bool is_up() const { return at_height(side_slack_mm_); }
  /// The axis is sent to this machine position; nothing: the words do not say to which.
  void retract(AxisId axis, const std::optional<double>& to, std::uint32_t nc_line);
  /// A tool is changed in a tilted plane.
  void find_plane(std::uint32_t nc_line) {
    find(
        nc_line,
        "the tool is changed in a tilted plane: what the control does for it would go along the tilted axes");
  }
  /// A tool change: the control may move any axis.
  void forget(std::uint32_t nc_line);
  /// A motion at whose end only some axes are known. `linear_follow`: tool-centre-point control is on.
  void partly(const JointVector& q, const Known& known, bool linear_follow, std::uint32_t nc_line);
  /// X and Y move by words of the part from which no more is known: in a tilted plane at one height of
  /// machine Z, under tool-centre-point control at any. `both`: where each goes is said; of one alone it is
  /// not known where the other one stands.
  void sideways(bool tcp, bool both, std::uint32_t nc_line);
  /// Axes at these positions, as far as they are `known`, stand within their travel.
  void check_travel(const JointVector& q, const Known& known, std::uint32_t nc_line);
  /// Z moves to where the words alone do not say.
  void loses_height() {
    if (z_) known_[*z_] = false;
  }
  /// The control turns its rotary axes by itself, into a tilted plane.
  void turns_to(const JointVector& q, std::uint32_t nc_line);
  /// A motion at whose end all axes are known: true when it belongs to the way, and not to the CL path.
  bool wholly(const JointVector& q, bool rapid, bool tcp, const TableKinematics& kinematics,
              std::uint32_t nc_line);
  /// The end of motions that were on the CL path.
  void stands(const JointVector& q);
  /// Words of the tool's length that may move Z by it at once.
  void changes_length(std::uint32_t nc_line);
  /// The spindle stops and turns the other way round away from the part only, and no faster than it can.
  void spindle(const nc::Spindle& spindle, std::uint32_t nc_line);
  /// What may only be done away from the part.
  void needs_height(const char* what, std::uint32_t nc_line);

 private:
  void find(std::uint32_t nc_line, const std::string& what);
  void note_motion(std::uint32_t nc_line) {
    if (moves_unnamed_ == 0) moves_unnamed_ = nc_line;
  }
  bool at_height(double slack_mm) const;
  /// The sign of Z that leads away from the part.
  double away() const { return machine_.safe.away < 0 ? -1.0 : 1.0; }
  std::string height_text() const;
  void check_turn(const JointVector& q, const Known& known, std::uint32_t nc_line);
  /// A rotary axis goes to another place, or comes from one that is not known.
  bool turns(const JointVector& q) const;
  void check_swing(const JointVector& q, bool tcp, const TableKinematics& kinematics, std::uint32_t nc_line);
  void check_table(const JointVector& q, bool tcp, const TableKinematics& kinematics, std::uint32_t nc_line);

  const Machine& machine_;
  double turn_slack_mm_, side_slack_mm_;
  std::size_t most_findings_;
  WordFigures& figures_;
  std::optional<AxisId> z_;
  // The first motion, other than a retract, of a tool that no word has named; 0: none.
  std::uint32_t moves_unnamed_ = 0;
  bool tool_is_named_ = false;  // by a tool change, or by the job: a cut was begun with it
  nc::SpindleTurn turn_ = nc::SpindleTurn::off;
  JointVector q_;
  Known known_{};
  Known free_{};  // not known, but moved where it may move freely
  bool walks_ = true;
  bool partly_since_ = true;  // the last motion was not known as a whole
};

}  // namespace trunnion::post
