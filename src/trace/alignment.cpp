#include "trace/alignment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "trunnion/base/number_text.hpp"

namespace trunnion::trace {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kOff = 1.05;          // cost of a place that is not along the program
constexpr double kBack = 3.0;          // of coming back to it after having left
constexpr double kMostMismatch = 4.0;  // of a way that is longer or shorter than the program's
constexpr double kOtherBlock = 0.5;    // of a place whose block is another than the row says
constexpr std::size_t kCandidates = 24;
constexpr double kMostAnchors = 40000.0;
constexpr double kAtEnd_mm = 1e-4;
constexpr std::uint32_t kLinesApart = 5;  // by which a row's block may be ahead of, or behind, its positions

double typical_scatter(std::span<const Scaled> x) {
  std::vector<double> d;
  const std::size_t every = std::max<std::size_t>(1, x.size() / 20000);
  for (std::size_t i = 1; i + 1 < x.size(); i += every)
    d.push_back((x[i] - 0.5 * (x[i - 1] + x[i + 1])).norm());
  if (d.empty()) return 0.0;
  const auto middle = d.begin() + static_cast<std::ptrdiff_t>(d.size() / 2);
  std::nth_element(d.begin(), middle, d.end());
  return *middle;
}

// Samples a step apart, the first and the last.
std::vector<std::size_t> anchors_of(std::span<const Scaled> x, double step) {
  std::vector<std::size_t> out{0};
  for (std::size_t i = 1; i < x.size(); ++i) {
    if ((x[i] - x[out.back()]).norm() >= step) out.push_back(i);
  }
  if (out.back() + 1 != x.size()) out.push_back(x.size() - 1);
  return out;
}

struct State {
  double cost = std::numeric_limits<double>::infinity();
  double s = kNone;  // where it is, or was last
  int back = -1;     // state of the anchor before
};

// State 0 of an anchor: not along the program.
class WayFinder {
 public:
  WayFinder(const JointPath& path, const std::vector<PlannedBlock>& blocks, std::span<const Scaled> x,
            const Trace& trace, const Alignment& limits)
      : path_(path),
        blocks_(blocks),
        x_(x),
        trace_(trace),
        limits_(limits),
        anchors_(anchors_of(x, limits.step)) {}

  const std::vector<std::size_t>& anchors() const { return anchors_; }

  /// The place of each anchor; NaN: not along the program. Fails where another way fits alike.
  Result<std::vector<double>> find() {
    std::vector<std::vector<State>> states(anchors_.size());
    for (std::size_t a = 0; a < anchors_.size(); ++a) {
      add_states(anchors_[a], states[a]);
      for (std::size_t j = 0; j < states[a].size(); ++j) {
        State& to = states[a][j];
        const double own = to.cost;
        if (a == 0) continue;
        to.cost = std::numeric_limits<double>::infinity();
        const double way = (x_[anchors_[a]] - x_[anchors_[a - 1]]).norm();
        for (std::size_t i = 0; i < states[a - 1].size(); ++i) {
          const State& from = states[a - 1][i];
          const double cost = from.cost + own + step_cost(from, i == 0, to, j == 0, way);
          if (cost >= to.cost) continue;
          to.cost = cost;
          to.back = static_cast<int>(i);
        }
        if (j == 0 && to.back >= 0) to.s = states[a - 1][static_cast<std::size_t>(to.back)].s;
      }
    }
    return trace_back(states);
  }

 private:
  void add_states(std::size_t sample, std::vector<State>& out) const {
    out.push_back({kOff, kNone, -1});
    const double near = 0.3 * limits_.within;
    for (const auto& place : path_.candidates(x_[sample], limits_.within, kCandidates)) {
      const double d = place.distance / near;
      double cost = d * d / (1.0 + d * d);
      const std::uint32_t line = trace_.samples[sample].nc_line;
      if (line > 0) {
        const std::uint32_t of_place = blocks_[path_.segment(place.segment).block].nc_line;
        if ((line > of_place ? line - of_place : of_place - line) > kLinesApart) cost += kOtherBlock;
      }
      out.push_back({cost, place.s, -1});
    }
  }

  double step_cost(const State& from, bool from_off, const State& to, bool to_off, double way) const {
    if (to_off) return 0.0;
    const bool fresh = std::isnan(from.s);
    const double back = 0.5 * limits_.step;
    if (!fresh && to.s < from.s - back) return std::numeric_limits<double>::infinity();
    if (from_off) return fresh ? 0.0 : kBack;
    const double mismatch = std::abs(to.s - from.s - way) / (2.0 * std::max(way, limits_.step));
    return std::min(mismatch, kMostMismatch);
  }

  Result<std::vector<double>> trace_back(const std::vector<std::vector<State>>& states) const {
    std::vector<double> out(anchors_.size(), kNone);
    std::size_t best = 0;
    for (std::size_t j = 0; j < states.back().size(); ++j) {
      if (states.back()[j].cost < states.back()[best].cost) best = j;
    }
    bool checked = false;
    for (std::size_t a = anchors_.size(); a-- > 0;) {
      const State& at = states[a][best];
      if (best != 0) {
        out[a] = at.s;
        if (!checked) {
          checked = true;
          if (const double other = other_way(states[a], best); !std::isnan(other))
            return fail(ErrorCode::wrong_input,
                        "the trace fits two parts of the program alike, NC line " + line_text(at.s) +
                            " and NC line " + line_text(other) +
                            " at its end: a column block (line of the program) or a longer trace tells them "
                            "apart",
                        trace_.file);
        }
      }
      best = at.back < 0 ? 0 : static_cast<std::size_t>(at.back);
    }
    return out;
  }

  // Another place to end at, as cheap and far from the best one.
  double other_way(const std::vector<State>& states, std::size_t best) const {
    const double apart = std::max(8.0 * limits_.step, 2.0 * limits_.within);
    for (std::size_t j = 1; j < states.size(); ++j) {
      if (states[j].cost < states[best].cost + kOff && std::abs(states[j].s - states[best].s) > apart)
        return states[j].s;
    }
    return kNone;
  }

  std::string line_text(double s) const {
    return std::to_string(blocks_[path_.segment(path_.segment_at(s)).block].nc_line);
  }

  const JointPath& path_;
  const std::vector<PlannedBlock>& blocks_;
  std::span<const Scaled> x_;
  const Trace& trace_;
  const Alignment& limits_;
  std::vector<std::size_t> anchors_;
};

// The samples between the anchors.
void place_samples(const JointPath& path, std::span<const Scaled> x, const std::vector<std::size_t>& anchors,
                   const std::vector<double>& at, Alignment& out) {
  out.s.assign(x.size(), kNone);
  out.distance.assign(x.size(), kNone);
  const auto put = [&](std::size_t i, double from, double to) {
    const auto place = path.nearest(x[i], std::max(from, 0.0), std::min(to, path.length()));
    // What comes to the program's first place, or goes on from its last, is not along it.
    if (place.distance > out.within || (place.beyond && place.distance > kAtEnd_mm)) return;
    out.s[i] = place.s;
    out.distance[i] = place.distance;
  };
  const double around = 0.6 * out.step;
  for (std::size_t a = 0; a < anchors.size(); ++a) {
    const bool on = !std::isnan(at[a]);
    if (on) put(anchors[a], at[a] - around, at[a] + around);
    if (a + 1 == anchors.size()) break;
    const bool next_on = !std::isnan(at[a + 1]);
    if (!on && !next_on) continue;
    const double from = on ? at[a] : at[a + 1];
    const double to = next_on ? at[a + 1] : at[a];
    for (std::size_t i = anchors[a] + 1; i < anchors[a + 1]; ++i)
      put(i, std::min(from, to) - 2.0 * around, std::max(from, to) + 2.0 * around);
  }
}

// A machine that has come to an end of what is known of the program and goes elsewhere from there may be
// beside its last pieces on that way; the same before a beginning.
class EndTrimmer {
 public:
  EndTrimmer(const JointPath& path, double still, Alignment& out) : path_(path), still_(still), out_(out) {}

  void run() {
    for (std::size_t i = 0; i < out_.s.size();) {
      if (std::isnan(out_.s[i])) {
        ++i;
        continue;
      }
      std::size_t end = i + 1;
      while (end < out_.s.size() && !std::isnan(out_.s[end])) ++end;
      trim(i, end);
      i = end;
    }
  }

 private:
  void trim(std::size_t begin, std::size_t end) {
    const auto first = out_.s.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = out_.s.begin() + static_cast<std::ptrdiff_t>(end);
    const auto [low, high] = std::minmax_element(first, last);
    const double from = *low, to = *high;
    // What it does while it stands there is no motion along the program.
    if (is_end(to)) {
      std::size_t arrived = begin;
      while (arrived + 1 < end && out_.s[arrived] < to - still_) ++arrived;
      for (std::size_t i = arrived + 1; i < end; ++i) forget(i);
      end = arrived + 1;
    }
    if (is_end(from)) {
      std::size_t leaves = end - 1;
      while (leaves > begin && !(out_.s[leaves] <= from + still_)) --leaves;
      for (std::size_t i = begin; i < leaves; ++i) forget(i);
    }
  }
  bool is_end(double s) const {
    return s < out_.step || s > path_.length() - out_.step || path_.is_near_hole(s, out_.step);
  }
  void forget(std::size_t i) {
    out_.s[i] = kNone;
    out_.distance[i] = kNone;
  }

  const JointPath& path_;
  double still_;
  Alignment& out_;
};

void go_forward(Alignment& out) {
  out.forward = out.s;
  double most = -std::numeric_limits<double>::infinity();
  std::vector<double> up = out.s;
  for (double& s : up) {
    if (std::isnan(s)) continue;
    most = std::max(most, s);
    s = most;
  }
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = out.s.size(); i-- > 0;) {
    if (std::isnan(out.s[i])) continue;
    least = std::min(least, out.s[i]);
    out.forward[i] = 0.5 * (least + up[i]);
  }
}

// Of places that moved a step, how many along the program, and how far.
struct Fit {
  std::size_t on = 0, off = 0, jumps = 0, breaks = 0;
  double median = 0.0;
};

Fit fit_of(const JointPath& path, std::span<const Scaled> x, const std::vector<std::size_t>& anchors,
           const std::vector<double>& at, const Alignment& found) {
  Fit fit;
  std::vector<double> d;
  std::size_t first = anchors.size(), last = 0;
  for (std::size_t a = 0; a < anchors.size(); ++a) {
    if (std::isnan(at[a])) continue;
    first = std::min(first, a);
    last = a;
  }
  std::size_t off = 0;
  double last_s = 0.0;
  for (std::size_t a = first; a <= last && a < anchors.size(); ++a) {
    if (std::isnan(at[a])) {
      ++off;
      continue;
    }
    // Nobody knows the way through a hole.
    const double near = 2.0 * found.step;
    if (off > 0 && !path.is_near_hole(last_s, near) && !path.is_near_hole(at[a], near)) fit.off += off;
    off = 0;
    last_s = at[a];
    ++fit.on;
    d.push_back(std::isnan(found.distance[anchors[a]]) ? found.within : found.distance[anchors[a]]);
    if (a == first || std::isnan(at[a - 1])) continue;
    const double way = (x[anchors[a]] - x[anchors[a - 1]]).norm();
    if (std::abs(at[a] - at[a - 1] - way) > 2.0 * std::max(way, found.step)) ++fit.jumps;
  }
  for (std::size_t i = 0; i < path.segments(); ++i) fit.breaks += path.segment(i).known ? 0U : 1U;
  if (!d.empty()) {
    const auto middle = d.begin() + static_cast<std::ptrdiff_t>(d.size() / 2);
    std::nth_element(d.begin(), middle, d.end());
    fit.median = *middle;
  }
  return fit;
}

// How far the axes go beyond where they are first, at most.
double way_of(std::span<const Scaled> x, std::size_t from, std::size_t to) {
  double most = 0.0;
  for (std::size_t i = from; i <= to; ++i) most = std::max(most, (x[i] - x[from]).norm());
  return most;
}

double median_distance(const JointPath& path, std::span<const Scaled> x, const Scaled& factor,
                       const Scaled& add, const std::array<int, kMaxAxes>& column) {
  constexpr std::size_t kLooks = 60;
  std::vector<double> d;
  const double far = 10.0 * path.diagonal() + 1000.0;
  for (std::size_t k = 0; k < kLooks; ++k) {
    const std::size_t i = k * (x.size() - 1) / (kLooks - 1);
    Scaled y;
    for (int c = 0; c < y.size(); ++c) y[c] = x[i][column[static_cast<std::size_t>(c)]] * factor[c] + add[c];
    d.push_back(std::min(path.nearest(y, 0.0, path.length()).distance, far));
  }
  std::nth_element(d.begin(), d.begin() + kLooks / 2, d.end());
  return d[kLooks / 2];
}

}  // namespace

Result<Alignment> align(const JointPath& path, const std::vector<PlannedBlock>& blocks,
                        std::span<const Scaled> x, const Trace& trace) {
  Alignment out;
  const double scatter = typical_scatter(x);
  // A part of 100 mm may be left by 3 mm, one of 5 mm by 0.25 mm: what is farther is no deviation.
  out.within = std::clamp(0.03 * path.diagonal(), 0.25, 3.0);
  double way = 0.0;
  for (std::size_t i = 1; i < x.size(); ++i) way += (x[i] - x[i - 1]).norm();
  out.step = std::max({0.1 * out.within, 10.0 * scatter, way / kMostAnchors, path.length() / kMostAnchors});
  out.step = std::min(out.step, std::max(2.0 * out.within, way / kMostAnchors));
  WayFinder finder(path, blocks, x, trace, out);
  const auto at = finder.find();
  if (!at) return tl::unexpected(at.error());
  place_samples(path, x, finder.anchors(), *at, out);
  EndTrimmer(path, 1e-3 + 4.0 * scatter, out).run();
  const Fit fit = fit_of(path, x, finder.anchors(), *at, out);
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::wrong_input, "the trace is not of this program on this machine: " + why,
                trace.file);
  };
  if (fit.on < 2) return refuse("no part of it is along the program");
  const double near = static_cast<double>(fit.on) / static_cast<double>(fit.on + fit.off);
  if (near < 0.9 - 0.05 * static_cast<double>(std::min<std::size_t>(fit.breaks, 8)))
    return refuse("only " + fixed_text(100.0 * near, 0) + " of 100 places between its ends are within " +
                  fixed_text(out.within, 2) + " mm of it");
  if (static_cast<double>(fit.jumps) >
      3.0 + static_cast<double>(fit.breaks) + 0.02 * static_cast<double>(fit.on))
    return refuse("it jumps along the program at " + std::to_string(fit.jumps) + " of " +
                  std::to_string(fit.on) + " places");
  if (fit.median > 0.3 * out.within)
    return refuse("half of its places are more than " + fixed_text(fit.median, 3) + " mm beside it");
  go_forward(out);
  out.first = x.size();
  double low = path.length(), high = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (std::isnan(out.s[i])) continue;
    out.first = std::min(out.first, i);
    out.last = i;
    low = std::min(low, out.s[i]);
    high = std::max(high, out.s[i]);
  }
  // Who leaves the program in its middle and goes on elsewhere was never on it, or has the first pieces alone
  // in common with it.
  const double elsewhere = 3.0 * out.within;
  const auto ends_there = [&](double s, std::size_t row, std::size_t next) {
    const double close = out.step + std::min(1.5 * (x[next] - x[row]).norm(), 5.0 * out.within);
    return s < close || s > path.length() - close || path.is_near_hole(s, close);
  };
  if (!ends_there(high, out.last, std::min(out.last + 1, x.size() - 1)) &&
      way_of(x, out.last, x.size() - 1) > elsewhere)
    return refuse("it leaves it at NC line " +
                  std::to_string(blocks[path.segment(path.segment_at(high)).block].nc_line) +
                  " and goes on elsewhere");
  if (!ends_there(low, out.first, out.first > 0 ? out.first - 1 : 0) && way_of(x, 0, out.first) > elsewhere)
    return refuse("it comes from elsewhere to NC line " +
                  std::to_string(blocks[path.segment(path.segment_at(low)).block].nc_line) +
                  ", in the middle of it");
  if (high - low < std::max(0.01 * path.length(), 4.0 * out.step))
    return refuse("it runs along no more than " + fixed_text(high - low, 2) + " of its " +
                  fixed_text(path.length(), 2) + " mm");
  return out;
}

std::string explain_mismatch(const JointPath& path, std::span<const Scaled> x, const Machine& machine) {
  std::array<int, kMaxAxes> same{};
  for (std::size_t c = 0; c < kMaxAxes; ++c) same[c] = static_cast<int>(c);
  const Scaled one = Scaled::Ones();
  const double before = median_distance(path, x, one, Scaled::Zero(), same);
  double best = 0.2 * before;
  std::string out;
  const auto look = [&](const Scaled& factor, const Scaled& add, const std::array<int, kMaxAxes>& column,
                        const std::string& what) {
    const double d = median_distance(path, x, factor, add, column);
    if (d >= best) return;
    best = d;
    out = what;
  };
  const auto of_kind = [&](AxisKind kind, double factor) {
    Scaled f = one;
    for (AxisId id = 0; id < machine.axes.size(); ++id) {
      if (machine.axes[id].kind == kind) f[static_cast<int>(id)] = factor;
    }
    return f;
  };
  const Scaled none = Scaled::Zero();
  look(of_kind(AxisKind::linear, kMmPerInch), none, same, "its lengths look like inches");
  look(of_kind(AxisKind::linear, 1.0 / kMmPerInch), none, same,
       "its lengths look as if they had been turned from inches into mm twice");
  look(of_kind(AxisKind::linear, 1000.0), none, same, "its lengths look like metres");
  look(of_kind(AxisKind::linear, 1.0 / 1000.0), none, same, "its lengths look like micrometres");
  look(of_kind(AxisKind::rotary, kDegreePerRad), none, same, "its angles look like radians");
  look(of_kind(AxisKind::rotary, kRadPerDegree), none, same,
       "its angles look as if they had been turned into degrees twice");
  for (AxisId a = 0; a < machine.axes.size(); ++a) {
    Scaled f = one;
    f[static_cast<int>(a)] = -1.0;
    look(f, none, same, machine.axes[a].name + " looks as if it had the other sign");
    for (AxisId b = a + 1; b < machine.axes.size(); ++b) {
      if (machine.axes[a].kind != machine.axes[b].kind) continue;
      auto swapped = same;
      std::swap(swapped[a], swapped[b]);
      look(one, none, swapped,
           "the columns of " + machine.axes[a].name + " and " + machine.axes[b].name +
               " look as if they had been swapped");
    }
  }
  // A constant: the middles of what is passed.
  Scaled low = x[0], high = x[0], low_p = path.node(0), high_p = path.node(0);
  for (const Scaled& v : x) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  for (std::size_t i = 0; i <= path.segments(); ++i) {
    low_p = low_p.cwiseMin(path.node(i));
    high_p = high_p.cwiseMax(path.node(i));
  }
  const Scaled by = 0.5 * (low_p + high_p - low - high);
  const JointVector shift = unscaled(machine, by);
  std::string text = "it would be with these added:";
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const bool rotary = machine.axes[id].kind == AxisKind::rotary;
    text += " " + machine.axes[id].name + " " + fixed_text(shift[id] * (rotary ? kDegreePerRad : 1.0), 3);
  }
  look(one, by, same, text + " (work offset or tool length; see '# positions: words')");
  return out;
}

}  // namespace trunnion::trace
