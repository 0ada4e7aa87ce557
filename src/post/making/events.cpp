// What is not a motion: spindle, coolant, tool, texts and words for the post-processor.
#include <cmath>
#include <utility>
#include <variant>

#include "trunnion/base/number_text.hpp"

#include "post/judging/asked.hpp"
#include "post/making/pipeline.hpp"

namespace trunnion::post {
namespace {

template <class... F>
struct Visitor : F... {
  using F::operator()...;
};
template <class... F>
Visitor(F...) -> Visitor<F...>;

}  // namespace

Result<void> Pipeline::emit_event(const cl::Record& record) {
  auto done = emit_event_at(record);
  if (done || !done.error().file.empty()) return done;
  Error error = done.error();
  error.file = posting_.job.cl_file;
  error.where = record.where;
  return tl::unexpected(error);
}

Result<void> Pipeline::emit_event_at(const cl::Record& record) {
  return std::visit(
      Visitor{
          [&](const cl::Spindle& s) { return emit_spindle(s, record.where); },
          [&](const cl::Coolant& c) { return emit_coolant(coolant_kind(c.kind)); },
          [&](const cl::ToolChange& t) { return emit_tool_change(t, record.where); },
          [&](const cl::ToolSelect& t) {
            // The magazine may do without.
            if (posting_.controller.tool_preselect.empty()) return Result<void>{};
            return posting_.write(nc::ToolSelect{t.number});
          },
          [&](const cl::WorkOffset& w) { return head_.check_work_offset(w, record.where); },
          [&](const cl::ToolGeometry& g) {
            if (g.diameter_mm) spindle_.set_diameter(*g.diameter_mm);
            tool_.own_length_mm = g.length_mm.value_or(0.0);
            tool_.own_length_where = record.where;
            return Result<void>{};
          },
          [&](const cl::CutterCompensation& c) { return emit_cutter_compensation(c, record.where); },
          [&](const cl::Dwell& d) { return emit_dwell(d, record.where); },
          [&](const cl::Stop& s) { return emit_stop(s, record.where); },
          [&](const cl::Text& t) { return emit_text(t, record.where); },
          [&](const cl::OperationBegin& o) {
            thermal_.begin_operation(o.name);
            return posting_.write(nc::Comment{o.name, true});
          },
          [&](const cl::Tolerance& t) { return take_tolerance(t, record.where); },
          [&](const cl::PostWord& w) { return take_post_word(w, record.where); },
          [](const auto&) { return Result<void>{}; },
      },
      record.data);
}

Result<void> Pipeline::emit_spindle(const cl::Spindle& spindle, SourceRef where) {
  const bool stops = spindle.state == cl::Spindle::State::off;
  if (stops) {
    if (auto r = emit_pause_above(where); !r) return r;
  }
  const auto asked = spindle_.ask(spindle, where);
  if (!asked) return tl::unexpected(asked.error());
  if (!*asked) return {};
  errors_.state.spindle(stops ? 0.0 : spindle_.rpm());
  return stops || spindle_.go_on_at_once(at_.known) ? posting_.write(**asked) : Result<void>{};
}

Result<void> Pipeline::emit_coolant(nc::CoolantKind kind) {
  spindle_.ask(kind);
  return kind == nc::CoolantKind::off || spindle_.go_on_at_once(at_.known) ? posting_.write(nc::Coolant{kind})
                                                                           : Result<void>{};
}

Result<void> Pipeline::emit_stop(const cl::Stop& stop, SourceRef where) {
  if (auto r = emit_pause_above(where); !r) return r;
  return posting_.write(nc::Stop{stop.optional});
}

Result<void> Pipeline::emit_tool_change(const cl::ToolChange& t, SourceRef where) {
  if (auto r = emit_retract(where); !r) return r;
  at_.up = false;  // the control may move any axis for it
  at_.returns = false;
  at_.approaches = true;
  spindle_.tool_called();
  nc::ToolCall call;
  call.tool = t.number;
  call.length_offset = *t.length_register;
  tool_.length_register = call.length_offset;
  const std::string text = "tool " + std::to_string(t.number) + ", gauge length " +
                           shortest_text(*t.gauge_length_mm) + " mm, length register " +
                           std::to_string(tool_.length_register);
  if (auto r = posting_.write(nc::Comment{text}); !r) return r;
  if (auto r = posting_.write(call); !r) return r;
  pause(posting_.controller.tool_change_s);
  if (posting_.options.rtcp && posting_.controller.tcp.replaces_length) return {};
  if (posting_.controller.length.automatic) return {};
  // Where the words are those of S the control must not add a length, and some do with the tool change.
  const bool adds = posting_.machine.output_point == OutputPoint::tip;
  return posting_.write(nc::LengthCompensation{adds ? call.length_offset : 0});
}

Result<void> Pipeline::emit_dwell(const cl::Dwell& d, SourceRef where) {
  double seconds = d.seconds;
  if (d.revolutions) {
    if (spindle_.rpm() <= 0.0) {
      return fail(ErrorCode::wrong_input, "DELAY in revolutions and the spindle has no speed",
                  posting_.job.cl_file, where);
    }
    seconds = *d.revolutions / spindle_.rpm() * kSecondsPerMinute;
  }
  constexpr double kLongest_s = 86400.0;
  if (seconds > kLongest_s) {
    return fail(ErrorCode::wrong_input, "DELAY: " + shortest_text(seconds) + " s is more than a day",
                posting_.job.cl_file, where);
  }
  if (auto r = spindle_.resume(); !r) return r;
  pause(seconds);
  return posting_.write(nc::Dwell{std::llround(seconds * 1000.0)});
}

Result<void> Pipeline::emit_text(const cl::Text& t, SourceRef where) {
  if (t.kind == cl::Text::Kind::insert) {
    // Some CAM systems put remarks there; a line that no one has checked does not go to a machine as a
    // command.
    posting_.diagnostics.warning_once(
        "INSERT", posting_.job.cl_file, where,
        "the text of INSERT goes into the program as a comment, not as a command");
  }
  return t.text.empty() ? Result<void>{} : posting_.write(nc::Comment{t.text, true});
}

Result<void> Pipeline::take_tolerance(const cl::Tolerance& t, SourceRef where) {
  if (!t.on) {
    posting_.diagnostics.warning_once("LINTOL/OFF", posting_.job.cl_file, where,
                                      "LINTOL/OFF is not followed: the tolerance stays " +
                                          shortest_text(modes_.tolerances.cutting().tip_mm) + " mm");
  }
  modes_.tolerances.take(t);
  return {};
}

}  // namespace trunnion::post
