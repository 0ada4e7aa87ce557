#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "trunnion/base/median.hpp"
#include "trunnion/base/units.hpp"

#include "diagnosis/data/data_check.hpp"
#include "diagnosis/fit/observations.hpp"
#include "diagnosis/search/run_factors.hpp"
#include "diagnosis/verdict/ball_place.hpp"
#include "diagnosis/verdict/bookkeeping.hpp"
#include "diagnosis/verdict/bookkeeping_figures.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::array kClockSteps = {120.0,  180.0,  300.0,  450.0,  600.0,  900.0, 1200.0,
                                    1500.0, 1800.0, 2400.0, 3600.0, 5400.0, 7200.0};  // s

template <class F>
bool varies(const Dataset& data, const F& value) {
  if (data.readings.empty()) return false;
  const double first = value(data.track.state(data.readings.front().row));
  return std::any_of(data.readings.begin(), data.readings.end(), [&](const Reading& r) {
    return std::abs(value(data.track.state(r.row)) - first) > 1e-9;
  });
}

bool stands_still(const Dataset& data, AxisId a) {
  return std::none_of(data.readings.begin(), data.readings.end(),
                      [&](const Reading& r) { return data.track.state(r.row).q[a] != 0.0; });
}

bool measured(const Dataset& data, Quantity q) {
  return std::any_of(data.readings.begin(), data.readings.end(),
                     [q](const Reading& r) { return r.quantity == q; });
}

// Readings in a larger unit that no instrument gives: what a machine does is in their tenths.
bool beyond_instruments(const Convention& c, const Dataset& data) {
  constexpr double kLargest_mm = 5.0, kLargest_rad = 0.05;
  if (c.kind != ConventionKind::unit || !c.axes.empty() || c.factor <= 1.0 || c.only_uncertainty)
    return false;
  for (const Quantity q : {Quantity::displacement, Quantity::rotation}) {
    if (c.quantity && *c.quantity != q) continue;
    std::vector<double> sizes;
    for (const Reading& r : data.readings)
      if (r.quantity == q && concerns(data, r, c)) sizes.push_back(std::abs(r.value));
    if (!sizes.empty() &&
        c.factor * median(sizes) > (q == Quantity::displacement ? kLargest_mm : kLargest_rad))
      return true;
  }
  return false;
}

class Listed {
 public:
  Listed(const Machine& machine, const Dataset& data, const Model& model)
      : machine_(machine),
        data_(data),
        model_(model),
        both_(measured(data, Quantity::displacement) && measured(data, Quantity::rotation)) {}

  std::vector<Convention> all() {
    senses();
    directions();
    swaps();
    stacking();
    units();
    offsets();
    clocks();
    of_files();
    compensation();
    of_single_runs();
    motions();
    return std::move(out_);
  }

  // What one run could have wrong in its positions alone.
  std::vector<Convention> columns() {
    senses();
    swaps();
    units();
    std::erase_if(out_, [](const Convention& c) {
      const bool of_file = c.kind == ConventionKind::unit || c.in_file;
      return !of_file || !moves_the_ball(c);
    });
    return std::move(out_);
  }

 private:
  Convention& add(ConventionKind kind) {
    out_.emplace_back().kind = kind;
    return out_.back();
  }
  void senses() {
    for (AxisId a = 0; a < machine_.axes.size(); ++a) {
      if (stands_still(data_, a)) continue;
      add(ConventionKind::axis_sense).axes = {a};
      Convention& c = add(ConventionKind::axis_sense);
      c.axes = {a};
      c.in_file = true;
    }
    // Of those that come to the same the first is said: the run that is the only one of its quantity.
    if (data_.context.runs.size() > 1)
      for (std::size_t run = 0; run < data_.context.runs.size(); ++run)
        add(ConventionKind::reading_sense).run = run;
    if (both_)
      for (const Quantity q : {Quantity::displacement, Quantity::rotation})
        add(ConventionKind::reading_sense).quantity = q;
    add(ConventionKind::reading_sense);
  }
  // What n says. Where all readings are along one axis, its sign is that of the readings.
  void directions() {
    constexpr double kSeen = 1e-6;
    for (int k = 0; k < 3; ++k) {
      const auto along = [k](const Reading& r) { return std::abs(r.n[k]) > kSeen; };
      const auto beside = [k](const Reading& r) { return std::abs(r.n[k]) < 1.0 - kSeen; };
      if (std::any_of(data_.readings.begin(), data_.readings.end(), along) &&
          std::any_of(data_.readings.begin(), data_.readings.end(), beside))
        add(ConventionKind::component_sense).components = {k};
    }
    for (const AxisId a : machine_.rotary_axes())
      if (!stands_still(data_, a)) {
        add(ConventionKind::frame);
        frames_of_runs();
        return;
      }
  }
  // Of one run: the components of n that some reading has, those that are not all of one, the axes that move.
  struct Seen {
    std::array<bool, 3> along{}, beside{};
    std::optional<MachineState> first;
    std::set<AxisId> moves;
  };
  std::vector<Seen> seen_in_runs() const {
    constexpr double kSeen = 1e-6;
    std::vector<Seen> out(data_.context.runs.size());
    for (const Reading& r : data_.readings) {
      const MachineState now = data_.track.state(r.row);
      Seen& seen = out[now.run];
      for (std::size_t k = 0; k < 3; ++k) {
        const double n = std::abs(r.n[static_cast<Eigen::Index>(k)]);
        seen.along[k] = seen.along[k] || n > kSeen;
        seen.beside[k] = seen.beside[k] || n < 1.0 - kSeen;
      }
      if (!seen.first) seen.first = now;
      for (AxisId a = 0; a < machine_.axes.size(); ++a)
        if (now.q[a] != seen.first->q[a]) seen.moves.insert(a);
    }
    return out;
  }
  // A run in which no rotary axis turns has its part turned, at most, and shows no other frame.
  void frames_of_runs() {
    constexpr std::size_t kMostRuns = 12;
    const std::size_t runs = data_.context.runs.size();
    if (runs < 2 || runs > kMostRuns) return;
    const std::vector<Seen> of = seen_in_runs();
    const auto turns = [&](AxisId a) { return machine_.axes[a].kind == AxisKind::rotary; };
    for (std::size_t run = 0; run < runs; ++run)
      if (std::any_of(of[run].moves.begin(), of[run].moves.end(), turns))
        add(ConventionKind::frame).run = run;
  }
  void swaps() {
    for (AxisId a = 0; a < machine_.axes.size(); ++a)
      for (AxisId b = a + 1; b < machine_.axes.size(); ++b)
        if (machine_.axes[a].kind == machine_.axes[b].kind &&
            !(stands_still(data_, a) && stands_still(data_, b)))
          for (const bool positions_only : {false, true}) {
            Convention& c = add(ConventionKind::swapped_columns);
            c.axes = {a, b};
            c.in_file = positions_only;
          }
    for (int a = 0; a < 3; ++a)
      for (int b = a + 1; b < 3; ++b) add(ConventionKind::swapped_columns).components = {a, b};
  }
  void stacking() {
    const std::vector<AxisId> rotary = machine_.rotary_axes();
    if (rotary.size() == 2 && !stands_still(data_, rotary[0]) && !stands_still(data_, rotary[1]))
      add(ConventionKind::stacking_order).axes = rotary;
  }
  void unit(std::optional<Quantity> q, double factor, bool with_uncertainty) {
    Convention& c = add(ConventionKind::unit);
    c.quantity = q;
    c.factor = factor;
    c.with_uncertainty = with_uncertainty;
  }
  void units() {
    std::vector<std::optional<Quantity>> of;
    for (const Quantity q : {Quantity::displacement, Quantity::rotation})
      if (measured(data_, q)) of.emplace_back(q);
    if (both_) of.emplace_back(std::nullopt);
    for (const auto& q : of) {
      for (const double factor : {1e3, 1e-3}) {
        unit(q, factor, false);
        unit(q, factor, true);
      }
      if (q == Quantity::displacement)
        for (const double factor : {kMmPerInch, 1.0 / kMmPerInch}) unit(q, factor, true);
      if (q == Quantity::rotation)
        for (const double factor : {kUradPerArcsec, 1.0 / kUradPerArcsec, kDegreePerRad, kRadPerDegree})
          unit(q, factor, true);
    }
    units_of_runs();
    Convention rotary, linear;
    for (AxisId a = 0; a < machine_.axes.size(); ++a)
      if (!stands_still(data_, a))
        (machine_.axes[a].kind == AxisKind::rotary ? rotary : linear).axes.push_back(a);
    for (auto& [c, factors] : {std::pair{rotary, std::vector{kDegreePerRad}},
                               std::pair{linear, std::vector{1e3, 1e-3, kMmPerInch, 1.0 / kMmPerInch}}}) {
      if (c.axes.empty()) continue;
      for (const double factor : factors) {
        out_.push_back(c);
        out_.back().kind = ConventionKind::unit;
        out_.back().factor = factor;
      }
    }
    unit_of_one_axis(linear.axes);
  }
  // One column in another unit leads a ball about on the part.
  void unit_of_one_axis(const std::vector<AxisId>& axes) {
    if (axes.size() < 2) return;
    for (const AxisId axis : axes)
      for (const double factor : {1e3, 1e-3, kMmPerInch, 1.0 / kMmPerInch}) {
        Convention c;
        c.kind = ConventionKind::unit;
        c.axes = {axis};
        c.factor = factor;
        if (proved_by_the_ball(machine_, model_, data_, c)) out_.push_back(c);
      }
  }
  std::vector<double> uncertainties(Quantity q, const std::optional<std::size_t>& run) const {
    std::vector<double> out;
    for (const Reading& r : data_.readings)
      if (r.quantity == q && (!run || data_.run_of(r) == *run)) out.push_back(r.u_random);
    return out;
  }
  // Of single runs only where they stand out by as much: there may be hundreds.
  void units_of_runs() {
    constexpr double kStandsOut = 30.0;
    const std::size_t runs = data_.context.runs.size();
    if (runs < 2) return;
    for (const Quantity q : {Quantity::displacement, Quantity::rotation}) {
      std::vector<std::optional<double>> typical(runs);
      std::vector<double> all;
      if (!measured(data_, q)) continue;
      const double usual_u = median(uncertainties(q, {}));
      for (std::size_t run = 0; run < runs; ++run)
        if (auto scatter = scatter_over_uncertainty(data_, q, run); !scatter.empty())
          all.push_back(*(typical[run] = median(std::move(scatter))));
      if (all.size() < 2) continue;
      const double usual = median(all);
      for (std::size_t run = 0; run < runs; ++run) {
        if (!typical[run]) continue;
        for (const auto& [out, factor] :
             {std::pair{*typical[run] > kStandsOut * usual, 1e-3},
              std::pair{kStandsOut * *typical[run] < std::min(usual, 1.0), 1e3}}) {
          if (!out) continue;
          // Too large against its uncertainty: which of the two is it that other runs have otherwise?
          const double u = median(uncertainties(q, run));
          const bool is_u = factor < 1.0 ? kStandsOut * u < usual_u : u > kStandsOut * usual_u;
          unit(q, is_u ? 1.0 / factor : factor, false);
          out_.back().run = run;
          out_.back().only_uncertainty = is_u;
        }
      }
    }
  }
  void offsets() {
    add(ConventionKind::tool_length);
    add(ConventionKind::tool_length).in_readings = true;
    add(ConventionKind::tool_offset).in_readings = true;
    if (model_.setup_translation != SetupTranslation::fixed) return;
    for (std::size_t run = 0; run < data_.context.runs.size(); ++run)
      add(ConventionKind::ball_offset).run = run;
  }
  void clocks() {
    bool recorded = varies(data_, [](const MachineState& s) { return s.spindle_rpm; });
    for (std::size_t k = 0; k < data_.context.names.temperatures.size(); ++k)
      recorded = recorded || varies(data_, [k](const MachineState& s) { return s.temperature_K[k]; });
    for (std::size_t k = 0; k < data_.context.names.states.size(); ++k)
      recorded = recorded || varies(data_, [k](const MachineState& s) { return s.state[k]; });
    if (!recorded) return;
    for (const double step : kClockSteps)
      for (const double by : {step, -step}) add(ConventionKind::time_shift).clock.by_s = by;
  }

  // What whoever wrote one file of several does in all runs of it.
  void of_files() {
    constexpr std::size_t kMostFiles = 8;
    std::map<std::size_t, std::set<std::size_t>> runs;
    for (const Reading& r : data_.readings) runs[data_.rows[r.row].file].insert(data_.run_of(r));
    if (runs.size() < 2 || runs.size() > kMostFiles) return;
    const std::vector<Convention> of_all = out_;
    for (const auto& [file, of_file] : runs) {
      if (of_file.size() < 2) continue;
      for (const Convention& c : of_all) {
        const bool of_readings = c.kind == ConventionKind::unit && c.axes.empty() && !c.quantity;
        const bool of_one_quantity = c.kind == ConventionKind::unit && c.axes.empty() && !both_;
        if (c.of_a_part() || !(of_readings || of_one_quantity || c.kind == ConventionKind::frame ||
                               (c.kind == ConventionKind::reading_sense && !c.quantity)))
          continue;
        out_.push_back(c);
        out_.back().file = file;
      }
    }
  }

  // What whoever measured one run does: its directions, and the positions of the axes that move in it.
  void of_single_runs() {
    constexpr std::size_t kMostRuns = 24;
    const std::size_t runs = data_.context.runs.size();
    if (runs < 2 || runs > kMostRuns) return;
    const std::vector<Seen> of = seen_in_runs();
    for (std::size_t run = 0; run < runs; ++run) {
      const auto add_of_run = [&](ConventionKind kind) -> Convention& {
        Convention& c = add(kind);
        c.run = run;
        return c;
      };
      for (int k = 0; k < 3; ++k) {
        const auto i = static_cast<std::size_t>(k);
        if (of[run].along[i] && of[run].beside[i])
          add_of_run(ConventionKind::component_sense).components = {k};
        for (int other = k + 1; other < 3; ++other)
          if (of[run].along[i] && of[run].along[static_cast<std::size_t>(other)])
            add_of_run(ConventionKind::swapped_columns).components = {k, other};
      }
      for (const AxisId a : of[run].moves) {
        Convention& sense = add_of_run(ConventionKind::axis_sense);
        sense.axes = {a};
        sense.in_file = true;
        if (machine_.axes[a].kind != AxisKind::rotary) continue;
        Convention& unit = add_of_run(ConventionKind::unit);
        unit.axes = {a};
        unit.factor = kDegreePerRad;
      }
    }
  }

  // A column that says one sense throughout: of each run in which it does.
  void motions() {
    constexpr std::size_t kMost = 24;
    const std::vector<OneSidedSense> found = one_sided_senses(Observations(machine_, data_));
    for (std::size_t k = 0; k < std::min(found.size(), kMost); ++k) {
      Convention& c = add(ConventionKind::motion_sense);
      c.axes = {found[k].axis};
      c.run = found[k].run;
    }
  }

  // Runs, and files of several, in which the model says more than noise.
  void compensation() {
    constexpr std::size_t kMostRuns = 12;
    constexpr double kShows = 1.0;  // root mean square of what the model says, over the uncertainty
    const std::size_t runs = data_.context.runs.size();
    if (runs < 2 || runs > kMostRuns || model_.effects.empty()) return;
    const VectorXd says = Observations(machine_, data_).predicted(model_);
    std::vector<double> square(runs), count(runs);
    std::map<std::size_t, std::set<std::size_t>> of_file;
    for (std::size_t i = 0; i < data_.readings.size(); ++i) {
      const Reading& r = data_.readings[i];
      square[data_.run_of(r)] += std::pow(says[static_cast<Eigen::Index>(i)] / r.u_random, 2);
      count[data_.run_of(r)] += 1.0;
      of_file[data_.rows[r.row].file].insert(data_.run_of(r));
    }
    const auto shows = [&](std::size_t run) { return square[run] > kShows * kShows * count[run]; };
    for (std::size_t run = 0; run < runs; ++run)
      if (shows(run)) add_compensated().run = run;
    for (const auto& [file, its] : of_file)
      if (of_file.size() > 1 && its.size() > 1 && std::any_of(its.begin(), its.end(), shows))
        add_compensated().file = file;
  }
  Convention& add_compensated() {
    Convention& c = add(ConventionKind::compensated);
    c.effects = model_.effects.size();
    return c;
  }

  const Machine& machine_;
  const Dataset& data_;
  const Model& model_;
  bool both_;
  std::vector<Convention> out_;
};

}  // namespace

std::vector<Convention> conventions(const Machine& machine, const Dataset& data, const Model& model) {
  std::vector<Convention> out = Listed(machine, data, model).all();
  std::erase_if(out, [&](const Convention& c) {
    return beyond_instruments(c, data) || refuted_by_the_ball(machine, model, data, c);
  });
  return out;
}

std::vector<Convention> columns_of_single_runs(const Machine& machine, const Dataset& data,
                                               const Model& model) {
  std::vector<TurningRun> runs = turning_runs(machine, data);
  std::erase_if(runs, [](const TurningRun& run) { return !run.follows; });
  std::vector<Convention> out;
  if (std::none_of(runs.begin(), runs.end(),
                   [](const TurningRun& run) { return run.wanders_mm < kBallStands_mm; }))
    return out;
  const std::vector<Convention> columns = Listed(machine, data, model).columns();
  for (const TurningRun& run : runs)
    for (Convention c : columns) {
      c.run = run.run;
      if (run.wanders_mm > kBallWanders_mm && proved_by_the_ball(machine, model, data, c))
        out.push_back(std::move(c));
    }
  return out;
}

std::string_view text_of(ConventionKind kind) {
  switch (kind) {
    case ConventionKind::axis_sense:
      return "axis_sense";
    case ConventionKind::reading_sense:
      return "reading_sense";
    case ConventionKind::swapped_columns:
      return "swapped_columns";
    case ConventionKind::unit:
      return "unit";
    case ConventionKind::tool_length:
      return "tool_length";
    case ConventionKind::tool_offset:
      return "tool_offset";
    case ConventionKind::ball_offset:
      return "ball_offset";
    case ConventionKind::time_shift:
      return "time_shift";
    case ConventionKind::stacking_order:
      return "stacking_order";
    case ConventionKind::component_sense:
      return "component_sense";
    case ConventionKind::frame:
      return "frame";
    case ConventionKind::motion_sense:
      return "motion_sense";
    case ConventionKind::position_offset:
      return "position_offset";
    case ConventionKind::compensated:
      return "compensated";
  }
  return "";
}

}  // namespace trunnion::diagnosis
