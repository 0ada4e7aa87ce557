#include <pybind11/stl.h>

#include "app/options.hpp"
#include "app/python/calls.hpp"

PYBIND11_MODULE(_trunnion, m) {
  using namespace trunnion;
  m.doc() = "What trunnion's program does, on numpy arrays and texts: see the package `trunnion`.";
  m.attr("__version__") = TRUNNION_VERSION;
  python::register_exceptions();
  python::add_machine(m);
  python::add_programs(m);
  python::add_models(m);
  m.def(
      "machines", [] { return app::shipped_names("machines"); }, "Names of the machines that ship.");
  m.def(
      "controllers", [] { return app::shipped_names("controllers"); }, "Names of the controllers that ship.");
  m.def("wait_for_abandoned", &python::wait_for_abandoned,
        "Waits for work whose result Ctrl-C dropped: its threads must not outlive the module.");
}
