#pragma once
#include <optional>
#include <vector>

#include "trunnion/post/verify.hpp"

#include "post/judging/late_axes.hpp"
#include "post/judging/reached_feeds.hpp"
#include "post/offset_tracker.hpp"
#include "post/program_state.hpp"
#include "post/run_time_values.hpp"

// Private to the verifier.
namespace trunnion::post {

/// The machine while the program runs: what hangs on its past, its drift, the values that the control holds.
struct MachineAsRun {
  MachineAsRun(const Machine& machine, const nc::Controller& controller, const VerifyOptions& o)
      : offsets(o.offsets != nullptr
                    ? std::optional<OffsetTracker>(std::in_place, *o.offsets, unlimited(o.offset_limits))
                    : std::nullopt),
        values(controller),
        state(machine.axes.size(), o.truth != nullptr ? o.truth->lags() : std::vector<LagRequest>{},
              o.temperatures.of_truth),
        late(o.lag_s) {}

  void elapse(double seconds) {
    if (offsets) offsets->advance(seconds);
  }
  void move_to(const JointVector& q, double seconds) {
    state.move_to(q, seconds);
    elapse(seconds);
  }

  std::optional<OffsetTracker> offsets;
  RunTimeValues values;
  std::optional<ReachedFeeds> feeds;  // where the machine file says how fast its axes accelerate
  ProgramState state;
  LateAxes late;
};

}  // namespace trunnion::post
