#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>

#include "trunnion/base/number_text.hpp"
#include "trunnion/diagnosis/table_models.hpp"
#include "trunnion/geom/linear_algebra.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kSameNode_mm = 1e-6;
constexpr double kAxial = 1e-4;  // n is along an axis within its printed digits

long long key_of(double value) {
  return std::llround(value / kSameNode_mm);
}

double side(const Axis& axis) {
  return axis.carries_part ? -1.0 : 1.0;
}

struct Axes {
  AxisId u = 0, v = 0;
};

// The joint that a translation along `direction` is written to: the axis of the map that moves that way, else
// the first one.
AxisId joint_for(const Machine& machine, const Axes& axes, int direction) {
  return std::abs(machine.axes[axes.v].direction[direction]) > 0.5 ? axes.v : axes.u;
}

std::string symbol(char what, const Machine& machine, AxisId joint) {
  return std::string("E") + what + machine.axes[joint].name;
}

struct Form {
  std::string name;
  Interpolation method;
  double smoothing = 0.0;
};

TableCandidate surface(const Machine& machine, const PlanarMap& map, const Axes& axes, const Form& form) {
  TableCandidate out;
  out.name = form.name;
  out.one.method = Interpolation::linear;
  out.two.method = form.method;
  out.two.smoothing = form.smoothing;
  ErrorTable table;
  table.arguments = {map.u, map.v};
  table.nodes = {map.u_nodes, map.v_nodes};
  for (int k = 0; k < 3; ++k) {
    const auto& values = map.displacement_M[static_cast<std::size_t>(k)];
    if (values.empty()) continue;
    const AxisId joint = joint_for(machine, axes, k);
    ErrorTable::Component component{symbol("XYZ"[k], machine, joint), values};
    for (double& value : component.values)
      value *= side(machine.axes[joint]);  // the deviation of the tool relative to the part
    table.components.push_back(std::move(component));
  }
  out.tables = {table};
  return out;
}

ErrorTable line_table(const std::string& axis, const std::vector<double>& nodes) {
  ErrorTable table;
  table.arguments = {axis};
  table.nodes = {nodes};
  return table;
}

TableCandidate single(const Machine& machine, const PlanarMap& map, const Axes& axes) {
  TableCandidate out;
  out.name = "single";
  out.one.method = Interpolation::linear;
  out.two.method = Interpolation::bilinear;
  const std::size_t i0 = map.u_nodes.size() / 2, j0 = map.v_nodes.size() / 2;
  ErrorTable along_u = line_table(map.u, map.u_nodes), along_v = line_table(map.v, map.v_nodes);
  for (int k = 0; k < 3; ++k) {
    if (map.displacement_M[static_cast<std::size_t>(k)].empty()) continue;
    ErrorTable::Component cu{symbol("XYZ"[k], machine, axes.u), {}},
        cv{symbol("XYZ"[k], machine, axes.v), {}};
    for (std::size_t i = 0; i < map.u_nodes.size(); ++i)
      cu.values.push_back(side(machine.axes[axes.u]) * map.at(k, i, j0));
    for (std::size_t j = 0; j < map.v_nodes.size(); ++j)
      cv.values.push_back(side(machine.axes[axes.v]) * (map.at(k, i0, j) - map.at(k, i0, j0)));
    along_u.components.push_back(std::move(cu));
    along_v.components.push_back(std::move(cv));
  }
  out.tables = {along_u, along_v};
  return out;
}

JointVector node(const PlanarMap& map, const Axes& axes, std::size_t i, std::size_t j) {
  JointVector q = map.rest;
  q[axes.u] = map.u_nodes[i];
  q[axes.v] = map.v_nodes[j];
  return q;
}

// Twists of both joints at their nodes that explain all nodes: least squares with a weak pull to zero, which
// settles what the plane cannot tell apart (a constant of one axis against the other's, a yaw without a
// lever).
TableCandidate rigid(const Machine& machine, const PlanarMap& map, const Axes& axes) {
  // Relative weights of the pull. That on rotations is the stronger, so that what a translation can say is
  // said by one.
  constexpr double kPull = 1e-10, kPullRotation = 1e-6;
  constexpr double kArm_mm = 100.0;  // makes rotations comparable with translations
  const std::size_t n = map.u_nodes.size(), m = map.v_nodes.size(), unknowns = 6 * (n + m);
  const auto size = static_cast<Eigen::Index>(unknowns);
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < m; ++j) {
      const DeviationMap deviation(machine, node(map, axes, i, j), map.tool_mm);
      Eigen::Matrix<double, 3, 12> block;
      for (int joint = 0; joint < 2; ++joint)
        for (int c = 0; c < 6; ++c) {
          Twist unit;
          if (c < 3)
            unit.trans_mm[c] = 1.0;
          else
            unit.rot_rad[c - 3] = 1.0 / kArm_mm;
          const Link link{Link::Kind::joint, joint == 0 ? axes.u : axes.v};
          block.col(6 * joint + c) = deviation.linear_M(link, unit).displacement_mm;
        }
      const std::size_t first[2] = {6 * i, 6 * (n + j)};
      for (int k = 0; k < 3; ++k) {
        if (map.displacement_M[static_cast<std::size_t>(k)].empty()) continue;
        for (int a = 0; a < 12; ++a) {
          const auto row = static_cast<Eigen::Index>(first[a / 6] + static_cast<std::size_t>(a % 6));
          right[row] += block(k, a) * map.at(k, i, j);
          for (int b = 0; b < 12; ++b)
            N(row, static_cast<Eigen::Index>(first[b / 6] + static_cast<std::size_t>(b % 6))) +=
                block(k, a) * block(k, b);
        }
      }
    }
  const double scale = N.diagonal().maxCoeff();
  for (Eigen::Index k = 0; k < size; ++k) N(k, k) += scale * (k % 6 < 3 ? kPull : kPullRotation);
  const Eigen::VectorXd z = solve_positive(N, right);
  TableCandidate out;
  out.name = "rigid";
  out.one.method = Interpolation::linear;
  out.two.method = Interpolation::bilinear;
  for (int joint = 0; joint < 2; ++joint) {
    ErrorTable table = line_table(joint == 0 ? map.u : map.v, joint == 0 ? map.u_nodes : map.v_nodes);
    for (int c = 0; c < 6; ++c) {
      ErrorTable::Component component{symbol("XYZABC"[c], machine, joint == 0 ? axes.u : axes.v), {}};
      double largest = 0.0;
      for (std::size_t i = 0; i < table.nodes[0].size(); ++i) {
        const double value =
            z[static_cast<Eigen::Index>(6 * (joint == 0 ? i : n + i)) + c] / (c < 3 ? 1.0 : kArm_mm);
        component.values.push_back(value);
        largest = std::max(largest, std::abs(value));
      }
      if (largest > 1e-12) table.components.push_back(std::move(component));
    }
    if (!table.components.empty()) out.tables.push_back(std::move(table));
  }
  return out;
}

}  // namespace

Result<std::vector<TableCandidate>> table_candidates(const Machine& machine, const PlanarMap& map) {
  const auto u = machine.axis(map.u), v = machine.axis(map.v);
  if (!u || !v) return fail(ErrorCode::wrong_input, "the map's axes are not in the machine file");
  const Axes axes{*u, *v};
  std::vector<TableCandidate> out = {single(machine, map, axes), rigid(machine, map, axes),
                                     surface(machine, map, axes, {"bilinear", Interpolation::bilinear}),
                                     surface(machine, map, axes, {"nurbs", Interpolation::nurbs}),
                                     surface(machine, map, axes, {"spline", Interpolation::spline})};
  for (const double smoothing : {0.01, 0.1, 1.0})
    out.push_back(surface(machine, map, axes,
                          {"spline smoothed " + shortest_text(smoothing), Interpolation::spline, smoothing}));
  return out;
}

Result<PlanarMap> planar_map(const Dataset& data, const Machine& machine) {
  struct Sum {
    double total = 0.0;
    int count = 0;
  };
  std::map<std::pair<long long, long long>, std::array<Sum, 3>> nodes;
  std::map<long long, double> at[kMaxAxes];
  std::vector<std::size_t> used;
  for (std::size_t r = 0; r < data.readings.size(); ++r) {
    const Reading& reading = data.readings[r];
    if (reading.quantity != Quantity::displacement || reading.frame != SensitivityFrame::machine) continue;
    if (reading.n.cwiseAbs().maxCoeff() < 1.0 - kAxial) continue;
    used.push_back(r);
    const JointVector& q = data.track.state(reading.row).q;
    for (AxisId id = 0; id < machine.axes.size(); ++id) at[id][key_of(q[id])] = q[id];
  }
  std::vector<AxisId> moving;
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    if (at[id].size() > 1) moving.push_back(id);
  if (moving.size() != 2 || machine.axes[moving[0]].kind != AxisKind::linear ||
      machine.axes[moving[1]].kind != AxisKind::linear)
    return fail(ErrorCode::wrong_input,
                "a map wants readings along the axes X, Y, Z over exactly two moving linear axes; " +
                    std::to_string(moving.size()) + " move here");
  PlanarMap map;
  map.u = machine.axes[moving[0]].name;
  map.v = machine.axes[moving[1]].name;
  for (const auto& [key, value] : at[moving[0]]) map.u_nodes.push_back(value);
  for (const auto& [key, value] : at[moving[1]]) map.v_nodes.push_back(value);
  map.rest = data.track.state(data.readings[used.front()].row).q;
  map.tool_mm = data.rows[data.readings[used.front()].row].tool_mm;
  bool measured[3] = {false, false, false};
  for (const std::size_t r : used) {
    const Reading& reading = data.readings[r];
    const JointVector& q = data.track.state(reading.row).q;
    Eigen::Index k = 0;
    reading.n.cwiseAbs().maxCoeff(&k);
    Sum& sum = nodes[{key_of(q[moving[0]]), key_of(q[moving[1]])}][static_cast<std::size_t>(k)];
    sum.total += reading.value * (reading.n[k] > 0 ? 1.0 : -1.0);
    ++sum.count;
    measured[k] = true;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    if (!measured[k]) continue;
    for (const double u : map.u_nodes)
      for (const double v : map.v_nodes) {
        const auto it = nodes.find({key_of(u), key_of(v)});
        if (it == nodes.end() || it->second[k].count == 0)
          return fail(ErrorCode::wrong_input, std::string("the grid has no ") + "XYZ"[k] + " reading at " +
                                                  map.u + " " + shortest_text(u) + ", " + map.v + " " +
                                                  shortest_text(v));
        map.displacement_M[k].push_back(it->second[k].total / it->second[k].count);
      }
  }
  return map;
}

std::vector<CheckReading> check_readings(const Dataset& data) {
  std::vector<CheckReading> out;
  for (const Reading& reading : data.readings)
    if (reading.quantity == Quantity::displacement && reading.frame == SensitivityFrame::machine)
      out.push_back(
          {data.track.state(reading.row).q, data.rows[reading.row].tool_mm, reading.n, reading.value});
  return out;
}

}  // namespace trunnion::diagnosis
