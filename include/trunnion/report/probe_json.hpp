#pragma once
#include <string>

#include "trunnion/probe/program.hpp"
#include "trunnion/probe/reading.hpp"

namespace trunnion::report {

/// {"poses": [{"A_deg", "C_deg"}], "touches", "seconds", "sigma_of_um": {"A": {"point_mm": [..],
/// "direction_urad":
/// [..]}}}: what a centre that errs by 1 um leaves in each axis; null where the poses do not tell.
std::string probe_program_json(const Machine& machine, const probe::MadeProgram& program);
/// The same for people.
std::string probe_program_text(const Machine& machine, const probe::MadeProgram& program);

/// {"poses": [{"A_deg", ..., "center_mm", "radius_mm", "worst_residual_um", "deviation_um", "u_um"}],
/// "radius_mm", "expected_radius_mm", "scatter_um", "fast_less_slow_um", "u_common_z_um"}
std::string probe_reading_json(const Machine& machine, const probe::Strokes& strokes,
                               const probe::ProbeReading& reading);
std::string probe_reading_text(const Machine& machine, const probe::Strokes& strokes,
                               const probe::ProbeReading& reading);

}  // namespace trunnion::report
