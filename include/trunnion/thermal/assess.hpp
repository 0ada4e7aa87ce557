#pragma once
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/thermal/simulate.hpp"

namespace trunnion::thermal {

/// When a correction is sent to the machine.
enum class Sending {
  always,    // with every block, as a posted program does
  per_blade  // once, at the start of each blade, as the paper does
};

/// Blades of a truth file (`truth_text`) under the offsets of a file that `thermal predict` wrote. Runs are
/// matched by run_id; a run without offsets counts as uncorrected.
Result<std::vector<BladeResult>> assess_files(std::string_view truth, const std::string& truth_file,
                                              std::string_view offsets, const std::string& offsets_file,
                                              Sending sending, Diagnostics& diagnostics);

}  // namespace trunnion::thermal
