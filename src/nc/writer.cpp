#include "trunnion/nc/writer.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "trunnion/base/contract.hpp"

#include "nc/digits.hpp"
#include "nc/templates.hpp"

namespace trunnion::nc {
namespace {

constexpr std::int64_t kUnknown = -1;

// Longest motion block: 9 axis words and F of at most 26 characters each, block number, motion and feed
// words, separators.
constexpr std::size_t kMotionRoom = 512;
// Words of one block that come from the controller file may be this long together.
constexpr std::size_t kWordRoom = 128;

constexpr std::uint16_t kLinearAxes = 0b111000111;

char* put_text(char* p, const std::string& text) {
  std::memcpy(p, text.data(), text.size());
  return p + text.size();
}

// Numbers as the control takes them need at most 18 digits.
constexpr std::int64_t kLargest = 999'999'999'999'999'999;

}  // namespace

struct Writer::State {
  State(const Controller& controller, std::string& text)
      : c(controller), out(text), block_number(c.block_numbers.start) {
    linear = {c.numbers.axes.decimals(AxisLetter::X), c.numbers.trailing_zeros, c.numbers.point_required,
              c.numbers.plus_sign};
    rotary = linear;
    rotary.decimals = c.numbers.axes.decimals(AxisLetter::A);
    for (const auto mode : {FeedMode::per_minute, FeedMode::inverse_time}) {
      auto& style = feed_style[static_cast<std::size_t>(mode)];
      style = linear;
      style.decimals = c.numbers.feed.decimals(mode);
      style.plus_sign = false;
    }
    TRUNNION_EXPECTS(c.motion.rapid.size() + c.motion.linear.size() + c.motion.rapid_suffix.size() +
                         c.feed.per_minute.size() + c.feed.inverse_time.size() +
                         c.block_numbers.prefix.size() + 16 * c.line.separator.size() <
                     kWordRoom);
    turn = c.numbers.axes.turn();
  }

  const Controller& c;
  std::string& out;
  NumberStyle linear, rotary;
  std::array<NumberStyle, 2> feed_style;
  std::int64_t turn = 0;

  // What the control knows.
  AxisWords position;
  std::optional<MotionKind> motion_kind;
  FeedMode feed_mode = FeedMode::per_minute;
  std::array<std::int64_t, 2> feed = {kUnknown, kUnknown};
  Spindle spindle;
  std::uint8_t coolant = 0;  // bit per kind
  std::int64_t length = 0;   // number; kUnknown after a tool change
  bool tcp = false;
  std::int64_t work_offset = 0;  // 0: not chosen
  std::optional<PathMode> path_mode;
  bool plane = false;

  // What this program has said.
  std::string program_name;
  std::int64_t program_number = 0;
  bool started = false;
  bool setup_pending = false;
  bool ended = false;
  std::string pending_words;  // length or TCP words that belong into the next motion block

  std::int64_t block_number;
  std::size_t lines = 0;
  std::size_t motions = 0;

  tl::unexpected<Error> refuse(const std::string& message, SourceRef where = {}) const {
    return fail(ErrorCode::wrong_input, c.name + ": " + message, {}, where);
  }

  // --- lines
  // -----------------------------------------------------------------------------------------------------------------

  char* put_block_number(char* p) {
    p = put_text(p, c.block_numbers.prefix);
    p = put_unsigned(p, static_cast<std::uint64_t>(block_number));
    p = put_text(p, c.line.separator);
    block_number += c.block_numbers.step;
    if (block_number > c.block_numbers.max) block_number = c.block_numbers.start;
    return p;
  }

  bool wants_number(const std::string& line) const {
    if (!c.block_numbers.enabled) return false;
    return std::none_of(c.block_numbers.not_before.begin(), c.block_numbers.not_before.end(),
                        [&](const std::string& start) { return line.starts_with(start); });
  }

  Result<void> put_line(const std::string& line) {
    const std::size_t begin = out.size();
    if (wants_number(line)) {
      std::array<char, kWordRoom + 24> buffer;
      out.append(buffer.data(), put_block_number(buffer.data()));
    }
    out += line;
    const std::size_t length_of_line = out.size() - begin;
    if (length_of_line > c.line.max_length) {
      out.resize(begin);
      return refuse("a line of " + std::to_string(length_of_line) + " characters is longer than the " +
                    std::to_string(c.line.max_length) + " that the control takes: '" + line.substr(0, 40) +
                    "...'");
    }
    out += c.line.end;
    ++lines;
    return {};
  }

  Result<void> put_template(const Template& lines_of_template, const Values& values) {
    for (const auto& line : lines_of_template) {
      if (auto done = put_line(render(line, values)); !done) return done;
    }
    return {};
  }

  Result<void> put_words(const Template& words, const Values& values, const char* what) {
    if (words.empty()) return refuse(std::string("the controller file has no words for ") + what);
    return put_template(words, values);
  }

  // Words that the control wants in the block of the motion they belong to.
  Result<void> put_with_motion(const Template& words, const Values& values, const char* what) {
    if (words.empty()) return refuse(std::string("the controller file has no words for ") + what);
    pending_words.clear();
    for (const auto& line : words) pending_words += render(line, values) + c.line.separator;
    if (pending_words.size() > kWordRoom) return refuse("words too long: '" + pending_words + "'");
    return {};
  }

  std::string number_text(std::int64_t quanta, const NumberStyle& style) const {
    std::array<char, 32> buffer;
    return {buffer.data(), put_number(buffer.data(), quanta, style)};
  }

  void forget(std::uint16_t axes) { position.mask = static_cast<std::uint16_t>(position.mask & ~axes); }

  // --- motion
  // ----------------------------------------------------------------------------------------------------------------

  std::uint16_t changed_axes(const AxisWords& words) const {
    std::uint16_t changed = 0;
    for (std::size_t i = 0; i < kAxisLetters; ++i) {
      const auto bit = static_cast<std::uint16_t>(1U << i);
      if ((words.mask & bit) == 0) continue;
      if ((position.mask & bit) == 0 || position.quanta[i] != words.quanta[i])
        changed = static_cast<std::uint16_t>(changed | bit);
    }
    return changed;
  }

  // A control that counts modulo one turn takes the shorter way: half a turn or more cannot be told by the
  // angle.
  Result<void> check_turns(const Motion& m, std::uint16_t changed) const {
    for (const AxisLetter letter : {AxisLetter::A, AxisLetter::B, AxisLetter::C}) {
      if ((changed & AxisWords::bit(letter)) == 0 || !position.has(letter)) continue;
      const std::int64_t way = std::abs(m.words[letter] - position[letter]);
      if (2 * way >= turn) {
        return refuse(std::string("axis ") + letter_of(letter) + " turns by " + number_text(way, rotary) +
                          " degrees in one feed block, and the control would take the shorter way",
                      m.source);
      }
    }
    return {};
  }

  Result<void> check_feed(const Motion& m) const {
    if (m.feed <= 0) return refuse("a feed move without feed", m.source);
    const bool inverse = m.feed_mode == FeedMode::inverse_time;
    if (inverse && !c.has_inverse_time()) return refuse("the control has no inverse-time feed", m.source);
    const auto& limit = inverse ? c.feed.max_inverse_time : c.feed.max_per_minute;
    if (!limit) return {};
    const double value =
        static_cast<double>(m.feed) /
        static_cast<double>(kPowersOfTen[static_cast<std::size_t>(c.numbers.feed.decimals(m.feed_mode))]);
    if (value <= *limit) return {};
    return refuse("feed " + number_text(m.feed, feed_style[static_cast<std::size_t>(m.feed_mode)]) +
                      " is beyond the largest that the control takes, " + std::to_string(*limit),
                  m.source);
  }

  Result<void> check_motion(const Motion& m, std::uint16_t changed) const {
    if (!pending_words.empty() && (changed & AxisWords::bit(AxisLetter::Z)) == 0) {
      return refuse("the motion after length compensation must say where Z goes", m.source);
    }
    if (m.kind == MotionKind::feed) {
      if (auto ok = check_feed(m); !ok) return ok;
      if (c.rotary.modulo) return check_turns(m, changed);
    }
    return {};
  }

  char* put_axis(char* p, std::size_t i, std::int64_t quanta) const {
    const auto letter = kAllAxisLetters[i];
    *p++ = letter_of(letter);
    if (!is_rotary(letter)) return put_number(p, quanta, linear);
    if (c.rotary.modulo) {
      quanta %= turn;
      if (quanta < 0) quanta += turn;
    }
    return put_number(p, quanta, rotary);
  }

  // Motion word, words that wait for a motion, feed mode: in this order in front of the axis words.
  char* put_leading(char* p, const Motion& m) {
    if (m.kind == MotionKind::feed && m.feed_mode != feed_mode) {
      const auto& word = m.feed_mode == FeedMode::inverse_time ? c.feed.inverse_time : c.feed.per_minute;
      if (!word.empty()) p = put_text(put_text(p, word), c.line.separator);
      feed_mode = m.feed_mode;
      feed = {kUnknown, kUnknown};
    }
    if (!c.motion.modal || motion_kind != m.kind) {
      p = put_text(p, m.kind == MotionKind::rapid ? c.motion.rapid : c.motion.linear);
      p = put_text(p, c.line.separator);
      motion_kind = m.kind;
    }
    if (!pending_words.empty()) {
      p = put_text(p, pending_words);
      pending_words.clear();
    }
    return p;
  }

  char* put_feed(char* p, const Motion& m) {
    const auto mode = static_cast<std::size_t>(m.feed_mode);
    const bool always = m.feed_mode == FeedMode::inverse_time && c.feed.inverse_time_every_block;
    if (!always && feed[mode] == m.feed) return p;
    feed[mode] = m.feed;
    *p++ = 'F';
    p = put_number(p, m.feed, feed_style[mode]);
    return put_text(p, c.line.separator);
  }

  Result<void> write_motion(const Motion& m) {
    if (setup_pending) {
      if (auto done = flush_setup(true); !done) return done;
    }
    TRUNNION_EXPECTS(started && !ended);
    const std::uint16_t changed = changed_axes(m.words);
    if (changed == 0) return {};
    if (auto ok = check_motion(m, changed); !ok) return ok;
    std::array<char, kMotionRoom + 2 * kWordRoom> buffer;
    char* p = buffer.data();
    if (c.block_numbers.enabled) p = put_block_number(p);
    p = put_leading(p, m);
    for (std::size_t i = 0; i < kAxisLetters; ++i) {
      if ((changed & (1U << i)) == 0) continue;
      if (m.words.quanta[i] > kLargest || m.words.quanta[i] < -kLargest)
        return refuse("coordinate too large", m.source);
      p = put_axis(p, i, m.words.quanta[i]);
      p = put_text(p, c.line.separator);
      position.quanta[i] = m.words.quanta[i];
    }
    position.mask = static_cast<std::uint16_t>(position.mask | changed);
    if (m.kind == MotionKind::feed) {
      p = put_feed(p, m);
    } else if (!c.motion.rapid_suffix.empty()) {
      p = put_text(put_text(p, c.motion.rapid_suffix), c.line.separator);
    }
    p -= c.line.separator.size();
    const auto length_of_line = static_cast<std::size_t>(p - buffer.data());
    if (length_of_line > c.line.max_length) {
      return refuse("a motion block of " + std::to_string(length_of_line) +
                        " characters is longer than the " + std::to_string(c.line.max_length) +
                        " that the control takes",
                    m.source);
    }
    p = put_text(p, c.line.end);
    out.append(buffer.data(), static_cast<std::size_t>(p - buffer.data()));
    ++lines;
    ++motions;
    return {};
  }

  // --- everything else
  // -------------------------------------------------------------------------------------------------------

  Result<void> flush_setup(bool with_default_path_mode) {
    setup_pending = false;
    if (auto done = put_template(c.program.setup, {}); !done) return done;
    if (with_default_path_mode && c.default_path_mode) return write(PathMode{*c.default_path_mode, 0});
    return {};
  }

  Result<void> switch_tcp_off() {
    if (!tcp || !c.tcp.off_for_tool_change) return {};
    return write(TcpControl{});
  }

  Result<void> write(const ProgramStart& b) {
    TRUNNION_EXPECTS(!started);
    for (const char ch : b.name) {
      const bool ok = (ch >= '0' && ch <= '9') || (ch >= 'A' && ch <= 'Z') || (ch >= 'a' && ch <= 'z') ||
                      ch == '_' || ch == '-';
      if (!ok) return refuse("the program name '" + b.name + "' may hold letters, digits, _ and - only");
    }
    if (b.number <= 0) return refuse("the program number must be positive, not " + std::to_string(b.number));
    started = true;
    setup_pending = true;
    program_name = b.name.empty() ? "PROGRAM" : b.name;
    program_number = b.number;
    return put_template(c.program.begin, program_values());
  }

  Values program_values() const {
    return Values()
        .set(Placeholder::name, program_name)
        .set(Placeholder::number, std::to_string(program_number));
  }

  Result<void> write(const ProgramEnd&) {
    if (auto done = switch_tcp_off(); !done) return done;
    if (feed_mode == FeedMode::inverse_time && !c.feed.per_minute.empty()) {
      feed_mode = FeedMode::per_minute;
      if (auto done = put_line(c.feed.per_minute); !done) return done;
    }
    ended = true;
    return put_template(c.program.end, program_values());
  }

  Result<void> write(const Comment& b) {
    std::string text;
    for (char ch : b.text) {
      const bool printable = ch >= ' ' && ch <= '~';
      if (c.comments.upper_case && ch >= 'a' && ch <= 'z') ch = static_cast<char>(ch - 'a' + 'A');
      if (!c.comments.close.empty() && ch == '(') ch = '[';
      if (!c.comments.close.empty() && ch == ')') ch = ']';
      text += printable ? ch : '?';
    }
    std::string_view rest = text;
    do {
      std::size_t n = rest.size();
      if (n > c.comments.max_length) {
        const auto blank = rest.rfind(' ', c.comments.max_length);
        n = blank == std::string_view::npos || blank == 0 ? c.comments.max_length : blank;
      }
      const std::string blank = c.comments.close.empty() ? " " : "";
      if (auto done = put_line(c.comments.open + blank + std::string(rest.substr(0, n)) + c.comments.close);
          !done)
        return done;
      rest.remove_prefix(n);
      rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
    } while (!rest.empty());
    return {};
  }

  Result<void> write(const Raw& b) {
    if (b.text.find_first_of("\r\n") != std::string::npos) return refuse("a raw line must be one line");
    return put_line(b.text);
  }

  Result<void> write(const Dwell& b) {
    if (b.milliseconds <= 0) return {};
    NumberStyle style = linear;
    style.plus_sign = false;
    style.decimals = c.dwell_decimals;
    const std::int64_t step = kPowersOfTen[static_cast<std::size_t>(3 - c.dwell_decimals)];
    Values values;
    values.set(Placeholder::seconds, number_text((b.milliseconds + step / 2) / step, style));
    values.set(Placeholder::milliseconds, std::to_string(b.milliseconds));
    return put_words(c.dwell, values, "a dwell");
  }

  Result<void> write(const Spindle& b) {
    const std::int64_t rpm = b.turn == SpindleTurn::off ? 0 : b.rpm;
    if (spindle.turn == b.turn && spindle.rpm == rpm) return {};
    if (b.turn != SpindleTurn::off && rpm <= 0)
      return refuse("the spindle is to turn at " + std::to_string(b.rpm) + " rpm");
    spindle = {b.turn, rpm};
    const auto& words = b.turn == SpindleTurn::off         ? c.spindle_off
                        : b.turn == SpindleTurn::clockwise ? c.spindle_clockwise
                                                           : c.spindle_counterclockwise;
    return put_words(words, Values().set(Placeholder::rpm, std::to_string(rpm)), "this spindle command");
  }

  Result<void> write(const Coolant& b) {
    const auto kind = static_cast<std::size_t>(b.kind);
    const auto wanted = static_cast<std::uint8_t>(b.kind == CoolantKind::off ? 0 : coolant | (1U << kind));
    if (wanted == coolant) return {};
    coolant = wanted;
    static constexpr std::array kWhat = {"coolant off", "flood coolant", "mist coolant",
                                         "coolant through the tool", "air"};
    return put_words(c.coolant[kind], {}, kWhat[kind]);
  }

  Result<void> write(const ToolCall& b) {
    if (b.tool < 0 || b.length_offset < 0)
      return refuse("tool and length offset numbers must not be negative");
    if (auto done = switch_tcp_off(); !done) return done;
    // The control stops the spindle and the coolant for it, and may move any axis.
    spindle = {};
    coolant = 0;
    length = kUnknown;
    pending_words.clear();
    forget(static_cast<std::uint16_t>(~0U));
    const auto values = Values()
                            .set(Placeholder::tool, std::to_string(b.tool))
                            .set(Placeholder::length_offset, std::to_string(b.length_offset));
    return put_words(c.tool_change, values, "a tool change");
  }

  Result<void> write(const LengthCompensation& b) {
    if (c.length.automatic || length == b.number) return {};
    length = b.number;
    forget(kLinearAxes);
    if (b.number == 0) return put_words(c.length.off, {}, "the end of length compensation");
    const auto values = Values().set(Placeholder::length_offset, std::to_string(b.number));
    return c.length.with_motion ? put_with_motion(c.length.on, values, "length compensation")
                                : put_words(c.length.on, values, "length compensation");
  }

  Result<void> write(const TcpControl& b) {
    if (b.on == tcp) return {};
    tcp = b.on;
    forget(kLinearAxes);
    if (c.tcp.replaces_length) length = 0;
    if (!b.on) return put_words(c.tcp.off, {}, "the end of tool-centre-point control");
    const auto values = Values().set(Placeholder::length_offset, std::to_string(b.length_offset));
    return c.tcp.with_motion ? put_with_motion(c.tcp.on, values, "tool-centre-point control")
                             : put_words(c.tcp.on, values, "tool-centre-point control");
  }

  Result<void> write(const WorkOffset& b) {
    if (b.index == work_offset) return {};
    if (b.index < 1 || static_cast<std::size_t>(b.index) > c.work_offsets.size()) {
      return refuse("work offset " + std::to_string(b.index) + ": the controller file has " +
                    std::to_string(c.work_offsets.size()));
    }
    work_offset = b.index;
    forget(static_cast<std::uint16_t>(~0U));
    return put_template(c.work_offsets[static_cast<std::size_t>(b.index) - 1], {});
  }

  Result<void> write(const PathMode& b) {
    if (path_mode && path_mode->kind == b.kind && path_mode->tolerance == b.tolerance) return {};
    path_mode = b;
    if (b.tolerance > 0) {
      return put_words(c.continuous_within,
                       Values().set(Placeholder::tolerance, number_text(b.tolerance, linear)),
                       "path blending within a tolerance");
    }
    return put_words(c.path_modes[static_cast<std::size_t>(b.kind)], {}, "this path mode");
  }

  Result<void> write(const Retract& b) {
    if (auto done = switch_tcp_off(); !done) return done;
    for (const AxisLetter letter : {AxisLetter::Z, AxisLetter::W, AxisLetter::X, AxisLetter::Y, AxisLetter::A,
                                    AxisLetter::B, AxisLetter::C, AxisLetter::U, AxisLetter::V}) {
      if ((b.axes & AxisWords::bit(letter)) == 0) continue;
      const std::string what = std::string("a safe position of axis ") + letter_of(letter);
      if (auto done = put_words(c.retract[index(letter)], {}, what.c_str()); !done) return done;
      position.forget(letter);
    }
    motion_kind.reset();
    return {};
  }

  Result<void> write(const TiltedPlane& b) {
    if (!b.on && !plane) return {};
    plane = b.on;
    forget(static_cast<std::uint16_t>(~0U));
    if (!b.on) return put_words(c.tilted_plane.off, {}, "the end of a tilted plane");
    Values values;
    static constexpr std::array kOrigin = {Placeholder::x, Placeholder::y, Placeholder::z};
    static constexpr std::array kAngle = {Placeholder::a, Placeholder::b, Placeholder::c};
    for (std::size_t i = 0; i < 3; ++i) {
      values.set(kOrigin[i], number_text(b.origin[i], linear));
      values.set(kAngle[i], number_text(b.angles[i], rotary));
    }
    return put_words(c.tilted_plane.on, values, "a tilted plane");
  }

  Result<void> write(const Stop& b) {
    return put_words(b.optional ? c.optional_stop : c.stop, {}, b.optional ? "an optional stop" : "a stop");
  }

  Result<void> write_block(const Block& block) {
    const bool heads = std::holds_alternative<ProgramStart>(block) || std::holds_alternative<Comment>(block);
    TRUNNION_EXPECTS(started || heads);
    TRUNNION_EXPECTS(!ended);
    if (setup_pending && !heads) {
      if (auto done = flush_setup(!std::holds_alternative<PathMode>(block)); !done) return done;
    }
    return std::visit(
        [this](const auto& b) -> Result<void> {
          if constexpr (std::is_same_v<std::decay_t<decltype(b)>, Motion>) {
            return write_motion(b);
          } else {
            return write(b);
          }
        },
        block);
  }
};

Writer::Writer(const Controller& controller, std::string& out)
    : state_(std::make_unique<State>(controller, out)) {}
Writer::Writer(Writer&&) noexcept = default;
Writer::~Writer() = default;

Result<void> Writer::write(const Motion& motion) {
  return state_->write_motion(motion);
}
Result<void> Writer::write(const Block& block) {
  return state_->write_block(block);
}
std::size_t Writer::lines() const {
  return state_->lines;
}
std::size_t Writer::motions() const {
  return state_->motions;
}

}  // namespace trunnion::nc
