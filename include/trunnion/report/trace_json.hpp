#pragma once
#include <string>
#include <vector>

#include "trunnion/post/verify.hpp"
#include "trunnion/trace/compare.hpp"

namespace trunnion::report {

/// verify_json with what the control really did, as the object `trace`.
std::string verify_json(const post::VerifyReport& report, const trace::TraceReport& trace);

/// The same for people, line by line.
std::vector<std::string> trace_lines(const trace::TraceReport& trace, double tolerance_mm);

}  // namespace trunnion::report
