#include "app/input_share.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace trunnion::app {

namespace fs = std::filesystem;

std::optional<double> share_read(const std::string& file) {
  std::error_code ec;
  const auto size = fs::file_size(file, ec);
  if (ec || size == 0) return std::nullopt;
  for (fs::directory_iterator it("/proc/self/fd", ec), end; !ec && it != end; it.increment(ec)) {
    std::error_code other;
    if (!fs::equivalent(it->path(), file, other) || other) continue;
    std::ifstream info("/proc/self/fdinfo/" + it->path().filename().string());
    std::string word;
    std::uintmax_t position = 0;
    if (info >> word >> position && word == "pos:")
      return std::min(1.0, static_cast<double>(position) / static_cast<double>(size));
  }
  return std::nullopt;
}

}  // namespace trunnion::app
