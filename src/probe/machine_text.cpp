#include <algorithm>
#include <vector>

#include "trunnion/base/number_text.hpp"
#include "trunnion/config/value.hpp"
#include "trunnion/probe/calibration.hpp"

namespace trunnion::probe {
namespace {

struct Edit {
  std::size_t at, length;
  std::string text;
};

std::size_t offset_of(std::string_view text, SourceRef where) {
  std::size_t at = 0;
  for (std::uint32_t line = 1; line < where.line; ++line) {
    const auto end = text.find('\n', at);
    if (end == std::string_view::npos) return text.size();
    at = end + 1;
  }
  return at + (where.column > 0 ? where.column - 1 : 0);
}

// The array that begins at or behind `from`: numbers and remarks, no array within.
std::optional<Edit> array_at(std::string_view text, std::size_t from) {
  const auto open = text.find('[', from);
  if (open == std::string_view::npos) return std::nullopt;
  bool remark = false;
  for (std::size_t at = open; at < text.size(); ++at) {
    if (text[at] == '\n') remark = false;
    if (text[at] == '#') remark = true;
    if (text[at] == ']' && !remark) return Edit{open, at + 1 - open, {}};
  }
  return std::nullopt;
}

std::string array_text(const Vec3& v, int decimals) {
  std::string out = "[";
  for (int i = 0; i < 3; ++i) {
    std::string number = fixed_text(v[i], decimals);
    while (number.back() == '0') number.pop_back();
    if (number.back() == '.') number += '0';
    out += (i > 0 ? ", " : "") + number;
  }
  return out + "]";
}

}  // namespace

Result<std::string> machine_text_with_axes(std::string_view text, const std::string& file,
                                           const Machine& machine) {
  const auto root = config::parse_toml(text, file);
  if (!root) return tl::unexpected(root.error());
  const config::Value* axes = root->find("axis");
  std::vector<Edit> edits;
  for (const AxisId id : machine.rotary_axes()) {
    const Axis& axis = machine.axes[id];
    if (axes == nullptr || axes->as_array() == nullptr) break;
    for (const config::Value& table : *axes->as_array()) {
      const config::Value* name = table.find("name");
      if (name == nullptr || name->as_string() == nullptr || *name->as_string() != axis.name) continue;
      // A nanometre, and a nanometre a metre away.
      constexpr int kPoint = 6;
      constexpr int kDirection = 9;
      for (const auto& [key, value] :
           {std::pair<const char*, std::string>{"point_mm", array_text(axis.point_mm, kPoint)},
            std::pair<const char*, std::string>{"direction", array_text(axis.direction, kDirection)}}) {
        const config::Value* old = table.find(key);
        if (old == nullptr) continue;
        auto edit = array_at(text, offset_of(text, old->where));
        if (!edit) continue;
        edit->text = value;
        edits.push_back(std::move(*edit));
      }
    }
  }
  if (edits.size() != 2 * machine.rotary_axes().size())
    return fail(ErrorCode::wrong_input, "not every rotary axis has its 'point_mm' and 'direction' as arrays",
                file);
  std::sort(edits.begin(), edits.end(), [](const Edit& a, const Edit& b) { return a.at > b.at; });
  std::string out(text);
  for (const Edit& edit : edits) out.replace(edit.at, edit.length, edit.text);
  return out;
}

}  // namespace trunnion::probe
