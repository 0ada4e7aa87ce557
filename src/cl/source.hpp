#pragma once
#include <string_view>

#include "trunnion/cl/reader.hpp"

namespace trunnion::cl {

/// Text that is in memory already.
class MemorySource final : public TextSource {
 public:
  explicit MemorySource(std::string_view text) : text_(text) {}
  Result<std::size_t> read(char* buffer, std::size_t capacity) override;

 private:
  std::string_view text_;
  std::size_t offset_ = 0;
};

}  // namespace trunnion::cl
