// Arcs, drilling cycles and touches of a probe.
#include <algorithm>
#include <array>
#include <cmath>

#include "nc/reading/lexer.hpp"
#include "nc/writing/writer_state.hpp"

namespace trunnion::nc {
// Words of a feed that is per minute from here on; empty where nothing changes.
std::string Writer::State::per_minute_words(std::int64_t quanta, bool with_number) {
  std::string words;
  if (modal.feed_mode != FeedMode::per_minute) {
    modal.feed_mode = FeedMode::per_minute;
    feed = {kUnknown, kUnknown};
    words = c.feed.per_minute;
  }
  auto& known = feed[static_cast<std::size_t>(FeedMode::per_minute)];
  if (with_number && known != quanta) {
    known = quanta;
    if (!words.empty()) words += c.line.separator;
    words += "F" + number_text(quanta, forms.feed[static_cast<std::size_t>(FeedMode::per_minute)]);
  }
  return words;
}

Result<void> Writer::State::check_shape(std::int64_t feed_quanta, SourceRef where) const {
  if (!due.in_motion.empty() || !due.cutter.empty() || due.restores())
    return refuse("an arc, a drilling cycle or a touch needs a straight motion before it", where);
  const auto mode = static_cast<std::size_t>(FeedMode::per_minute);
  if (feed_quanta <= 0 || feed_quanta > forms.largest_feed[mode]) {
    Motion m;
    m.feed = feed_quanta;
    m.source = where;
    return refuse_feed(m);
  }
  if ((modal.position.mask & kXyz) != kXyz)
    return refuse("an arc, a drilling cycle or a touch from an unknown place", where);
  return {};
}

Result<void> Writer::State::write(const Arc& b) {
  if (auto ok = check_shape(b.feed, b.source); !ok) return ok;
  const bool helix = b.words.has(AxisLetter::Z) && b.words[AxisLetter::Z] != modal.position[AxisLetter::Z];
  const Template& words = c.arcs.words(b.clockwise, helix);
  if (words.empty())
    return refuse("the controller file has no words for this arc: [arcs] in " + c.file, b.source);
  const std::string mode = per_minute_words(b.feed, false);
  const auto center = [&](std::size_t i, AxisLetter letter) {
    return number_text(c.arcs.center_absolute ? b.center[i] : b.center[i] - modal.position[letter],
                       forms.linear);
  };
  Values values;
  values.set(Placeholder::x, number_text(b.words[AxisLetter::X], forms.linear));
  values.set(Placeholder::y, number_text(b.words[AxisLetter::Y], forms.linear));
  if (helix) values.set(Placeholder::z, number_text(b.words[AxisLetter::Z], forms.linear));
  values.set(Placeholder::i, center(0, AxisLetter::X)).set(Placeholder::j, center(1, AxisLetter::Y));
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::string line = render(words[i], values);
    if (i + 1 == words.size()) {
      if (!mode.empty()) line.insert(0, mode + c.line.separator);
      const std::string number = per_minute_words(b.feed, true);
      if (!number.empty()) line += c.line.separator + number;
    }
    if (auto done = put_line(line); !done) return done;
  }
  for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y}) modal.position.set(letter, b.words[letter]);
  if (helix) modal.position.set(AxisLetter::Z, b.words[AxisLetter::Z]);
  modal.motion_kind.reset();
  ++motions;
  return {};
}

// Holes that differ in their place only follow as places.
bool Writer::State::continues_cycle(const Hole& b) const {
  if (!modal.cycle) return false;
  const Hole& a = *modal.cycle;
  return a.kind == b.kind && a.feed == b.feed && a.bottom == b.bottom && a.clear == b.clear &&
         a.step == b.step && a.dwell_ms == b.dwell_ms && a.thread == b.thread &&
         a.words[AxisLetter::Z] == b.words[AxisLetter::Z];
}

Result<void> Writer::State::write(const Hole& b) {
  if (auto ok = check_shape(b.feed, b.source); !ok) return ok;
  const Template& words = c.cycles.words(b);
  if (words.empty())
    return refuse("the controller file has no words for this drilling cycle: [cycles] in " + c.file,
                  b.source);
  const std::int64_t back = b.words[AxisLetter::Z];
  if (!(b.bottom < b.clear && b.clear <= back))
    return refuse("a hole whose bottom is not below its clearance", b.source);
  ++motions;
  if (continues_cycle(b)) return put_next_hole(b);
  if (auto done = end_cycle(); !done) return done;
  if (!holds(words, Placeholder::x) && (changed_axes(b.words) & kPlaneWords) != 0)
    return refuse("the tool must stand over the hole", b.source);
  const bool states_back = holds(words, Placeholder::back) || holds(words, Placeholder::rise);
  const bool to_clear = back == b.clear;
  if (!states_back && !to_clear && back != modal.position[AxisLetter::Z])
    return refuse("the cycle returns to its clearance, or to where it came from", b.source);
  // Without a clearance it begins and ends where the tool stands, and is one hole.
  const bool stands_there = !holds(words, Placeholder::clear);
  if (stands_there && (!to_clear || modal.position[AxisLetter::Z] != b.clear))
    return refuse("the tool must stand at the clearance of the hole", b.source);
  const bool own_feed = holds(words, Placeholder::feed);
  const bool is_tap = b.kind == Hole::Kind::tap;
  if (const std::string modes = per_minute_words(b.feed, !own_feed && !is_tap); !modes.empty()) {
    if (auto done = put_line(modes); !done) return done;
  }
  if (auto done = put_cycle(words, b,
                            stands_there ? nullptr
                            : to_clear   ? &c.cycles.to_clear
                                         : &c.cycles.to_initial);
      !done)
    return done;
  if (is_tap) modal.spindle.reset();
  // Whether the feed of a cycle stays in force afterwards differs.
  if (own_feed) feed = {kUnknown, kUnknown};
  for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y, AxisLetter::Z})
    modal.position.set(letter, b.words[letter]);
  modal.motion_kind.reset();
  if (c.cycles.modal() && !stands_there) modal.cycle = b;
  return {};
}

Result<void> Writer::State::put_cycle(const Template& words, const Hole& b, const Template* in_front) {
  const std::int64_t back = b.words[AxisLetter::Z];
  const auto style = forms.feed[static_cast<std::size_t>(FeedMode::per_minute)];
  NumberStyle seconds = forms.linear;
  seconds.plus_sign = false;
  seconds.decimals = 3;
  NumberStyle unsigned_length = forms.linear;
  unsigned_length.plus_sign = false;
  Values v;
  v.set(Placeholder::x, number_text(b.words[AxisLetter::X], forms.linear));
  v.set(Placeholder::y, number_text(b.words[AxisLetter::Y], forms.linear));
  v.set(Placeholder::clear, number_text(b.clear, forms.linear))
      .set(Placeholder::bottom, number_text(b.bottom, forms.linear));
  v.set(Placeholder::depth, number_text(b.bottom - b.clear, forms.linear));
  v.set(Placeholder::back, number_text(back, forms.linear))
      .set(Placeholder::rise, number_text(back - b.clear, forms.linear));
  // A cycle that always has a step gets one of the whole depth.
  v.set(Placeholder::step, number_text(b.step > 0 ? b.step : b.clear - b.bottom, unsigned_length));
  v.set(Placeholder::feed, number_text(b.feed, style));
  if (b.kind == Hole::Kind::tap) {
    std::int64_t unit = 1;
    for (int i = c.cycles.pitch_decimals; i < kPitchDecimals; ++i) unit *= 10;
    const std::int64_t pitch = (b.thread.pitch + unit / 2) / unit;
    NumberStyle style_of_pitch = forms.linear;
    style_of_pitch.decimals = c.cycles.pitch_decimals;
    v.set(Placeholder::lead,
          number_text(b.thread.hand == Thread::Hand::left ? -pitch : pitch, style_of_pitch));
    style_of_pitch.plus_sign = false;
    v.set(Placeholder::pitch, number_text(pitch, style_of_pitch));
    v.set(Placeholder::rpm, std::to_string(b.thread.rpm));
  }
  v.set(Placeholder::seconds, number_text(b.dwell_ms, seconds));
  v.set(Placeholder::milliseconds, std::to_string(b.dwell_ms));
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::string line = render(words[i], v);
    // Lines before the last one stand by themselves.
    if (i + 1 == words.size() && in_front != nullptr && !in_front->empty())
      line.insert(0, in_front->front() + c.line.separator);
    if (auto done = put_line(line); !done) return done;
  }
  return {};
}

Result<void> Writer::State::put_next_hole(const Hole& b) {
  const std::uint16_t changed = changed_axes(b.words) & kPlaneWords;
  std::string line;
  for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y}) {
    // A line without an axis word would drill nothing.
    if (changed != 0 && (changed & AxisWords::bit(letter)) == 0) continue;
    if (!line.empty()) line += c.line.separator;
    line += letter_of(letter) + number_text(b.words[letter], forms.linear);
    modal.position.set(letter, b.words[letter]);
  }
  return put_line(line);
}

Result<void> Writer::State::write(const Probe& b) {
  if (auto ok = check_shape(b.feed, b.source); !ok) return ok;
  if ((b.words.mask & kXyz) != kXyz) return refuse("a touch must name X, Y and Z", b.source);
  if (const std::string modes = per_minute_words(b.feed, false); !modes.empty()) {
    if (auto done = put_line(modes); !done) return done;
  }
  static constexpr std::array kEnd = {Placeholder::x, Placeholder::y, Placeholder::z};
  static constexpr std::array kWay = {Placeholder::dx, Placeholder::dy, Placeholder::dz};
  Values values;
  double square = 0.0;
  for (std::size_t i = 0; i < kEnd.size(); ++i) {
    const AxisLetter letter = kAllAxisLetters[i];
    const std::int64_t way = b.words[letter] - modal.position[letter];
    square += static_cast<double>(way) * static_cast<double>(way);
    values.set(kEnd[i], number_text(b.words[letter], forms.linear));
    values.set(kWay[i], number_text(way, forms.linear));
  }
  values.set(Placeholder::distance, number_text(std::llround(std::sqrt(square)), forms.linear));
  values.set(Placeholder::feed,
             number_text(b.feed, forms.feed[static_cast<std::size_t>(FeedMode::per_minute)]));
  // What the words leave in force is not the same on all controls: the next motion says it anew.
  feed = {kUnknown, kUnknown};
  modal.motion_kind.reset();
  modal.position.forget(kLinearAxes);
  ++motions;
  if (b.guards) {
    // It has gone its whole way, or the program stops.
    modal.position.set(AxisLetter::X, b.words[AxisLetter::X]);
    modal.position.set(AxisLetter::Y, b.words[AxisLetter::Y]);
    modal.position.set(AxisLetter::Z, b.words[AxisLetter::Z]);
    const Template& words = b.first && !c.probing.first.empty() ? c.probing.first : c.probing.guarded;
    return put_words(words, values, "a guarded motion", "[probing] guarded");
  }
  return put_words(c.probing.touch, values, "a touch of a probe", "[probing] touch");
}

Result<void> Writer::State::write(const ProbeLog& b) {
  if (!c.has_probing()) return no_words("a touch of a probe", "[probing] touch");
  if (b.kind == ProbeLog::Kind::declare) return put_template(c.probing.declare, {});
  if (b.kind == ProbeLog::Kind::close) return put_template(c.probing.close, {});
  const auto may_stand = [](char ch) { return is_letter(ch) || is_digit(ch) || ch == '-' || ch == '.'; };
  if (b.name.empty() || !std::all_of(b.name.begin(), b.name.end(), may_stand))
    return refuse("the file of touches '" + b.name + "' may hold letters, digits, - and . only");
  const Template& words = b.kind == ProbeLog::Kind::open ? c.probing.open : c.probing.record;
  return put_template(words, Values().set(Placeholder::name, b.name));
}

Result<void> Writer::State::end_cycle() {
  if (!modal.cycle) return {};
  modal.cycle.reset();
  return put_template(c.cycles.off, {});
}

}  // namespace trunnion::nc
