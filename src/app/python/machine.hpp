#pragma once
#include <memory>
#include <string>
#include <utility>

#include "app/options.hpp"
#include "app/python/calls.hpp"

namespace trunnion::python {

/// A machine file with its controller, as Python holds it.
class PyMachine {
 public:
  PyMachine(const std::string& file, const std::string& controller);

  const Machine& machine() const { return files_->machine; }
  const nc::Controller& controller() const { return files_->controller; }
  std::shared_ptr<const app::MachineFiles> files() const { return files_; }
  /// For work that outlives the Python object.
  std::shared_ptr<const Machine> shared() const { return {files_, &files_->machine}; }
  /// As the command line is given them: so the program finds the same files.
  const std::string& machine_word() const { return words_.first; }
  const std::string& controller_word() const { return words_.second; }

 private:
  std::pair<std::string, std::string> words_;
  std::shared_ptr<const app::MachineFiles> files_;
};

/// One row of positions in the order of the machine's axes: mm and degrees there, mm and rad here.
JointVector joints_of(const Machine& machine, const double* row);
void put_joints(const Machine& machine, const JointVector& q, double* row);

}  // namespace trunnion::python
