#pragma once
#include <map>
#include <mutex>

#include "diagnosis/fit/fit_core.hpp"

namespace trunnion::diagnosis {

/// One candidate at one shape: what of its columns the base cannot imitate.
struct Atom {
  std::size_t family = 0;  // of the library given to Atoms
  std::size_t variant = 0;
  std::vector<double> shape;
  std::shared_ptr<const Eigen::MatrixXf>
      span;             // orthonormal, rows as FitCore::white; float: scores need no more
  MatrixXd to_columns;  // rank x parameters: the projected columns (internal units) are span * to_columns
  const Eigen::MatrixXf& U() const { return *span; }
  Eigen::Index rank() const { return span->cols(); }
};

/// Inner products of a set's members: all that its tests need when readings are not correlated.
struct Products {
  MatrixXd gram;                    // of all columns, member after member
  VectorXd moments;                 // with the white residual of the base
  std::vector<Eigen::Index> first;  // column of each member, and the end
};

/// What a set of atoms leaves.
struct Remainder {
  MatrixXd basis;     // orthonormal, of the set
  VectorXd residual;  // white residual of the base without what the set explains
  double rss() const { return residual.squaredNorm(); }
};

struct Score {
  double drop = 0.0;  // of the residual sum of squares
  Eigen::Index rank = 0;
};

/// The library's effects at all shapes of the search, whitened and freed of the base: score tests are
/// products with them (README of this layer, "Score test").
class Atoms {
 public:
  Atoms(const Observations& observations, const FitCore& base, std::vector<EffectFamily> library);
  /// The same effects beside other readings: `base` is that of `other` but for its residual.
  Atoms(const Atoms& other, const FitCore& base);
  /// The effects that have no shape to be searched.
  Atoms without_shapes() const;

  const std::vector<EffectFamily>& library() const { return library_; }
  const std::vector<Atom>& all() const { return atoms_; }
  const Effect& effect(const Atom& atom) const { return *library_[atom.family].variants[atom.variant]; }
  const FitCore& base() const { return base_; }
  const Observations& observations() const { return o_; }

  Remainder remainder(const std::vector<const Atom*>& set) const;
  Products products(const std::vector<const Atom*>& set) const;
  /// Part of a direction (its length) that the others of a set must leave for it to count.
  static constexpr double kTaken = 1e-3;
  /// The same where single readings weigh at most 2.5 standard deviations, when there were outliers (those
  /// that were not found are there too): for tests whose answer must not hang on a few readings.
  Remainder bounded(Remainder set, double variance) const;
  bool rough() const { return rough_; }
  Score score(const Atom& atom, const Remainder& given) const;
  /// The best atom of each family given a set (null where no direction of it is left).
  struct Best {
    const Atom* atom = nullptr;
    Score score;
    double p = 1.0;  // chi-square tail of drop / scale
  };
  std::vector<Best> best_of_each(const std::vector<const Atom*>& set, double scale) const;
  /// A better shape between the grid's points, by golden section on the score; the atom itself where there is
  /// none.
  Atom refined(const Atom& atom, const Remainder& given) const;
  Atom make_atom(std::size_t family, std::size_t variant, const std::vector<double>& shape) const;

  /// Number of independent shapes that each family amounts to, and of families, under the null: from
  /// simulated noise (medians of the smallest p-value). Deterministic.
  struct Multiplicity {
    std::vector<double> shapes;  // of each family
    double families = 1.0;
  };
  Multiplicity multiplicity(std::size_t simulations, std::uint64_t seed) const;

 private:
  Atom refined_step(const Atom& atom, const Remainder& given) const;
  std::vector<Atom> make_atoms(std::size_t family, std::size_t variant,
                               const std::vector<std::vector<double>>& shapes) const;
  // Inner products of every atom with one: of all atoms' columns, one below the other, with its columns.
  std::shared_ptr<const Eigen::MatrixXf> with_all(const Atom& atom) const;
  // Where the columns of each atom are among all, and what they make with the white residual of the base.
  void count_columns();
  Eigen::MatrixXf with_residual() const;
  const Observations& o_;
  const FitCore& base_;
  std::vector<EffectFamily> library_;
  std::vector<Atom> atoms_;
  std::vector<Eigen::Index> first_;  // of each atom among all columns
  Eigen::MatrixXf moments_;          // with_residual()
  // By the columns' address: they are kept with what was found.
  struct Kept {
    std::shared_ptr<const Eigen::MatrixXf> of, products;
  };
  struct Memory {
    std::mutex mutex;
    std::map<const Eigen::MatrixXf*, Kept> kept;
  };
  std::shared_ptr<Memory> memory_ = std::make_shared<Memory>();
  bool rough_ = false;
};

}  // namespace trunnion::diagnosis
