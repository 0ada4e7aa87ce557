#include "nc/control/templates.hpp"

#include <algorithm>

#include "trunnion/base/contract.hpp"

namespace trunnion::nc {
namespace {

constexpr std::array<std::string_view, kPlaceholders> kNames = {"tool",
                                                                "length_offset",
                                                                "rpm",
                                                                "seconds",
                                                                "milliseconds",
                                                                "number",
                                                                "name",
                                                                "tolerance",
                                                                "x",
                                                                "y",
                                                                "z",
                                                                "a",
                                                                "b",
                                                                "c",
                                                                "index",
                                                                "clamp",
                                                                "step",
                                                                "dead_band",
                                                                "channel",
                                                                "target",
                                                                "measured",
                                                                "temperature",
                                                                "reference",
                                                                "factor",
                                                                "i",
                                                                "j",
                                                                "bottom",
                                                                "clear",
                                                                "depth",
                                                                "back",
                                                                "rise",
                                                                "feed",
                                                                "position",
                                                                "axis",
                                                                "distance",
                                                                "direction",
                                                                "pitch",
                                                                "lead",
                                                                "dx",
                                                                "dy",
                                                                "dz"};

}  // namespace

std::string_view name_of(Placeholder placeholder) {
  return kNames[static_cast<std::size_t>(placeholder)];
}

std::optional<Placeholder> placeholder_of(std::string_view name) {
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (kNames[i] == name) return static_cast<Placeholder>(i);
  }
  return std::nullopt;
}

TemplatePiece next_piece(std::string_view& rest, std::string& fault) {
  const auto open = rest.find('{');
  TemplatePiece piece{rest.substr(0, open), std::nullopt};
  if (open == std::string_view::npos) {
    rest = {};
    return piece;
  }
  const auto close = rest.find('}', open);
  if (close == std::string_view::npos) {
    fault = "'{' without '}'";
    rest = {};
    return piece;
  }
  const auto name = rest.substr(open + 1, close - open - 1);
  piece.placeholder = placeholder_of(name);
  if (!piece.placeholder) fault = "unknown placeholder {" + std::string(name) + "}";
  rest.remove_prefix(close + 1);
  return piece;
}

bool holds(const Template& lines, Placeholder placeholder) {
  return holds(lines, name_of(placeholder));
}

bool holds(const Template& lines, std::string_view name) {
  const std::string text = "{" + std::string(name) + "}";
  return std::any_of(lines.begin(), lines.end(),
                     [&](const auto& line) { return line.find(text) != std::string::npos; });
}

std::string render(std::string_view line, const Values& values) {
  std::string out;
  std::string fault;
  while (!line.empty()) {
    const auto piece = next_piece(line, fault);
    out += piece.text;
    if (piece.placeholder) out += values[*piece.placeholder];
  }
  TRUNNION_EXPECTS(fault.empty());
  return out;
}

}  // namespace trunnion::nc
