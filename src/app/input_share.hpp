#pragma once
#include <optional>
#include <string>

namespace trunnion::app {

/// How much of `file`, which this process has open, was read so far: 0 to 1. The system knows, so that nobody
/// on the way from the file to the program has to count. Nothing where it is not open, empty or no file.
std::optional<double> share_read(const std::string& file);

}  // namespace trunnion::app
