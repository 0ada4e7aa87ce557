#pragma once
#include <optional>
#include <string>

#include "trunnion/effects/model.hpp"
#include "trunnion/post/verify.hpp"
#include "trunnion/trace/compare.hpp"

#include "app/against_options.hpp"
#include "app/options.hpp"

namespace trunnion::app {

/// What a trace is held against: the program as it was verified (VerifyOptions::collect), and its path, read
/// again.
struct TracedProgram {
  const AgainstOptions& against;
  const MachineFiles& files;
  const post::VerifyOptions& options;
  const post::VerifyReport& report;
};

/// What the program refers to must outlive the plan.
Result<trace::Plan> plan_of(const TracedProgram& program);

/// The trace of a file, in the form of `trace::parse_trace`.
Result<trace::Trace> load_trace(const std::string& file, const Machine& machine, Diagnostics& diagnostics);

}  // namespace trunnion::app
