#include "diagnosis/search/search.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <oneapi/tbb/parallel_for.h>
#include <set>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/float_products.hpp"
#include "diagnosis/fit/statistics.hpp"
#include "diagnosis/fit/usual_size.hpp"
#include "diagnosis/search/time_constants.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kWide = 8;            // sets kept from one expansion
constexpr std::size_t kWideForRivals = 24;  // a short travel has many that look alike
constexpr std::size_t kBeam = 4;            // sets expanded at each depth
constexpr std::size_t kMostExchanged = 24;  // sets beside which a rival's member is exchanged
constexpr double kLeavesNoise = 1.25;       // chi-square per degree of freedom
constexpr int kMostSwaps = 6;               // of what was found for a smaller one
constexpr double kSameSpan =
    0.995;  // cosine from which a direction counts as contained: 1 % of its chi-square
// Rivals within kThousandToOne are reported together (two effects that differ by 5.4 of chi-square, which
// noise moves by 4.6, are within it in 19 of 20 measurements). An evidence ratio of 100 : 1 in -2 ln: worth a
// look.
constexpr double kWorthwhile = 9.2;
// For one that contains what was found, 10 : 1: the smaller one that suffices is named, unless these
// readings hardly see what the larger one has more.
constexpr double kUndecidedNested = 4.6;
constexpr double kSameSignal = 0.999;  // cosine from which two effects give the same signal
// What is left of the further directions of a larger effect beside a smaller one and the rest of its set:
// where it is less, that they are not needed is not seen, since the rest gives way.
constexpr double kSeenBeside = 0.3;
// Chi-square by which a set may come nearer once all its time constants are refitted: each was found beside
// the members that were there then. At least, and as a part of what the set explains.
constexpr double kLagsOpen = 60.0, kLagsOpenPart = 0.005;
constexpr std::size_t kMostRefitted = 16;  // sets, each time
constexpr double kSuffices = 0.005;        // p-value above which what the larger one has more is not missed
// That something is missing is sure already: of a rival the evidence decides, not whether it would have been
// found alone.
constexpr double kRivalLevel = 0.05;
constexpr double kKnownPeriod =
    6.0;  // chi-square that a known period may be worse than the best one and still be meant
constexpr double kUndetermined = 1e-10;  // square of a singular value of columns of length 1
constexpr double kGivenRest = 0.03;  // part of a direction (its length) that the others must leave a member
constexpr double kRounding =
    1e-10;                       // of a member's best seen parameter: what is seen less is not seen at all
constexpr double kTiny = 1e-12;  // stands for a usual magnitude of 0
constexpr double kNarrowest = 0.01;   // width of a prior that the readings do not feel
constexpr double kWeakest = 1e-8;     // share of the best seen direction's square below which none is weighed
constexpr double kSureAnyhow = 1e-6;  // p-value below which a few readings cannot be the reason
constexpr double kSinglePrecision = 6e-8;  // relative rounding of inner products
constexpr double kNoMatter = 0.1;          // of chi-square: rounding below it decides between no two sets

Families families(const std::vector<Atom>& members) {
  Families out;
  for (const Atom& atom : members) out.insert(atom.family);
  return out;
}

std::multiset<std::pair<std::size_t, std::size_t>> variants(const std::vector<Atom>& members) {
  std::multiset<std::pair<std::size_t, std::size_t>> out;
  for (const Atom& atom : members) out.emplace(atom.family, atom.variant);
  return out;
}

bool any_lag(const Atoms& atoms, const EffectSet& set) {
  return std::any_of(set.members.begin(), set.members.end(),
                     [&](const Atom& atom) { return has_lag(atoms.effect(atom).info()); });
}

bool has_family(const EffectSet& set, std::size_t family) {
  return std::any_of(set.members.begin(), set.members.end(),
                     [family](const Atom& atom) { return atom.family == family; });
}

}  // namespace

double occam(double s, double k) {
  return k <= 0.0 ? 0.0 : s > k ? k * (1.0 + std::log(s / k)) : s;
}

double occam(const Share& share, const VectorXd& usual, double variance) {
  const Svd svd = thin_svd(share.to_columns * usual.asDiagonal());
  const VectorXd along = (svd.U.transpose() * share.along).cwiseAbs2() / variance;
  const VectorXd seen = svd.s.cwiseAbs2() / variance;
  if (along.size() == 0 || !(seen[0] > 0.0)) return 0.0;
  // The price as a function of the logarithm of the width may have several hollows: a fine grid from where
  // the prior does nothing to where it is as wide as the readings want the hardest seen direction.
  constexpr double kStep = 0.2;
  double least = along.sum();
  const double end = std::log((1.0 + along.maxCoeff()) / std::max(seen.minCoeff(), kWeakest * seen[0]));
  for (double u = std::log(kNarrowest / seen[0]); u < end + kStep; u += kStep) {
    double price = 0.0;
    for (Eigen::Index k = 0; k < along.size(); ++k) {
      const double wide = 1.0 + std::exp(u) * seen[k];
      price += std::log(wide) + along[k] / wide;
    }
    price += 2.0 * std::log1p(std::exp(u) / (kFarFromUsual * kFarFromUsual));
    least = std::min(least, price);
  }
  return least;
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

bool Search::in_general(const Atom& larger, const Atom& smaller) const {
  const auto& named = atoms_.effect(larger).info().contains;
  return std::find(named.begin(), named.end(), atoms_.effect(smaller).info().id) != named.end();
}

bool Search::contains(const Atom& larger, const Atom& smaller) const {
  if (larger.rank() <= smaller.rank() || smaller.rank() == 0) return false;
  // Smaller in general, not because these runs excite only a part of it.
  if (atoms_.effect(larger).info().linear_count() <= atoms_.effect(smaller).info().linear_count())
    return false;
  if (in_general(larger, smaller)) return true;
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

std::vector<Eigen::Index> columns_of(const Products& products, const std::vector<std::size_t>& members) {
  std::vector<Eigen::Index> out;
  for (const std::size_t m : members)
    for (Eigen::Index k = products.first[m]; k < products.first[m + 1]; ++k) out.push_back(k);
  return out;
}

std::vector<std::size_t> all_but(std::size_t count, std::size_t member) {
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < count; ++k)
    if (k != member) out.push_back(k);
  return out;
}

// Of an atom whose columns have these inner products, and these with the residual, once the others' part of
// both is taken out.
Share share_of(const Atom& atom, const MatrixXd& gram, const VectorXd& moments) {
  const PivotedCholesky factor = pivoted_cholesky(gram, kGivenRest * kGivenRest);
  Share out{MatrixXd(factor.rank, gram.cols()), VectorXd(factor.rank)};
  for (Eigen::Index k = 0; k < factor.rank; ++k) {
    const auto before = factor.lower.row(k).head(k);
    const Eigen::Index own = factor.order[k];
    out.along[k] = (moments[own] - before.dot(out.along.head(k))) / factor.lower(k, k);
    out.to_columns.row(k) = (gram.row(own) - before * out.to_columns.topRows(k)) / factor.lower(k, k);
  }
  out.to_columns *= atom.to_columns;
  return out;
}

Share share_of(const Atom& atom, const Remainder& given) {
  const VectorXd moments = inner_products(atom.U(), given.residual.cast<float>()).cast<double>();
  MatrixXd gram = MatrixXd::Identity(atom.rank(), atom.rank());
  if (given.basis.cols() > 0) {
    const MatrixXd m = inner_products(atom.U(), given.basis.cast<float>()).cast<double>();
    gram -= m * m.transpose();
  }
  return share_of(atom, gram, moments);
}

VectorXd usual_magnitudes(const EffectInfo& info) {
  VectorXd out(static_cast<Eigen::Index>(info.linear_count()));
  for (std::size_t k = 0; k < info.linear_count(); ++k)
    out[static_cast<Eigen::Index>(k)] = std::max(std::abs(info.parameters[k].usual), kTiny);
  return out;
}

}  // namespace

double Search::price(const Atom& atom, const Share& share) const {
  return occam(share, usual_magnitudes(atoms_.effect(atom).info()), noise_.variance) +
         2.0 * std::log(multiplicity_.shapes[atom.family]) + 2.0 * std::log(multiplicity_.families);
}

// Inner products are in single precision, and what a set leaves is a small difference of large sums: errors
// of a hundred usual sizes beside members that are nearly collinear left -346 of 8.5e6, and a wrong pair was
// named.
bool Search::rounding_matters(const Products& products) const {
  if (products.gram.size() == 0) return false;
  double least = 1.0;
  for (const double value : symmetric_eigen(products.gram).values)
    if (value > Atoms::kTaken * Atoms::kTaken) least = std::min(least, value);
  return kSinglePrecision * atoms_.base().white.squaredNorm() / least > kNoMatter * noise_.variance;
}

// Everything from inner products of the members; only correlated noise, the bounded tests of rough data and
// errors so large that rounding matters need the columns themselves.
Share Search::share_beside(const Products& products, const std::vector<Atom>& members, std::size_t member,
                           const std::vector<std::size_t>& others) const {
  const auto own = columns_of(products, {member}), rest = columns_of(products, others);
  MatrixXd gram = products.gram(own, own);
  VectorXd moments = products.moments(own);
  if (!rest.empty()) {
    const MatrixXd across = products.gram(own, rest);
    const MatrixXd through = across * inverse_above(products.gram(rest, rest), Atoms::kTaken * Atoms::kTaken);
    gram -= through * across.transpose();
    moments -= through * products.moments(rest);
  }
  return share_of(members[member], gram, moments);
}

// Each member beside those before it, in the order that costs least: what two of them share is paid for once,
// but it is paid for.
double Search::price(const std::vector<Atom>& members, const Products& products,
                     const std::vector<double>& corrections) const {
  std::vector<std::size_t> order(members.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  double least = INFINITY;
  do {
    double sum = 0.0;
    for (std::size_t k = 0; k < order.size(); ++k) {
      const std::vector<std::size_t> before(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(k));
      Share share = share_beside(products, members, order[k], before);
      share.along *= corrections[order[k]];
      sum += price(members[order[k]], share);
    }
    least = std::min(least, sum);
  } while (std::next_permutation(order.begin(), order.end()));
  return least;
}

EffectSet Search::evaluate(std::vector<Atom> members) const {
  EffectSet out;
  out.members = std::move(members);
  const std::vector<const Atom*> all = pointers(out.members);
  const Products products = atoms_.products(all);
  const bool rounded = rounding_matters(products);
  out.rss = rounded ? atoms_.remainder(all).rss()
                    : atoms_.base().white.squaredNorm() -
                          products.moments.dot(inverse_above(products.gram, Atoms::kTaken * Atoms::kTaken) *
                                               products.moments);
  out.criterion = out.rss / noise_.variance;
  std::vector<double> corrections;  // of lengths, for the noise's correlation
  for (std::size_t k = 0; k < out.members.size(); ++k) {
    const Share share = share_beside(products, out.members, k, all_but(out.members.size(), k));
    Eigen::Index rank = share.along.size();
    const double plain = share.along.squaredNorm() / noise_.variance;
    double drop = plain;
    double p = global_p(out.members[k].family, drop, rank);
    const bool bound = atoms_.rough() && p > kSureAnyhow;
    if (noise_.phi > 0.0 || bound || rounded) {
      std::vector<const Atom*> rest = all;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(k));
      const Remainder given = atoms_.remainder(rest);
      MatrixXd u = out.members[k].U().cast<double>();
      take_out(given.basis, u);
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
    corrections.push_back(plain > 0.0 ? std::sqrt(drop / plain) : 1.0);
  }
  out.criterion += price(out.members, products, corrections);
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

const EffectSet* Search::seen(const std::vector<Atom>& members) const {
  const auto key = variants(members);
  for (const EffectSet& set : tried_)
    if (variants(set.members) == key) return &set;
  return nullptr;
}

void Search::expand(const EffectSet& from, std::size_t keep) {
  const auto best = atoms_.best_of_each(pointers(from.members), noise_.variance);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t f = 0; f < best.size(); ++f) {
    if (best[f].atom == nullptr) continue;
    const Share share = share_of(*best[f].atom, from.remainder);
    order.emplace_back(price(*best[f].atom, share) - share.along.squaredNorm() / noise_.variance, f);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::vector<Atom>> next;
  for (const auto& [value, f] : order) {
    if (next.size() >= keep || value > kWorthwhile) break;
    std::vector<Atom> members = from.members;
    members.push_back(*best[f].atom);
    if (families(members).count(f) > 1) continue;
    // With another time constant, found beside other members, it may have been far from its best.
    const EffectSet* known = seen(members);
    if (known != nullptr && (known->refitted || !any_lag(atoms_, *known))) continue;
    next.push_back(std::move(members));
  }
  std::vector<EffectSet> sets(next.size());
  oneapi::tbb::parallel_for(std::size_t{0}, next.size(), [&](std::size_t i) {
    Atom& added = next[i].back();
    added = known_shape(atoms_.refined(added, from.remainder), from.remainder);
    sets[i] = evaluate(std::move(next[i]));
  });
  for (EffectSet& set : sets) remember(std::move(set));
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
  EffectSet out = least_of_tried();
  // One step adds one effect, so two that stand for one are never reached.
  for (EffectSet& set : with_pairs(out))
    if (seen(set.members) == nullptr) tried_.push_back(std::move(set));
  out = best_refitted();
  complete(out);
  return out;
}

EffectSet Search::refitted(EffectSet set) const {
  if (!set.refitted && set.members.size() > 1 && any_lag(atoms_, set))
    set = evaluate(with_best_lags(atoms_, std::move(set.members), noise_.variance));
  set.refitted = true;
  return set;
}

void Search::refit_near(double criterion) {
  const double explained = (atoms_.base().white.squaredNorm() - least_of_tried().rss) / noise_.variance;
  const double within = criterion + std::max(kLagsOpen, kLagsOpenPart * explained);
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < tried_.size(); ++k)
    if (!tried_[k].refitted && tried_[k].criterion < within && tried_[k].members.size() > 1 &&
        any_lag(atoms_, tried_[k]))
      order.push_back(k);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return tried_[a].criterion < tried_[b].criterion; });
  if (order.size() > kMostRefitted) order.resize(kMostRefitted);
  oneapi::tbb::parallel_for(std::size_t{0}, order.size(),
                            [&](std::size_t i) { tried_[order[i]] = refitted(std::move(tried_[order[i]])); });
}

// Of the same effects in other variants the better one: beside other members another sensor may have been the
// one that suited.
void Search::remember(EffectSet set) {
  const auto key = families(set.members);
  const auto same = std::find_if(tried_.begin(), tried_.end(),
                                 [&](const EffectSet& other) { return families(other.members) == key; });
  if (same == tried_.end()) {
    tried_.push_back(std::move(set));
    return;
  }
  if (variants(set.members) != variants(same->members)) {
    set = refitted(std::move(set));
    *same = refitted(std::move(*same));
  }
  if (set.criterion < same->criterion) *same = std::move(set);
}

EffectSet Search::best_refitted() {
  if (!any_lag(atoms_, least_of_tried())) return least_of_tried();
  refit_near(least_of_tried().criterion);
  // A member that made up for time constants that were not the best ones is not needed beside those that are.
  // On the way to the set without all of them none may be significant.
  EffectSet now = refitted(least_of_tried());
  remember(now);
  for (bool fewer = true; fewer && now.members.size() > 1;) {
    fewer = false;
    const EffectSet from = now;
    for (std::size_t k = 0; k < from.members.size(); ++k) {
      std::vector<Atom> rest = from.members;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(k));
      EffectSet smaller = refitted(evaluate(std::move(rest)));
      remember(smaller);
      if (smaller.criterion < now.criterion) {
        now = std::move(smaller);
        fewer = true;
      }
    }
  }
  return least_of_tried();
}

const EffectSet& Search::least_of_tried() const {
  const EffectSet* best = &tried_.front();
  for (const EffectSet& set : tried_)
    if (set.significant(alpha_) && set.criterion < best->criterion) best = &set;
  return *best;
}

// `found` with a member exchanged for an effect of which one parameter alone gives the signal that was found:
// that its other parameters are 0 is no evidence against it, many errors are of one parameter.
void Search::add_twins(const EffectSet& found, std::vector<EffectSet>& out) const {
  for (const Atom& own : found.members) {
    std::vector<Atom> rest;
    for (const Atom& atom : found.members)
      if (atom.family != own.family) rest.push_back(atom);
    const Remainder given = atoms_.remainder(pointers(rest));
    const auto beside = [&](MatrixXd columns) {
      take_out(given.basis, columns);
      return columns;
    };
    const MatrixXd mine = pivoted_qr(beside(own.U().cast<double>()), kGivenRest).Q;
    const double drop = (mine.transpose() * given.residual).squaredNorm();
    for (const Atom& other : atoms_.all()) {
      const EffectInfo& info = atoms_.effect(other).info();
      const auto holds = [&](const EffectSet& set) { return has_family(set, other.family); };
      if (other.rank() == 0 || info.shape_count() > 0 || holds(found) ||
          std::any_of(out.begin(), out.end(), holds) || in_general(other, own) || in_general(own, other))
        continue;
      const MatrixXd columns = other.U().cast<double>() * other.to_columns;
      const MatrixXd left = beside(columns);
      for (Eigen::Index k = 0; k < left.cols(); ++k) {
        const double length = left.col(k).norm();
        if (length < kGivenRest * columns.col(k).norm() || length <= 0.0) continue;
        const VectorXd along = left.col(k) / length;
        const double size = along.dot(given.residual);
        const double lost = (drop - size * size) / noise_.variance;
        if ((mine.transpose() * along).norm() < kSameSignal ||
            std::abs(size) / length > kFarFromUsual * info.parameters[static_cast<std::size_t>(k)].usual ||
            (mine.cols() > 1 && chi2_tail(lost, static_cast<double>(mine.cols() - 1)) < kSuffices))
          continue;
        rest.push_back(other);
        out.push_back(evaluate(rest));
        rest.pop_back();
        break;
      }
    }
  }
}

// Members without whom the rest does better.
EffectSet Search::without_needless(EffectSet set) const {
  for (std::size_t k = 0; set.members.size() > 1 && k < set.members.size();) {
    std::vector<Atom> fewer = set.members;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(k));
    EffectSet smaller = evaluate(std::move(fewer));
    if (smaller.criterion < set.criterion) {
      set = std::move(smaller);
      k = 0;
    } else {
      ++k;
    }
  }
  return set;
}

// `found` with a member of two columns exchanged for two effects of one parameter that span the same beside
// the others: two squarenesses of Z with one length of tool are what an overhanging Z is beside a tilted
// spindle. What the others are no longer needed for goes.
std::vector<EffectSet> Search::with_pairs(const EffectSet& found) const {
  constexpr double kIndependent = 0.9;
  std::vector<EffectSet> out;
  for (const Atom& own : found.members) {
    std::vector<Atom> rest;
    for (const Atom& atom : found.members)
      if (atom.family != own.family) rest.push_back(atom);
    const Remainder given = atoms_.remainder(pointers(rest));
    MatrixXd mine = own.U().cast<double>();
    take_out(given.basis, mine);
    mine = pivoted_qr(mine, kGivenRest).Q;
    if (mine.cols() != 2) continue;
    std::vector<std::pair<const Atom*, VectorXd>> inside;
    for (const Atom& other : atoms_.all()) {
      const EffectInfo& info = atoms_.effect(other).info();
      if (other.rank() != 1 || info.linear_count() != 1 || info.shape_count() > 0 ||
          has_family(found, other.family))
        continue;
      MatrixXd left = other.U().cast<double>();
      take_out(given.basis, left);
      const double length = left.norm();
      if (length < kGivenRest || (mine.transpose() * left).norm() < kSameSignal * length) continue;
      inside.emplace_back(&other, left / length);
    }
    for (std::size_t a = 0; a < inside.size(); ++a)
      for (std::size_t b = a + 1; b < inside.size(); ++b) {
        if (inside[a].first->family == inside[b].first->family ||
            std::abs(inside[a].second.dot(inside[b].second)) > kIndependent)
          continue;
        std::vector<Atom> members = rest;
        members.push_back(*inside[a].first);
        members.push_back(*inside[b].first);
        EffectSet set = without_needless(evaluate(std::move(members)));
        if (set.significant(kRivalLevel)) out.push_back(std::move(set));
      }
  }
  return out;
}

// That two effects are rarer than one is in their price; where it is not enough, nobody can tell.
void Search::add_pairs(const EffectSet& found, std::vector<EffectSet>& out) const {
  for (EffectSet& set : with_pairs(found)) {
    const Families own = families(set.members);
    const bool known = std::any_of(out.begin(), out.end(),
                                   [&](const EffectSet& other) { return families(other.members) == own; });
    if (!known && set.criterion < found.criterion + kThousandToOne) out.push_back(std::move(set));
  }
}

bool Search::exchange_members(const EffectSet& set, std::set<Families>& looked) {
  bool any = false;
  for (std::size_t m = 0; m < set.members.size(); ++m) {
    std::vector<Atom> rest = set.members;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(m));
    if (!looked.insert(families(rest)).second) continue;
    expand(evaluated(std::move(rest)), kWideForRivals);
    any = true;
  }
  return any;
}

// Whether the rest of its set leaves the readings to say that the larger effect is the smaller one.
bool Search::more_is_seen(const EffectSet& set, const Atom& larger, const Atom& smaller) const {
  std::vector<const Atom*> beside = {&smaller};
  for (const Atom& atom : set.members)
    if (atom.family != larger.family && atom.family != smaller.family) beside.push_back(&atom);
  MatrixXd more = larger.U().cast<double>();
  take_out(atoms_.remainder(beside).basis, more);
  return thin_svd(more).s[0] > kSeenBeside;
}

std::vector<EffectSet> Search::rivals(EffectSet& found) {
  std::vector<EffectSet> out;
  bool swapped = true;
  for (int round = 0; swapped; ++round) {
    swapped = false;
    out.clear();
    for (const EffectSet& set : tried_) {
      if (set.members.empty() || set.members.size() > found.members.size() ||
          set.criterion >= found.criterion + kThousandToOne || !set.significant(kRivalLevel))
        continue;
      const auto mine = families(found.members), other_ones = families(set.members);
      if (std::includes(mine.begin(), mine.end(), other_ones.begin(), other_ones.end())) continue;
      // Nested spans: the smaller that suffices is named, the other is no rival.
      bool no_rival = false, nested = false;
      for (const Atom& other : set.members)
        for (const Atom& own : found.members) {
          if (other.family == own.family) continue;
          if (set.members.size() == found.members.size() && contains(own, other)) {
            const double lost = (set.rss - found.rss) / noise_.variance;
            const auto columns = static_cast<double>(own.rank() - other.rank());
            no_rival = true;
            if (round < kMostSwaps && chi2_tail(lost, columns) > kSuffices &&
                set.criterion < found.criterion + kWorthwhile) {
              const EffectSet smaller = set;
              found = smaller;
              complete(found);
              swapped = true;
            }
            break;
          }
          nested = nested || (contains(other, own) && more_is_seen(set, other, own));
        }
      if (swapped) break;
      const double margin = nested ? kUndecidedNested : kThousandToOne;
      if (!no_rival && set.criterion < found.criterion + margin) out.push_back(set);
    }
  }
  std::sort(out.begin(), out.end(),
            [](const EffectSet& a, const EffectSet& b) { return a.criterion < b.criterion; });
  return out;
}

// A large effect that stands in for two was the best of single ones, and the way to these leads through an
// exchange beside which it does nothing any more: it is left out then. Only for what leaves noise: beside
// that of very large effects the errors of this linear search are larger than what an exchange gains.
void Search::improve(EffectSet& found, std::set<Families>& looked) {
  for (int round = 0; round < kMostSwaps && exchange_members(found, looked); ++round) {
    // Which of two sets that nearly do the same is the nearer is not known before both are refitted.
    const bool lags = any_lag(atoms_, found);
    if (lags) refit_near(found.criterion);
    const auto least =
        std::min_element(tried_.begin(), tried_.end(),
                         [](const EffectSet& a, const EffectSet& b) { return a.criterion < b.criterion; });
    if (!lags && least->criterion < found.criterion) remember(without_needless(EffectSet(*least)));
    const EffectSet& best = least_of_tried();
    const double dof = atoms_.base().dof() - static_cast<double>(best.columns());
    if (!(best.criterion < found.criterion) || (!lags && best.rss > kLeavesNoise * dof)) return;
    found = EffectSet(best);
    complete(found);
    if (lags) return;
  }
}

std::vector<EffectSet> Search::alternatives(EffectSet& found) {
  // Beside the sets of the search: each member replaced by every other effect. That of what became the
  // smaller one, and of rivals, too: what stands for one member may need another one beside it.
  std::set<Families> looked;
  std::vector<EffectSet> out;
  improve(found, looked);
  for (bool more = exchange_members(found, looked) || !looked.empty(); more;) {
    refit_near(found.criterion);
    out = rivals(found);
    more = exchange_members(found, looked);
    for (const EffectSet& rival : out)
      if (looked.size() < kMostExchanged && exchange_members(rival, looked)) more = true;
  }
  add_twins(found, out);
  add_pairs(found, out);
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
    const double rounding = kRounding * unit.maxCoeff();
    for (double& u : unit) u = u > rounding ? 1.0 / u : 0.0;
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
