#include "post/making/event_maker.hpp"

#include <cmath>
#include <utility>
#include <variant>

#include "trunnion/base/number_text.hpp"

#include "post/coolant_kinds.hpp"
#include "post/making/post_words.hpp"

namespace trunnion::post {
namespace {

template <class... F>
struct Visitor : F... {
  using F::operator()...;
};
template <class... F>
Visitor(F...) -> Visitor<F...>;

}  // namespace

Result<void> EventMaker::take(const cl::Record& record) {
  auto done = take_record(record);
  if (done || !done.error().file.empty()) return done;
  Error error = done.error();
  error.file = work_.posting.job.cl_file;
  error.where = record.where;
  return tl::unexpected(error);
}

Result<void> EventMaker::take_record(const cl::Record& record) {
  return std::visit(
      Visitor{
          [&](const cl::Spindle& s) { return take_spindle(s, record.where); },
          [&](const cl::Coolant& c) { return take_coolant(coolant_kind(c.kind)); },
          [&](const cl::ToolChange& t) { return take_tool_change(t, record.where); },
          [&](const cl::ToolSelect& t) {
            // The magazine may do without.
            if (work_.posting.controller.tool_preselect.empty()) return Result<void>{};
            return work_.posting.write(nc::ToolSelect{t.number});
          },
          [&](const cl::WorkOffset& w) { return head_.check_work_offset(w, record.where); },
          [&](const cl::ToolGeometry& g) {
            work_.tool.own_length_mm = g.length_mm.value_or(0.0);
            work_.tool.own_length_where = record.where;
            return take_diameter(g, record.where);
          },
          [&](const cl::CutterCompensation& c) { return cutter_words_.switch_to(c, record.where); },
          [&](const cl::Dwell& d) { return take_dwell(d); },
          [&](const cl::Stop& s) { return take_stop(s, record.where); },
          [&](const cl::Text& t) { return take_text(t, record.where); },
          [&](const cl::OperationBegin& o) {
            work_.thermal.begin_operation(o.name);
            return work_.posting.write(nc::Comment{o.name, true});
          },
          [&](const cl::Tolerance& t) { return take_tolerance(t, record.where); },
          [&](const cl::PostWord& w) { return take_post_word(w, record.where); },
          [](const auto&) { return Result<void>{}; },
      },
      record.data);
}

Result<void> EventMaker::take_spindle(const cl::Spindle& spindle, SourceRef where) {
  const nc::Spindle before = work_.spindle.spindle();
  const bool stops = spindle.state != cl::Spindle::State::on;
  const bool turns_round = spindle.state == cl::Spindle::State::on && before.turn != nc::SpindleTurn::off &&
                           (before.turn == nc::SpindleTurn::counterclockwise) != spindle.counterclockwise &&
                           !work_.at.approaches;
  if (stops || turns_round) {
    if (auto r = safe_way_.pause_above(where); !r) return r;
  }
  const auto asked = work_.spindle.ask(spindle, where);
  if (!asked) return tl::unexpected(asked.error());
  if (!*asked) return {};
  if (work_.posting.options.rtcp && work_.posting.controller.speed_not_under_tcp && !work_.at.approaches &&
      !(**asked == before)) {
    if (auto r = safe_way_.pause_above(where); !r) return r;
  }
  work_.errors.state.spindle(stops ? 0.0 : work_.spindle.rpm());
  return stops || work_.spindle.go_on_at_once(work_.at.known) ? work_.posting.write(**asked) : Result<void>{};
}

Result<void> EventMaker::take_diameter(const cl::ToolGeometry& tool, SourceRef where) {
  const double before_mm = work_.spindle.diameter_mm();
  if (!tool.diameter_mm || work_.spindle.set_diameter(*tool.diameter_mm, where)) return {};
  return fail(ErrorCode::wrong_input,
              "a diameter of " + shortest_text(*tool.diameter_mm) +
                  " mm behind SPINDL, which made its speed from a surface speed and " +
                  shortest_text(before_mm) + " mm: CUTTER or TLDATA must stand before SPINDL");
}

Result<void> EventMaker::take_coolant(nc::CoolantKind kind) {
  work_.spindle.ask(kind);
  return kind == nc::CoolantKind::off || work_.spindle.go_on_at_once(work_.at.known)
             ? work_.posting.write(nc::Coolant{kind})
             : Result<void>{};
}

Result<void> EventMaker::take_stop(const cl::Stop& stop, SourceRef where) {
  if (auto r = safe_way_.pause_above(where); !r) return r;
  if (work_.posting.controller.stops.end_spindle)
    work_.spindle.stopped();
  else if (!stop.optional && work_.spindle.spindle().turn != nc::SpindleTurn::off)
    work_.posting.warn_once(
        "stop with spindle", where,
        "STOP: " + work_.posting.controller.name +
            " does not stop the spindle and the coolant with the program. SPINDL/OFF before STOP "
            "does");
  // Whoever jogs an axis there goes on from somewhere else: up again first, then all other axes, then down.
  work_.at.up = false;
  return work_.posting.write(nc::Stop{stop.optional, true});
}

Result<void> EventMaker::take_tool_change(const cl::ToolChange& t, SourceRef where) {
  const auto refuse = [](const std::string& why) { return fail(ErrorCode::wrong_input, why); };
  if (t.number == 0)
    return refuse(
        "tool 0: a control takes it for no tool, without a length; number the tool where the CL file is "
        "made");
  const bool adds = work_.posting.machine.output_point == OutputPoint::tip;
  if (adds && !work_.posting.controller.length.automatic && *t.length_register == 0)
    return refuse("length register 0 of tool " + std::to_string(t.number) +
                  ": a control adds no length with it; give the register of the tool's length");
  if (auto r = safe_way_.retract(where); !r) return r;
  work_.at.up = false;  // the control may move any axis for it
  work_.at.returns = false;
  work_.at.approaches = true;
  work_.spindle.tool_called(t.number);
  nc::ToolCall call;
  call.tool = t.number;
  call.length_offset = *t.length_register;
  work_.tool.length_register = call.length_offset;
  const std::string text = "tool " + std::to_string(t.number) + ", gauge length " +
                           gauge_text(*t.gauge_length_mm) + " mm, length register " +
                           std::to_string(work_.tool.length_register);
  if (auto r = work_.posting.write(nc::Comment{text}); !r) return r;
  if (auto r = work_.posting.write(call); !r) return r;
  work_.pause(work_.posting.controller.tool_change_s);
  if (work_.posting.options.rtcp && work_.posting.controller.tcp.replaces_length) return {};
  if (work_.posting.controller.length.automatic) return {};
  // Where the words are those of S the control must not add a length, and some do with the tool change.
  return work_.posting.write(nc::LengthCompensation{adds ? call.length_offset : 0});
}

Result<void> EventMaker::take_dwell(const cl::Dwell& d) {
  double seconds = d.seconds;
  if (d.revolutions) {
    if (work_.spindle.rpm() <= 0.0)
      return fail(ErrorCode::wrong_input, "DELAY in revolutions and the spindle has no speed");
    seconds = *d.revolutions / work_.spindle.rpm() * kSecondsPerMinute;
  }
  constexpr double kLongest_s = 86400.0;
  if (seconds > kLongest_s)
    return fail(ErrorCode::wrong_input, "DELAY: " + shortest_text(seconds) + " s is more than a day");
  if (auto r = work_.spindle.resume(); !r) return r;
  work_.pause(seconds);
  return work_.posting.write(nc::Dwell{std::llround(seconds * 1000.0)});
}

Result<void> EventMaker::take_text(const cl::Text& t, SourceRef where) {
  if (t.kind == cl::Text::Kind::insert) {
    // Some CAM systems put remarks there; a line that no one has checked does not go to a machine as a
    // command.
    work_.posting.warn_once("INSERT", where,
                            "the text of INSERT goes into the program as a comment, not as a command");
  }
  return t.text.empty() ? Result<void>{} : work_.posting.write(nc::Comment{t.text, true});
}

Result<void> EventMaker::take_tolerance(const cl::Tolerance& t, SourceRef where) {
  if (!t.on) {
    work_.posting.warn_once("LINTOL/OFF", where,
                            "LINTOL/OFF is not followed: the tolerance stays " +
                                shortest_text(work_.modes.tolerances.cutting().tip_mm) + " mm");
  }
  work_.modes.tolerances.take(t);
  return {};
}

// The chunk of motions before the word is written; the intake has acted on it for those behind it.
Result<void> EventMaker::take_post_word(const cl::PostWord& word, SourceRef where) {
  std::string cut;
  if (word.word == "LIMITS" && take_limits(word, *work_.posting.job.machine, work_.posting.machine, cut)) {
    work_.axis_words.take_travel();
    if (!cut.empty()) {
      work_.posting.diagnostics.warning(
          work_.posting.job.cl_file, where,
          "LIMITS: axis " + cut + " has less travel than that; its own limits stay");
    }
    return {};
  }
  if (const auto limit = rotary_limit_rad_s(word); limit && word.word == "MAXDPM") {
    work_.planner.axes().limit_rotary(*limit);
    return {};
  }
  if (word.word == "CLEARP") {
    work_.modes.clear_plane = clear_plane_of(word);
    if (work_.modes.clear_plane || (word.fields.size() == 1 && word.fields[0] == "OFF")) return {};
  }
  if (measure_of(word, work_.posting.machine) || word.word == kStands) return {};
  if (word.word == "RETRCT" && word.fields.empty()) return safe_way_.leave_part(where);
  if (const auto turn = table_turn_of(word, work_.posting.machine, work_.at.point.q)) {
    const Axis& axis = work_.posting.machine.axes[turn->axis];
    if (axis.within_limits(turn->angle))
      return safe_way_.turn_table(turn->axis, turn->angle, turn->now, where);
    return fail(ErrorCode::check_failed, word.word + ": axis " + axis.name + " would have to go to " +
                                             fixed_text(turn->angle * kDegreePerRad, 4) +
                                             " deg, beyond its limits");
  }
  std::string text = word.word;
  for (std::size_t i = 0; i < word.fields.size(); ++i) {
    text += i == 0 ? '/' : ',';
    text += word.fields[i];
  }
  text += " is not acted on";
  work_.posting.warn_once("post word " + text, where, text);
  return {};
}

}  // namespace trunnion::post
