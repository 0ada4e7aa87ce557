#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/geom/pose.hpp"
#include "trunnion/machine/safe_height.hpp"

namespace trunnion {

enum class AxisKind : std::uint8_t { linear, rotary };

/// Index of an axis in Machine::axes.
using AxisId = std::size_t;

/// Three linear axes and two rotary ones that carry the part: `load_machine` takes no more. Joint positions
/// are copied from stage to stage, so they are no longer than that.
inline constexpr std::size_t kMaxAxes = 5;

/// One number per axis: mm for linear axes, rad for rotary axes (or mm/s, rad/s). Deliberately without a
/// norm: mm and rad do not add.
class JointVector {
 public:
  double& operator[](AxisId id) { return values_[id]; }
  double operator[](AxisId id) const { return values_[id]; }
  bool operator==(const JointVector&) const = default;

  /// a + t (b - a), axis by axis: what a control does between two blocks without tool-centre-point control.
  static JointVector interpolate(const JointVector& a, const JointVector& b, double t) {
    JointVector out;
    for (std::size_t i = 0; i < kMaxAxes; ++i)
      out.values_[i] = a.values_[i] + t * (b.values_[i] - a.values_[i]);
    return out;
  }

 private:
  std::array<double, kMaxAxes> values_{};
};

/// One axis of the chain. Frames: `direction` and `point_mm` in M with all axes at zero. Internal units.
struct Axis {
  std::string name;  // one letter: X, Y, Z, A, B, C, ...
  AxisKind kind = AxisKind::linear;
  /// The way the carried body physically moves (linear) or the vector about which it physically turns
  /// (rotary, right-hand rule) for a positive command. Unit length.
  Vec3 direction = Vec3::UnitX();
  Vec3 point_mm = Vec3::Zero();  // a point on the rotary axis; the measured carriage point of a linear axis
                                 // (moves with it)
  double min = -std::numeric_limits<double>::infinity();  // mm, rad
  double max = std::numeric_limits<double>::infinity();
  bool cyclic = false;                 // the control may count turns for ever
  std::optional<double> rapid;         // mm/s, rad/s
  std::optional<double> max_feed;      // mm/s, rad/s
  std::optional<double> acceleration;  // largest, mm/s2, rad/s2
  std::optional<double> jerk;          // largest, mm/s3, rad/s3
  std::optional<double> screw_pitch_mm;
  bool carries_part = false;

  bool has_limits() const { return min > -std::numeric_limits<double>::infinity(); }
  bool within_limits(double value) const { return value >= min && value <= max; }
};

/// Which point's position the X Y Z words are.
enum class OutputPoint : std::uint8_t { tip, spindle };

/// A machine as its file describes it: the kinematic chain and its nominal geometry (`physics` in README of
/// this layer).
struct Machine {
  std::string file;  // where it was read from, for headers and messages
  std::string name;
  std::optional<std::string> controller;
  std::vector<Axis> axes;
  std::vector<AxisId> tool_chain;  // from the bed outwards
  std::vector<AxisId> part_chain;  // from the bed outwards
  double tool_length_mm = 0.0;     // gauge length, S to tip
  double spindle_max_rpm = 0.0;    // 1/min; 0: not known
  Vec3 part_zero_mm = Vec3::Zero();
  OutputPoint output_point = OutputPoint::tip;
  Vec3 work_offset_mm = Vec3::Zero();
  /// The work offset that programs call where nothing else names one: 1 (G54), 2, ...
  std::int64_t work_offset = 1;
  /// Rotary positions at which the program zero was probed on the real machine; nothing: the part is where
  /// this file says.
  std::optional<JointVector> probed_at;
  double reference_degC = 20.0;  // ISO 1
  struct Sensors {
    std::map<std::string, std::string> axes;  // axis name -> temperature name
    std::string ambient = "ambient";
  } sensors;
  /// Default tolerance of the tool axis between two blocks.
  Angle axis_tolerance = Angle::degrees(0.05);

  SafeHeight safe;
  /// The control has kinematics with tool-centre-point control and without, and words to switch between them
  /// (nc::Controller::Tcp::switches_kinematics).
  bool switchable_kinematics = false;

  std::optional<AxisId> axis(std::string_view axis_name) const;
  /// Rotary axes that carry the part, from the bed outwards (0, 1 or 2).
  std::vector<AxisId> rotary_axes() const;
  /// Vector from S to the tool tip, mm.
  Vec3 tool_vector() const { return {0.0, 0.0, -tool_length_mm}; }
};

/// Reads a machine from TOML text. All findings go to `diagnostics` with `file:line:column`; fails when one
/// is an error. Besides types, units and unknown keys it checks: known axis names, no axis twice, unit
/// directions (normalised when 1e-4 near, see Direction), min < max, every axis in exactly one chain, three
/// linear axes that span space, at most two rotary axes that carry the part and are not parallel, none that
/// carries the tool, part zero and offsets finite.
Result<Machine> parse_machine(std::string_view toml, const std::string& file, Diagnostics& diagnostics);
Result<Machine> load_machine(const std::string& path, Diagnostics& diagnostics);

}  // namespace trunnion
