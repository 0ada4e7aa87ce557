#pragma once
#include "trunnion/config/section.hpp"
#include "trunnion/nc/controller.hpp"

#include "nc/control/patterns.hpp"

namespace trunnion::nc {

/// Of [program] setup, [spindle] and [coolant], as far as this file has them: an error where a word switches
/// the unit, the plane or the feed to what programs here are not written in, shifts or turns the zero, or
/// moves an axis. Such words would be in every program, and its verification takes them as they are. What the
/// file says elsewhere ([read.refused], [input]) has been read.
void check_setup(config::Section& root, const Controller& c);

/// Words of the setup that nothing else in the file knows: one warning.
void warn_of_unknown_setup(const Controller& c, const PatternSet& patterns, Diagnostics& diagnostics);

}  // namespace trunnion::nc
