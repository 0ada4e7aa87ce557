#pragma once
#include <exception>
#include <optional>
#include <utility>

#include "trunnion/base/result.hpp"

namespace trunnion {

/// An error thrown out of loops whose functions give plain numbers (a formula that gives none at some place);
/// caught where a file or the command ends.
class Failure : public std::exception {
 public:
  explicit Failure(Error error) : error_(std::move(error)), text_(error_.text()) {}
  const Error& error() const { return error_; }
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  Error error_;
  std::string text_;
};

/// What the exception means for the user: that of a Failure, io_failed where the system refused memory, a
/// thread or a file; nothing for a defect of the program.
std::optional<Error> error_of(const std::exception& exception);

}  // namespace trunnion
