#include "nc/reading/read_state.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"

#include "nc/digits.hpp"

namespace trunnion::nc {
namespace {

// It holds a length, in the unit of the program.
bool is_length(Placeholder p) {
  switch (p) {
    case Placeholder::x:
    case Placeholder::y:
    case Placeholder::z:
    case Placeholder::i:
    case Placeholder::j:
    case Placeholder::bottom:
    case Placeholder::clear:
    case Placeholder::depth:
    case Placeholder::back:
    case Placeholder::rise:
    case Placeholder::step:
    case Placeholder::position:
    case Placeholder::pitch:
    case Placeholder::lead:
      return true;
    default:
      return false;
  }
}

// Without a point it is a number of the control's smallest increments. Where a retract goes has its own
// words.
bool counts_increments(Placeholder p) {
  return (is_length(p) && p != Placeholder::position) || p == Placeholder::a || p == Placeholder::b ||
         p == Placeholder::c || p == Placeholder::seconds;
}

}  // namespace

void ReadFindings::error(std::uint32_t column, const std::string& message) {
  const SourceRef where{line, column};
  diagnostics.error(file, where, message);
  if (!first) first = Error{ErrorCode::wrong_input, message, file, where};
  constexpr std::size_t kMost = 20;  // the wrong controller would make one of every line
  if (++errors >= kMost && !given_up) {
    given_up = true;
    diagnostics.error(file, where, given_up_because);
  }
}

ReadState::ReadState(const Controller& controller, std::string file, Diagnostics& diagnostics,
                     Reader::Sink out, ReaderOptions opts)
    : c(controller),
      findings{std::move(file), diagnostics, "too many errors: is it a program for " + c.name + "?"},
      sink(std::move(out)),
      options(std::move(opts)),
      language(c, options, diagnostics) {
  if (c.cycles.initial_at_start || c.cycles.to_clear.empty()) cycle_return.to_clear = false;
  if (options.whole_program) {
    program.frame.emplace(c, language.patterns);
    modal.length = kUnknown;
  }
}

void ReadState::emit(const Block& block) {
  if (!program.started && !std::holds_alternative<ProgramStart>(block)) emit(ProgramStart{});
  if (std::holds_alternative<ProgramStart>(block)) program.started = true;
  sink(block);
}

void ReadState::set_feed_mode(FeedMode mode) {
  if (mode == modal.feed_mode) return;
  modal.feed_mode = mode;
  feed = 0;
}

// In whole mm a minute alone most controls need none; others have a reason. G93 counts in thousandths where
// axes do (bit 0 of parameter 3401 of Fanuc: F1 is 0.001 or 1).
bool ReadState::wants_point_of_feed(const Number& number) const {
  return c.numbers.point_required && !number.has_point && number.mantissa != 0 &&
         (modal.feed_mode == FeedMode::inverse_time || c.refused.contains("F"));
}

void ReadState::check_size_of_feed(std::int64_t quanta, std::uint32_t column) {
  const std::int64_t most = forms.largest_feed[static_cast<std::size_t>(modal.feed_mode)];
  if (quanta <= most) return;
  const bool inverse = modal.feed_mode == FeedMode::inverse_time;
  error(column, "F is larger than the control takes, " +
                    shortest_text(inverse ? *c.feed.max_inverse_time : *c.feed.max_per_minute) + " (" +
                    c.file + ", [feed] " + (inverse ? "max_inverse_time" : "max_per_minute") + ")");
}

void ReadState::check_size_of_feeds(const MotionRun& run) {
  const std::int64_t most = forms.largest_feed[static_cast<std::size_t>(run.feed_mode)];
  if (most == kLargest) return;
  const auto behind = run.feed.begin() + static_cast<std::ptrdiff_t>(run.count);
  const auto large = std::find_if(run.feed.begin(), behind, [&](std::int64_t f) { return f > most; });
  if (large == behind) return;
  const std::uint32_t now = findings.line;
  const SourceRef where = run.source[static_cast<std::size_t>(large - run.feed.begin())];
  findings.line = where.line;
  check_size_of_feed(*large, where.column);
  findings.line = now;
}

void ReadState::check_point_of_feed(const Number& number, std::uint32_t column) {
  if (wants_point_of_feed(number)) {
    const auto why = c.refused.find("F");
    return error(column,
                 "F has no decimal point: " +
                     (why != c.refused.end() ? why->second : "the control may count it in increments"));
  }
  if (!language.others || !c.numbers.point_required || number.has_point || number.mantissa == 0) return;
  if (language.others->per_revolution() || language.others->in_inches())
    error(column, "F has no decimal point: the control reads it in increments");
}

void ReadState::follow_spindle(std::int64_t rpm) {
  constexpr double kFastest = 1e9;  // mm/min: beyond any machine
  const double mm_min =
      static_cast<double>(language.others->feed_of_turn()) /
      static_cast<double>(kPowersOfTen[static_cast<std::size_t>(OtherWords::kTurnDecimals)]) *
      static_cast<double>(rpm);
  const int decimals = c.numbers.feed.per_minute_decimals;
  feed = mm_min > 0.0 && mm_min < kFastest
             ? std::llround(mm_min * static_cast<double>(kPowersOfTen[static_cast<std::size_t>(decimals)]))
             : 0;
}

void ReadState::change_speed(const Number& rpm) {
  Spindle now = modal.spindle.value_or(Spindle{});
  if (now.turn == SpindleTurn::off || !to_rounded_quanta(rpm, 0, now.rpm) || now.rpm == modal.spindle->rpm)
    return;
  modal.spindle = now;
  emit(now);
}

bool ReadState::spindle_turns_at_nothing(std::uint32_t column) {
  if (!language.others || !modal.spindle || modal.spindle->turn == SpindleTurn::off || modal.spindle->rpm > 0)
    return false;
  error(column, "a cut, and the spindle was told to turn at a speed of 0");
  return true;
}

std::int64_t ReadState::unwrapped(AxisLetter letter, std::int64_t value) const {
  if (!c.rotary.is_modulo(letter) || !modal.position.has(letter)) return value;
  const std::int64_t from = modal.position[letter];
  std::int64_t way = (value - from) % language.turn;
  if (2 * way > language.turn) way -= language.turn;
  if (2 * way < -language.turn) way += language.turn;
  return from + way;
}

// A line of several that mean a tilted plane only together: in some controls it turns the coordinates alone.
bool ReadState::waits_for_plane() {
  if (language.others->frame_moved_aside()) {
    error(1, "a datum shift in a tilted plane, and a motion behind it: end the plane first");
    return true;
  }
  if (program.plane_since == 0) return false;
  error(1, "a motion in the tilted plane of line " + std::to_string(program.plane_since) + " without '" +
               c.tilted_plane.on.back() +
               "' before it: the program does not give the positions of the rotary axes for it");
  program.plane_since = 0;
  return true;
}

void ReadState::note_pattern(const FoundEvent& found) {
  if (!program.frame) return;
  const std::string message = program.frame->take(*found.pattern, findings.line);
  if (!message.empty()) error(found, message);
}

bool ReadState::may_move(std::uint32_t column) {
  if (!program.frame) return true;
  program.said_anything = true;
  const std::string message = program.frame->moves();
  if (!message.empty()) error(column, message);
  return message.empty();
}

const Number* ReadState::value(const FoundEvent& found, Placeholder p) const {
  return found.captures.has(p) ? &found.captures[p] : kept.has(p) ? &kept[p] : nullptr;
}

std::int64_t ReadState::whole(const FoundEvent& found, Placeholder p, std::int64_t fallback) {
  const Number* number = value(found, p);
  std::int64_t out = fallback;
  if (number == nullptr) return out;
  if (p == Placeholder::tool || p == Placeholder::length_offset || p == Placeholder::index) {
    if (!to_quanta(*number, 0, out))
      error(found.column, "a number that counts things is not whole, or too large");
  } else if (!to_rounded_quanta(*number, 0, out)) {
    error(found.column, "number too large");
  } else if (p == Placeholder::milliseconds && number->has_point) {
    error(found.column, "a dwell in milliseconds with a decimal point: controls differ in its unit");
  }
  return out;
}

std::int64_t ReadState::scaled(const FoundEvent& found, Placeholder p, int decimals) {
  const Number* number = value(found, p);
  std::int64_t out = 0;
  if (number != nullptr && !to_quanta(*number, decimals, out)) {
    error(found.column, std::string("{") + std::string(name_of(p)) + "} has more decimals than " +
                            std::to_string(decimals));
  }
  if (number != nullptr) check_point(found, p, *number);
  return language.others && is_length(p) ? language.others->length(out) : out;
}

void ReadState::check_point(const FoundEvent& found, Placeholder p, const Number& number) {
  if (!c.numbers.point_required || number.has_point || number.mantissa == 0 || !counts_increments(p)) return;
  error(found.column, std::string("{") + std::string(name_of(p)) +
                          "} has no decimal point: the control would take it for a number of increments");
}

// A motion under kinematics that are not known may go anywhere.
bool ReadState::kinematics_unknown(std::uint32_t column) {
  if (modal.tcp_known) return false;
  error(column, "the program has not said which kinematics are active: '" + c.tcp.off.back() + "' or '" +
                    c.tcp.on.back() + "' must stand before the first motion");
  modal.tcp_known = true;  // said once
  return true;
}

}  // namespace trunnion::nc
