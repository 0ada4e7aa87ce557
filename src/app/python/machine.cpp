#include "app/python/machine.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "trunnion/base/number_text.hpp"
#include "trunnion/geom/direction.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/post/proving.hpp"
#include "trunnion/report/machine_json.hpp"

namespace trunnion::python {
namespace {

Vec3 tool_of(const Machine& machine, const std::optional<double>& length_mm) {
  return {0.0, 0.0, -length_mm.value_or(machine.tool_length_mm)};
}

py::tuple forward_of(const PyMachine& self, const Numbers& positions,
                     const std::optional<double>& tool_length_mm) {
  const Machine& machine = self.machine();
  const std::size_t n = machine.axes.size();
  need_columns(positions, n, "positions");
  Numbers tips = array_like(positions, {3});
  Numbers axes = array_like(positions, {3});
  const double* in = positions.data();
  double* tip = tips.mutable_data();
  double* axis = axes.mutable_data();
  const std::size_t rows = rows_of(positions, n);
  {
    const py::gil_scoped_release release;
    const Vec3 tool = tool_of(machine, tool_length_mm);
    for (std::size_t i = 0; i < rows; ++i) {
      const ToolPose pose = tool_pose(forward(machine, joints_of(machine, in + n * i), tool));
      Eigen::Map<Vec3>(tip + 3 * i) = pose.tip_P;
      Eigen::Map<Vec3>(axis + 3 * i) = pose.axis_P;
    }
  }
  return py::make_tuple(tips, axes);
}

// Unit length as a reader of CL files takes it: no other vector says a direction by mistake.
Vec3 direction_of(const double* row, std::size_t index) {
  const Vec3 v(row[0], row[1], row[2]);
  const auto direction = Direction::from(v);
  if (!direction) {
    throw Refused(ErrorCode::wrong_use, "error: tool_axes: row " + std::to_string(index) +
                                            " has the length " + shortest_text(v.norm()) + ", not 1");
  }
  return direction->vec();
}

Numbers inverse_of(const PyMachine& self, const Numbers& tips, const Numbers& tool_axes,
                   const std::optional<Numbers>& near, const std::optional<double>& tool_length_mm) {
  Machine machine = self.machine();
  if (tool_length_mm) machine.tool_length_mm = *tool_length_mm;
  const std::size_t n = machine.axes.size();
  need_columns(tips, 3, "tips_mm");
  need_columns(tool_axes, 3, "tool_axes");
  const std::size_t rows = rows_of(tips, 3);
  if (rows_of(tool_axes, 3) != rows)
    throw Refused(ErrorCode::wrong_use, "error: as many tool axes as tips are needed");
  if (near) need_columns(*near, n, "near");
  const std::size_t seeds = near ? rows_of(*near, n) : 0;
  if (near && seeds != 1 && seeds != rows)
    throw Refused(ErrorCode::wrong_use, "error: near: one row, or as many as tips");
  constexpr std::size_t kMost = 2;
  Numbers out = array_like(tips, {kMost, n});
  std::fill_n(out.mutable_data(), out.size(), std::numeric_limits<double>::quiet_NaN());
  const double* tip = tips.data();
  const double* axis = tool_axes.data();
  const double* seed = near ? near->data() : nullptr;
  double* to = out.mutable_data();
  const py::gil_scoped_release release;
  for (std::size_t i = 0; i < rows; ++i) {
    const JointVector from =
        seed == nullptr ? JointVector{} : joints_of(machine, seed + (seeds == 1 ? 0 : n * i));
    const ToolPose pose{Vec3(tip[3 * i], tip[3 * i + 1], tip[3 * i + 2]), direction_of(axis + 3 * i, i)};
    const auto solutions = inverse(machine, pose, from);
    for (std::size_t k = 0; k < std::min(kMost, solutions.size()); ++k)
      put_joints(machine, solutions[k].q, to + n * (kMost * i + k));
  }
  return out;
}

Numbers beyond_limits(const PyMachine& self, const Numbers& positions) {
  const Machine& machine = self.machine();
  const std::size_t n = machine.axes.size();
  need_columns(positions, n, "positions");
  Numbers out = array_like(positions, {n});
  std::fill_n(out.mutable_data(), out.size(), 0.0);
  for (std::size_t i = 0; i < rows_of(positions, n); ++i) {
    for (const LimitViolation& v : limit_violations(machine, joints_of(machine, positions.data() + n * i))) {
      const bool rotary = machine.axes[v.axis].kind == AxisKind::rotary;
      out.mutable_data()[n * i + v.axis] = rotary ? Angle::radians(v.by).deg() : v.by;
    }
  }
  return out;
}

Numbers words_from(const PyMachine& self, const Numbers& positions,
                   const std::optional<double>& tool_length_mm) {
  const Machine& machine = self.machine();
  const std::size_t n = machine.axes.size();
  need_columns(positions, n, "positions");
  Numbers out = array_like(positions, {n});
  const Vec3 tool = tool_of(machine, tool_length_mm);
  for (std::size_t i = 0; i < rows_of(positions, n); ++i) {
    put_joints(machine, words_of(machine, joints_of(machine, positions.data() + n * i), tool),
               out.mutable_data() + n * i);
  }
  return out;
}

std::string described(const PyMachine& self) {
  const auto program = taken(post::proving_program(self.machine(), self.controller()), {});
  return report::machine_json(self.machine(), self.controller(), program);
}

std::vector<std::string> axis_names(const PyMachine& self) {
  std::vector<std::string> out;
  for (const Axis& axis : self.machine().axes) out.push_back(axis.name);
  return out;
}

}  // namespace

PyMachine::PyMachine(const std::string& file, const std::string& controller) : words_(file, controller) {
  Diagnostics diagnostics;
  app::MachineOptions options;
  options.machine = file;
  options.controller = controller;
  files_ = std::make_shared<app::MachineFiles>(
      taken(app::load_with_controller(options, diagnostics), diagnostics));
  warn_of(diagnostics);
}

JointVector joints_of(const Machine& machine, const double* row) {
  JointVector q;
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    q[id] = machine.axes[id].kind == AxisKind::rotary ? Angle::degrees(row[id]).rad() : row[id];
  return q;
}

void put_joints(const Machine& machine, const JointVector& q, double* row) {
  for (AxisId id = 0; id < machine.axes.size(); ++id)
    row[id] = machine.axes[id].kind == AxisKind::rotary ? Angle::radians(q[id]).deg() : q[id];
}

void add_machine(py::module_& m) {
  py::class_<PyMachine, std::shared_ptr<PyMachine>>(m, "Machine")
      .def(py::init([](const std::filesystem::path& file, const std::filesystem::path& controller) {
             return std::make_shared<PyMachine>(file.string(), controller.string());
           }),
           py::arg("file"), py::arg("controller") = "")
      .def_property_readonly("name", [](const PyMachine& s) { return s.machine().name; })
      .def_property_readonly("file", [](const PyMachine& s) { return s.machine().file; })
      .def_property_readonly("controller", [](const PyMachine& s) { return s.controller().name; })
      .def_property_readonly("axes", &axis_names)
      .def_property_readonly("tool_length_mm", [](const PyMachine& s) { return s.machine().tool_length_mm; })
      .def_property_readonly(
          "_words", [](const PyMachine& s) { return py::make_tuple(s.machine_word(), s.controller_word()); })
      .def("forward", &forward_of, py::arg("positions"), py::arg("tool_length_mm") = py::none())
      .def("inverse", &inverse_of, py::arg("tips_mm"), py::arg("tool_axes"), py::arg("near") = py::none(),
           py::arg("tool_length_mm") = py::none())
      .def("beyond_limits", &beyond_limits, py::arg("positions"))
      .def("words", &words_from, py::arg("positions"), py::arg("tool_length_mm") = py::none())
      .def("_described", &described);
}

}  // namespace trunnion::python
