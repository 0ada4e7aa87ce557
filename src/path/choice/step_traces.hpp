#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace trunnion::path {

/// By which step a position was reached: from which position of the layer before, and as which of the
/// positions that are reached from there.
struct TracedStep {
  std::uint16_t from = 0;
  std::uint16_t pick = 0;
};

/// The steps to all positions of each layer of a shortest path, written from the first to the last and read
/// from the last to the first. A byte a layer where at most two positions are reached from at most two.
class StepTraces {
 public:
  void clear() {
    bytes_.clear();
    layers_ = 0;
  }
  std::size_t layers() const { return layers_; }

  /// A layer of one position, the only solution in its only turn, reached from the only one before.
  void add_one() { add(kPlain); }
  /// A layer of two positions, the two solutions in their only turns, reached from position 0 or 1.
  void add_two(std::uint16_t first_from, std::uint16_t second_from) {
    add(static_cast<std::uint8_t>(kPlain | kTwo | first_from << 1 | second_from << 3 | 1 << 4));
  }
  /// So many layers of two positions in a straight line: of `add_two` from 0 and from 1.
  void add_straight(std::size_t count) {
    bytes_.insert(bytes_.end(), count, kStraight);
    layers_ += count;
  }
  void add(std::span<const TracedStep> steps);

  struct Read {
    TracedStep step;
    bool plain = false;     // as `add_one` or `add_two` wrote it: the pick is the solution
    std::size_t count = 0;  // of positions of a plain layer
  };
  /// Takes the last layer off where it is of two positions that were reached in a straight line: the two
  /// solutions, each from the position with its number.
  bool take_straight() {
    if (bytes_.back() != kStraight) return false;
    bytes_.pop_back();
    --layers_;
    return true;
  }
  /// Of position `at` of the last layer, which is taken off.
  Read take_last(std::size_t at);

 private:
  // Bit 0: two positions; then the bit of `from` and that of `pick` of each.
  static constexpr std::uint8_t kTwo = 1;
  static constexpr std::uint8_t kPlain = 32;
  static constexpr std::uint8_t kSmall = 64;
  static constexpr std::uint8_t kStraight = kPlain | kTwo | 1 << 3 | 1 << 4;
  static constexpr std::uint8_t kNibbles =
      0x80;                                    // before it the number of positions, before that a byte each
  static constexpr std::uint8_t kWide = 0x81;  // the same with 16 bits for each number

  void add(std::uint8_t code) {
    bytes_.push_back(code);
    ++layers_;
  }
  void put(std::uint16_t number) {
    bytes_.push_back(static_cast<std::uint8_t>(number & 0xff));
    bytes_.push_back(static_cast<std::uint8_t>(number >> 8));
  }
  std::uint16_t number_at(std::size_t i) const {
    return static_cast<std::uint16_t>(bytes_[i] | bytes_[i + 1] << 8);
  }

  std::vector<std::uint8_t> bytes_;
  std::size_t layers_ = 0;
};

}  // namespace trunnion::path
