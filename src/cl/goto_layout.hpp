#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "trunnion/base/lanes.hpp"

namespace trunnion::cl {

/// How the characters of a plain GOTO line of six numbers are placed: in most files points, commas and the
/// end of the line stand where they stood in the line before. Such a line is checked and read as a whole,
/// 32 characters and all six numbers at a time, where the processor has AVX2.
class GotoLayout {
 public:
  /// So many characters from the beginning of a line on can be read, whatever is in them.
  static constexpr std::size_t kWidest = 96;

  /// Takes over the layout of the line of `length` characters at `line`, its newline included, that was read
  /// as a plain GOTO. Lines that are too wide, or have numbers without a point, with more than seven decimals
  /// or with a `+` have none.
  void learn(const char* line, std::size_t length);
  /// 0: none is known.
  std::size_t length() const { return length_; }
  /// Where GOTO stands, counted from 1.
  std::uint32_t column() const { return column_; }
  /// The six numbers of the line at `line`, the same bits as plain_number gives; false where it is laid out
  /// otherwise, or is no plain GOTO.
  TRUNNION_FOUR bool read(const char* line, double* numbers) const;

 private:
  static constexpr std::size_t kVectors = kWidest / 32;
  using Places = std::array<std::uint64_t, 2>;  // of characters of a line, a bit each
  struct Field {
    std::size_t begin, point, end;
  };

  bool take_fields(const char* line, std::size_t length, std::array<Field, 6>& fields) const;
  void take_field(std::size_t number, const Field& field);

  std::size_t length_ = 0;
  std::uint32_t column_ = 1;
  // Characters that stand as they are; 0xff where those of a number stand; 0xff behind the line.
  alignas(32) std::array<std::uint8_t, kWidest> fixed_{};
  alignas(32) std::array<std::uint8_t, kWidest> number_{};
  alignas(32) std::array<std::uint8_t, kWidest> behind_{};
  Places digits_{};   // that are digits
  Places leading_{};  // blanks, a sign and digits
  Places no_digit_{};
  // The digits of a number, eight at most, stand in the sixteen characters from here on.
  std::array<std::size_t, 6> from_{};
  // Numbers 0 and 1, 2 and 3, 4 and 5: where in those sixteen the digits are.
  alignas(32) std::array<std::array<std::uint8_t, 32>, 3> digit_at_{};
  // Of numbers 0, 2, 4 and of 1, 3, 5: powers of ten by which the digits are divided, and leading_ of each.
  struct Four {
    alignas(32) std::array<double, 4> scale{1.0, 1.0, 1.0, 1.0};
    alignas(32) std::array<std::array<std::uint64_t, 4>, 2> leading{};
  };
  std::array<Four, 2> four_{};
};

}  // namespace trunnion::cl
