#pragma once

namespace trunnion::config {

/// Larger numbers are refused wherever a file has them: from here on not every whole number is a double
/// (2^53), and nothing that is measured or set on a machine is as large.
inline constexpr double kLargestNumber = 9007199254740992.0;

}  // namespace trunnion::config
