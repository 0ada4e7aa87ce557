#include "trunnion/diagnosis/diagnose.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"

#include "diagnosis/data/data_check.hpp"
#include "diagnosis/fit/fit_core.hpp"
#include "diagnosis/fit/heldout.hpp"
#include "diagnosis/fit/statistics.hpp"
#include "diagnosis/fit/uneven_scatter.hpp"
#include "diagnosis/fit/usual_size.hpp"
#include "diagnosis/search/leftover.hpp"
#include "diagnosis/search/neighbours.hpp"
#include "diagnosis/search/ranking.hpp"
#include "diagnosis/search/run_factors.hpp"
#include "diagnosis/search/turn_numbers.hpp"
#include "diagnosis/verdict/ball_place.hpp"
#include "diagnosis/verdict/bookkeeping.hpp"
#include "diagnosis/verdict/constant_sensors.hpp"
#include "diagnosis/verdict/needless.hpp"
#include "diagnosis/verdict/next_measurement.hpp"
#include "diagnosis/verdict/odd_runs.hpp"
#include "diagnosis/verdict/unrecorded.hpp"
#include "diagnosis/verdict/verdict_text.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kLowChi2 = 0.8, kHighChi2 = 1.25, kChi2Level = 1e-4;  // README, "data_problem"
constexpr double kLooseAlpha = 0.05;      // of the set beside which the noise is judged
constexpr double kMostlyExplained = 0.7;  // below, the best match of the library is no name but a likeness
constexpr double kUneasy = 20.0;  // 1 % of sums of squares, beside tests that are corrected for their number
constexpr double kFewestDof = 5.0;
constexpr double kSimulatedNumbers =
    2e8;  // products per simulation round: keeps 10 000 readings within seconds
constexpr std::size_t kFewestSimulations = 40;
constexpr int kMostRounds = 3;  // of the judgement of outliers
// Of the level of false alarms, once for effects and once for structure. The other half of it is what their
// numbers of independent tests, judged by medians, understate in the tails, and what a noise that had to be
// estimated adds.
constexpr double kShareOfLevel = 0.25;
constexpr double kAmongSets =
    0.96;  // that the truth is among sets that hold all within an evidence ratio of 100
constexpr double kOfConvention = 0.97, kOfHarm = 0.9, kOfRounding = 0.95, kOfUneven = 0.9;
constexpr double kPartInstead = 20.0;  // in -2 ln: that a part of a range does better than what was named
constexpr double kNoiseBeside = 1.1;   // chi-square per degree of freedom beside a formula
// Of effects that were named: p of what they leave below which a formula is sought all the same.
constexpr double kUneasyRest = 0.05;
constexpr double kBesideAFormula = 0.9;        // of effects beside which a formula does what others did
constexpr double kBesideAWanderingBall = 0.7;  // confidence where positions of a run may be wrong
constexpr double kOfPositionsAlone = 0.85;     // of a mistake that a ball would show, and no reading does
constexpr double kBesideAPart = 0.7, kBesideOneFunction = 0.8;
// p of an effect from which weights that were estimated change nothing.
constexpr double kSureBesideWeights = 1e-6;
constexpr double kAsSimple = 6.8;  // evidence ratio of 1 : 30, in -2 ln
// What is in the library is known physics of such machines, and one of the thousands of functions follows two
// effects closely by chance: odds of 100 : 1, in -2 ln, in favour of effects that leave only noise.
constexpr double kKnownPhysics = 9.2;
constexpr double kHardlyNoise = 0.05;  // p of what is left
// Of effects among those found beside which the others may be of second order: their share of what all do,
// and how far above the noise (chi-square): a hundredth of their size is then above it, too.
constexpr double kShareOfLarge = 0.99, kFarAboveNoise = 1e5;
constexpr double kFewDof = 60.0;       // below, scatter and its correlation are not told from what is missing
constexpr double kReadingsEach = 3.0;  // degrees of freedom for each parameter
constexpr double kClearlyLess = 10.0;  // chi-square

struct Outcome {
  EffectSet found;
  std::vector<EffectSet> rivals;
  NoiseScale noise;
  Leftover before, after;
  double rss_after = 0.0, dof_after = 0.0;
};

class Engine {
 public:
  Engine(std::shared_ptr<const Observations> whole, const Model& model, const DiagnoseOptions& options,
         std::vector<EffectFamily> library)
      : whole_(std::move(whole)),
        condensed_(whole_->size() > kMostSingly
                       ? std::make_shared<const Observations>(whole_, bins_of(*whole_))
                       : whole_),
        o_(*condensed_),
        model_(model),
        options_(options),
        library_(std::move(library)),
        structures_(o_) {}

  Diagnosis run() {
    FitCore base = fit_core(o_, model_, {});
    Diagnosis d;
    // Outliers are judged beside what was found; a second round with them settles the verdict.
    for (int round = 0;; ++round) {
      const Atoms atoms(o_, base, library_);
      structures_.fit_to(base);
      const Outcome outcome = search(atoms);
      if (round < kMostRounds) {
        std::vector<bool> now = base.whitening->noise().used;
        now.flip();
        auto flags = now;
        if (!keep_all_) {
          if (!outcome.found.members.empty()) flags = outliers_beside(atoms, outcome.found);
          keep_all_ = structured(atoms, outcome.found, flags);
          if (keep_all_) flags.assign(flags.size(), false);
        }
        if (flags != now) {
          base = fit_core(o_, model_, {.robust = false}, flags);
          continue;
        }
      }
      fill(d, atoms, outcome);
      if (options_.conventions && something_is_wrong(d))
        run_factors_ = run_factors(atoms, multiplicity_, level(), options_.max_effects);
      left_out_ = base.whitening->noise().used;
      left_out_.flip();
      if (options_.weigh && condensed_ == whole_) look_at_scatter(atoms, outcome.found);
      return d;
    }
  }
  /// After run(): the readings that count as outliers, one flag for each of those that are judged.
  const std::vector<bool>& left_out() const { return left_out_; }
  /// After run(), where something is wrong: of single runs, whose readings may have the wrong sign or unit.
  const RunFactors& of_runs() const { return run_factors_; }
  /// After run(): whether the readings scatter unevenly; not looked at where they were taken together.
  const std::optional<UnevenScatter>& scatter() const { return scatter_; }

 private:
  double level() const { return kShareOfLevel * options_.alpha; }

  Outcome search(const Atoms& atoms) {
    Outcome out;
    double width = 0.0;
    for (const Atom& atom : atoms.all()) width += static_cast<double>(atom.rank());
    const double affordable =
        kSimulatedNumbers / std::max(1.0, width * static_cast<double>(o_.size()) / 10.0);
    multiplicity_ = atoms.multiplicity(std::clamp(static_cast<std::size_t>(affordable), kFewestSimulations,
                                                  std::max(kFewestSimulations, options_.simulations)),
                                       options_.seed);
    const MatrixXd surrogate = surrogate_for(atoms.base());
    const Remainder nothing = atoms.remainder({});
    const Judgement of_base = judge(atoms, nothing, structures_, surrogate, options_.seed);
    const auto [first, judged] = beside_what(atoms, of_base, surrogate);
    noise_ = out.noise = judged.noise;
    search_ = std::make_unique<Search>(atoms, multiplicity_, noise_, level(), options_.max_effects);
    out.found = search_->best();
    if (!out.found.members.empty()) out.rivals = search_->alternatives(out.found);
    leave_out_smooth_waves(atoms, out);
    out.before = noise_.phi == 0.0 && of_base.noise.phi == 0.0
                     ? rescaled(of_base.left, of_base.noise, noise_)
                     : leftover(atoms, nothing, structures_, noise_);
    const bool same = out.found.ids(atoms) == first.ids(atoms);
    if (out.found.members.empty())
      out.after = out.before;
    else
      out.after = same ? judged.left : leftover(atoms, out.found.remainder, structures_, noise_);
    out.rss_after = out.found.remainder.rss();
    out.dof_after = atoms.base().dof() - static_cast<double>(out.found.remainder.basis.cols());
    if (out.found.members.size() > 1 || (out.found.members.size() == 1 && is_rest(out)))
      put_into_model(atoms, out);
    return out;
  }
  // A period that the positions cannot tell from a smooth error is not what is named: of the two the smooth
  // one is what machines have, and between the positions the wave makes it worse.
  void leave_out_smooth_waves(const Atoms& atoms, Outcome& out) const {
    std::vector<Atom> rest;
    Families waves;
    for (std::size_t m = 0; m < out.found.members.size(); ++m) {
      const Atom& atom = out.found.members[m];
      if (may_be_smooth(atoms, out.found, m, noise_.variance))
        waves.insert(atom.family);
      else
        rest.push_back(atom);
    }
    if (waves.empty()) return;
    std::erase_if(out.rivals, [&](const EffectSet& rival) {
      return std::any_of(rival.members.begin(), rival.members.end(),
                         [&](const Atom& atom) { return waves.contains(atom.family); });
    });
    if (!rest.empty()) {
      out.found = search_->evaluated(std::move(rest));
    } else {
      out.found = {};
      out.rivals.clear();
      out.found.remainder = atoms.remainder({});
    }
  }
  MatrixXd surrogate_for(const FitCore& base) const {
    const auto room = static_cast<Eigen::Index>(std::clamp(base.dof() / 5.0, 0.0, kMostSurrogate));
    return smooth_surrogate(structures_.blocks, base, room);
  }
  bool is_rest(const Outcome& x) const {
    return x.after.found(level()) ||
           (x.rss_after > kHighChi2 * x.dof_after && chi2_is_off(x.rss_after, x.dof_after));
  }

  // The few that do nearly all that the set does, and do it far above the noise; the largest first.
  std::vector<Atom> far_ahead(const Atoms& atoms, const EffectSet& set) const {
    const auto gained = [&](std::vector<Atom> members) {
      return base_rss(atoms) - search_->evaluated(std::move(members)).rss;
    };
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t k = 0; k < set.members.size(); ++k) order.emplace_back(-gained({set.members[k]}), k);
    std::sort(order.begin(), order.end());
    std::vector<Atom> out;
    for (const auto& [drop, k] : order) {
      out.push_back(set.members[k]);
      const double all = gained(out);
      if (all < kFarAboveNoise * noise_.variance) return {};
      if (all > kShareOfLarge * (base_rss(atoms) - set.rss)) return out;
    }
    return out;
  }
  // The search is linear in each effect. A large one turns and moves what the others do, and what that leaves
  // is of second order, but above the noise: it would pass for an effect. So the large ones are fitted as
  // they are, and what stands beside them is sought in what they leave then.
  void put_into_model(const Atoms& atoms, Outcome& out) {
    EffectSet large;
    large.members = far_ahead(atoms, out.found);
    if (large.members.empty()) return;
    std::vector<bool> flags = atoms.base().whitening->noise().used;
    flags.flip();
    const FitCore exact = fit_core(o_, with(atoms, large), {.robust = false}, flags);
    const Atoms beside(o_, exact, library_);
    structures_.fit_to(exact);
    const MatrixXd surrogate = surrogate_for(exact);
    const auto judge_beside = [&](const Remainder& left) {
      return judge(beside, left, structures_, surrogate, options_.seed);
    };
    Judgement judged = judge_beside(beside.remainder({}));
    // A further large effect would pass for noise until it is found, too.
    NoiseScale noise = judged.noise.variance < noise_.variance ? judged.noise : noise_;
    const auto search_beside = [&] {
      return Search(beside, multiplicity_, noise, level(), options_.max_effects - large.members.size());
    };
    EffectSet more = search_beside().best();
    std::vector<EffectSet> others;
    if (!more.members.empty()) {
      judged = judge_beside(more.remainder);
      noise = judged.noise;
      Search search = search_beside();
      more = search.best();
      if (!more.members.empty()) others = search.alternatives(more);
    }
    // Twice the same effect is none: two steps follow whatever rises and falls.
    const auto repeats = [&](const EffectSet& set) {
      return std::any_of(set.members.begin(), set.members.end(), [&](const Atom& atom) {
        return std::any_of(large.members.begin(), large.members.end(),
                           [&](const Atom& other) { return other.family == atom.family; });
      });
    };
    std::erase_if(others, repeats);
    if (!repeats(more) && more.remainder.rss() + kClearlyLess < out.rss_after) {
      if (noise_.phi == 0.0 && judged.noise.phi == 0.0)
        out.before = rescaled(std::move(out.before), noise_, judged.noise);
      noise_ = out.noise = judged.noise;
      out.after = leftover(beside, more.remainder, structures_, noise_);
      out.rss_after = more.remainder.rss();
      out.dof_after = exact.dof() - static_cast<double>(more.remainder.basis.cols());
      // Against this noise the other sets are others, too.
      search_ = std::make_unique<Search>(atoms, multiplicity_, noise_, level(), options_.max_effects);
      search_->best();
      large = search_->evaluated(large.members);
      out.rivals = search_->alternatives(large);
      const double before = large.rss / noise_.variance;
      out.found = together(atoms, large, more, before);
      for (EffectSet& rival : out.rivals) rival = together(atoms, rival, more, before);
      for (const EffectSet& other : others) out.rivals.push_back(together(atoms, large, other, before));
      std::sort(out.rivals.begin(), out.rivals.end(),
                [](const EffectSet& a, const EffectSet& b) { return a.criterion < b.criterion; });
    }
    structures_.fit_to(atoms.base());
  }
  // Large effects, and small ones beside them in what the large ones found leave as they are, not in what a
  // linear search leaves of them (`before`, noise units).
  static EffectSet together(const Atoms& atoms, EffectSet large, const EffectSet& small, double before) {
    for (const Atom& atom : small.members)
      large.members.push_back(atoms.make_atom(atom.family, atom.variant, atom.shape));
    large.drop.insert(large.drop.end(), small.drop.begin(), small.drop.end());
    large.rank.insert(large.rank.end(), small.rank.begin(), small.rank.end());
    large.p.insert(large.p.end(), small.p.begin(), small.p.end());
    large.criterion += small.criterion - before;
    large.rss = small.rss;
    return large;
  }

  struct Beside {
    EffectSet set;
    Judgement judged;
  };
  // The set beside which the noise is judged. What the surrogate cannot follow looks like scatter that is
  // large and correlated in time, and against such scatter nothing is significant. So where the scatter is
  // not as stated, the sets that are clear against the stated uncertainty are an explanation too: the
  // likelier of the two stands.
  Beside beside_what(const Atoms& atoms, const Judgement& of_base, const MatrixXd& surrogate) {
    const auto by = [&](const NoiseScale& noise) {
      Beside out{Search(atoms, multiplicity_, noise, kLooseAlpha, options_.max_effects).best(), of_base};
      if (!out.set.members.empty())
        out.judged = judge(atoms, out.set.remainder, structures_, surrogate, options_.seed);
      return out;
    };
    Beside by_scatter = by(of_base.noise);
    if (as_stated(by_scatter.judged.noise)) return by_scatter;
    NoiseScale stated;
    stated.dof = kStatedDof;
    Beside by_statement = by(stated);
    // Of few readings beside a base that misfits the correlation is that of what is missing.
    if (atoms.base().dof() < kFewDof && !by_statement.set.members.empty() &&
        as_stated(by_statement.judged.noise) && leaves_noise(by_statement.set, atoms.base().dof()))
      return by_statement;
    const auto cost = [&](const Beside& b) {
      return surprise(b.judged.noise, atoms.base().dof()) +
             2.0 * std::log(multiplicity_.families) * static_cast<double>(b.set.members.size());
    };
    return cost(by_statement) + kAsSimple < cost(by_scatter) ? by_statement : by_scatter;
  }
  // By itself, and with few enough parameters that scatter alone could not be followed so far.
  static bool leaves_noise(const EffectSet& set, double dof) {
    const auto columns = static_cast<double>(set.columns());
    return kReadingsEach * columns <= dof && set.rss <= kHighChi2 * (dof - columns);
  }
  static bool as_stated(const NoiseScale& noise) {
    return noise.phi == 0.0 && noise.raw_variance <= kHighChi2;
  }
  // Bayesian information criterion of readings whose noise is AR(1) of this variance and correlation, beside
  // as many columns as it has lost degrees of freedom. Scatter below the stated uncertainty is no merit.
  static double surprise(const NoiseScale& noise, double dof) {
    double steps = 0.0;
    for (const auto& s : noise.sequences) steps += s.empty() ? 0.0 : static_cast<double>(s.size() - 1);
    return dof * std::log(std::max(noise.raw_variance, 1.0)) +
           std::min(steps, dof) * std::log(1.0 - noise.phi * noise.phi) + (dof - noise.dof) * std::log(dof);
  }

  Model with(const Atoms& atoms, const EffectSet& set) const {
    Model out = model_;
    for (const Atom& atom : set.members) {
      ModelEffect effect = model_effect(atoms.library()[atom.family].variants[atom.variant]);
      // Linear ones start at 0: where the runs leave a combination open, the score's estimate of it is far
      // out.
      const std::size_t linear = effect.effect->info().linear_count();
      for (std::size_t k = 0; k < effect.parameters.size(); ++k) {
        effect.parameters[k].value = k < linear ? 0.0 : atom.shape[k - linear];
        effect.parameters[k].given = true;
      }
      out.effects.push_back(std::move(effect));
    }
    return out;
  }
  std::vector<bool> outliers_beside(const Atoms& atoms, const EffectSet& set) const {
    return find_outliers(o_, fit_core(o_, with(atoms, set), {.robust = false}));
  }

  void look_at_scatter(const Atoms& atoms, const EffectSet& found) {
    const FitCore all = fit_core(o_, with(atoms, found), {.robust = false});
    scatter_ = uneven_scatter(o_, all, surrogate_for(all));
  }

  // Readings that stand out together are no outliers: they are neighbours and stand out to the same side, or
  // one function of the state explains most of what they are off by.
  bool structured(const Atoms& atoms, const EffectSet& set, const std::vector<bool>& flags) {
    const auto far = std::count(flags.begin(), flags.end(), true);
    if (far < 2) return false;
    const FitCore all = fit_core(o_, with(atoms, set), {.robust = false});
    if (company(o_, flags, all.white) > kInCompany) return true;
    if (far < kFewestTogether) return false;
    return structures_.twists.common_cause(all).has_value();
  }

  void fill(Diagnosis& d, const Atoms& atoms, const Outcome& x) {
    const FitCore& base = atoms.base();
    d.chi2 = base.chi2();
    d.dof = base.dof();
    d.scatter.autocorrelation = x.noise.phi;
    d.scatter.factor = std::sqrt(x.noise.raw_variance);
    d.null_directions = open_directions(o_, base);
    d.base = fit(*whole_, model_);
    sizes(d, base, x.noise);
    d.depends_on = dependences(x.before);
    d.leftover = dependences(x.after);
    d.ranking = ranking(atoms, *search_, noise_, x.found, level());
    const std::vector<EffectSet> other_numbers = find_numbers(d, atoms, x.found);
    decide(d, atoms, x);
    find_agreed(d, atoms, x);
    d.rows.problems = row_problems(*whole_);
    std::optional<FitCore> whole;
    if (!d.effects.empty()) whole = refit(d, atoms, x.found);
    const bool number_open = d.number_is_open();
    if (options_.plan &&
        (d.verdict == Verdict::ambiguous || d.verdict == Verdict::not_testable || number_open)) {
      std::vector<EffectSet> others = x.rivals;
      if (number_open) others.insert(others.end(), other_numbers.begin(), other_numbers.end());
      d.next = next_measurement(atoms, x.found, others, noise_);
    }
    if (options_.plan && !d.next && d.verdict != Verdict::data_problem &&
        d.verdict != Verdict::not_in_library && !d.null_directions.empty())
      d.next = next_for_open_parameters(o_, whole ? *whole : base);
    if (d.paragraph.empty()) d.paragraph = paragraph(d, atoms, x.found);
    if (!d.effects.empty() && one_function(x, atoms) == OneFunction::as_good)
      d.paragraph += one_function_text(d);
  }

  // Each covariate once, with its smallest p-value.
  std::vector<Dependence> dependences(const Leftover& tests) const {
    constexpr std::size_t kMost = 8;
    std::vector<Dependence> out;
    for (const auto& t : tests.tests) {
      if (!(t.p < options_.alpha) || out.size() == kMost) break;
      if (std::none_of(out.begin(), out.end(),
                       [&](const Dependence& e) { return e.covariate == t.covariate; }))
        out.push_back({t.covariate, t.p});
    }
    return out;
  }

  // Of single readings, also where they were taken together.
  void sizes(Diagnosis& d, const FitCore& base, const NoiseScale& noise) const {
    std::vector<bool> used = base.whitening->noise().used;
    VectorXd residual, u;
    if (condensed_ == whole_) {
      residual = plain_residual(o_, base);
      u = base.whitening->noise().u;
    } else {
      used = d.base.outlier;
      used.flip();
      residual = Eigen::Map<const VectorXd>(d.base.residual.data(), whole_->size());
      u = stated_noise(*whole_, 0.0, 0.0).u;
      d.chi2 = d.base.chi2;
      d.dof = d.base.dof;
    }
    d.outliers = static_cast<std::size_t>(std::count(used.begin(), used.end(), false));
    const SizeByQuantity rms = size_by_quantity(o_.data(), residual, used);
    const SizeByQuantity floor = size_by_quantity(o_.data(), u, used);
    d.rms_um = rms.um;
    d.rms_urad = rms.urad;
    d.noise_floor_um = floor.um * std::sqrt(noise.variance);
    d.noise_floor_urad = floor.urad * std::sqrt(noise.variance);
  }

  static double chi2_p(double chi2, double dof) {
    const double tail = chi2_tail(chi2, dof);
    return 2.0 * std::min(tail, 1.0 - tail);
  }
  bool chi2_is_off(double chi2, double dof) const {
    if (dof < 1.0) return false;
    const double reduced = chi2 / dof;
    if (reduced >= kLowChi2 && reduced <= kHighChi2) return false;
    return chi2_p(chi2, dof) < kChi2Level;
  }

  static bool something_is_wrong(const Diagnosis& d) {
    return !d.rows.contradicted && d.verdict != Verdict::nothing_to_find &&
           d.verdict != Verdict::not_testable;
  }

  // Whether any effect of the machine's geometry or motion can be seen at all; those of time and set-up
  // always can.
  bool testable(const Diagnosis& d) const {
    if (d.dof < kFewestDof) return false;
    for (const RankedEffect& r : d.ranking) {
      const auto family = std::find_if(library_.begin(), library_.end(),
                                       [&](const EffectFamily& f) { return f.id() == r.id; });
      if (family == library_.end()) continue;
      const EffectClass kind = family->info().kind;
      if (r.excited && (kind == EffectClass::geometric || kind == EffectClass::dynamic)) return true;
    }
    return false;
  }

  // A period that is none of the known ones of the screw is sure, but what turns with it is not known.
  bool unknown_period(const Atoms& atoms, const EffectSet& set) const {
    return std::any_of(set.members.begin(), set.members.end(), [&](const Atom& atom) {
      const auto& info = atoms.effect(atom).info();
      if (!info.id.starts_with("periodic:")) return false;
      const auto& known = info.parameters.back().candidates;
      return !known.empty() && std::none_of(known.begin(), known.end(),
                                            [&](double c) { return std::abs(c - atom.shape[0]) < 1e-9 * c; });
    });
  }

  // Where the positions that were read cannot tell how often an effect repeats: the other numbers, or
  // periods, into `d`, and the sets with them, of each effect the first few.
  std::vector<EffectSet> find_numbers(Diagnosis& d, const Atoms& atoms, const EffectSet& found) const {
    constexpr std::size_t kMost = 4;
    std::vector<EffectSet> out;
    for (std::size_t m = 0; m < found.members.size() && m < d.ranking.size(); ++m) {
      std::vector<double> numbers = numbers_alike(atoms, found, m, noise_.variance);
      if (numbers.empty()) numbers = periods_alike(atoms, found, m, noise_.variance);
      for (std::size_t k = 0; k < std::min(numbers.size(), kMost); ++k)
        out.push_back(with_number(atoms, found, m, numbers[k]));
      if (!numbers.empty()) d.ranking[m].parameters.back().also = std::move(numbers);
    }
    return out;
  }

  // Which members of what was found are sure in each of the sets, and do the same to the readings there.
  void find_agreed(Diagnosis& d, const Atoms& atoms, const Outcome& x) const {
    constexpr double kAlike = 0.1;    // of what it does to the readings
    constexpr double kSure = 1e-6;    // its p-value beside the others
    constexpr double kEvident = 0.1;  // share of chi-square that the set takes and it takes alone
    if (x.rivals.empty()) return;
    const auto does = [&](const EffectSet& set, std::size_t family, std::size_t variant) {
      const auto own = std::find_if(set.members.begin(), set.members.end(), [&](const Atom& atom) {
        return atom.family == family && atom.variant == variant;
      });
      if (own == set.members.end()) return VectorXd();
      const auto m = static_cast<std::size_t>(own - set.members.begin());
      const bool evident = set.drop[m] * noise_.variance > kEvident * (base_rss(atoms) - set.rss);
      if (!(set.p[m] < kSure) || !evident) return VectorXd();
      const std::vector<double> values = estimate(atoms, set.members).values[m];
      const VectorXd linear =
          Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
      return VectorXd(own->U().cast<double>() * (own->to_columns * linear));
    };
    for (std::size_t m = 0; m < x.found.members.size() && m < d.ranking.size(); ++m) {
      const Atom& atom = x.found.members[m];
      const VectorXd here = does(x.found, atom.family, atom.variant);
      d.ranking[m].same_in_all =
          here.size() > 0 && std::all_of(x.rivals.begin(), x.rivals.end(), [&](const EffectSet& set) {
            const VectorXd there = does(set, atom.family, atom.variant);
            return there.size() > 0 && (there - here).norm() < kAlike * here.norm();
          });
    }
  }

  // Rounding is the same wherever a position is measured again, and looks like structure: where no more than
  // that is left, these readings show nothing.
  bool only_rounding(const Diagnosis& d) const {
    constexpr double kNoMore = 1.2;
    const auto rounded = [&](Quantity quantity, double rms) {
      const double step =
          resolution(*whole_, quantity) / (quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad);
      return std::isnan(rms) || rms <= kNoMore * step / std::sqrt(12.0);
    };
    return rounded(Quantity::displacement, d.rms_um) && rounded(Quantity::rotation, d.rms_urad);
  }

  void decide(Diagnosis& d, const Atoms& atoms, const Outcome& x) {
    if (const std::string wrong = contradiction(*whole_); !wrong.empty()) {
      d.verdict = Verdict::data_problem;
      d.confidence = 0.99;
      d.rows.contradicted = true;
      d.paragraph = "The rows contradict themselves: " + wrong + ". Correct the file first.";
      return;
    }
    if (only_rounding(d)) {
      d.verdict = testable(d) ? Verdict::nothing_to_find : Verdict::not_testable;
      d.only_rounding = true;
      d.confidence = kOfRounding;
      return;
    }
    const double gained = (base_rss(atoms) - x.rss_after) / noise_.variance;
    double left = 0.0;
    for (const auto& t : x.after.tests)
      if (t.p < level()) left = std::max(left, t.drop - static_cast<double>(t.rank));
    d.explained = gained > 0.0 ? gained / (gained + left) : 0.0;
    if (x.found.members.empty()) return decide_without_effect(d, x);
    const bool rest = is_rest(x);
    if (rest && d.explained < kMostlyExplained) {
      d.verdict = Verdict::not_in_library;
      d.confidence = 0.97;
      return;
    }
    const OneFunction function = one_function(x, atoms);
    if (function == OneFunction::better) {
      d.verdict = Verdict::not_in_library;
      d.imitators = x.found.ids(atoms);
      d.confidence = 0.97;
      return;
    }
    d.effects = x.found.ids(atoms);
    d.sets = {d.effects};
    d.confidence = posterior(x);
    for (const EffectSet& set : x.rivals) d.sets.push_back(set.ids(atoms));
    if (rest || (x.rivals.empty() && (unknown_period(atoms, x.found) || d.number_is_open()))) {
      d.verdict = Verdict::named_but_incomplete;
      d.confidence = x.rivals.empty() ? std::min(d.confidence, 0.97) : kAmongSets;
    } else if (!x.rivals.empty()) {
      d.verdict = Verdict::ambiguous;
      d.confidence = kAmongSets;
    } else if (function == OneFunction::as_good) {
      d.verdict = Verdict::ambiguous;
    } else {
      d.verdict = Verdict::named;
      if (x.after.p < kHardlyNoise) d.confidence *= 0.93;  // the rest is hardly noise
    }
    if (function == OneFunction::as_good) d.confidence = std::min(d.confidence, kBesideOneFunction);
    if (x.rivals.empty()) refuse_harm(d, atoms, x);
  }

  // What one run says of the set must not be wrong in another.
  void refuse_harm(Diagnosis& d, const Atoms& atoms, const Outcome& x) const {
    const double scatter = x.rss_after / std::max(x.dof_after, 1.0);
    const auto harm = held_out_harm(atoms, x.found.members, std::max({1.0, noise_.variance, scatter}));
    if (!harm) return;
    d.harm =
        HeldOutHarm{o_.data().context.runs[harm->run].id, d.effects, harm->chi2_before, harm->chi2_after};
    d.verdict = Verdict::not_in_library;
    d.confidence = kOfHarm;
    d.effects.clear();
    d.sets.clear();
  }

  // One function of the state that does what two effects or more are needed for: they imitate it, or it
  // imitates them.
  enum class OneFunction { worse, as_good, better };
  OneFunction one_function(const Outcome& x, const Atoms& atoms) const {
    if (x.found.members.size() < 2) return OneFunction::worse;
    double best = INFINITY;
    for (const auto& t : x.before.tests) {
      if (t.neighbours || t.rank == 0) continue;
      best = std::min(best, occam(t.drop, static_cast<double>(t.rank)) - t.drop);
    }
    best += base_rss(atoms) / noise_.variance + 2.0 * std::log(x.before.tried);
    const double ahead = x.found.criterion - best;
    if (x.after.p < kHardlyNoise) return ahead > -kAsSimple ? OneFunction::better : OneFunction::worse;
    if (ahead > kKnownPhysics) return OneFunction::better;
    return ahead > 0.0 ? OneFunction::as_good : OneFunction::worse;
  }

  void decide_without_effect(Diagnosis& d, const Outcome& x) const {
    if (x.before.found(level())) {
      d.verdict = Verdict::not_in_library;
      d.confidence = x.before.p < 1e-4 ? 0.98 : 0.85;
    } else if (chi2_is_off(d.chi2, d.dof)) {
      d.verdict = Verdict::data_problem;
      d.confidence = 0.97;
    } else if (!testable(d)) {
      d.verdict = Verdict::not_testable;
      d.confidence = 0.95;
    } else {
      d.verdict = Verdict::nothing_to_find;
      double smallest = x.before.p;
      for (const RankedEffect& r : d.ranking) smallest = std::min(smallest, r.p_value);
      // A residual that is hardly the stated noise is one more test.
      smallest = std::min(smallest, kUneasy * chi2_p(d.chi2, d.dof));
      d.confidence = smallest > 0.2 ? 0.985 : smallest > 0.05 ? 0.95 : 0.85;
    }
  }

  static double base_rss(const Atoms& atoms) { return atoms.base().white.squaredNorm(); }
  double posterior(const Outcome& x) const {
    double others = 0.0;
    for (const EffectSet& set : x.rivals) others += std::exp(-0.5 * (set.criterion - x.found.criterion));
    double wrong = 0.0;
    for (const double p : x.found.p) wrong += p;
    return std::clamp(0.985 / (1.0 + others) * (1.0 - std::min(wrong, 0.5)), 0.01, 0.99);
  }

  // Parameters of the exact model, with everything free, into `d`; what the readings alone say of them.
  FitCore refit(Diagnosis& d, const Atoms& atoms, const EffectSet& found) const {
    std::vector<bool> flags = atoms.base().whitening->noise().used;
    flags.flip();
    const Model start = with(atoms, found);
    FitCore own = fit_core(o_, start, {.robust = false}, flags);
    d.null_directions = open_directions(o_, own);
    const SizedFit sized = with_usual_sizes(o_, start, own);
    const FitCore& all = sized.core;
    for (std::size_t m = 0; m < found.members.size(); ++m) {
      const std::size_t e = model_.effects.size() + m;
      ModelEffect effect = all.model.effects[e];
      for (std::size_t k = 0; k < all.free.size(); ++k) {
        if (all.free[k].effect != e) continue;
        const auto i = static_cast<Eigen::Index>(k);
        ParameterValue& p = effect.parameters[all.free[k].index];
        p.prior = false;
        p.sigma = own.determined[k] ? std::optional(std::sqrt(all.covariance(i, i)) * sized.sigma_factor)
                                    : std::nullopt;
      }
      // That of one of several periods says nothing of the others.
      if (m < d.ranking.size() && d.ranking[m].number_is_open()) effect.parameters.back().sigma.reset();
      for (std::size_t k = 0; m < d.ranking.size() && k < d.ranking[m].parameters.size(); ++k) {
        const double unit = unit_factor(effect.effect->info().parameters[k].unit);
        d.ranking[m].parameters[k].value = effect.parameters[k].value / unit;
        const auto& sigma = effect.parameters[k].sigma;
        d.ranking[m].parameters[k].sigma = sigma ? std::optional(*sigma / unit) : std::nullopt;
      }
      d.additions.push_back(std::move(effect));
    }
    return own;
  }

  std::shared_ptr<const Observations> whole_, condensed_;  // the same where readings are few
  const Observations& o_;
  const Model& model_;
  DiagnoseOptions options_;
  std::vector<EffectFamily> library_;
  Structures structures_;
  Atoms::Multiplicity multiplicity_;
  NoiseScale noise_;
  std::unique_ptr<Search> search_;
  bool keep_all_ = false;  // no reading is an outlier
  std::vector<bool> left_out_;
  RunFactors run_factors_;
  std::optional<UnevenScatter> scatter_;
};

}  // namespace

namespace {

void forget_effects(Diagnosis& d) {
  d.effects.clear();
  d.sets.clear();
  d.additions.clear();
  d.imitators.clear();
  d.harm.reset();
  d.next.reset();
}

// Rows that cannot be right: nothing is said of the machine before they are.
void blame_rows(Diagnosis& d) {
  forget_effects(d);
  d.verdict = Verdict::data_problem;
  d.confidence = kOfConvention;
  d.paragraph = "Rows of the measurement file cannot be right: ";
  for (std::size_t k = 0; k < d.rows.problems.size(); ++k) {
    if (k > 0) d.paragraph += "; ";
    d.paragraph += d.rows.problems[k];
  }
  d.paragraph += ". Correct or leave out these rows, then diagnose again.";
}

double parameters_of(const std::vector<ModelEffect>& effects) {
  double out = 0.0;
  for (const ModelEffect& effect : effects) out += static_cast<double>(effect.parameters.size());
  return out;
}

// A formula does as much without the effects as beside them: it is not they that are missing.
bool is_superfluous(const Diagnosis& d, const ProposedFormula& beside, const ProposedFormula& alone) {
  constexpr double kNoMore = 10.0;  // of chi-square, beyond what their parameters pay
  const double parameters = parameters_of(d.additions);
  return alone.terms <= beside.terms && alone.chi2_after <= beside.chi2_after + 2.0 * parameters + kNoMore;
}

// Smooth functions of positions follow an error of a part of the travel well enough to be significant, and
// drifts one that acts above a temperature. What begins while something rises for the only time begins at a
// moment, too: a `step`. Effects of one parameter, and of motion, are too stiff; tilts of the set-ups are of
// whole runs, and most of their many parameters do nothing.
bool could_imitate_a_part(const Diagnosis& d) {
  return !d.additions.empty() &&
         std::all_of(d.additions.begin(), d.additions.end(), [](const ModelEffect& e) {
           const EffectInfo& info = e.effect->info();
           const bool of_whole_runs = info.kind == EffectClass::setup && info.shape_count() == 0;
           return info.kind != EffectClass::dynamic && !of_whole_runs && info.parameters.size() > 1;
         });
}

// That a ball would stand still is all that speaks for a mistake in the positions of one run.
bool readings_say_nothing(const Bookkeeping& said) {
  return said.convention.run && said.chi2_after > said.chi2_before - kThousandToOne;
}

void nothing_but(Diagnosis& d, ProposedFormula formula) {
  const std::vector<std::string> imitators = d.effects;
  forget_effects(d);
  d.verdict = Verdict::not_in_library;
  d.imitators = imitators;
  d.formula = std::move(formula);
  d.leftover = d.depends_on;
  d.paragraph = imitated_text(d);
}

// A formula follows the readings clearly nearer than the convention that is said of the files, which is no
// mistake of theirs then: an error that the library lacks is imitated by positions that stand in other
// columns.
bool is_rather_a_function(const Machine& machine, const Dataset& data, const std::vector<bool>& left_out,
                          const Diagnosis& d) {
  constexpr double kNearer = 1.1;  // chi-square per degree of what the convention leaves over the formula's
  if (d.bookkeeping.empty() || d.verdict != Verdict::not_in_library || d.harm) return false;
  const auto formula = propose_formula(machine, data, d.base.model, left_out);
  const Bookkeeping& said = d.bookkeeping.front();
  return formula && kNearer * formula->chi2_after * said.dof < said.chi2_after * formula->dof_after;
}

bool in_each(const std::vector<std::vector<std::string>>& sets, const std::string& id) {
  return std::all_of(sets.begin(), sets.end(), [&](const std::vector<std::string>& set) {
    return std::find(set.begin(), set.end(), id) != set.end();
  });
}

// Effects that did a part of what the formula does are not missing. Where sets could not be told apart, none
// is taken away, since what the others of a set stand for is open; unless the formula leaves only noise
// beside what is in each of them.
void name_fewer(const Machine& machine, const Dataset& data, const std::vector<bool>& left_out,
                Diagnosis& d) {
  if (d.additions.size() < 2 || (!left_out.empty() && left_out.size() != data.readings.size())) return;
  const bool one_set = d.sets.size() < 2;
  const Observations o(machine, data);
  std::vector<ModelEffect> needed =
      needed_beside(o, d.base.model, d.additions, d.formula->alone.effects, left_out);
  if (needed.empty() || needed.size() == d.additions.size()) return;
  if (!one_set && !std::all_of(needed.begin(), needed.end(),
                               [&](const ModelEffect& effect) { return in_each(d.sets, effect.id()); }))
    return;
  Model known = d.base.model;
  known.effects.insert(known.effects.end(), needed.begin(), needed.end());
  auto again = propose_formula(machine, data, known, left_out);
  // What is left out pays for itself, as in `needed_beside`.
  const double pays = std::log(static_cast<double>(data.readings.size())) *
                      (parameters_of(d.additions) - parameters_of(needed));
  if (!again || again->chi2_after > d.formula->chi2_after + pays + kThousandToOne) return;
  if (!one_set && again->chi2_after > kNoiseBeside * again->dof_after) return;
  const std::vector<std::string> before = std::exchange(d.effects, {});
  const auto first = static_cast<std::ptrdiff_t>(d.base.model.effects.size());
  known.effects.insert(known.effects.end(), again->alone.effects.begin(), again->alone.effects.end());
  const std::vector<ModelEffect> fitted = fit_core(o, known, {.robust = false}, left_out).model.effects;
  d.additions.assign(fitted.begin() + first,
                     fitted.begin() + first + static_cast<std::ptrdiff_t>(needed.size()));
  for (const ModelEffect& effect : d.additions) d.effects.push_back(effect.id());
  d.imitators.clear();
  for (const std::string& id : before)
    if (std::find(d.effects.begin(), d.effects.end(), id) == d.effects.end()) d.imitators.push_back(id);
  d.sets = {d.effects};
  d.formula = std::move(again);
  d.confidence = std::min(d.confidence, kBesideAFormula);
  d.paragraph = fewer_text(d);
}

// Effects were named beside which the rest passed for noise, but is more than that: one of them may follow a
// part of an error that the library lacks.
bool leaves_more_than_noise(const Machine& machine, const Dataset& data, const std::vector<bool>& left_out,
                            const Diagnosis& d) {
  const bool sets = d.verdict == Verdict::ambiguous && d.sets.size() > 1 && !d.formula;
  if ((d.verdict != Verdict::named && !sets) || d.additions.size() < 2 ||
      (!left_out.empty() && left_out.size() != data.readings.size()))
    return false;
  const Observations o(machine, data);
  Model known = d.base.model;
  known.effects.insert(known.effects.end(), d.additions.begin(), d.additions.end());
  const FitCore core = fit_core(o, known, {.robust = false}, left_out);
  return chi2_tail(core.chi2(), core.dof()) < kUneasyRest;
}

// What follows the errors that the named effects leave, or all of them where none is named.
void propose(const Machine& machine, const Dataset& data, const std::vector<bool>& left_out, Diagnosis& d) {
  const bool none = d.verdict == Verdict::not_in_library && !d.harm;
  if (could_imitate_a_part(d)) {
    auto part = propose_part(machine, data, d.base.model, left_out,
                             {d.additions, static_cast<double>(std::max<std::size_t>(d.ranking.size(), 1))});
    if (part && part->ahead > kPartInstead) {
      nothing_but(d, std::move(*part));
      d.paragraph += formula_text(*d.formula);
      return;
    }
    if (part) {
      d.formula = std::move(part);
      if (d.verdict == Verdict::named) d.verdict = Verdict::ambiguous;
      d.confidence = std::min(d.confidence, kBesideAPart);
      d.paragraph =
          kTwoExplanations + d.paragraph +
          " Or no such effect is missing, but an error that acts in a part only, and these readings "
          "hardly tell the two apart: read more positions at the ends of that part." +
          formula_text(*d.formula);
      return;
    }
  }
  const bool uneasy = leaves_more_than_noise(machine, data, left_out, d);
  if (!none && !uneasy && d.verdict != Verdict::named_but_incomplete) return;
  Model known = d.base.model;
  known.effects.insert(known.effects.end(), d.additions.begin(), d.additions.end());
  d.formula = propose_formula(machine, data, known, left_out);
  if (!d.formula) return;
  if (!none) {
    const auto alone = propose_formula(machine, data, d.base.model, left_out);
    if (alone && is_superfluous(d, *d.formula, *alone))
      nothing_but(d, *alone);
    else
      name_fewer(machine, data, left_out, d);
  }
  if (uneasy && (d.verdict == Verdict::named || d.verdict == Verdict::ambiguous)) {
    // Where each effect is needed the formula follows what chance makes of the noise.
    if (d.imitators.empty()) {
      d.formula.reset();
      return;
    }
    d.verdict = Verdict::named_but_incomplete;
    d.next.reset();  // was to tell sets apart
  }
  d.paragraph += formula_text(*d.formula);
}

// What the model has with all its linear parameters free is fitted already: such an effect at another period
// is not the one that is missing. Where a parameter is held, what it is held at may be what is wrong.
void leave_out_given(std::vector<EffectFamily>& library, const Model& model) {
  const auto given = [&](const std::shared_ptr<const Effect>& one) {
    const ModelEffect* known = find_effect(model, one->info());
    if (known == nullptr) return false;
    const auto linear = static_cast<std::ptrdiff_t>(one->info().linear_count());
    return linear > 0 && std::none_of(known->parameters.begin(), known->parameters.begin() + linear,
                                      [](const ParameterValue& p) { return p.fixed; });
  };
  for (EffectFamily& family : library) std::erase_if(family.variants, given);
  std::erase_if(library, [](const EffectFamily& family) { return family.variants.empty(); });
}

}  // namespace

Diagnosis diagnose(const Machine& machine, const Dataset& data, const Model& given,
                   const DiagnoseOptions& options, const std::vector<EffectFamily>& extra) {
  const auto engine = [&](std::shared_ptr<const Observations> all, const Model& known,
                          const DiagnoseOptions& how) {
    std::vector<EffectFamily> library = effect_library(all->machine(), all->data().context);
    library.insert(library.end(), extra.begin(), extra.end());
    leave_out_given(library, known);
    return Engine(std::move(all), known, how, std::move(library));
  };
  const auto whole = std::make_shared<const Observations>(machine, data);
  const Model model = with_best_variants(*whole, given);
  Engine first = engine(whole, model, options);
  Diagnosis out = first.run();
  if (!options.conventions || out.rows.contradicted) return out;
  DiagnoseOptions quick = options;
  quick.plan = quick.formula = quick.conventions = quick.weigh = false;
  const EffectSearch search = [&](const Machine& m, const Dataset& d, const Model& known) {
    return engine(std::make_shared<const Observations>(m, d), known, quick).run();
  };
  WrongConventions wrong = wrong_conventions(*whole, model, out, first.of_runs(), search);
  out.bookkeeping = std::move(wrong.likely);
  if (wrong.sure && !wrong.proved && options.formula &&
      is_rather_a_function(machine, data, first.left_out(), out))
    out.bookkeeping.clear();
  if (!out.bookkeeping.empty() && !wrong.sure) {
    // Neither is compensated before somebody has looked.
    out.verdict = Verdict::ambiguous;
    out.confidence = kAmongSets;
    out.paragraph = either_text(out) + " " + out.paragraph;
    return out;
  }
  if (out.bookkeeping.empty() && first.scatter()) {
    DiagnoseOptions once = options;
    once.weigh = false;
    out = diagnose(machine, weighed(data, *first.scatter()), given, once, extra);
    out.scatter.uneven = first.scatter();
    // What scatters may be an error that goes up and down between the places that were read.
    const bool sure =
        !out.effects.empty() && !out.ranking.empty() && out.ranking.front().p_value < kSureBesideWeights;
    if (!sure && out.verdict != Verdict::data_problem) out.confidence = std::min(out.confidence, kOfUneven);
    out.paragraph += uneven_text(*out.scatter.uneven);
    return out;
  }
  if (out.bookkeeping.empty()) {
    if (!out.rows.problems.empty()) blame_rows(out);
    if (options.formula) propose(machine, data, first.left_out(), out);
    blame_odd_runs(*whole, model, first.left_out(), out, search);
    doubt_beside_unrecorded(*whole, model, first.left_out(), out);
    if (const std::string wanders = wandering_text(machine, data); !wanders.empty()) {
      out.confidence = std::min(out.confidence, kBesideAWanderingBall);
      out.paragraph = wanders + " " + out.paragraph;
    }
    if (out.verdict != Verdict::nothing_to_find) out.paragraph += constant_sensors_text(*whole);
    return out;
  }
  out.verdict = Verdict::bookkeeping;
  out.confidence = out.bookkeeping.size() == 1 ? kOfConvention : kAmongSets;
  const bool positions_alone = wrong.proved && readings_say_nothing(out.bookkeeping.front());
  if (positions_alone) out.confidence = std::min(out.confidence, kOfPositionsAlone);
  forget_effects(out);
  out.paragraph = bookkeeping_text(out.bookkeeping);
  if (positions_alone)
    out.paragraph +=
        " The readings fit either way: if that run followed no ball, but a point that was led about on the "
        "part on purpose, its positions are right.";
  return out;
}

}  // namespace trunnion::diagnosis
