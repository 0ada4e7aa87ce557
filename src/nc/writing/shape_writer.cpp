#include "nc/writing/shape_writer.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "nc/reading/lexer.hpp"

namespace trunnion::nc {

// Words of a feed that is per minute from here on; empty where nothing changes.
std::string ShapeWriter::per_minute_words(std::int64_t quanta, bool with_number) {
  std::string words;
  if (s_.modal.feed_mode != FeedMode::per_minute) {
    s_.modal.feed_mode = FeedMode::per_minute;
    s_.feed = {kUnknown, kUnknown};
    words = s_.c.feed.per_minute;
  }
  auto& known = s_.feed[static_cast<std::size_t>(FeedMode::per_minute)];
  if (with_number && known != quanta) {
    known = quanta;
    if (!words.empty()) words += s_.c.line.separator;
    words += "F" + s_.number_text(quanta, s_.forms.feed[static_cast<std::size_t>(FeedMode::per_minute)]);
  }
  return words;
}

Result<void> ShapeWriter::check_shape(std::int64_t feed_quanta, SourceRef where) const {
  if (!s_.due.in_motion.empty() || !s_.due.cutter.empty() || s_.due.restores())
    return s_.refuse("an arc, a drilling cycle or a touch needs a straight motion before it", where);
  const auto mode = static_cast<std::size_t>(FeedMode::per_minute);
  if (feed_quanta <= 0 || feed_quanta > s_.forms.largest_feed[mode]) {
    Motion m;
    m.feed = feed_quanta;
    m.source = where;
    return s_.refuse_feed(m);
  }
  if ((s_.modal.position.mask & kXyz) != kXyz)
    return s_.refuse("an arc, a drilling cycle or a touch from an unknown place", where);
  return {};
}

Result<void> ShapeWriter::write(const Arc& b) {
  if (auto ok = check_shape(b.feed, b.source); !ok) return ok;
  const bool helix = b.words.has(AxisLetter::Z) && b.words[AxisLetter::Z] != s_.modal.position[AxisLetter::Z];
  const Template& words = s_.c.arcs.words(b.clockwise, helix);
  if (words.empty())
    return s_.refuse("the controller file has no words for this arc: [arcs] in " + s_.c.file, b.source);
  const std::string mode = per_minute_words(b.feed, false);
  const auto center = [&](std::size_t i, AxisLetter letter) {
    return s_.number_text(s_.c.arcs.center_absolute ? b.center[i] : b.center[i] - s_.modal.position[letter],
                          s_.forms.linear);
  };
  Values values;
  values.set(Placeholder::x, s_.number_text(b.words[AxisLetter::X], s_.forms.linear));
  values.set(Placeholder::y, s_.number_text(b.words[AxisLetter::Y], s_.forms.linear));
  if (helix) values.set(Placeholder::z, s_.number_text(b.words[AxisLetter::Z], s_.forms.linear));
  values.set(Placeholder::i, center(0, AxisLetter::X)).set(Placeholder::j, center(1, AxisLetter::Y));
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::string line = render(words[i], values);
    if (i + 1 == words.size()) {
      if (!mode.empty()) line.insert(0, mode + s_.c.line.separator);
      const std::string number = per_minute_words(b.feed, true);
      if (!number.empty()) line += s_.c.line.separator + number;
    }
    if (auto done = s_.put_line(line); !done) return done;
  }
  for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y})
    s_.modal.position.set(letter, b.words[letter]);
  if (helix) s_.modal.position.set(AxisLetter::Z, b.words[AxisLetter::Z]);
  s_.modal.motion_kind.reset();
  ++s_.motions;
  return {};
}

// Holes that differ in their place only follow as places.
bool ShapeWriter::continues_cycle(const Hole& b) const {
  if (!s_.modal.cycle) return false;
  const Hole& a = *s_.modal.cycle;
  return a.kind == b.kind && a.feed == b.feed && a.bottom == b.bottom && a.clear == b.clear &&
         a.step == b.step && a.dwell_ms == b.dwell_ms && a.thread == b.thread &&
         a.words[AxisLetter::Z] == b.words[AxisLetter::Z];
}

Result<void> ShapeWriter::write(const Hole& b) {
  if (auto ok = check_shape(b.feed, b.source); !ok) return ok;
  const Template& words = s_.c.cycles.words(b);
  if (words.empty())
    return s_.refuse("the controller file has no words for this drilling cycle: [cycles] in " + s_.c.file,
                     b.source);
  const std::int64_t back = b.words[AxisLetter::Z];
  if (!(b.bottom < b.clear && b.clear <= back))
    return s_.refuse("a hole whose bottom is not below its clearance", b.source);
  ++s_.motions;
  if (continues_cycle(b)) return put_next_hole(b);
  if (auto done = end_cycle(); !done) return done;
  if (!holds(words, Placeholder::x) && (s_.changed_axes(b.words) & kPlaneWords) != 0)
    return s_.refuse("the tool must stand over the hole", b.source);
  const bool states_back = holds(words, Placeholder::back) || holds(words, Placeholder::rise);
  const bool to_clear = back == b.clear;
  if (!states_back && !to_clear && back != s_.modal.position[AxisLetter::Z])
    return s_.refuse("the cycle returns to its clearance, or to where it came from", b.source);
  // Without a clearance it begins and ends where the tool stands, and is one hole.
  const bool stands_there = !holds(words, Placeholder::clear);
  if (stands_there && (!to_clear || s_.modal.position[AxisLetter::Z] != b.clear))
    return s_.refuse("the tool must stand at the clearance of the hole", b.source);
  const bool own_feed = holds(words, Placeholder::feed);
  const bool is_tap = b.kind == Hole::Kind::tap;
  if (const std::string modes = per_minute_words(b.feed, !own_feed && !is_tap); !modes.empty()) {
    if (auto done = s_.put_line(modes); !done) return done;
  }
  if (auto done = put_cycle(words, b,
                            stands_there ? nullptr
                            : to_clear   ? &s_.c.cycles.to_clear
                                         : &s_.c.cycles.to_initial);
      !done)
    return done;
  if (is_tap) s_.modal.spindle.reset();
  // Whether the feed of a cycle stays in force afterwards differs.
  if (own_feed) s_.feed = {kUnknown, kUnknown};
  for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y, AxisLetter::Z})
    s_.modal.position.set(letter, b.words[letter]);
  s_.modal.motion_kind.reset();
  if (s_.c.cycles.modal() && !stands_there) s_.modal.cycle = b;
  return {};
}

Result<void> ShapeWriter::put_cycle(const Template& words, const Hole& b, const Template* in_front) {
  const std::int64_t back = b.words[AxisLetter::Z];
  const auto style = s_.forms.feed[static_cast<std::size_t>(FeedMode::per_minute)];
  Values v;
  v.set(Placeholder::x, s_.number_text(b.words[AxisLetter::X], s_.forms.linear));
  v.set(Placeholder::y, s_.number_text(b.words[AxisLetter::Y], s_.forms.linear));
  v.set(Placeholder::clear, s_.number_text(b.clear, s_.forms.linear))
      .set(Placeholder::bottom, s_.number_text(b.bottom, s_.forms.linear));
  v.set(Placeholder::depth, s_.number_text(b.bottom - b.clear, s_.forms.linear));
  v.set(Placeholder::back, s_.number_text(back, s_.forms.linear))
      .set(Placeholder::rise, s_.number_text(back - b.clear, s_.forms.linear));
  // A cycle that always has a step gets one of the whole depth.
  v.set(Placeholder::step,
        s_.number_text(b.step > 0 ? b.step : b.clear - b.bottom, s_.forms.unsigned_length()));
  v.set(Placeholder::feed, s_.number_text(b.feed, style));
  if (b.kind == Hole::Kind::tap) {
    std::int64_t unit = 1;
    for (int i = s_.c.cycles.pitch_decimals; i < kPitchDecimals; ++i) unit *= 10;
    const std::int64_t pitch = (b.thread.pitch + unit / 2) / unit;
    NumberStyle style_of_pitch = s_.forms.linear;
    style_of_pitch.decimals = s_.c.cycles.pitch_decimals;
    v.set(Placeholder::lead,
          s_.number_text(b.thread.hand == Thread::Hand::left ? -pitch : pitch, style_of_pitch));
    v.set(Placeholder::pitch, s_.number_text(pitch, s_.forms.unsigned_of(s_.c.cycles.pitch_decimals)));
    v.set(Placeholder::rpm, std::to_string(b.thread.rpm));
  }
  v.set(Placeholder::seconds, s_.number_text(b.dwell_ms, s_.forms.unsigned_of(3)));
  v.set(Placeholder::milliseconds, std::to_string(b.dwell_ms));
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::string line = render(words[i], v);
    // Lines before the last one stand by themselves.
    if (i + 1 == words.size() && in_front != nullptr && !in_front->empty())
      line.insert(0, in_front->front() + s_.c.line.separator);
    if (auto done = s_.put_line(line); !done) return done;
  }
  return {};
}

Result<void> ShapeWriter::put_next_hole(const Hole& b) {
  const std::uint16_t changed = s_.changed_axes(b.words) & kPlaneWords;
  std::string line;
  for (const AxisLetter letter : {AxisLetter::X, AxisLetter::Y}) {
    // A line without an axis word would drill nothing.
    if (changed != 0 && (changed & AxisWords::bit(letter)) == 0) continue;
    if (!line.empty()) line += s_.c.line.separator;
    line += letter_of(letter) + s_.number_text(b.words[letter], s_.forms.linear);
    s_.modal.position.set(letter, b.words[letter]);
  }
  return s_.put_line(line);
}

Result<void> ShapeWriter::write(const Probe& b) {
  if (auto ok = check_shape(b.feed, b.source); !ok) return ok;
  if ((b.words.mask & kXyz) != kXyz) return s_.refuse("a touch must name X, Y and Z", b.source);
  if (const std::string modes = per_minute_words(b.feed, false); !modes.empty()) {
    if (auto done = s_.put_line(modes); !done) return done;
  }
  Values values;
  double square = 0.0;
  for (std::size_t i = 0; i < kPlaceXyz.size(); ++i) {
    const AxisLetter letter = kAllAxisLetters[i];
    const std::int64_t way = b.words[letter] - s_.modal.position[letter];
    square += static_cast<double>(way) * static_cast<double>(way);
    values.set(kPlaceXyz[i], s_.number_text(b.words[letter], s_.forms.linear));
    values.set(kWayXyz[i], s_.number_text(way, s_.forms.linear));
  }
  values.set(Placeholder::distance, s_.number_text(std::llround(std::sqrt(square)), s_.forms.linear));
  values.set(Placeholder::feed,
             s_.number_text(b.feed, s_.forms.feed[static_cast<std::size_t>(FeedMode::per_minute)]));
  // What the words leave in force is not the same on all controls: the next motion says it anew.
  s_.feed = {kUnknown, kUnknown};
  s_.modal.motion_kind.reset();
  s_.modal.position.forget(kLinearAxes);
  ++s_.motions;
  if (b.guards) {
    // It has gone its whole way, or the program stops.
    s_.modal.position.set(AxisLetter::X, b.words[AxisLetter::X]);
    s_.modal.position.set(AxisLetter::Y, b.words[AxisLetter::Y]);
    s_.modal.position.set(AxisLetter::Z, b.words[AxisLetter::Z]);
    const Template& words =
        b.first && !s_.c.probing.first.empty() ? s_.c.probing.first : s_.c.probing.guarded;
    return s_.put_words(words, values, "a guarded motion", "[probing] guarded");
  }
  return s_.put_words(s_.c.probing.touch, values, "a touch of a probe", "[probing] touch");
}

Result<void> ShapeWriter::write(const ProbeLog& b) {
  if (!s_.c.has_probing()) return s_.no_words("a touch of a probe", "[probing] touch");
  if (b.kind == ProbeLog::Kind::declare) return s_.put_template(s_.c.probing.declare, {});
  if (b.kind == ProbeLog::Kind::close) return s_.put_template(s_.c.probing.close, {});
  const auto may_stand = [](char ch) { return is_of_name(ch) || ch == '-' || ch == '.'; };
  if (b.name.empty() || !std::all_of(b.name.begin(), b.name.end(), may_stand))
    return s_.refuse("the file of touches '" + b.name + "' may hold letters, digits, - and . only");
  const Template& words = b.kind == ProbeLog::Kind::open ? s_.c.probing.open : s_.c.probing.record;
  return s_.put_template(words, Values().set(Placeholder::name, b.name));
}

Result<void> ShapeWriter::end_cycle() {
  if (!s_.modal.cycle) return {};
  s_.modal.cycle.reset();
  return s_.put_template(s_.c.cycles.off, {});
}

}  // namespace trunnion::nc
