#include "trunnion/trace/compare.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "trunnion/base/number_text.hpp"

#include "trace/causes.hpp"
#include "trace/cl_course.hpp"

namespace trunnion::trace {
namespace {

constexpr std::size_t kSlowBlocks = 10;

double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

ToolPose pose_of(const Plan& plan, const Machine& machine, const JointVector& q, double length_mm) {
  const Vec3 tool(0.0, 0.0, -length_mm);
  return plan.pose ? plan.pose(q, tool) : tool_pose(forward(machine, q, tool));
}

// From sample to sample: of a vector across the path, the standard deviation of one of its two coordinates.
// Quantiles of the lengths of such vectors, over sigma: Rayleigh's distribution. The largest of them: where
// an axis scatters at the end of a long arm, or with its speed, most rows are better than the worst.
class Scatter {
 public:
  void add(const Vec3& before, const Vec3& at, const Vec3& after) {
    lengths_.push_back((at - 0.5 * (before + after)).norm());
  }
  double sigma() {
    const double by = std::sqrt(1.5);  // variance of a value less the mean of two others
    double most = 0.0;
    for (const double share : {0.5, 0.9, 0.99})
      most = std::max(most, quantile(lengths_, share) / std::sqrt(-2.0 * std::log(1.0 - share)));
    return most / by;
  }

 private:
  std::vector<double> lengths_;
};

// How far an axis may be beside the straight line between two values that are so far apart: an eighth of what
// their neighbours are off from going straight on. Of all axes together, scaled mm.
double unsure_between_values(const Followed& followed, double time_s, double apart_s) {
  const auto at = [&](double t) -> Scaled {
    const auto& times = followed.time_s;
    const auto behind =
        static_cast<std::size_t>(std::upper_bound(times.begin(), times.end(), t) - times.begin());
    if (behind == 0) return followed.x.front();
    if (behind == times.size()) return followed.x.back();
    const double share = (t - times[behind - 1]) / (times[behind] - times[behind - 1]);
    return (1.0 - share) * followed.x[behind - 1] + share * followed.x[behind];
  };
  return 0.125 * (at(time_s - apart_s) - 2.0 * at(time_s) + at(time_s + apart_s)).norm();
}

// At how many rows nobody knows whether the tip is within the tolerance.
void remark_between_values(const Followed& followed, double apart_s, double tolerance_mm,
                           TraceReport& report) {
  std::size_t count = 0;
  double most_mm = 0.0;
  for (std::size_t i = followed.at.first; i <= followed.at.last; ++i) {
    if (std::isnan(followed.at.s[i])) continue;
    const double unsure_mm = unsure_between_values(followed, followed.time_s[i], apart_s);
    count += unsure_mm > tolerance_mm ? 1U : 0U;
    most_mm = std::max(most_mm, unsure_mm);
  }
  if (count == 0) return;
  report.remarks.push_back(
      "every axis was recorded at moments of its own: at " + std::to_string(count) +
      " rows, where axes change their speeds between two values, the tip is known no better than within " +
      fixed_text(most_mm * 1e3, 1) + " um");
}

// Rows along the program, one after the other.
class Judge {
 public:
  Judge(const Followed& followed, const JointPath& path, const Machine& machine, const Plan& plan,
        TraceReport& report)
      : followed_(followed),
        path_(path),
        machine_(machine),
        plan_(plan),
        report_(report),
        course_(machine, plan) {}

  void run(const CompareOptions& options) {
    const auto& at = followed_.at;
    for (std::size_t i = at.first; i <= at.last; ++i) {
      if (std::isnan(at.s[i])) {
        run_length_ = 0;
        continue;
      }
      ++report_.coverage.on_path;
      take(i, options);
    }
    report_.rms_tip_deviation_mm = count_ == 0 ? 0.0 : std::sqrt(sum2_ / static_cast<double>(count_));
    report_.scatter_mm = scatter_.sigma();
    const double most = std::sqrt(2.0 * std::log(std::max<double>(static_cast<double>(count_), 2.0)));
    report_.uncertainty_mm = report_.scatter_mm * (most + 1.0);
    for (const auto& [line, place] : worst_) report_.places.push_back(place);
    std::sort(report_.places.begin(), report_.places.end(),
              [](const TracePlace& a, const TracePlace& b) { return a.tip_mm > b.tip_mm; });
    if (report_.places.size() > options.worst_count) report_.places.resize(options.worst_count);
    if (!report_.places.empty()) report_.worst = report_.places.front();
  }
  std::size_t feed_samples() const { return count_; }

 private:
  void take(std::size_t i, const CompareOptions& options) {
    const double s = followed_.at.s[i];
    const std::size_t segment = path_.segment_at(s);
    const std::size_t block = path_.segment(segment).block;
    const PlannedBlock& planned = plan_.blocks[block];
    const JointVector q = unscaled(machine_, followed_.x[i]);
    const ToolPose tool = pose_of(plan_, machine_, q, planned.length_mm);
    if (planned.rapid) {
      const ToolPose wanted = pose_of(plan_, machine_, unscaled(machine_, path_.at(s)), planned.length_mm);
      report_.max_rapid_deviation_mm =
          std::max(report_.max_rapid_deviation_mm, (tool.tip_P - wanted.tip_P).norm());
      run_length_ = 0;
      return;
    }
    const double around = 0.05 + 2.0 * followed_.at.distance[i];
    const std::size_t first = path_.segment(path_.segment_at(std::max(s - around, 0.0))).block;
    const std::size_t last = path_.segment(path_.segment_at(std::min(s + around, path_.length()))).block;
    const OffPath off = course_.off(tool, first, last);
    ++count_;
    sum2_ += off.tip_mm * off.tip_mm;
    report_.max_tip_deviation_mm = std::max(report_.max_tip_deviation_mm, off.tip_mm);
    report_.max_axis_deviation_rad = std::max(report_.max_axis_deviation_rad, off.axis_rad);
    report_.max_flute_deviation_mm = std::max(report_.max_flute_deviation_mm, off.flute_mm);
    const TracePlace place{followed_.time_s[i], planned.nc_line, planned.cl_line, off.tip_mm,
                           off.axis_rad,        off.flute_mm,    tool.tip_P};
    TracePlace& worst = worst_[planned.nc_line];
    if (off.tip_mm >= worst.tip_mm) worst = place;
    if (options.course) report_.course.push_back(place);
    follow_on(i, off, tool);
  }

  void follow_on(std::size_t i, const OffPath& off, const ToolPose& tool) {
    const bool goes_on = run_length_ > 0 && i == last_sample_ + 1;
    if (goes_on)
      report_.coverage.largest_step_mm =
          std::max(report_.coverage.largest_step_mm, (tool.tip_P - last_tip_P_).norm());
    run_length_ = goes_on ? run_length_ + 1 : 1;
    if (run_length_ >= 3) scatter_.add(before_, last_, off.error_P);
    before_ = last_;
    last_ = off.error_P;
    last_tip_P_ = tool.tip_P;
    last_sample_ = i;
  }

  const Followed& followed_;
  const JointPath& path_;
  const Machine& machine_;
  const Plan& plan_;
  TraceReport& report_;
  ClCourse course_;
  std::map<std::uint32_t, TracePlace> worst_;
  Scatter scatter_;
  double sum2_ = 0.0;
  std::size_t count_ = 0, run_length_ = 0, last_sample_ = 0;
  Vec3 before_ = Vec3::Zero(), last_ = Vec3::Zero(), last_tip_P_ = Vec3::Zero();
};

// When the trace passes lengths of the path, asked for in their order.
class Clock {
 public:
  Clock(const Followed& followed, double still) : followed_(followed), still_(still), i_(followed.at.first) {}

  /// The moment at which it goes on beyond `s`, or comes there from where the program is not known.
  double leaves(double s) {
    const auto& forward = followed_.at.forward;
    std::size_t last = i_;
    for (std::size_t i = i_; i <= followed_.at.last; ++i) {
      if (std::isnan(forward[i])) continue;
      if (forward[i] > s + still_) {
        i_ = last;
        if (i > last + 1 && forward[i] - s < 2.0 * step_behind(i)) return followed_.time_s[i - 1];
        const double from = forward[last], to = forward[i];
        const double share = to > from ? std::clamp((s - from) / (to - from), 0.0, 1.0) : 1.0;
        return followed_.time_s[last] + share * (followed_.time_s[i] - followed_.time_s[last]);
      }
      last = i;
    }
    i_ = last;
    return followed_.time_s[last];
  }

  /// The moment at which it has come to `s`, or goes on from there to where the program is not known: a row
  /// need not be at `s` where it does not stop.
  double comes_to(double s) const {
    const auto& forward = followed_.at.forward;
    std::size_t last = i_, before = i_;
    for (std::size_t i = i_; i <= followed_.at.last; ++i) {
      if (std::isnan(forward[i])) continue;
      if (forward[i] >= s - still_) {
        const bool leaves = i > last + 1 && forward[last] < s - still_;
        const double step = forward[last] - forward[before];
        return leaves && s - forward[last] < 2.0 * step ? followed_.time_s[last + 1] : followed_.time_s[i];
      }
      before = last;
      last = i;
    }
    return followed_.time_s[last];
  }

 private:
  // From a row to the next one that is on the program.
  double step_behind(std::size_t i) const {
    const auto& forward = followed_.at.forward;
    for (std::size_t next = i + 1; next <= followed_.at.last; ++next) {
      if (!std::isnan(forward[next])) return forward[next] - forward[i];
    }
    return 0.0;
  }

  const Followed& followed_;
  double still_;
  std::size_t i_;
};

// The first moment at which it is as far as it ever gets.
double arrives(const Followed& followed, double still) {
  const auto& at = followed.at;
  const double end = at.forward[at.last];
  std::size_t first = at.last;
  for (std::size_t i = at.last + 1; i-- > at.first;) {
    if (std::isnan(at.forward[i])) continue;
    if (at.forward[i] < end - still) break;
    first = i;
  }
  return followed.time_s[first];
}

// The blocks of the program in the time of the trace.
class TimeKeeper {
 public:
  TimeKeeper(const Followed& followed, const JointPath& path, const Plan& plan, double still)
      : followed_(followed), path_(path), plan_(plan), still_(still), clock_(followed, still) {}

  void run(TraceReport& report) {
    const auto& at = followed_.at;
    const double from = at.forward[at.first], to = at.forward[at.last];
    // Half a step short of its ends it is at its ends: of a step that it takes there, where it does not stop.
    const bool at_start = from < std::max(at.step, step_from(at.first, 1));
    const bool at_end = to > path_.length() - std::max(at.step, step_from(at.last, -1));
    report.coverage.complete = at_start && at_end;
    report.begins_s = clock_.leaves(from);
    const double ends = arrives(followed_, still_);
    double begins = report.begins_s, holes_s = 0.0, unplanned_s = 0.0, more_s = 0.0;
    for (std::size_t i = 0; i < path_.segments();) {
      const std::size_t block = path_.segment(i).block;
      std::size_t end = i;
      while (end + 1 < path_.segments() && path_.segment(end + 1).block == block) ++end;
      const double s = path_.end_of(end);
      const bool passed = s > from && s < to - still_;
      if (!path_.segment(i).known && passed) {
        const double goes_on = clock_.leaves(s);
        holes_s += goes_on - begins;
        unplanned_s +=
            path_.segment(end).ends_s - path_.segment(i).begins_s + plan_.blocks[block - 1].dwell_s;
        begins = goes_on;
      } else if (s > from && path_.begin_of(i) < to) {
        const bool before_hole = end + 1 < path_.segments() && !path_.segment(end + 1).known;
        const double ends_s = !passed ? ends : before_hole ? clock_.comes_to(s) : clock_.leaves(s);
        const double dwell_s = passed && !before_hole ? plan_.blocks[block].dwell_s : 0.0;
        more_s += plan_.blocks[block].more_s;
        if (path_.begin_of(i) >= from - at.step && s <= to)
          blocks_.push_back({plan_.blocks[block].nc_line,
                             path_.segment(end).ends_s - path_.segment(i).begins_s + dwell_s, ends_s - begins,
                             begins});
        begins = ends_s;
      }
      i = end + 1;
    }
    const double planned_from = at_start ? path_.leaves_s(0.0) : path_.leaves_s(from);
    const double planned_to = path_.planned_s(at_end ? path_.length() : to);
    report.planned_s = std::max(planned_to - planned_from - unplanned_s, 0.0);
    report.more_s = more_s;
    report.duration_s = std::max(ends - report.begins_s - holes_s, 0.0);
    report.elsewhere_s = holes_s;
    std::sort(blocks_.begin(), blocks_.end(), [](const BlockTime& a, const BlockTime& b) {
      return a.actual_s - a.planned_s > b.actual_s - b.planned_s;
    });
    if (blocks_.size() > kSlowBlocks) blocks_.resize(kSlowBlocks);
    report.slow = std::move(blocks_);
  }

 private:
  // From a row to the one beside it; 0 where that is off the program.
  double step_from(std::size_t row, int by) const {
    const auto& at = followed_.at;
    if (at.first == at.last) return 0.0;
    const double beside = at.forward[row + static_cast<std::size_t>(by)];
    return std::isnan(beside) ? 0.0 : std::abs(beside - at.forward[row]);
  }

  const Followed& followed_;
  const JointPath& path_;
  const Plan& plan_;
  double still_;
  Clock clock_;
  std::vector<BlockTime> blocks_;
};

void judge_coverage(const Followed& followed, const JointPath& path, const Plan& plan, TraceReport& report) {
  const auto& at = followed.at;
  Coverage& c = report.coverage;
  double feed = 0.0;
  for (std::size_t i = 0; i < path.segments(); ++i) {
    if (!plan.blocks[path.segment(i).block].rapid) feed += path.end_of(i) - path.begin_of(i);
  }
  const auto feed_between = [&](double from, double to) {
    double sum = 0.0;
    for (std::size_t i = path.segment_at(from); i < path.segments() && path.begin_of(i) < to; ++i) {
      if (plan.blocks[path.segment(i).block].rapid) continue;
      sum += std::max(0.0, std::min(to, path.end_of(i)) - std::max(from, path.begin_of(i)));
    }
    return sum;
  };
  double seen = feed_between(at.forward[at.first], at.forward[at.last]);
  double last_s = at.forward[at.first], last_t = followed.time_s[at.first];
  for (std::size_t i = at.first; i <= at.last; ++i) {
    if (std::isnan(at.forward[i])) continue;
    const double dt = followed.time_s[i] - last_t;
    c.largest_gap_s = std::max(c.largest_gap_s, dt);
    if (dt > 10.0 * followed.period_s && at.forward[i] - last_s > at.step)
      seen -= feed_between(last_s, at.forward[i]);
    last_s = at.forward[i];
    last_t = followed.time_s[i];
  }
  c.share = feed > 0.0 ? std::clamp(seen / feed, 0.0, 1.0) : 1.0;
  const auto line = [&](double s) { return plan.blocks[path.segment(path.segment_at(s)).block].nc_line; };
  c.first_nc_line = line(at.forward[at.first]);
  c.last_nc_line = line(at.forward[at.last]);
  c.left_out = followed.left_out;
}

void add_remarks(const Followed& followed, TraceReport& report) {
  const Coverage& c = report.coverage;
  if (!c.complete)
    report.remarks.push_back("the trace shows the program from NC line " + std::to_string(c.first_nc_line) +
                             " to " + std::to_string(c.last_nc_line) +
                             "; duration and planned time are of this part");
  if (c.share < 0.98)
    report.remarks.push_back(fixed_text(100.0 * c.share, 0) +
                             " of 100 parts of the feed path are seen; the rest nobody knows");
  if (c.largest_gap_s > 10.0 * followed.period_s)
    report.remarks.push_back("no row for " + fixed_text(c.largest_gap_s, 3) +
                             " s, where rows are typically " + fixed_text(followed.period_s * 1e3, 1) +
                             " ms apart");
  constexpr double kFarApart_mm = 1.0;
  if (c.largest_step_mm > kFarApart_mm)
    report.remarks.push_back("two rows are up to " + fixed_text(c.largest_step_mm, 2) +
                             " mm of the tip's way apart: what is between them is not seen");
}

}  // namespace

Result<TraceReport> compare(const Trace& trace, const Machine& machine, const Plan& plan,
                            const CompareOptions& options) {
  if (plan.blocks.size() < 2 || plan.path.size() < 2)
    return fail(ErrorCode::wrong_input, "the program has no motion that a trace could be held against",
                trace.file);
  const JointPath path(machine, plan.blocks);
  const auto followed = follow_path(trace, machine, plan, path);
  if (!followed) return tl::unexpected(followed.error());
  TraceReport report;
  for (const PathPoint& point : plan.path) report.flute_mm = std::max(report.flute_mm, point.flute_mm);
  report.coverage.samples = trace.samples.size();
  Judge judge(*followed, path, machine, plan, report);
  judge.run(options);
  if (judge.feed_samples() == 0)
    return fail(ErrorCode::wrong_input, "no row of the trace is on a feed move of the program", trace.file);
  judge_coverage(*followed, path, plan, report);
  // What the rows scatter by speaks for a trace, what lies between values against it.
  const double scattered_mm = report.uncertainty_mm;
  if (trace.apart_s > 0.0) {
    const double between_mm = unsure_between_values(*followed, report.worst.time_s, trace.apart_s);
    report.uncertainty_mm = std::max(report.uncertainty_mm, between_mm);
    if (between_mm > plan.tolerance_mm && report.max_tip_deviation_mm < 3.0 * between_mm)
      return fail(ErrorCode::wrong_input,
                  "every axis was recorded at moments of its own, " + shortest_text(trace.apart_s) +
                      " s apart, and where the tip is furthest off (" +
                      fixed_text(report.max_tip_deviation_mm * 1e3, 1) +
                      " um) the axes change their speeds: between two values they are known within " +
                      fixed_text(between_mm * 1e3, 1) + " um; the tolerance is " +
                      fixed_text(plan.tolerance_mm * 1e3, 1) + " um. Record more often, or all axes at once",
                  trace.file);
  }
  if (report.uncertainty_mm > plan.tolerance_mm && report.max_tip_deviation_mm < 3.0 * report.uncertainty_mm)
    return fail(
        ErrorCode::wrong_input,
        "the rows scatter too much to tell the tolerance: from row to row the tip's place is off by " +
            fixed_text(report.scatter_mm * 1e3, 2) +
            " um (one standard deviation), so that a largest "
            "deviation is known within " +
            fixed_text(report.uncertainty_mm * 1e3, 1) + " um; the tolerance is " +
            fixed_text(plan.tolerance_mm * 1e3, 1) +
            " um. Positions of one row that are not of one moment look so, too",
        trace.file);
  const double still = std::max(0.002, 4.0 * report.scatter_mm);
  TimeKeeper(*followed, path, plan, still).run(report);
  Findings found = find_causes(*followed, path, machine, plan, report.scatter_mm);
  report.causes = std::move(found.causes);
  add_remarks(*followed, report);
  if (trace.apart_s > 0.0) remark_between_values(*followed, trace.apart_s, plan.tolerance_mm, report);
  report.remarks.insert(report.remarks.end(), found.remarks.begin(), found.remarks.end());
  report.within_tolerance =
      report.max_tip_deviation_mm <= plan.tolerance_mm + scattered_mm &&
      (report.flute_mm == 0.0 || report.max_flute_deviation_mm <= plan.tolerance_mm + scattered_mm);
  if (report.max_tip_deviation_mm > plan.tolerance_mm && report.within_tolerance && scattered_mm > 0.0)
    report.remarks.push_back("within " + fixed_text(scattered_mm * 1e3, 2) +
                             " um, as far as the rows' scatter lets one know, the tolerance is kept");
  return report;
}

}  // namespace trunnion::trace
