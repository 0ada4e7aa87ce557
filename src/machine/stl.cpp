#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <set>

#include "trunnion/machine/body_meshes.hpp"

namespace trunnion {
namespace {

// Binary: 80 bytes that anything may stand in, the count, and of each triangle a normal, three corners (all
// float32, little-endian) and two bytes.
constexpr std::size_t kHead = 84;
constexpr std::size_t kRecord = 50;
constexpr std::size_t kNormal = 12;
constexpr std::size_t kMostTriangles = 2'000'000;

std::size_t count_of(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kHead - sizeof count, sizeof count);
  return count;
}

bool is_finite(const std::array<float, 3>& corner) {
  return std::all_of(corner.begin(), corner.end(), [](float v) { return std::isfinite(v); });
}

Result<Triangles> parse_binary(std::string_view bytes, const std::string& file) {
  const std::size_t count = count_of(bytes);
  Triangles out;
  out.reserve(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const char* record = bytes.data() + kHead + i * kRecord + kNormal;
    for (std::size_t k = 0; k < 3; ++k) {
      std::array<float, 3> corner{};
      std::memcpy(corner.data(), record + k * sizeof corner, sizeof corner);
      if (!is_finite(corner))
        return fail(ErrorCode::wrong_input,
                    "triangle " + std::to_string(i + 1) + " has a corner that is no number", file);
      out.push_back(corner);
    }
  }
  return out;
}

// Words of a text with their lines.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}
  std::string_view next() {
    while (at_ < text_.size() && is_space(text_[at_])) line_ += text_[at_++] == '\n' ? 1U : 0U;
    const std::size_t from = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    return text_.substr(from, at_ - from);
  }
  std::uint32_t line() const { return line_; }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  std::string_view text_;
  std::size_t at_ = 0;
  std::uint32_t line_ = 1;
};

Result<Triangles> parse_text(std::string_view text, const std::string& file) {
  Triangles out;
  Words words(text);
  std::size_t of_facet = 0;
  const auto wrong = [&](const std::string& what) {
    return fail(ErrorCode::wrong_input, what, file, SourceRef{words.line(), 1});
  };
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (word == "endfacet") {
      if (of_facet != 3) return wrong("a facet of " + std::to_string(of_facet) + " corners; STL has three");
      of_facet = 0;
    }
    if (word != "vertex") continue;
    std::array<float, 3> corner{};
    for (float& v : corner) {
      std::string_view number = words.next();
      if (number.starts_with('+')) number.remove_prefix(1);
      const auto [end, code] = std::from_chars(number.data(), number.data() + number.size(), v);
      if (number.empty() || code != std::errc() || end != number.data() + number.size() || !std::isfinite(v))
        return wrong("'" + std::string(number.substr(0, 20)) + "' is no coordinate");
    }
    ++of_facet;
    out.push_back(corner);
    if (out.size() > 3 * kMostTriangles) return wrong("more than 2000000 triangles");
  }
  if (of_facet != 0) return wrong("the file ends within a facet");
  return out;
}

}  // namespace

Result<Triangles> parse_stl(std::string_view bytes, const std::string& file) {
  // A text begins with "solid"; so do some binary files, whose length tells them.
  const bool exact = bytes.size() >= kHead && bytes.size() == kHead + kRecord * count_of(bytes);
  if (!exact && !bytes.starts_with("solid")) {
    if (bytes.size() < kHead)
      return fail(ErrorCode::wrong_input, "this is no STL file: " + std::to_string(bytes.size()) + " bytes",
                  file);
    return fail(ErrorCode::wrong_input,
                "this is no STL file, or it is cut short: " + std::to_string(bytes.size()) + " bytes, and " +
                    std::to_string(count_of(bytes)) + " triangles would be " +
                    std::to_string(kHead + kRecord * count_of(bytes)),
                file);
  }
  if (exact && count_of(bytes) > kMostTriangles)
    return fail(ErrorCode::wrong_input, std::to_string(count_of(bytes)) + " triangles; at most 2000000",
                file);
  auto out = exact ? parse_binary(bytes, file) : parse_text(bytes, file);
  if (out && out->empty()) return fail(ErrorCode::wrong_input, "no triangle in this STL file", file);
  return out;
}

Triangles coarsened(const Triangles& corners, std::size_t most) {
  if (corners.size() <= 3 * most) return corners;
  float size = 0.0F;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto by = [k](const auto& a, const auto& b) { return a[k] < b[k]; };
    const auto [low, high] = std::minmax_element(corners.begin(), corners.end(), by);
    size = std::max(size, (*high)[k] - (*low)[k]);
  }
  constexpr float kFinest = 2048.0F;  // cells along the longest edge
  constexpr float kCoarser = 1.3F;
  Triangles out = corners;
  for (float cell = size / kFinest; out.size() > 3 * most && cell < size; cell *= kCoarser) {
    out.clear();
    std::set<std::array<std::array<float, 3>, 3>> seen;
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
      std::array<std::array<float, 3>, 3> moved{};
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t d = 0; d < 3; ++d) moved[k][d] = cell * std::round(corners[i + k][d] / cell);
      if (moved[0] == moved[1] || moved[1] == moved[2] || moved[2] == moved[0]) continue;
      if (!seen.insert(moved).second) continue;
      out.insert(out.end(), moved.begin(), moved.end());
    }
  }
  return out;
}

}  // namespace trunnion
