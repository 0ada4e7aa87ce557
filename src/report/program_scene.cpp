// The program of a scene: block by block what the page colours, shows and plays.
#include <algorithm>
#include <cmath>

#include "trunnion/machine/kinematics.hpp"

#include "report/nc_figures.hpp"
#include "report/svg.hpp"

namespace trunnion::report {
namespace {

// Beyond this the blocks are thinned, extremes kept: a page of a million is as large as one of these.
constexpr std::size_t kMostBlocks = 200'000;
constexpr double kFineLength_mm = 1e-4;  // as words are rounded
constexpr double kFineAngle_deg = 1e-4;
constexpr double kFineDeviation_um = 1e-3;

// As far as the feed moves go from the axis of the table.
double reach(const Machine& machine, const post::VerifyReport& report) {
  double out = 10.0;
  const Pose X_MP = part_in_machine(machine, JointVector{});
  const auto rotary = machine.rotary_axes();
  const Vec3 up = rotary.empty() ? Vec3::UnitZ() : machine.axes[rotary.back()].direction;
  const Vec3 point = rotary.empty() ? X_MP.p : machine.axes[rotary.back()].point_mm;
  for (const auto& block : report.blocks) {
    if (block.rapid) continue;
    const Vec3 from = X_MP * block.tip_P - point;
    out = std::max(out, (from - from.dot(up) * up).norm());
  }
  return 1.25 * out;
}

// Under the lowest feed move: the table of a machine file without one.
void lower_table(const Machine& machine, const post::VerifyReport& report, Machine& out) {
  if (machine.safe.table) return;
  const auto rotary = machine.rotary_axes();
  if (rotary.empty()) return;
  const Axis& inner = machine.axes[rotary.back()];
  const Vec3 up = inner.direction.z() < 0.0 ? Vec3(-inner.direction) : inner.direction;
  const Pose X_MP = part_in_machine(machine, JointVector{});
  double low = std::numeric_limits<double>::infinity();
  for (const auto& block : report.blocks)
    if (!block.rapid) low = std::min(low, (X_MP * block.tip_P - inner.point_mm).dot(up));
  if (std::isfinite(low))
    out.safe.table = TableExtent{reach(machine, report), low - 0.12 * reach(machine, report)};
}

}  // namespace

Scene program_scene(const Machine& machine, const post::VerifyReport& report,
                    const std::vector<ProgrammedSegment>& segments) {
  Machine drawn = machine;
  lower_table(machine, report, drawn);
  Scene out = machine_solids(drawn, reach(machine, report));
  const auto& blocks = report.blocks;
  std::vector<double> deviation;
  deviation.reserve(blocks.size());
  for (const auto& block : blocks) deviation.push_back(block.tip_deviation_mm);
  std::vector<std::size_t> kept = thinned(deviation, kMostBlocks);
  for (const auto& w : report.worst) kept.push_back(block_of(report, w));
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  for (const auto& w : report.worst)
    out.worst.push_back(static_cast<std::size_t>(
        std::lower_bound(kept.begin(), kept.end(), block_of(report, w)) - kept.begin()));
  const auto add = [&](std::string name, std::string unit, double step, const auto& value) {
    BlockColumn column{std::move(name), std::move(unit), step, {}};
    column.values.reserve(kept.size());
    for (const std::size_t i : kept) column.values.push_back(value(i));
    out.columns.push_back(std::move(column));
  };
  add("nc_line", "", 1.0, [&](std::size_t i) { return static_cast<double>(blocks[i].nc_line); });
  add("cl_line", "", 1.0, [&](std::size_t i) { return static_cast<double>(blocks[i].cl_line); });
  add("rapid", "", 1.0, [&](std::size_t i) { return blocks[i].rapid ? 1.0 : 0.0; });
  add("path_mm", "mm", 1e-3, [&](std::size_t i) { return blocks[i].path_mm; });
  add("seconds", "s", 1e-4, [&](std::size_t i) { return blocks[i].seconds; });
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const bool rotary = machine.axes[id].kind == AxisKind::rotary;
    add(machine.axes[id].name, rotary ? "°" : "mm", rotary ? kFineAngle_deg : kFineLength_mm,
        [&](std::size_t i) { return blocks[i].q[id] * (rotary ? kDegreePerRad : 1.0); });
  }
  const auto colour = [&](const char* column, std::string label, std::string unit, double largest) {
    out.colourings.push_back({column, std::move(label), std::move(unit), largest});
  };
  const auto largest = [&] {  // of the column that was added last
    const auto& values = out.columns.back().values;
    return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
  };
  add("tip_um", "µm", kFineDeviation_um,
      [&](std::size_t i) { return blocks[i].rapid ? 0.0 : blocks[i].tip_deviation_mm * kUmPerMm; });
  colour("tip_um", report.on_truth ? "tip deviation on the machine with its errors" : "tip deviation", "µm",
         largest());
  add("axis_deg", "°", 1e-6, [&](std::size_t i) {
    return blocks[i].rapid ? 0.0 : static_cast<double>(blocks[i].axis_deviation_rad) * kDegreePerRad;
  });
  colour("axis_deg", "tool axis deviation", "°", largest());
  if (!segments.empty()) {
    std::vector<double> straight(blocks.size(), 0.0);
    for (const auto& segment : segments) {
      for (std::size_t i = segment.from + 1; i <= segment.to; ++i) straight[i] = segment.straight_um;
    }
    add("straight_um", "µm", kFineDeviation_um, [&](std::size_t i) { return straight[i]; });
    colour("straight_um", "error without inserted points", "µm", largest());
  }
  return out;
}

}  // namespace trunnion::report
