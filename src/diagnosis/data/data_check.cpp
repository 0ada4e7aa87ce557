#include "diagnosis/data/data_check.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "trunnion/base/median.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

#include "diagnosis/fit/whitening.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kContradiction = 8.0;        // standard deviations of a difference; noise does not reach it
constexpr std::size_t kFewestDuplicates = 3;  // fewer equal readings may be the instrument's resolution
constexpr double kDuplicateShare = 0.2;
constexpr double kTimedDuplicateShare = 0.02;  // the same where the run's times go on: no two moments are one

std::vector<std::int64_t> row_key(const Observations& o, Eigen::Index i, bool with_run) {
  const MachineState& s = o.state(i);
  const Reading& r = o.reading(i);
  std::vector<std::int64_t> key = {std::llround(s.time_s * 1e3), std::llround(s.spindle_rpm),
                                   static_cast<std::int64_t>(r.quantity), static_cast<std::int64_t>(r.frame)};
  if (with_run) key.push_back(static_cast<std::int64_t>(s.run));
  for (int k = 0; k < 3; ++k) key.push_back(std::llround(r.n[k] * 1e6));
  for (int k = 0; k < 3; ++k) key.push_back(std::llround(o.data().rows[r.row].tool_mm[k] * 1e6));
  for (std::size_t a = 0; a < o.machine().axes.size(); ++a) {
    key.push_back(std::llround(s.q[a] * 1e6));
    key.push_back(s.direction[a]);
    key.push_back(std::llround(s.velocity[a] * 1e6));
  }
  return key;
}

std::string place(const Observations& o, Eigen::Index i) {
  const RowOrigin& row = o.data().rows[o.reading(i).row];
  return o.data().files[row.file] + ":" + std::to_string(row.line);
}

// Of each run: more than half of its readings have a moment of their own in their group.
std::vector<bool> times_go_on(const Observations& o) {
  std::vector<bool> out;
  for (const auto& run : o.runs()) {
    std::set<std::pair<std::size_t, double>> moments;
    for (const Eigen::Index i : run) moments.emplace(o.reading(i).group, o.state(i).time_s);
    out.push_back(2 * moments.size() > run.size());
  }
  return out;
}

std::string same_moment(const Observations& o) {
  const std::vector<bool> goes_on = times_go_on(o);
  std::map<std::vector<std::int64_t>, Eigen::Index> first;
  std::size_t equal = 0, timed = 0;
  std::string example;
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    const auto [it, fresh] = first.emplace(row_key(o, i, true), i);
    if (fresh) continue;
    const Reading& a = o.reading(it->second);
    const Reading& b = o.reading(i);
    const double difference = std::abs(a.value - b.value);
    const double unit = b.quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad;
    if (difference > kContradiction * std::hypot(a.u_random, b.u_random))
      return place(o, it->second) + " and " + place(o, i) +
             " contradict each other: the same moment and pose, " + fixed_text(a.value / unit, 3) +
             " against " + fixed_text(b.value / unit, 3) +
             (b.quantity == Quantity::displacement ? " um" : " urad") + " with u_random " +
             fixed_text(b.u_random / unit, 3);
    if (difference != 0.0) continue;
    if (++equal == 1) example = place(o, it->second) + " and " + place(o, i);
    if (goes_on[o.state(i).run]) ++timed;
  }
  const auto share = [&](std::size_t count) {
    return count < kFewestDuplicates ? 0.0 : static_cast<double>(count) / static_cast<double>(o.size());
  };
  if (share(equal) > kDuplicateShare || share(timed) > kTimedDuplicateShare)
    return std::to_string(equal) + " readings stand twice (" + example +
           "): counted twice, they would look more certain than they are";
  return {};
}

std::string same_runs(const Observations& o) {
  using Signature = std::vector<std::vector<std::int64_t>>;
  std::map<Signature, std::size_t> seen;
  for (std::size_t run = 0; run < o.runs().size(); ++run) {
    if (o.runs()[run].size() < kFewestDuplicates) continue;
    Signature signature;
    for (const Eigen::Index i : o.runs()[run]) {
      signature.push_back(row_key(o, i, false));
      signature.back().push_back(std::llround(o.reading(i).value * 1e12));
    }
    const auto [it, fresh] = seen.emplace(std::move(signature), run);
    if (!fresh)
      return "runs '" + o.data().context.runs[it->second].id + "' and '" + o.data().context.runs[run].id +
             "' hold the same readings: one measurement was given twice";
  }
  return {};
}

constexpr std::size_t kShown = 3;  // rows of a kind; the rest is counted

// Sentences of one kind, the first few of them.
class Few {
 public:
  void add(std::string text) {
    if (++count_ <= kShown) out_.push_back(std::move(text));
  }
  std::vector<std::string> all(const std::string& further) {
    if (count_ > kShown) out_.back() += " (and " + std::to_string(count_ - kShown) + " more " + further + ")";
    return std::move(out_);
  }

 private:
  std::vector<std::string> out_;
  std::size_t count_ = 0;
};

std::string amount(const Reading& r) {
  const bool length = r.quantity == Quantity::displacement;
  return fixed_text(r.value / (length ? kMmPerUm : kRadPerUrad), 3) + (length ? " um" : " urad");
}

std::vector<std::string> outside_travel(const Observations& o) {
  constexpr double kMargin = 0.1;  // of the travel: a machine file may be narrow
  Few out;
  for (Eigen::Index i = 0; i < o.size(); ++i)
    for (std::size_t a = 0; a < o.machine().axes.size(); ++a) {
      const Axis& axis = o.machine().axes[a];
      if (!axis.has_limits() || axis.cyclic) continue;
      const double margin = kMargin * (axis.max - axis.min), q = o.state(i).q[a];
      if (q >= axis.min - margin && q <= axis.max + margin) continue;
      const bool linear = axis.kind == AxisKind::linear;
      const double unit = linear ? 1.0 : kRadPerDegree;
      out.add(place(o, i) + ": " + axis.name + " = " + fixed_text(q / unit, 3) + (linear ? " mm" : " deg") +
              " is outside its travel of " + fixed_text(axis.min / unit, 3) + " to " +
              fixed_text(axis.max / unit, 3));
      break;
    }
  return out.all("rows outside the travel");
}

// One step back of more than ten minutes in a run that goes on otherwise: a clock that was set.
std::vector<std::string> clock_set_back(const Observations& o) {
  constexpr double kBack_s = 600.0;
  Few out;
  for (std::size_t run = 0; run < o.runs().size(); ++run) {
    Eigen::Index where = -1;
    std::size_t steps = 0;
    const auto& rows = o.runs()[run];
    for (std::size_t i = 1; i < rows.size(); ++i) {
      if (o.state(rows[i]).time_s >= o.state(rows[i - 1]).time_s) continue;
      ++steps;
      if (o.state(rows[i - 1]).time_s - o.state(rows[i]).time_s > kBack_s) where = rows[i];
    }
    if (steps == 1 && where >= 0)
      out.add(place(o, where) + ": the time of run '" + o.data().context.runs[run].id + "' jumps back to " +
              fixed_text(o.state(where).time_s, 0) + " s");
  }
  return out.all("jumps");
}

bool same_position(const Observations& o, Eigen::Index a, Eigen::Index b) {
  for (std::size_t k = 0; k < o.machine().axes.size(); ++k)
    if (std::abs(o.state(a).q[k] - o.state(b).q[k]) > 1e-6) return false;
  return true;
}

// The step of the readings of each quantity: all readings have to be looked at for it.
struct Steps {
  double displacement, rotation;
  explicit Steps(const Observations& o)
      : displacement(resolution(o, Quantity::displacement)), rotation(resolution(o, Quantity::rotation)) {}
  double of(Quantity q) const { return q == Quantity::displacement ? displacement : rotation; }
};

// Equal readings, one after the other, while the machine moves: a beam that is interrupted.
std::vector<std::string> stuck(const Observations& o) {
  constexpr std::size_t kFewest = 8;
  constexpr double kChance = 1e-9;
  const Steps steps(o);
  Few out;
  for (const auto& group : o.groups()) {
    // What chance gives: as often as neighbours are equal elsewhere in the group, at least once. Repeats at
    // one place neither count nor break a run of equal readings.
    std::size_t equal = 0, longest = 1, length = 1, begin = 0, from = 0, end = 0;
    for (std::size_t i = 1; i < group.size(); ++i) {
      const double value = o.values()[group[i]];
      if (value != o.values()[group[i - 1]] || value == 0.0) {
        length = 1;
        begin = i;
        continue;
      }
      if (same_position(o, group[i], group[i - 1])) continue;
      ++equal;
      if (++length > longest) {
        longest = length;
        from = begin;
        end = i;
      }
    }
    if (longest < kFewest) continue;
    const double elsewhere = static_cast<double>(equal - (longest - 1)) + 1.0;
    const double seen = elsewhere / static_cast<double>(std::max<std::size_t>(group.size() - longest, 2));
    // Of two readings with this noise and this step of the display, where the error does not change.
    const Reading& reading = o.reading(group[from]);
    const double by_step = steps.of(reading.quantity) / (2.0 * std::sqrt(kPi) * reading.u_random);
    const double chance = std::max(seen, by_step);
    if (chance >= 1.0 || std::pow(chance, static_cast<double>(longest - 1)) > kChance) continue;
    out.add(place(o, group[from]) + " to " + place(o, group[end]) + ": the reading stands still at " +
            amount(o.reading(group[end])) + " while the machine moves: the beam or the probe had no signal");
  }
  return out.all("readings that stand still");
}

// An axis is faster at some readings than at most of them: what follows its speed is large there.
bool speeds_differ(const Observations& o, const std::vector<Eigen::Index>& group) {
  constexpr double kFaster = 3.0;
  for (AxisId a = 0; a < o.machine().axes.size(); ++a) {
    std::vector<double> speeds;
    speeds.reserve(group.size());
    for (const Eigen::Index i : group) speeds.push_back(std::abs(o.state(i).velocity[a]));
    const double largest = *std::max_element(speeds.begin(), speeds.end());
    if (largest > 0.0 && largest > kFaster * median(speeds)) return true;
  }
  return false;
}

// Of the readings of one group, those far from all others; their middle and scatter.
struct FarOff {
  std::vector<Eigen::Index> readings;
  double middle = 0.0, scatter = 0.0;
};
FarOff far_off_in(const Observations& o, const std::vector<Eigen::Index>& group, const Steps& steps) {
  constexpr std::size_t kFewest = 8;
  constexpr double kFar = 50.0, kMostShare = 0.05;
  FarOff out;
  if (group.size() < kFewest || speeds_differ(o, group)) return out;
  std::vector<double> values, distances;
  for (const Eigen::Index i : group) values.push_back(o.values()[i]);
  out.middle = median(values);
  for (const double v : values) distances.push_back(std::abs(v - out.middle));
  out.scatter = kMadToSigma * median(distances);
  const double step = steps.of(o.reading(group.front()).quantity);
  for (const Eigen::Index i : group)
    if (std::abs(o.values()[i] - out.middle) >
        kFar * (out.scatter + 3.0 * std::max(o.reading(i).u_random, step)))
      out.readings.push_back(i);
  if (static_cast<double>(out.readings.size()) > kMostShare * static_cast<double>(group.size()) + 1.0)
    out.readings.clear();
  return out;
}

// A false touch, another unit.
std::vector<std::string> far_off(const Observations& o) {
  Few out;
  const Steps steps(o);
  for (const auto& group : o.groups()) {
    const FarOff far = far_off_in(o, group, steps);
    for (const Eigen::Index i : far.readings) {
      const double unit = o.reading(i).quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad;
      const double ratio = std::abs(o.values()[i]) / std::max(std::abs(far.middle), far.scatter);
      out.add(place(o, i) + ": " + amount(o.reading(i)) +
              " where the others of its run and direction are within " + fixed_text(far.scatter / unit, 3) +
              " of " + fixed_text(far.middle / unit, 3) +
              (ratio > 300.0 && ratio < 3000.0 ? ": a value in another unit, or a false touch"
                                               : ": a false touch, or a reading of something else"));
    }
  }
  return out.all("single readings far off");
}

// How often the senses of an axis, in the order of time, are those of steps of its own positions, or of
// another axis'.
struct SensesOfSteps {
  std::size_t agree = 0, up = 0, down = 0;  // up, down: the other way, of either stated sense
  bool stated_up = false, stated_down = false;
  Eigen::Index example = -1;
  // Nearly all rows, both senses among them. (A place that is approached by overshooting it, always from one
  // side, states one.)
  bool contradict() const {
    constexpr std::size_t kFewest = 3, kOtherThanOne = 10;  // of as many rows one may agree
    return std::min(up, down) >= kFewest && kOtherThanOne * agree <= up + down;
  }
  bool follow() const { return agree > 10 * (up + down); }
  bool one_sided() const {
    constexpr std::size_t kFewest = 3;
    constexpr std::size_t kOfAll = 10;  // one step back of as many may be the start of a further pass
    return (up == 0 || down == 0) && up + down >= kFewest && kOfAll * (up + down) >= agree + up + down &&
           stated_up != stated_down;
  }
};

SensesOfSteps senses_of_steps(const Observations& o, const std::vector<Eigen::Index>& rows, AxisId of,
                              AxisId at) {
  constexpr double kMoves = 1e-6;  // mm, rad
  SensesOfSteps out;
  for (std::size_t k = 1; k < rows.size(); ++k) {
    const MachineState before = o.state(rows[k - 1]), now = o.state(rows[k]);
    const double by = now.q[at] - before.q[at];
    if (std::abs(by) < kMoves || now.direction[of] == 0 || !(now.time_s > before.time_s)) continue;
    (now.direction[of] > 0 ? out.stated_up : out.stated_down) = true;
    if ((by > 0.0) == (now.direction[of] > 0)) {
      ++out.agree;
    } else {
      ++(now.direction[of] > 0 ? out.up : out.down);
      if (out.example < 0) out.example = rows[k];
    }
  }
  return out;
}

std::vector<Eigen::Index> in_time(const Observations& o, std::vector<Eigen::Index> rows) {
  std::stable_sort(rows.begin(), rows.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return o.state(a).time_s < o.state(b).time_s; });
  return rows;
}

// The sense of the last motion that a run states of an axis, against its positions. Where it is that of
// another axis' positions their columns are exchanged, which is for the conventions to say.
std::string senses_against_positions(const Observations& o) {
  const auto& axes = o.machine().axes;
  for (const auto& run : o.runs()) {
    const std::vector<Eigen::Index> rows = in_time(o, run);
    for (AxisId axis = 0; axis < axes.size(); ++axis) {
      const SensesOfSteps own = senses_of_steps(o, rows, axis, axis);
      if (!own.contradict()) continue;
      bool exchanged = false;
      for (AxisId other = 0; other < axes.size(); ++other)
        exchanged = exchanged || (other != axis && axes[other].kind == axes[axis].kind &&
                                  senses_of_steps(o, rows, axis, other).follow());
      if (exchanged) continue;
      const std::size_t against = own.up + own.down;
      return "dir_" + axes[axis].name + " of run '" + o.data().context.runs[o.state(own.example).run].id +
             "' says the other way than the positions go in the order of their times, in " +
             std::to_string(against) + " of " + std::to_string(against + own.agree) + " rows, first in " +
             place(o, own.example);
    }
  }
  return "";
}

}  // namespace

std::vector<OneSidedSense> one_sided_senses(const Observations& o) {
  std::vector<OneSidedSense> out;
  for (std::size_t run = 0; run < o.runs().size(); ++run) {
    const std::vector<Eigen::Index> rows = in_time(o, o.runs()[run]);
    for (AxisId axis = 0; axis < o.machine().axes.size(); ++axis)
      if (senses_of_steps(o, rows, axis, axis).one_sided()) out.push_back({run, axis});
  }
  return out;
}

std::string contradiction(const Observations& o) {
  for (const auto& check : {same_runs, same_moment, senses_against_positions})
    if (std::string found = check(o); !found.empty()) return found;
  return "";
}

std::vector<bool> far_readings(const Observations& o) {
  std::vector<bool> out(static_cast<std::size_t>(o.size()), false);
  const Steps steps(o);
  for (const auto& group : o.groups())
    for (const Eigen::Index i : far_off_in(o, group, steps).readings) out[static_cast<std::size_t>(i)] = true;
  return out;
}

std::vector<std::string> row_problems(const Observations& o) {
  std::vector<std::string> out;
  for (auto& kind : {outside_travel(o), clock_set_back(o), stuck(o), far_off(o)})
    out.insert(out.end(), kind.begin(), kind.end());
  return out;
}

}  // namespace trunnion::diagnosis
