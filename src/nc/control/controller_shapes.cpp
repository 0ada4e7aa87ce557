#include "nc/control/section_reading.hpp"
#include "nc/reading/hole_calls.hpp"

namespace trunnion::nc {
namespace {

using P = Placeholder;

void read_arcs(Section& s, Controller& c) {
  auto& a = c.arcs;
  read_template(s, "clockwise", {P::x, P::y, P::i, P::j}, a.clockwise);
  read_template(s, "counterclockwise", {P::x, P::y, P::i, P::j}, a.counterclockwise);
  read_template(s, "helix_clockwise", {P::x, P::y, P::z, P::i, P::j}, a.helix_clockwise);
  read_template(s, "helix_counterclockwise", {P::x, P::y, P::z, P::i, P::j}, a.helix_counterclockwise);
  read_choice<bool>(s, "center", {{"from_start", false}, {"absolute", true}}, a.center_absolute);
  a.radius_tolerance_mm = s.quantity_or("radius_tolerance_mm", a.radius_tolerance_mm);
  if (a.clockwise.empty() != a.counterclockwise.empty())
    s.error("clockwise", "'clockwise' and 'counterclockwise' go together");
  if (a.helix_clockwise.empty() != a.helix_counterclockwise.empty())
    s.error("helix_clockwise", "'helix_clockwise' and 'helix_counterclockwise' go together");
  if (!a.clockwise.empty() && !(a.radius_tolerance_mm > 0.0))
    s.error("radius_tolerance_mm", "'radius_tolerance_mm' must be above 0");
}

void read_cycles(Section& s, Controller& c) {
  auto& y = c.cycles;
  const std::set<P> allowed = {P::x,    P::y,    P::clear, P::bottom,  P::depth,       P::back,
                               P::rise, P::step, P::feed,  P::seconds, P::milliseconds};
  static constexpr std::array kKeys = {"drill", "peck", "chip_break", "feed_out"};
  for (std::size_t i = 0; i < kKeys.size(); ++i) {
    const std::string dwell = std::string(kKeys[i]) + "_dwell";
    read_template(s, kKeys[i], allowed, y.plain[i]);
    read_template(s, dwell.c_str(), allowed, y.dwell[i]);
    for (const Template* words : {&y.plain[i], &y.dwell[i]}) {
      const bool ends = holds(*words, P::bottom) || holds(*words, P::depth);
      if (!words->empty() && !(ends && holds(*words, P::clear)))
        s.error(kKeys[i], std::string("'") + kKeys[i] + "' needs {clear}, and {bottom} or {depth}");
    }
  }
  std::set<P> of_taps = allowed;
  of_taps.insert({P::rpm, P::pitch, P::lead});
  for (const P none : {P::step, P::seconds, P::milliseconds}) of_taps.erase(none);
  read_template(s, "tap", of_taps, y.tap);
  read_template(s, "tap_left", of_taps, y.tap_left);
  for (const Template* words : {&y.tap, &y.tap_left}) {
    const char* const key = words == &y.tap ? "tap" : "tap_left";
    const int geared = holds(*words, P::feed) + holds(*words, P::pitch) + holds(*words, P::lead);
    if (words->empty()) continue;
    if (!(holds(*words, P::bottom) || holds(*words, P::depth)) || geared != 1)
      s.error(key,
              std::string("'") + key + "' needs {bottom} or {depth}, and one of {feed}, {pitch} and {lead}");
  }
  if (y.tap.empty() && !y.tap_left.empty()) s.error("tap_left", "'tap_left' needs 'tap' too");
  read_integer(s, "pitch_decimals", y.pitch_decimals, 1, kPitchDecimals);
  read_template(s, "to_clear", {}, y.to_clear);
  read_template(s, "to_initial", {}, y.to_initial);
  read_template(s, "off", {}, y.off);
  read_into(s, "initial_at_start", y.initial_at_start);
  read_into(s, "dwell_feeds_to_return", y.dwell_feeds_to_return);
  y.back_mm = s.quantity_or("back_mm", y.back_mm);
  const bool steps = !y.plain[1].empty() || !y.plain[2].empty();
  if (steps && !(y.back_mm > 0.0)) s.error("back_mm", "'back_mm' must be above 0 for cycles with steps");
}

// Those of a file replace those of its base.
void read_cycles_of_others(Section& root, Controller& c) {
  auto sections = root.sections("cycle_of_others");
  if (!sections.empty()) c.input.flow.holes.cycles.clear();
  for (Section& s : sections) {
    Controller::Input::Flow::Holes::Cycle cycle;
    cycle.begins = s.text("begins");
    read_choice<Hole::Kind>(s, "kind",
                            {{"drill", Hole::Kind::drill},
                             {"peck", Hole::Kind::peck},
                             {"chip_break", Hole::Kind::chip_break},
                             {"feed_out", Hole::Kind::feed_out},
                             {"tap", Hole::Kind::tap}},
                            cycle.kind);
    cycle.values = s.texts("values");
    read_template(s, "lines", {P::clear, P::bottom, P::depth, P::back, P::rise, P::feed, P::seconds},
                  cycle.lines);
    if (cycle.begins.empty()) s.error("begins", "'begins' is empty");
    const bool by_place = cycle.begins.ends_with('(');
    for (const std::string& value : cycle.values) {
      const auto sign = value.find('=');
      if (by_place != (sign == std::string::npos) ||
          !is_meaning_in_cycle(std::string_view(value).substr(by_place ? 0 : sign + 1)))
        s.error("values", "'" + value + "' is no value of a cycle");
    }
    s.finish();
    c.input.flow.holes.cycles.push_back(std::move(cycle));
  }
}

void read_probing(Section& s, Controller& c) {
  auto& p = c.probing;
  read_template(s, "touch", {P::x, P::y, P::z, P::dx, P::dy, P::dz, P::distance, P::feed}, p.touch);
  read_template(s, "guarded", {P::x, P::y, P::z, P::feed}, p.guarded);
  read_template(s, "first", {P::x, P::y, P::z, P::feed}, p.first);
  read_template(s, "declare", {}, p.declare);
  read_template(s, "open", {P::name}, p.open);
  read_template(s, "record", {P::name}, p.record);
  read_template(s, "close", {}, p.close);
  read_into(s, "suffix", p.suffix);
  read_into(s, "confirmed", p.confirmed);
  const auto hold_all = [](const Template& lines, std::initializer_list<P> all) {
    return std::all_of(all.begin(), all.end(), [&](P one) { return holds(lines, one); });
  };
  const bool ends = hold_all(p.touch, {P::x, P::y, P::z});
  const bool ways = hold_all(p.touch, {P::dx, P::dy, P::dz});
  if (!p.touch.empty() && (ends == ways || !holds(p.touch, P::feed)))
    s.error("touch", "'touch' must hold {feed}, and {x}, {y}, {z} or {dx}, {dy}, {dz}");
  if (!p.guarded.empty() && !hold_all(p.guarded, {P::x, P::y, P::z, P::feed}))
    s.error("guarded", "'guarded' must hold {x}, {y}, {z} and {feed}");
  if (!p.first.empty() && (p.guarded.empty() || !hold_all(p.first, {P::x, P::y, P::z, P::feed})))
    s.error("first", "'first' must hold {x}, {y}, {z} and {feed}, and needs 'guarded' too");
  if (!p.touch.empty() && p.open.empty() && p.record.empty())
    s.error("touch", "'touch' needs 'open' or 'record': else the control keeps no touch");
}

}  // namespace

void read_shapes(Section& root, Controller& c) {
  in_section(root, "arcs", [&](Section& s) { read_arcs(s, c); });
  in_section(root, "cycles", [&](Section& s) { read_cycles(s, c); });
  read_cycles_of_others(root, c);
  in_section(root, "probing", [&](Section& s) { read_probing(s, c); });
  in_section(root, "axis_numbers", [&](Section& s) {
    for (const auto& axes : s.keys("^(any|[ABC]{1,3})$")) {
      if (const auto lines = s.find_texts(axes)) c.axis_numbers[axes] = *lines;
    }
  });
  in_section(root, "post", [&](Section& s) {
    const std::vector<std::pair<const char*, bool>> choices = {{"native", true}, {"moves", false}};
    read_choice<bool>(s, "arcs", choices, c.arcs.native);
    read_choice<bool>(s, "cycles", choices, c.cycles.native);
  });
}

}  // namespace trunnion::nc
