#pragma once
#include <string>
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

/// A file's text, and its name for messages.
struct FileText {
  std::string_view text;
  const std::string& file;
};

/// Blades of a truth file under the offsets of a file that `thermal predict` wrote. Runs are
/// matched by run_id; a run without offsets counts as uncorrected.
Result<std::vector<BladeResult>> assess_files(const FileText& truth, const FileText& offsets, Sending sending,
                                              Diagnostics& diagnostics);

}  // namespace trunnion::thermal
