#include "diagnosis/verdict/unrecorded.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/fit/fit_core.hpp"
#include "diagnosis/fit/statistics.hpp"
#include "diagnosis/verdict/wandering_readings.hpp"
#include "diagnosis/verdict/worth.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kBesideCondition = 0.7, kOfCondition = 0.9;
// Evidence of 100 : 1 in favour of errors of axes, in -2 ln: nearly all readings are taken in some order.
constexpr double kAxesErr = 9.2;
// A spindle that grows with its speed is what spindles do; another power of it must be proved.
constexpr double kSpindlesGrow = 2.0 * kThousandToOne;
constexpr double kFormulaAhead = 50.0;  // in chi-square, of a formula that follows the readings nearer
constexpr double kOnlyNoise = 1.25;     // chi-square per degree of freedom
// From what a spindle or a clamp takes to what a casting takes, by factors of 1.65.
constexpr double kShortest_s = 60.0, kLongest_s = 15000.0;
constexpr int kTimeConstants = 12;
// Beyond, this costs more than it tells.
constexpr Eigen::Index kMostReadingsOfAll = 5000;
constexpr std::size_t kMostRunsOfAll = 40;

bool is_steady_drift(const ModelEffect& effect) {
  return effect.id() == "time_drift";
}

std::string words_of(const InPlace& best) {
  const std::string& what = best.condition->what;
  if (best.condition->kind == ConditionKind::scale)
    return what + " (" + short_number(best.factor) + " times as large as the model says)";
  if (!best.condition->goes_with_time) return what;
  return what + (std::isinf(best.tau_s) ? ", steady with time"
                                        : ", which settles with a time constant of about " +
                                              std::to_string(std::llround(best.tau_s)) + " s");
}

class Exchange {
 public:
  Exchange(const Observations& whole, const Model& model, std::vector<bool> flags,
           const std::vector<ModelEffect>& named)
      : o_(whole), model_(model), flags_(std::move(flags)) {
    for (const auto& make : {drifts, growth_by_run, growth_laws, temperature_gradients, reversals,
                             displaced_tools, moved_in_run})
      add(make(whole));
    const FitCore as_given = fit_core(o_, model_, {.robust = false}, flags_);
    add(scaled_runs(whole, as_given.model));
    Model with_all = model_;
    with_all.effects.insert(with_all.effects.end(), named.begin(), named.end());
    const FitCore all = fit_core(o_, with_all, {.robust = false}, flags_);
    chi2_ = all.chi2();
    dof_ = std::max(all.dof(), 1.0);
  }

  /// The best condition, by what it is ahead; null where none may stand for all that is dropped.
  InPlace best(std::vector<const ModelEffect*> dropped, std::vector<const ModelEffect*> kept) const {
    InPlace out;
    out.dropped = std::move(dropped);
    out.kept = std::move(kept);
    std::vector<Condition> fitting;
    for (const Condition& one : conditions_)
      if (std::all_of(out.dropped.begin(), out.dropped.end(),
                      [&](const ModelEffect* effect) { return one->stands_for(*effect); }))
        fitting.push_back(one);
    if (fitting.empty()) return out;
    Model rest = model_;
    for (const ModelEffect* effect : out.kept) rest.effects.push_back(*effect);
    const FitCore plain = fit_core(o_, rest, {.robust = false}, flags_);
    const double handicap = paid(out.dropped, plain) - (known_physics(out.dropped) ? kAxesErr : 0.0) -
                            (is_growth_alone(out.dropped) ? kSpindlesGrow : 0.0);
    for (const Condition& one : fitting) {
      const auto alike = std::count_if(fitting.begin(), fitting.end(),
                                       [&](const Condition& other) { return other->kind == one->kind; });
      try_all(one, plain, handicap - 2.0 * std::log(static_cast<double>(alike)), out);
    }
    return out;
  }
  double noise_of_named() const { return chi2_ / dof_; }

 private:
  using Condition = std::shared_ptr<const UnrecordedCondition>;
  void add(std::vector<UnrecordedCondition> some) {
    for (UnrecordedCondition& one : some)
      conditions_.push_back(std::make_shared<const UnrecordedCondition>(std::move(one)));
  }
  static bool known_physics(const std::vector<const ModelEffect*>& dropped) {
    return !dropped.empty() &&
           std::all_of(dropped.begin(), dropped.end(), [](const ModelEffect* e) { return is_of_axes(*e); });
  }
  static bool is_growth_alone(const std::vector<const ModelEffect*>& dropped) {
    return dropped.size() == 1 && dropped.front()->id() == "spindle_growth";
  }
  double price(Eigen::Index columns) const {
    return std::log(static_cast<double>(o_.size())) +
           2.0 * std::log(std::max(1.0, static_cast<double>(columns)));
  }
  Worth worth_of(const MatrixXd& columns, const FitCore& plain, const VectorXd& largest) const {
    const VectorXd whole = plain.whitening->applied(columns).colwise().norm();
    return worth(plain.projected(columns), whole, plain.white,
                 price(columns.cols()) * std::max(1.0, noise_of_named()), largest);
  }
  // For those of the parameters that the effects need.
  double paid(const std::vector<const ModelEffect*>& dropped, const FitCore& plain) const {
    double out = 0.0;
    for (const ModelEffect* effect : dropped) {
      const MatrixXd columns = o_.linear_columns(*effect->effect, effect->shape());
      out += std::max(1.0, worth_of(columns, plain, {}).count) * price(columns.cols()) +
             static_cast<double>(effect->effect->info().shape_count()) * price(1);
    }
    return out;
  }
  void try_one(const Condition& one, double tau_s, const FitCore& plain, double handicap,
               InPlace& best) const {
    const MatrixXd columns = one->columns(tau_s);
    const Worth worth = worth_of(columns, plain, one->largest);
    if (worth.count == 0.0) return;
    const double chi2 = plain.chi2() - worth.gained;
    const double shapes = std::isinf(tau_s) ? 0.0 : 1.0;
    const double noise = std::max(1.0, std::min(chi2, chi2_) / dof_);
    const double ahead =
        (chi2_ - chi2) / noise + handicap - worth.count * price(columns.cols()) - shapes * price(1);
    const double dof = std::max(plain.dof() - worth.count - shapes, 1.0);
    // What leaves more than noise, and more than what was named, is no explanation.
    if (ahead <= best.ahead || (chi2 >= kOnlyNoise * dof && chi2 > noise_of_named() * dof)) return;
    best.ahead = ahead;
    best.chi2 = chi2;
    best.dof = dof;
    best.gained = worth.gained / noise;
    best.parameters = worth.count + shapes;
    best.condition = one;
    best.tau_s = tau_s;
    if (one->kind == ConditionKind::scale) best.factor = 1.0 + worth.coefficients[0];
  }
  void try_all(const Condition& one, const FitCore& plain, double handicap, InPlace& best) const {
    if (!one->steady_is_known) try_one(one, INFINITY, plain, handicap, best);
    if (!one->goes_with_time) return;
    double factor = std::pow(kLongest_s / kShortest_s, 1.0 / (kTimeConstants - 1));
    for (int k = 0; k < kTimeConstants; ++k)
      try_one(one, kShortest_s * std::pow(factor, k), plain, handicap, best);
    // By the square root of the factor to either side of the best, five times: to a hundredth.
    constexpr int kHalvings = 5;
    for (int k = 0; k < kHalvings && best.condition == one && !std::isinf(best.tau_s); ++k) {
      factor = std::sqrt(factor);
      const double best_s = best.tau_s;
      try_one(one, best_s / factor, plain, handicap, best);
      try_one(one, best_s * factor, plain, handicap, best);
    }
  }

  const Observations& o_;
  const Model& model_;
  std::vector<bool> flags_;
  std::vector<Condition> conditions_;
  double chi2_ = 0.0, dof_ = 1.0;  // with all that was named
};

// In place of each effect, of each two, of all.
InPlace best_exchange(const Exchange& exchange, const std::vector<ModelEffect>& named) {
  const std::size_t count = named.size();
  InPlace best;
  for (std::size_t set = count == 0 ? 0 : 1; set < (std::size_t{1} << count); ++set) {
    std::vector<const ModelEffect*> dropped, kept;
    for (std::size_t k = 0; k < count; ++k) ((set >> k) % 2 == 1 ? dropped : kept).push_back(&named[k]);
    if (dropped.size() > 2 && !kept.empty()) continue;
    if (InPlace one = exchange.best(std::move(dropped), std::move(kept)); one.ahead > best.ahead)
      best = std::move(one);
  }
  return best;
}

std::vector<std::string> ids_of(const std::vector<const ModelEffect*>& effects) {
  std::vector<std::string> out;
  out.reserve(effects.size());
  for (const ModelEffect* effect : effects) out.push_back(effect->id());
  return out;
}

std::string listed_ids(const std::vector<const ModelEffect*>& effects) {
  std::string out;
  for (const ModelEffect* effect : effects) out += (out.empty() ? "" : " and ") + effect->id();
  return out;
}

// Each set once, the first first, without these effects; none that is empty then.
std::vector<std::vector<std::string>> sets_without(const std::vector<std::vector<std::string>>& sets,
                                                   const std::vector<std::string>& ids) {
  std::vector<std::vector<std::string>> out;
  for (std::vector<std::string> set : sets) {
    std::erase_if(set,
                  [&](const std::string& id) { return std::find(ids.begin(), ids.end(), id) != ids.end(); });
    if (!set.empty() && std::find(out.begin(), out.end(), set) == out.end()) out.push_back(std::move(set));
  }
  return out;
}

// That the condition it is, and what the others show where it is of one run.
void say_condition(const Observations& o, const InPlace& best, Diagnosis& d) {
  const std::string instead = listed_ids(best.dropped);
  const std::string better = words_of(best) + ", explains the readings better";
  const auto& only_in = best.condition->only_in;
  if (only_in) d.rows.odd_runs = {o.data().context.runs[*only_in].id};
  d.confidence = std::min(d.confidence, kOfCondition);
  d.next.reset();
  const std::vector<std::vector<std::string>> others = sets_without(d.sets, ids_of(best.dropped));
  d.sets.clear();
  if (best.condition->kind == ConditionKind::wander) d.formula.reset();
  if ((only_in || best.condition->kind == ConditionKind::wander) && !best.kept.empty()) {
    const std::vector<std::string> kept = ids_of(best.kept);
    const bool only_noise = best.per_degree() < kOnlyNoise;
    std::erase_if(d.additions, [&](const ModelEffect& e) {
      return std::find(kept.begin(), kept.end(), e.id()) == kept.end();
    });
    // What the kept ones could not be told from stays open.
    d.effects = kept;
    d.sets = others;
    d.verdict = others.size() > 1 ? Verdict::ambiguous
                : only_noise      ? Verdict::named
                                  : Verdict::named_but_incomplete;
    d.paragraph =
        (others.size() > 1 ? "Missing in the model, or one of the other sets: " : "Missing in the model: ") +
        listed_ids(best.kept) + (instead.empty() ? ". Nothing else is: " : ". Not " + instead + ": ") +
        better + ". " + best.condition->remedy;
    return;
  }
  if (best.condition->kind == ConditionKind::wander) {
    d.verdict = Verdict::data_problem;
    d.imitators = ids_of(best.dropped);
    d.paragraph = "Nothing is proved that is missing in the model: " + better + " than " +
                  (instead.empty() ? "anything that the state of the machine explains" : instead) + ". " +
                  best.condition->remedy;
    d.effects.clear();
    d.additions.clear();
    return;
  }
  if (!best.condition->covariate.empty())
    d.depends_on.insert(d.depends_on.begin(),
                        {best.condition->covariate, chi2_tail(best.gained, best.parameters)});
  d.verdict = Verdict::not_in_library;
  d.imitators = ids_of(best.dropped);
  d.leftover = d.depends_on;
  d.paragraph = "The model misses something real that is none of the effects known here: " + better +
                " than " + instead + ". " + best.condition->remedy;
  d.effects.clear();
  d.additions.clear();
}

// Where nothing was named: what explains it all. A formula that does no better is none. That one run is
// longer than the others is what a wrong scale of that run does, too.
void say_what_explains(const InPlace& best, Diagnosis& d) {
  const std::string words = words_of(best) + ". " + best.condition->remedy;
  if (best.condition->only_in || (!best.condition->goes_with_time && !d.rows.odd_runs.empty())) {
    d.paragraph += " What would explain it: " + words;
    return;
  }
  d.rows.odd_runs.clear();
  if (d.formula && d.formula->chi2_after > best.chi2) d.formula.reset();
  d.paragraph =
      "The model misses something real that is none of the effects known here. What explains it: " + words +
      (d.formula ? formula_text(*d.formula) : "");
}

// Of what is left over nothing is known but that it changes with time.
bool goes_with_time_alone(const Diagnosis& d) {
  return std::all_of(d.depends_on.begin(), d.depends_on.end(), [](const Dependence& dependence) {
    return dependence.covariate.find("time") != std::string::npos;
  });
}

// Readings that wander, in place of effects, of a formula, of both. Where nothing stands against them, what
// follows a state that nobody tried wanders as well while the machine goes through it.
void say_that_they_wander(const Observations& o, const InPlace& best, Diagnosis& d) {
  const bool against_nothing = best.dropped.empty() && best.kept.empty() && !d.formula;
  if (best.ahead > kThousandToOne && (!against_nothing || goes_with_time_alone(d))) {
    say_condition(o, best, d);
    return;
  }
  if (against_nothing) {
    d.confidence = std::min(d.confidence, kBesideCondition);
    d.paragraph += " Or none is: " + words_of(best) + ", leaves as little. " + best.condition->remedy;
    return;
  }
  const std::string instead = listed_ids(best.dropped);
  d.imitators = ids_of(best.dropped);
  if (d.verdict != Verdict::not_in_library) {
    if (const std::vector<std::string> kept = ids_of(best.kept); !kept.empty()) d.sets.push_back(kept);
    d.verdict = Verdict::ambiguous;
  }
  d.confidence = std::min(d.confidence, kBesideCondition);
  d.paragraph = kTwoExplanations + d.paragraph + " Or " + (instead.empty() ? "none" : "no " + instead) +
                " is missing, but this is " + words_of(best) + ": hardly to be told apart. " +
                best.condition->remedy;
}

}  // namespace

bool is_step(const ModelEffect& effect) {
  return effect.id() == "step";
}
bool is_thermal(const ModelEffect& effect) {
  return effect.effect->info().kind == EffectClass::thermal;
}
bool is_of_axes(const ModelEffect& effect) {
  return effect.effect->info().kind == EffectClass::geometric;
}
bool may_come_of_order(const ModelEffect& effect) {
  return is_steady_drift(effect) || is_of_axes(effect) || effect.effect->info().kind == EffectClass::setup;
}

void doubt_beside_unrecorded(const Observations& whole, const Model& model, const std::vector<bool>& left_out,
                             Diagnosis& d) {
  const bool nothing_named = d.verdict == Verdict::not_in_library && d.additions.empty() && !d.harm;
  if (!nothing_named && d.verdict != Verdict::named && d.verdict != Verdict::ambiguous &&
      d.verdict != Verdict::named_but_incomplete)
    return;
  if (whole.size() > kMostReadingsOfAll || whole.runs().size() > kMostRunsOfAll) return;
  const bool alike = left_out.size() == static_cast<std::size_t>(whole.size());
  const std::vector<ModelEffect> named = d.additions;
  const std::vector<bool> flags = alike ? left_out : std::vector<bool>{};
  const Exchange exchange(whole, model, flags, named);
  InPlace best = best_exchange(exchange, named);
  if (const auto wandering =
          beside_wandering_readings(whole, fit_core(whole, model, {.robust = false}, flags), named, d);
      wandering && wandering->ahead > best.ahead)
    best = *wandering;
  if (best.condition == nullptr || best.ahead < -kThousandToOne) return;
  const bool only_noise = best.per_degree() < kOnlyNoise;
  if (best.condition->kind == ConditionKind::wander) {
    say_that_they_wander(whole, best, d);
    return;
  }
  if (d.formula && d.formula->chi2_after + kFormulaAhead * std::max(best.per_degree(), 1.0) < best.chi2)
    return;
  if (nothing_named) {
    if (best.ahead > kThousandToOne && only_noise) say_what_explains(best, d);
    return;
  }
  if (best.ahead > kThousandToOne) {
    say_condition(whole, best, d);
    return;
  }
  // One drift or another: a drift it is.
  if (std::all_of(best.dropped.begin(), best.dropped.end(),
                  [](const ModelEffect* effect) { return is_steady_drift(*effect); }))
    return;
  if (const std::vector<std::string> kept = ids_of(best.kept); !kept.empty()) d.sets.push_back(kept);
  d.imitators = ids_of(best.dropped);
  d.verdict = Verdict::ambiguous;
  d.confidence = std::min(d.confidence, kBesideCondition);
  d.paragraph = kTwoExplanations + d.paragraph + " Or no " + listed_ids(best.dropped) + " is missing, but " +
                words_of(best) + ": these readings hardly tell the two apart. " + best.condition->remedy;
}

}  // namespace trunnion::diagnosis
