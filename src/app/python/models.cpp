// Models of a machine's errors against measurements: what `trunnion model evaluate`, `fit` and `diagnose` do.
#include <filesystem>
#include <memory>
#include <optional>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <string>
#include <utility>
#include <vector>

#include "trunnion/base/files.hpp"
#include "trunnion/diagnosis/diagnose.hpp"
#include "trunnion/diagnosis/evaluate.hpp"
#include "trunnion/diagnosis/fit.hpp"
#include "trunnion/effects/model_paths.hpp"
#include "trunnion/report/diagnosis_json.hpp"

#include "app/options.hpp"
#include "app/python/calls.hpp"
#include "app/python/machine.hpp"

namespace trunnion::python {
namespace {

using diagnosis::Dataset;
using diagnosis::Quantity;

double in_micro(double value, Quantity quantity) {
  return value / (quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad);
}

/// Readings of one machine, as Python holds them.
class PyMeasurements {
 public:
  PyMeasurements(const PyMachine& machine, const std::vector<std::filesystem::path>& paths)
      : machine_(machine.shared()) {
    Diagnostics diagnostics;
    const std::vector<std::string> files(paths.begin(), paths.end());
    data_ = std::make_shared<const Dataset>(
        taken(diagnosis::load_measurements(files, *machine_, diagnostics), diagnostics));
    warn_of(diagnostics);
  }
  PyMeasurements(const PyMachine& machine, const std::string& text, const std::string& name)
      : machine_(machine.shared()) {
    Diagnostics diagnostics;
    const std::vector<diagnosis::NamedText> files = {{name, text}};
    data_ = std::make_shared<const Dataset>(
        taken(diagnosis::parse_measurements(files, *machine_, diagnostics), diagnostics));
    warn_of(diagnostics);
  }

  const Dataset& data() const { return *data_; }
  std::shared_ptr<const Dataset> shared() const { return data_; }
  std::shared_ptr<const Machine> machine() const { return machine_; }

 private:
  std::shared_ptr<const Machine> machine_;
  std::shared_ptr<const Dataset> data_;
};

template <class Of>
Numbers each_reading(const Dataset& data, const Of& of) {
  Numbers out(static_cast<py::ssize_t>(data.readings.size()));
  for (std::size_t i = 0; i < data.readings.size(); ++i) out.mutable_data()[i] = of(data.readings[i]);
  return out;
}

Numbers directions_of(const PyMeasurements& self) {
  const auto& readings = self.data().readings;
  Numbers out({static_cast<py::ssize_t>(readings.size()), py::ssize_t{3}});
  for (std::size_t i = 0; i < readings.size(); ++i)
    Eigen::Map<Vec3>(out.mutable_data() + 3 * i) = readings[i].n;
  return out;
}

Numbers positions_of(const PyMeasurements& self) {
  const auto& readings = self.data().readings;
  const std::size_t n = self.machine()->axes.size();
  Numbers out({readings.size(), n});
  for (std::size_t i = 0; i < readings.size(); ++i)
    put_joints(*self.machine(), self.data().track.state(readings[i].row).q, out.mutable_data() + n * i);
  return out;
}

std::vector<std::string> run_names(const PyMeasurements& self) {
  std::vector<std::string> out;
  for (const RunInfo& run : self.data().context.runs) out.push_back(run.id);
  return out;
}

/// A model file's text for a machine. It is read anew with the sensors of the data that it meets.
class PyModel {
 public:
  PyModel(const PyMachine& machine, std::string file, std::string text)
      : PyModel(machine.shared(), std::move(file), std::move(text)) {}
  PyModel(std::shared_ptr<const Machine> machine, std::string file, std::string text)
      : machine_(std::move(machine)), file_(std::move(file)), text_(std::move(text)) {
    warn_of(read({}).second);
  }
  static PyModel load(const PyMachine& machine, const std::filesystem::path& file) {
    return PyModel(machine, file.string(), taken(read_file(file.string()), {}));
  }

  const std::string& file() const { return file_; }
  const std::string& text() const { return text_; }
  const Machine& machine() const { return *machine_; }
  std::shared_ptr<const Machine> shared_machine() const { return machine_; }
  std::pair<Model, Diagnostics> read(const EffectContext& context) const {
    Diagnostics diagnostics;
    Model model = taken(parse_model(text_, file_, *machine_, context, diagnostics), diagnostics);
    return {std::move(model), std::move(diagnostics)};
  }

 private:
  std::shared_ptr<const Machine> machine_;
  std::string file_, text_;
};

void save(const PyModel& self, const std::filesystem::path& path) {
  const std::string file = path.string();
  const Model model = self.read({}).first;
  if (const auto written = write_file(file, model_text(written_to(model, file))); !written)
    refuse({}, written.error());
}

// Of every position: displacement (um) and rotation (urad) of the tool relative to the part, in M.
py::tuple deviations_of(const PyModel& self, const Numbers& positions,
                        const std::optional<double>& tool_length_mm) {
  const Machine& machine = self.machine();
  const std::size_t n = machine.axes.size();
  need_columns(positions, n, "positions");
  Numbers shifts = array_like(positions, {3});
  Numbers turns = array_like(positions, {3});
  double* shift = shifts.mutable_data();
  double* turn = turns.mutable_data();
  const double* in = positions.data();
  const std::size_t rows = rows_of(positions, n);
  const Model model = self.read({}).first;
  {
    const py::gil_scoped_release release;
    const ModelEvaluator evaluator(model);
    const Vec3 tool(0.0, 0.0, -tool_length_mm.value_or(machine.tool_length_mm));
    for (std::size_t i = 0; i < rows; ++i) {
      MachineState state;
      state.q = joints_of(machine, in + n * i);
      const Deviation d = DeviationMap(machine, state.q, tool).exact_M(evaluator.errors(state));
      Eigen::Map<Vec3>(shift + 3 * i) = d.displacement_mm / kMmPerUm;
      Eigen::Map<Vec3>(turn + 3 * i) = d.rotation_rad / kRadPerUrad;
    }
  }
  return py::make_tuple(shifts, turns);
}

/// What a model and measurements come together as; work that Ctrl-C drops owns it.
struct Meeting {
  std::shared_ptr<const Machine> machine;
  std::shared_ptr<const Dataset> data;
  Model model;
};

std::shared_ptr<const Meeting> meet(const PyMeasurements& measurements, const PyModel& model) {
  auto [read, diagnostics] = model.read(measurements.data().context);
  app::warn_of_missing_sensors(read, measurements.data().context, diagnostics);
  warn_of(diagnostics);
  return std::make_shared<const Meeting>(
      Meeting{measurements.machine(), measurements.shared(), std::move(read)});
}

std::string evaluate(const PyMeasurements& measurements, const PyModel& model) {
  const auto in = meet(measurements, model);
  const auto result = interruptible([in] { return diagnosis::evaluate(*in->machine, *in->data, in->model); });
  return report::evaluation_json(result, *in->machine);
}

/// (fitted model, result as JSON, residuals in um or urad, whitened residuals, outliers)
py::tuple fit(const PyMeasurements& measurements, const PyModel& model, bool robust) {
  const auto in = meet(measurements, model);
  diagnosis::FitOptions options;
  options.robust = robust;
  auto result =
      interruptible([in, options] { return diagnosis::fit(*in->machine, *in->data, in->model, options); });
  result.model.parent = model.file();
  const auto count = static_cast<py::ssize_t>(in->data->readings.size());
  Numbers residuals(count);
  Numbers normalised(count);
  py::array_t<bool> outliers(count);
  for (py::ssize_t k = 0; k < count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    residuals.mutable_at(k) = in_micro(result.residual[i], in->data->readings[i].quantity);
    normalised.mutable_at(k) = result.normalised[i];
    outliers.mutable_at(k) = result.outlier[i];
  }
  PyModel fitted(model.shared_machine(), model.file(), model_text(result.model));
  return py::make_tuple(std::move(fitted), report::fit_json(result, *in->data), residuals, normalised,
                        outliers);
}

std::string diagnose(const PyMeasurements& measurements, const PyModel& model, const PyModel* also) {
  const auto in = meet(measurements, model);
  std::vector<EffectFamily> extra;
  if (also != nullptr) {
    for (const ModelEffect& effect : also->read(in->model.context).first.effects)
      extra.push_back({{effect.effect}});
  }
  const auto result = interruptible(
      [in, extra] { return diagnosis::diagnose(*in->machine, *in->data, in->model, {}, extra); });
  return report::diagnosis_json(result, *in->machine);
}

}  // namespace

void add_models(py::module_& m) {
  py::class_<PyMeasurements>(m, "Measurements")
      .def(py::init<const PyMachine&, const std::vector<std::filesystem::path>&>(), py::arg("machine"),
           py::arg("files"))
      .def_static(
          "from_text",
          [](const PyMachine& machine, const std::string& text, const std::string& name) {
            return PyMeasurements(machine, text, name);
          },
          py::arg("machine"), py::arg("text"), py::arg("name") = "measurements.csv")
      .def("__len__", [](const PyMeasurements& s) { return s.data().readings.size(); })
      .def_property_readonly("runs", &run_names)
      .def_property_readonly(
          "run",
          [](const PyMeasurements& s) {
            py::array_t<std::int64_t> out(static_cast<py::ssize_t>(s.data().readings.size()));
            for (py::ssize_t i = 0; i < out.size(); ++i)
              out.mutable_at(i) =
                  static_cast<std::int64_t>(s.data().run_of(s.data().readings[static_cast<std::size_t>(i)]));
            return out;
          })
      .def_property_readonly("is_rotation",
                             [](const PyMeasurements& s) {
                               py::array_t<bool> out(static_cast<py::ssize_t>(s.data().readings.size()));
                               for (py::ssize_t i = 0; i < out.size(); ++i)
                                 out.mutable_at(i) =
                                     s.data().readings[static_cast<std::size_t>(i)].quantity ==
                                     Quantity::rotation;
                               return out;
                             })
      .def_property_readonly("value",
                             [](const PyMeasurements& s) {
                               return each_reading(s.data(), [](const diagnosis::Reading& r) {
                                 return in_micro(r.value, r.quantity);
                               });
                             })
      .def_property_readonly("u_random",
                             [](const PyMeasurements& s) {
                               return each_reading(s.data(), [](const diagnosis::Reading& r) {
                                 return in_micro(r.u_random, r.quantity);
                               });
                             })
      .def_property_readonly("n", &directions_of)
      .def_property_readonly("positions", &positions_of);
  py::class_<PyModel>(m, "Model")
      .def(py::init(&PyModel::load), py::arg("machine"), py::arg("file"))
      .def_static(
          "from_text",
          [](const PyMachine& machine, const std::string& text, const std::string& name) {
            return PyModel(machine, name, text);
          },
          py::arg("machine"), py::arg("text"), py::arg("name") = "")
      .def_property_readonly("file", &PyModel::file)
      .def_property_readonly("text", &PyModel::text)
      .def("save", &save, py::arg("file"))
      .def("deviations", &deviations_of, py::arg("positions"), py::arg("tool_length_mm") = py::none())
      .def("_values", [](const PyModel& s) { return report::model_json(s.read({}).first); });
  m.def("evaluate", &evaluate, py::arg("measurements"), py::arg("model"));
  m.def("fit", &fit, py::arg("measurements"), py::arg("model"), py::arg("robust") = true);
  m.def("diagnose", &diagnose, py::arg("measurements"), py::arg("model"), py::arg("also") = py::none());
}

}  // namespace trunnion::python
