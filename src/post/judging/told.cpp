#include "post/judging/told.hpp"

namespace trunnion::post {

void Told::take(const nc::Block& block) {
  if (const auto* offset = std::get_if<nc::WorkOffset>(&block)) work_offset_ = offset->index;
  if (const auto* call = std::get_if<nc::ToolCall>(&block)) {
    tool_ = call->tool;
    tools_.insert(call->tool);
    spindle_ = {};
    spindle_is_open_ = false;
    // Whether the change of a tool ends the coolant is for the machine's builder to say.
    if (coolant_ != 0U) coolant_.reset();
    length_.reset();
    if (controller_.length.automatic) length_ = call->tool;
  }
  if (const auto* length = std::get_if<nc::LengthCompensation>(&block)) length_ = length->number;
  if (const auto* control = std::get_if<nc::TcpControl>(&block)) take_tcp(*control);
  if (std::holds_alternative<nc::Retract>(block) && controller_.retract_ends_length &&
      !controller_.length.automatic && length_ != 0)
    length_.reset();
  if (const auto* spindle = std::get_if<nc::Spindle>(&block)) {
    spindle_ = *spindle;
    spindle_is_open_ = false;
  }
  if (std::holds_alternative<nc::Stop>(block)) at_stop_ = {spindle_, coolant_.value_or(0U)};
  // Whether an optional one is taken is for the operator to say: what it may end has to be said again.
  if (std::holds_alternative<nc::Stop>(block) && controller_.stops.end_spindle) {
    spindle_ = {};
    spindle_is_open_ = false;
    coolant_ = 0U;
  }
  if (const auto* hole = std::get_if<nc::Hole>(&block)) {
    thread_.reset();
    if (hole->kind == nc::Hole::Kind::tap) thread_ = hole->thread;
    spindle_is_open_ = spindle_is_open_ || thread_;
  }
  if (const auto* coolant = std::get_if<nc::Coolant>(&block))
    coolant_ = coolant->kind == nc::CoolantKind::off
                   ? 0U
                   : coolant_.value_or(0U) | (1U << static_cast<unsigned>(coolant->kind));
  if (const auto* mode = std::get_if<nc::PathMode>(&block)) path_mode_ = *mode;
  if (std::holds_alternative<nc::Retract>(block) || std::holds_alternative<nc::ToolCall>(block))
    cutter_is_new_ = false;
  if (const auto* cutter = std::get_if<nc::CutterCompensation>(&block)) {
    cutter_is_new_ = cutter_.side != cutter->side;
    cutter_ = *cutter;
    if (cutter_.side != nc::CutterSide::off) wear_registers_.insert(cutter_.number);
  }
}

std::vector<std::int64_t> Told::wear_of_tools() const {
  std::vector<std::int64_t> out;
  if (!controller_.wear_register_is_tool) return out;
  constexpr std::int64_t kUsual = 1;  // of a program that loads no tool
  for (const std::int64_t number : wear_registers_)
    if (tools_.contains(number) || (tools_.empty() && number == kUsual)) out.push_back(number);
  return out;
}

// Where it takes the place of length compensation the register of its words counts.
void Told::take_tcp(const nc::TcpControl& control) {
  if (!controller_.tcp.replaces_length || controller_.length.automatic) return;
  length_ = control.on ? control.length_offset : 0;
}

}  // namespace trunnion::post
