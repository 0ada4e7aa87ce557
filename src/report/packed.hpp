#pragma once
#include <string>
#include <string_view>
#include <vector>

/// Bytes as text that a page can hold: deflated (zlib, RFC 1950) and in base64. The page's script undoes it.
namespace trunnion::report {

std::string base64(const void* data, std::size_t bytes);

std::string packed(std::string_view bytes);

/// Whole multiples of `step`: differences of neighbours as 32-bit integers, their bytes sorted by weight,
/// packed. A value that is no number becomes the smallest integer.
std::string packed(const std::vector<double>& values, double step);

}  // namespace trunnion::report
