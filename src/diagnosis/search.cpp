#include "diagnosis/search.hpp"

#include <algorithm>
#include <cmath>
#include <set>

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
constexpr double kKnownPeriod =
    6.0;  // chi-square that a known period may be worse than the best one and still be meant
constexpr double kUndetermined = 1e-10;  // square of a singular value of columns of length 1
constexpr double kSureAnyhow = 1e-6;     // p-value below which a few readings cannot be the reason
constexpr double kFarFromUsual = 10.0;   // times its usual magnitude: an effect there costs evidence, slowly

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
  const Svd svd = thin_svd((a.U.transpose() * b.U).cast<double>());
  return std::min(1.0, svd.s[0]);
}

bool Search::contains(const Atom& larger, const Atom& smaller) const {
  if (larger.rank() <= smaller.rank() || smaller.rank() == 0) return false;
  const auto& named = atoms_.effect(larger).info().contains;
  const std::string& id = atoms_.effect(smaller).info().id;
  if (std::find(named.begin(), named.end(), id) != named.end()) return true;
  const Svd svd = thin_svd((larger.U.transpose() * smaller.U).cast<double>());
  return svd.s.size() == smaller.rank() && svd.s[svd.s.size() - 1] > kSameSpan;
}

EffectSet Search::evaluate(std::vector<Atom> members) const {
  EffectSet out;
  out.members = std::move(members);
  std::vector<const Atom*> all;
  for (const Atom& atom : out.members) all.push_back(&atom);
  out.remainder = atoms_.remainder(all);
  out.criterion = out.remainder.rss() / noise_.variance;
  for (std::size_t k = 0; k < out.members.size(); ++k) {
    std::vector<const Atom*> rest = all;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(k));
    const Remainder given = atoms_.remainder(rest);
    MatrixXd u = out.members[k].U.cast<double>();
    u -= given.basis * (given.basis.transpose() * u);
    u = pivoted_qr(u, 0.03).Q;  // the square root of what a set must leave of a direction
    out.drop.push_back(corrected_drop(u, given.residual, noise_));
    out.rank.push_back(u.cols());
    out.p.push_back(global_p(out.members[k].family, out.drop.back(), u.cols()));
    if (atoms_.rough() && out.p.back() > kSureAnyhow) {
      const double bounded = corrected_drop(u, atoms_.bounded(given, noise_.variance).residual, noise_);
      out.p.back() = std::max(out.p.back(), global_p(out.members[k].family, bounded, u.cols()));
    }
    out.criterion += occam(out.drop.back(), static_cast<double>(u.cols())) +
                     2.0 * std::log(multiplicity_.shapes[out.members[k].family]) +
                     2.0 * std::log(multiplicity_.families);
  }
  out.criterion += implausibility(out);
  return out;
}

// A student's t prior would say the same: parameters far beyond what machines show need more evidence.
double Search::implausibility(const EffectSet& set) const {
  const SetEstimate e = estimate(atoms_, set.members);
  double sum = 0.0;
  for (std::size_t m = 0; m < set.members.size(); ++m) {
    const auto& info = atoms_.effect(set.members[m]).info();
    double worst = 0.0;
    for (std::size_t k = 0; k < e.values[m].size(); ++k)
      worst = std::max(worst, (std::abs(e.values[m][k]) - 2.0 * e.sigmas[m][k]) /
                                  std::max(std::abs(info.parameters[k].usual), 1e-12));
    sum += 2.0 * std::log1p(std::pow(std::max(worst, 0.0) / kFarFromUsual, 2));
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
  auto best = atoms_.best_of_each(from.remainder, noise_.variance);
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
  std::size_t added = 0;
  for (const auto& [value, f] : order) {
    if (added >= keep || value > kUndecided) break;
    std::vector<Atom> members = from.members;
    members.push_back(*best[f].atom);
    if (families(members).count(f) > 1 || seen(members) != nullptr) continue;
    members.back() = known_shape(atoms_.refined(members.back(), from.remainder), from.remainder);
    tried_.push_back(evaluate(std::move(members)));
    ++added;
  }
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
    for (const std::size_t i : level) expand(EffectSet(tried_[i]), kWide);
  }
  const EffectSet* best = &tried_.front();
  for (const EffectSet& set : tried_)
    if (set.significant(alpha_) && set.criterion < best->criterion) best = &set;
  return *best;
}

std::vector<EffectSet> Search::alternatives(EffectSet& found) {
  // Beside the sets of the search: each member replaced by every other effect.
  for (std::size_t m = 0; m < found.members.size(); ++m) {
    std::vector<Atom> rest = found.members;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(m));
    const EffectSet without = evaluate(rest);
    expand(without, kWide);
  }
  std::vector<EffectSet> out;
  bool swapped = true;
  for (int round = 0; swapped && round < 3; ++round) {
    swapped = false;
    out.clear();
    for (const EffectSet& set : tried_) {
      if (set.members.empty() || set.members.size() > found.members.size() || !set.significant(alpha_))
        continue;
      const auto mine = families(found.members), other_ones = families(set.members);
      if (std::includes(mine.begin(), mine.end(), other_ones.begin(), other_ones.end())) continue;
      // Nested spans: the smaller that suffices is named, the other is no rival.
      bool no_rival = false;
      for (const Atom& other : set.members)
        for (const Atom& own : found.members) {
          if (other.family == own.family) continue;
          if (set.members.size() == found.members.size() && contains(own, other)) {
            const double lost = (set.remainder.rss() - found.remainder.rss()) / noise_.variance;
            const auto columns = static_cast<double>(own.rank() - other.rank());
            no_rival = true;
            if (chi2_tail(lost, columns) > alpha_ && set.criterion < found.criterion + kUndecided) {
              const EffectSet smaller = set;
              found = smaller;
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
  SetEstimate out;
  std::vector<MatrixXd> blocks;
  Eigen::Index width = 0;
  for (const Atom& atom : members) {
    blocks.push_back(
        atoms.base().projected(atoms.observations().linear_columns(atoms.effect(atom), atom.shape)));
    width += blocks.back().cols();
  }
  MatrixXd all(atoms.base().white.size(), width);
  Eigen::Index at = 0;
  for (const MatrixXd& block : blocks) {
    all.middleCols(at, block.cols()) = block;
    at += block.cols();
  }
  VectorXd scale = all.colwise().norm().transpose();
  for (Eigen::Index k = 0; k < width; ++k) {
    scale[k] = scale[k] > 0.0 ? 1.0 / scale[k] : 0.0;
    all.col(k) *= scale[k];
  }
  const SymmetricEigen eigen = symmetric_eigen(all.transpose() * all);
  VectorXd inverse = eigen.values;
  for (double& v : inverse) v = v > kUndetermined ? 1.0 / v : 0.0;
  const MatrixXd half = scale.asDiagonal() * eigen.vectors * inverse.cwiseSqrt().asDiagonal();
  const VectorXd value =
      scale.asDiagonal() *
      (eigen.vectors *
       (inverse.asDiagonal() * (eigen.vectors.transpose() * (all.transpose() * atoms.base().white))));
  at = 0;
  for (const MatrixXd& block : blocks) {
    out.values.emplace_back();
    out.sigmas.emplace_back();
    for (Eigen::Index k = 0; k < block.cols(); ++k, ++at) {
      out.values.back().push_back(value[at]);
      out.sigmas.back().push_back(half.row(at).norm());
    }
  }
  return out;
}

}  // namespace trunnion::diagnosis
