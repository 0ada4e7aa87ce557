#include "app/python/calls.hpp"

#include <algorithm>

#include "trunnion/base/failure.hpp"
#include "trunnion/base/printable.hpp"

namespace trunnion::python {
namespace {

std::vector<std::thread>& abandoned() {
  static std::vector<std::thread> threads;  // touched with the GIL only
  return threads;
}

void raise(ErrorCode code, const std::string& text) {
  const py::object error =
      py::module_::import("trunnion.errors").attr("error_of")(static_cast<int>(code), printable(text, "\n"));
  PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(error.ptr())), error.ptr());
}

}  // namespace

void refuse(const Diagnostics& diagnostics, const Error& error) {
  std::string text;
  bool said = false;
  for (const Finding& finding : diagnostics.findings()) {
    if (finding.severity != Severity::error) continue;
    text += (text.empty() ? "" : "\n") + finding.text();
    said = said || finding.text() == error.text();
  }
  if (!said) text += (text.empty() ? "" : "\n") + error.text();
  throw Refused(error.code, text);
}

void warn_of(const Diagnostics& diagnostics) {
  const py::object kind = py::module_::import("trunnion.errors").attr("Warning");
  for (const Finding& finding : diagnostics.findings()) {
    if (finding.severity != Severity::warning) continue;
    if (PyErr_WarnEx(kind.ptr(), printable(finding.text(), "\n").c_str(), 2) != 0)
      throw py::error_already_set();
  }
}

void abandon(std::thread thread) {
  abandoned().push_back(std::move(thread));
}

void wait_for_abandoned() {
  std::vector<std::thread> threads = std::move(abandoned());
  const py::gil_scoped_release release;
  for (std::thread& thread : threads) thread.join();
}

void need_columns(const Numbers& numbers, std::size_t columns, const std::string& what) {
  if (numbers.ndim() > 0 && static_cast<std::size_t>(numbers.shape(numbers.ndim() - 1)) == columns) return;
  const std::string has = numbers.ndim() == 0
                              ? "one number"
                              : std::to_string(numbers.shape(numbers.ndim() - 1)) + " in the last dimension";
  throw Refused(ErrorCode::wrong_use,
                "error: " + what + ": " + std::to_string(columns) + " numbers a row, not " + has);
}

Numbers array_like(const Numbers& like, const std::vector<std::size_t>& columns) {
  std::vector<py::ssize_t> shape(like.shape(), like.shape() + like.ndim() - 1);
  for (const std::size_t n : columns) shape.push_back(static_cast<py::ssize_t>(n));
  return Numbers(shape);
}

void register_exceptions() {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Refused& refused) {
      raise(refused.code(), refused.what());
    } catch (const py::error_already_set&) {
      throw;
    } catch (const py::builtin_exception&) {
      throw;
    } catch (const std::exception& e) {
      if (const auto error = error_of(e)) return raise(error->code, error->text());
      raise(ErrorCode::defect, std::string("defect of the program: ") + e.what());
    }
  });
}

}  // namespace trunnion::python
