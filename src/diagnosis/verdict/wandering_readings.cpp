#include "diagnosis/verdict/wandering_readings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <oneapi/tbb/parallel_for.h>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/fit_core.hpp"
#include "diagnosis/fit/variance.hpp"
#include "diagnosis/fit/wander.hpp"
#include "diagnosis/verdict/worth.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr Eigen::Index kMostReadingsThatWander = 3000;  // more take seconds
constexpr Eigen::Index kFewestThatWander = 60;
constexpr std::size_t kMostBlocks = 6;  // effects and the formula: all their subsets are looked at
// Of the wandering part: over the uncertainty of a reading; readings in which it fades.
constexpr std::array kSizes = {0.4, 0.8, 1.5, 3.0, 6.0, 12.0};
constexpr std::array kLengths = {3.0, 8.0, 20.0, 50.0, 150.0, 500.0};
// The stated uncertainty is trusted as in `noise_scale`.
constexpr double kPriorOfSize = 12.0;
constexpr double kFormulasTried = 2000.0;  // functions of the state that count as independent (README)
constexpr double kRankBelow = 1e-6;

using Subset = unsigned;  // bit k: block k

// Of one subset of the blocks.
struct Cost {
  double deviance = INFINITY, chi2 = 0.0, dof = 1.0;
  Wander wander;
};

// All that a noise is judged by, rows over their uncertainty.
class WanderingFit {
 public:
  WanderingFit(const Observations& o, const FitCore& base, std::vector<MatrixXd> blocks, const VectorXd& raw)
      : of_run_(sequences_of(o, true, base.whitening->noise().used)),
        of_group_(sequences_of(o, false, base.whitening->noise().used)) {
    const VectorXd& inverse_u = base.whitening->inverse_u();
    std::vector<MatrixXd> columns;
    for (const FreeParameter& free : base.free)
      columns.emplace_back(
          o.columns(base.model.effects[free.effect]).col(static_cast<Eigen::Index>(free.index)));
    if (base.whitening->free_setup())
      for (const auto& run : o.runs()) {
        MatrixXd setup = MatrixXd::Zero(o.size(), 3);
        for (const Eigen::Index i : run) setup.row(i) = o.setup_row(i).transpose();
        columns.push_back(std::move(setup));
      }
    readings_ = o.size();
    for (MatrixXd& c : columns) c = inverse_u.asDiagonal() * c;
    const std::size_t groups = add_groups(o, *base.whitening, columns);
    rows_ = readings_ + static_cast<Eigen::Index>(groups);
    nuisance_ = side_by_side(columns);
    for (std::size_t k = 0; k < groups; ++k)
      nuisance_(readings_ + static_cast<Eigen::Index>(k),
                nuisance_.cols() - static_cast<Eigen::Index>(groups - k)) = 1.0;
    for (Eigen::Index k = 0; k < nuisance_.cols(); ++k)
      if (const double length = nuisance_.col(k).norm(); length > 0.0) nuisance_.col(k) /= length;
    for (MatrixXd& c : blocks) {
      c = inverse_u.asDiagonal() * c;
      ends_.push_back((ends_.empty() ? 0 : ends_.back()) + c.cols());
    }
    blocks.emplace_back(inverse_u.asDiagonal() * raw);
    rest_ = side_by_side(blocks);
    used_ = static_cast<double>(base.whitening->noise().used_count()) + static_cast<double>(groups);
  }

  // Readings of the longest sequence. What does not fade within half of it is an offset that all share, of
  // which `u_common` says how large it may be.
  double longest(bool along_run) const {
    std::size_t out = 0;
    for (const auto& s : along_run ? of_run_ : of_group_) out = std::max(out, s.size());
    return static_cast<double>(out);
  }
  // Of each subset, without the prices of its blocks.
  std::vector<Cost> costs(const Wander& wander) const {
    MatrixXd nuisance = nuisance_, rest = rest_;
    double log_determinant = 0.0;
    if (wander.size > 0.0) {
      const auto& sequences = wander.along_run ? of_run_ : of_group_;
      log_determinant = take_wander(wander, sequences, nuisance.topRows(readings_));
      take_wander(wander, sequences, rest.topRows(readings_));
    }
    const PivotedQr qr = pivoted_qr(nuisance, kRankBelow);
    for (const double d : qr.diagonal) log_determinant += 2.0 * std::log(d);
    take_out(qr.Q, rest);
    const MatrixXd products = rest.transpose() * rest;
    const double dof = used_ - static_cast<double>(qr.diagonal.size());
    std::vector<Cost> out(std::size_t{1} << ends_.size());
    for (Subset set = 0; set < out.size(); ++set) {
      Cost& cost = out[set];
      const auto [explained, rank] = explained_by(set, products);
      cost.chi2 = std::max(products(products.rows() - 1, products.cols() - 1) - explained, 0.0);
      cost.dof = std::max(dof - rank, 1.0);
      cost.deviance = (dof + kPriorOfSize) * std::log((cost.chi2 + kPriorOfSize) / (dof + kPriorOfSize)) +
                      log_determinant;
      cost.wander = wander;
    }
    return out;
  }

 private:
  // Offsets that a group shares: columns over the readings; each has a row of its own, of its size.
  static std::size_t add_groups(const Observations& o, const Whitening& whitening,
                                std::vector<MatrixXd>& columns) {
    std::size_t count = 0;
    for (const auto& group : o.groups()) {
      MatrixXd shared = MatrixXd::Zero(o.size(), 1);
      for (const Eigen::Index i : group)
        if (whitening.noise().used[static_cast<std::size_t>(i)]) shared(i, 0) = whitening.shared()[i];
      if (shared.norm() == 0.0) continue;
      columns.push_back(std::move(shared));
      ++count;
    }
    return count;
  }
  MatrixXd side_by_side(const std::vector<MatrixXd>& parts) const {
    Eigen::Index width = 0, at = 0;
    for (const MatrixXd& part : parts) width += part.cols();
    MatrixXd out = MatrixXd::Zero(rows_, width);
    for (const MatrixXd& part : parts) {
      out.block(0, at, part.rows(), part.cols()) = part;
      at += part.cols();
    }
    return out;
  }
  std::pair<double, double> explained_by(Subset set, const MatrixXd& products) const {
    std::vector<Eigen::Index> chosen;
    for (std::size_t k = 0; k < ends_.size(); ++k)
      if ((set >> k) % 2 == 1)
        for (Eigen::Index c = k == 0 ? 0 : ends_[k - 1]; c < ends_[k]; ++c) chosen.push_back(c);
    if (chosen.empty()) return {0.0, 0.0};
    MatrixXd normal = products(chosen, chosen);
    VectorXd right = products(chosen, products.cols() - 1);
    const VectorXd scale = normal.diagonal().array().max(1e-300).sqrt().inverse();
    normal = scale.asDiagonal() * normal * scale.asDiagonal();
    right = scale.asDiagonal() * right;
    constexpr double kHardlySeen = 1e-9;
    const VectorXd found = inverse_above(normal, kHardlySeen) * right;
    return {found.dot(right), static_cast<double>(chosen.size())};
  }

  std::vector<std::vector<Eigen::Index>> of_run_, of_group_;
  MatrixXd nuisance_, rest_;  // model, set-ups, groups; blocks, then the readings
  std::vector<Eigen::Index> ends_;
  Eigen::Index readings_ = 0, rows_ = 0;
  double used_ = 0.0;
};

// Of each subset the noise that suits it best.
std::vector<Cost> best_costs(const WanderingFit& fit) {
  struct Point {
    Wander wander;
    std::vector<Cost> costs;
  };
  std::vector<Point> points;
  for (const bool along_run : {true, false})
    for (const double length : kLengths)
      for (const double size : kSizes)
        if (2.0 * length <= fit.longest(along_run)) points.push_back({{size, length, along_run}, {}});
  if (points.empty()) return {};
  oneapi::tbb::parallel_for(std::size_t{0}, points.size(),
                            [&](std::size_t k) { points[k].costs = fit.costs(points[k].wander); });
  std::vector<Cost> out = points.front().costs;
  for (const Point& point : points)
    for (std::size_t k = 0; k < out.size(); ++k)
      if (point.costs[k].deviance < out[k].deviance) out[k] = point.costs[k];
  return out;
}

// What stands against a wander: named effects first, then those of the formula, about the fit with all of
// them (where one is large the others are of second order of it).
struct Against {
  std::vector<MatrixXd> columns;
  std::vector<double> prices;  // in -2 ln
  VectorXd raw;                // readings without the base alone

  double price(Subset set) const {
    double out = 0.0;
    for (std::size_t k = 0; k < prices.size(); ++k)
      if ((set >> k) % 2 == 1) out += prices[k];
    return out;
  }
};

Against against(const Observations& o, const FitCore& base, const std::vector<ModelEffect>& named,
                const Diagnosis& d) {
  Model with_all = base.model;
  with_all.effects.insert(with_all.effects.end(), named.begin(), named.end());
  if (d.formula)
    with_all.effects.insert(with_all.effects.end(), d.formula->alone.effects.begin(),
                            d.formula->alone.effects.end());
  std::vector<bool> flags = base.whitening->noise().used;
  flags.flip();
  const FitCore all = fit_core(o, with_all, {.robust = false}, flags);
  const double each = std::log(static_cast<double>(o.size()));
  const double noise = std::max(1.0, base.chi2() / std::max(base.dof(), 1.0));
  Against out{{}, {}, all.raw};
  const std::size_t first = base.model.effects.size();
  for (std::size_t k = first; k < all.model.effects.size(); ++k) {
    const ModelEffect& fitted = all.model.effects[k];
    const EffectInfo& info = fitted.effect->info();
    const MatrixXd& columns = out.columns.emplace_back(o.linear_columns(*fitted.effect, fitted.shape()));
    for (std::size_t p = 0; p < info.linear_count(); ++p)
      out.raw += fitted.parameters[p].value * columns.col(static_cast<Eigen::Index>(p));
    if (k - first >= named.size()) {
      out.prices.push_back(static_cast<double>(d.formula->terms) * (each + 2.0 * std::log(kFormulasTried)));
      continue;
    }
    const VectorXd whole = base.whitening->applied(columns).colwise().norm();
    const double needed = worth(base.projected(columns), whole, base.white, each * noise, {}).count;
    out.prices.push_back((std::max(1.0, needed) + static_cast<double>(info.shape_count())) * each +
                         2.0 * std::log(std::max(1.0, static_cast<double>(d.ranking.size()))));
  }
  return out;
}

// What it is, and what to do before it is measured again.
UnrecordedCondition condition_of(const Wander& wander, const Observations& o) {
  const Quantity quantity = o.reading(0).quantity;
  const bool length = quantity == Quantity::displacement;
  UnrecordedCondition out;
  out.kind = ConditionKind::wander;
  out.what = "an instrument that wanders by " +
             short_number(wander.size * typical_u(o, quantity) / (length ? kMmPerUm : kRadPerUrad)) +
             (length ? " um" : " urad") + " within some " + std::to_string(std::llround(wander.length)) +
             (wander.along_run ? " readings" : " readings of one direction");
  out.remedy =
      "Let the instrument settle and measure the same poses once more, in another order: what comes back is "
      "an "
      "error of the machine.";
  return out;
}

}  // namespace

std::optional<InPlace> beside_wandering_readings(const Observations& o, const FitCore& base,
                                                 const std::vector<ModelEffect>& named, const Diagnosis& d) {
  const std::size_t known = named.size();
  const std::size_t count = known + (d.formula ? d.formula->alone.effects.size() : 0);
  if (o.size() > kMostReadingsThatWander || o.size() < kFewestThatWander || count > kMostBlocks)
    return std::nullopt;
  const Against other = against(o, base, named, d);
  const WanderingFit fit(o, base, other.columns, other.raw);
  const Subset everything = (Subset{1} << count) - 1;
  const double white = fit.costs({0.0, 1.0, true})[everything].deviance + other.price(everything);
  const std::vector<Cost> wandering = best_costs(fit);
  if (wandering.empty()) return std::nullopt;
  const auto priced = [&](Subset set) { return wandering[set].deviance + other.price(set); };
  Subset best = 0;
  for (Subset set = 0; set <= everything; ++set)
    if (priced(set) < priced(best)) best = set;
  InPlace out;
  for (std::size_t k = 0; k < known; ++k)
    ((best >> k) % 2 == 1 ? out.kept : out.dropped).push_back(&named[k]);
  const bool needs_formula = (best >> known) != 0;
  const bool replaces = !out.dropped.empty() || d.formula || count == 0;
  if (needs_formula || !replaces) return std::nullopt;
  // Its size and its length, and whether it is of a run or of each direction.
  constexpr double kWays = 2.0;
  out.ahead = white - priced(best) - 2.0 * std::log(static_cast<double>(o.size())) - 2.0 * std::log(kWays);
  out.chi2 = wandering[best].chi2;
  out.dof = wandering[best].dof;
  out.gained = std::max(out.ahead, 0.0);
  out.parameters = 2.0;
  out.condition = std::make_shared<const UnrecordedCondition>(condition_of(wandering[best].wander, o));
  return out;
}

}  // namespace trunnion::diagnosis
