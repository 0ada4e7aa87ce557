#include "diagnosis/search/time_constants.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/search/search.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr int kMostMoves = 8;
constexpr int kMostHalvings = 5;         // of a step that is too long
constexpr double kSlopeOver = 0.02;      // of ln tau
constexpr double kLongestMove = 0.7;     // of ln tau: a factor of 2, beyond which no slope holds
constexpr double kNoGain = 0.05;         // of chi-square
constexpr double kSameSlope = 1e-3;      // part of a slope (its length) that the others must leave it
constexpr double kShortestSlope = 1e-6;  // of the residual's change, noise units: the readings do not feel it

std::vector<const Atom*> addresses(const std::vector<Atom>& members) {
  std::vector<const Atom*> out;
  out.reserve(members.size());
  for (const Atom& atom : members) out.push_back(&atom);
  return out;
}

Atom with_tau(const Atoms& atoms, const Atom& atom, double logarithm) {
  const Parameter& p = atoms.effect(atom).info().parameters.back();
  return atoms.make_atom(atom.family, atom.variant, {std::clamp(std::exp(logarithm), p.min, p.max)});
}

// The step in ln tau of each lag by Gauss and Newton, the linear parameters
// following freely (variable projection; Kaufman 1975, BIT 15).
VectorXd step_of_lags(const Atoms& atoms, const std::vector<Atom>& members,
                      const std::vector<std::size_t>& lags, const Remainder& left) {
  const SetEstimate now = estimate(atoms, members);
  MatrixXd slopes(left.residual.size(), static_cast<Eigen::Index>(lags.size()));
  for (std::size_t k = 0; k < lags.size(); ++k) {
    const Atom& atom = members[lags[k]];
    const auto& values = now.values[lags[k]];
    const VectorXd linear =
        Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
    const double at = std::log(atom.shape[0]);
    const Atom low = with_tau(atoms, atom, at - kSlopeOver), high = with_tau(atoms, atom, at + kSlopeOver);
    slopes.col(static_cast<Eigen::Index>(k)) = (high.U().cast<double>() * (high.to_columns * linear) -
                                                low.U().cast<double>() * (low.to_columns * linear)) /
                                               (2.0 * kSlopeOver);
  }
  take_out(left.basis, slopes);
  const VectorXd length = slopes.colwise().norm().transpose();
  const VectorXd unit = length.unaryExpr([](double v) { return v > kShortestSlope ? 1.0 / v : 0.0; });
  slopes *= unit.asDiagonal();
  const VectorXd step =
      unit.asDiagonal() * (inverse_above(slopes.transpose() * slopes, kSameSlope * kSameSlope) *
                           (slopes.transpose() * left.residual));
  return step.cwiseMax(-kLongestMove).cwiseMin(kLongestMove);
}

}  // namespace

bool has_lag(const EffectInfo& info) {
  return info.shape_count() == 1 && info.parameters.back().name == "tau";
}

std::vector<Atom> with_best_lags(const Atoms& atoms, std::vector<Atom> members, double variance) {
  std::vector<std::size_t> lags;
  for (std::size_t k = 0; k < members.size(); ++k)
    if (has_lag(atoms.effect(members[k]).info()) && members[k].rank() > 0) lags.push_back(k);
  if (lags.empty()) return members;
  Remainder left = atoms.remainder(addresses(members));
  for (int move = 0; move < kMostMoves; ++move) {
    VectorXd step = step_of_lags(atoms, members, lags, left);
    double gain = 0.0;
    for (int halving = 0; halving < kMostHalvings && !(gain > 0.0); ++halving, step *= 0.5) {
      std::vector<Atom> moved = members;
      for (std::size_t k = 0; k < lags.size(); ++k) {
        Atom& atom = moved[lags[k]];
        atom = with_tau(atoms, atom, std::log(atom.shape[0]) + step[static_cast<Eigen::Index>(k)]);
      }
      Remainder then = atoms.remainder(addresses(moved));
      gain = (left.rss() - then.rss()) / variance;
      if (gain > 0.0) {
        members = std::move(moved);
        left = std::move(then);
      }
    }
    if (gain < kNoGain) break;
  }
  return members;
}

}  // namespace trunnion::diagnosis
