#pragma once
#include "trunnion/report/page.hpp"
#include "trunnion/trace/compare.hpp"

namespace trunnion::report {

/// What the control really did (`course` must have been kept): the path coloured by the deviation of the
/// rows, the deviation in time, the causes, the blocks that took longest beside the plan.
Section trace_section(const trace::TraceReport& trace, double tolerance_mm);

}  // namespace trunnion::report
