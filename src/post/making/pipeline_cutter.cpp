// Cutter compensation that adds wear to a path of the tool's centre.
#include <cmath>

#include "post/making/pipeline.hpp"

namespace trunnion::post {

Result<void> Pipeline::emit_cutter_compensation(const cl::CutterCompensation& c, SourceRef where) {
  const auto side = static_cast<nc::CutterSide>(c.side);
  if (side == cutter_.side) return {};
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::check_failed, "CUTCOM: " + why, posting_.job.cl_file, where);
  };
  if (posting_.controller.cutter_compensation[static_cast<std::size_t>(side)].empty())
    return refuse("the controller file has no words for it ([cutter_compensation])");
  if (posting_.options.rtcp) return refuse("not under tool-centre-point control");
  if (thermal_.is_at_run_time()) return refuse("not with values at run time");
  if (side != nc::CutterSide::off && cutter_.is_on())
    return refuse("CUTCOM/OFF is missing before the other side");
  if (at_.approaches || !at_.known) {
    if (side == nc::CutterSide::off) return {};
    return refuse("the tool must have been positioned before it is switched on");
  }
  const std::int64_t number = c.wear_register ? *c.wear_register : tool_.length_register;
  if (side != nc::CutterSide::off) {
    posting_.diagnostics.warning_once("wear", posting_.job.cl_file, where,
                                      "CUTCOM: verified with nothing in register " + std::to_string(number) +
                                          ": it holds the wear of the tool, not its radius");
    const std::string text =
        "CUTTER COMPENSATION: REGISTER " + std::to_string(number) + " HOLDS WEAR ONLY, 0 FOR A NEW TOOL";
    if (auto done = posting_.write(nc::Comment{text}); !done) return done;
  }
  cutter_ = {side, true};
  return posting_.write(nc::CutterCompensation{side, side == nc::CutterSide::off ? 0 : number});
}

Result<void> Pipeline::check_compensated(std::size_t i) {
  const path::Point to = now_.chunk->point(i);
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::check_failed, "CUTCOM: " + why, posting_.job.cl_file, to.where);
  };
  const bool on = cutter_.is_on();
  if (on && (at_.approaches || now_.chunk->motions[i].point.rapid))
    return refuse("CUTCOM/OFF is missing before this rapid");
  if (on && !same_rotary(at_.point.q, to.q))
    return refuse("the tool axis turns while the control compensates: CUTCOM/OFF is missing");
  if (cutter_.changes && !at_.approaches) {
    const Vec3 way = word_xyz(to.tip_P, to.q) - word_xyz(at_.point.tip_P, at_.point.q);
    const double across_mm = std::hypot(way.x(), way.y());
    const double digit_mm = posting_.controller.numbers.axes.quantum(nc::AxisLetter::X);
    if (on && (across_mm <= digit_mm || std::abs(way.z()) > digit_mm))
      return refuse("the motion that leads in must be a line across the tool axis");
    cutter_.changes = !on && across_mm <= digit_mm;
  }
  return {};
}

}  // namespace trunnion::post
