#include "post/making/spindle_and_coolant.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"

namespace trunnion::post {

bool SpindleAndCoolant::set_diameter(double mm, SourceRef where) {
  diameter_where_ = where;
  if (speed_has_diameter_ && !has_moved_ && mm != diameter_mm_) return false;
  speed_has_diameter_ = speed_has_diameter_ && mm == diameter_mm_;
  diameter_mm_ = mm;
  has_moved_ = false;
  return true;
}

Result<std::optional<nc::Spindle>> SpindleAndCoolant::ask(const cl::Spindle& s, SourceRef where) {
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::wrong_input, why, posting_.job.cl_file, where);
  };
  const auto leave_out = [&](const char* key, const std::string& why) {
    posting_.warn_once(key, where, why);
    return std::optional<nc::Spindle>();
  };
  is_said_ = true;
  said_for_ = tool_;
  if (s.state == cl::Spindle::State::off) {
    spindle_ = {};
    is_said_ = false;
    return spindle_;
  }
  if (s.state == cl::Spindle::State::orient) {
    posting_.warn_once("orient", where, "SPINDL/ORIENT: the spindle is stopped, and not turned to an angle");
    spindle_ = {};
    is_said_ = false;
    return spindle_;
  }
  if (s.speed_rpm) {
    rpm_ = *s.speed_rpm;
    speed_has_diameter_ = false;
  }
  if (s.surface_speed_mm_s) {
    if (diameter_mm_ <= 0.0) {
      return refuse("SPINDL gives a surface speed and no CUTTER or TLDATA a diameter" +
                    (tool_ ? " of tool " + std::to_string(*tool_) : std::string()));
    }
    speed_has_diameter_ = true;
    rpm_ = *s.surface_speed_mm_s / (kPi * diameter_mm_) * kSecondsPerMinute;
  }
  if (s.max_rpm) rpm_ = std::min(rpm_, *s.max_rpm);
  if (rpm_ <= 0.0) return leave_out("no speed", "SPINDL gives no speed, and none was given before: left out");
  constexpr double kFastest_rpm = 1e6;
  if (std::llround(std::min(rpm_, 2.0 * kFastest_rpm)) < 1 || rpm_ > kFastest_rpm) {
    return refuse("SPINDL: " + shortest_text(rpm_) + " rpm is not between 1 and " +
                  shortest_text(kFastest_rpm) + " rpm");
  }
  if (const double fastest = posting_.machine.spindle_max_rpm; fastest > 0.0 && rpm_ > fastest) {
    return refuse("SPINDL: " + shortest_text(rpm_) + " rpm, and the spindle turns at " +
                  shortest_text(fastest) + " rpm at most ([spindle] max_rpm of " + posting_.machine.file +
                  "); SPINDL/...,MAXRPM,n holds a surface speed below it");
  }
  spindle_.turn = s.counterclockwise ? nc::SpindleTurn::counterclockwise : nc::SpindleTurn::clockwise;
  spindle_.rpm = std::llround(rpm_);
  return spindle_;
}

void SpindleAndCoolant::ask(nc::CoolantKind kind) {
  coolant_ = kind == nc::CoolantKind::off ? 0U : coolant_ | (1U << static_cast<unsigned>(kind));
}

void SpindleAndCoolant::tool_called(std::uint32_t number) {
  if (has_moved_ && tool_ != number) diameter_mm_ = 0.0;
  if (tool_ != number) moved_with_mm_ = 0.0;
  tool_ = number;
  tapped_ = false;
  is_said_ = false;
  resumes_ = true;
}

Result<void> SpindleAndCoolant::check_before_cut(SourceRef where) {
  if (std::exchange(is_said_, true)) return {};
  const std::string& file = posting_.job.cl_file;
  if (spindle_.turn == nc::SpindleTurn::counterclockwise && said_for_ && said_for_ != tool_)
    return fail(
        ErrorCode::wrong_input,
        "no SPINDL since the tool was loaded, and the tool before turned counterclockwise: say which way "
        "this one turns",
        file, where);
  if (spindle_.turn == nc::SpindleTurn::off) {
    posting_.diagnostics.warning(
        file, where,
        rpm_ > 0.0 ? "the spindle was stopped before this cut (SPINDL/OFF or ORIENT), and does not turn"
                   : "no SPINDL before this cut: the spindle does not turn");
  } else {
    posting_.diagnostics.warning(file, where,
                                 "no SPINDL since the tool was loaded: it turns at the " +
                                     std::to_string(spindle_.rpm) + " rpm of the tool before");
  }
  return {};
}

void SpindleAndCoolant::tell_new_diameter() {
  const double before_mm = std::exchange(moved_with_mm_, diameter_mm_);
  if (!(before_mm > 0.0)) return;
  posting_.warn_once("new diameter", diameter_where_,
                     "a diameter of " + shortest_text(diameter_mm_) + " mm, and the tool in the spindle" +
                         (tool_ ? ", tool " + std::to_string(*tool_) + "," : std::string()) +
                         " has moved with " + shortest_text(before_mm) +
                         " mm: no tool change stands between. It goes on with the same tool");
}

Result<void> SpindleAndCoolant::resume() {
  has_moved_ = true;
  if (moved_with_mm_ != diameter_mm_) tell_new_diameter();
  if (!std::exchange(resumes_, false)) return {};
  tapped_ = false;
  if (spindle_.turn != nc::SpindleTurn::off) {
    if (auto r = posting_.write(spindle_); !r) return r;
  }
  for (const nc::CoolantKind kind :
       {nc::CoolantKind::flood, nc::CoolantKind::mist, nc::CoolantKind::through_tool, nc::CoolantKind::air}) {
    if ((coolant_ & (1U << static_cast<unsigned>(kind))) == 0) continue;
    if (auto r = posting_.write(nc::Coolant{kind}); !r) return r;
  }
  return {};
}

}  // namespace trunnion::post
