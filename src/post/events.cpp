// What is not a motion: spindle, coolant, tool, texts and words for the post-processor.
#include <cmath>
#include <variant>

#include "trunnion/base/number_text.hpp"

#include "post/pipeline.hpp"

namespace trunnion::post {
namespace {

template <class... F>
struct Visitor : F... {
  using F::operator()...;
};
template <class... F>
Visitor(F...) -> Visitor<F...>;

nc::CoolantKind coolant_kind(cl::Coolant::Kind kind) {
  switch (kind) {
    case cl::Coolant::Kind::off:
      return nc::CoolantKind::off;
    case cl::Coolant::Kind::mist:
      return nc::CoolantKind::mist;
    case cl::Coolant::Kind::through:
      return nc::CoolantKind::through_tool;
    case cl::Coolant::Kind::air:
      return nc::CoolantKind::air;
    default:
      return nc::CoolantKind::flood;
  }
}

}  // namespace

Result<void> Pipeline::emit_event(const cl::Record& record) {
  return std::visit(
      Visitor{
          [&](const cl::Spindle& s) { return emit_spindle(s, record.where); },
          [&](const cl::Coolant& c) { return write(nc::Coolant{coolant_kind(c.kind)}); },
          [&](const cl::ToolChange& t) { return emit_tool_change(t); },
          [&](const cl::ToolGeometry& g) {
            if (g.diameter_mm) tool_diameter_mm_ = *g.diameter_mm;
            return Result<void>{};
          },
          [&](const cl::CutterCompensation& c) { return emit_cutter_compensation(c, record.where); },
          [&](const cl::Dwell& d) { return emit_dwell(d, record.where); },
          [&](const cl::Stop& s) { return write(nc::Stop{s.optional}); },
          [&](const cl::Text& t) { return emit_text(t, record.where); },
          [&](const cl::OperationBegin& o) {
            begin_operation(o.name);
            return write(nc::Comment{o.name});
          },
          [&](const cl::Tolerance& t) { return take_tolerance(t, record.where); },
          [&](const cl::PostWord& w) { return take_post_word(w, record.where); },
          [](const auto&) { return Result<void>{}; },
      },
      record.data);
}

Result<void> Pipeline::emit_spindle(const cl::Spindle& s, SourceRef where) {
  if (s.state == cl::Spindle::State::off) {
    state_.spindle(0.0);
    return write(nc::Spindle{});
  }
  if (s.state == cl::Spindle::State::orient) {
    diagnostics_.warning_once("orient", job_.cl_file, where, "SPINDL/ORIENT is not acted on");
    return {};
  }
  if (s.speed_rpm) spindle_rpm_ = *s.speed_rpm;
  if (s.surface_speed_mm_s) {
    if (tool_diameter_mm_ <= 0.0) {
      return fail(ErrorCode::wrong_input, "SPINDL gives a surface speed and no CUTTER or TLDATA a diameter",
                  job_.cl_file, where);
    }
    spindle_rpm_ = *s.surface_speed_mm_s / (kPi * tool_diameter_mm_) * kSecondsPerMinute;
  }
  if (s.max_rpm) spindle_rpm_ = std::min(spindle_rpm_, *s.max_rpm);
  if (spindle_rpm_ <= 0.0) {
    diagnostics_.warning_once("no speed", job_.cl_file, where,
                              "SPINDL gives no speed, and none was given before: left out");
    return {};
  }
  constexpr double kFastest_rpm = 1e6;
  if (std::llround(std::min(spindle_rpm_, 2.0 * kFastest_rpm)) < 1 || spindle_rpm_ > kFastest_rpm) {
    return fail(ErrorCode::wrong_input,
                "SPINDL: " + shortest_text(spindle_rpm_) + " rpm is not between 1 and " +
                    shortest_text(kFastest_rpm) + " rpm",
                job_.cl_file, where);
  }
  state_.spindle(spindle_rpm_);
  nc::Spindle out;
  out.turn = s.counterclockwise ? nc::SpindleTurn::counterclockwise : nc::SpindleTurn::clockwise;
  out.rpm = std::llround(spindle_rpm_);
  return write(out);
}

Result<void> Pipeline::emit_tool_change(const cl::ToolChange& t) {
  approach_ = true;
  if (auto r = leave_plane(); !r) return r;
  nc::ToolCall call;
  call.tool = t.number;
  call.length_offset = t.length_register.value_or(t.number);
  length_offset_ = call.length_offset;
  if (auto r = write(call); !r) return r;
  pause(controller_.tool_change_s);
  if (options_.rtcp && controller_.tcp.replaces_length) return {};
  // The spindle's position is what the words say where the output point is S: then the control must not add a
  // length.
  if (machine_.output_point == OutputPoint::spindle || controller_.length.automatic) return {};
  return write(nc::LengthCompensation{call.length_offset});
}

Result<void> Pipeline::emit_dwell(const cl::Dwell& d, SourceRef where) {
  double seconds = d.seconds;
  if (d.revolutions) {
    if (spindle_rpm_ <= 0.0) {
      return fail(ErrorCode::wrong_input, "DELAY in revolutions and the spindle has no speed", job_.cl_file,
                  where);
    }
    seconds = *d.revolutions / spindle_rpm_ * kSecondsPerMinute;
  }
  constexpr double kLongest_s = 86400.0;
  if (seconds > kLongest_s) {
    return fail(ErrorCode::wrong_input, "DELAY: " + shortest_text(seconds) + " s is more than a day",
                job_.cl_file, where);
  }
  pause(seconds);
  return write(nc::Dwell{std::llround(seconds * 1000.0)});
}

Result<void> Pipeline::emit_text(const cl::Text& t, SourceRef where) {
  if (t.kind == cl::Text::Kind::insert) {
    // Some CAM systems put remarks there; a line that no one has checked does not go to a machine as a
    // command.
    diagnostics_.warning_once("INSERT", job_.cl_file, where,
                              "the text of INSERT goes into the program as a comment, not as a command");
  }
  return t.text.empty() ? Result<void>{} : write(nc::Comment{t.text});
}

Result<void> Pipeline::take_tolerance(const cl::Tolerance& t, SourceRef where) {
  if (!t.on) {
    diagnostics_.warning_once("LINTOL/OFF", job_.cl_file, where,
                              "LINTOL/OFF is not followed: the tolerance stays " +
                                  shortest_text(tolerances_.cutting().tip_mm) + " mm");
  }
  tolerances_.take(t);
  return {};
}

}  // namespace trunnion::post
