#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace trunnion {

/// The name that `word` was probably meant to be: fewest letters inserted, left out, changed or swapped with
/// their neighbour, at most a third of the word's (one in a word of three), small and capital letters alike.
/// Empty where there is none.
std::string nearest_name(std::string_view word, const std::vector<std::string>& names);

/// "; did you mean 'post'?", or nothing.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& names);

}  // namespace trunnion
