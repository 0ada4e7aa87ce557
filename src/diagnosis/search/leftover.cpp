#include "diagnosis/search/leftover.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <oneapi/tbb/parallel_for.h>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/statistics.hpp"
#include "diagnosis/search/neighbours.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::uint64_t kNeighbourSeed = 7;
constexpr double kSpreadMargin = 0.85;
constexpr double kClear = 0.01;        // level from which structure stands beside the noise
constexpr std::size_t kMostTaken = 3;  // blocks of it: more would take noise for structure
constexpr double kMostOfDof = 0.35;    // columns beside which the noise is judged, of the degrees of freedom
// Blocks of one covariate lie within each other: two tests of it count as one and a half. Twists overlap
// more.
constexpr double kShareOfBlocks = 0.75, kShareOfTwists = 0.4;
// Smooth functions overlap much; what is left below this is nothing new.
constexpr double kImitatedLeftover = 1e-3;

Structures::Freed free_of(const FitCore& base, const StructureBlock& block) {
  MatrixXd white = block.columns();
  base.whitening->whiten(white);
  Structures::Freed out;
  out.scale = white.colwise().norm().transpose();
  for (double& s : out.scale) s = s > 0.0 ? 1.0 / s : 0.0;
  base.whitening->take_setups(white);
  white = white * out.scale.asDiagonal();
  const MatrixXd in_base = base.basis.topRows(white.rows()).transpose() * white;
  out.gram = white.transpose() * white - in_base.transpose() * in_base;
  return out;
}

// Without correlation the normal equations suffice. `given`: columns of the set and, last, the residual,
// ready for products with raw columns.
Leftover::Test plain_test(const StructureBlock& block, const Structures::Freed& freed, const MatrixXd& given,
                          double variance) {
  const MatrixXd in_given = given.transpose() * block.columns() * freed.scale.asDiagonal();
  const MatrixXd in_set = in_given.topRows(given.cols() - 1);
  const SymmetricEigen eigen = symmetric_eigen(freed.gram - in_set.transpose() * in_set);
  const VectorXd along = eigen.vectors.transpose() * in_given.bottomRows(1).transpose();
  Leftover::Test out{block.covariate, 1.0, 0.0, 0};
  for (Eigen::Index k = 0; k < along.size(); ++k) {
    if (!(eigen.values[k] > kImitatedLeftover * kImitatedLeftover)) continue;
    out.drop += along[k] * along[k] / eigen.values[k] / variance;
    ++out.rank;
  }
  return out;
}

Leftover::Test test(const Atoms& atoms, const Remainder& set, const StructureBlock& block,
                    const Structures::Freed& freed, const NoiseScale& noise) {
  MatrixXd u = atoms.base().projected(block.columns());
  take_out(set.basis, u);
  u = pivoted_qr(u * freed.scale.asDiagonal(), kImitatedLeftover).Q;
  return {block.covariate, 1.0, corrected_drop(u, set.residual, noise), u.cols()};
}

// Set and residual as products with raw columns want them: what is free of set-ups needs no more than to be
// whitened once more.
MatrixXd given_of(const Atoms& atoms, const Remainder& set) {
  const Eigen::Index n = atoms.observations().size();
  const Whitening& whitening = *atoms.base().whitening;
  MatrixXd out(n, set.basis.cols() + 1);
  out << set.basis.topRows(n), set.residual.head(n);
  whitening.mix(out);
  return whitening.inverse_u().asDiagonal() * out;
}

// p-values over all tests, in order.
void finish(Leftover& out, const NoiseScale& noise) {
  for (auto& t : out.tests) {
    const auto k = static_cast<double>(t.rank);
    if (t.neighbours)
      t.p = normal_cdf(-t.z);
    else
      t.p = t.rank > 0 ? f_tail(t.drop / k, k, noise.test_dof()) : 1.0;
    t.p = smallest_of(t.p, out.tried);
  }
  std::stable_sort(out.tests.begin(), out.tests.end(),
                   [](const auto& a, const auto& b) { return a.p < b.p; });
  if (!out.tests.empty()) out.p = out.tests.front().p, out.drop = out.tests.front().drop;
}

}  // namespace

void Structures::fit_to(const FitCore& base) {
  twists.fit_to(base);
  freed.resize(blocks.size());
  oneapi::tbb::parallel_for(std::size_t{0}, blocks.size(),
                            [&](std::size_t i) { freed[i] = free_of(base, blocks[i]); });
}

Leftover leftover(const Atoms& atoms, const Remainder& left, const Structures& structures,
                  const NoiseScale& noise) {
  const Remainder set = atoms.bounded(left, noise.variance);
  Leftover out;
  const auto& blocks = structures.blocks;
  out.tests.resize(blocks.size());
  const MatrixXd given = noise.phi == 0.0 ? given_of(atoms, set) : MatrixXd();
  oneapi::tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t i) {
    const auto& freed = structures.freed[i];
    out.tests[i] = noise.phi == 0.0 ? plain_test(blocks[i], freed, given, noise.variance)
                                    : test(atoms, set, blocks[i], freed, noise);
    out.tests[i].block = i;
  });
  for (const NeighbourTest& n : neighbour_tests(atoms, set, noise, kNeighbourSeed)) {
    Leftover::Test t{n.covariate, 1.0, std::max(n.z, 0.0) * std::max(n.z, 0.0), 1};
    t.neighbours = true;
    // The spread is one of a few dozen series: its own error widens the tail.
    t.z = n.z * kSpreadMargin;
    out.tests.push_back(std::move(t));
  }
  for (const TwistBank::Hit& hit : structures.twists.best(atoms, set, noise)) {
    Leftover::Test t{structures.twists.covariate(hit), 1.0, hit.drop, hit.rank};
    t.twist = hit;
    out.tests.push_back(std::move(t));
  }
  const auto tested =
      std::count_if(out.tests.begin(), out.tests.end(), [](const auto& t) { return t.rank > 0 && !t.twist; });
  out.tried = kShareOfBlocks * static_cast<double>(tested) +
              kShareOfTwists * static_cast<double>(structures.twists.count());
  finish(out, noise);
  return out;
}

Leftover rescaled(Leftover tests, const NoiseScale& from, const NoiseScale& to) {
  for (auto& t : tests.tests)
    if (!t.neighbours) t.drop *= from.variance / to.variance;
  finish(tests, to);
  return tests;
}

Judgement judge(const Atoms& atoms, const Remainder& set, const Structures& structures,
                const MatrixXd& surrogate, std::uint64_t seed) {
  NoiseScale stated;
  stated.dof = kStatedDof;
  const Leftover raw = leftover(atoms, set, structures, stated);
  // Clear against the scatter itself too: where the stated uncertainty is too small everything looks clear.
  const NoiseScale plain = noise_scale(atoms, set, surrogate, seed);
  const double scatter = std::max(1.0, plain.raw_variance);
  const auto clear = [&](const Leftover::Test& t) {
    const auto k = static_cast<double>(t.rank);
    return smallest_of(f_tail(t.drop / scatter / k, k, plain.dof), raw.tried) < kClear;
  };
  MatrixXd beside = surrogate;
  const double room = kMostOfDof * atoms.base().dof();
  for (std::size_t k = 0, taken = 0; k < raw.tests.size() && taken < kMostTaken; ++k) {
    if (!(raw.tests[k].p < kClear)) break;
    if (raw.tests[k].neighbours || !clear(raw.tests[k])) continue;
    const MatrixXd columns = raw.tests[k].twist ? structures.twists.columns(*raw.tests[k].twist)
                                                : structures.blocks[raw.tests[k].block].columns();
    if (static_cast<double>(beside.cols() + columns.cols()) > room) continue;
    const Eigen::Index at = beside.cols();
    beside.conservativeResize(Eigen::NoChange, at + columns.cols());
    beside.rightCols(columns.cols()) = atoms.base().projected(columns);
    ++taken;
  }
  Judgement out;
  out.noise = beside.cols() == surrogate.cols() ? plain : noise_scale(atoms, set, beside, seed);
  out.left =
      out.noise.phi == 0.0 ? rescaled(raw, stated, out.noise) : leftover(atoms, set, structures, out.noise);
  return out;
}

Replicates replicates(const Observations& o, const FitCore& fit, const VectorXd& white, double model_dof) {
  std::map<std::vector<std::int64_t>, std::vector<Eigen::Index>> cells;
  const auto& used = fit.whitening->noise().used;
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    if (!used[static_cast<std::size_t>(i)]) continue;
    const MachineState& s = o.state(i);
    std::vector<std::int64_t> key = {static_cast<std::int64_t>(o.reading(i).group),
                                     std::llround(s.spindle_rpm)};
    for (std::size_t a = 0; a < o.machine().axes.size(); ++a) {
      key.push_back(std::llround(s.q[a] * 1e6));
      key.push_back(s.direction[a]);
      key.push_back(std::llround(s.velocity[a] * 1e6));
    }
    cells[key].push_back(i);
  }
  double pure = 0.0, pure_dof = 0.0;
  for (const auto& [key, cell] : cells) {
    double mean = 0.0;
    for (const Eigen::Index i : cell) mean += white[i] / static_cast<double>(cell.size());
    for (const Eigen::Index i : cell) pure += (white[i] - mean) * (white[i] - mean);
    pure_dof += static_cast<double>(cell.size()) - 1.0;
  }
  Replicates out;
  out.pure_dof = pure_dof;
  if (pure_dof < 4.0) return out;  // a variance from fewer says nothing
  out.pure_variance = pure / pure_dof;
  const double lack_dof = model_dof - pure_dof;
  if (lack_dof < 1.0) return out;
  const double lack = std::max(0.0, white.head(o.size()).squaredNorm() - pure);
  if (out.pure_variance > 0.0) out.p = f_tail(lack / lack_dof / out.pure_variance, lack_dof, pure_dof);
  return out;
}

}  // namespace trunnion::diagnosis
