#include "report/nc_figures.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/machine/table_kinematics.hpp"
#include "trunnion/path/flute.hpp"

#include "report/svg.hpp"

namespace trunnion::report {

SpacePlot path_plot(const post::VerifyReport& report, double max_um) {
  SpacePlot plot;
  plot.frame = "part frame P";
  plot.colour = {"tip deviation", "µm"};
  plot.value_max = max_um;
  std::vector<double> way;
  for (std::size_t i = 0; i < report.blocks.size(); ++i)
    way.push_back(i == 0 ? 0.0 : report.blocks[i].path_mm - report.blocks[i - 1].path_mm);
  // Moves far longer than the others link what is cut.
  constexpr double kFarLonger = 20.0;
  std::vector<double> sorted = way;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  if (!sorted.empty()) std::nth_element(sorted.begin(), middle, sorted.end());
  const double longest = sorted.empty() ? 0.0 : kFarLonger * *middle;
  for (std::size_t i = 0; i < report.blocks.size(); ++i) {
    const auto& block = report.blocks[i];
    plot.x.push_back(block.tip_P.x());
    plot.y.push_back(block.tip_P.y());
    plot.z.push_back(block.tip_P.z());
    const bool links = block.rapid || (longest > 0.0 && way[i] > longest);
    plot.value.push_back(links ? kGap : block.tip_deviation_mm * kUmPerMm);
  }
  return plot;
}

Series deviation_series(const post::VerifyReport& report, std::string name) {
  Series out;
  out.name = std::move(name);
  for (const auto& block : report.blocks) {
    out.x.push_back(block.path_mm);
    out.y.push_back(block.rapid ? kGap : block.tip_deviation_mm * kUmPerMm);
  }
  return out;
}

std::vector<ProgrammedSegment> programmed_segments(const Machine& machine, const post::VerifyReport& report) {
  constexpr int kSamples = 8;
  const TableKinematics kinematics(machine, machine.tool_vector());
  std::vector<ProgrammedSegment> out;
  std::size_t from = report.blocks.size();  // none
  for (std::size_t i = 0; i < report.blocks.size(); ++i) {
    const auto& block = report.blocks[i];
    if (!block.programmed) continue;
    const bool feed = from < i && std::none_of(report.blocks.begin() + static_cast<std::ptrdiff_t>(from) + 1,
                                               report.blocks.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                                               [](const auto& b) { return b.rapid; });
    if (feed) {
      const ToolPose begin = kinematics.pose(report.blocks[from].q);
      const ToolPose end = kinematics.pose(block.q);
      const path::FluteSegment way({begin.tip_P, end.tip_P, begin.axis_P, end.axis_P}, report.flute_mm);
      double largest = 0.0;
      double of_flute = 0.0;
      for (int k = 1; k < kSamples; ++k) {
        const double t = static_cast<double>(k) / kSamples;
        const ToolPose at = kinematics.pose(JointVector::interpolate(report.blocks[from].q, block.q, t));
        largest = std::max(largest, distance_to_segment(at.tip_P, begin.tip_P, end.tip_P));
        if (report.flute_mm == 0.0) continue;
        const double nearest = way.nearest(at.tip_P, at.axis_P, t);
        of_flute = std::max(of_flute, way.off(at.tip_P, at.axis_P, nearest).largest_mm(report.flute_mm));
      }
      out.push_back({from, i, largest * kUmPerMm, of_flute * kUmPerMm, i - from - 1});
    }
    from = i;
  }
  return out;
}

XyPlot model_against_truth(const Machine& machine, const post::VerifyReport& report,
                           const ProgrammedSegment& segment) {
  constexpr int kSteps = 100;
  const TableKinematics kinematics(machine, machine.tool_vector());
  const JointVector& q0 = report.blocks[segment.from].q;
  const JointVector& q1 = report.blocks[segment.to].q;
  const Vec3 p0 = kinematics.pose(q0).tip_P;
  const Vec3 p1 = kinematics.pose(q1).tip_P;
  const auto error = [&](double t) -> Vec3 {
    return (kinematics.pose(JointVector::interpolate(q0, q1, t)).tip_P - (p0 + t * (p1 - p0))) * kUmPerMm;
  };
  const Vec3 middle = error(0.5);
  XyPlot plot;
  plot.x = {"place on the segment t", ""};
  plot.y = {"|e|", "µm"};
  plot.series.resize(4);
  const char* names[] = {"true error", "first harmonic", "left by the harmonic", "left by the parabola"};
  for (std::size_t s = 0; s < plot.series.size(); ++s) plot.series[s].name = names[s];
  for (int i = 0; i <= kSteps; ++i) {
    const double t = static_cast<double>(i) / kSteps;
    const Vec3 e = error(t);
    const Vec3 harmonic = middle * std::sin(kPi * t);
    const Vec3 parabola = middle * (4.0 * t * (1.0 - t));
    const double values[] = {e.norm(), harmonic.norm(), (e - harmonic).norm(), (e - parabola).norm()};
    for (std::size_t s = 0; s < plot.series.size(); ++s) {
      plot.series[s].x.push_back(t);
      plot.series[s].y.push_back(values[s]);
    }
  }
  return plot;
}

std::size_t block_of(const post::VerifyReport& report, const post::WorstPlace& place) {
  const auto at =
      std::lower_bound(report.blocks.begin(), report.blocks.end(), place.nc_line,
                       [](const auto& block, std::uint32_t line) { return block.nc_line < line; });
  if (at == report.blocks.end()) return report.blocks.empty() ? 0 : report.blocks.size() - 1;
  return static_cast<std::size_t>(at - report.blocks.begin());
}

}  // namespace trunnion::report
