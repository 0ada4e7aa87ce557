#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace trunnion::cl {

/// How the characters of a plain GOTO line of six numbers are placed: in most files points, commas and the
/// end of the line stand where they stood in the line before. Such a line is checked and read as a whole,
/// sixteen characters at a time.
class GotoLayout {
 public:
  /// So many characters from the beginning of a line on can be read, whatever is in them.
  static constexpr std::size_t kWidest = 80;

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
  bool read(const char* line, double* numbers) const;

 private:
  static constexpr std::size_t kVectors = kWidest / 16;
  using Places = std::array<std::uint64_t, 2>;  // of characters of a line, a bit each
  struct Field {
    std::size_t begin, point, end;
  };

  bool take_fields(const char* line, std::size_t length, std::array<Field, 6>& fields) const;
  void take_field(std::size_t number, const Field& field);

  std::size_t length_ = 0;
  std::uint32_t column_ = 1;
  // Characters that stand as they are; 0xff where those of a number stand; 0xff behind the line.
  alignas(16) std::array<std::uint8_t, kWidest> fixed_{};
  alignas(16) std::array<std::uint8_t, kWidest> number_{};
  alignas(16) std::array<std::uint8_t, kWidest> behind_{};
  Places digits_{};   // that are digits
  Places leading_{};  // blanks, a sign and digits
  Places no_digit_{};
  // Of two numbers each. Their eight digits are those of the nine characters before the end, but for the
  // point.
  struct Pair {
    alignas(16) std::array<std::uint8_t, 16> before, behind;  // the point: 0xff for characters to be taken
    alignas(16) std::array<std::array<std::uint64_t, 2>, 2> leading;  // of the sign; [word][number]
    alignas(16) std::array<double, 2> scale;
    std::array<std::size_t, 2> end;
  };
  std::array<Pair, 3> pairs_{};
};

}  // namespace trunnion::cl
