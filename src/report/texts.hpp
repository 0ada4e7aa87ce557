#pragma once
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/base/texts.hpp"

#include "report/svg.hpp"

/// Short texts of the pages.
namespace trunnion::report {

/// Micrometres below a millimetre, millimetres from there on.
inline std::string um_text(double value) {
  constexpr double kUmPerMillimetre = 1e3;
  return std::abs(value) < kUmPerMillimetre ? short_number(value, 3) + " µm"
                                            : short_number(value / kUmPerMillimetre, 3) + " mm";
}

/// With a capital and a full stop.
inline std::string as_sentence(std::string text) {
  if (!text.empty() && text.front() >= 'a' && text.front() <= 'z')
    text.front() = static_cast<char>(text.front() - 'a' + 'A');
  return text.empty() || text.back() == '.' ? text : text + ".";
}

/// "–" for what is not known.
inline std::string optional_text(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? short_number(*value, 3) : "–";
}

}  // namespace trunnion::report
