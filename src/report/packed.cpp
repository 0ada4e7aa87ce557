#include "report/packed.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>
#include <zlib.h>

#include "trunnion/base/contract.hpp"

namespace trunnion::report {

std::string base64(const void* data, std::size_t bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto* in = static_cast<const unsigned char*>(data);
  std::string out;
  out.reserve((bytes + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes; i += 3) {
    const std::size_t have = std::min<std::size_t>(3, bytes - i);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = (group << 8U) | (k < have ? in[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out += k <= have ? kDigits[(group >> (18U - 6U * static_cast<unsigned>(k))) & 63U] : '=';
  }
  return out;
}

std::string packed(std::string_view bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string out(size, '\0');
  const int done =
      compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                static_cast<uLong>(bytes.size()), 6);
  if (done == Z_MEM_ERROR) throw std::bad_alloc();
  TRUNNION_EXPECTS(done == Z_OK);
  return base64(out.data(), size);
}

std::string packed(const std::vector<double>& values, double step) {
  constexpr std::size_t kBytes = 4;
  constexpr double kLargest = std::numeric_limits<std::int32_t>::max();
  std::string planes(kBytes * values.size(), '\0');
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto whole =
        std::isfinite(values[i])
            ? static_cast<std::int32_t>(std::clamp(std::round(values[i] / step), -kLargest, kLargest))
            : std::numeric_limits<std::int32_t>::min();
    const auto bits = static_cast<std::uint32_t>(whole);
    std::uint32_t change = bits - last;  // modulo 2^32, as the script adds it up again
    last = bits;
    // Small changes of either sign have small numbers.
    change = (change << 1U) ^ (0U - (change >> 31U));
    for (std::size_t k = 0; k < kBytes; ++k)
      planes[k * values.size() + i] = static_cast<char>((change >> (8U * k)) & 255U);
  }
  return packed(planes);
}

}  // namespace trunnion::report
