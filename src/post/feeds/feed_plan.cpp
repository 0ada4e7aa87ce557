#include "post/feeds/feed_plan.hpp"

#include <algorithm>

namespace trunnion::post {
namespace {

constexpr double kRoundedWay = 2.0;  // quanta: root of 3, half a quantum of X Y Z at either end

}  // namespace

FeedPlanner::FeedPlanner(const Machine& machine, const nc::Controller& controller, FeedOutput output)
    : times_(machine, controller),
      inverse_(output == FeedOutput::inverse && controller.has_inverse_time()),
      rounding_mm_(kRoundedWay * controller.numbers.axes.quantum(nc::AxisLetter::X)) {}

// The largest F of this mode with which the block does not last less than `seconds` but for half a digit, and
// never less than the axes need. Per minute of linear axes it is `rate_mm_s`.
BlockFeed FeedPlanner::in_mode(nc::FeedMode mode, const ControlTimes::Way& way, double axes_s, double seconds,
                               double rate_mm_s) const {
  const nc::Controller& controller = times_.controller();
  const nc::FeedFormat& format = controller.numbers.feed;
  BlockFeed out;
  out.mode = mode;
  out.wanted_s = seconds;
  if (mode == nc::FeedMode::inverse_time) {
    if (controller.feed.max_inverse_time)
      out.wanted_s = std::max(seconds, kSecondsPerMinute / *controller.feed.max_inverse_time);
    out.quanta = format.quanta(mode, 1.0 / out.wanted_s);
  } else if (way.rotary_only) {
    out.quanta = format.rotary_quanta(way.length / seconds);
  } else {
    double rate = rate_mm_s;
    if (controller.feed.max_per_minute)
      rate = std::min(rate, *controller.feed.max_per_minute / kSecondsPerMinute);
    out.quanta = format.quanta(mode, rate);
  }
  const auto lasts = [&] { return times_.seconds(way, mode, out.quanta); };
  out.seconds = lasts();
  if (out.seconds < axes_s && out.quanta > 1) {
    --out.quanta;
    out.seconds = lasts();
  }
  return out;
}

BlockFeed FeedPlanner::plan(const Move& move, double feed_mm_s) const {
  const double tip_s = move.tip_mm / feed_mm_s;
  const double seconds = std::max(tip_s, move.axes_s) / move.pace;
  const bool inverse = inverse_ && axes().turns(move.a, move.b);
  const ControlTimes::Way way = times_.way(move.a, move.b, move.tcp_way_mm);
  const auto in = [&](nc::FeedMode mode) {
    return in_mode(mode, way, move.axes_s, seconds, way.length / seconds);
  };
  const double programmed_s = way.length / feed_mm_s;
  const bool as_programmed =
      !way.rotary_only && is_way_of_tip(way.length, move.tip_mm) && programmed_s >= move.axes_s;
  if (as_programmed && (move.tcp_way_mm || !axes().turns(move.a, move.b))) {
    BlockFeed out =
        in_mode(nc::FeedMode::per_minute, way, move.axes_s, programmed_s / move.pace, feed_mm_s * move.pace);
    out.lost_s = programmed_s / move.pace - programmed_s;
    return out;
  }
  BlockFeed out = in(inverse ? nc::FeedMode::inverse_time : nc::FeedMode::per_minute);
  if (inverse && (out.runs_away() || out.seconds < move.axes_s)) {
    // Below the lowest rate of inverse time; a feed per minute has none.
    const BlockFeed other = in(nc::FeedMode::per_minute);
    if (other.seconds > out.seconds) out = other;
    out.other_mode = true;
  }
  if (tip_s > kTipMoves * move.axes_s) out.lost_s = seconds - tip_s;
  return out;
}

}  // namespace trunnion::post
