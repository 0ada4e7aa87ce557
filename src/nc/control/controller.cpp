#include "trunnion/nc/controller.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/files.hpp"
#include "trunnion/base/nearest_name.hpp"
#include "trunnion/base/texts.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/section.hpp"

#include "nc/control/base_differences.hpp"
#include "nc/control/patterns.hpp"
#include "nc/control/section_reading.hpp"
#include "nc/control/setup_check.hpp"
#include "nc/digits.hpp"

namespace trunnion::nc {
namespace {

using config::Section;
using config::Value;

void read_numbers(Section& s, Controller& c) {
  int linear = c.numbers.axes.decimals(AxisLetter::X);
  int rotary = c.numbers.axes.decimals(AxisLetter::A);
  read_integer(s, "linear_decimals", linear, 0, kMaxDecimals);
  read_integer(s, "rotary_decimals", rotary, 0, kMaxDecimals);
  c.numbers.axes = AxisFormat(linear, rotary);
  read_integer(s, "feed_decimals", c.numbers.feed.per_minute_decimals, 0, kMaxDecimals);
  read_integer(s, "inverse_time_decimals", c.numbers.feed.inverse_time_decimals, 0, kMaxDecimals);
  read_into(s, "trailing_zeros", c.numbers.trailing_zeros);
  read_into(s, "decimal_point_required", c.numbers.point_required);
  read_into(s, "plus_sign", c.numbers.plus_sign);
}

// The text of a comment must not end it, and the program's own comments must come out as they are.
void check_comments(Section& s, const Controller::Comments& comments) {
  constexpr std::string_view kNeeded = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 .:";
  const std::string& listed = comments.characters;
  for (const char ch : kNeeded) {
    if (listed.find(ch) == std::string::npos)
      return s.error("characters", std::string("'characters' must hold '") + ch +
                                       "': capital letters, digits, blank, point and colon are needed");
  }
  for (const char ch : listed) {
    const bool ends = comments.close.find(ch) != std::string::npos;
    if (ch < ' ' || ch > '~' || ch == '%' || ends)
      return s.error("characters",
                     "'characters' must hold printable ASCII characters only, no '%' and none "
                     "that ends a comment");
  }
  const auto is_listed = [&](char ch) { return listed.find(ch) != std::string::npos; };
  const std::string& mark = comments.mark;
  if (mark.empty() || mark.size() > 8 || !std::all_of(mark.begin(), mark.end(), is_listed) ||
      is_of_name(mark.front()) || mark.front() == ' ')
    s.error("mark",
            "'mark' must be 1 to 8 of the listed 'characters', the first neither a letter nor a digit");
  for (const std::string& word : comments.active_words) {
    if (word.empty() ||
        !std::all_of(word.begin(), word.end(), [](char ch) { return ch >= 'A' && ch <= 'Z'; }))
      s.error("active_words", "'active_words' must be words of capital letters, not \"" + word + "\"");
  }
}

void read_layout(Section& root, Controller& c) {
  in_section(root, "line", [&](Section& s) {
    read_integer(s, "max_characters", c.line.max_length, 40, 10000);
    read_into(s, "separator", c.line.separator);
    read_integer(s, "m_words", c.line.m_words, 0, 99);
    read_into(s, "m_words_before_motion", c.line.m_words_before_motion);
    read_choice<std::string>(s, "end", {{"lf", "\n"}, {"crlf", "\r\n"}}, c.line.end);
  });
  in_section(root, "block_numbers", [&](Section& s) {
    auto& n = c.block_numbers;
    read_into(s, "enabled", n.enabled);
    read_into(s, "prefix", n.prefix);
    read_integer(s, "start", n.start, 0, 999999999);
    read_integer(s, "step", n.step, 1, 1000000);
    read_integer(s, "max", n.max, 1, 999999999);
    if (auto v = s.find_texts("not_before")) n.not_before = *v;
  });
  in_section(root, "comments", [&](Section& s) {
    read_into(s, "open", c.comments.open);
    read_into(s, "close", c.comments.close);
    if (auto v = s.find_texts("also_read")) c.comments.also_read = *v;
    // The verdict of the verification is one line.
    read_integer(s, "max_characters", c.comments.max_length, 60, 1000);
    read_into(s, "upper_case", c.comments.upper_case);
    read_into(s, "characters", c.comments.characters);
    read_into(s, "mark", c.comments.mark);
    if (auto v = s.find_texts("active_words")) c.comments.active_words = *v;
    if (c.comments.open.empty()) s.error("open", "'open' must not be empty");
    check_comments(s, c.comments);
  });
}

// "{axis}=DC({angle})"
void read_modulo_word(Section& s, Controller& c) {
  const auto word = s.find_text("modulo_word");
  if (!word) return;
  constexpr std::string_view kAxis = "{axis}";
  constexpr std::string_view kAngle = "{angle}";
  constexpr std::size_t kLongest = 8;
  const std::string_view text = *word;
  const auto angle = text.find(kAngle);
  const std::string_view open = angle == text.npos ? "" : text.substr(0, angle);
  if (!text.empty() && (!open.starts_with(kAxis) || open.size() == kAxis.size())) {
    return s.error("modulo_word", "'modulo_word' must be {axis}, some text, {angle}: \"{axis}=DC({angle})\"");
  }
  c.rotary.modulo_open = text.empty() ? "" : open.substr(kAxis.size());
  c.rotary.modulo_close = text.empty() ? "" : text.substr(angle + kAngle.size());
  if (c.rotary.modulo_open.size() > kLongest || c.rotary.modulo_close.size() > kLongest)
    s.error("modulo_word", "'modulo_word': at most 8 characters before and behind {angle}");
}

void read_motion(Section& root, Controller& c) {
  in_section(root, "motion", [&](Section& s) {
    read_into(s, "rapid", c.motion.rapid);
    read_into(s, "linear", c.motion.linear);
    read_into(s, "modal", c.motion.modal);
    read_into(s, "rapid_suffix", c.motion.rapid_suffix);
    read_into(s, "straight_rapids_need", c.motion.straight_rapids_need);
  });
  in_section(root, "feed", [&](Section& s) {
    read_into(s, "per_minute", c.feed.per_minute);
    read_into(s, "inverse_time", c.feed.inverse_time);
    read_into(s, "inverse_time_every_block", c.feed.inverse_time_every_block);
    read_choice<FeedPath>(
        s, "path", {{"linear_first", FeedPath::linear_first}, {"all_axes", FeedPath::all_axes}}, c.feed.path);
    if (auto v = s.find_number("max_per_minute")) c.feed.max_per_minute = *v;
    read_into(s, "per_minute_needs", c.feed.per_minute_needs);
    if (auto v = s.find_number("max_inverse_time")) c.feed.max_inverse_time = *v;
    if (auto v = s.find_quantity("min_linear_rate_mm_min")) c.feed.min_linear_rate_mm_s = *v;
    read_into(s, "looks_ahead", c.feed.looks_ahead);
  });
  in_section(root, "incremental", [&](Section& s) {
    using P = Placeholder;
    read_into(s, "on", c.incremental.on);
    read_into(s, "off", c.incremental.off);
    read_template(s, "move", {P::axis, P::distance, P::feed}, c.incremental.move);
    if (c.incremental.on.empty() != c.incremental.off.empty())
      s.error("on", "[incremental] needs both 'on' and 'off', or neither");
    for (const P needed : {P::axis, P::distance, P::feed}) {
      if (!c.incremental.move.empty() && !holds(c.incremental.move, needed))
        s.error("move", "'move' must hold {axis}, {distance} and {feed}");
    }
  });
  in_section(root, "rotary", [&](Section& s) {
    read_into(s, "shorter_way", c.rotary.shorter_way);
    read_into(s, "straight_way", c.rotary.straight_way);
    read_modulo_word(s, c);
    const auto axes = s.find_texts("modulo_axes");
    if (!axes) return;
    c.rotary.modulo_axes = 0;
    for (const auto& name : *axes) {
      const auto letter = axis_letter(name);
      if (letter && is_rotary(*letter)) {
        c.rotary.modulo_axes = static_cast<std::uint16_t>(c.rotary.modulo_axes | AxisWords::bit(*letter));
      } else {
        s.error("modulo_axes", "'" + name + "' is no rotary axis: A, B or C");
      }
    }
  });
}

void read_compensation(Section& root, Controller& c) {
  using P = Placeholder;
  in_section(root, "length", [&](Section& s) {
    read_template(s, "on", {P::length_offset}, c.length.on);
    read_template(s, "off", {}, c.length.off);
    read_into(s, "automatic", c.length.automatic);
    read_into(s, "with_motion", c.length.with_motion);
    read_into(s, "moves_at_once", c.length.moves_at_once);
  });
  in_section(root, "tcp", [&](Section& s) {
    read_template(s, "on", {P::length_offset}, c.tcp.on);
    read_template(s, "off", {}, c.tcp.off);
    read_into(s, "with_motion", c.tcp.with_motion);
    read_into(s, "off_for_tool_change", c.tcp.off_for_tool_change);
    read_into(s, "replaces_length", c.tcp.replaces_length);
    read_into(s, "switches_kinematics", c.tcp.switches_kinematics);
    read_into(s, "off_at_start", c.tcp.off_at_start);
  });
  in_section(root, "cutter_compensation", [&](Section& s) {
    read_template(s, "off", {}, c.cutter_compensation[0]);
    read_template(s, "left", {P::number}, c.cutter_compensation[1]);
    read_template(s, "right", {P::number}, c.cutter_compensation[2]);
    read_into(s, "register_is_tool", c.wear_register_is_tool);
    for (std::size_t i = 1; i < 3; ++i) {
      if (c.cutter_compensation[0].empty() || !holds(c.cutter_compensation[i], P::number))
        s.error("off", "'left', 'right' and 'off' go together, the first two with {number}");
    }
  });
  in_section(root, "tilted_plane", [&](Section& s) {
    read_template(s, "on", {P::x, P::y, P::z, P::a, P::b, P::c, P::direction}, c.tilted_plane.on);
    read_template(s, "off", {}, c.tilted_plane.off);
    read_into(s, "needs_length", c.tilted_plane.needs_length);
    read_into(s, "off_at_start", c.tilted_plane.off_at_start);
    read_into(s, "off_before_next", c.tilted_plane.off_before_next);
    read_choice<PlaneAngles>(s, "angles",
                             {{"euler_zxz", PlaneAngles::euler_zxz},
                              {"euler_xyz", PlaneAngles::euler_xyz},
                              {"fixed_xyz", PlaneAngles::fixed_xyz}},
                             c.tilted_plane.angles);
  });
}

void read_reserved_numbers(Section& s, Controller::Program& program) {
  const auto range = s.find_numbers("reserved_numbers");
  if (!range) return;
  const auto is_number = [](double n) { return n >= 1.0 && n <= 99999999.0 && n == std::floor(n); };
  if (range->size() != 2 || !is_number(range->front()) || !is_number(range->back()) ||
      range->front() > range->back())
    return s.error(
        "reserved_numbers",
        "'reserved_numbers' must be the first and the last program number of the macros, 1 to 99999999");
  program.first_reserved = static_cast<std::int64_t>(range->front());
  program.last_reserved = static_cast<std::int64_t>(range->back());
}

void read_program(Section& root, Controller& c) {
  using P = Placeholder;
  in_section(root, "program", [&](Section& s) {
    read_template(s, "begin", {P::number, P::name}, c.program.begin);
    read_template(s, "setup", {}, c.program.setup);
    read_template(s, "end", {P::number, P::name}, c.program.end);
    read_reserved_numbers(s, c.program);
  });
  in_section(root, "tool", [&](Section& s) {
    read_template(s, "change", {P::tool, P::length_offset}, c.tool_change);
    read_template(s, "preselect", {P::tool}, c.tool_preselect);
    if (!c.tool_preselect.empty() && !holds(c.tool_preselect, P::tool))
      s.error("preselect", "'preselect' must hold {tool}");
    c.tool_change_s = s.quantity_or("change_s", 0.0);
    if (c.tool_change_s < 0.0) s.error("change_s", "'change_s' must not be negative");
  });
  in_section(root, "spindle", [&](Section& s) {
    read_template(s, "clockwise", {P::rpm}, c.spindle_clockwise);
    read_template(s, "counterclockwise", {P::rpm}, c.spindle_counterclockwise);
    read_template(s, "off", {}, c.spindle_off);
    read_into(s, "speed_not_under_tcp", c.speed_not_under_tcp);
  });
  in_section(root, "coolant", [&](Section& s) {
    for (std::size_t i = 0; i < kCoolantNames.size(); ++i)
      read_template(s, kCoolantNames[i], {}, c.coolant[i]);
  });
  in_section(root, "dwell", [&](Section& s) {
    read_template(s, "words", {P::seconds, P::milliseconds}, c.dwell);
    read_integer(s, "decimals", c.dwell_decimals, 0, 3);
  });
  in_section(root, "stop", [&](Section& s) {
    read_template(s, "program", {}, c.stops.program);
    read_template(s, "optional", {}, c.stops.optional);
    read_into(s, "ends_spindle_and_coolant", c.stops.end_spindle);
  });
  in_section(root, "retract", [&](Section& s) {
    read_into(s, "ends_length", c.retract_ends_length);
    for (const auto& key : s.keys("^[XYZABCUVW]$")) {
      if (key == "ends_length") continue;
      const auto letter = axis_letter(key);
      if (letter) {
        read_template(s, key.c_str(), {Placeholder::position}, c.retract[index(*letter)]);
      } else {
        s.error(key, "'" + key + "' is no axis: X, Y, Z, A, B, C, U, V or W");
      }
    }
  });
}

// One word each, or the lines of each.
void read_work_offsets(Section& s, Controller& c) {
  const Value* value = s.raw("words");
  if (value == nullptr) return;
  const auto* items = value->as_array();
  const auto refuse = [&] { s.error("words", "'words' must be an array of words, or of arrays of lines"); };
  if (items == nullptr) return refuse();
  c.work_offsets.clear();
  for (const auto& item : *items) {
    Template lines;
    if (const auto* word = item.as_string()) lines.push_back(*word);
    if (const auto* array = item.as_array()) {
      for (const auto& line : *array) {
        if (line.as_string() != nullptr) lines.push_back(*line.as_string());
      }
    }
    if (lines.empty()) return refuse();
    c.work_offsets.push_back(std::move(lines));
  }
}

void read_variables(Section& s, const char* key, std::array<std::int64_t, 3>& out) {
  const Value* value = s.raw(key, config::KeyType::numbers);
  if (value == nullptr) return;
  const auto* items = value->as_array();
  bool ok = items != nullptr && items->size() == out.size();
  for (std::size_t i = 0; ok && i < out.size(); ++i) {
    const auto* number = std::get_if<std::int64_t>(&(*items)[i].data);
    ok = number != nullptr && *number > 0;
    if (ok) out[i] = *number;
  }
  if (!ok) s.error(key, std::string("'") + key + "' must be three numbers of variables");
}

void read_modes(Section& root, Controller& c) {
  in_section(root, "work_offset", [&](Section& s) { read_work_offsets(s, c); });
  in_section(root, "offset_shift", [&](Section& s) {
    using P = Placeholder;
    read_template(s, "set", {P::index, P::x, P::y, P::z}, c.offset_shift.set);
    read_template(s, "add", {P::x, P::y, P::z}, c.offset_shift.add);
    read_into(s, "not_under_tcp", c.offset_shift.not_under_tcp);
    read_integer(s, "last_set", c.offset_shift.last_set, 0, 99);
  });
  in_section(root, "run_time", [&](Section& s) {
    using P = Placeholder;
    auto& r = c.run_time;
    read_into(s, "open", r.open);
    read_into(s, "close", r.close);
    read_into(s, "variable", r.variable);
    read_variables(s, "source", r.source);
    read_variables(s, "latched", r.latched);
    read_template(s, "begin", {}, r.begin);
    read_template(s, "latch", {P::clamp, P::step, P::dead_band}, r.latch);
    if (!r.latch.empty() && (r.open.empty() || r.variable.empty()))
      s.error("latch", "'latch' needs 'open' and 'variable' too");
  });
  in_section(root, "run_time_temperatures", [&](Section& s) {
    using P = Placeholder;
    auto& t = c.run_time_temperatures;
    read_integer(s, "first", t.first, 1, 99999);
    read_integer(s, "first_reference", t.first_reference, 1, 99999);
    read_integer(s, "count", t.count, 1, 999);
    read_variables(s, "measured", t.measured);
    read_template(s, "reset", {}, t.reset);
    read_template(s, "read", {P::channel, P::temperature}, t.read);
    read_template(s, "reference", {P::reference, P::temperature}, t.reference);
    read_template(s, "start", {P::target, P::measured}, t.start);
    read_template(s, "add", {P::target, P::temperature, P::reference, P::factor}, t.add);
    read_template(s, "subtract", {P::target, P::temperature, P::reference, P::factor}, t.subtract);
    const bool whole = !t.reset.empty() && !t.reference.empty() && !t.start.empty() && !t.subtract.empty();
    if (!t.add.empty() && !(whole && t.first > 0 && t.first_reference > 0 && t.count > 0)) {
      s.error(
          "add",
          "'add' needs 'first', 'first_reference', 'count', 'reset', 'reference', 'start' and 'subtract'");
    }
  });
  in_section(root, "path_mode", [&](Section& s) {
    static constexpr std::array kKeys = {"exact_path", "exact_stop", "continuous"};
    for (std::size_t i = 0; i < kKeys.size(); ++i) read_template(s, kKeys[i], {}, c.path_modes[i]);
    read_template(s, "continuous_within", {Placeholder::tolerance}, c.continuous_within);
    if (!c.continuous_within.empty() && !holds(c.continuous_within, Placeholder::tolerance))
      s.error("continuous_within",
              "'continuous_within' must hold {tolerance}; without it it is 'continuous'");
    read_template(s, "continuous_off", {}, c.continuous_off);
    PathModeKind kind = c.default_path_mode.value_or(PathModeKind::exact_path);
    read_choice<PathModeKind>(s, "default",
                              {{"exact_path", PathModeKind::exact_path},
                               {"exact_stop", PathModeKind::exact_stop},
                               {"continuous", PathModeKind::continuous}},
                              kind);
    if (s.has("default")) c.default_path_mode = kind;
  });
  in_section(root, "input", [&](Section& s) {
    read_template(s, "inch", {}, c.input.inch);
    read_template(s, "millimetre", {}, c.input.millimetre);
    read_into(s, "unit_keeps_speed", c.input.unit_keeps_speed);
    read_template(s, "planes", {}, c.input.planes);
    if (!c.input.planes.empty() && c.input.planes.size() != 3)
      s.error("planes", "'planes' are three words, of X Y, of Z X and of Y Z, or none");
    read_template(s, "reference", {}, c.input.reference);
    read_template(s, "skipped", {}, c.input.lines.skipped);
    read_template(s, "silent", {}, c.input.lines.silent);
    read_into(s, "tool_name", c.input.lines.tool_name);
    read_into(s, "rapid_suffix", c.input.lines.rapid_suffix);
    read_template(s, "away", {}, c.input.lines.away);
    read_template(s, "stands_for", {}, c.input.lines.stands_for);
    for (const std::string& line : c.input.lines.stands_for) {
      if (line.find(" = ") == std::string::npos)
        s.error("stands_for", "'" + line + "': a word, ' = ', and what it stands for");
    }
    read_into(s, "dwell_without_point_ms", c.input.lines.dwell_without_point_ms);
    read_template(s, "dwell", {Placeholder::seconds, Placeholder::milliseconds}, c.input.lines.dwell);
    read_into(s, "clockwise", c.input.clockwise);
    read_into(s, "counterclockwise", c.input.counterclockwise);
    read_into(s, "arc_radius", c.input.arc_radius);
    read_into(s, "centers_absolute", c.input.centers_absolute);
    read_into(s, "centers_from_start", c.input.centers_from_start);
    read_into(s, "machine_position", c.input.machine_position);
    read_into(s, "per_revolution", c.input.places.per_revolution);
    read_into(s, "radius_name", c.input.places.radius_name);
    read_into(s, "absolute_value", c.input.places.absolute_value);
    read_into(s, "increment_value", c.input.places.increment_value);
    read_into(s, "increment_prefix", c.input.places.increment_prefix);
    read_into(s, "shift", c.input.places.shift);
    read_into(s, "set_position", c.input.places.set_position);
    read_template(s, "end_shift", {}, c.input.places.end_shift);
    read_into(s, "variables", c.input.flow.variables);
    read_into(s, "define", c.input.flow.define);
    read_into(s, "formula", c.input.flow.formula);
    auto& own = c.input.flow.control_variables;
    own[0] = s.find_integer("first_control_variable").value_or(own[0]);
    own[1] = s.find_integer("last_control_variable").value_or(own[1]);
    read_into(s, "o_words", c.input.flow.o_words);
    read_into(s, "call", c.input.flow.call);
    read_into(s, "call_line", c.input.flow.call_line);
    read_into(s, "end_call", c.input.flow.end_call);
    c.input.flow.largest_program = s.find_integer("largest_program").value_or(c.input.flow.largest_program);
    read_into(s, "label", c.input.flow.label);
    read_into(s, "call_label", c.input.flow.call_label);
    read_into(s, "repeats", c.input.flow.repeats);
    read_into(s, "call_cycle", c.input.flow.holes.call);
    read_into(s, "call_cycle_word", c.input.flow.holes.call_word);
    read_into(s, "modal_call", c.input.flow.holes.modal_call);
    read_into(s, "zero_follows", c.input.places.zero_follows);
    read_into(s, "zero_stays", c.input.places.zero_stays);
    read_into(s, "datum_shift", c.input.places.datum_shift);
    read_into(s, "more_turns", c.input.places.more_turns);
    read_into(s, "pole", c.input.pole.set);
    read_into(s, "circle_about_pole", c.input.pole.about);
    read_into(s, "circle_by_radius", c.input.pole.by_radius);
    read_into(s, "polar_circle", c.input.pole.circle);
    read_into(s, "polar_line", c.input.pole.line);
    read_into(s, "circle_clockwise", c.input.pole.clockwise);
    read_into(s, "circle_counterclockwise", c.input.pole.counterclockwise);
    read_into(s, "turn", c.input.places.turn);
    read_into(s, "end_turn", c.input.places.end_turn);
    // A word that its base lets pass has a meaning here: G69 of the base ends nothing, and ends G68 on Haas.
    std::erase_if(c.input.lines.silent, [&](const std::string& word) {
      return word == c.input.places.turn || word == c.input.places.end_turn;
    });
    read_template(s, "frames", {}, c.input.places.frames);
    if (!c.input.places.frames.empty() && c.input.places.frames.size() != 4)
      s.error("frames",
              "'frames' are four words: a shift anew and further, a turn anew and further, or none");
  });
  in_section(root, "read", [&](Section& s) {
    read_template(s, "end", {}, c.program.also_end);
    read_template(s, "silent", {}, c.silent);
    read_template(s, "allowed", {}, c.allowed);
    if (auto refused = s.find_section("refused")) {
      for (const auto& word : refused->keys()) c.refused[word] = refused->text(word);
    }
  });
}

// What is known to move nothing: the end of length compensation, which moves Z on some controls, is not among
// them, nor a word that only this file knows.
Template modes_of(const Controller& c) {
  const auto is_mode = [&](const std::string& word) {
    return word == c.feed.per_minute || word == c.incremental.off ||
           std::find(c.silent.begin(), c.silent.end(), word) != c.silent.end();
  };
  Template out;
  bool says_feed = c.feed.per_minute.empty();
  for (const std::string& line : c.program.setup) {
    std::string kept;
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      if (!is_mode(word)) continue;
      says_feed = says_feed || word == c.feed.per_minute;
      kept += (kept.empty() ? "" : c.line.separator) + word;
    }
    if (!kept.empty()) out.push_back(kept);
  }
  if (!says_feed) out.push_back(c.feed.per_minute);
  return out;
}

Template ends_earlier_of(const Controller& c) {
  Template out;
  if (c.tcp.off_at_start) out = c.tcp.off;
  if (c.tilted_plane.off_at_start)
    out.insert(out.end(), c.tilted_plane.off.begin(), c.tilted_plane.off.end());
  return out;
}

void read_sections(Section& root, Controller& c) {
  in_section(root, "numbers", [&](Section& s) { read_numbers(s, c); });
  read_layout(root, c);
  read_motion(root, c);
  read_compensation(root, c);
  read_program(root, c);
  read_clamps(root, c);
  read_modes(root, c);
  read_shapes(root, c);
  check_setup(root, c);
  c.program.modes = modes_of(c);
  c.program.ends_earlier = ends_earlier_of(c);
}

// Bases are given by name and stand in the same folder.
constexpr int kMaxBases = 8;

// The file of a base: beside the file that names it, else in the folder of those that ship.
std::string base_file(const std::string& name, const std::string& path, const std::string& base_folder) {
  namespace fs = std::filesystem;
  const fs::path beside = fs::path(path).parent_path() / (name + ".toml");
  const fs::path shipped = fs::path(base_folder) / (name + ".toml");
  std::error_code ec;
  const bool use_shipped = !base_folder.empty() && !fs::exists(beside, ec) && fs::exists(shipped, ec);
  return (use_shipped ? shipped : beside).string();
}

Result<void> read_file_into(const std::string& path, const std::string& base_folder, int depth, Controller& c,
                            Diagnostics& diagnostics) {
  auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  auto value = config::parse_toml(*text, path);
  if (!value) {
    diagnostics.error(path, value.error().where, value.error().message);
    return tl::unexpected(value.error());
  }
  Section root(*value, "file", path, diagnostics);
  auto head = root.find_section("controller");
  if (!head) {
    root.error("controller", "missing table [controller]");
    return tl::unexpected(diagnostics.first_error());
  }
  if (const auto base = head->find_text("base")) {
    if (depth == kMaxBases) {
      head->error("base", "more than " + std::to_string(kMaxBases) + " bases: do two files name each other?");
      return tl::unexpected(diagnostics.first_error());
    }
    c.bases.push_back(base_file(*base, path, base_folder));
    const std::string file = c.bases.back();
    auto done = read_file_into(file, base_folder, depth + 1, c, diagnostics);
    if (!done) return done;
  }
  c.name = head->text("name");
  c.differs_in = head->find_texts("differs_in").value_or(Template{});
  head->finish();
  read_sections(root, c);
  root.finish();
  return {};
}

// What holds between keys, whichever file they come from.
void check(const Controller& c, Diagnostics& diagnostics) {
  const auto error = [&](const std::string& message) { diagnostics.error(c.file, {}, message); };
  if (c.motion.rapid.empty() || c.motion.linear.empty()) error("[motion] needs both 'rapid' and 'linear'");
  if (c.motion.rapid == c.motion.linear && c.motion.rapid_suffix.empty()) {
    error("[motion] 'rapid' and 'linear' are the same and there is no 'rapid_suffix' that tells them apart");
  }
  if (c.motion.rapid == c.motion.linear && c.motion.modal) {
    error("[motion] 'modal' must be false when 'rapid_suffix' tells rapids from feed moves");
  }
  if (c.program.end.empty()) error("[program] needs 'end'");
  if (c.tcp.on.empty() != c.tcp.off.empty()) error("[tcp] needs both 'on' and 'off', or neither");
  if (c.length.automatic && !c.length.on.empty()) error("[length] 'automatic' excludes 'on'");
  if (c.tilted_plane.on.empty() != c.tilted_plane.off.empty()) {
    error("[tilted_plane] needs both 'on' and 'off', or neither");
  }
  if (c.cycles.modal() && !c.cycles.plain[0].empty() &&
      (c.cycles.to_clear.empty() || c.cycles.to_initial.empty()))
    error("[cycles] 'off' needs 'to_clear' and 'to_initial' too");
  if (c.block_numbers.max < c.block_numbers.start) error("[block_numbers] 'max' is less than 'start'");
  if (c.rotary.modulo_axes != 0 && c.numbers.axes.decimals(AxisLetter::C) > 6) {
    error("[rotary] 'modulo_axes' allows at most 6 decimals for rotary axes");
  }
}

}  // namespace

bool Controller::names_position(AxisLetter letter) const {
  return holds(retract[index(letter)], Placeholder::position);
}

bool Controller::adds_length_of_register() const {
  return holds(length.on, Placeholder::length_offset) || holds(tcp.on, Placeholder::length_offset);
}

std::int64_t FeedFormat::quanta(FeedMode mode, double internal) const {
  const double scaled = internal * kSecondsPerMinute * scale(mode);
  TRUNNION_EXPECTS(scaled < 9e18);
  const std::int64_t quanta = AxisFormat::nearest(scaled);
  return scaled > 0.0 ? std::max<std::int64_t>(quanta, 1) : quanta;
}

std::int64_t FeedFormat::rotary_quanta(double rad_s) const {
  return quanta(FeedMode::per_minute, rad_s * kDegreePerRad);
}

double FeedFormat::rotary_internal(std::int64_t quanta) const {
  return internal(FeedMode::per_minute, quanta) * kRadPerDegree;
}

bool Controller::Program::is_numbered() const {
  return holds(begin, Placeholder::number);
}

bool Controller::Program::reserves(std::int64_t number) const {
  return is_numbered() && number >= first_reserved && number <= last_reserved;
}

Result<Controller> load_controller(const std::string& path, Diagnostics& diagnostics,
                                   const std::string& base_folder) {
  Controller c;
  c.file = path;
  const std::size_t errors_before = diagnostics.error_count();
  if (auto done = read_file_into(path, base_folder, 0, c, diagnostics); !done)
    return tl::unexpected(done.error());
  check(c, diagnostics);
  const PatternSet patterns = compile_patterns(c, diagnostics);
  if (diagnostics.error_count() > errors_before) return tl::unexpected(diagnostics.first_error());
  warn_of_unknown_setup(c, patterns, diagnostics);
  if (!c.bases.empty()) {
    Controller base;
    base.file = c.bases.front();
    Diagnostics heard_before;
    if (read_file_into(base.file, base_folder, 0, base, heard_before))
      warn_of_differences_from_base(c, patterns, base, diagnostics);
  }
  return c;
}

Result<std::string> find_controller(const std::string& name_or_path, const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code ec;
  if (name_or_path.ends_with(".toml") || fs::is_regular_file(name_or_path, ec)) return name_or_path;
  const auto path = fs::path(folder) / (name_or_path + ".toml");
  if (fs::is_regular_file(path, ec)) return path.string();
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder, ec)) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return fail(ErrorCode::io_failed, "no controller '" + name_or_path + "' in " + folder +
                                        did_you_mean(name_or_path, names) +
                                        (names.empty() ? "" : "; there are: " + joined(names, ", ")));
}

}  // namespace trunnion::nc
