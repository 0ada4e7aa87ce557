#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace trunnion::post {

/// A name that every control takes: letters, digits, _ and -, at most 24 of them; empty where nothing of the
/// text is left.
std::string name_for_control(std::string_view text);

/// The number that the digits of a name make, 1 to 9999 (the longest group, the first of equal ones); 1 where
/// there is none.
std::int64_t number_in_name(std::string_view name);

}  // namespace trunnion::post
