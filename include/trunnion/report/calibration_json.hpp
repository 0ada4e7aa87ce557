#pragma once
#include <string>
#include <vector>

#include "trunnion/probe/calibration.hpp"

namespace trunnion::report {

/// {"parameters": {"A.point_y_mm": {"value", "sigma", "was", "seen"}, ...}, "axes": {"A": {"point_mm",
/// "direction"}}, "linear_axes": {"C0Y_urad": {"value", "sigma"}, ...}, "turned_round", "not_seen",
/// "rms_before_um", "rms_after_um", "chi2", "dof", "readings", "control_parameters"}
std::string calibration_json(const probe::Calibration& calibration,
                             const std::vector<std::string>& control_lines);
/// The same for people.
std::string calibration_text(const probe::Calibration& calibration,
                             const std::vector<std::string>& control_lines);

}  // namespace trunnion::report
