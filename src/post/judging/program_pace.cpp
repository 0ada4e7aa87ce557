// How fast a program cuts, beside what its CL file asks for.
#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"

#include "post/feeds/feed_plan.hpp"
#include "post/judging/program_judge.hpp"

namespace trunnion::post {
namespace {

// What the post allows itself between the way of the tip and that by which a control divides F, and a little.
constexpr double kOtherWay = 1.02 * (1.0 + kSameWay);
constexpr double kRoundedEnds = 4.0;        // quanta of X Y Z
constexpr double kCorrected_mm = 0.05;      // by which corrections of errors change from block to block
constexpr double kSlower = 1.05;            // beyond what axes and F explain
constexpr double kShort_s = 1e-3;           // blocks of this time may be slower
constexpr double kShortCorrected_s = 0.03;  // as above; blocks that take up lost motion among them

std::string rate_text(double mm_s) {
  return fixed_text(mm_s * kSecondsPerMinute, 1) + " mm/min";
}

}  // namespace

double ProgramJudge::rate_of(const AskedState& asked) const {
  switch (asked.feed.mode) {
    case cl::FeedMode::per_minute:
      return asked.feed.value;
    case cl::FeedMode::per_revolution:
      return asked.feed.value * asked.rpm / kSecondsPerMinute;
    case cl::FeedMode::none:
      return options_.default_feed_mm_s.value_or(0.0);
    case cl::FeedMode::inverse:
      break;
  }
  return 0.0;
}

bool ProgramJudge::is_corrected() const {
  return options_.truth != nullptr || options_.offsets != nullptr || options_.has_lags();
}

// Blocks may go from one side of the path to the other.
double ProgramJudge::pace_slack_mm() const {
  const bool corrected = is_corrected();
  return kRoundedEnds * controller_.numbers.axes.quantum(nc::AxisLetter::X) + 2.0 * options_.tolerance_mm +
         (corrected ? kCorrected_mm : 0.0);
}

void ProgramJudge::check_progress(const Cut& cut, double seconds, const Rates& rates, std::uint32_t nc_line) {
  const auto along = [&](const Place& place) {
    const std::size_t next = std::min(place.segment + 1, points_.size() - 1);
    return points_[place.segment].along_mm + place.t * points_[next].way_mm;
  };
  const double way_mm = along(cut.to) - along(cut.from);
  if (way_mm <= seconds * rates.most * kOtherWay + rates.slack_mm) return;
  find(CheckOf::feeds, nc_line, [&] {
    return "up to here the tip goes " + fixed_text(way_mm, 4) + " mm along its path in " +
           shortest_text(std::round(1e5 * seconds) / 1e5) + " s, " + rate_text(way_mm / seconds) +
           "; the CL file asks for " + rate_text(rates.most);
  });
}

ProgramJudge::Rates ProgramJudge::rates_of(const Cut& cut, const Covered& covered) const {
  Rates out;
  out.slack_mm = pace_slack_mm();
  out.known = covered.any;
  if (!covered.any) return out;
  out.least = std::numeric_limits<double>::infinity();
  const std::size_t first = std::min(covered.first, cut.beside.value_or(covered.first));
  const std::size_t last = std::max(covered.last, cut.beside.value_or(covered.last));
  for (std::size_t j = number(first); j <= number(last); j = asked_.next_change(j)) {
    const AskedState& asked = asked_.at(j);
    const double rate = rate_of(asked);
    out.known = out.known && rate > 0.0;
    out.least = std::min(out.least, rate);
    out.most = std::max(out.most, rate);
    if (asked.rotary_rad_s > 0.0)
      out.rotary_rad_s =
          out.rotary_rad_s > 0.0 ? std::min(out.rotary_rad_s, asked.rotary_rad_s) : asked.rotary_rad_s;
  }
  return out;
}

// Of CL motions that are to last so long blocks have a share.
ProgramJudge::InverseShare ProgramJudge::inverse_share(const Cut& cut, const Covered& covered) const {
  InverseShare out;
  for (std::size_t j = covered.first; covered.any && j <= covered.last; ++j) {
    const AskedState& asked = asked_.at(number(j));
    if (asked.feed.mode != cl::FeedMode::inverse) return {};
    const double begins = j == cut.from.segment + 1 ? cut.from.t : 0.0;
    const double ends = j == cut.to.segment + 1 ? cut.to.t : 1.0;
    const double share = std::max(0.0, ends - begins);
    if (!(points_[j].way_mm > kNearEnd_mm) && !(points_[j].turn > kNearEnds * options_.axis_tolerance.rad()))
      continue;
    out.seconds += share / asked.feed.value;
    out.way_mm += share * points_[j].way_mm;
    out.turn_rad += share * points_[j].turn;
  }
  return out;
}

// A part of a motion may be faster than another: by the way of the tip, where that tells it, it is held to
// its share, and the whole of it to its time.
void ProgramJudge::check_inverse(const Cut& cut, const Covered& covered, const InverseTimes& pace,
                                 const InverseShare& share, std::uint32_t nc_line) {
  if (share.seconds <= 0.0 || pace.seconds <= 0.0) {
    inverse_ = {};
    return;
  }
  inverse_.asked.seconds += share.seconds;
  inverse_.asked.way_mm += share.way_mm;
  inverse_.asked.turn_rad += share.turn_rad;
  inverse_.seconds += pace.seconds;
  inverse_.slowest_s += pace.slowest_s;
  inverse_.beyond_s += pace.beyond_s;
  const auto say = [&](const InverseSum& sum) {
    find(CheckOf::feeds, nc_line, [&] {
      return "up to here it takes " + fixed_text(sum.seconds, 4) + " s, FEDRAT/INVERS asks for " +
             fixed_text(sum.asked.seconds, 4) + " s, the slowest axis needs " + fixed_text(sum.slowest_s, 4) +
             " s" + cl_line(points_[covered.last].line);
    });
  };
  // Where a block begins and ends on its motion is known so well.
  const double slack_mm = kNearEnd_mm + kNearEnds * options_.tolerance_mm;
  const double slack = slack_mm / share.way_mm;
  if (slack * kNearEnds < 1.0 && pace.seconds < share.seconds * (1.0 - slack) / kOtherWay)
    return say({share, pace.seconds, pace.slowest_s, pace.beyond_s});
  const bool ends_motion =
      cut.to.t >= 1.0 || cut.to.t <= 0.0 || is_rounding(cut.to.segment + 1, 1.0 - cut.to.t);
  if (!ends_motion) return;
  const InverseSum sum = std::exchange(inverse_, {});
  const double slack_rad = kNearEnds * options_.axis_tolerance.rad();
  const double of_all = std::min(slack_mm / sum.asked.way_mm, slack_rad / sum.asked.turn_rad);
  if (!(of_all * kNearEnds < 1.0)) return;
  const double digit = 1.0 + 1.0 / static_cast<double>(std::max<std::int64_t>(pace.feed, 1));
  const bool corrected = is_corrected();
  const double longest_s = std::max(sum.asked.seconds * (1.0 + of_all) + sum.beyond_s, sum.slowest_s);
  if (sum.seconds * digit < sum.asked.seconds * (1.0 - of_all) / kOtherWay ||
      (!options_.has_lags() &&
       sum.seconds > kSlower * digit * longest_s + (corrected ? kShortCorrected_s : kShort_s)))
    say(sum);
}

void ProgramJudge::lasts(const Pace& pace, std::uint32_t nc_line) {
  if (!cut_) return;
  const Cut cut = *cut_;
  cut_.reset();
  const Covered motions = covered(cut);
  check_states(cut, motions, nc_line);
  if (told_.take_new_cutter() && !cut.outside && motions.first < motions.last) {
    find(CheckOf::path, nc_line, [&] {
      return "the motion in which the control goes to the compensated path, or leaves it, ends beyond that "
             "of the CL file" +
             cl_line(points_[motions.first].line) + ": the wear would be made up for along the wall";
    });
  }
  const Rates rates = rates_of(cut, motions);
  if (rates.known && pace.seconds > 0.0)
    return check_pace(pace, rates, motions.last, !cut.outside || cut.in_hole, nc_line);
  if (rates.known && cut.outside) return check_feed_word(pace, rates, motions.last, nc_line);
  if (cut.outside) return;
  const InverseShare share = inverse_share(cut, motions);
  const double slowest_s = slowest_of(pace, rates);
  const double beyond_s = std::max(0.0, slowest_s - share.seconds);
  check_inverse(cut, motions, {pace.seconds, slowest_s, beyond_s, pace.feed}, share, nc_line);
}

// Of a block that comes from a place that is not known the F word alone tells how fast it is.
void ProgramJudge::check_feed_word(const Pace& pace, const Rates& rates, std::size_t point,
                                   std::uint32_t nc_line) {
  if (pace.mode == nc::FeedMode::inverse_time) {
    return find(CheckOf::feeds, nc_line,
                [&] { return "inverse time from a place that is not known" + cl_line(points_[point].line); });
  }
  const double f = controller_.numbers.feed.internal(pace.mode, pace.feed);
  const bool too_slow = f * kSlower < std::min(rates.least, slowest_axis_mm_s_);
  if (f <= rates.most * kOtherWay && !too_slow) return;
  find(CheckOf::feeds, nc_line, [&] {
    return "F says " + rate_text(f) + ", the CL file asks for " + rate_text(rates.most) +
           cl_line(points_[point].line);
  });
}

// Half a digit of F, and of the time that it means.
double ProgramJudge::digit_of(const Pace& pace) {
  return 1.0 + 1.0 / static_cast<double>(std::max<std::int64_t>(pace.feed, 1));
}

double ProgramJudge::short_s() const {
  return is_corrected() ? kShortCorrected_s : kShort_s;
}

bool ProgramJudge::too_fast(const Pace& pace, const Rates& rates) const {
  return pace.way_mm > pace.seconds * rates.most * digit_of(pace) * kOtherWay + rates.slack_mm;
}

bool ProgramJudge::keeps_pace(const Pace& pace, const Rates& rates, bool may_not_be_slow) const {
  if (!(pace.seconds > 0.0)) return true;
  if (too_fast(pace, rates)) return false;
  // Words that are led are slow at corners.
  if (!may_not_be_slow || options_.has_lags()) return true;
  const double lasts_s = pace.seconds / digit_of(pace);
  if (lasts_s <= kSlower * pace.slowest_s + short_s()) return true;
  if ((lasts_s - short_s()) * rates.least <= kSlower * (kOtherWay * pace.way_mm + rates.slack_mm))
    return true;
  if (rates.rotary_rad_s > 0.0 && lasts_s <= kSlower * pace.turn_rad / rates.rotary_rad_s + short_s())
    return true;
  // The largest F that the control takes.
  const nc::Controller::FeedRules& rules = controller_.feed;
  const std::optional<double>& most =
      pace.mode == nc::FeedMode::inverse_time ? rules.max_inverse_time : rules.max_per_minute;
  const double f = controller_.numbers.feed.internal(pace.mode, pace.feed) * kSecondsPerMinute;
  return most && f >= *most / kSlower;
}

// As `keeps_pace` of blocks that last, without the digits of F, which only allow more.
ProgramJudge::SurePace ProgramJudge::sure_pace(const Rates& rates) const {
  SurePace out{rates.most * kOtherWay, rates.slack_mm, 0.0, 0.0, kSlower, short_s()};
  if (options_.has_lags()) return out;
  out.least_mm_s = rates.least / (kSlower * kOtherWay);
  out.less_mm = (short_s() * rates.least / kSlower + rates.slack_mm) / kOtherWay;
  return out;
}

// Of a block that is slow the axes may be the reason, which is known when those behind it are.
void ProgramJudge::off_pace(const Pace& pace, const Rates& rates, std::size_t point, std::uint32_t nc_line) {
  if (!accelerates_ || too_fast(pace, rates)) return find_pace(pace, rates, point, nc_line);
  Slow slow{pace, std::max(pace.slowest_s, pace.way_mm / rates.least), rates.slack_mm / rates.least,
            rates.most, points_[point].line};
  if (rates.rotary_rad_s > 0.0) slow.asked_s = std::max(slow.asked_s, pace.turn_rad / rates.rotary_rad_s);
  slow_ = slow;
}

void ProgramJudge::judge_slow(const Slow& slow, double reached_s, std::uint32_t nc_line) {
  const Pace& pace = slow.pace;
  if (pace.seconds / digit_of(pace) <= kSlower * (reached_s + slow.slack_s) + short_s()) return;
  find(CheckOf::feeds, nc_line, [&] {
    return "the tip goes " + shortest_text(std::round(1e4 * pace.way_mm) / 1e4) + " mm in " +
           shortest_text(std::round(1e5 * pace.seconds) / 1e5) + " s; the CL file asks for " +
           rate_text(slow.rate_mm_s) + cl_line(slow.cl_line) + ", and its axes need " +
           shortest_text(std::round(1e5 * reached_s) / 1e5) + " s to get as fast as they can";
  });
}

void ProgramJudge::find_pace(const Pace& pace, const Rates& rates, std::size_t point, std::uint32_t nc_line) {
  find(CheckOf::feeds, nc_line, [&] {
    std::string text = "the tip goes " + shortest_text(std::round(1e4 * pace.way_mm) / 1e4) + " mm in " +
                       shortest_text(std::round(1e5 * pace.seconds) / 1e5) + " s, " +
                       rate_text(pace.way_mm / pace.seconds) + "; the CL file asks for " +
                       rate_text(rates.most);
    if (rates.least < rates.most) text += " or " + rate_text(rates.least);
    text += cl_line(points_[point].line);
    if (pace.way_mm < pace.seconds * rates.least)
      text += "; its slowest axis needs " + shortest_text(std::round(1e5 * pace.slowest_s) / 1e5) + " s";
    return text;
  });
}

}  // namespace trunnion::post
