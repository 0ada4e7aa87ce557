#pragma once
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "report/svg.hpp"

/// Short texts of the pages.
namespace trunnion::report {

/// Micrometres below a millimetre, millimetres from there on.
inline std::string um_text(double value) {
  constexpr double kUmPerMillimetre = 1e3;
  return std::abs(value) < kUmPerMillimetre ? short_number(value, 3) + " µm"
                                            : short_number(value / kUmPerMillimetre, 3) + " mm";
}

/// "–" for what is not known.
inline std::string optional_text(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? short_number(*value, 3) : "–";
}

inline std::string joined(const std::vector<std::string>& parts, const char* between) {
  std::string out;
  for (const auto& part : parts) {
    if (!out.empty()) out += between;
    out += part;
  }
  return out;
}

}  // namespace trunnion::report
