#include "app/number_list.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "trunnion/base/number_text.hpp"

#include "app/support.hpp"

namespace trunnion::app {

Result<std::vector<double>> numbers_of(const std::string& option, const std::string& text,
                                       const std::string& names, const std::string& unit) {
  const auto wanted = static_cast<std::size_t>(std::count(names.begin(), names.end(), ',')) + 1;
  std::istringstream fields(text);
  std::vector<double> numbers;
  for (std::string field; std::getline(fields, field, ',');) {
    const auto number = parse_number(field);
    if (!number || std::abs(number.value) > kLargestOption) numbers.clear();
    if (!number) break;
    numbers.push_back(number.value);
  }
  if (numbers.size() != wanted)
    return fail(ErrorCode::wrong_use, option + ": '" + text + "' is not " + names + ": " +
                                          std::to_string(wanted) + " numbers, " + unit);
  return numbers;
}

}  // namespace trunnion::app
