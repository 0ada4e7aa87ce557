#include "post/making/program_name.hpp"

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {
namespace {

constexpr std::size_t kLongestName = 24;
constexpr std::uint64_t kLargestNumber = 9999;

bool is_decimal_digit(char c) {
  return c >= '0' && c <= '9';
}

bool stays_in_name(char c) {
  return is_decimal_digit(c) || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '-';
}

}  // namespace

std::string name_for_control(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (stays_in_name(c))
      out += c;
    else if (!out.empty() && out.back() != '_')
      out += '_';
    if (out.size() == kLongestName) break;
  }
  while (!out.empty() && out.back() == '_') out.pop_back();
  return out;
}

std::int64_t number_in_name(std::string_view name) {
  std::string_view longest;
  for (std::size_t i = 0; i < name.size();) {
    std::size_t end = i;
    while (end < name.size() && is_decimal_digit(name[end])) ++end;
    if (end - i > longest.size()) longest = name.substr(i, end - i);
    i = end + 1;
  }
  const auto number = parse_integer(longest);
  return number && *number >= 1 && *number <= kLargestNumber ? static_cast<std::int64_t>(*number) : 1;
}

}  // namespace trunnion::post
