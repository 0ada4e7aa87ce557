#include <algorithm>
#include <cmath>

#include "trunnion/report/page.hpp"

namespace trunnion::report {

std::vector<std::size_t> thinned(const std::vector<double>& values, std::size_t most) {
  const std::size_t n = values.size();
  std::vector<std::size_t> out;
  if (n <= most || most < 4) {
    for (std::size_t i = 0; i < n; ++i) out.push_back(i);
    return out;
  }
  // Of every stretch the first, the smallest, the largest, and a gap if it holds one.
  const std::size_t stretches = std::max<std::size_t>(most / 3, 1);
  for (std::size_t s = 0; s < stretches; ++s) {
    const std::size_t begin = s * n / stretches;
    const std::size_t end = (s + 1) * n / stretches;
    std::size_t low = begin;
    std::size_t high = begin;
    std::size_t gap = end;
    for (std::size_t i = begin; i < end; ++i) {
      if (!std::isfinite(values[i])) {
        gap = std::min(gap, i);
        continue;
      }
      if (!std::isfinite(values[low]) || values[i] < values[low]) low = i;
      if (!std::isfinite(values[high]) || values[i] > values[high]) high = i;
    }
    std::array<std::size_t, 4> kept = {begin, low, high, gap};
    std::sort(kept.begin(), kept.end());
    for (const std::size_t i : kept) {
      if (i < end && (out.empty() || out.back() < i)) out.push_back(i);
    }
  }
  if (out.back() != n - 1) out.push_back(n - 1);
  return out;
}

}  // namespace trunnion::report
