#include "post/judging/asked.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "post/coolant_kinds.hpp"
#include "post/making/post_words.hpp"

namespace trunnion::post {

void Asked::note(SourceRef where) {
  changed_ = false;
  now_.line = where.line;
  states_.push_back({motions_, now_, std::exchange(stood_, false)});
}

void Asked::take_spindle(const cl::Spindle& s) {
  if (s.state != cl::Spindle::State::on) {
    now_.spindle = {};
    stood_ = true;
    return;
  }
  if (s.speed_rpm) now_.rpm = *s.speed_rpm;
  if (s.surface_speed_mm_s && diameter_mm_ > 0.0)
    now_.rpm = *s.surface_speed_mm_s / (kPi * diameter_mm_) * kSecondsPerMinute;
  if (s.max_rpm) now_.rpm = std::min(now_.rpm, *s.max_rpm);
  if (!(now_.rpm > 0.0)) return;
  now_.spindle.turn = s.counterclockwise ? nc::SpindleTurn::counterclockwise : nc::SpindleTurn::clockwise;
  now_.spindle.rpm = std::llround(now_.rpm);
}

// The pitch is its feed over the speed of the spindle.
void Asked::take_shape(const cl::Shape& shape) {
  const auto* hole = std::get_if<cl::Hole>(&shape.what);
  if (hole == nullptr || hole->kind != cl::Hole::Kind::tap) return;
  const bool per_turn = hole->feed.mode == cl::FeedMode::per_revolution;
  now_.pitch_mm = per_turn ? hole->feed.value : hole->feed.value * kSecondsPerMinute / now_.rpm;
  taps_left_ = shape.motions;
  changed_ = true;
}

void Asked::take(const ExpectedMotions& motions) {
  const auto goes_on = [&] { return !changed_ && taps_left_ == 0 && motions.feed == now_.feed; };
  std::size_t i = 0;
  for (; i < motions.points.size() && !goes_on(); ++i) {
    const path::ChoicePoint& point = motions.points[i];
    if (!point.rapid && !(motions.feed == now_.feed)) {
      now_.feed = motions.feed;
      changed_ = true;
    }
    if (changed_) note(point.where);
    ++motions_;
    if (taps_left_ > 0 && --taps_left_ == 0) {
      now_.pitch_mm = 0.0;
      changed_ = true;
    }
  }
  motions_ += motions.points.size() - i;
}

void Asked::take(const cl::Record& record) {
  const auto is = [&](const auto* what) { return changed_ = changed_ || what != nullptr, what != nullptr; };
  if (const auto* spindle = std::get_if<cl::Spindle>(&record.data); is(spindle)) take_spindle(*spindle);
  if (const auto* coolant = std::get_if<cl::Coolant>(&record.data); is(coolant)) {
    const nc::CoolantKind kind = coolant_kind(coolant->kind);
    now_.coolant = kind == nc::CoolantKind::off ? 0U : now_.coolant | (1U << static_cast<unsigned>(kind));
  }
  if (std::holds_alternative<cl::Spindle>(record.data) || std::holds_alternative<cl::Coolant>(record.data))
    said_.push_back({motions_, now_.spindle, now_.coolant});
  if (const auto* change = std::get_if<cl::ToolChange>(&record.data); is(change)) {
    now_.tool = change->number;
    now_.length_register = change->length_register.value_or(change->number);
  }
  if (const auto* offset = std::get_if<cl::WorkOffset>(&record.data); offset != nullptr && !work_offset_)
    work_offset_ = offset->index;
  if (const auto* geometry = std::get_if<cl::ToolGeometry>(&record.data))
    diameter_mm_ = geometry->diameter_mm.value_or(diameter_mm_);
  if (const auto* cutter = std::get_if<cl::CutterCompensation>(&record.data); is(cutter)) {
    const auto side = static_cast<nc::CutterSide>(cutter->side);
    const std::int64_t number = cutter->wear_register ? *cutter->wear_register : now_.length_register;
    now_.cutter = {side, side == nc::CutterSide::off ? 0 : number};
  }
  if (const auto* word = std::get_if<cl::PostWord>(&record.data);
      word != nullptr && word->word == "MAXDPM" && is(word))
    now_.rotary_rad_s = rotary_limit_rad_s(*word).value_or(now_.rotary_rad_s);
  if (const auto* shape = std::get_if<cl::ShapeBegin>(&record.data)) take_shape(*shape->shape);
  if (const auto* dwell = std::get_if<cl::Dwell>(&record.data)) {
    const double seconds = dwell->revolutions && now_.rpm > 0.0
                               ? *dwell->revolutions / now_.rpm * kSecondsPerMinute
                               : dwell->seconds;
    if (const auto milliseconds = std::llround(seconds * 1000.0); milliseconds > 0)
      pauses_.push_back({motions_, AskedPause::Kind::dwell, milliseconds, record.where.line});
  }
  if (const auto* stop = std::get_if<cl::Stop>(&record.data)) {
    const auto kind = stop->optional ? AskedPause::Kind::optional_stop : AskedPause::Kind::stop;
    pauses_.push_back({motions_, kind, 0, record.where.line, now_.spindle.turn == nc::SpindleTurn::off,
                       now_.coolant == 0U});
  }
}

const AskedState& Asked::at(std::size_t motion) const {
  const auto behind = std::upper_bound(states_.begin(), states_.end(), motion,
                                       [](std::size_t m, const From& from) { return m < from.motion; });
  return behind == states_.begin() ? now_ : std::prev(behind)->state;
}

std::size_t Asked::next_change(std::size_t motion) const {
  const auto behind = std::upper_bound(states_.begin(), states_.end(), motion,
                                       [](std::size_t m, const From& from) { return m < from.motion; });
  return behind == states_.end() ? kNever : behind->motion;
}

bool Asked::stops_before(std::size_t motion) const {
  if (met_ > 0 && pauses_[met_ - 1].before == motion) return true;
  const auto at = std::lower_bound(states_.begin(), states_.end(), motion,
                                   [](const From& from, std::size_t m) { return from.motion < m; });
  return at != states_.end() && at->motion == motion && at->stood;
}

void Asked::forget(std::size_t motion) {
  while (states_.size() > 1 && states_[1].motion <= motion) states_.pop_front();
  // A block may end on a motion far behind the pause that it begins before.
  constexpr std::size_t kMotionsOfBlock = 1024;
  while (!said_.empty() && said_.front().before + kMotionsOfBlock < motion) said_.pop_front();
  for (; met_ > 0 && pauses_.front().before + kMotionsOfBlock < motion; --met_, ++pauses_gone_)
    pauses_.pop_front();
}

}  // namespace trunnion::post
