#include "trunnion/base/printable.hpp"

#include <algorithm>
#include <cstdint>

namespace trunnion {
namespace {

struct CodePoint {
  std::uint32_t value = 0;
  std::size_t length = 0;  // bytes; 0: these are no UTF-8
};

CodePoint first_of(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byte(0);
  if (lead < 0x80) return {lead, 1};
  const std::size_t length = lead < 0xc2 ? 0 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : lead < 0xf5 ? 4 : 0;
  if (length == 0 || text.size() < length) return {};
  std::uint32_t value = lead & (0xffU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0U) != 0x80) return {};
    value = value << 6U | (byte(i) & 0x3fU);
  }
  const bool shortest = value >= (length == 2 ? 0x80U : length == 3 ? 0x800U : 0x10000U);
  const bool exists = value <= 0x10ffff && (value < 0xd800 || value > 0xdfff);
  return shortest && exists ? CodePoint{value, length} : CodePoint{};
}

bool acts(std::uint32_t c) {
  const bool control = c < 0x20 || (c >= 0x7f && c < 0xa0);
  const bool separates_lines = c == 0x2028 || c == 0x2029;
  const bool turns = c == 0x61c || c == 0x200e || c == 0x200f || (c >= 0x202a && c <= 0x202e) ||
                     (c >= 0x2066 && c <= 0x2069);
  return control || separates_lines || turns;
}

std::string hexadecimal(std::uint32_t value, int digits) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string out;
  for (int i = digits - 1; i >= 0; --i) out += kDigits[(value >> (4 * i)) & 0xfU];
  return out;
}

}  // namespace

std::string printable_json(std::string_view json) {
  std::string out;
  out.reserve(json.size());
  while (!json.empty()) {
    const CodePoint c = first_of(json);
    const std::size_t length = std::max<std::size_t>(1, c.length);
    if (c.length > 0 && c.value >= 0x7f && acts(c.value))
      out.append("\\u").append(hexadecimal(c.value, 4));
    else
      out.append(json.substr(0, length));
    json.remove_prefix(length);
  }
  return out;
}

std::string printable(std::string_view text, std::string_view kept) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const CodePoint c = first_of(text);
    const std::size_t length = std::max<std::size_t>(1, c.length);
    if (c.length == 0) {
      out += "\\x" + hexadecimal(static_cast<unsigned char>(text[0]), 2);
    } else if (!acts(c.value) || (c.length == 1 && kept.find(text[0]) != std::string_view::npos)) {
      out += text.substr(0, length);
    } else {
      out += c.value < 0x100 ? "\\x" + hexadecimal(c.value, 2) : "\\u" + hexadecimal(c.value, 4);
    }
    text.remove_prefix(length);
  }
  return out;
}

}  // namespace trunnion
