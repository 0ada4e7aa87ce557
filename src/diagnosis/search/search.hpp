#pragma once
#include <set>

#include "diagnosis/fit/noise_scale.hpp"
#include "diagnosis/search/atoms.hpp"

namespace trunnion::diagnosis {

/// A set of effects with what it explains.
struct EffectSet {
  std::vector<Atom> members;
  std::vector<double>
      drop;  // of each member given the others, in units of the noise variance, corrected for correlation
  std::vector<Eigen::Index> rank;
  std::vector<double> p;   // global p-value of each member given the others
  double rss = 0.0;        // what the set leaves of the base's
  Remainder remainder;     // of those that are extended or reported
  double criterion = 0.0;  // -2 ln evidence, up to a constant: smaller is better
  bool refitted = false;   // the time constants of all members together

  std::vector<std::string> ids(const Atoms& atoms) const;
  bool significant(double alpha) const;
  Eigen::Index columns() const;
};

/// -2 ln of the Occam factor of k columns that drop chi-square by s, prior width fitted to the data (local
/// empirical Bayes; George and Foster 2000).
double occam(double s, double k);

using Families = std::multiset<std::size_t>;  // of the members of a set

/// An effect beside others: coordinates of the residual along what is left of its columns (orthonormal), and
/// the matrix from its parameters to them.
struct Share {
  MatrixXd to_columns;
  VectorXd along;
};

/// The same under a normal prior of the parameters, each `usual` times a common width that is fitted: what
/// the readings hardly see of an effect costs it nothing. With equally seen columns it is the above, but that
/// the width has a prior of its own with long tails (Cauchy's, ten times the usual magnitudes).
double occam(const Share& share, const VectorXd& usual, double variance);

/// Forward search with swaps and drops over sets of effects (README of this layer, "Search").
class Search {
 public:
  Search(const Atoms& atoms, const Atoms::Multiplicity& multiplicity, const NoiseScale& noise, double alpha,
         std::size_t depth);

  /// The best set whose every member is significant given the others; empty when there is none.
  EffectSet best();
  /// Sets that the data cannot tell from `found`, best first, without `found` and without families that
  /// contain a member of it.
  std::vector<EffectSet> alternatives(EffectSet& found);

  /// With its remainder.
  EffectSet evaluated(std::vector<Atom> members) const;
  /// Global p-value of an effect that drops chi-square by `drop` (noise units) with `rank` columns.
  double global_p(std::size_t family, double drop, Eigen::Index rank) const;
  /// All columns of a smaller effect are within the span of the larger one, on these data or in general.
  bool contains(const Atom& larger, const Atom& smaller) const;
  const Atoms::Multiplicity& multiplicity() const { return multiplicity_; }
  /// Largest cosine between two effects.
  static double rho(const Atom& a, const Atom& b);

 private:
  EffectSet evaluate(std::vector<Atom> members) const;
  bool in_general(const Atom& larger, const Atom& smaller) const;
  void add_twins(const EffectSet& found, std::vector<EffectSet>& out) const;
  const EffectSet& least_of_tried() const;
  EffectSet without_needless(EffectSet set) const;
  /// With the time constants that fit best, all of them moved together.
  EffectSet refitted(EffectSet set) const;
  /// Refits those that were tried and may come as near as a set with this criterion.
  void refit_near(double criterion);
  /// The best of those that were tried, refitted, without members that it does better without.
  EffectSet best_refitted();
  void remember(EffectSet set);
  bool more_is_seen(const EffectSet& set, const Atom& larger, const Atom& smaller) const;
  std::vector<EffectSet> with_pairs(const EffectSet& found) const;
  void add_pairs(const EffectSet& found, std::vector<EffectSet>& out) const;
  void complete(EffectSet& set) const;
  bool rounding_matters(const Products& products) const;
  Share share_beside(const Products& products, const std::vector<Atom>& members, std::size_t member,
                     const std::vector<std::size_t>& others) const;
  double price(const std::vector<Atom>& members, const Products& products,
               const std::vector<double>& corrections) const;
  double price(const Atom& atom, const Share& share) const;
  void expand(const EffectSet& from, std::size_t keep);
  /// Tries each member replaced by every other effect; whether beside any set that is not in `looked`.
  bool exchange_members(const EffectSet& set, std::set<Families>& looked);
  /// Of the sets that were tried, best first; `found` becomes a smaller one that suffices.
  void improve(EffectSet& found, std::set<Families>& looked);
  std::vector<EffectSet> rivals(EffectSet& found);
  Atom known_shape(Atom atom, const Remainder& given) const;
  const EffectSet* seen(const std::vector<Atom>& members) const;

  const Atoms& atoms_;
  const Atoms::Multiplicity& multiplicity_;
  const NoiseScale& noise_;
  double alpha_;
  std::size_t depth_;
  std::vector<EffectSet> tried_;
};

/// Linear parameters of the members of a set, fitted together (internal units), and their covariance.
struct SetEstimate {
  std::vector<std::vector<double>> values, sigmas;  // per member; sigma 0 where undetermined
};
SetEstimate estimate(const Atoms& atoms, const std::vector<Atom>& members);
SetEstimate estimate(const std::vector<Atom>& members, const Products& products);

}  // namespace trunnion::diagnosis
