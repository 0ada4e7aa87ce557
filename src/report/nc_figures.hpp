#pragma once
#include <cstddef>
#include <vector>

#include "trunnion/machine/machine.hpp"
#include "trunnion/post/verify.hpp"
#include "trunnion/report/page.hpp"

/// Parts of the NC pages.
namespace trunnion::report {

inline constexpr double kUmPerMm = 1e3;

/// The path in the part frame, coloured by tip deviation up to `max_um` (0: its own largest); rapids are
/// gaps.
SpacePlot path_plot(const post::VerifyReport& report, double max_um);

/// Tip deviation of each feed block at its end, um, over the path length.
Series deviation_series(const post::VerifyReport& report, std::string name);

/// A programmed segment (two CL points that are blocks of the program): what it would err if the machine ran
/// it in one move.
struct ProgrammedSegment {
  std::size_t from = 0;  // indices into VerifyReport::blocks
  std::size_t to = 0;
  double straight_um = 0.0;  // largest distance of the tip from the segment, sampled, nominal machine
  std::size_t inserted = 0;
};
std::vector<ProgrammedSegment> programmed_segments(const Machine& machine, const post::VerifyReport& report);

/// True error |e(t)| of the segment run in one move, and what the first harmonic and the parabola make of its
/// midpoint error (paper Eq. 3.3); um over t in [0, 1].
XyPlot model_against_truth(const Machine& machine, const post::VerifyReport& report,
                           const ProgrammedSegment& segment);

/// Index of the block nearest to a place of the worst list.
std::size_t block_of(const post::VerifyReport& report, const post::WorstPlace& place);

/// The machine of this file as solids, its axes at zero; `size_mm` is the radius of what stands on its table.
/// Extents that the machine file does not give follow from that.
Scene machine_solids(const Machine& machine, double size_mm);

/// The same with the program: path, columns and the places of the worst blocks. `segments` are those of the
/// report.
Scene program_scene(const Machine& machine, const post::VerifyReport& report,
                    const std::vector<ProgrammedSegment>& segments);

}  // namespace trunnion::report
