#include "post/judging/safe_walk.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {
namespace {

// A turn, or a way sideways, that is more than rounding and the correction of errors.
constexpr double kTurn_rad = 0.002 * kRadPerDegree;
constexpr double kSideways_mm = 1.0;

std::string in_mm(double value) {
  return fixed_text(value, 3) + " mm";
}

}  // namespace

SafeWalk::SafeWalk(const Machine& machine, double quantum_mm, double room_mm, std::size_t most_findings,
                   WordFigures& figures)
    : machine_(machine),
      turn_slack_mm_(quantum_mm),
      side_slack_mm_(kSideways_mm + room_mm),
      most_findings_(most_findings),
      figures_(figures),
      z_(machine.axis("Z")) {}

void SafeWalk::find(std::uint32_t nc_line, const std::string& what) {
  ++figures_.unsafe_count;
  if (figures_.unsafe.size() < most_findings_) figures_.unsafe.push_back({nc_line, what});
}

bool SafeWalk::at_height(double slack_mm) const {
  return z_ && known_[*z_] && machine_.safe.is_safe(q_[*z_], slack_mm);
}

std::string SafeWalk::height_text() const {
  if (!machine_.safe.z_mm()) return "the machine file does not say where the safe height is ([retract] z_mm)";
  return (z_ && known_[*z_] ? "machine Z is " + in_mm(q_[*z_]) : std::string("machine Z is not known")) +
         ", the safe height " + in_mm(*machine_.safe.z_mm());
}

void SafeWalk::retract(AxisId axis, const std::optional<double>& to, std::uint32_t nc_line) {
  const Axis& a = machine_.axes[axis];
  walks_ = true;
  partly_since_ = true;
  const bool is_z = z_ && axis == *z_;
  if (!is_z && !at_height(side_slack_mm_))
    find(nc_line, "axis " + a.name + " goes to a machine position below the safe height: " + height_text());
  std::optional<double> there = to;
  if (!there && is_z && machine_.safe.z_is_given) there = machine_.safe.z_mm();
  const bool was_known = known_[axis];
  known_[axis] = there.has_value();
  if (!there) {
    if (is_z) find(nc_line, "where the retract goes is not known: the machine file needs [retract] z_mm");
    return;
  }
  const double down_mm = is_z && was_known ? away() * (q_[axis] - *there) : 0.0;
  if (down_mm > side_slack_mm_)
    find(nc_line, "the retract takes the tool " + in_mm(down_mm) + " down, from machine Z " +
                      in_mm(q_[axis]) + " to " + in_mm(*there));
  q_[axis] = *there;
  if (!a.within_limits(*there)) {
    find(nc_line, "the retract to machine " + a.name + " " + in_mm(*there) + " is beyond the travel of " +
                      in_mm(a.min) + " to " + in_mm(a.max));
  } else if (is_z && !at_height(turn_slack_mm_)) {
    find(nc_line, "the retract does not reach the safe height: " + height_text());
  }
}

void SafeWalk::forget(std::uint32_t nc_line) {
  if (machine_.safe.z_mm() && !at_height(side_slack_mm_))
    find(nc_line, "the tool is changed below the safe height: " + height_text());
  else
    needs_height("the tool is changed", nc_line);
  // Its length is not in any register, and no table of the program has it.
  if (!tool_is_named_ && moves_unnamed_ != 0)
    find(moves_unnamed_, "axes move before the first tool change: which tool is in the spindle is not known");
  tool_is_named_ = true;
  turn_ = nc::SpindleTurn::off;
  walks_ = true;
  partly_since_ = true;
  known_ = {};
  free_ = {};
}

void SafeWalk::check_turn(const JointVector& q, const Known& known, std::uint32_t nc_line) {
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const Axis& axis = machine_.axes[id];
    if (axis.kind != AxisKind::rotary || !known[id]) continue;
    if (known_[id] && std::abs(q[id] - q_[id]) <= kTurn_rad) continue;
    if (!at_height(turn_slack_mm_))
      return find(nc_line, "axis " + axis.name + " turns below the safe height: " + height_text());
  }
}

bool SafeWalk::turns(const JointVector& q) const {
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (machine_.axes[id].kind == AxisKind::rotary && !(known_[id] && std::abs(q[id] - q_[id]) <= kTurn_rad))
      return true;
  }
  return false;
}

// On the way to a cut. Under tool-centre-point control the tip goes straight on the table that turns, and
// takes the linear axes with it.
void SafeWalk::check_swing(const JointVector& q, bool tcp, const TableKinematics& kinematics,
                           std::uint32_t nc_line) {
  constexpr int kPlaces = 32;
  if (!z_ || !machine_.safe.z_mm()) return;
  if (!machine_.safe.is_safe(q[*z_], side_slack_mm_))
    return find(nc_line,
                "a rotary axis turns while the tool comes down to a cut, to machine Z " + in_mm(q[*z_]));
  if (!tcp) return;
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (!known_[id])
      return find(nc_line,
                  "a rotary axis turns under tool-centre-point control from a place that is not known");
  }
  const Vec3 from_P = kinematics.pose(q_).tip_P;
  const Vec3 to_P = kinematics.pose(q).tip_P;
  double lowest_mm = q[*z_];
  for (int i = 1; i < kPlaces; ++i) {
    const double t = static_cast<double>(i) / kPlaces;
    const JointVector even = JointVector::interpolate(q_, q, t);
    const TableKinematics::Sines sines = kinematics.sines(even);
    const Vec3 off_P = from_P + t * (to_P - from_P) - kinematics.tip_P(even, sines);
    const double z_mm = even[*z_] + away() * kinematics.to_machine(off_P, sines)[2];
    if (away() * (lowest_mm - z_mm) > 0.0) lowest_mm = z_mm;
  }
  if (!machine_.safe.is_safe(lowest_mm, side_slack_mm_))
    find(nc_line,
         "a rotary axis turns under tool-centre-point control at the safe height, and takes machine "
         "Z down to " +
             in_mm(lowest_mm) + " on the way");
}

void SafeWalk::check_travel(const JointVector& q, const Known& known, std::uint32_t nc_line) {
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const Axis& axis = machine_.axes[id];
    const bool linear = axis.kind == AxisKind::linear;
    const double slack = linear ? turn_slack_mm_ : kTurn_rad;
    if (!known[id] || !axis.has_limits() || (q[id] >= axis.min - slack && q[id] <= axis.max + slack))
      continue;
    return find(nc_line, "axis " + axis.name + " would stand beyond its travel, at " +
                             (linear ? in_mm(q[id]) : fixed_text(q[id] * kDegreePerRad, 3) + " deg"));
  }
}

void SafeWalk::partly(const JointVector& q, const Known& known, bool linear_follow, std::uint32_t nc_line) {
  note_motion(nc_line);
  walks_ = true;
  partly_since_ = true;
  check_turn(q, known, nc_line);
  bool turned = false;
  bool moved = false;
  bool comes_down = false;
  check_travel(q, known, nc_line);
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    const bool changes = known[id] && (!known_[id] || q[id] != q_[id]);
    if (machine_.axes[id].kind == AxisKind::rotary) {
      turned = turned || changes;
    } else if (!z_ || id != *z_) {
      moved = moved || changes;
    } else {
      comes_down = changes;
    }
  }
  if (turned && linear_follow)
    find(nc_line, "a rotary axis turns under tool-centre-point control from a place that is not known");
  if (moved && !at_height(side_slack_mm_))
    find(nc_line, "X or Y moves below the safe height on the way to a cut: " + height_text());
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (!known[id]) continue;
    q_[id] = q[id];
    known_[id] = true;
    free_[id] = false;
  }
  if (comes_down && !at_height(side_slack_mm_))
    find(nc_line, "the tool comes down where not all axes are known to stand: " + height_text());
}

void SafeWalk::sideways(bool tcp, bool both, std::uint32_t nc_line) {
  note_motion(nc_line);
  partly_since_ = true;
  if (tcp) find(nc_line, "X, Y or Z moves under tool-centre-point control from a place that is not known");
  if (!at_height(side_slack_mm_))
    find(nc_line, "X or Y moves below the safe height on the way to a cut: " + height_text());
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (machine_.axes[id].kind == AxisKind::rotary || (z_ && id == *z_)) continue;
    known_[id] = false;
    free_[id] = both;
  }
}

void SafeWalk::turns_to(const JointVector& q, std::uint32_t nc_line) {
  note_motion(nc_line);
  Known rotary{};
  for (AxisId id = 0; id < machine_.axes.size(); ++id)
    rotary[id] = machine_.axes[id].kind == AxisKind::rotary;
  check_turn(q, rotary, nc_line);
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (!rotary[id]) continue;
    q_[id] = q[id];
    known_[id] = true;
  }
}

bool SafeWalk::wholly(const JointVector& q, bool rapid, bool tcp, const TableKinematics& kinematics,
                      std::uint32_t nc_line) {
  note_motion(nc_line);
  if (rapid && machine_.safe.table) check_table(q, tcp, kinematics, nc_line);
  if (!walks_ || (!rapid && !partly_since_)) {
    stands(q);
    return false;
  }
  Known all{};
  all.fill(true);
  check_turn(q, all, nc_line);
  if (partly_since_ && turns(q)) check_swing(q, tcp, kinematics, nc_line);
  double sideways_mm = 0.0;
  for (AxisId id = 0; id < machine_.axes.size(); ++id) {
    if (machine_.axes[id].kind == AxisKind::rotary || (z_ && id == *z_) || free_[id]) continue;
    const double way_mm = known_[id] ? q[id] - q_[id] : std::numeric_limits<double>::infinity();
    sideways_mm = std::hypot(sideways_mm, way_mm);
  }
  const bool left_height = at_height(side_slack_mm_);
  const bool z_known = z_ && known_[*z_];
  if (const double up_mm = z_known && left_height ? away() * (q[*z_] - q_[*z_]) : 0.0; up_mm > side_slack_mm_)
    find(nc_line, "from the safe height the tool goes " + in_mm(up_mm) + " up to the path, to machine Z " +
                      in_mm(q[*z_]) + ": there it was inside of what it works at, or below");
  const double down_mm = z_known ? std::abs(q[*z_] - q_[*z_]) : side_slack_mm_ + 1.0;
  q_ = q;
  known_ = all;
  free_ = {};
  partly_since_ = false;
  if (sideways_mm > kSideways_mm && !(left_height && at_height(side_slack_mm_)))
    find(nc_line, "X or Y moves below the safe height on the way to a cut: " + height_text());
  walks_ = rapid && (down_mm <= side_slack_mm_ || at_height(side_slack_mm_));
  return true;
}

void SafeWalk::stands(const JointVector& q) {
  q_ = q;
  known_.fill(true);
  free_ = {};
  walks_ = false;
  tool_is_named_ = true;
}

void SafeWalk::changes_length(std::uint32_t nc_line) {
  if (z_ && known_[*z_] && !is_up())
    find(nc_line,
         "tool length compensation is switched on or off below the safe height, where the control may move Z "
         "by the tool length at once ([length] moves_at_once): " +
             height_text());
}

void SafeWalk::spindle(const nc::Spindle& spindle, std::uint32_t nc_line) {
  const bool stops = spindle.rpm == 0;
  if (stops) needs_height("the spindle stops", nc_line);
  if (!stops && turn_ != nc::SpindleTurn::off && spindle.turn != nc::SpindleTurn::off &&
      spindle.turn != turn_)
    needs_height("the spindle turns the other way round", nc_line);
  turn_ = stops ? nc::SpindleTurn::off : spindle.turn;
  if (const double fastest = machine_.spindle_max_rpm;
      fastest > 0.0 && static_cast<double>(spindle.rpm) > fastest)
    find(nc_line, "the spindle is told to turn at " + std::to_string(spindle.rpm) + " rpm, above the " +
                      shortest_text(fastest) + " rpm of the machine file ([spindle] max_rpm)");
}

void SafeWalk::needs_height(const char* what, std::uint32_t nc_line) {
  if (!walks_) find(nc_line, std::string(what) + " before the tool has left the part: " + height_text());
}

// The tip may not go through the table at rapid rate.
void SafeWalk::check_table(const JointVector& q, bool tcp, const TableKinematics& kinematics,
                           std::uint32_t nc_line) {
  constexpr int kPlaces = 32;
  constexpr double kRounding_mm = 1e-3;
  bool from_known = true;
  for (AxisId id = 0; id < machine_.axes.size(); ++id) from_known = from_known && known_[id];
  const Vec3 to_P = kinematics.pose(q).tip_P;
  const Vec3 from_P = kinematics.pose(q_).tip_P;
  double deepest_mm = 0.0;
  for (int i = from_known ? 0 : kPlaces; i <= kPlaces; ++i) {
    const double t = static_cast<double>(i) / kPlaces;
    const Vec3 tip_P = tcp ? Vec3(from_P + t * (to_P - from_P))
                           : Vec3(kinematics.pose(JointVector::interpolate(q_, q, t)).tip_P);
    deepest_mm = std::max(deepest_mm, inside_table_mm(machine_, tip_P).value_or(0.0));
  }
  if (deepest_mm > kRounding_mm)
    find(nc_line, "in a rapid the tip is " + in_mm(deepest_mm) + " below the top of the table ([table] of " +
                      machine_.file + ")");
}

}  // namespace trunnion::post
