#pragma once
#include <algorithm>
#include <cstddef>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trunnion::test {

/// One of the stops of a program left out: nothing where it has none.
inline std::string without_a_stop(const std::string& nc, std::mt19937_64& random) {
  std::vector<std::pair<std::size_t, std::size_t>> stops;  // lines, by where they begin and end
  for (std::size_t begin = 0; begin < nc.size();) {
    const std::size_t end = std::min(nc.find('\n', begin), nc.size() - 1) + 1;
    const std::string_view line(nc.data() + begin, end - begin);
    const std::size_t word = line.find_last_of(' ');
    const std::string_view last = line.substr(word == std::string_view::npos ? 0 : word + 1);
    if (last == "M1\n" || last == "M0\n") stops.emplace_back(begin, end);
    begin = end;
  }
  if (stops.empty()) return {};
  const auto [begin, end] = stops[random() % stops.size()];
  return nc.substr(0, begin) + nc.substr(end);
}

}  // namespace trunnion::test
