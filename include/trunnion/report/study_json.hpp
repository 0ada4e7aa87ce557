#pragma once
#include <string>

#include "trunnion/path/study.hpp"

namespace trunnion::report {

/// Result of `trunnion study nonlinear` as one JSON object: `predictors` (share of the error that each
/// leaves), `tolerances` (points by placement beside the on-chord optimum and the two-sided law, cutting
/// moves and links apart), `worst_segments` (predicted beside certified, with the CL line).
std::string study_json(const path::StudyResult& result);
/// The same as tables of text.
std::string study_text(const path::StudyResult& result);

}  // namespace trunnion::report
