#include "diagnosis/search/run_factors.hpp"

#include <algorithm>
#include <cmath>
#include <oneapi/tbb/parallel_for.h>

namespace trunnion::diagnosis {
namespace {

constexpr double kAffordable =
    2e9;  // products: readings times columns of the library, over all that is tried

double columns(const Atoms& atoms) {
  double out = 0.0;
  for (const Atom& atom : atoms.all()) out += static_cast<double>(atom.rank());
  return out;
}

// The best effects beside these readings, their uncertainty taken at its word.
EffectSet best(const Atoms& atoms, const Atoms::Multiplicity& multiplicity, double level, std::size_t depth) {
  NoiseScale stated;
  stated.dof = kStatedDof;
  return Search(atoms, multiplicity, stated, level, depth).best();
}

// What a set costs once readings of a run are multiplied, in -2 ln of their probability: of another unit of
// readings and uncertainties the weights, of readings alone the density.
double cost(const EffectSet& set, const RunFactor& f, const std::vector<Eigen::Index>& rows) {
  if (f.factor < 0.0) return set.criterion;
  if (!f.with_uncertainty) return set.criterion - 2.0 * static_cast<double>(rows.size()) * std::log(f.factor);
  double left = 0.0;
  for (const Eigen::Index i : rows) left += std::pow(set.remainder.residual[i], 2);
  return set.criterion + (1.0 / (f.factor * f.factor) - 1.0) * left;
}

bool of_one_quantity(const Observations& o, std::size_t run, Quantity quantity) {
  return std::all_of(o.runs()[run].begin(), o.runs()[run].end(),
                     [&](Eigen::Index i) { return o.reading(i).quantity == quantity; });
}

std::vector<RunFactor> factors_of(const Observations& o, std::size_t run) {
  std::vector<RunFactor> out = {{.run = run, .factor = -1.0}};
  if (!of_one_quantity(o, run, Quantity::rotation)) return out;
  out.push_back({.run = run, .factor = kUradPerArcsec});
  // Smaller readings beside the same uncertainties would explain away whatever is not understood.
  out.push_back({.run = run, .factor = 1.0 / kUradPerArcsec, .with_uncertainty = true});
  return out;
}

}  // namespace

std::vector<std::size_t> in_order_of_misfit(const Observations& o, const VectorXd& white) {
  const auto& runs = o.runs();
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t run = 0; run < runs.size(); ++run) {
    double sum = 0.0;
    for (const Eigen::Index i : runs[run]) sum += std::pow(white[i], 2);
    order.emplace_back(-sum, run);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> out;
  for (const auto& [sum, run] : order)
    if (!runs[run].empty()) out.push_back(run);
  return out;
}

RunFactors run_factors(const Atoms& all_shapes, const Atoms::Multiplicity& multiplicity, double level,
                       std::size_t depth) {
  const Observations& o = all_shapes.observations();
  RunFactors out;
  if (o.runs().size() < 2) return out;
  const Atoms atoms = all_shapes.without_shapes();
  const double affordable = kAffordable / std::max(1.0, columns(atoms) * static_cast<double>(o.size()));
  std::vector<RunFactor> all;
  for (const std::size_t run : in_order_of_misfit(o, atoms.base().white))
    for (const RunFactor& f : factors_of(o, run))
      if (static_cast<double>(all.size()) < affordable) all.push_back(f);
  const double as_they_are = best(atoms, multiplicity, level, depth).criterion;
  oneapi::tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t k) {
    RunFactor& f = all[k];
    const auto& rows = o.runs()[f.run];
    VectorXd more = VectorXd::Zero(o.size());
    for (const Eigen::Index i : rows) more[i] = (f.factor - 1.0) * o.values()[i];
    FitCore changed = atoms.base();
    changed.white += changed.projected(more);
    const EffectSet set = best(Atoms(atoms, changed), multiplicity, level, depth);
    f.gain = as_they_are - cost(set, f, rows);
    if (f.factor < 1.0) return;
    RunFactor other = f;
    other.with_uncertainty = true;
    other.gain = as_they_are - cost(set, other, rows);
    if (other.gain > f.gain) f = other;
  });
  out.tried = static_cast<double>(all.size());
  std::erase_if(all, [](const RunFactor& f) { return !(f.gain > 0.0); });
  std::stable_sort(all.begin(), all.end(),
                   [](const RunFactor& a, const RunFactor& b) { return a.gain > b.gain; });
  out.better = std::move(all);
  return out;
}

}  // namespace trunnion::diagnosis
