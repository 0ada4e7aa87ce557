#include "diagnosis/search/ranking.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/statistics.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kPower = 0.95;       // of a detection limit
constexpr double kReportedRho = 0.5;  // rivals below are told apart easily
constexpr std::size_t kMostRivals = 5;
constexpr std::size_t kHeldOut = 8;  // effects whose held-out gain is computed
constexpr double kMostDetectable_um =
    1e5;  // beyond a tenth of a millimetre of error "not excited" is the honest word

// RMS at the readings (rotations as um at 1 m) of the smallest contribution that would be seen, along the
// combination of parameters that is seen best, each counted in its usual magnitude. `level`: of the test.
std::optional<double> detectable(const Atoms& atoms, const Atom& atom, const NoiseScale& noise,
                                 double level) {
  if (atom.rank() == 0) return std::nullopt;
  const auto& info = atoms.effect(atom).info();
  MatrixXd raw = atoms.observations().linear_columns(atoms.effect(atom), atom.shape);
  for (Eigen::Index k = 0; k < raw.cols(); ++k)
    raw.col(k) *= info.parameters[static_cast<std::size_t>(k)].usual;
  const MatrixXd seen = atoms.base().projected(raw);
  const SymmetricEigen eigen = symmetric_eigen(seen.transpose() * seen);
  const Eigen::Index best = eigen.values.size() - 1;  // in ascending order
  if (best < 0 || !(eigen.values[best] > 0.0)) return std::nullopt;
  const double lambda =
      needed_noncentrality(static_cast<double>(atom.rank()), level, kPower) * noise.variance;
  VectorXd change = raw * eigen.vectors.col(best) * std::sqrt(lambda / eigen.values[best]);
  for (Eigen::Index i = 0; i < change.size(); ++i)
    change[i] /= atoms.observations().reading(i).quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad;
  const double rms = std::sqrt(change.squaredNorm() / static_cast<double>(change.size()));
  return rms < kMostDetectable_um ? std::optional(rms) : std::nullopt;
}

std::vector<Rival> rivals(const Atoms& atoms, const std::vector<Atoms::Best>& best, const Atom& atom) {
  std::vector<Rival> out;
  for (const auto& other : best) {
    if (other.atom == nullptr || other.atom->family == atom.family) continue;
    if (const double rho = Search::rho(atom, *other.atom); rho >= kReportedRho)
      out.push_back({atoms.library()[other.atom->family].id(), rho});
  }
  std::stable_sort(out.begin(), out.end(), [](const Rival& a, const Rival& b) { return a.rho > b.rho; });
  if (out.size() > kMostRivals) out.resize(kMostRivals);
  return out;
}

}  // namespace

std::vector<RankedParameter> printed_parameters(const Effect& effect, const std::vector<double>& values,
                                                const std::vector<double>& sigmas,
                                                const std::vector<double>& shape) {
  std::vector<RankedParameter> out;
  const auto& parameters = effect.info().parameters;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const double unit = unit_factor(parameters[k].unit);
    const bool linear = k < values.size();
    const double value = linear ? values[k] : shape[k - values.size()];
    RankedParameter p{parameters[k].key(), value / unit, std::nullopt};
    if (linear && sigmas[k] > 0.0) p.sigma = sigmas[k] / unit;
    out.push_back(std::move(p));
  }
  return out;
}

namespace {

std::optional<double> measured(double rms) {
  return std::isfinite(rms) ? std::optional(rms) : std::nullopt;
}

// A family of which these readings see nothing.
Atom unseen(std::size_t family, Eigen::Index rows) {
  Atom out;
  out.family = family;
  out.span = std::make_shared<Eigen::MatrixXf>(rows, 0);
  return out;
}

}  // namespace

std::vector<RankedEffect> ranking(const Atoms& atoms, const Search& search, const NoiseScale& noise,
                                  const EffectSet& found, double alpha) {
  const Remainder nothing = atoms.remainder({});
  const auto best = atoms.best_of_each({}, noise.variance);
  const auto found_ids = found.ids(atoms);
  std::vector<std::pair<RankedEffect, Atom>> all;
  for (std::size_t f = 0; f < best.size(); ++f) {
    RankedEffect r;
    r.id = atoms.library()[f].id();
    Atom atom;
    const auto member = std::find_if(found.members.begin(), found.members.end(),
                                     [f](const Atom& a) { return a.family == f; });
    if (member != found.members.end())
      atom = *member;
    else if (best[f].atom != nullptr)
      atom = *best[f].atom;
    else {
      all.emplace_back(std::move(r), unseen(f, atoms.base().white.size()));
      continue;
    }
    r.variant = atoms.effect(atom).info().variant;
    r.chi2_drop = corrected_drop(atom.U().cast<double>(), nothing.residual, noise);
    r.dof = static_cast<double>(atom.rank());
    r.excited = atom.rank() > 0;
    r.p_value = search.global_p(f, r.chi2_drop, atom.rank());
    all.emplace_back(std::move(r), std::move(atom));
  }
  const auto place = [&](const RankedEffect& r) {
    return static_cast<std::size_t>(std::find(found_ids.begin(), found_ids.end(), r.id) - found_ids.begin());
  };
  std::stable_sort(all.begin(), all.end(), [&](const auto& a, const auto& b) {
    const auto key = [&](const auto& e) {
      return std::tuple(place(e.first), e.first.p_value, -e.first.chi2_drop);
    };
    return key(a) < key(b);
  });
  const auto before = held_out(atoms, {});
  std::vector<RankedEffect> out;
  const auto& multiplicity = search.multiplicity();
  for (std::size_t i = 0; i < all.size(); ++i) {
    auto& [r, atom] = all[i];
    if (atom.rank() > 0) {
      const double tests = multiplicity.shapes[atom.family] * multiplicity.families;
      r.detectable_um = detectable(atoms, atom, noise, alpha / std::max(1.0, tests));
      r.excited = r.detectable_um.has_value();
      const SetEstimate e = estimate(atoms, {atom});
      r.parameters = printed_parameters(atoms.effect(atom), e.values[0], e.sigmas[0], atom.shape);
      if (i < kHeldOut && before) {
        const HeldOut after = *held_out(atoms, {atom});
        r.heldout_before_um = measured(before->rms_um);
        r.heldout_after_um = measured(after.rms_um);
        r.heldout_before_urad = measured(before->rms_urad);
        r.heldout_after_urad = measured(after.rms_urad);
        r.rivals = rivals(atoms, best, atom);
      }
    }
    out.push_back(std::move(r));
  }
  return out;
}

}  // namespace trunnion::diagnosis
