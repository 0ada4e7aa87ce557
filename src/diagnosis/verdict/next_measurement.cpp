#include "diagnosis/verdict/next_measurement.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/statistics.hpp"
#include "diagnosis/search/time_constants.hpp"
#include "diagnosis/verdict/verdict_text.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kGoodEnough = 0.01;  // chance of a wrong name that needs no further run
constexpr double kStaysOpen = 0.05;   // from which on it is said what no run decides
constexpr double kSameLag = 1.15;     // quotient of two time constants below which they are one
// Share of a signal below which nothing of it is left: rounding of products of columns.
constexpr double kHeld = 1e-6;

// Columns of base and of all effects in question on some readings, as their Gram matrix (whitened, set-ups
// out).
class Design {
 public:
  Design(const Atoms& atoms, const EffectSet& found, const std::vector<EffectSet>& rivals) : atoms_(atoms) {
    const auto add = [&](const EffectSet& set) {
      const SetEstimate e = estimate(atoms, set.members);
      Set out;
      for (std::size_t m = 0; m < set.members.size(); ++m) {
        members_.push_back(set.members[m]);
        for (const double v : e.values[m]) out.values.push_back(v);
      }
      out.width = static_cast<Eigen::Index>(out.values.size());
      sets_.push_back(out);
    };
    add(found);
    for (const EffectSet& rival : rivals) add(rival);
    const Model& model = atoms.base().model;
    for (const ModelEffect& effect : model.effects)
      base_width_ += static_cast<Eigen::Index>(effect.parameters.size());
    Eigen::Index at = base_width_;
    for (Set& set : sets_) {
      set.begin = at;
      at += set.width;
    }
    width_ = at;
    add_lags(found, rivals);
  }

  MatrixXd gram(const Observations& o, const Whitening& whitening) const {
    MatrixXd columns(o.size(), width_);
    Eigen::Index at = 0;
    for (const ModelEffect& effect : atoms_.base().model.effects) {
      const MatrixXd block = o.columns(effect);
      columns.middleCols(at, block.cols()) = block;
      for (std::size_t k = 0; k < effect.parameters.size(); ++k)
        if (effect.parameters[k].fixed) columns.col(at + static_cast<Eigen::Index>(k)).setZero();
      at += block.cols();
    }
    const auto add = [&](const Atom& atom) {
      const MatrixXd block = o.linear_columns(atoms_.effect(atom), atom.shape);
      columns.middleCols(at, block.cols()) = block;
      at += block.cols();
    };
    for (const Atom& atom : members_) add(atom);
    for (const Lagged& lagged : lagged_)
      for (const double tau : lagged.tau) {
        Atom atom = lagged.atom;
        atom.shape = {tau};
        add(atom);
      }
    whitening.apply(columns);
    return columns.transpose() * columns;
  }

  // Chance of a wrong name: each rival's by its squared distance from what was found, the smaller of both
  // ways round (the chi-square that tells them apart), each free to take its best values; together by their
  // odds. Not the nearest rival's alone: a run that tells apart all but one is worth its time. Where one
  // holds all that the other does, wherever the machine stands, no run takes it out again: what it could have
  // more is no promise, since its values are noise about 0 where the smaller one is the truth.
  double wrong_name(const MatrixXd& gram, double variance) const {
    double odds = 0.0;
    for (std::size_t r = 1; r < sets_.size(); ++r) {
      const double p = normal_cdf(-0.5 * std::sqrt(apart(gram, r) / variance));
      odds += p / (1.0 - p);
    }
    return odds / (1.0 + odds);
  }
  // Rivals, counted from 0, of which one holds the other on these readings.
  std::vector<std::size_t> one_with_found(const MatrixXd& gram) const {
    std::vector<std::size_t> out;
    for (std::size_t r = 1; r < sets_.size(); ++r)
      if (apart(gram, r) <= 0.0) out.push_back(r - 1);
    return out;
  }

 private:
  struct Set {
    Eigen::Index begin = 0, width = 0;
    std::vector<double> values;
    std::vector<Eigen::Index> more;  // columns of its members with other time constants
  };
  // A member with a lag: refitted, it takes the time constants of the others.
  struct Lagged {
    Atom atom;
    std::vector<double> tau;
  };

  void add_lags(const EffectSet& found, const std::vector<EffectSet>& rivals) {
    std::vector<double> all;
    for (const Atom& atom : members_) {
      if (!has_lag(atoms_.effect(atom).info())) continue;
      const double tau = atom.shape.front();
      const auto same = [&](double other) { return std::max(tau / other, other / tau) < kSameLag; };
      if (std::none_of(all.begin(), all.end(), same)) all.push_back(tau);
      const bool known = std::any_of(lagged_.begin(), lagged_.end(), [&](const Lagged& other) {
        return other.atom.family == atom.family && other.atom.variant == atom.variant;
      });
      if (!known) lagged_.push_back({atom, {}});
    }
    for (Lagged& lagged : lagged_) {
      lagged.tau = all;
      const auto count =
          static_cast<Eigen::Index>(atoms_.effect(lagged.atom).info().linear_count() * lagged.tau.size());
      for (std::size_t s = 0; s < sets_.size(); ++s) {
        const EffectSet& set = s == 0 ? found : rivals[s - 1];
        const bool has = std::any_of(set.members.begin(), set.members.end(), [&](const Atom& atom) {
          return atom.family == lagged.atom.family && atom.variant == lagged.atom.variant;
        });
        for (Eigen::Index k = 0; has && k < count; ++k) sets_[s].more.push_back(width_ + k);
      }
      width_ += count;
    }
  }

  double apart(const MatrixXd& gram, std::size_t rival) const {
    return std::min(distance(gram, sets_[0], sets_[rival]), distance(gram, sets_[rival], sets_[0]));
  }
  static double signal(const MatrixXd& gram, const Set& set) {
    const VectorXd f = Eigen::Map<const VectorXd>(set.values.data(), set.width);
    return f.dot(gram.block(set.begin, set.begin, set.width, set.width) * f);
  }
  // What base and the other set leave of this one's signal.
  double distance(const MatrixXd& gram, const Set& truth, const Set& other) const {
    std::vector<Eigen::Index> index;
    for (Eigen::Index k = 0; k < base_width_; ++k) index.push_back(k);
    for (Eigen::Index k = 0; k < other.width; ++k) index.push_back(other.begin + k);
    index.insert(index.end(), other.more.begin(), other.more.end());
    const VectorXd f = Eigen::Map<const VectorXd>(truth.values.data(), truth.width);
    const auto n = static_cast<Eigen::Index>(index.size());
    MatrixXd a(n, n);
    VectorXd b(n), scale(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index gi = index[static_cast<std::size_t>(i)];
      scale[i] = gram(gi, gi) > 0.0 ? 1.0 / std::sqrt(gram(gi, gi)) : 0.0;
      b[i] = gram.row(gi).segment(truth.begin, truth.width).dot(f);
      for (Eigen::Index k = 0; k < n; ++k) a(i, k) = gram(gi, index[static_cast<std::size_t>(k)]);
    }
    const double total = signal(gram, truth);
    const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * a * scale.asDiagonal());
    const VectorXd along = eigen.vectors.transpose() * (scale.asDiagonal() * b);
    double explained = 0.0;
    for (Eigen::Index k = 0; k < n; ++k)
      if (eigen.values[k] > 1e-10) explained += along[k] * along[k] / eigen.values[k];
    return total - explained > kHeld * total ? total - explained : 0.0;
  }

  const Atoms& atoms_;
  std::vector<Atom> members_;
  std::vector<Set> sets_;
  std::vector<Lagged> lagged_;
  Eigen::Index base_width_ = 0, width_ = 0;
};

// The sensors that the data have and a planned run says nothing of: the room warms by 3 K over the run.
void warm_the_room(PlanRun& run, const Observations& o) {
  const auto& names = o.data().context.names.temperatures;
  const auto& ambient = o.machine().sensors.ambient;
  if (std::find(names.begin(), names.end(), ambient) != names.end())
    run.temperatures_K[ambient] = {{0.0, 0.0}, {run.minutes * 60.0, 3.0}};
}

}  // namespace

std::optional<NextMeasurement> next_measurement(const Atoms& atoms, const EffectSet& found,
                                                const std::vector<EffectSet>& rivals,
                                                const NoiseScale& noise) {
  const Observations& o = atoms.observations();
  auto candidates = menu(o);
  if (candidates.empty()) return std::nullopt;
  NextMeasurement out;
  if (rivals.empty()) {
    const auto first = std::find_if(candidates.begin(), candidates.end(),
                                    [](const PlanRun& r) { return r.id.starts_with("R-test"); });
    out.runs = {first == candidates.end() ? candidates.front() : *first};
    out.minutes = out.runs[0].minutes;
    out.why = "'" + out.runs[0].id + "' (" + short_number(out.minutes) +
              " min) excites most effects of this machine.";
    return out;
  }
  const bool free_setup = atoms.base().model.setup_translation == SetupTranslation::free;
  const Design design(atoms, found, rivals);
  const MatrixXd old = design.gram(o, *atoms.base().whitening);
  out.wrong_before = design.wrong_name(old, noise.variance);
  MatrixXd sum = old;
  double chance = out.wrong_before;
  for (int step = 0; step < 2 && chance > kGoodEnough; ++step) {
    double best_value = INFINITY;
    std::optional<PlanRun> best;
    double best_chance = chance;
    MatrixXd best_gram;
    for (PlanRun run : candidates) {
      if (run.id.find("at rest") != std::string::npos) warm_the_room(run, o);
      auto data = expand({run}, o.machine(), o.data().context);
      if (!data) continue;
      const Observations planned(o.machine(), *data);
      const Whitening whitening(planned, stated_noise(planned, 0.0, 0.0), free_setup);
      const MatrixXd gram = design.gram(planned, whitening);
      const double after = design.wrong_name(sum + gram, noise.variance);
      // Good enough: the shortest; else the surest, a little in favour of the shorter.
      const double value = after <= kGoodEnough ? run.minutes * 1e-6 : after * (1.0 + run.minutes * 1e-4);
      if (value < best_value) best_value = value, best = run, best_chance = after, best_gram = gram;
    }
    if (!best || best_chance > 0.98 * chance) break;
    std::string id = "next " + std::to_string(step + 1) + ": " + best->id;
    best->id = std::move(id);
    out.minutes += best->minutes;
    out.runs.push_back(*best);
    sum += best_gram;
    chance = best_chance;
  }
  out.wrong_after = chance;
  if (out.runs.empty()) return std::nullopt;
  for (const PlanRun& run : out.runs) out.why += (out.why.empty() ? "'" : " and '") + run.id + "'";
  out.why += ", " + short_number(out.minutes) + " min: probability of naming a wrong effect " +
             short_number(100.0 * out.wrong_before) + " % -> " + short_number(100.0 * out.wrong_after) +
             " %.";
  if (out.wrong_after > kStaysOpen) {
    std::vector<std::vector<std::string>> open = {found.ids(atoms)};
    for (const std::size_t r : design.one_with_found(sum))
      if (auto ids = rivals[r].ids(atoms); ids != open.front()) open.push_back(std::move(ids));
    if (open.size() > 1) out.why += " " + not_told_apart_text(open);
  }
  return out;
}

}  // namespace trunnion::diagnosis
