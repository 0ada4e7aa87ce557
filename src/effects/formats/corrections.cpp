#include <Eigen/LU>
#include <algorithm>
#include <array>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/effects/control_tables.hpp"

#include "effects/closed_turn.hpp"

namespace trunnion {
namespace {

constexpr int kMostIterations = 8;
constexpr double kConverged_mm = 1e-7;  // a tenth of a nanometre

// +1 for an axis that carries the tool, -1 for one that carries the part: what its motion does to the tool
// relative to the part.
double side(const Axis& axis) {
  return axis.carries_part ? -1.0 : 1.0;
}

// The translation of joint `input` along `direction` that a motion of `output` by 1 mm makes good (0 when it
// cannot).
double gain(const Axis& input, const Axis& output, Eigen::Index direction) {
  return side(input) * side(output) * output.direction[direction];
}

}  // namespace

void close_turns(const Machine& machine, CorrectionMap& corrections) {
  for (std::size_t k = 0; k < corrections.inputs.size(); ++k) {
    if (!machine.axes[*machine.axis(corrections.inputs[k])].cyclic ||
        !lacks_end_of_turn(corrections.nodes[k]))
      continue;
    Grid nodes{corrections.nodes[0],
               corrections.nodes.size() > 1 ? corrections.nodes[1] : std::vector<double>(),
               {}};
    const auto closed = [&](std::vector<double>& values) {
      if (values.empty()) return;
      Grid grid = nodes;
      grid.values = std::move(values);
      close_turn(grid, k);
      values = std::move(grid.values);
    };
    for (CorrectionMap::Output& output : corrections.outputs) {
      closed(output.up);
      closed(output.down);
    }
    corrections.nodes[k].push_back(corrections.nodes[k].front() + kTwoPi);
  }
}

std::optional<ComponentPlace> place_of_component(const Machine& machine, std::string_view symbol) {
  if (symbol.size() != 3 || symbol[0] != 'E') return std::nullopt;
  const auto kind = std::string_view("XYZABC").find(symbol[1]);
  const auto joint = machine.axis(symbol.substr(2));
  if (kind == std::string_view::npos || !joint) return std::nullopt;
  return ComponentPlace{*joint, kind >= 3, static_cast<Eigen::Index>(kind % 3)};
}

Result<TableErrors> TableErrors::create(const Machine& machine, const std::vector<ErrorTable>& tables,
                                        const InterpolationOptions& one, const InterpolationOptions& two) {
  TableErrors out;
  for (const ErrorTable& table : tables)
    for (const auto& component : table.components) {
      const auto place = place_of_component(machine, component.name);
      if (!place)
        return fail(ErrorCode::wrong_input, "'" + component.name + "' is no component error of this machine",
                    table.file);
      Entry entry{.joint = place->joint,
                  .rotation = place->rotation,
                  .direction = place->direction,
                  .u = 0,
                  .v = 0,
                  .interpolant = {}};
      const auto u = machine.axis(table.arguments[0]), v = machine.axis(table.arguments.back());
      if (!u || !v)
        return fail(ErrorCode::wrong_input, "the table's argument is no axis of this machine", table.file);
      entry.u = *u;
      entry.v = *v;
      auto interpolant =
          make_interpolant(table.grid(component.name), table.arguments.size() == 1 ? one : two);
      if (!interpolant) return tl::unexpected(interpolant.error());
      entry.interpolant = *interpolant;
      out.entries_.push_back(std::move(entry));
    }
  return out;
}

Result<TableErrors> TableErrors::create(const Machine& machine, const std::vector<ErrorTable>& tables) {
  InterpolationOptions one, two;
  one.method = Interpolation::linear;
  two.method = Interpolation::bilinear;
  return create(machine, tables, one, two);
}

ChainErrors TableErrors::at(const JointVector& q) const {
  ChainErrors errors;
  for (const Entry& entry : entries_) {
    Twist& twist = errors.joint[entry.joint];
    (entry.rotation ? twist.rot_rad : twist.trans_mm)[entry.direction] +=
        entry.interpolant->value(q[entry.u], q[entry.v]);
  }
  return errors;
}

JointVector corrected_position(const Machine& machine, const JointVector& q, const Vec3& tool_mm,
                               const ChainErrors& errors) {
  std::array<AxisId, 3> linear{};
  Mat3 motion = Mat3::Zero();  // of the tool relative to the part, in M, per mm of each linear axis
  std::size_t count = 0;
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    if (machine.axes[id].kind == AxisKind::linear && count < 3) {
      motion.col(static_cast<Eigen::Index>(count)) = side(machine.axes[id]) * machine.axes[id].direction;
      linear[count++] = id;
    }
  TRUNNION_EXPECTS(count == 3);
  const Mat3 inverse = motion.inverse();
  const Vec3 target = forward(machine, q, tool_mm).p;
  const Mat3 R_MP = part_in_machine(machine, q).R;
  JointVector moved = q;
  for (int n = 0; n < kMostIterations; ++n) {
    const Vec3 off_M = R_MP * (forward(machine, moved, tool_mm, errors).p - target);
    if (off_M.norm() < kConverged_mm) break;
    const Vec3 step = inverse * off_M;
    for (std::size_t k = 0; k < 3; ++k) moved[linear[k]] -= step[static_cast<Eigen::Index>(k)];
  }
  return moved;
}

Result<CorrectionMap> corrections_of(const Machine& machine, const std::vector<ErrorTable>& errors,
                                     const CorrectionGrid& grid) {
  const auto& [inputs, nodes, outputs, rest, tool_mm] = grid;
  TRUNNION_EXPECTS(inputs.size() == nodes.size() && !inputs.empty() && inputs.size() <= 2);
  const auto table = TableErrors::create(machine, errors);
  if (!table) return tl::unexpected(table.error());
  CorrectionMap map{.inputs = inputs, .nodes = nodes, .outputs = {}};
  std::vector<AxisId> in, out;
  for (const std::string& name : inputs) {
    const auto id = machine.axis(name);
    if (!id) return fail(ErrorCode::wrong_input, "the machine has no axis " + name);
    in.push_back(*id);
  }
  for (const std::string& name : outputs) {
    const auto id = machine.axis(name);
    if (!id || machine.axes[*id].kind != AxisKind::linear)
      return fail(ErrorCode::wrong_input, "axis " + name + " is no linear axis of this machine");
    out.push_back(*id);
    map.outputs.push_back({name, {}, {}});
  }
  const std::size_t width = nodes.size() > 1 ? nodes[1].size() : 1;
  for (std::size_t i = 0; i < nodes[0].size(); ++i)
    for (std::size_t j = 0; j < width; ++j) {
      JointVector q = rest;
      q[in[0]] = nodes[0][i];
      if (in.size() > 1) q[in[1]] = nodes[1][j];
      // The control looks its tables up at the commanded position, where the errors are taken too.
      const JointVector moved = corrected_position(machine, q, tool_mm, table->at(q));
      for (std::size_t k = 0; k < out.size(); ++k) map.outputs[k].up.push_back(moved[out[k]] - q[out[k]]);
    }
  return map;
}

Result<std::vector<ErrorTable>> errors_of(const Machine& machine, const CorrectionMap& corrections) {
  ErrorTable table;
  table.arguments = corrections.inputs;
  table.nodes = corrections.nodes;
  for (const auto& output : corrections.outputs) {
    const bool own = std::find(corrections.inputs.begin(), corrections.inputs.end(), output.axis) !=
                     corrections.inputs.end();
    const auto joint = machine.axis(own ? output.axis : corrections.inputs[0]),
               moved = machine.axis(output.axis);
    if (!joint || !moved) return fail(ErrorCode::wrong_input, "the machine has no axis " + output.axis);
    const Axis& mover = machine.axes[*moved];
    Eigen::Index direction = 0;
    const double along = mover.direction.cwiseAbs().maxCoeff(&direction);
    if (mover.kind != AxisKind::linear && own) {  // a rotary axis over itself: its angular positioning
      const std::string name = std::string("E") + "ABC"[direction] + mover.name;
      ErrorTable::Component component{name, {}};
      for (std::size_t i = 0; i < output.up.size(); ++i)
        component.values.push_back(-0.5 *
                                   (output.up[i] + (output.down.empty() ? output.up : output.down)[i]) *
                                   mover.direction[direction]);
      table.components.push_back(std::move(component));
      continue;
    }
    if (mover.kind != AxisKind::linear || along < 1.0 - 1e-9)
      return fail(ErrorCode::wrong_input,
                  "corrections of axis " + output.axis +
                      " are no component error: it moves along no axis of the machine");
    const double factor = -gain(machine.axes[*joint], mover, direction);
    ErrorTable::Component component{std::string("E") + "XYZ"[direction] + machine.axes[*joint].name, {}};
    for (std::size_t i = 0; i < output.up.size(); ++i)
      component.values.push_back(factor * 0.5 *
                                 (output.up[i] + (output.down.empty() ? output.up : output.down)[i]));
    table.components.push_back(std::move(component));
  }
  return std::vector<ErrorTable>{table};
}

}  // namespace trunnion
