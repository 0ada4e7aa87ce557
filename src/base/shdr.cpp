#include "trunnion/base/shdr.hpp"

#include <cctype>

#include "trunnion/base/field_text.hpp"
#include "trunnion/base/number_text.hpp"

namespace trunnion {
namespace {

ShdrLine command(std::string_view words) {
  constexpr std::string_view kPong = "PONG";
  ShdrLine out;
  if (!words.starts_with(kPong)) return out;
  const auto ms = parse_number(trimmed(words.substr(kPong.size())));
  constexpr double kSecondsPerMs = 1e-3;
  out.heartbeat_s = ms && ms.value > 0.0 ? ms.value * kSecondsPerMs : 10.0;  // 10 s where it says none
  return out;
}

}  // namespace

bool is_shdr(std::string_view line) {
  const std::string_view text = trimmed(line);
  if (text.empty() || text.front() == '{' || text.front() == '<') return false;
  return text.front() == '*' || text.find('|') != std::string_view::npos;
}

Result<ShdrLine> parse_shdr_line(std::string_view line) {
  std::string_view rest = trimmed(line);
  if (!rest.empty() && rest.front() == '*') return command(trimmed(rest.substr(1)));
  const auto next = [&rest] {
    const auto bar = rest.find('|');
    const std::string_view field = trimmed(rest.substr(0, bar));
    rest = bar == std::string_view::npos ? std::string_view() : rest.substr(bar + 1);
    return field;
  };
  const bool data = rest.find('|') != std::string_view::npos;
  const std::string_view time = next();
  // A calendar time, or a number of the adapter's own clock, which may be 0 at a trigger.
  const std::string_view digits = time.starts_with('-') ? time.substr(1) : time;
  const bool no_time = digits.empty() || std::isdigit(static_cast<unsigned char>(digits.front())) == 0;
  if (!data || (!time.empty() && no_time))
    return fail(ErrorCode::wrong_input, "a line of an adapter is time|item|value..., this begins with '" +
                                            std::string(time.substr(0, 40)) + "'");
  ShdrLine out;
  out.time = time;
  while (!rest.empty()) {
    const std::string_view item = next();
    if (item.starts_with('@')) return out;  // an asset: the rest is XML
    const std::string_view value = next();
    if (!item.empty()) out.values.push_back({std::string(item), std::string(value)});
  }
  return out;
}

}  // namespace trunnion
