#include "nc/section_reading.hpp"

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
  read_template(s, "to_clear", {}, y.to_clear);
  read_template(s, "to_initial", {}, y.to_initial);
  read_template(s, "off", {}, y.off);
  read_into(s, "dwell_feeds_to_return", y.dwell_feeds_to_return);
  y.back_mm = s.quantity_or("back_mm", y.back_mm);
  const bool steps = !y.plain[1].empty() || !y.plain[2].empty();
  if (steps && !(y.back_mm > 0.0)) s.error("back_mm", "'back_mm' must be above 0 for cycles with steps");
}

void read_probing(Section& s, Controller& c) {
  auto& p = c.probing;
  read_template(s, "touch", {P::x, P::y, P::z, P::feed}, p.touch);
  read_template(s, "open", {P::name}, p.open);
  read_template(s, "record", {}, p.record);
  read_template(s, "close", {}, p.close);
  for (const P needed : {P::x, P::y, P::z, P::feed}) {
    if (!p.touch.empty() && !holds(p.touch, needed))
      s.error("touch", "'touch' must hold {x}, {y}, {z} and {feed}");
  }
  if (!p.touch.empty() && (p.open.empty() || p.close.empty()))
    s.error("touch", "'touch' needs 'open' and 'close' too");
}

}  // namespace

void read_shapes(Section& root, Controller& c) {
  in_section(root, "arcs", [&](Section& s) { read_arcs(s, c); });
  in_section(root, "cycles", [&](Section& s) { read_cycles(s, c); });
  in_section(root, "probing", [&](Section& s) { read_probing(s, c); });
  in_section(root, "axis_numbers", [&](Section& s) {
    for (const auto& axes : s.keys("^(any|[ABC]{1,3})$")) {
      if (const auto lines = s.find_texts(axes)) c.axis_numbers[axes] = *lines;
    }
  });
  in_section(root, "post", [&](Section& s) {
    const std::vector<std::pair<const char*, bool>> choices = {{"native", true}, {"moves", false}};
    read_choice<bool>(s, "arcs", choices, c.native_arcs);
    read_choice<bool>(s, "cycles", choices, c.native_cycles);
  });
}

}  // namespace trunnion::nc
