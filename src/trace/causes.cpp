#include "trace/causes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/number_text.hpp"

#include "trace/delay_fit.hpp"

namespace trunnion::trace {
namespace {

constexpr std::size_t kRowsBeside = 4;    // rows on each side for a velocity
constexpr double kLeastShare = 0.05;      // of the squared deviation, for a cause to be named
constexpr double kSurely = 5.0;           // of its sigmas
constexpr double kLeast_mm = 5e-5;        // root mean square of what a cause does, to be worth a word
constexpr double kSharp = 0.035;          // rad (2 degrees): corners that a control may round
constexpr std::size_t kLeastAtLimit = 5;  // rows, one after the other
constexpr double kAtLimit = 0.98;
// Servo drives differ by a few ms, clocks by anything.
constexpr double kClocks_s = 0.025;

// What is looked at.
struct Ran {
  const Followed& followed;
  const JointPath& path;
  const Machine& machine;
  const Plan& plan;
  double scatter;
};

bool is_rotary(const Machine& machine, AxisId id) {
  return machine.axes[id].kind == AxisKind::rotary;
}

TracePlace place_at(const Followed& followed, const JointPath& path, const Plan& plan, std::size_t i) {
  TracePlace out;
  out.time_s = followed.time_s[i];
  if (std::isnan(followed.at.s[i])) return out;
  const PlannedBlock& block = plan.blocks[path.segment(path.segment_at(followed.at.s[i])).block];
  out.nc_line = block.nc_line;
  out.cl_line = block.cl_line;
  return out;
}

// A scaled length of an axis in its own unit.
double own_unit(const Machine& machine, AxisId id, double value) {
  return is_rotary(machine, id) ? value / kLever_mm * kDegreePerRad : value;
}

std::string unit_text(const Machine& machine, AxisId id, const std::string& per) {
  return (is_rotary(machine, id) ? "deg" : "mm") + per;
}

// Axes at their largest speed or acceleration.
class Limits {
 public:
  Limits(const Followed& followed, const JointPath& path, const Machine& machine, const Plan& plan)
      : followed_(followed), path_(path), machine_(machine), plan_(plan) {}

  void look(std::vector<Cause>& out) {
    const auto& at = followed_.at;
    std::vector<Scaled> v, a;
    std::vector<std::size_t> rows;
    for (std::size_t i = at.first; i <= at.last; ++i) {
      Scaled vi, ai;
      if (std::isnan(at.s[i]) || !motion_at(followed_, i, kRowsBeside, vi, ai)) continue;
      v.push_back(vi);
      a.push_back(ai);
      rows.push_back(i);
    }
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      speed(id, v, rows, out);
      acceleration(id, a, rows, out);
    }
  }

 private:
  Cause at_limit(const char* kind, AxisId id, double value, const char* per, std::size_t row) const {
    return {kind,
            machine_.axes[id].name,
            value,
            0.0,
            unit_text(machine_, id, per),
            0.0,
            place_at(followed_, path_, plan_, row),
            ""};
  }

  void speed(AxisId id, const std::vector<Scaled>& v, const std::vector<std::size_t>& rows,
             std::vector<Cause>& out) const {
    const Axis& axis = machine_.axes[id];
    if (!axis.rapid) return;
    const double limit = *axis.rapid * (is_rotary(machine_, id) ? kLever_mm : 1.0);
    std::size_t run = 0, count = 0, first = 0, longest = 0;
    double most = 0.0;
    for (std::size_t k = 0; k < v.size(); ++k) {
      const double speed = std::abs(v[k][static_cast<int>(id)]);
      const bool feed = !plan_.blocks[path_.segment(path_.segment_at(followed_.at.s[rows[k]])).block].rapid;
      run = feed && speed >= kAtLimit * limit ? run + 1 : 0;
      if (run == 0) continue;
      ++count;
      most = std::max(most, speed);
      if (run > longest) {
        longest = run;
        first = rows[k] + 1 - run;
      }
    }
    if (longest < kLeastAtLimit) return;
    Cause cause = at_limit("speed_limit", id, own_unit(machine_, id, most), "/s", first);
    cause.text = axis.name + " runs at its largest speed, " + fixed_text(cause.value, 2) + " " + cause.unit +
                 ", in " + std::to_string(count) + " rows of feed moves, first at NC line " +
                 std::to_string(cause.place.nc_line);
    out.push_back(std::move(cause));
  }

  // A limit that is reached again and again is a place where many rows are, and none beyond.
  void acceleration(AxisId id, const std::vector<Scaled>& a, const std::vector<std::size_t>& rows,
                    std::vector<Cause>& out) const {
    std::vector<double> size;
    size.reserve(a.size());
    for (const Scaled& v : a) size.push_back(std::abs(v[static_cast<int>(id)]));
    if (size.size() < 200) return;
    std::vector<double> sorted = size;
    std::sort(sorted.begin(), sorted.end());
    const double top = sorted[sorted.size() - 1 - sorted.size() / 1000];
    constexpr double kLeast_mm_s2 = 20.0;
    if (top < kLeast_mm_s2) return;
    const auto above = [&](double level) {
      return static_cast<std::size_t>(sorted.end() - std::lower_bound(sorted.begin(), sorted.end(), level));
    };
    const std::size_t at_top = above(0.95 * top), high = above(0.5 * top), beyond = above(1.05 * top);
    if (at_top < 40 || at_top * 2 < high || beyond * 20 > at_top) return;
    std::size_t run = 0, longest = 0, first = 0;
    for (std::size_t k = 0; k < size.size(); ++k) {
      run = size[k] >= 0.95 * top ? run + 1 : 0;
      if (run <= longest) continue;
      longest = run;
      first = rows[k] + 1 - run;
    }
    if (longest < kLeastAtLimit) return;
    const double level = sorted[sorted.size() - at_top / 2 - 1];
    Cause cause = at_limit("acceleration_limit", id, own_unit(machine_, id, level), "/s2", first);
    cause.text = machine_.axes[id].name + " accelerates by " + fixed_text(cause.value, 0) + " " + cause.unit +
                 " again and again (" + std::to_string(at_top) + " rows) and never by more: a limit";
    out.push_back(std::move(cause));
  }

  const Followed& followed_;
  const JointPath& path_;
  const Machine& machine_;
  const Plan& plan_;
};

// What is left near corners, towards their inside.
struct Corners {
  double inside2 = 0.0, all2 = 0.0;
  std::size_t corners = 0, inside = 0;
  double largest = 0.0;
  std::size_t worst = 0;  // row
};

class CornerLook {
 public:
  CornerLook(const Followed& followed, const JointPath& path, const Plan& plan)
      : followed_(followed), path_(path), plan_(plan) {
    for (std::size_t i = 0; i + 1 < path.segments(); ++i) {
      const Scaled from = path.tangent(i), to = path.tangent(i + 1);
      if (!path.segment(i).known || !path.segment(i + 1).known || from.isZero() || to.isZero()) continue;
      if (plan.blocks[path.segment(i).block].rapid || plan.blocks[path.segment(i + 1).block].rapid) continue;
      const double turn = (to - from).norm();
      // There and back again has no inside.
      if (turn < kSharp || turn > 1.99) continue;
      corners_.push_back(
          {path.end_of(i),
           0.5 * std::min(path.end_of(i) - path.begin_of(i), path.end_of(i + 1) - path.begin_of(i + 1)),
           (to - from) / turn});
    }
  }

  Corners look(const DelayFit& fit) const {
    Corners out;
    std::size_t c = 0;
    std::vector<double> deepest(corners_.size(), 0.0);
    std::vector<bool> seen(corners_.size(), false);
    for (std::size_t i = followed_.at.first; i <= followed_.at.last; ++i) {
      if (std::isnan(followed_.at.s[i])) continue;
      const double s = followed_.at.s[i];
      if (plan_.blocks[path_.segment(path_.segment_at(s)).block].rapid) continue;
      const Scaled left = fit.left_at(i);
      out.all2 += left.squaredNorm();
      while (c + 1 < corners_.size() && std::abs(corners_[c + 1].s - s) <= std::abs(corners_[c].s - s)) ++c;
      // Alignment may go back by a hair.
      while (c > 0 && std::abs(corners_[c - 1].s - s) < std::abs(corners_[c].s - s)) --c;
      if (corners_.empty() || std::abs(corners_[c].s - s) > std::min(corners_[c].around, 5.0)) continue;
      const double in = left.dot(corners_[c].inward);
      seen[c] = true;
      if (std::abs(in) > std::abs(deepest[c])) deepest[c] = in;
      if (in > 0.0) out.inside2 += in * in;
      if (in > out.largest) {
        out.largest = in;
        out.worst = i;
      }
    }
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      out.corners += seen[k] ? 1U : 0U;
      out.inside += seen[k] && deepest[k] > 0.0 ? 1U : 0U;
    }
    return out;
  }

 private:
  struct Corner {
    double s, around;
    Scaled inward;
  };
  const Followed& followed_;
  const JointPath& path_;
  const Plan& plan_;
  std::vector<Corner> corners_;
};

std::string cause_text(const Cause& cause) {
  const std::string size = fixed_text(std::abs(cause.value), cause.unit == "ms" ? 2 : 4) + " " + cause.unit;
  const std::string within =
      cause.sigma > 0.0 ? " (+- " + fixed_text(cause.sigma, cause.unit == "ms" ? 2 : 4) + ")" : "";
  if (cause.kind == "lag")
    return cause.axis + " is " + size + within + (cause.value > 0.0 ? " behind" : " ahead of") +
           " the other axes";
  if (cause.kind == "curve")
    return "curves are cut on their inside in proportion to the acceleration, as all axes do that lag by " +
           size + within;
  if (cause.kind == "offset")
    return cause.axis + " stands " + size + within + (cause.value > 0.0 ? " above" : " below") +
           " its programmed position all along: an offset or a zero that is not the program's";
  if (cause.kind == "backlash")
    return cause.axis + " stands " + size + within +
           (cause.value > 0.0 ? " short of its position, on the side that it comes from"
                              : " beyond its position, on the side that it goes to");
  return cause.axis + " is off by " + size + within + " when it reverses, and comes back within some 10 ms";
}

void add_fitted(const DelayFit& fit, const Ran& ran, Findings& out) {
  const auto& [followed, path, machine, plan, scatter] = ran;
  for (const DelayFit::Term& term : fit.terms()) {
    const double floor = std::max(kLeast_mm, 0.3 * scatter);
    if (std::abs(term.value) < kSurely * term.sigma || term.share < kLeastShare || term.rms < floor) continue;
    Cause cause;
    cause.share = std::min(term.share, 1.0);
    cause.place = place_at(followed, path, plan, term.worst);
    switch (term.kind) {
      case DelayFit::Kind::lag:
        cause.kind = "lag";
        cause.value = term.value * 1e3;
        cause.sigma = term.sigma * 1e3;
        cause.unit = "ms";
        if (std::abs(term.value) > kClocks_s)
          out.remarks.push_back(machine.axes[term.axis].name + " and the other axes are " +
                                fixed_text(std::abs(cause.value), 0) +
                                " ms apart: a delay of an axis, or columns of two clocks; the rows do not "
                                "tell which, and the deviations are right only for the first");
        break;
      case DelayFit::Kind::curve:
        // A lag tau of all axes takes a circle in by tau^2 a / 2.
        if (term.value >= 0.0) continue;
        cause.kind = "curve";
        cause.value = std::sqrt(-2.0 * term.value) * 1e3;
        cause.sigma = term.sigma / std::sqrt(-2.0 * term.value) * 1e3;
        cause.unit = "ms";
        break;
      case DelayFit::Kind::offset:
        cause.kind = "offset";
        break;
      case DelayFit::Kind::backlash:
        cause.kind = "backlash";
        break;
      case DelayFit::Kind::spike:
        cause.kind = "reversal";
        break;
      case DelayFit::Kind::shared:
        continue;  // of refined values only
    }
    if (term.kind != DelayFit::Kind::curve) cause.axis = machine.axes[term.axis].name;
    if (cause.unit.empty()) {
      // What has to be added to the trace to be on the path: the axis itself is off by the opposite.
      const double sign = term.kind == DelayFit::Kind::backlash ? 1.0 : -1.0;
      cause.value = sign * own_unit(machine, term.axis, term.value);
      cause.sigma = own_unit(machine, term.axis, term.sigma);
      cause.unit = unit_text(machine, term.axis, "");
    }
    cause.text = cause_text(cause);
    out.causes.push_back(std::move(cause));
  }
}

void add_corner(const Corners& corners, double before2, const Ran& ran, std::vector<Cause>& out) {
  const auto& [followed, path, machine, plan, scatter] = ran;
  constexpr std::size_t kLeastCorners = 3;
  constexpr double kLeastCorner_mm = 5e-4;  // digits of a trace round corners by less
  constexpr double kMostlyInside = 0.8;
  const double share = before2 > 0.0 ? corners.inside2 / before2 : 0.0;
  if (corners.corners < kLeastCorners || share < kLeastShare ||
      corners.largest < std::max(kLeastCorner_mm, 5.0 * scatter) ||
      static_cast<double>(corners.inside) < kMostlyInside * static_cast<double>(corners.corners))
    return;
  Cause cause{"corner",
              "",
              corners.largest,
              0.0,
              "mm",
              std::min(share, 1.0),
              place_at(followed, path, plan, corners.worst),
              ""};
  cause.text = "corners are cut on their inside, by " + fixed_text(cause.value * 1e3, 1) +
               " um at most: the control blends blocks, or its axes round them (" +
               std::to_string(corners.inside) + " of " + std::to_string(corners.corners) + " corners seen)";
  out.push_back(std::move(cause));
}

}  // namespace

Findings find_causes(const Followed& followed, const JointPath& path, const Machine& machine,
                     const Plan& plan, double scatter) {
  Findings out;
  DelayFit fit(followed, path, machine, plan);
  fit.run();
  const Ran ran{followed, path, machine, plan, scatter};
  add_fitted(fit, ran, out);
  add_corner(CornerLook(followed, path, plan).look(fit), fit.before2(), ran, out.causes);
  std::sort(out.causes.begin(), out.causes.end(),
            [](const Cause& a, const Cause& b) { return a.share > b.share; });
  Limits(followed, path, machine, plan).look(out.causes);
  if (!fit.has_run())
    out.remarks.push_back(
        "too few rows of feed moves, evenly enough in time, to say why the machine left the path");
  else
    out.remarks.push_back(
        "a delay that all axes share is no deviation and cannot be told from the clock's "
        "own time: the delay of an axis is that behind the others");
  return out;
}

}  // namespace trunnion::trace
