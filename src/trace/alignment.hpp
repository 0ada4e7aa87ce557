#pragma once
#include <span>
#include <string>
#include <vector>

#include "trunnion/base/result.hpp"

#include "trace/joint_path.hpp"

// Private to the layer: which place of the program each row of a trace is.
namespace trunnion::trace {

struct Alignment {
  std::vector<double> s;            // of each sample along the JointPath; NaN: not along the program
  std::vector<double> distance;     // of its place from there, scaled
  std::vector<double> forward;      // s made to never go back: for times
  std::size_t first = 0, last = 0;  // samples along the program, both included
  double within = 0.0;              // how far off a place may be and still count as along the program
  double step = 0.0;                // of what was looked at in the whole
};

/// Finds the way of `x` along the path as a whole (the cheapest sequence of places that goes forward as far
/// as the axes move, dynamic programming over places a step apart), then each sample's place between them.
/// Fails where too little of it is along the program, or two ways fit alike.
Result<Alignment> align(const JointPath& path, const std::vector<PlannedBlock>& blocks,
                        std::span<const Scaled> x, const Trace& trace);

/// In other units, signs or columns the same rows would be along the program: in which, in words; empty where
/// none is found.
std::string explain_mismatch(const JointPath& path, std::span<const Scaled> x, const Machine& machine);

}  // namespace trunnion::trace
