#pragma once
#include <chrono>
#include <exception>
#include <future>
#include <memory>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"

namespace trunnion::python {

namespace py = pybind11;

/// What becomes a Python exception: its text is what the program prints, one line a finding.
class Refused : public std::exception {
 public:
  Refused(ErrorCode code, std::string text) : code_(code), text_(std::move(text)) {}
  ErrorCode code() const { return code_; }
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  ErrorCode code_;
  std::string text_;
};

/// Throws Refused: the findings of a stage that failed, and `error` where it is not one of them.
[[noreturn]] void refuse(const Diagnostics& diagnostics, const Error& error);
/// The value, or Refused.
template <class T>
T taken(Result<T> result, const Diagnostics& diagnostics) {
  if (!result) refuse(diagnostics, result.error());
  return std::move(*result);
}

/// Python's own warnings of all warnings in `diagnostics`. With the GIL.
void warn_of(const Diagnostics& diagnostics);

/// Keeps a thread whose result nobody waits for any more; `wait_for_abandoned` (when Python ends) waits for
/// those.
void abandon(std::thread thread);
void wait_for_abandoned();

/// Does `work` in a thread of its own, without the GIL. Ctrl-C raises KeyboardInterrupt at once; the work
/// goes on until it is done, and its result is dropped: `work` owns what it uses.
template <class Work>
std::invoke_result_t<Work> interruptible(Work work) {
  constexpr std::chrono::milliseconds kStep(50);
  using T = std::invoke_result_t<Work>;
  std::packaged_task<T()> task(std::move(work));
  std::future<T> result = task.get_future();
  std::thread thread(std::move(task));
  for (;;) {
    {
      const py::gil_scoped_release release;
      if (result.wait_for(kStep) == std::future_status::ready) break;
    }
    if (PyErr_CheckSignals() != 0) {
      abandon(std::move(thread));
      throw py::error_already_set();
    }
  }
  thread.join();
  return result.get();
}

/// Rows of `columns` numbers, whatever the dimensions before them.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
/// Throws Refused (wrong_use) unless the last dimension of `numbers` is `columns`.
void need_columns(const Numbers& numbers, std::size_t columns, const std::string& what);
/// An array with the dimensions of `like`, but for the last one, which becomes `columns`.
Numbers array_like(const Numbers& like, const std::vector<std::size_t>& columns);
inline std::size_t rows_of(const Numbers& numbers, std::size_t columns) {
  return static_cast<std::size_t>(numbers.size()) / columns;
}

/// Translates Refused, and everything else that the program ends with, to the exceptions of trunnion.errors.
void register_exceptions();

void add_machine(py::module_& m);
void add_programs(py::module_& m);
void add_models(py::module_& m);

}  // namespace trunnion::python
