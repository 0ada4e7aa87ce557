#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/machine/machine.hpp"
#include "trunnion/nc/controller.hpp"
#include "trunnion/probe/poses.hpp"

namespace trunnion::probe {

/// A straight rod that holds a ball: from its centre to the far end.
struct Stem {
  Vec3 end_P = Vec3::Zero();  // mm
  double radius_mm = 0.0;
};
/// The probe over its stylus: a cylinder about the spindle's axis, from that far over the centre of the
/// stylus ball up to the spindle's gauge point.
struct ProbeBody {
  double radius_mm = 0.0;
  double above_mm = 0.0;
};

/// One ball on the table and a stylus in the spindle, as a program is made for them.
struct Ball {
  Vec3 place_P = Vec3::Zero();  // its centre, roughly, mm
  double radius_mm = 0.0;
  double stylus_radius_mm = 0.0;
  double stylus_length_mm = 0.0;  // from the spindle's gauge point to the centre of the stylus ball
  /// At every pose the centre is within this of where the machine file has it.
  double within_mm = 0.0;
  double clearance_mm =
      2.0;  // that the stylus keeps from the ball where it is not to touch, beside `within_mm`
  /// What holds the ball. Nothing: a thin stem against the table's normal, which only decides between which
  /// sides it stands.
  std::optional<Stem> stem;
  std::optional<ProbeBody> body;

  /// Between the centres where they touch.
  double reach_mm() const { return radius_mm + stylus_radius_mm; }
  /// Between the centres, as the machine file has them, everywhere but on the way of a touch.
  double apart_mm() const { return reach_mm() + within_mm + clearance_mm; }
};

struct ProgramOptions {
  Ball ball;
  std::size_t poses = 12;
  /// Touches from the side at each pose, evenly round the ball, 4 to 12. Four do not tell three lobes of the
  /// probe from a ball that lies elsewhere; eight do.
  std::size_t sides = 4;
  std::vector<JointVector> planned;  // rotary positions to touch the ball at, in place of `poses` of a grid
  /// Every pose twice: reached from below and from above by each rotary axis, as far as its travel allows.
  bool both_senses = false;
  Angle largest_tilt = Angle::degrees(60.0);
  std::int64_t tool = 99;           // the stylus
  std::string log = "touches.txt";  // file of the control
  double slow_mm_s = 1.0, fast_mm_s = 200.0 / kSecondsPerMinute, first_mm_s = 300.0 / kSecondsPerMinute;
  double move_mm_s = 2000.0 / kSecondsPerMinute;
  std::vector<std::string> head;  // further lines for the operator
};

/// Largest `Ball::within_mm` for which a stroke along its line meets the ball wherever that is, and not as a
/// glancing touch.
double most_within_mm(double reach_mm);
/// How far below the safe height the places of the axes are said anew. A control that watches the probe only
/// where it is told is told from there on.
inline constexpr double kBelowSafe_mm = 1.0;

struct MadeProgram {
  std::string text;
  ChosenPoses chosen;
  std::size_t touches = 0;  // lines that the control's log will have
  double seconds = 0.0;     // about, at the feeds that are given
  /// Where the rotary axes may not stand anywhere before the program begins: why, in words.
  std::string before_start;
};

/// The probing program. At each pose the ball is touched from above and from some sides a little above its
/// equator, each time fast and slow from the same place, and the stylus goes back the way it came. At the
/// first pose it comes down from the safe height as a touch. The rotary axes turn at the safe height only.
/// Fails with check_failed where fewer than four poses can be reached, and with wrong_input where the control
/// has no words for touches or the machine no safe height.
Result<MadeProgram> make_program(const Machine& machine, const nc::Controller& controller,
                                 const ProgramOptions& options);

}  // namespace trunnion::probe
