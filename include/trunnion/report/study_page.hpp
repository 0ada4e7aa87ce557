#pragma once
#include <string>

#include "trunnion/path/study.hpp"
#include "trunnion/report/page.hpp"

namespace trunnion::report {

/// The page of `trunnion study nonlinear`: points by placement and tolerance beside the on-chord optimum and
/// the two-sided law, what every predictor leaves, the worst segments predicted beside proved.
Page study_page(const path::StudyResult& result, const std::string& cl_file, const std::string& made_by);

}  // namespace trunnion::report
