#pragma once
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "trunnion/cl/reader.hpp"

namespace trunnion::test {

/// CL or NC text from memory.
class TextOf final : public cl::TextSource {
 public:
  explicit TextOf(std::string text) : text_(std::move(text)) {}
  Result<std::size_t> read(char* buffer, std::size_t capacity) override {
    const std::size_t n = std::min(capacity, text_.size() - at_);
    std::memcpy(buffer, text_.data() + at_, n);
    at_ += n;
    return n;
  }

 private:
  std::string text_;
  std::size_t at_ = 0;
};

}  // namespace trunnion::test
