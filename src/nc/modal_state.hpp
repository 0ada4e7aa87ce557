#pragma once
#include <cstdint>
#include <optional>
#include <utility>

#include "trunnion/nc/axis_words.hpp"
#include "trunnion/nc/blocks.hpp"
#include "trunnion/nc/controller.hpp"

namespace trunnion::nc {

/// A number that the control may not have (feed, length offset).
inline constexpr std::int64_t kUnknown = -1;

/// What a control knows after the blocks of a program so far: the same for whoever writes them and whoever
/// reads them back.
struct ModalState {
  explicit ModalState(const Controller& c) : tcp_known(!c.tcp.unknown_at_start) {}

  // Each gives false where the control knows that already.
  bool turn_spindle(const Spindle& now) {
    if (spindle && now.turn == spindle->turn && now.rpm == spindle->rpm) return false;
    spindle = now;
    return true;
  }
  bool switch_coolant(CoolantKind kind) {
    const auto now = static_cast<std::uint8_t>(
        kind == CoolantKind::off ? 0U : coolant.value_or(0U) | (1U << static_cast<unsigned>(kind)));
    return std::exchange(coolant, now) != now;
  }
  /// It ended the spindle and the coolant: what is said of them behind it is said.
  void stop() {
    spindle.reset();
    coolant.reset();
  }
  /// `replaces_length`: it takes the place of length compensation.
  bool switch_tcp(bool on, std::int64_t offset, bool replaces_length) {
    if (tcp_known && on == tcp && offset == tcp_offset) return false;
    tcp = on;
    tcp_known = true;
    tcp_offset = offset;
    if (replaces_length) length = 0;
    position.forget(kLinearAxes);
    return true;
  }
  bool call_work_offset(std::int64_t index) {
    if (index == work_offset) return false;
    work_offset = index;
    position.forget(kAllAxes);
    return true;
  }
  bool set_path_mode(const PathMode& now) {
    if (path_mode && path_mode->kind == now.kind && path_mode->tolerance == now.tolerance) return false;
    path_mode = now;
    return true;
  }
  bool switch_cutter(const CutterCompensation& now) {
    if (now.side == cutter.side && now.number == cutter.number) return false;
    cutter = now;
    return true;
  }

  void set_length(std::int64_t number) {
    length = number;
    position.forget(kLinearAxes);
  }
  void clamp(std::uint16_t axes, bool on) {
    clamped = static_cast<std::uint16_t>(on ? clamped | axes : clamped & ~axes);
  }
  /// The control stops the spindle for it, on some machines the coolant, may move any axis, and knows no
  /// length then.
  void change_tool() {
    spindle = Spindle{};
    if (coolant != 0) coolant.reset();
    length = kUnknown;
    position.forget(kAllAxes);
    cycle.reset();
  }
  /// In or out of a tilted plane.
  void switch_plane(bool on) {
    plane = on;
    position.forget(kAllAxes);
  }

  AxisWords position;
  std::optional<MotionKind> motion_kind;
  FeedMode feed_mode = FeedMode::per_minute;
  /// Nothing behind a tap, whose cycle leaves it stopped on most controls: to be said again.
  std::optional<Spindle> spindle = Spindle{};
  std::optional<std::uint8_t> coolant = 0;  // bit per kind; not known where a tool change may have ended it
  std::uint16_t clamped = 0;                // rotary axes, bits of AxisWords
  std::int64_t length = 0;  // number; below 0: not known before the program says it, and after a tool change
  bool tcp = false;
  bool tcp_known;
  std::int64_t tcp_offset = 0;
  std::int64_t work_offset = 0;  // 0: not chosen
  std::optional<PathMode> path_mode;
  bool plane = false;
  std::optional<Hole> cycle;  // in force
  CutterCompensation cutter;
};

}  // namespace trunnion::nc
