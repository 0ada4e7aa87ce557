#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/nc/controller.hpp"

namespace trunnion::nc {

/// What may stand in braces in the templates of a controller file.
enum class Placeholder : std::uint8_t {
  tool,
  length_offset,
  rpm,
  seconds,
  milliseconds,
  number,
  name,
  tolerance,
  x,
  y,
  z,
  a,
  b,
  c,
  index,
  clamp,
  step,
  dead_band,
  channel,
  target,
  measured,
  temperature,
  reference,
  factor,
  i,
  j,
  bottom,
  clear,
  depth,
  back,
  rise,
  feed,
  position,
  axis,
  distance,
  direction,
  pitch,
  lead,
  dx,
  dy,
  dz
};
inline constexpr std::size_t kPlaceholders = 41;  // bits of Captures::mask
inline constexpr std::array kPlaceXyz = {Placeholder::x, Placeholder::y, Placeholder::z};
inline constexpr std::array kWayXyz = {Placeholder::dx, Placeholder::dy, Placeholder::dz};
inline constexpr std::array kAnglesAbc = {Placeholder::a, Placeholder::b, Placeholder::c};

std::string_view name_of(Placeholder placeholder);
std::optional<Placeholder> placeholder_of(std::string_view name);

/// Texts for the placeholders of one line.
class Values {
 public:
  Values& set(Placeholder placeholder, std::string text) {
    text_[static_cast<std::size_t>(placeholder)] = std::move(text);
    return *this;
  }
  const std::string& operator[](Placeholder placeholder) const {
    return text_[static_cast<std::size_t>(placeholder)];
  }

 private:
  std::array<std::string, kPlaceholders> text_;
};

/// One piece of a template line: text up to `{`, then the placeholder (if any).
struct TemplatePiece {
  std::string_view text;
  std::optional<Placeholder> placeholder;
};

/// Takes the next piece off `rest`. An unknown placeholder or an open brace ends with `fault` naming it.
TemplatePiece next_piece(std::string_view& rest, std::string& fault);

/// One of the lines has the placeholder.
bool holds(const Template& lines, Placeholder placeholder);

/// `line` with its placeholders replaced. The controller reader has checked the line.
std::string render(std::string_view line, const Values& values);

}  // namespace trunnion::nc
