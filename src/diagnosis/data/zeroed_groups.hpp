#pragma once
#include "trunnion/diagnosis/measurement.hpp"

namespace trunnion::diagnosis {

/// Marks readings whose `u_common` is not given and whose instrument was set to 0 at the first of them (an
/// interferometer, a level): their shared offset is minus the error there, as large as the errors that are
/// sought, so nothing is known of it. Of a quantity where all such groups of a run, and two at least in all,
/// begin with exactly 0 (in the order of time) and go on otherwise.
void mark_zeroed(Dataset& data);

}  // namespace trunnion::diagnosis
