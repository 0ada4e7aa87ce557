#include "post/making/cutter_words.hpp"

#include <cmath>

namespace trunnion::post {

Result<void> CutterWords::switch_to(const cl::CutterCompensation& c, SourceRef where) {
  const auto side = static_cast<nc::CutterSide>(c.side);
  if (side == work_.cutter.side) return {};
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::check_failed, "CUTCOM: " + why, work_.posting.job.cl_file, where);
  };
  if (work_.posting.controller.cutter_compensation[static_cast<std::size_t>(side)].empty())
    return refuse("the controller file has no words for it ([cutter_compensation])");
  if (work_.posting.options.rtcp) return refuse("not under tool-centre-point control");
  if (work_.thermal.is_at_run_time()) return refuse("not with values at run time");
  if (side != nc::CutterSide::off && work_.cutter.is_on())
    return refuse("CUTCOM/OFF is missing before the other side");
  if (work_.at.approaches || work_.at.returns || !work_.at.known) {
    if (side == nc::CutterSide::off) return {};
    return refuse("the tool must have been positioned before it is switched on");
  }
  const std::int64_t number = c.wear_register ? *c.wear_register : work_.tool.length_register;
  const bool is_tool = number == static_cast<std::int64_t>(work_.spindle.tool().value_or(1));
  if (side != nc::CutterSide::off && work_.posting.controller.wear_register_is_tool && is_tool)
    return refuse(
        "on " + work_.posting.controller.name + " register " + std::to_string(number) + " is tool " +
        std::to_string(number) +
        " of the tool table, and the control adds half its diameter, not its wear. Name an entry that holds "
        "the wear alone and is no tool of the program: CUTCOM/LEFT,ADJUST,n or OSETNO,n");
  if (side != nc::CutterSide::off) {
    work_.posting.warn_once("wear", where,
                            "CUTCOM: verified with nothing in register " + std::to_string(number) +
                                ": it holds the wear of the tool, not its radius");
    if (number == work_.tool.length_register && !work_.posting.controller.wear_register_is_tool)
      work_.posting.warn_once(
          "wear in a length", where,
          "CUTCOM: register " + std::to_string(number) +
              " is that of the tool's length, too. A control that keeps lengths and wear in one memory would "
              "move the contour by the length of the tool: look how yours keeps them, or name another "
              "register "
              "(CUTCOM/LEFT,ADJUST,n or OSETNO,n)");
    const std::string text =
        "CUTTER COMPENSATION: REGISTER " + std::to_string(number) + " HOLDS WEAR ONLY, 0 FOR A NEW TOOL";
    if (auto done = work_.posting.write(nc::Comment{text}); !done) return done;
  }
  work_.cutter = {side, true};
  return work_.posting.write(nc::CutterCompensation{side, side == nc::CutterSide::off ? 0 : number});
}

Result<void> CutterWords::check(std::size_t i) {
  const path::Point to = work_.now.chunk->point(i);
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::check_failed, "CUTCOM: " + why, work_.posting.job.cl_file, to.where);
  };
  const bool on = work_.cutter.is_on();
  if (on && (work_.at.approaches || work_.now.chunk->points[i].rapid))
    return refuse("CUTCOM/OFF is missing before this rapid");
  if (on && !work_.same_rotary(work_.at.point.q, to.q))
    return refuse("the tool axis turns while the control compensates: CUTCOM/OFF is missing");
  if (work_.cutter.changes && !work_.at.approaches) {
    const Vec3 way = words_.xyz(to.tip_P, to.q) - words_.xyz(work_.at.point.tip_P, work_.at.point.q);
    const double across_mm = std::hypot(way.x(), way.y());
    const double digit_mm = work_.posting.controller.numbers.axes.quantum(nc::AxisLetter::X);
    if (on && (across_mm <= digit_mm || std::abs(way.z()) > digit_mm))
      return refuse("the motion that leads in must be a line across the tool axis");
    work_.cutter.changes = !on && across_mm <= digit_mm;
  }
  return {};
}

}  // namespace trunnion::post
