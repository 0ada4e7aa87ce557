#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/trace/compare.hpp"

#include "trace/delay_fit.hpp"
#include "trace/program_senses.hpp"

namespace trunnion::trace {
namespace {

constexpr std::size_t kHalf = 4;  // rows on each side, for means
constexpr double kSpikes = 6.0;   // decays of a spike: then nothing is left

// Senses in which the rows themselves move, where the program does not say it.
class RowSenses {
 public:
  explicit RowSenses(const Scaled& begin) : extreme_(begin) {}

  void go_to(const Scaled& x) {
    constexpr double kTurn = 0.02;  // scaled mm: less is no motion
    for (int c = 0; c < x.size(); ++c) {
      const double step = x[c] - extreme_[c];
      if (std::abs(step) > kTurn) sign_[c] = step > 0.0 ? 1.0 : -1.0;
      if (step * sign_[c] > 0.0) extreme_[c] = x[c];
    }
  }
  const Scaled& sign() const { return sign_; }

 private:
  Scaled extreme_;
  Scaled sign_ = Scaled::Zero();
};

/// The command at the rows of a trace, from what the fit found.
class Follower {
 public:
  Follower(const Followed& followed, const JointPath& path, const Machine& machine, const Plan& plan)
      : followed_(followed),
        path_(path),
        machine_(machine),
        plan_(plan),
        fit_(followed, path, machine, plan) {
    fit_.run();
    fit_.refine();
    shared_s_ = fit_.found(DelayFit::Kind::shared, 0).value;
  }

  FollowedTrace run() {
    const DelayFit::Term shared = fit_.found(DelayFit::Kind::shared, 0);
    // When between two rows a control records is not known; spikes look like delays of up to 0.7 ms, too.
    if (shared.value <= followed_.period_s) return {samples(), 0.0, 0.0};
    return {samples(), shared.value, shared.sigma};
  }

 private:
  std::vector<FollowedSample> samples() {
    find_places();
    std::vector<FollowedSample> out, approach;
    std::size_t cut = 0, holes = 0;
    bool is_cutting = false;
    for (std::size_t i = followed_.at.first; i <= followed_.at.last; ++i) {
      const Row& row = rows_[i];
      if (!row.known) continue;
      if (row.holes != holes || (row.rapid && is_cutting)) {
        approach.clear();
        is_cutting = false;
      }
      holes = row.holes;
      if (approach.empty() && !is_cutting) approach.push_back(before(i));
      if (row.rapid) {
        if (!(approach.back().direction == of_axes(row.sign))) approach.push_back(sample_at(i, false));
        continue;
      }
      if (!is_cutting) {
        ++cut;
        for (FollowedSample& sample : approach) sample.cut = cut;
        out.insert(out.end(), approach.begin(), approach.end());
      }
      is_cutting = true;
      out.push_back(sample_at(i, is_clear(i)));
      out.back().cut = cut;
    }
    return out;
  }

  struct Row {
    bool known = false, rapid = false;
    bool in_doubt = false;  // a spike may be there
    std::size_t segment = 0;
    Mean mean;
    Scaled commanded;       // of the mean
    Scaled at_moment;       // the command of the row itself
    std::size_t holes = 0;  // of the path up to there
    double s = 0.0;
    Scaled sign = Scaled::Zero();
    Scaled came = Scaled::Zero();    // sense before it, as the rows move
    Scaled late_s = Scaled::Zero();  // by which the moment of the last reversal may be wrong
  };

  void find_places() {
    rows_.resize(followed_.x.size());
    ProgramSenses senses(path_);
    RowSenses came(followed_.x.front());
    Scaled came_s = Scaled::Constant(-std::numeric_limits<double>::infinity());
    double furthest = 0.0, came_from_s = 0.0;
    std::size_t segment = 0, holes = 0;
    for (std::size_t i = 0; i <= followed_.at.last; ++i) {
      const Scaled before = came.sign();
      came.go_to(followed_.x[i]);
      if (i < followed_.at.first || std::isnan(followed_.at.s[i])) continue;
      auto mean = mean_at(followed_, i, kHalf);
      if (!mean) continue;
      mean->x += fit_.between_rows(mean->smooth);
      Row& row = rows_[i];
      row.mean = *mean;
      // At its command where what was found is taken out; along the path the place follows from there.
      const Scaled at_command = mean->x + fit_.to_program(i, mean->v);
      const double s = followed_.at.s[i];
      const double around = 0.1 + 2.0 * (at_command - followed_.x[i]).norm() + followed_.at.step;
      const auto place =
          path_.nearest(at_command, std::max(s - around, 0.0), std::min(s + around, path_.length()));
      if (place.beyond) continue;
      row.segment = place.segment;
      row.s = place.s;
      row.commanded = path_.at(place.s);
      row.at_moment = command_at_moment(i, place.s);
      // Between a rapid and a cut there is no way back, though places scatter.
      furthest = std::max(furthest, place.s);
      for (; segment < path_.segment_at(furthest); ++segment) holes += path_.segment(segment).known ? 0U : 1U;
      row.rapid = plan_.blocks[path_.segment(segment).block].rapid;
      row.holes = holes;
      row.came = before;
      senses.go_to(place.s, followed_.time_s[i]);
      row.sign = (senses.sign().array() != 0.0).select(senses.sign(), came.sign());
      row.known = true;
      const bool goes_on = i > 0 && rows_[i - 1].known && rows_[i - 1].holes == holes;
      if (!goes_on) came_from_s = followed_.time_s[i];
      if (goes_on) date_reversals(i);
      // When an axis turned round that came another way out of sight is not known: there, or once it moves.
      const Scaled& last = goes_on ? rows_[i - 1].sign : before;
      for (int c = 0; c < last.size(); ++c)
        if (last[c] * row.sign[c] < 0.0 && senses.reversed_s()[c] < came_from_s)
          came_s[c] = followed_.time_s[i];
      row.in_doubt = may_have_spikes(followed_.time_s[i], senses, came_s);
    }
  }

  // Of as few rows as tell a speed: where the path turns, the mean of more is beside it.
  Scaled command_at_moment(std::size_t i, double s) const {
    const auto mean = mean_at(followed_, i, 1);
    if (!mean) return path_.at(s);
    const Scaled at_command = mean->x + fit_.between_rows(mean->smooth) + fit_.to_program(i, mean->v);
    const double around = 2.0 * ((at_command - path_.at(s)).norm() + followed_.at.step);
    return path_.at(
        path_.nearest(at_command, std::max(s - around, 0.0), std::min(s + around, path_.length())).s);
  }

  // Of an axis that has some, and turns round there or may have done so shortly before.
  bool may_have_spikes(double time_s, const ProgramSenses& senses, const Scaled& came_s) const {
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const int c = static_cast<int>(id);
      const double turned_s = std::max(senses.doubtful_s()[c], came_s[c]);
      const bool may = senses.is_turning(c) || time_s - turned_s < kSpikes * DelayFit::kSpike_s;
      if (may && fit_.found(DelayFit::Kind::spike, id).value != 0.0) return true;
    }
    return false;
  }

  // A spike that is not taken out yet holds the place back: since when it may have been where it is.
  void date_reversals(std::size_t i) {
    Row& row = rows_[i];
    row.late_s = rows_[i - 1].late_s;
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const int c = static_cast<int>(id);
      if (row.sign[c] == rows_[i - 1].sign[c]) continue;
      const double spike = std::abs(fit_.found(DelayFit::Kind::spike, id).value);
      std::size_t first = i;
      while (first > 0 && rows_[first - 1].known && rows_[first - 1].s > row.s - spike) --first;
      row.late_s[c] = followed_.time_s[i] - followed_.time_s[first];
    }
  }

  // The velocities that the effects of a reading see: those of its mean, or, of an axis that hardly moves and
  // has followed an even command for long enough, that of the command. In the reading is that of the mean,
  // times the delays: a column that scatters with it shows of an axis at rest an error that follows its
  // velocity.
  struct Seen {
    Scaled v;
    std::array<bool, kMaxAxes> of_command{};
  };
  Seen velocities_at(std::size_t i) const {
    constexpr double kHardly = 10.0;  // standard deviations
    Seen out{rows_[i].mean.v};
    const double scatter_s = scatter_of_velocity(followed_, kHalf);
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const int c = static_cast<int>(id);
      if (std::abs(out.v[c]) > kHardly * fit_.scatter()[c] * scatter_s || fit_.spikes_at(i)[c] != 0.0)
        continue;
      const auto even = even_command(i, id);
      if (!even) continue;
      out.v[c] = *even;
      out.of_command[id] = true;
    }
    return out;
  }
  // The velocity of an axis' command, where it has run evenly until nothing is left of what was before.
  std::optional<double> even_command(std::size_t i, AxisId id) const {
    constexpr double kDelays = 12.0;  // exp(-12) of a speed is left: nothing beside its scatter
    constexpr double kEven = 0.3;     // of the scatter of one row
    const int c = static_cast<int>(id);
    const double late_s = std::max(0.0, shared_s_ + fit_.found(DelayFit::Kind::lag, id).value);
    const auto before = kHalf + static_cast<std::size_t>(kDelays * late_s / followed_.period_s) + 1;
    if (before > i) return std::nullopt;
    const std::size_t first = i - before, last = i + kHalf;
    const auto& t = followed_.time_s;
    const double from = rows_[first].commanded[c], to = rows_[last].commanded[c];
    const double v = (to - from) / (t[last] - t[first]);
    for (std::size_t k = first; k <= last; ++k) {
      if (!rows_[k].known || rows_[k].holes != rows_[i].holes) return std::nullopt;
      if (std::abs(rows_[k].commanded[c] - from - v * (t[k] - t[first])) > kEven * fit_.scatter()[c])
        return std::nullopt;
    }
    return v;
  }
  Scaled own_delays_s() const {
    Scaled out = Scaled::Zero();
    for (AxisId id = 0; id < machine_.axes.size(); ++id)
      out[static_cast<int>(id)] = fit_.found(DelayFit::Kind::lag, id).value;
    return out;
  }

  JointVector of_axes(const Scaled& sign) const {
    JointVector out;
    for (AxisId id = 0; id < machine_.axes.size(); ++id) out[id] = sign[static_cast<int>(id)];
    return out;
  }

  // How the axes came to a row.
  FollowedSample before(std::size_t i) const {
    FollowedSample out = sample_at(i, false);
    if (i > 0) out.time_s = followed_.time_s[i - 1];
    const Row& row = rows_[i];
    out.direction = of_axes((row.came.array() != 0.0).select(row.came, row.sign));
    return out;
  }

  // All rows that its means are of are known, and none of them is on the other side of a reversal; nor was
  // one shortly before that may have been none.
  bool is_clear(std::size_t i) const {
    if (rows_[i].in_doubt) return false;
    for (std::size_t k = i - kHalf; k <= i + kHalf; ++k)
      if (!rows_[k].known || rows_[k].sign != rows_[i].sign) return false;
    return true;
  }

  FollowedSample sample_at(std::size_t i, bool is_reading) const {
    const Row& row = rows_[i];
    const PlannedBlock& block = plan_.blocks[path_.segment(row.segment).block];
    FollowedSample out;
    out.time_s = row.mean.time_s;
    out.commanded = unscaled(machine_, is_reading ? mean_command(i) : row.commanded);
    const Seen seen = is_reading ? velocities_at(i) : Seen{row.mean.v};
    // Along the path the place follows from the delays, so there it is at the velocities that are said.
    const Scaled& tangent = path_.tangent(row.segment);
    const Scaled along = tangent.dot(own_delays_s().cwiseProduct(row.mean.v - seen.v)) * tangent;
    out.actual = unscaled(machine_, row.mean.x + shared_s_ * row.mean.v + along);
    out.velocity = unscaled(machine_, seen.v);
    out.direction = of_axes(row.sign);
    out.is_reading = is_reading;
    out.first_row = i - std::min(i, kHalf);
    out.last_row = i + kHalf;
    if (is_reading) out.unsure = unsure_at(i, seen);
    out.length_mm = block.length_mm;
    out.nc_line = block.nc_line;
    return out;
  }

  // Over the time that the row is a mean of: inside of corners and curves, as the row is. Along the path the
  // places are those of means already.
  Scaled mean_command(std::size_t i) const {
    const auto& t = followed_.time_s;
    const double span = t[i + kHalf] - t[i - kHalf];
    Scaled mean = Scaled::Zero();
    for (std::size_t k = i - kHalf; k < i + kHalf; ++k)
      mean += 0.5 * (t[k + 1] - t[k]) / span * (rows_[k].at_moment + rows_[k + 1].at_moment);
    const Row& row = rows_[i];
    return row.commanded + across(mean - row.commanded, path_.tangent(row.segment));
  }

  std::vector<JointVector> unsure_at(std::size_t i, const Seen& seen) const {
    const Row& row = rows_[i];
    const Scaled tangent = path_.tangent(row.segment);
    std::vector<JointVector> out;
    const auto add = [&](const Scaled& v) { out.push_back(unscaled(machine_, v)); };
    // What is along the path moves the commanded place, too.
    const auto add_across = [&](const Scaled& v) { add(across(v, tangent)); };
    Scaled speed, a = Scaled::Zero();
    motion_at(followed_, i, kHalf, speed, a);
    // Between two rows nobody knows how an axis went: straight, or as it accelerates.
    const Scaled own_delays = own_delays_s();
    const double grid_s2 = followed_.period_s * followed_.period_s / 12.0;
    for (AxisId id = 0; id < machine_.axes.size(); ++id) {
      const int c = static_cast<int>(id);
      const double own_s = own_delays[c];
      const double in_mean_s = seen.of_command[id] ? shared_s_ : shared_s_ + own_s;
      Scaled v = Scaled::Zero();
      v[c] = std::hypot(fit_.scatter()[c] * scatter_of_mean(followed_, kHalf, in_mean_s), grid_s2 * a[c]);
      add_across(v);
      // The moment of a reversal is known to a row at best, and the mean of a spike is not its middle.
      v[c] = fit_.spikes_at(i)[c];
      if (v[c] == 0.0) continue;
      const double late = 0.5 * (followed_.period_s + row.late_s[c]) / DelayFit::kSpike_s,
                   half = static_cast<double>(kHalf) * followed_.period_s / DelayFit::kSpike_s;
      v[c] *= std::hypot(late, half * half / 6.0);
      add(v);
      add(tangent.dot(v) * tangent);
    }
    // The place of a mean is a little short of the mean of places where the command turns.
    const Scaled &begin = rows_[i - kHalf].commanded, &end = rows_[i + kHalf].commanded;
    const Scaled turn = begin - 2.0 * row.commanded + end;
    const double sharp = turn.norm() / std::max((end - begin).norm(), 1e-9);
    add_across(DelayFit::kBend * std::min(1.0, 2.0 * sharp) * turn);
    // A control that blends its blocks is inside of its curves.
    add_across(fit_.found(DelayFit::Kind::curve, 0).value * a);
    // Along the path the place is where the fit says.
    add(tangent.cwiseProduct(fit_.sigma_to_program(i, row.mean.v)).norm() * tangent);
    return out;
  }

  const Followed& followed_;
  const JointPath& path_;
  const Machine& machine_;
  const Plan& plan_;
  DelayFit fit_;
  double shared_s_ = 0.0;
  std::vector<Row> rows_;
};

}  // namespace

Result<FollowedTrace> follow(const Trace& trace, const Machine& machine, const Plan& plan) {
  if (plan.blocks.size() < 2)
    return fail(ErrorCode::wrong_input, "the program has no motion that a trace could be held against",
                trace.file);
  const JointPath path(machine, plan.blocks);
  const auto followed = follow_path(trace, machine, plan, path);
  if (!followed) return tl::unexpected(followed.error());
  return Follower(*followed, path, machine, plan).run();
}

}  // namespace trunnion::trace
