#pragma once
#include <optional>
#include <vector>

#include "trace/alignment.hpp"

// Private to the layer: a trace in the measures of the path, found along it.
namespace trunnion::trace {

/// A trace whose rows were found along the program.
struct Followed {
  std::vector<Scaled> x;  // of each sample that is kept
  std::vector<double> time_s;
  Alignment at;
  std::size_t left_out = 0;
  double period_s = 0.0;  // between two samples, typically
};

/// Turns words into joint positions, leaves out rows that are no positions of a machine that moves, and finds
/// the others along `path`.
Result<Followed> follow_path(const Trace& trace, const Machine& machine, const Plan& plan,
                             const JointPath& path);

/// Velocity and acceleration of the sample `i` (scaled, per second) from a parabola through those around it;
/// false where they are not `half` samples on both sides, evenly enough in time.
bool motion_at(const Followed& followed, std::size_t i, std::size_t half, Scaled& velocity,
               Scaled& acceleration);

/// Means over the time of some samples, straight between them.
struct Mean {
  Scaled x, v;          // scaled, per second
  Scaled smooth;        // what is to be added to x if the axes go smoothly between them (Euler, Maclaurin)
  double time_s = 0.0;  // in their middle
};
/// Of the samples from `half` before `i` to `half` behind it; nothing as for `motion_at`.
///
/// What stands behind a first-order lag, dx/dt = (c - x) / tau, has the mean command x + tau v over the same
/// time, exactly, whatever c does: at corners and in the tail that a delay leaves behind them too.
std::optional<Mean> mean_at(const Followed& followed, std::size_t i, std::size_t half);

/// How far single positions scatter, one standard deviation: of fourth differences of rows `apart`, in which
/// there is nothing that an axis does smoothly; by the size that this share of them does not exceed.
Scaled scatter_of(const Followed& followed, std::size_t apart, double share);
/// How far v of a mean scatters (per second), and x + tau v, where single positions scatter by 1.
double scatter_of_velocity(const Followed& followed, std::size_t half);
double scatter_of_mean(const Followed& followed, std::size_t half, double tau_s);

}  // namespace trunnion::trace
