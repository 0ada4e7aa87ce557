#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trunnion/machine/kinematics.hpp"

namespace trunnion::thermal {

/// One scalar reading of the thermal drift at a pose: n . deviation of the tool relative to the part since
/// the datum.
struct DriftReading {
  JointVector q;
  Vec3 n_M = Vec3::UnitX();  // unit, axes of M
  double value_mm = 0.0;
  double u_mm = 0.001;  // standard uncertainty
};

struct DriftParameter {
  std::string name;  // "tool_x", "Y0A", "X0C", ...
  double value_mm = 0.0;
  double sigma_mm = 0.0;
  bool identifiable = false;  // value and sigma mean something
};

/// Drift split into a shift of the tool (three translations) and of each rotary axis: of its line in M at A =
/// C = 0, across it (the location errors of ISO 230-7; an axis moves alone, the one that it carries stays).
struct DriftSplit {
  std::vector<DriftParameter> parameters;
  long rank = 0;
  double condition = 0.0;                    // of the identifiable part
  std::vector<std::string> null_directions;  // what these poses cannot tell apart, in words
  Eigen::MatrixXd null_space;                // the same as columns over the parameters
  double rms_mm = 0.0;                       // of the residual

  const DriftParameter* find(std::string_view name) const;
  /// Deviation of the tool relative to the part at another pose, axes of M; nothing when it depends on what
  /// the readings leave open.
  std::optional<Vec3> deviation_M(const Machine& machine, const JointVector& q,
                                  const std::optional<JointVector>& probed_at) const;
};

/// Splits readings by weighted least squares through the chain's own linearisation (effects/deviation.hpp).
/// Datum: without `probed_at` it rides (it was set cold): d = t - (I - R_A) dA - R_A dC; a common shift of
/// all three is never seen. With `probed_at` the program zero was probed at that pose on the drifted axes, so
/// that axis shifts count as their difference to that pose, carried with the table, and the tool shift is
/// what came since: d = t - (I - R_A) dA - R_A (I - R_C) dC for a probing at A = C = 0. Fails when there are
/// no readings or an uncertainty is not above zero.
Result<DriftSplit> split_drift(const Machine& machine, const std::vector<DriftReading>& readings,
                               const std::optional<JointVector>& probed_at);

/// The paper's mapping of an offset (its Eq. 6 and 7, as far as its text tells): A and C that turn the vector
/// (x, y, z) as if it were a tool axis onto Z. A translation has no orientation content: offsets of tens of
/// um with its z of 10 um give tens of degrees. Exists for comparison only: off by default, and whoever calls
/// it must print `paper_mapping_warning`.
struct PaperAngles {
  Angle A, C;
};
PaperAngles paper_offset_to_angles(const Vec3& offset_mm);
/// The z that the paper assumes, since it measured X and Y only.
inline constexpr double kPaperZ_mm = 0.010;
inline constexpr const char* paper_mapping_warning =
    "the paper's mapping of an offset to table angles has no physical ground: a translation has no "
    "orientation; use X, Y, Z "
    "corrections";

}  // namespace trunnion::thermal
