#include <algorithm>
#include <map>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/texts.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/iso230_lines.hpp"

namespace trunnion::iso230 {
namespace {

// `REF_DATA_FWD[3,2]` -> name and indices (second one 0 when absent).
struct Key {
  std::string_view name;
  std::uint64_t i = 0, j = 0;
};

std::optional<Key> parse_key(std::string_view text) {
  const auto open = text.find('[');
  if (open == std::string_view::npos || !text.ends_with(']')) return std::nullopt;
  const std::string_view inside = text.substr(open + 1, text.size() - open - 2);
  const auto comma = inside.find(',');
  const auto i = parse_integer(trim(inside.substr(0, comma)));
  const auto j = comma == std::string_view::npos ? std::optional<std::uint64_t>(0)
                                                 : parse_integer(trim(inside.substr(comma + 1)));
  if (!i || !j) return std::nullopt;
  return Key{trim(text.substr(0, open)), *i, *j};
}

using Series =
    std::map<std::uint64_t, std::map<std::uint64_t, double>>;  // target number -> cycle -> position

}  // namespace

bool is_motion_log(std::string_view text) {
  return text.find("TGT_DATA[") != std::string_view::npos;
}

Result<LineTest> parse_motion_log(std::string_view text, const std::string& file, const std::string& name,
                                  Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.error_count();
  std::map<std::uint64_t, double> targets;
  Series forward, backward;
  double factor = 1.0;  // to mm or rad
  bool rotary = false;
  for (std::uint32_t number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    const std::string_view line = trim(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const auto equals = line.find('=');
    if (line.starts_with('#') || equals == std::string_view::npos) continue;
    const std::string_view left = trim(line.substr(0, equals)), right = trim(line.substr(equals + 1));
    if (left == "UNIT") {
      rotary = right == "deg";
      factor = rotary ? kRadPerDegree : 1.0;
      if (right != "mm" && right != "deg")
        diagnostics.error(file, {number, 1}, "UNIT is '" + std::string(right) + "', expected mm or deg");
      continue;
    }
    const auto key = parse_key(left);
    if (!key || (key->name != "TGT_DATA" && key->name != "REF_DATA_FWD" && key->name != "REF_DATA_BWD"))
      continue;
    const ParsedNumber value = parse_number(right);
    if (!value) {
      diagnostics.error(file, {number, static_cast<std::uint32_t>(equals + 2)},
                        "'" + std::string(right) + "' is not a number");
      continue;
    }
    if (key->name == "TGT_DATA")
      targets[key->i] = value.value;
    else
      (key->name == "REF_DATA_FWD" ? forward : backward)[key->i][key->j] = value.value;
  }
  for (const Series* series : {&forward, &backward})
    for (const auto& [i, runs] : *series)
      if (!targets.contains(i))
        diagnostics.error(file, {}, "target " + std::to_string(i) + " has readings but no TGT_DATA");
  if (targets.empty()) diagnostics.error(file, {}, "no TGT_DATA: not a positioning test");
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());

  std::vector<std::pair<double, std::uint64_t>> order;
  order.reserve(targets.size());
  for (const auto& [i, target] : targets) order.emplace_back(target, i);
  std::sort(order.begin(), order.end());
  LineTest test;
  test.name = name;
  test.rotary = rotary;
  for (const auto& [target, i] : order) {
    test.target.push_back(target * factor);
    const auto deviations = [&, target = target, i = i](const Series& series) {
      std::vector<double> out;
      if (const auto it = series.find(i); it != series.end())
        for (const auto& [j, position] : it->second) out.push_back((position - target) * factor);
      return out;
    };
    if (!forward.empty()) test.up.push_back(deviations(forward));
    if (!backward.empty()) test.down.push_back(deviations(backward));
  }
  return test;
}

}  // namespace trunnion::iso230
