#pragma once
#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "trunnion/base/lanes.hpp"
#include "trunnion/machine/machine.hpp"
#include "trunnion/post/checks.hpp"
#include "trunnion/post/verify.hpp"

#include "post/judging/asked.hpp"
#include "post/judging/path_place.hpp"
#include "post/judging/path_points.hpp"
#include "post/judging/told.hpp"

// Private to the verifier: the program beside its path.
namespace trunnion::post {

/// Where a block ends is known but for rounding and what it is off its place, that in tolerances.
inline constexpr double kNearEnd_mm = 2e-3;
inline constexpr double kNearEnds = 3.0;

/// " (CL line 7)", behind a finding.
std::string cl_line(std::uint32_t line);

/// How long a block lasts, and what that must do for.
struct Pace {
  double way_mm = 0.0;     // of the tip, words taken as they are
  double turn_rad = 0.0;   // largest turn of a rotary axis
  double seconds = 0.0;    // 0: from where it goes is not known
  double slowest_s = 0.0;  // that its slowest axis needs
  nc::FeedMode mode = nc::FeedMode::per_minute;
  std::int64_t feed = 0;  // quanta
};

/// Holds what the words of a program set against what its CL file and the job ask for, at every cut. It is
/// told of the program's words and motions in their order, and of a motion where on the CL path it is; of
/// geometry it knows nothing more. What it finds goes into the table of the report.
class ProgramJudge {
 public:
  /// References must outlive the judge; the points are those of the CL path.
  ProgramJudge(const Machine& machine, const nc::Controller& controller, const VerifyOptions& options,
               const PathPoints& points);

  /// The CL file: motions, and records that are none.
  Asked& asked() { return asked_; }
  /// No length is to be added where no tool is loaded.
  void expect_no_length() { adds_length_ = false; }

  /// Words that are no motion, and motions at whose end not all axes are known.
  /// @param at  where the program is on the path
  void take(const nc::Block& block, const Place& at, std::uint32_t nc_line);
  /// Any motion.
  void check_offset(std::uint32_t nc_line);
  /// The axes of a motion.
  void take_axes(std::uint16_t mask, std::uint32_t nc_line) {
    if ((mask & ~axes_) != 0) find_axis(mask, nc_line);
  }

  /// The block at hand is a feed from one place of the path to another. `lasts` must follow.
  void cut(const Place& from, const Place& to) { cut_ = {from, to, false}; }
  /// It comes to a place of the path from outside: the motion to this CL point is the next to be cut.
  void comes_to(std::size_t point) { cut_ = {{point - 1}, {point - 1, 1.0}, true}; }
  /// As `comes_to`, in a stroke of a hole that has steps.
  void drills_to(std::size_t point) { cut_ = {{point - 1}, {point - 1, 1.0}, true, {}, true}; }
  /// As `comes_to`, to the place that it has left. Where two motions meet, what is said for the second stands
  /// before or behind the way out and back.
  void comes_back(std::size_t point, const Place& at);
  /// Asked::stops_before, of this point.
  bool stops_before(std::size_t point) const { return asked_.stops_before(number(point)); }
  /// The motion to this CL point is one with another tool.
  bool wants_another_tool(std::size_t point) const { return asked_.at(number(point)).tool != told_.tool(); }
  /// How long the block at hand lasts: what it is told about is judged.
  void lasts(const Pace& pace, std::uint32_t nc_line);
  /// What blocks keep to whose pace is surely that of the CL file, whatever the digits of F: a cheap test
  /// that most pass.
  struct SurePace {
    double most_mm_s, more_mm;   // the way is no longer than seconds * most + more,
    double least_mm_s, less_mm;  // and no shorter than seconds * least - less,
    double of_axes, short_s;     // or no more than of_axes times what the slowest axis needs, and so many s

    template <class T>
    lanes::Mask<T> holds(const T& way_mm, const T& seconds, const T& slowest_s) const {
      return (way_mm <= seconds * most_mm_s + more_mm) &
             ((way_mm >= seconds * least_mm_s - less_mm) | (seconds <= of_axes * slowest_s + short_s));
    }
  };
  /// Feeds one after the other, from one place of the path to another. Of each `rows` has the `pace(i)`, the
  /// `seconds(i)` of it and the `line(i)`, and whether `all_keep` a pace; `judged(i)` follows when it has
  /// been: `take_slow` is about it then.
  template <class Rows>
  void cut(const Place& from, const Place& to, std::size_t count, const Rows& rows) {
    if (count == 0) return;
    const Cut all{from, to, false};
    const Covered motions = covered(all);
    check_states(all, motions, rows.line(count - 1));
    const Rates rates = rates_of(all, motions);
    if (!rates.known) {
      const InverseShare share = inverse_share(all, motions);
      check_inverse(all, motions, together(share.seconds, rates, count, rows), share, rows.line(count - 1));
      for (std::size_t i = 0; i < count; ++i) rows.judged(i);
      return;
    }
    const bool all_keep = rows.all_keep(sure_pace(rates), count);
    double seconds = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      seconds += rows.seconds(i);
      if (!all_keep) check_pace(rows.pace(i), rates, motions.last, true, rows.line(i));
      rows.judged(i);
    }
    check_progress(all, seconds, rates, rows.line(count - 1));
  }
  /// A block that lasts longer than its feed and the speeds of its axes ask for.
  struct Slow {
    Pace pace;
    double asked_s = 0.0;    // the longest that these ask for
    double slack_s = 0.0;    // by which that is not known
    double rate_mm_s = 0.0;  // of the CL file, line `cl_line`
    std::uint32_t cl_line = 0;
  };
  /// The block that was judged last, if it is one and its axes may be the reason: `judge_slow` must follow
  /// when that is known.
  std::optional<Slow> take_slow() { return std::exchange(slow_, std::nullopt); }
  /// `reached_s`: what it lasts at the largest speed that its axes reach in it.
  void judge_slow(const Slow& slow, double reached_s, std::uint32_t nc_line);
  /// The limits that the control takes its values under (VerifyOptions::offset_limits), `elapsed_s` after it
  /// took them before.
  void check_limits(const nc::LatchValues& latch, double elapsed_s, std::uint32_t nc_line);
  /// A rapid that ends at this CL point.
  void rapid_to(std::size_t point, std::uint32_t nc_line);
  template <class What>
  void find(CheckOf of, std::uint32_t nc_line, const What& what) {
    Check& check = checks_[static_cast<std::size_t>(of)];
    ++check.count;
    if (check.places.size() >= options_.worst_count) return;
    std::string text = what();
    if (!check.places.empty() && check.places.back().what == text) return;
    check.places.push_back({nc_line, std::move(text)});
  }

  /// Motion number `point` of those that are known now, or later ones: the first with another state than it.
  std::size_t next_change(std::size_t point) const;

  /// What FEDRAT/INVERS asks of blocks together, and how far they go.
  struct InverseShare {
    double seconds = 0.0;
    double way_mm = 0.0, turn_rad = 0.0;
  };
  struct InverseSum {
    InverseShare asked;
    double seconds = 0.0, slowest_s = 0.0;
    double beyond_s = 0.0;  // by which slow axes take longer than their blocks' shares
  };
  /// What was found so far, to go back to.
  struct Found {
    std::array<std::size_t, kChecks> count{}, places{};
    InverseSum inverse;
    std::size_t pauses_met = 0;
  };
  Found found() const;
  void go_back_to(const Found& found);

  /// The program has been read to its end. The rest of the report is there.
  void finish(VerifyReport& report, std::uint32_t nc_line);

 private:
  /// The motions of the CL file, by the points at which they end, of which a block cuts more than rounding.
  struct Cut {
    Place from, to;
    bool outside = false;
    std::optional<std::size_t> beside{};  // the motion that meets the covered one where it comes back
    bool in_hole = false;
  };
  struct Covered {
    std::size_t first = 0, last = 0;
    bool any = false;
  };
  /// Feeds of the CL file, mm/s.
  struct Rates {
    double least = 0.0, most = 0.0;
    double rotary_rad_s = 0.0;  // MAXDPM; 0: none
    double slack_mm = 0.0;      // by which the way of one block may be longer
    bool known = false;
  };

  std::size_t number(std::size_t point) const { return point + points_.gone(); }
  void check_feed_word(const Pace& pace, const Rates& rates, std::size_t point, std::uint32_t nc_line);
  bool is_rounding(std::size_t point, double share) const;
  Covered covered(const Cut& cut) const;
  bool agrees(const AskedState& asked) const;
  Rates rates_of(const Cut& cut, const Covered& covered) const;
  double rate_of(const AskedState& asked) const;
  InverseShare inverse_share(const Cut& cut, const Covered& covered) const;
  /// `blocks`: their times, together; the share that is asked of them.
  struct InverseTimes {
    double seconds = 0.0, slowest_s = 0.0, beyond_s = 0.0;
    std::int64_t feed = 0;  // of the first
  };
  void check_inverse(const Cut& cut, const Covered& covered, const InverseTimes& blocks,
                     const InverseShare& share, std::uint32_t nc_line);
  /// MAXDPM among what holds the axes.
  static double slowest_of(const Pace& pace, const Rates& rates) {
    return rates.rotary_rad_s > 0.0 ? std::max(pace.slowest_s, pace.turn_rad / rates.rotary_rad_s)
                                    : pace.slowest_s;
  }
  /// Each block has a share by its way, or its turn where the tip stands.
  template <class Rows>
  static InverseTimes together(double asked_s, const Rates& rates, std::size_t count, const Rows& rows) {
    double way_mm = 0.0, turn_rad = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const Pace block = rows.pace(i);
      way_mm += block.way_mm;
      turn_rad += block.turn_rad;
    }
    InverseTimes out;
    out.feed = rows.pace(0).feed;
    for (std::size_t i = 0; i < count; ++i) {
      const Pace block = rows.pace(i);
      out.seconds += block.seconds;
      const double slowest_s = slowest_of(block, rates);
      out.slowest_s += slowest_s;
      const double part = way_mm > kNearEnd_mm ? block.way_mm / way_mm
                          : turn_rad > 0.0     ? block.turn_rad / turn_rad
                                               : 1.0;
      out.beyond_s += std::max(0.0, slowest_s - asked_s * part);
    }
    return out;
  }
  void find_axis(std::uint16_t mask, std::uint32_t nc_line);
  void check_states(const Cut& cut, const Covered& covered, std::uint32_t nc_line);
  void check_place(const AskedState& asked, std::uint32_t nc_line);
  void check_length(const AskedState& asked, std::uint32_t nc_line);
  void check_cut(const AskedState& asked, std::uint32_t nc_line);
  void check_thread(const AskedState& asked, std::uint32_t nc_line);
  void check_pauses(std::size_t point, std::uint32_t nc_line);
  void check_pace(const Pace& pace, const Rates& rates, std::size_t point, bool may_not_be_slow,
                  std::uint32_t nc_line) {
    if (!keeps_pace(pace, rates, may_not_be_slow)) off_pace(pace, rates, point, nc_line);
  }
  SurePace sure_pace(const Rates& rates) const;
  bool too_fast(const Pace& pace, const Rates& rates) const;
  bool keeps_pace(const Pace& pace, const Rates& rates, bool may_not_be_slow) const;
  void off_pace(const Pace& pace, const Rates& rates, std::size_t point, std::uint32_t nc_line);
  static double digit_of(const Pace& pace);
  double short_s() const;
  bool is_corrected() const;  // words are not where the path is
  double pace_slack_mm() const;
  void check_progress(const Cut& cut, double seconds, const Rates& rates, std::uint32_t nc_line);
  void find_pace(const Pace& pace, const Rates& rates, std::size_t point, std::uint32_t nc_line);
  /// A motion at whose end not all axes are known.
  void take_partly(const nc::Motion& motion, std::uint32_t nc_line);
  void check_needs_length(bool on, std::uint32_t nc_line);
  void check_register(const nc::LengthCompensation& length, const Place& at, std::uint32_t nc_line);
  void find_cutter(const AskedState& asked, std::uint32_t nc_line);
  void take_pause(const Place& at, const AskedPause& told, std::uint32_t nc_line);
  /// What the CL file has switched off before it is off.
  void check_stop(const AskedPause& stop, std::uint32_t nc_line);
  bool asks_about(const Place& at, const std::function<bool(const nc::Spindle&, unsigned)>& is) const;
  void check_speed(const nc::Spindle& spindle, const Place& at, std::uint32_t nc_line);
  void check_coolant(const nc::Coolant& coolant, const Place& at, std::uint32_t nc_line);

  const Machine& machine_;
  const nc::Controller& controller_;
  const VerifyOptions& options_;
  const PathPoints& points_;
  Asked asked_;
  Told told_;
  bool adds_length_;
  std::uint16_t axes_ = 0;  // bits of the words that the machine has
  bool accelerates_;        // the machine file says how fast every axis does
  std::optional<Slow> slow_;
  InverseSum inverse_;                                                  // since the last CL point
  double slowest_axis_mm_s_ = std::numeric_limits<double>::infinity();  // of X Y Z
  std::optional<Cut> cut_;                                              // at hand
  Checks checks_;
  std::vector<AllowedUse> allowed_;
};

}  // namespace trunnion::post
