#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/machine/kinematics.hpp"

namespace trunnion::thermal {

/// Deviation of the tool relative to the part, actual minus nominal (physics: "Errors"): a correction is
/// minus this.
struct Offset {
  double time_s = 0.0;    // since the start of the run; of a table by operation: unused
  std::string operation;  // name of the operation (a blade); empty in a table over time
  Vec3 deviation_mm = Vec3::Zero();
  double sigma_mm = 0.0;  // standard uncertainty of the largest component
};

enum class OffsetFrame {
  machine,  // axes of M
  part      // axes of P: turns with the table
};

/// Offsets over time, or one for each operation.
struct OffsetTable {
  enum class Key { time, operation };
  std::string file;
  Key key = Key::time;
  OffsetFrame frame = OffsetFrame::machine;
  std::vector<Offset> rows;  // over time: strictly increasing

  /// The largest standard uncertainty of its rows.
  double largest_sigma_mm() const;
  /// Deviation at `time_s`: linear between rows, held outside. Requires a table over time with a row.
  Vec3 at_time(double time_s) const;
  /// The row of an operation; nothing when the table has none of that name.
  const Offset* of_operation(std::string_view name) const;
  /// The row whose operation a comment of an NC program names: letters of either case, brackets of either
  /// kind, since controls know only some.
  const Offset* of_comment(std::string_view text) const;
};

/// Reads `time_s` or `operation`, `dx_um`, `dy_um`, `dz_um` (each optional: 0), [`sigma_um`], [`frame`]
/// (`machine` or `part`, the same in all rows). Findings go to `diagnostics` with file:line:column.
Result<OffsetTable> parse_offsets(std::string_view text, const std::string& file, Diagnostics& diagnostics);
Result<OffsetTable> load_offsets(const std::string& path, Diagnostics& diagnostics);

/// What keeps a thermal correction harmless. Klipper, Siemens MD20392 and Heidenhain have the same ones.
struct OffsetLimits {
  bool enabled = true;
  double clamp_mm =
      0.2;  // largest component that is ever applied; twice the largest drift of the reference data
  double slew_mm_s = 0.001;      // Heidenhain's 1 um/s
  double dead_band_mm = 0.0005;  // smaller changes are not followed: below the resolution of a length word
};

/// Follows offsets over time under limits; a new one for each program.
class OffsetFollower {
 public:
  explicit OffsetFollower(const OffsetLimits& limits) : limits_(limits) {}
  /// Deviation that may be applied `dt_s` after the previous call when `wanted_mm` is asked for. The first
  /// call of a program sets it without slew (nothing is being cut yet). What a slow drift gathered within the
  /// dead band is taken in one step, so that a drift slower than the slew limit is never followed late; of a
  /// jump no more than the slew limit.
  /// Switched off: zero.
  Vec3 follow(const Vec3& wanted_mm, double dt_s);
  bool clamped() const { return clamped_; }            // in any call
  bool slew_limited() const { return slew_limited_; }  // in any call

 private:
  OffsetLimits limits_;
  std::optional<Vec3> applied_mm_;
  Vec3 stood_s_ = Vec3::Zero();  // since the component last moved
  bool clamped_ = false;
  bool slew_limited_ = false;
};

}  // namespace trunnion::thermal
