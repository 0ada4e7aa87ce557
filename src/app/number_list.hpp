#pragma once
#include <string>
#include <vector>

#include "trunnion/base/result.hpp"

namespace trunnion::app {

/// As many numbers as `names` has, with commas between them, else "--ball-mm: '1,2' is not X,Y,Z: 3 numbers,
/// mm".
Result<std::vector<double>> numbers_of(const std::string& option, const std::string& text,
                                       const std::string& names, const std::string& unit = "mm");

}  // namespace trunnion::app
