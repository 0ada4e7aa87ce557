#pragma once
#include <cmath>
#include <random>
#include <vector>

#include "trunnion/nc/controller.hpp"

namespace trunnion::test {

/// Random programs that say nothing twice and use only what `controller` has words for: blocks -> text ->
/// blocks must give them back. State that the controls drop by themselves (spindle at a tool change, ...) is
/// followed here independently of writer and reader.
class RandomProgram {
 public:
  RandomProgram(const nc::Controller& controller, std::uint64_t seed) : c_(controller), random_(seed) {}

  std::vector<nc::Block> make(int length) {
    blocks_ = {start()};
    if (c_.default_path_mode) {
      path_ = {*c_.default_path_mode, 0};
      blocks_.push_back(path_);
    }
    for (int i = 0; i < length; ++i) step();
    if (tcp_) tcp(false);
    blocks_.push_back(nc::ProgramEnd{});
    return blocks_;
  }

 private:
  std::int64_t integer(std::int64_t low, std::int64_t high) {
    return std::uniform_int_distribution<std::int64_t>(low, high)(random_);
  }

  static bool mentions(const nc::Template& lines, const std::string& what) {
    for (const auto& line : lines) {
      if (line.find(what) != std::string::npos) return true;
    }
    return false;
  }

  nc::Block start() {
    nc::ProgramStart block;
    if (mentions(c_.program.begin, "{name}")) block.name = "PART-" + std::to_string(integer(1, 99));
    if (mentions(c_.program.begin, "{number}")) block.number = integer(1, 9999);
    return block;
  }

  void step() {
    switch (integer(0, 29)) {
      case 0:
        return comment();
      case 1:
        return dwell();
      case 2:
        return spindle();
      case 3:
        return coolant();
      case 4:
        return tool();
      case 5:
        return length();
      case 6:
        return tcp(!tcp_);
      case 7:
        return work_offset();
      case 8:
        return path_mode();
      case 9:
        return retract();
      case 10:
        return plane();
      case 11:
        return stop();
      case 12:
        return offset_shift();
      case 13:
        return arc();
      case 14:
        return hole();
      default:
        return motion();
    }
  }

  void comment() {
    static const std::string kLetters = "ABCXYZ0189 .:/=+-*!&[]";
    std::string text = "C";
    for (std::int64_t i = integer(0, 20); i > 0; --i) {
      text += kLetters[static_cast<std::size_t>(integer(0, static_cast<std::int64_t>(kLetters.size()) - 1))];
    }
    while (text.back() == ' ') text.pop_back();
    blocks_.push_back(nc::Comment{text});
  }

  void dwell() {
    if (c_.dwell.empty()) return;
    std::int64_t step = 1;
    if (!mentions(c_.dwell, "{milliseconds}")) {
      for (int d = c_.dwell_decimals; d < 3; ++d) step *= 10;
    }
    blocks_.push_back(nc::Dwell{step * integer(1, 20000)});
  }

  void spindle() {
    nc::Spindle block{static_cast<nc::SpindleTurn>(integer(0, 2)), integer(1, 24000)};
    if (block.turn == nc::SpindleTurn::off) block.rpm = 0;
    if (tcp_ && c_.speed_not_under_tcp && block.rpm > 0) tcp(false);
    if (block.turn == spindle_.turn && block.rpm == spindle_.rpm) return;
    spindle_ = block;
    blocks_.push_back(block);
  }

  void coolant() {
    const auto kind = integer(0, 4);
    if (c_.coolant[static_cast<std::size_t>(kind)].empty()) return;
    const auto now = kind == 0 ? 0U : coolant_ | (1U << kind);
    if (now == coolant_) return;
    coolant_ = now;
    blocks_.push_back(nc::Coolant{static_cast<nc::CoolantKind>(kind)});
  }

  void tool() {
    if (tcp_) tcp(false);
    const auto number = integer(1, 99);
    blocks_.push_back(
        nc::ToolCall{number, mentions(c_.tool_change, "{length_offset}") ? integer(1, 99) : number});
    spindle_ = {};
    coolant_ = 0;
    length_ = -1;
    known_ = {};
  }

  void length() { length(integer(0, mentions(c_.length.on, "{length_offset}") ? 3 : 1)); }

  void length(std::int64_t number) {
    if (c_.length.automatic || c_.length.on.empty() || (tcp_ && c_.tcp.replaces_length)) return;
    if (number == length_) return;
    length_ = number;
    forget_linear();
    blocks_.push_back(nc::LengthCompensation{number});
    if (number != 0 && c_.length.with_motion) motion(true);
  }

  void tcp(bool on) {
    if (!c_.has_tcp() || on == tcp_) return;
    tcp_ = on;
    if (c_.tcp.replaces_length) length_ = 0;
    forget_linear();
    blocks_.push_back(nc::TcpControl{on, on && mentions(c_.tcp.on, "{length_offset}") ? integer(1, 99) : 0});
    if (on && c_.tcp.with_motion) motion(true);
  }

  void work_offset() {
    if (c_.work_offsets.empty()) return;
    const auto number = integer(1, static_cast<std::int64_t>(c_.work_offsets.size()));
    if (number == work_offset_) return;
    work_offset_ = number;
    known_ = {};
    blocks_.push_back(nc::WorkOffset{number});
  }

  void offset_shift() {
    nc::OffsetShift block;
    block.kind = static_cast<nc::OffsetShift::Kind>(integer(0, 1));
    const bool sets = block.kind == nc::OffsetShift::Kind::set;
    if ((sets ? c_.offset_shift.set : c_.offset_shift.add).empty()) return;
    if (tcp_ && c_.offset_shift.not_under_tcp) tcp(false);
    if (sets) block.index = integer(1, 6);
    for (auto& v : block.offset) v = integer(-100000, 100000);
    forget_linear();
    blocks_.push_back(block);
  }

  void path_mode() {
    nc::PathMode block{static_cast<nc::PathModeKind>(integer(0, 2)), 0};
    if (block.kind == nc::PathModeKind::continuous && !c_.continuous_within.empty())
      block.tolerance = integer(0, 50);
    const bool has_words =
        block.tolerance > 0 || !c_.path_modes[static_cast<std::size_t>(block.kind)].empty();
    if (!has_words || (path_.kind == block.kind && path_.tolerance == block.tolerance && path_chosen_))
      return;
    if (!path_chosen_ && c_.default_path_mode && path_.kind == block.kind &&
        path_.tolerance == block.tolerance)
      return;
    path_ = block;
    path_chosen_ = true;
    blocks_.push_back(block);
  }

  void retract() {
    const auto letter = static_cast<nc::AxisLetter>(integer(0, 2));
    if (c_.retract[nc::index(letter)].empty()) return;
    if (tcp_) tcp(false);
    known_.forget(letter);
    nc::Retract block{nc::AxisWords::bit(letter), {}};
    if (c_.names_position(letter)) block.to.set(letter, integer(-9999999, 9999999));
    blocks_.push_back(block);
    if (c_.retract_ends_length && length_ > 0) {
      length_ = -1;
      length(integer(0, 1) == 0 ? 0 : 1);
    }
  }

  void plane() {
    if (!c_.has_tilted_plane() || tcp_) return;
    plane_ = !plane_;
    nc::TiltedPlane block;
    block.on = plane_;
    if (plane_) {
      for (auto& v : block.origin) v = integer(-100000, 100000);
      for (auto& v : block.angles) v = integer(-1800000, 1800000);
    }
    known_ = {};
    blocks_.push_back(block);
  }

  void stop() {
    const bool optional = integer(0, 1) == 1;
    if (!(optional ? c_.stops.optional : c_.stops.program).empty()) blocks_.push_back(nc::Stop{optional});
  }

  bool xyz_known() const { return (known_.mask & nc::kXyz) == nc::kXyz; }

  void arc() {
    if (!xyz_known()) return;
    nc::Arc block;
    block.clockwise = integer(0, 1) == 1;
    const bool helix = integer(0, 2) == 0 && !c_.arcs.words(block.clockwise, true).empty();
    if (c_.arcs.words(block.clockwise, helix).empty()) return;
    block.feed = integer(1, 9999999);
    const std::int64_t x = known_[nc::AxisLetter::X];
    const std::int64_t y = known_[nc::AxisLetter::Y];
    block.center = {x + integer(-200000, 200000), y + integer(1, 200000)};
    if (integer(0, 3) != 0) {  // else a full circle
      const double radius =
          std::hypot(static_cast<double>(x - block.center[0]), static_cast<double>(y - block.center[1]));
      const double angle = static_cast<double>(integer(0, 6283)) / 1000.0;
      known_.set(nc::AxisLetter::X, block.center[0] + std::llround(radius * std::cos(angle)));
      known_.set(nc::AxisLetter::Y, block.center[1] + std::llround(radius * std::sin(angle)));
    }
    if (helix) known_.set(nc::AxisLetter::Z, known_[nc::AxisLetter::Z] + integer(1, 99999));
    block.words = known_;
    last_feed_ = block.feed;
    blocks_.push_back(block);
  }

  void hole() {
    if (!xyz_known() || std::abs(known_[nc::AxisLetter::Z]) > 9000000000) return;
    nc::Hole block;
    block.kind = static_cast<nc::Hole::Kind>(integer(0, 3));
    block.dwell_ms = integer(0, 1) * integer(1, 3000);
    const nc::Template& words = c_.cycles.words(block);
    if (words.empty()) return;
    const bool places = mentions(words, "{x}");
    const bool any_back = mentions(words, "{back}") || mentions(words, "{rise}");
    block.feed = integer(1, 9999999);
    block.clear = known_[nc::AxisLetter::Z] - integer(0, 1) * integer(0, 50000);
    block.bottom = block.clear - integer(100, 900000);
    if (block.kind == nc::Hole::Kind::peck || block.kind == nc::Hole::Kind::chip_break)
      block.step = integer(1, block.clear - block.bottom - 1);
    const std::int64_t back = integer(0, 1) == 0 ? block.clear
                              : any_back         ? block.clear + integer(0, 90000)
                                                 : known_[nc::AxisLetter::Z];
    for (std::int64_t holes = integer(1, 4); holes > 0; --holes) {
      if (places && integer(0, 3) != 0) known_.set(nc::AxisLetter::X, integer(-5000000, 5000000));
      if (places && integer(0, 3) != 0) known_.set(nc::AxisLetter::Y, integer(-5000000, 5000000));
      known_.set(nc::AxisLetter::Z, back);
      block.words = known_;
      blocks_.push_back(block);
    }
    last_feed_ = block.feed;
  }

  void forget_linear() {
    for (const auto letter : nc::kAllAxisLetters) {
      if (!nc::is_rotary(letter)) known_.forget(letter);
    }
  }

  void motion(bool with_z = false) {
    nc::Motion block;
    block.kind = integer(0, 3) == 0 ? nc::MotionKind::rapid : nc::MotionKind::feed;
    if (block.kind == nc::MotionKind::feed) {
      block.feed_mode =
          c_.has_inverse_time() && integer(0, 1) == 1 ? nc::FeedMode::inverse_time : nc::FeedMode::per_minute;
      block.feed = integer(0, 4) == 0 ? 1 : integer(1, 9999999);
      if (integer(0, 2) == 0 && last_feed_ > 0) block.feed = last_feed_;
      last_feed_ = block.feed;
    }
    const nc::AxisWords before = known_;
    for (const auto letter :
         {nc::AxisLetter::X, nc::AxisLetter::Y, nc::AxisLetter::Z, nc::AxisLetter::A, nc::AxisLetter::C}) {
      const bool wanted = integer(0, 2) != 0 || (with_z && letter == nc::AxisLetter::Z);
      if (wanted) known_.set(letter, next_position(letter, block.kind));
    }
    if (known_ == before) return motion(with_z);
    block.words = known_;
    blocks_.push_back(block);
  }

  std::int64_t next_position(nc::AxisLetter letter, nc::MotionKind kind) {
    if (c_.rotary.is_modulo(letter)) {
      const std::int64_t turn = c_.numbers.axes.turn();
      if (!known_.has(letter)) return integer(0, turn - 1);
      const std::int64_t half = turn / 2 - 1;
      static_cast<void>(kind);
      return known_[letter] + integer(-half, half);
    }
    switch (integer(0, 5)) {
      case 0:
        return 0;
      case 1:
        return integer(-9, 9);
      case 2:
        return known_[letter];
      case 3:
        return integer(-20000000000, 20000000000);
      default:
        return integer(-5000000, 5000000);
    }
  }

  const nc::Controller& c_;
  std::mt19937_64 random_;
  std::vector<nc::Block> blocks_;
  nc::AxisWords known_;
  nc::Spindle spindle_;
  unsigned coolant_ = 0;
  std::int64_t length_ = 0;
  bool tcp_ = false;
  bool plane_ = false;
  std::int64_t work_offset_ = 0;
  nc::PathMode path_;
  bool path_chosen_ = false;
  std::int64_t last_feed_ = 0;
};

}  // namespace trunnion::test
