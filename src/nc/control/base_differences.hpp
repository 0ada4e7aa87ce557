#pragma once
#include "trunnion/base/diagnostics.hpp"
#include "trunnion/nc/controller.hpp"

#include "nc/control/patterns.hpp"

namespace trunnion::nc {

/// One warning for each word that means one thing in a controller file and another in the file that it stands
/// on
/// (`base`): M4 as [spindle] clockwise, P of a dwell as {seconds}, Z of a cycle as {depth}, a tool change
/// without M6, a setup without G49, centres of arcs as coordinates. A program is written and verified by the
/// same file, so that nothing else finds such a slip. Words that [controller] differs_in names are meant so.
void warn_of_differences_from_base(const Controller& own, const PatternSet& own_patterns,
                                   const Controller& base, Diagnostics& diagnostics);

}  // namespace trunnion::nc
