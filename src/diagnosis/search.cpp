#include "diagnosis/search.hpp"

#include <algorithm>
#include <cmath>
#include <oneapi/tbb/parallel_for.h>
#include <set>

#include "diagnosis/float_products.hpp"
#include "diagnosis/linalg.hpp"
#include "diagnosis/statistics.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kWide = 8;  // sets kept from one expansion
constexpr std::size_t kBeam = 4;  // sets expanded at each depth
constexpr double kSameSpan =
    0.995;  // cosine from which a direction counts as contained: 1 % of its chi-square
// Evidence ratio of 100 : 1 (in -2 ln): rivals within it are reported together.
constexpr double kUndecided = 9.2;
// The same for a rival with more columns, 30 : 1: most of its chance to fit as well is chance.
constexpr double kUndecidedLarger = 6.8;
// That something is missing is sure already: of a rival the evidence decides, not whether it would have been
// found alone.
constexpr double kRivalLevel = 0.05;
constexpr double kKnownPeriod =
    6.0;  // chi-square that a known period may be worse than the best one and still be meant
constexpr double kUndetermined = 1e-10;  // square of a singular value of columns of length 1
constexpr double kGivenRest = 0.03;   // part of a direction (its length) that the others must leave a member
constexpr double kSureAnyhow = 1e-6;  // p-value below which a few readings cannot be the reason
constexpr double kFarFromUsual = 10.0;  // times its usual magnitude: an effect there costs evidence, slowly

std::multiset<std::size_t> families(const std::vector<Atom>& members) {
  std::multiset<std::size_t> out;
  for (const Atom& atom : members) out.insert(atom.family);
  return out;
}

}  // namespace

double occam(double s, double k) {
  return k <= 0.0 ? 0.0 : s > k ? k * (1.0 + std::log(s / k)) : s;
}

std::vector<std::string> EffectSet::ids(const Atoms& atoms) const {
  std::vector<std::string> out;
  for (const Atom& atom : members) out.push_back(atoms.library()[atom.family].id());
  return out;
}

Eigen::Index EffectSet::columns() const {
  Eigen::Index sum = 0;
  for (const Eigen::Index k : rank) sum += k;
  return sum;
}

bool EffectSet::significant(double alpha) const {
  return std::all_of(p.begin(), p.end(), [alpha](double v) { return v < alpha; });
}

Search::Search(const Atoms& atoms, const Atoms::Multiplicity& multiplicity, const NoiseScale& noise,
               double alpha, std::size_t depth)
    : atoms_(atoms), multiplicity_(multiplicity), noise_(noise), alpha_(alpha), depth_(depth) {}

double Search::global_p(std::size_t family, double drop, Eigen::Index rank) const {
  if (rank == 0) return 1.0;
  const auto k = static_cast<double>(rank);
  const double p = f_tail(drop / k, k, noise_.test_dof());
  return smallest_of(smallest_of(p, multiplicity_.shapes[family]), multiplicity_.families);
}

double Search::rho(const Atom& a, const Atom& b) {
  if (a.rank() == 0 || b.rank() == 0) return 0.0;
  const Svd svd = thin_svd(inner_products(a.U(), b.U()).cast<double>());
  return std::min(1.0, svd.s[0]);
}

bool Search::contains(const Atom& larger, const Atom& smaller) const {
  if (larger.rank() <= smaller.rank() || smaller.rank() == 0) return false;
  // Smaller in general, not because these runs excite only a part of it.
  if (atoms_.effect(larger).info().linear_count() <= atoms_.effect(smaller).info().linear_count())
    return false;
  const auto& named = atoms_.effect(larger).info().contains;
  const std::string& id = atoms_.effect(smaller).info().id;
  if (std::find(named.begin(), named.end(), id) != named.end()) return true;
  const Svd svd = thin_svd(inner_products(larger.U(), smaller.U()).cast<double>());
  return svd.s.size() == smaller.rank() && svd.s[svd.s.size() - 1] > kSameSpan;
}

namespace {

std::vector<const Atom*> pointers(const std::vector<Atom>& members) {
  std::vector<const Atom*> out;
  out.reserve(members.size());
  for (const Atom& atom : members) out.push_back(&atom);
  return out;
}

std::vector<Eigen::Index> columns_of(const Products& products, std::size_t member, bool the_others) {
  std::vector<Eigen::Index> out;
  for (Eigen::Index k = 0; k < products.moments.size(); ++k)
    if ((k >= products.first[member] && k < products.first[member + 1]) != the_others) out.push_back(k);
  return out;
}

}  // namespace

// Everything from inner products of the members; only correlated noise and the bounded tests of rough data
// need the columns themselves.
double Search::drop_given_rest(const Products& products, std::size_t member, Eigen::Index& rank) const {
  const auto own = columns_of(products, member, false), rest = columns_of(products, member, true);
  MatrixXd gram = products.gram(own, own);
  VectorXd moments = products.moments(own);
  if (!rest.empty()) {
    const MatrixXd across = products.gram(own, rest);
    const MatrixXd through = across * inverse_above(products.gram(rest, rest), Atoms::kTaken * Atoms::kTaken);
    gram -= through * across.transpose();
    moments -= through * products.moments(rest);
  }
  const PivotedCholesky factor = pivoted_cholesky(gram, kGivenRest * kGivenRest);
  rank = factor.rank;
  VectorXd along(rank);
  for (Eigen::Index k = 0; k < rank; ++k)
    along[k] =
        (moments[factor.order[k]] - factor.lower.row(k).head(k).dot(along.head(k))) / factor.lower(k, k);
  return along.squaredNorm() / noise_.variance;
}

EffectSet Search::evaluate(std::vector<Atom> members) const {
  EffectSet out;
  out.members = std::move(members);
  const std::vector<const Atom*> all = pointers(out.members);
  const Products products = atoms_.products(all);
  out.rss =
      atoms_.base().white.squaredNorm() -
      products.moments.dot(inverse_above(products.gram, Atoms::kTaken * Atoms::kTaken) * products.moments);
  out.criterion = out.rss / noise_.variance;
  for (std::size_t k = 0; k < out.members.size(); ++k) {
    Eigen::Index rank = 0;
    double drop = drop_given_rest(products, k, rank);
    double p = global_p(out.members[k].family, drop, rank);
    const bool bound = atoms_.rough() && p > kSureAnyhow;
    if (noise_.phi > 0.0 || bound) {
      std::vector<const Atom*> rest = all;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(k));
      const Remainder given = atoms_.remainder(rest);
      MatrixXd u = out.members[k].U().cast<double>();
      u -= given.basis * (given.basis.transpose() * u);
      u = pivoted_qr(u, kGivenRest).Q;
      rank = u.cols();
      drop = corrected_drop(u, given.residual, noise_);
      p = global_p(out.members[k].family, drop, rank);
      if (atoms_.rough() && p > kSureAnyhow) {
        const double bounded = corrected_drop(u, atoms_.bounded(given, noise_.variance).residual, noise_);
        p = std::max(p, global_p(out.members[k].family, bounded, rank));
      }
    }
    out.drop.push_back(drop);
    out.rank.push_back(rank);
    out.p.push_back(p);
    out.criterion += occam(drop, static_cast<double>(rank)) +
                     2.0 * std::log(multiplicity_.shapes[out.members[k].family]) +
                     2.0 * std::log(multiplicity_.families);
  }
  out.criterion += implausibility(out, products);
  return out;
}

void Search::complete(EffectSet& set) const {
  if (set.remainder.residual.size() == 0) set.remainder = atoms_.remainder(pointers(set.members));
}

EffectSet Search::evaluated(std::vector<Atom> members) const {
  EffectSet out = evaluate(std::move(members));
  complete(out);
  return out;
}

namespace {

// What a prior with long tails (Cauchy's, as wide as kFarFromUsual usual values) costs a parameter that the
// readings put at `value` +/- `sigma`: the least of the sum, over what it may truly be. One that they hardly
// see costs no more than the chi-square of being small.
double far_from_usual(double value, double sigma, double usual) {
  constexpr int kSteps = 64;
  double least = INFINITY;
  for (int i = 0; i <= kSteps; ++i) {
    const double truth = value * i / kSteps;
    const double misfit = sigma > 0.0 ? std::pow((value - truth) / sigma, 2) : (i == kSteps ? 0.0 : INFINITY);
    least = std::min(least, misfit + 2.0 * std::log1p(std::pow(truth / (kFarFromUsual * usual), 2)));
  }
  return least;
}

}  // namespace

// Parameters far beyond what machines show need more evidence; of an effect the worst one counts.
double Search::implausibility(const EffectSet& set, const Products& products) const {
  const SetEstimate e = estimate(set.members, products);
  double sum = 0.0;
  for (std::size_t m = 0; m < set.members.size(); ++m) {
    const auto& info = atoms_.effect(set.members[m]).info();
    double worst = 0.0;
    for (std::size_t k = 0; k < e.values[m].size(); ++k)
      worst = std::max(worst, far_from_usual(e.values[m][k], e.sigmas[m][k],
                                             std::max(std::abs(info.parameters[k].usual), 1e-12)));
    sum += worst;
  }
  return sum;
}

const EffectSet* Search::seen(const std::vector<Atom>& members) const {
  const auto key = families(members);
  for (const EffectSet& set : tried_)
    if (families(set.members) == key) return &set;
  return nullptr;
}

void Search::expand(const EffectSet& from, std::size_t keep) {
  const auto best = atoms_.best_of_each(pointers(from.members), noise_.variance);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t f = 0; f < best.size(); ++f) {
    if (best[f].atom == nullptr) continue;
    const double s = best[f].score.drop / noise_.variance;
    order.emplace_back(occam(s, static_cast<double>(best[f].score.rank)) +
                           2.0 * std::log(multiplicity_.shapes[f]) + 2.0 * std::log(multiplicity_.families) -
                           s,
                       f);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::vector<Atom>> next;
  for (const auto& [value, f] : order) {
    if (next.size() >= keep || value > kUndecided) break;
    std::vector<Atom> members = from.members;
    members.push_back(*best[f].atom);
    if (families(members).count(f) > 1 || seen(members) != nullptr) continue;
    next.push_back(std::move(members));
  }
  std::vector<EffectSet> sets(next.size());
  oneapi::tbb::parallel_for(std::size_t{0}, next.size(), [&](std::size_t i) {
    Atom& added = next[i].back();
    added = known_shape(atoms_.refined(added, from.remainder), from.remainder);
    sets[i] = evaluate(std::move(next[i]));
  });
  for (EffectSet& set : sets) tried_.push_back(std::move(set));
}

// A period next to a known one (the screw's pitch and its parts) is that one.
Atom Search::known_shape(Atom atom, const Remainder& given) const {
  const auto& info = atoms_.effect(atom).info();
  if (info.shape_count() != 1) return atom;
  double best = atoms_.score(atom, given).drop - kKnownPeriod * noise_.variance;
  for (const double value : info.parameters.back().candidates) {
    Atom trial = atoms_.make_atom(atom.family, atom.variant, {value});
    if (const double drop = atoms_.score(trial, given).drop; drop > best)
      best = drop, atom = std::move(trial);
  }
  return atom;
}

EffectSet Search::best() {
  tried_.clear();
  tried_.push_back(evaluate({}));
  for (std::size_t depth = 0; depth < depth_; ++depth) {
    std::vector<std::size_t> level;
    for (std::size_t i = 0; i < tried_.size(); ++i)
      if (tried_[i].members.size() == depth) level.push_back(i);
    std::sort(level.begin(), level.end(),
              [&](std::size_t a, std::size_t b) { return tried_[a].criterion < tried_[b].criterion; });
    if (level.size() > kBeam) level.resize(kBeam);
    for (const std::size_t i : level) {
      complete(tried_[i]);
      expand(EffectSet(tried_[i]), kWide);
    }
  }
  const EffectSet* best = &tried_.front();
  for (const EffectSet& set : tried_)
    if (set.significant(alpha_) && set.criterion < best->criterion) best = &set;
  EffectSet out = *best;
  complete(out);
  return out;
}

std::vector<EffectSet> Search::alternatives(EffectSet& found) {
  // Beside the sets of the search: each member replaced by every other effect.
  for (std::size_t m = 0; m < found.members.size(); ++m) {
    std::vector<Atom> rest = found.members;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(m));
    const EffectSet without = evaluated(rest);
    expand(without, kWide);
  }
  std::vector<EffectSet> out;
  bool swapped = true;
  for (int round = 0; swapped && round < 3; ++round) {
    swapped = false;
    out.clear();
    for (const EffectSet& set : tried_) {
      if (set.members.empty() || set.members.size() > found.members.size() || !set.significant(kRivalLevel))
        continue;
      const auto mine = families(found.members), other_ones = families(set.members);
      if (std::includes(mine.begin(), mine.end(), other_ones.begin(), other_ones.end())) continue;
      // Nested spans: the smaller that suffices is named, the other is no rival.
      bool no_rival = false;
      for (const Atom& other : set.members)
        for (const Atom& own : found.members) {
          if (other.family == own.family) continue;
          if (set.members.size() == found.members.size() && contains(own, other)) {
            const double lost = (set.rss - found.rss) / noise_.variance;
            const auto columns = static_cast<double>(own.rank() - other.rank());
            no_rival = true;
            if (chi2_tail(lost, columns) > alpha_ && set.criterion < found.criterion + kUndecided) {
              const EffectSet smaller = set;
              found = smaller;
              complete(found);
              swapped = true;
            }
            break;
          }
          no_rival = no_rival || contains(other, own);
        }
      if (swapped) break;
      const double margin = set.columns() > found.columns() ? kUndecidedLarger : kUndecided;
      if (!no_rival && set.criterion < found.criterion + margin) out.push_back(set);
    }
  }
  std::sort(out.begin(), out.end(),
            [](const EffectSet& a, const EffectSet& b) { return a.criterion < b.criterion; });
  return out;
}

SetEstimate estimate(const Atoms& atoms, const std::vector<Atom>& members) {
  return estimate(members, atoms.products(pointers(members)));
}

SetEstimate estimate(const std::vector<Atom>& members, const Products& products) {
  const MatrixXd inverse = inverse_above(products.gram, Atoms::kTaken * Atoms::kTaken);
  const VectorXd along = inverse * products.moments;
  SetEstimate out;
  for (std::size_t m = 0; m < members.size(); ++m) {
    const Eigen::Index at = products.first[m], rank = members[m].rank();
    const MatrixXd& to = members[m].to_columns;
    // The shortest parameters, in units of what each contributes, that give these columns.
    VectorXd unit = to.colwise().norm().transpose();
    for (double& u : unit) u = u > 0.0 ? 1.0 / u : 0.0;
    const MatrixXd scaled = to * unit.asDiagonal();
    const MatrixXd back =
        unit.asDiagonal() * scaled.transpose() * inverse_above(scaled * scaled.transpose(), kUndetermined);
    const VectorXd value = back * along.segment(at, rank);
    const MatrixXd covariance = back * inverse.block(at, at, rank, rank) * back.transpose();
    out.values.emplace_back(value.begin(), value.end());
    out.sigmas.emplace_back();
    for (Eigen::Index k = 0; k < value.size(); ++k)
      out.sigmas.back().push_back(std::sqrt(std::max(covariance(k, k), 0.0)));
  }
  return out;
}

}  // namespace trunnion::diagnosis
