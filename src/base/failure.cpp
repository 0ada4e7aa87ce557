#include "trunnion/base/failure.hpp"

#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

namespace trunnion {

std::optional<Error> error_of(const std::exception& exception) {
  if (const auto* failure = dynamic_cast<const Failure*>(&exception)) return failure->error();
  const bool no_memory = dynamic_cast<const std::bad_alloc*>(&exception) != nullptr ||
                         dynamic_cast<const std::length_error*>(&exception) != nullptr;
  if (no_memory) return Error{ErrorCode::io_failed, "not enough memory", {}, {}};
  // The library for threads says it in words alone: "pthread_create has failed: ...".
  if (dynamic_cast<const std::system_error*>(&exception) != nullptr ||
      std::string_view(exception.what()).starts_with("pthread_create"))
    return Error{ErrorCode::io_failed, std::string("the system refuses: ") + exception.what(), {}, {}};
  return std::nullopt;
}

}  // namespace trunnion
