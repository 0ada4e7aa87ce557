#include "diagnosis/verdict/bookkeeping.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <oneapi/tbb/parallel_for.h>

#include "trunnion/base/median.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/data/data_check.hpp"
#include "diagnosis/fit/statistics.hpp"
#include "diagnosis/fit/usual_size.hpp"
#include "diagnosis/search/atoms.hpp"
#include "diagnosis/verdict/ball_offsets.hpp"
#include "diagnosis/verdict/ball_place.hpp"
#include "diagnosis/verdict/bookkeeping_figures.hpp"
#include "diagnosis/verdict/clock_shift.hpp"

namespace trunnion::diagnosis {
namespace {

// README, "Conventions"; calibrated in tests/bench/discovery (run --conventions).
constexpr double kSuspicious = 1.5;  // chi-square per degree: below, nothing is the wrong way round
constexpr double kMuchIsWrong =
    250.0;  // chi-square above its degrees: many readings may hide a wrong run in theirs
constexpr double kFarTooSmall = 0.1;  // the same of readings in too large a unit
constexpr double kShare = 0.7;       // of what is wrong, that the convention explains beside the same effects
constexpr double kMuchBetter = 2.0;  // chi-square per degree of the best effects over that of the convention
constexpr double kOverwhelming = 20.0;  // the same where the rest is no noise
constexpr double kNearlyNoise = 3.0;    // chi-square per degree that is still "fits"
constexpr double kLeastNoise = 0.5;     // the same: less is no scatter that a measurement has
constexpr double kNoise = 1.4;          // chi-square per degree of a rest that is noise
constexpr double kNearlyAll = 0.9;      // share where effects explain the readings too, with more parameters
constexpr double kAbsurd = 50.0;        // usual magnitudes: no tool was set as badly; of the model's own too
constexpr double kAbsurdOfMachine = 500.0;            // no error of a machine that moves is as large
constexpr double kEvidence = 30.0;                    // in -2 ln
constexpr double kMoreEvidence = 90.0;                // the same where not only noise is left
constexpr double kAsGood = 30.0;                      // of a further convention beside the best
constexpr std::size_t kMostReadings = 2500;           // a convention concerns all: more only take time
constexpr std::size_t kSearched = 5;                  // conventions beside which effects are searched
constexpr std::ptrdiff_t kSearchedOfRuns = 2;         // the same of single runs, signs and units apart
constexpr std::size_t kLookedAt = 6;                  // runs whose directions and positions are tried
constexpr double kOfBestRun = 0.1;                    // least share of the best one's gain that is worth it
constexpr double kHelps = 0.05, kHelpsEffects = 0.3;  // least share of what is wrong that is worth a search
constexpr double kMostOddReadings = 0.05;
constexpr double kMostOffset_mm = 500.0;
constexpr double kMostToolOffset_mm = 250.0;  // nothing that is measured stands farther beside its tool
constexpr double kLeastLever_mm = 1.0, kLeastOffset_mm = 0.5, kLeastShift_s = 30.0;
constexpr double kOfLost =
    2.0;  // in chi-square: of a reading that a shift of the clock leaves without a state
constexpr int kNewtonSteps = 5, kClockRefinements = 12;

Model as_it_is(Model model) {
  for (ModelEffect& effect : model.effects)
    for (ParameterValue& p : effect.parameters) p.fixed = true;
  return model;
}

bool has_values(const Model& model) {
  return std::any_of(model.effects.begin(), model.effects.end(), [](const ModelEffect& e) {
    return std::any_of(e.parameters.begin(),
                       e.parameters.begin() + static_cast<std::ptrdiff_t>(e.effect->info().linear_count()),
                       [](const ParameterValue& p) { return !p.fixed && p.given && p.value != 0.0; });
  });
}

// The rows that readings were taken in, and those in which the spindle's speed or a free state changes: what
// has a memory needs them.
Dataset without_idle_rows(Dataset data) {
  std::vector<bool> kept(data.track.size(), false);
  for (const Reading& r : data.readings) kept[r.row] = true;
  std::vector<std::size_t> last(data.context.runs.size(), data.track.size());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const MachineState s = data.track.state(i);
    std::size_t& before = last[s.run];
    if (before == data.track.size()) {
      kept[i] = true;
    } else {
      const MachineState b = data.track.state(before);
      kept[i] = kept[i] || s.spindle_rpm != b.spindle_rpm ||
                !std::equal(s.state.begin(), s.state.end(), b.state.begin(), b.state.end());
    }
    before = i;
  }
  std::vector<MachineState> states;
  std::vector<RowOrigin> rows;
  std::vector<std::size_t> to(kept.size());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    to[i] = states.size();
    if (!kept[i]) continue;
    states.push_back(data.track.state(i));
    rows.push_back(data.rows[i]);
  }
  for (Reading& r : data.readings) r.row = to[r.row];
  Dataset out = make_dataset(data.context, states, std::move(rows), std::move(data.readings));
  out.files = std::move(data.files);
  return out;
}

// Every k-th reading, without single ones that cannot be right.
Dataset thinned_out(const Observations& whole) {
  Dataset data = whole.data();
  const std::vector<bool> far = far_readings(whole);
  std::vector<Reading> near;
  for (std::size_t i = 0; i < data.readings.size(); ++i)
    if (!far[i]) near.push_back(data.readings[i]);
  data.readings = std::move(near);
  const std::size_t step = (data.readings.size() + kMostReadings - 1) / kMostReadings;
  if (step < 2) return data;
  std::vector<Reading> kept;
  for (std::size_t i = 0; i < data.readings.size(); i += step) kept.push_back(data.readings[i]);
  data.readings = std::move(kept);
  return without_idle_rows(std::move(data));
}

// Most of these readings, times a factor, do not show even their own scatter. The middle one tells: a single
// run in another unit must not hide all others.
bool hardly_scatter(std::vector<double> over_uncertainty, double factor) {
  constexpr double kFarBelow = 0.2;  // of the uncertainty
  return !over_uncertainty.empty() && factor * median(std::move(over_uncertainty)) < kFarBelow;
}

bool are_small(const Dataset& data, const std::optional<Quantity>& quantity) {
  return hardly_scatter(scatter_over_uncertainty(data, quantity, {}), 1.0);
}

// Readings that another unit would put far below their own noise: it would explain anything away.
bool scales_to_nothing(const Convention& c, const Dataset& data) {
  if (c.kind != ConventionKind::unit || !c.axes.empty() || c.factor >= 1.0 || c.with_uncertainty)
    return false;
  if (!c.file) return hardly_scatter(scatter_over_uncertainty(data, c.quantity, c.run), c.factor);
  Dataset of_file = data;
  std::erase_if(of_file.readings, [&](const Reading& r) { return !concerns(data, r, c); });
  return hardly_scatter(scatter_over_uncertainty(of_file, c.quantity, {}), c.factor);
}

struct Trial {
  Convention what;
  Figures base, with_found;  // the model as given, and with the effects that were found, both fitted
  double best = INFINITY;    // smallest deviance of these and of `fewer`, each with its price
  double fewer = INFINITY;   // the same beside all that was found but one effect
  double excess =
      INFINITY;  // of chi-square of the model as given over what noise leaves; of a shift of the clock
};

// The files with one convention put right; effects that were found stand behind the model's own.
struct RightFiles {
  RightFiles(const Machine& machine, const Model& found, const Dataset& data, const Convention& c)
      : files(put_right(machine, found, with_known_state(data, c), c)),
        observations(files.machine, files.data) {}
  RightFiles(const RightFiles&) = delete;
  RightFiles& operator=(const RightFiles&) = delete;
  Model with_first(std::size_t effects) const {
    Model out = files.model;
    out.effects.resize(effects);
    return out;
  }
  Model without(std::size_t effect) const {
    Model out = files.model;
    out.effects.erase(out.effects.begin() + static_cast<std::ptrdiff_t>(effect));
    return out;
  }

  const PutRight files;
  const Observations observations;
};

struct Accepted {
  Bookkeeping said;
  double deviance = 0.0;  // with the price of the effects beside it
  bool sure = false;      // no effect does about as well
};

class Judge {
 public:
  Judge(const Observations& whole, const Model& model, const Diagnosis& said, const RunFactors& of_runs,
        const EffectSearch& search)
      : machine_(whole.machine()),
        data_(thinned_out(whole)),
        model_(model),
        of_runs_(of_runs),
        search_(search) {
    found_ = with(model_, said.additions);
    found_columns_ = columns_of(said.additions);
    families_ = std::max(1.0, static_cast<double>(said.ranking.size()));
    for (std::size_t k = 0; said.additions.size() > 1 && k < said.additions.size(); ++k)
      columns_without_.push_back(found_columns_ - columns_of({said.additions[k]}));
    said_clean_ = clean(said) && !leans_on_open_period(said);
    absurd_ = absurd(said.additions);
    small_readings_ = are_small(data_, Quantity::displacement) || are_small(data_, Quantity::rotation);
  }

  WrongConventions run() {
    as_given_ = fitted(machine_, data_, model_, {});
    found_as_given_ = found_columns_ > 0.0 ? fitted(machine_, data_, found_, {}) : as_given_;
    WrongConventions out;
    out.likely = proved();
    out.proved = !out.likely.empty();
    if (out.proved) return out;
    if (has_values(model_)) out.likely = as_it_stands();
    if (out.likely.empty()) out.likely = taken_up_by_the_model();
    const double reduced = as_given_.reduced();
    const bool suspicious = reduced > kSuspicious || as_given_.chi2 - as_given_.dof > kMuchIsWrong;
    if (!out.likely.empty() || as_given_.dof < 5.0 || (!suspicious && reduced > kFarTooSmall)) return out;
    return fitted_conventions();
  }

 private:
  static Model with(Model model, const std::vector<ModelEffect>& effects) {
    model.effects.insert(model.effects.end(), effects.begin(), effects.end());
    return model;
  }
  static double columns_of(const std::vector<ModelEffect>& effects) {
    double out = 0.0;
    for (const ModelEffect& e : effects) out += static_cast<double>(e.parameters.size());
    return out;
  }
  static FitCore core_of(const Observations& o, const Model& model, const std::vector<bool>& flags) {
    return fit_core(o, model, {.robust = false}, flags);
  }
  Figures fitted(const Machine& machine, const Dataset& data, const Model& model,
                 const std::vector<bool>& flags, double scale = 0.0) const {
    const Observations o(machine, data);
    return figures(o, model, core_of(o, model, flags), scale);
  }
  Figures under(const Convention& c, const Model& model) const {
    const PutRight right = put_right(machine_, model, with_known_state(data_, c), c);
    return fitted(right.machine, right.data, right.model, {}, of_scale(c, data_));
  }

  // Of effects, each chosen from all.
  double selection(double count) const { return 2.0 * std::log(families_) * count; }

  double price(const Convention& c) const {
    double free = 0.0;
    if (c.kind == ConventionKind::tool_offset || c.kind == ConventionKind::ball_offset) free = 3.0;
    if (c.kind == ConventionKind::tool_length || c.kind == ConventionKind::time_shift) free = 1.0;
    free += static_cast<double>(runs_with_lost_speeds(data_, c).size());
    // Of two that explain the same the one that changes fewer readings.
    const auto changed = std::count_if(data_.readings.begin(), data_.readings.end(),
                                       [&](const Reading& r) { return concerns(data_, r, c); });
    const double readings = static_cast<double>(data_.readings.size());
    // Three signs, three exchanges, positions: one of many against the one sign of all readings of the run.
    constexpr double kWaysOfOneRun = 8.0;
    const double chosen = c.is_of_columns_of_one_run() ? 2.0 * std::log(kWaysOfOneRun) : 0.0;
    return free * std::log(readings) + chosen + static_cast<double>(changed) / readings;
  }

  // Offsets by Newton's method, shifts of the clock between the steps of the list.
  Convention estimated(Convention c, const Model& model) const {
    if (c.kind == ConventionKind::time_shift) return with_lost_speeds(std::move(c), model);
    const bool offset = c.kind == ConventionKind::tool_length || c.kind == ConventionKind::tool_offset ||
                        c.kind == ConventionKind::ball_offset;
    if (!offset) return c;
    for (int step = 0; step < kNewtonSteps; ++step) {
      const Vec3 by = newton_step(c, model);
      c.by_mm += by;
      if (!c.by_mm.allFinite() || by.norm() < 1e-4 || c.by_mm.norm() > 2.0 * kMostOffset_mm) break;
    }
    return c;
  }
  // Before the first speed that is recorded the spindle turned at the one that fits best: what of it goes on
  // to act is one number a run.
  Convention with_lost_speeds(Convention c, const Model& model) const {
    constexpr int kSteps = 2;
    constexpr double kStep_rpm = 1000.0;
    const auto runs = runs_with_lost_speeds(data_, c);
    c.clock.speed_before_rpm.clear();
    if (runs.empty()) return c;
    const Dataset known = with_known_state(data_, c);
    c.clock.speed_before_rpm.resize(data_.context.runs.size());
    for (const std::size_t run : runs) c.clock.speed_before_rpm[run] = 0.0;
    for (int step = 0; step < kSteps; ++step) {
      const PutRight at = put_right(machine_, model, known, c);
      const Observations here(at.machine, at.data);
      const FitCore core = core_of(here, at.model, {});
      MatrixXd slope(here.size(), static_cast<Eigen::Index>(runs.size()));
      for (std::size_t k = 0; k < runs.size(); ++k) {
        Convention beside = c;
        *beside.clock.speed_before_rpm[runs[k]] += kStep_rpm;
        const PutRight moved = put_right(machine_, model, known, beside);
        slope.col(static_cast<Eigen::Index>(k)) =
            (Observations(moved.machine, moved.data).predicted(core.model) - here.predicted(core.model)) /
            kStep_rpm;
      }
      const MatrixXd g = core.projected(slope);
      const MatrixXd normal = g.transpose() * g;
      const VectorXd by = inverse_above(normal, 1e-9 * normal.trace()) * (g.transpose() * core.white);
      if (!by.allFinite()) break;
      for (std::size_t k = 0; k < runs.size(); ++k)
        *c.clock.speed_before_rpm[runs[k]] += by[static_cast<Eigen::Index>(k)];
    }
    return c;
  }
  Vec3 newton_step(const Convention& c, const Model& model) const {
    constexpr double kStep_mm = 0.5;
    const PutRight at = put_right(machine_, model, data_, c);
    const Observations here(at.machine, at.data);
    const FitCore core = core_of(here, at.model, {});
    std::vector<int> along = {0, 1, 2};
    if (c.kind == ConventionKind::tool_length) along = {2};
    MatrixXd slope(here.size(), static_cast<Eigen::Index>(along.size()));
    for (std::size_t k = 0; k < along.size(); ++k) {
      Convention beside = c;
      beside.by_mm[along[k]] += kStep_mm;
      const PutRight moved = put_right(machine_, model, data_, beside);
      const Observations there(moved.machine, moved.data);
      slope.col(static_cast<Eigen::Index>(k)) =
          ((here.values() - here.predicted(core.model)) - (there.values() - there.predicted(core.model))) /
          kStep_mm;
    }
    const MatrixXd g = core.projected(slope);
    const MatrixXd normal = g.transpose() * g;
    const VectorXd found = inverse_above(normal, 1e-9 * normal.trace()) * (g.transpose() * core.white);
    Vec3 out = Vec3::Zero();
    for (std::size_t k = 0; k < along.size(); ++k) out[along[k]] = found[static_cast<Eigen::Index>(k)];
    return out;
  }

  bool is_possible(const Convention& c) const {
    return large_enough(c) && !refuted_by_the_ball(machine_, model_, data_, c);
  }
  // Smaller ones are what effects are made for.
  static bool large_enough(const Convention& c) {
    switch (c.kind) {
      case ConventionKind::tool_length:
        return c.by_mm.norm() >= (c.in_readings ? kLeastOffset_mm : kLeastLever_mm) &&
               c.by_mm.norm() <= kMostOffset_mm;
      case ConventionKind::tool_offset:
        return c.by_mm.norm() >= kLeastOffset_mm && c.by_mm.norm() <= kMostToolOffset_mm;
      case ConventionKind::ball_offset:
        return c.by_mm.norm() >= kLeastOffset_mm && c.by_mm.norm() <= kMostOffset_mm;
      case ConventionKind::time_shift:
        return std::abs(c.clock.by_s) >= kLeastShift_s;
      case ConventionKind::axis_sense:
      case ConventionKind::reading_sense:
      case ConventionKind::swapped_columns:
      case ConventionKind::unit:
      case ConventionKind::stacking_order:
      case ConventionKind::component_sense:
      case ConventionKind::frame:
      case ConventionKind::motion_sense:
      case ConventionKind::position_offset:
      case ConventionKind::compensated:
        return true;
    }
    return true;
  }

  // What the control took out of a run is taken up by the run's set-up: nobody can tell, and it must not
  // stand in the way of another run.
  bool changes_nothing(const Trial& t) const {
    constexpr double kSame = 1.0;  // in -2 ln
    return t.what.kind == ConventionKind::compensated &&
           std::abs(t.base.deviance - as_given_.deviance) < kSame &&
           std::abs(t.with_found.deviance - found_as_given_.deviance) < kSame;
  }

  // Readings of which a control has taken out what the model says do not ask for it: as they are they gain
  // far less by the known effects than with them put back. Where a value has changed between the runs they
  // do.
  bool ask_for_the_known(const Convention& c) const {
    constexpr double kAsks =
        0.15;  // a value wrong by a quarter leaves 0.11, one that is not taken out 0.18 and more
    Dataset own = data_;
    std::erase_if(own.readings, [&](const Reading& r) { return !concerns(data_, r, c); });
    Model none = model_;
    none.effects.clear();
    const auto gain = [&](const Dataset& data) {
      return fitted(machine_, data, none, {}).chi2 - fitted(machine_, data, model_, {}).chi2;
    };
    return gain(own) > kAsks * gain(put_right(machine_, model_, own, c).data);
  }

  // Readings that a shift of the clock leaves without a state.
  double of_lost(const Convention& c) const {
    return static_cast<double>(data_.readings.size() - with_known_state(data_, c).readings.size());
  }
  // The figures as if they were of all readings: a lost one is no better explained than by a parameter of its
  // own.
  Figures with_lost(Figures f, double lost) const {
    if (lost == 0.0) return f;
    double logarithms = 0.0;  // of the noise of one reading
    for (const Reading& r : data_.readings) logarithms += 2.0 * std::log(r.u_random);
    const double each = 1.0 + logarithms / static_cast<double>(data_.readings.size());
    f.deviance += (each + kOfLost) * lost;
    f.floor += (each + kOfLost) * lost;
    return f;
  }

  Trial tried(const Convention& given) const {
    Trial out;
    out.what = estimated(given, model_);
    if (is_possible(out.what)) compare(out);
    return out;
  }
  // Sizes of parameters cost several fits, and only add to what speaks against a convention: most explain
  // nothing without them.
  void compare(Trial& t) const {
    const RightFiles right(machine_, found_, data_, t.what);
    const Observations& o = right.observations;
    const Model base = right.with_first(model_.effects.size());
    const double lost = of_lost(t.what), scale = of_scale(t.what, data_);
    const double n = std::log(static_cast<double>(data_.readings.size()));
    const FitCore core = core_of(o, base, {});
    const FitCore core_found = found_columns_ > 0.0 ? core_of(o, right.files.model, {}) : core;
    t.base = with_lost(least_figures(o, core, scale), lost);
    t.with_found = with_lost(least_figures(o, core_found, scale), lost);
    // Of one run, and where all that was found does as well beside it: else one effect less does not either.
    const auto fewer_may = [&] {
      return t.what.shows_in_the_file() ||
             (t.what.of_a_part() && t.with_found.deviance < found_as_given_.deviance + kEvidence);
    };
    std::vector<std::pair<Model, FitCore>> fewer;
    for (std::size_t k = 0; fewer_may() && k < columns_without_.size(); ++k) {
      Model without = right.without(model_.effects.size() + k);
      FitCore fit = core_of(o, without, {});
      t.fewer =
          std::min(t.fewer, least_figures(o, fit, scale).deviance + columns_without_[k] * n + price(t.what));
      fewer.emplace_back(std::move(without), std::move(fit));
    }
    if (explains(t)) {
      t.base = with_lost(figures(o, base, core, scale), lost);
      t.with_found =
          found_columns_ > 0.0 ? with_lost(figures(o, right.files.model, core_found, scale), lost) : t.base;
      t.fewer = INFINITY;
      for (std::size_t k = 0; fewer_may() && k < fewer.size(); ++k)
        t.fewer = std::min(t.fewer, figures(o, fewer[k].first, fewer[k].second, scale).deviance +
                                        columns_without_[k] * n + price(t.what));
    }
    t.best = std::min({t.base.deviance + price(t.what),
                       t.with_found.deviance + found_columns_ * n + price(t.what), t.fewer});
  }
  // How well the model as given does beside a shift of the clock.
  Trial at_clock(const Convention& given) const {
    Trial out;
    out.what = estimated(given, model_);
    if (!large_enough(out.what)) return out;
    const RightFiles right(machine_, model_, data_, out.what);
    const FitCore core = core_of(right.observations, right.files.model, {});
    const double lost = of_lost(out.what);
    const Figures f = with_lost(least_figures(right.observations, core, 0.0), lost);
    out.excess = f.chi2 - f.dof + kOfLost * lost;
    return out;
  }
  static bool falls(const Figures& from, const Figures& to, double share) {
    const double by = from.deviance - to.deviance;
    return by > kEvidence && by > share * (from.deviance - from.floor);
  }
  // What does not even bring the model or the effects that were found nearer to the readings explains
  // nothing; but readings that are too small are near to everything. A run of few readings is little of what
  // is wrong, but one effect less may do beside its other sign.
  bool explains(const Trial& t) const {
    const double n = std::log(static_cast<double>(data_.readings.size()));
    const double as_found = found_as_given_.deviance + found_columns_ * n + selection(1.0);
    if (t.what.is_of_columns_of_one_run())
      return falls(as_given_, t.base, kHelpsEffects) ||
             (!said_clean_ && falls(found_as_given_, t.with_found, kHelpsEffects));
    return t.fewer <= as_found + kThousandToOne || falls(as_given_, t.base, kHelps) ||
           (!said_clean_ && falls(found_as_given_, t.with_found, kHelpsEffects)) ||
           (t.what.kind == ConventionKind::unit && t.what.axes.empty() && t.what.factor > 1.0 &&
            (small_readings_ || t.what.of_a_part()));
  }

  // Each kind of clock shift once, at its best moment. Effects found beside the wrong clock suit it, so the
  // model as given decides, and a reading that is left without a state is no better explained than by a
  // parameter of its own.
  void refine_clock(std::vector<Trial>& trials) const {
    std::vector<Trial> shifts;
    for (const double sense : {1.0, -1.0}) {  // between the steps of the list the wrong one may look better
      const Trial* best = nullptr;
      for (const Trial& t : trials)
        if (t.what.kind == ConventionKind::time_shift && t.what.clock.by_s * sense > 0.0 &&
            (best == nullptr || t.excess < best->excess))
          best = &t;
      if (best != nullptr) shifts.push_back(*best);
    }
    if (shifts.empty()) return;
    std::erase_if(trials, [](const Trial& t) { return t.what.kind == ConventionKind::time_shift; });
    oneapi::tbb::parallel_for(std::size_t{0}, shifts.size(), [&](std::size_t i) { refine(shifts[i]); });
    trials.push_back(std::move(*std::min_element(
        shifts.begin(), shifts.end(), [](const Trial& a, const Trial& b) { return a.excess < b.excess; })));
    if (std::isfinite(trials.back().excess)) compare(trials.back());
  }
  void refine(Trial& shift) const {
    double step = 0.4 * std::abs(shift.what.clock.by_s);
    for (int k = 0; k < kClockRefinements; ++k, step *= 0.6)
      for (const double by : {step, -step}) {
        Convention c = shift.what;
        c.clock.by_s += by;
        if (Trial t = at_clock(c); t.excess < shift.excess) shift = std::move(t);
      }
  }

  // One whose directions or positions are wrong is among the runs that misfit most.
  std::vector<std::size_t> runs_that_misfit() const {
    const Observations o(machine_, data_);
    std::vector<std::size_t> out = in_order_of_misfit(o, core_of(o, model_, {}).white);
    out.resize(std::min(out.size(), kLookedAt));
    return out;
  }

  std::vector<Trial> trials() const {
    auto list = conventions(machine_, data_, model_);
    const std::vector<std::size_t> misfit = runs_that_misfit();
    std::erase_if(list, [&](const Convention& c) {
      return c.is_of_columns_of_one_run() && std::find(misfit.begin(), misfit.end(), *c.run) == misfit.end();
    });
    std::vector<Trial> out(list.size());
    oneapi::tbb::parallel_for(std::size_t{0}, list.size(), [&](std::size_t i) {
      out[i] = list[i].kind == ConventionKind::time_shift ? at_clock(list[i]) : tried(list[i]);
    });
    refine_clock(out);
    std::erase_if(out, [](const Trial& t) { return !std::isfinite(t.best); });
    std::stable_sort(out.begin(), out.end(), [](const Trial& a, const Trial& b) { return a.best < b.best; });
    return out;
  }

  // The best of each kind, positions and readings in another unit apart, and of these the best few: one kind
  // must not crowd out the others.
  void best_of_each_kind(std::vector<Trial>& all) const {
    std::vector<Trial> kept;
    for (Trial& t : all) {
      const bool readings = t.what.kind == ConventionKind::unit && t.what.axes.empty();
      const auto same = [&](const Trial& k) {
        return k.what.kind == t.what.kind && k.what.axes.empty() == t.what.axes.empty();
      };
      // Of one quantity, the other, or both: effects must be searched to tell.
      if (std::count_if(kept.begin(), kept.end(), same) < (readings && small_readings_ ? 3 : 1))
        kept.push_back(std::move(t));
    }
    if (kept.size() > kSearched) kept.resize(kSearched);
    all = std::move(kept);
  }

  // Of single runs, what does better with effects of its own: those that were found may suit the mistake.
  void add_runs(std::vector<Trial>& all) const {
    std::array<std::ptrdiff_t, 2> added = {0, 0};
    for (const RunFactor& f : of_runs_.better) {
      if (f.gain < std::max(kThousandToOne, kOfBestRun * of_runs_.better.front().gain)) return;
      if (added[f.factor < 0.0 ? 0 : 1]++ >= kSearchedOfRuns) continue;
      Convention c;
      c.kind = f.factor < 0.0 ? ConventionKind::reading_sense : ConventionKind::unit;
      c.run = f.run;
      c.with_uncertainty = f.with_uncertainty;
      if (c.kind == ConventionKind::unit) {
        c.quantity = Quantity::rotation;
        c.factor = f.factor;
      }
      const bool known = std::any_of(all.begin(), all.end(), [&](const Trial& t) {
        return t.what.kind == c.kind && t.what.run == c.run && !t.what.file && t.what.factor == c.factor &&
               t.what.with_uncertainty == c.with_uncertainty;
      });
      if (!known) all.push_back(tried(c));
    }
  }

  WrongConventions fitted_conventions() {
    auto all = trials();
    tried_ = static_cast<double>(all.size()) + of_runs_.tried;
    // Readings that hardly scatter are cured by no other unit than a larger one.
    const auto cures = [&](const Convention& c) {
      return c.kind != ConventionKind::unit || !c.axes.empty() || !small_readings_ ||
             (c.factor > 1.0 && !c.with_uncertainty && (c.of_a_part() || are_small(data_, c.quantity)));
    };
    std::erase_if(all, [&](const Trial& t) {
      return scales_to_nothing(t.what, data_) || !cures(t.what) || changes_nothing(t) ||
             (t.base.reduced() < kLeastNoise && t.with_found.reduced() < kLeastNoise) || !explains(t);
    });
    // Little is wrong with most readings: then a convention explains most of it, the model being as it is.
    if (as_given_.reduced() < kSuspicious && as_given_.reduced() > kFarTooSmall)
      std::erase_if(all, [&](const Trial& t) { return !falls(as_given_, t.base, kShare); });
    // Nor does what noise alone would leave too much of.
    const double n = std::log(static_cast<double>(data_.readings.size()));
    const Figures& known = absurd_ ? as_given_ : found_as_given_;
    const double to_beat = known.deviance + known.parameters * n;
    std::erase_if(all, [&](const Trial& t) {
      return t.base.floor + t.base.parameters * n + price(t.what) > to_beat + kThousandToOne;
    });
    best_of_each_kind(all);
    add_runs(all);
    // Both sides go on searching.
    if (!said_clean_ && found_columns_ > 0.0 &&
        std::any_of(all.begin(), all.end(), [](const Trial& t) { return t.what.of_a_part(); }))
      found_ = with(found_, search_(machine_, data_, found_).additions);
    std::vector<Accepted> accepted;
    double least = INFINITY;
    for (const Trial& t : all) {
      if (t.best > least + kAsGood) continue;
      auto said = judged(t);
      if (!said) continue;
      accepted.push_back(std::move(*said));
      // With the model alone only noise is left: no other does better by so much, but as well.
      if (t.base.reduced() < kNoise) least = std::min(least, t.best);
    }
    std::stable_sort(accepted.begin(), accepted.end(),
                     [](const Accepted& a, const Accepted& b) { return a.deviance < b.deviance; });
    WrongConventions out;
    out.sure = std::any_of(accepted.begin(), accepted.end(), [](const Accepted& a) { return a.sure; });
    for (Accepted& a : accepted)
      if (a.deviance < accepted.front().deviance + kAsGood) add(out.likely, std::move(a.said));
    return out;
  }

  // A search finds a few effects at once: where they are sure and not all, a second one goes on.
  Diagnosis searched(const PutRight& right, bool goes_on) const {
    Diagnosis first = search_(right.machine, right.data, right.model);
    if (!goes_on || clean(first) || first.additions.empty()) return first;
    Diagnosis out = search_(right.machine, right.data, with(right.model, first.additions));
    out.additions.insert(out.additions.begin(), first.additions.begin(), first.additions.end());
    return out;
  }

  // Effects are searched once more beside the convention; both sides then have the best that they can.
  std::optional<Accepted> judged(const Trial& t) const {
    const Dataset known = with_known_state(data_, t.what);
    const PutRight right = put_right(machine_, model_, known, t.what);
    const Diagnosis beside = searched(right, t.what.of_a_part());
    std::vector<bool> flags = beside.base.outlier;
    if (static_cast<double>(std::count(flags.begin(), flags.end(), true)) >
        kMostOddReadings * static_cast<double>(flags.size()))
      flags.clear();
    const Model needed = with(right.model, beside.additions), without = with(model_, beside.additions);
    const Figures after = fitted(right.machine, right.data, needed, flags, of_scale(t.what, data_));
    const Figures before = fitted(machine_, known, without, flags);
    // Effects far beyond their usual size are no explanation.
    Figures best = fitted(machine_, known, absurd_ ? model_ : found_, flags);
    const double n = std::log(static_cast<double>(data_.readings.size()));
    const double needed_effects = static_cast<double>(beside.additions.size());
    double best_effects = absurd_ ? 0.0 : static_cast<double>(found_.effects.size() - model_.effects.size());
    if (!absurd(beside.additions) && before.deviance + before.parameters * n + selection(needed_effects) <
                                         best.deviance + best.parameters * n + selection(best_effects)) {
      best = before;
      best_effects = needed_effects;
    }
    const double scale = std::max(1.0, after.reduced());
    const double share = (before.of_readings() - after.of_readings()) / (before.of_readings() - after.floor);
    const double evidence = (best.deviance - after.deviance) / scale +
                            (best.parameters - after.parameters) * n +
                            selection(best_effects - needed_effects) - price(t.what) -
                            (t.what.shows_in_the_file() ? 0.0 : 2.0 * std::log(tried_));
    const double better = off_by(best) / off_by(after);
    if (after.reduced() < kLeastNoise || absurd(beside.additions)) return std::nullopt;
    // A collision between two files looks much like it, and leaves 2.2.
    constexpr double kLittle = 1.8;
    if (t.what.kind == ConventionKind::compensated &&
        (after.reduced() >= kLittle || (after.reduced() >= kNoise && ask_for_the_known(t.what))))
      return std::nullopt;
    if (!(share >= kShare) || before.of_readings() - after.of_readings() < kEvidence) return std::nullopt;
    const bool noise_now = clean(beside) && after.reduced() < kNoise;
    const bool noise_only_now = noise_now && (!said_clean_ || share > kNearlyAll);
    // A state that was recorded now and then changes at moments that are not known: some structure stays.
    const bool steps_stay = t.what.kind == ConventionKind::time_shift && !said_clean_ && share > kNearlyAll &&
                            after.reduced() < kNoise;
    const bool far_nearer =
        better >= kMuchBetter && (after.reduced() < kNearlyNoise || better >= kOverwhelming);
    // A further effect is missing beside the run that is put right, and is small.
    const bool little_stays = t.what.of_a_part() && share > kNearlyAll && after.reduced() < kNoise &&
                              needed_effects <= best_effects && evidence >= kMoreEvidence;
    Accepted out{said(t.what, before, after, false), with_lost(after, of_lost(t.what)).deviance +
                                                         after.parameters * n + selection(needed_effects) +
                                                         price(t.what)};
    // An effect that nobody needs any more is evidence, too, and has been paid for like the others.
    const double enough = needed_effects < best_effects && noise_only_now ? kThousandToOne : kEvidence;
    out.sure = evidence >= enough && (noise_only_now || steps_stay || far_nearer || little_stays);
    if (out.sure) return out;
    // Effects do about as well: nobody can tell from these readings.
    const bool rival = found_columns_ > 0.0 && noise_only_now && evidence > -kThousandToOne;
    return rival ? std::optional(out) : std::nullopt;
  }
  // What is left is noise.
  static bool clean(const Diagnosis& d) {
    return d.verdict == Verdict::nothing_to_find || d.verdict == Verdict::named ||
           d.verdict == Verdict::ambiguous || d.only_number_is_open();
  }
  // A wave with any of several periods follows a wrong run as well as an error of the axis.
  static bool leans_on_open_period(const Diagnosis& d) {
    return d.only_number_is_open() && std::any_of(d.ranking.begin(), d.ranking.end(), [](const auto& r) {
             return r.number_is_open() && r.id.starts_with("periodic:");
           });
  }
  // Of effects that were found. A length that somebody typed in is wrong sooner than a machine is.
  static bool absurd(const std::vector<ModelEffect>& effects) {
    const auto of_tool = [](const ModelEffect& e) {
      return e.id() == "tool_length" || e.id() == "tool_offset";
    };
    std::vector<ModelEffect> tool, machine;
    std::partition_copy(effects.begin(), effects.end(), std::back_inserter(tool), std::back_inserter(machine),
                        of_tool);
    return beyond(tool, kAbsurd) || beyond(machine, kAbsurdOfMachine);
  }
  static bool beyond(const std::vector<ModelEffect>& effects, double usual_sizes) {
    return std::any_of(effects.begin(), effects.end(),
                       [&](const ModelEffect& e) { return is_beyond_usual(e, usual_sizes); });
  }
  // How far from noise, whichever way.
  static double off_by(const Figures& f) {
    const double r = std::max(f.reduced(), 1e-12);
    return std::max(r, 1.0 / r);
  }

  // What the positions alone prove, whatever the readings are.
  std::vector<Bookkeeping> proved() const {
    std::vector<Bookkeeping> out;
    double wanders_mm = 0.0;
    for (const TurningRun& run : turning_runs(machine_, data_))
      if (run.follows) wanders_mm = std::max(wanders_mm, run.wanders_mm);
    if (wanders_mm <= kBallWanders_mm) return out;
    std::vector<Convention> holding = conventions(machine_, data_, model_);
    std::erase_if(holding,
                  [&](const Convention& c) { return !proved_by_the_ball(machine_, model_, data_, c); });
    if (holding.empty()) holding = columns_of_single_runs(machine_, data_, model_);
    if (holding.empty()) holding = offsets_that_hold_the_ball(machine_, data_);
    for (const Convention& c : holding) {
      // A point that is not fixed on the part on purpose stands still by chance, and its readings say so.
      constexpr double kRises =
          1.2;  // of chi-square; mistakes that were made raise it by a hundredth at most
      const Figures after = under(c, model_);
      if (after.chi2 > kRises * std::max(as_given_.chi2, as_given_.dof)) continue;
      Bookkeeping one = said(c, as_given_, after, false);
      one.wandered_mm = wanders_mm;
      one.words = words_of(one, machine_, data_);
      add(out, std::move(one));
    }
    return out;
  }

  // The model's own values: they tell the sign of all readings, which fitted ones would follow.
  std::vector<Bookkeeping> as_it_stands() const {
    const Model held = as_it_is(model_);
    const Figures before = fitted(machine_, data_, held, {});
    if (before.reduced() < kSuspicious) return {};
    const auto list = conventions(machine_, data_, model_);
    std::vector<std::pair<double, Bookkeeping>> good;
    for (const Convention& given : list) {
      const Convention c = estimated(given, held);
      if (!is_possible(c) || scales_to_nothing(c, data_)) continue;
      const Figures after = under(c, held);
      if (after.reduced() > kNearlyNoise / 1.5 || before.reduced() < kOverwhelming * after.reduced() ||
          after.reduced() < 1.0 / kNearlyNoise)
        continue;
      good.emplace_back(after.deviance + price(c), said(c, before, after, true));
    }
    std::stable_sort(good.begin(), good.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Bookkeeping> out;
    for (auto& [deviance, b] : good)
      if (deviance < good.front().first + kAsGood) add(out, std::move(b));
    return out;
  }

  // An offset of the tool that the model's own parameters take up: then one of them is far beyond its usual
  // size.
  std::vector<Bookkeeping> taken_up_by_the_model() const {
    const auto core = [](const PutRight& at) {
      const Observations o(at.machine, at.data);
      const FitCore fit = core_of(o, at.model, {});
      return std::pair{figures(o, at.model, fit, 0.0), beyond(fit.model.effects, kAbsurd)};
    };
    const auto [before, far_beyond] = core({machine_, model_, data_});
    if (!far_beyond) return {};
    std::vector<Bookkeeping> out;
    for (const ConventionKind kind : {ConventionKind::tool_length, ConventionKind::tool_offset}) {
      Convention c;
      c.kind = kind;
      c.in_readings = true;
      c = estimated(c, as_it_is(model_));
      if (!large_enough(c) || scales_to_nothing(c, data_)) continue;
      const auto [after, still] = core(put_right(machine_, model_, data_, c));
      if (!still && after.deviance < before.deviance + kEvidence) {
        add(out, said(c, before, after, false));
        break;  // a length is simpler than an offset
      }
    }
    return out;
  }

  static void add(std::vector<Bookkeeping>& out, Bookkeeping b) {
    const bool known = std::any_of(out.begin(), out.end(), [&](const Bookkeeping& o) {
      return o.convention.kind == b.convention.kind && o.axis == b.axis && o.run == b.run &&
             o.file == b.file && o.axes == b.axes && o.components == b.components && o.quantity == b.quantity;
    });
    if (!known) out.push_back(std::move(b));
  }

  Bookkeeping said(const Convention& c, const Figures& before, const Figures& after, bool own_values) const {
    Bookkeeping out;
    out.convention = c;
    const auto name = [&](AxisId a) { return machine_.axes[a].name; };
    const bool of_one_axis = c.kind == ConventionKind::axis_sense || c.kind == ConventionKind::motion_sense;
    if (of_one_axis) out.axis = name(c.axes.front());
    if (!of_one_axis)
      for (const AxisId a : c.axes) out.axes.push_back(name(a));
    for (const int k : c.components) out.components.push_back(std::string("n_") + "xyz"[k]);
    for (std::size_t k = 0; k < c.by_position.size(); ++k) {
      const bool rotary = machine_.axes[c.axes[k]].kind == AxisKind::rotary;
      out.by_column.emplace_back(name(c.axes[k]) + (rotary ? "_deg" : "_mm"),
                                 c.by_position[k] * (rotary ? kDegreePerRad : 1.0));
    }
    if (c.run) out.run = data_.context.runs[*c.run].id;
    if (c.file) out.file = data_.files[*c.file];
    if (c.quantity) out.quantity = *c.quantity == Quantity::displacement ? "displacement" : "rotation";
    out.chi2_before = before.chi2;
    out.chi2_after = after.chi2;
    out.dof = after.dof;
    out.as_it_stands = own_values;
    out.words = words_of(out, machine_, data_);
    return out;
  }

  const Machine& machine_;
  Dataset data_;
  const Model& model_;
  const RunFactors& of_runs_;
  const EffectSearch& search_;
  Model found_;
  double found_columns_ = 0.0;
  std::vector<double> columns_without_;  // each of these effects, where there are several
  double families_ = 1.0;
  Figures as_given_, found_as_given_;  // of the files as they are: the model, and what was found beside it
  double tried_ = 1.0;
  bool said_clean_ = true;
  bool absurd_ = false;
  bool small_readings_ = false;  // of a quantity: nearly all are below their uncertainty
};

}  // namespace

WrongConventions wrong_conventions(const Observations& whole, const Model& model, const Diagnosis& said,
                                   const RunFactors& of_runs, const EffectSearch& search) {
  return Judge(whole, model, said, of_runs, search).run();
}

}  // namespace trunnion::diagnosis
