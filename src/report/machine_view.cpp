// The machine as lines: a disc for the table, the rotary axes, the tool (drawn by the page's script).
#include <algorithm>
#include <cmath>

#include "trunnion/machine/kinematics.hpp"

#include "report/nc_figures.hpp"

namespace trunnion::report {
namespace {

constexpr std::size_t kStops = 3000;

std::array<float, 3> point(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

MachineView::Outline line(std::string name, bool moves, const Vec3& from, const Vec3& to) {
  return {std::move(name), moves, {point(from), point(to)}};
}

// The table: a disc about the inner rotary axis below the lowest point of the path, with spokes that show how
// it turns.
struct Disc {
  Vec3 centre_P;
  Vec3 normal_P;
  double radius_mm;
};

Disc disc_under(const post::VerifyReport& report, const Vec3& point_P, const Vec3& axis_P) {
  constexpr double kGapBelow_mm = 10.0;
  constexpr double kBeyond = 1.3;
  double low = std::numeric_limits<double>::infinity();
  double radius = 10.0;
  for (const auto& block : report.blocks) {
    if (block.rapid) continue;
    const Vec3 from_point = block.tip_P - point_P;
    const double along = from_point.dot(axis_P);
    low = std::min(low, along);
    radius = std::max(radius, (from_point - along * axis_P).norm());
  }
  if (!std::isfinite(low)) low = 0.0;
  return {point_P + (low - kGapBelow_mm) * axis_P, axis_P, kBeyond * radius};
}

void add_disc(MachineView& view, const Disc& disc) {
  constexpr int kSides = 72;
  const Vec3 across = disc.normal_P.unitOrthogonal();
  const Vec3 third = disc.normal_P.cross(across);
  const auto at = [&](double angle, double part) -> Vec3 {
    return disc.centre_P + part * disc.radius_mm * (std::cos(angle) * across + std::sin(angle) * third);
  };
  MachineView::Outline rim{"table", true, {}};
  for (int i = 0; i <= kSides; ++i) rim.points.push_back(point(at(kTwoPi * i / kSides, 1.0)));
  // One spoke only, so that a full turn can be told from none.
  rim.points.push_back(point(at(0.0, 0.0)));
  view.outlines.push_back(std::move(rim));
}

}  // namespace

MachineView machine_view(const Machine& machine, const post::VerifyReport& report,
                         const std::vector<std::size_t>& wanted, std::vector<std::size_t>& stop_of) {
  MachineView view;
  view.tool_length_mm = machine.tool_length_mm;
  std::vector<double> deviation;
  for (const auto& block : report.blocks) deviation.push_back(block.tip_deviation_mm);
  std::vector<std::size_t> kept = thinned(deviation, kStops);
  kept.insert(kept.end(), wanted.begin(), wanted.end());
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  stop_of.clear();
  for (const std::size_t block : wanted)
    stop_of.push_back(
        static_cast<std::size_t>(std::lower_bound(kept.begin(), kept.end(), block) - kept.begin()));
  for (const Axis& axis : machine.axes) {
    view.axis_names.push_back(axis.name);
    view.axis_units.emplace_back(axis.kind == AxisKind::rotary ? "°" : "mm");
  }
  for (const std::size_t i : kept) {
    const auto& block = report.blocks[i];
    const Pose X_MP = part_in_machine(machine, block.q);
    const JointVector words = words_of(machine, block.q, machine.tool_vector());
    MachineView::Stop stop;
    for (Eigen::Index r = 0; r < 3; ++r) {
      const auto row = static_cast<std::size_t>(4 * r);
      for (Eigen::Index c = 0; c < 3; ++c)
        stop.part_in_machine.at(row + static_cast<std::size_t>(c)) = static_cast<float>(X_MP.R(r, c));
      stop.part_in_machine.at(row + 3) = static_cast<float>(X_MP.p[r]);
    }
    stop.tip_P = point(block.tip_P);
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      const double factor = machine.axes[id].kind == AxisKind::rotary ? kDegreePerRad : 1.0;
      stop.axes.push_back(static_cast<float>(words[id] * factor));
    }
    stop.path_mm = static_cast<float>(block.path_mm);
    stop.deviation_um = static_cast<float>(block.tip_deviation_mm * kUmPerMm);
    stop.nc_line = block.nc_line;
    stop.cl_line = block.cl_line;
    view.stops.push_back(std::move(stop));
  }
  const Pose X_PM = part_in_machine(machine, JointVector{}).inverse();
  const auto rotary = machine.rotary_axes();
  Disc disc = disc_under(report, Vec3::Zero(), Vec3::UnitZ());
  if (!rotary.empty()) {
    const Axis& inner = machine.axes[rotary.back()];
    disc = disc_under(report, X_PM * inner.point_mm, X_PM.R * inner.direction);
    view.outlines.push_back(line("axis " + inner.name, true,
                                 disc.centre_P - 0.4 * disc.radius_mm * disc.normal_P,
                                 disc.centre_P + 1.6 * disc.radius_mm * disc.normal_P));
  }
  if (rotary.size() == 2) {
    const Axis& outer = machine.axes[rotary.front()];
    view.outlines.push_back(line("axis " + outer.name, false,
                                 outer.point_mm - 1.5 * disc.radius_mm * outer.direction,
                                 outer.point_mm + 1.5 * disc.radius_mm * outer.direction));
  }
  add_disc(view, disc);
  return view;
}

}  // namespace trunnion::report
