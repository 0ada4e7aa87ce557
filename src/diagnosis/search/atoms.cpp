#include "diagnosis/search/atoms.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <oneapi/tbb/parallel_for.h>
#include <random>
#include <string_view>

#include "trunnion/base/contract.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/float_products.hpp"
#include "diagnosis/fit/statistics.hpp"
#include "diagnosis/search/structure.hpp"

namespace trunnion::diagnosis {
namespace {

// Part of a column (of its whitened length) below which the base imitates it: that of the positions stays
// below (as kRankTolerance of the fit), and an effect that must be 30 000 times its visible part is not
// tested but guessed.
constexpr double kImitated = 3e-5;
constexpr double kScored = 1e-3;    // part of a direction (squared) that a set must leave for it to be scored
constexpr double kBound = 2.5;      // standard deviations: 99 % of good readings lie within
constexpr int kFewestForRough = 4;  // outliers: fewer say nothing of those below the limit
constexpr std::size_t kChunk = 64;
constexpr double kMostSteps = 1.5;  // of the grid of periods, that a refinement may go

// A cross-talk is a product: where one axis stands still while the other moves it is no more than a component
// error of the other, and only that may be named.
bool crosses(const Observations& o, const EffectInfo& info) {
  constexpr std::string_view kKind = "crosstalk:";
  if (!info.id.starts_with(kKind) || info.id.size() != kKind.size() + 2) return true;
  const auto positions = [&](char name) {
    VectorXd out = VectorXd::Zero(o.size());
    const auto& axes = o.machine().axes;
    for (AxisId a = 0; a < axes.size(); ++a)
      if (axes[a].name == std::string(1, name))
        for (Eigen::Index i = 0; i < o.size(); ++i) out[i] = o.state(i).q[a];
    return out;
  };
  return joint_variation(positions(info.id[kKind.size()]), positions(info.id[kKind.size() + 1])) > 0;
}

// What is over within milliseconds of a reversal is shown by rows that follow one that soon: where they are
// seconds apart, the first one behind it says nothing of it.
bool shows_spikes(const Observations& o, AxisId axis) {
  constexpr double kSoon_s = 0.1;
  constexpr int kFewest = 6;
  std::vector<Eigen::Index> rows(static_cast<std::size_t>(o.size()));
  std::iota(rows.begin(), rows.end(), Eigen::Index{0});
  std::stable_sort(rows.begin(), rows.end(), [&](Eigen::Index a, Eigen::Index b) {
    return std::pair(o.state(a).run, o.state(a).time_s) < std::pair(o.state(b).run, o.state(b).time_s);
  });
  int count = 0;
  double reversed_s = -INFINITY;
  for (std::size_t k = 1; k < rows.size(); ++k) {
    const MachineState& before = o.state(rows[k - 1]);
    const MachineState& now = o.state(rows[k]);
    if (before.run != now.run)
      reversed_s = -INFINITY;
    else if (before.direction[axis] != now.direction[axis])
      reversed_s = now.time_s;
    const double since_s = now.time_s - reversed_s;
    count += since_s > 0.0 && since_s < kSoon_s ? 1 : 0;
  }
  return count >= kFewest;
}

bool shown_by(const Observations& o, const Effect& effect) {
  if (effect.info().id.starts_with("reversal_spike:")) return shows_spikes(o, effect.link().axis);
  return crosses(o, effect.info());
}

}  // namespace

Atoms::Atoms(const Observations& observations, const FitCore& base, std::vector<EffectFamily> library)
    : o_(observations), base_(base), library_(std::move(library)) {
  const auto& used = base.whitening->noise().used;
  rough_ = std::count(used.begin(), used.end(), false) >= kFewestForRough;
  struct Task {
    std::size_t family, variant;
    std::vector<std::vector<double>> shapes;
    std::vector<Atom> out;
  };
  std::vector<Task> tasks;
  for (std::size_t f = 0; f < library_.size(); ++f) {
    if (!shown_by(o_, *library_[f].variants.front())) continue;
    for (std::size_t v = 0; v < library_[f].variants.size(); ++v) {
      const auto grid = shape_grid(o_, *library_[f].variants[v]);
      for (std::size_t k = 0; k < grid.size(); k += kChunk)
        tasks.push_back({f,
                         v,
                         {grid.begin() + static_cast<std::ptrdiff_t>(k),
                          grid.begin() + static_cast<std::ptrdiff_t>(std::min(grid.size(), k + kChunk))},
                         {}});
    }
  }
  oneapi::tbb::parallel_for(std::size_t{0}, tasks.size(), [&](std::size_t i) {
    tasks[i].out = make_atoms(tasks[i].family, tasks[i].variant, tasks[i].shapes);
  });
  for (Task& task : tasks)
    for (Atom& atom : task.out) atoms_.push_back(std::move(atom));
  count_columns();
}

Atoms::Atoms(const Atoms& other, const FitCore& base)
    : o_(other.o_),
      base_(base),
      library_(other.library_),
      atoms_(other.atoms_),
      first_(other.first_),
      moments_(with_residual()),
      memory_(other.memory_),
      rough_(other.rough_) {}

Atoms Atoms::without_shapes() const {
  Atoms out = *this;
  std::erase_if(out.atoms_, [](const Atom& atom) { return !atom.shape.empty(); });
  out.memory_ = std::make_shared<Memory>();
  out.count_columns();
  return out;
}

void Atoms::count_columns() {
  first_ = {0};
  for (const Atom& atom : atoms_) first_.push_back(first_.back() + atom.rank());
  moments_ = with_residual();
}

Eigen::MatrixXf Atoms::with_residual() const {
  const Eigen::VectorXf residual = base_.white.cast<float>();
  Eigen::MatrixXf out(first_.back(), 1);
  oneapi::tbb::parallel_for(std::size_t{0}, atoms_.size(), [&](std::size_t i) {
    out.middleRows(first_[i], atoms_[i].rank()) = inner_products(atoms_[i].U(), residual);
  });
  return out;
}

std::vector<Atom> Atoms::make_atoms(std::size_t family, std::size_t variant,
                                    const std::vector<std::vector<double>>& shapes) const {
  const Effect& effect = *library_[family].variants[variant];
  const auto k = static_cast<Eigen::Index>(effect.info().linear_count());
  MatrixXd raw(o_.size(), k * static_cast<Eigen::Index>(shapes.size()));
  for (std::size_t s = 0; s < shapes.size(); ++s)
    raw.middleCols(static_cast<Eigen::Index>(s) * k, k) = o_.linear_columns(effect, shapes[s]);
  MatrixXd white = raw;
  base_.whitening->whiten(white);
  const Eigen::RowVectorXd length = white.colwise().norm();
  white = base_.projected(raw);
  for (Eigen::Index c = 0; c < white.cols(); ++c) white.col(c) *= length[c] > 0.0 ? 1.0 / length[c] : 0.0;
  std::vector<Atom> out;
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    const auto block = white.middleCols(static_cast<Eigen::Index>(s) * k, k);
    const MatrixXd q = pivoted_qr(block, kImitated).Q;
    const VectorXd units = length.segment(static_cast<Eigen::Index>(s) * k, k).transpose();
    out.push_back({family, variant, shapes[s], std::make_shared<Eigen::MatrixXf>(q.cast<float>()),
                   q.transpose() * block * units.asDiagonal()});
  }
  return out;
}

Remainder Atoms::bounded(Remainder set, double variance) const {
  if (!rough_) return set;
  const double most = kBound * std::sqrt(variance);
  MatrixXd r = set.residual.cwiseMax(-most).cwiseMin(most);
  base_.whitening->take_setups(r.topRows(o_.size()));
  take_out(base_.basis, r);
  take_out(set.basis, r);
  set.residual = r.col(0);
  return set;
}

Atom Atoms::make_atom(std::size_t family, std::size_t variant, const std::vector<double>& shape) const {
  return make_atoms(family, variant, {shape}).front();
}

Remainder Atoms::remainder(const std::vector<const Atom*>& set) const {
  Eigen::Index width = 0;
  for (const Atom* atom : set) width += atom->rank();
  Remainder out;
  MatrixXd all(base_.white.size(), width);
  Eigen::Index at = 0;
  for (const Atom* atom : set) {
    all.middleCols(at, atom->rank()) = atom->U().cast<double>();
    at += atom->rank();
  }
  if (width > 0) {
    out.basis = pivoted_qr(all, kTaken).Q;
  } else {
    out.basis.resize(base_.white.size(), 0);
  }
  out.residual = base_.white;
  take_out(out.basis, out.residual);
  return out;
}

Products Atoms::products(const std::vector<const Atom*>& set) const {
  Products out;
  out.first = {0};
  for (const Atom* atom : set) out.first.push_back(out.first.back() + atom->rank());
  const Eigen::Index width = out.first.back();
  out.gram = MatrixXd::Identity(width, width);
  out.moments.resize(width);
  const Eigen::VectorXf residual = base_.white.cast<float>();
  for (std::size_t i = 0; i < set.size(); ++i) {
    const Eigen::Index at = out.first[i], rows = set[i]->rank();
    out.moments.segment(at, rows) = inner_products(set[i]->U(), residual).cast<double>();
    for (std::size_t k = 0; k < i; ++k) {
      const MatrixXd block = inner_products(set[i]->U(), set[k]->U()).cast<double>();
      out.gram.block(at, out.first[k], rows, set[k]->rank()) = block;
      out.gram.block(out.first[k], at, set[k]->rank(), rows) = block.transpose();
    }
  }
  return out;
}

std::shared_ptr<const Eigen::MatrixXf> Atoms::with_all(const Atom& atom) const {
  {
    const std::scoped_lock lock(memory_->mutex);
    const auto found = memory_->kept.find(atom.span.get());
    if (found != memory_->kept.end()) return found->second.products;
  }
  auto out = std::make_shared<Eigen::MatrixXf>(first_.back(), atom.rank());
  oneapi::tbb::parallel_for(std::size_t{0}, atoms_.size(), [&](std::size_t i) {
    out->middleRows(first_[i], atoms_[i].rank()) = inner_products(atoms_[i].U(), atom.U());
  });
  const std::scoped_lock lock(memory_->mutex);
  memory_->kept[atom.span.get()] = {atom.span, out};
  return out;
}

namespace {

// b' G^-1 b over the directions of which enough is left.
Score score_of(const MatrixXd& gram, const VectorXd& b) {
  const SymmetricEigen eigen = symmetric_eigen(gram);
  const VectorXd along = eigen.vectors.transpose() * b;
  Score out;
  for (Eigen::Index k = 0; k < along.size(); ++k) {
    if (eigen.values[k] < kScored) continue;
    out.drop += along[k] * along[k] / eigen.values[k];
    ++out.rank;
  }
  return out;
}

}  // namespace

Score Atoms::score(const Atom& atom, const Remainder& given) const {
  if (atom.rank() == 0) return {};
  const VectorXd b = inner_products(atom.U(), given.residual.cast<float>()).cast<double>();
  if (given.basis.cols() == 0) return {b.squaredNorm(), atom.rank()};
  const MatrixXd m = inner_products(atom.U(), given.basis.cast<float>()).cast<double>();
  return score_of(MatrixXd::Identity(atom.rank(), atom.rank()) - m * m.transpose(), b);
}

std::vector<Atoms::Best> Atoms::best_of_each(const std::vector<const Atom*>& set, double scale) const {
  // With M = U'V, V the set's columns: U'(I - BB')U = I - M (V'V)^+ M', likewise the residual.
  const Products inside = products(set);
  Eigen::MatrixXf with_set(first_.back(), inside.gram.cols());
  for (std::size_t k = 0; k < set.size(); ++k)
    with_set.middleCols(inside.first[k], set[k]->rank()) = *with_all(*set[k]);
  const MatrixXd inverse = inverse_above(inside.gram, kTaken * kTaken);
  const VectorXd explained = inverse * inside.moments;
  std::vector<Score> scores(atoms_.size());
  oneapi::tbb::parallel_for(std::size_t{0}, atoms_.size(), [&](std::size_t i) {
    const Eigen::Index rank = atoms_[i].rank();
    if (rank == 0) return;
    VectorXd b = moments_.block(first_[i], 0, rank, 1).cast<double>();
    if (set.empty()) {
      scores[i] = {b.squaredNorm(), rank};
      return;
    }
    const MatrixXd m = with_set.middleRows(first_[i], rank).cast<double>();
    b -= m * explained;
    scores[i] = score_of(MatrixXd::Identity(rank, rank) - m * inverse * m.transpose(), b);
  });
  std::vector<Best> out(library_.size());
  for (std::size_t i = 0; i < atoms_.size(); ++i) {
    if (scores[i].rank == 0) continue;
    const double p = chi2_tail(scores[i].drop / scale, static_cast<double>(scores[i].rank));
    Best& best = out[atoms_[i].family];
    // Beyond the range of double the drop decides.
    if (best.atom != nullptr && (p > best.p || (p == best.p && scores[i].drop <= best.score.drop))) continue;
    best = {&atoms_[i], scores[i], p};
  }
  return out;
}

Atom Atoms::refined(const Atom& atom, const Remainder& given) const {
  const auto& info = effect(atom).info();
  if (info.shape_count() != 1) return atom;
  const Parameter& p = info.parameters.back();
  if (p.integer) return atom;
  if (info.id == "step") return refined_step(atom, given);
  // In 1/p for periods, in ln tau for time constants: there the score is a smooth hump.
  const bool period = info.id.starts_with("periodic:");
  const auto to = [&](double x) { return period ? 1.0 / x : std::log(x); };
  const auto from = [&](double u) { return period ? 1.0 / u : std::exp(u); };
  if (!(atom.shape[0] > 0.0)) return atom;
  std::vector<double> grid;
  for (const Atom& other : atoms_)
    if (other.family == atom.family && other.variant == atom.variant) grid.push_back(to(other.shape[0]));
  std::sort(grid.begin(), grid.end());
  const double at = to(atom.shape[0]);
  const auto above = std::upper_bound(grid.begin(), grid.end(), at + 1e-12);
  const auto below = std::lower_bound(grid.begin(), grid.end(), at - 1e-12);
  double high = above == grid.end() ? at : *above, low = below == grid.begin() ? at : *(below - 1);
  // Periods that the sampled positions alias are gaps of the grid: no way into them.
  if (period && grid.size() > 1) {
    std::vector<double> gaps;
    for (std::size_t k = 1; k < grid.size(); ++k) gaps.push_back(grid[k] - grid[k - 1]);
    const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
    std::nth_element(gaps.begin(), middle, gaps.end());
    high = std::min(high, at + kMostSteps * *middle);
    low = std::max(low, at - kMostSteps * *middle);
  }
  if (!(high > low)) return atom;
  Atom best = atom;
  double best_drop = score(atom, given).drop;
  constexpr double kGolden = 0.6180339887498949;
  const auto value = [&](double u) {
    Atom trial = make_atom(atom.family, atom.variant, {from(u)});
    const double drop = score(trial, given).drop;
    if (drop > best_drop) best_drop = drop, best = std::move(trial);
    return drop;
  };
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double fa = value(a), fb = value(b);
  for (int i = 0; i < 10; ++i) {
    if (fa > fb)
      high = b, b = a, fb = fa, a = high - kGolden * (high - low), fa = value(a);
    else
      low = a, a = b, fa = fb, b = low + kGolden * (high - low), fb = value(b);
  }
  return best;
}

Atom Atoms::refined_step(const Atom& atom, const Remainder& given) const {
  double low = -INFINITY, high = INFINITY;
  for (const Atom& other : atoms_) {
    if (other.family != atom.family || other.variant != atom.variant) continue;
    if (other.shape[0] < atom.shape[0]) low = std::max(low, other.shape[0]);
    if (other.shape[0] > atom.shape[0]) high = std::min(high, other.shape[0]);
  }
  Atom best = atom;
  double best_drop = score(atom, given).drop;
  for (const double t : step_moments(o_, effect(atom), low, high)) {
    Atom trial = make_atom(atom.family, atom.variant, {t});
    if (const double drop = score(trial, given).drop; drop > best_drop)
      best_drop = drop, best = std::move(trial);
  }
  return best;
}

Atoms::Multiplicity Atoms::multiplicity(std::size_t simulations, std::uint64_t seed) const {
  std::mt19937_64 engine(seed);
  std::normal_distribution<float> normal;
  const auto count = static_cast<Eigen::Index>(simulations);
  Eigen::MatrixXf noise(base_.white.size(), count);
  for (Eigen::Index c = 0; c < count; ++c)
    for (Eigen::Index i = 0; i < noise.rows(); ++i) noise(i, c) = normal(engine);
  std::vector<Eigen::VectorXf> drop(atoms_.size());
  oneapi::tbb::parallel_for(std::size_t{0}, atoms_.size(), [&](std::size_t a) {
    if (atoms_[a].rank() > 0)
      drop[a] = inner_products(atoms_[a].U(), noise).colwise().squaredNorm().transpose();
  });
  // Largest drop of each family and rank first: a tail probability costs more than all the rest.
  std::map<std::pair<std::size_t, Eigen::Index>, Eigen::VectorXf> largest;
  for (std::size_t a = 0; a < atoms_.size(); ++a) {
    if (drop[a].size() == 0) continue;
    auto [it, fresh] = largest.try_emplace({atoms_[a].family, atoms_[a].rank()}, drop[a]);
    if (!fresh) it->second = it->second.cwiseMax(drop[a]);
  }
  MatrixXd smallest = MatrixXd::Ones(static_cast<Eigen::Index>(library_.size()), count);
  for (const auto& [key, drops] : largest)
    for (Eigen::Index c = 0; c < count; ++c) {
      double& p = smallest(static_cast<Eigen::Index>(key.first), c);
      p = std::min(p, chi2_tail(static_cast<double>(drops[c]), static_cast<double>(key.second)));
    }
  const auto effective = [count](VectorXd values) {
    std::nth_element(values.data(), values.data() + count / 2, values.data() + count);
    const double median = std::max(values[count / 2], 1e-12);
    // The median of the smallest of m uniform numbers is 1 - 2^(-1/m).
    return median >= 0.5 ? 1.0 : std::log(2.0) / -std::log1p(-median);
  };
  Multiplicity out;
  for (Eigen::Index f = 0; f < smallest.rows(); ++f) {
    out.shapes.push_back(effective(smallest.row(f).transpose()));
    for (Eigen::Index c = 0; c < count; ++c) smallest(f, c) = smallest_of(smallest(f, c), out.shapes.back());
  }
  if (smallest.rows() > 0) out.families = effective(smallest.colwise().minCoeff().transpose());
  return out;
}

}  // namespace trunnion::diagnosis
