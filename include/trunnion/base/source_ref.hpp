#pragma once
#include <cstdint>

namespace trunnion {

/// Place in a text file: line and column count from 1; 0 means "not known". The name of the file stands once,
/// in what holds the records (a million path points carry a SourceRef each). Travels from the CL line to the
/// NC block and into every message.
struct SourceRef {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
  bool operator==(const SourceRef&) const = default;
};

}  // namespace trunnion
