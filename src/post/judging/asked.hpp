#pragma once
#include <algorithm>
#include <deque>
#include <optional>
#include <span>

#include "trunnion/cl/record.hpp"
#include "trunnion/nc/blocks.hpp"
#include "trunnion/post/verify.hpp"

// Private to the verifier: what a CL file asks for besides its path.
namespace trunnion::post {

/// What holds while a motion of the CL file is cut.
struct AskedState {
  cl::Feed feed;
  double rpm = 0.0;           // last speed that was given: feeds per revolution count by it
  double pitch_mm = 0.0;      // of a thread that is tapped; 0: none
  double rotary_rad_s = 0.0;  // MAXDPM; 0: none
  std::optional<std::int64_t> tool;
  std::int64_t length_register = 0;  // of the tool
  nc::Spindle spindle;
  unsigned coolant = 0;  // bit per kind
  nc::CutterCompensation cutter;
  std::uint32_t line = 0;  // of the CL file, from which on
};

/// DELAY, STOP and OPSTOP: what takes place before motion number `before`.
struct AskedPause {
  enum class Kind : std::uint8_t { dwell, stop, optional_stop };
  std::size_t before = 0;
  Kind kind = Kind::dwell;
  std::int64_t milliseconds = 0;  // of a dwell
  std::uint32_t line = 0;
  // Of a stop, at which somebody may reach in: what the CL file has switched off before it.
  bool spindle_is_off = false;
  bool coolant_is_off = false;
};

/// The records of a CL file in their order, as the states in which its motions are cut. Motions count from 0
/// on.
class Asked {
 public:
  static constexpr std::size_t kNever = static_cast<std::size_t>(-1);

  /// A record that is no motion; a tool change with register filled in.
  void take(const cl::Record& record);
  /// Motions with nothing between them.
  void take(const ExpectedMotions& motions);

  /// The state as it is now.
  const AskedState& now() const { return now_; }
  /// The state at a motion that was taken.
  const AskedState& at(std::size_t motion) const;
  /// The first motion behind this one that has another state.
  std::size_t next_change(std::size_t motion) const;
  /// Whether a SPINDL or COOLNT that stands between these two motions, or one that was in force there, asks
  /// for what `is` looks for: words are said at their places, and another one may follow before the next
  /// motion.
  template <class Is>
  bool says_between(std::size_t first, std::size_t last, const Is& is) const {
    for (std::size_t motion = first; motion <= last; motion = next_change(motion))
      if (const AskedState& there = at(motion); is(there.spindle, there.coolant)) return true;
    return std::any_of(said_.begin(), said_.end(), [&](const Said& said) {
      return said.before >= first && said.before <= last && is(said.spindle, said.coolant);
    });
  }
  /// SET/OFSETL: the first that is called, since a program has one zero.
  const std::optional<std::int64_t>& work_offset() const { return work_offset_; }
  /// The first pause that has not been met yet, or null.
  const AskedPause* next_pause() const { return met_ < pauses_.size() ? &pauses_[met_] : nullptr; }
  void meet_pause() { ++met_; }
  /// Right before this motion the CL file pauses, which was the last pause that was met, or the spindle
  /// stands.
  bool stops_before(std::size_t motion) const;
  /// How many have been met, to go back to where blocks are judged anew.
  std::size_t pauses_met() const { return pauses_gone_ + met_; }
  void go_back_to_pause(std::size_t met) { met_ = met - std::min(met, pauses_gone_); }
  /// States that only motions before this one have.
  void forget(std::size_t motion);

 private:
  struct From {
    std::size_t motion = 0;
    AskedState state;
    bool stood = false;  // the spindle, before it
  };
  /// What SPINDL or COOLNT has set before motion number `before`.
  struct Said {
    std::size_t before = 0;
    nc::Spindle spindle;
    unsigned coolant = 0U;
  };
  void note(SourceRef where);
  void take_spindle(const cl::Spindle& spindle);
  void take_shape(const cl::Shape& shape);

  AskedState now_;
  bool changed_ = true;
  bool stood_ = false;         // the spindle, since the last motion
  std::size_t taps_left_ = 0;  // motions of a tap that are to come
  double diameter_mm_ = 0.0;   // of the tool
  std::optional<std::int64_t> work_offset_;
  std::size_t motions_ = 0;
  std::deque<From> states_;
  std::deque<Said> said_;
  std::deque<AskedPause> pauses_;  // those that have been met, too, as long as they may be asked for again
  std::size_t met_ = 0;            // of them
  std::size_t pauses_gone_ = 0;
};

}  // namespace trunnion::post
