#include "diagnosis/fit/uneven_scatter.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/noise_scale.hpp"
#include "diagnosis/search/neighbours.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr Eigen::Index kFewestForVariance = 60;  // readings: fewer say little of a variance that changes
constexpr std::size_t kFewestOfLevel = 12;       // the same of one run or quantity
constexpr std::size_t kMostCauses = 3;
constexpr double kSureOfVariance = 20.0;  // of -2 ln likelihood, beyond ln(readings) for each parameter (BIC)
constexpr double kLeastLeft = 0.2;   // of a reading's variance that base, set and surrogate must leave it
constexpr double kMostSquare = 9.0;  // of the variance, that one reading may say: outliers do not decide
constexpr double kPriorOfTerm =
    0.25;  // weight of a term's being 0: e times in ln of the variance, twice, is usual
constexpr double kWorthWeights = 1.5;  // factor below which weights change nothing
constexpr double kOfMost = 0.95;       // share of the readings whose factor that is judged by
constexpr double kOfLeast = 0.25;      // share of the readings that scatter least
constexpr double kMostFactor = 20.0;
constexpr double kScattersMore = 1.2;     // factor from which a reading is asked for its neighbours
constexpr double kAlikeNeighbours = 2.0;  // standard deviations from which neighbours are alike

struct Term {
  std::string name;
  MatrixXd columns;
};

void add_levels(const Observations& o, const std::string& name, const std::vector<std::size_t>& of,
                std::size_t count, std::vector<Term>& to) {
  std::vector<std::size_t> size(count, 0);
  for (const std::size_t k : of) ++size[k];
  const auto enough =
      std::count_if(size.begin(), size.end(), [](std::size_t n) { return n >= kFewestOfLevel; });
  if (enough < 2) return;
  Term term{name, MatrixXd::Zero(o.size(), enough)};
  Eigen::Index column = 0;
  for (std::size_t level = 0; level < count; ++level) {
    if (size[level] < kFewestOfLevel) continue;
    for (Eigen::Index i = 0; i < o.size(); ++i)
      if (of[static_cast<std::size_t>(i)] == level) term.columns(i, column) = 1.0;
    ++column;
  }
  to.push_back(std::move(term));
}

void add_polynomial(const std::string& name, const VectorXd& x, std::vector<Term>& to) {
  const double low = x.minCoeff(), high = x.maxCoeff();
  if (!(high - low > 1e-9)) return;
  const Eigen::ArrayXd z = (2.0 * x.array() - low - high) / (high - low);
  Term term{name, MatrixXd(x.size(), 2)};
  term.columns << z.matrix(), (z * z - 1.0 / 3.0).matrix();
  to.push_back(std::move(term));
}

// Which probe or beam took each reading: frame, quantity and line of n, numbered.
std::vector<std::size_t> direction_of_readings(const Observations& o, std::size_t& count) {
  constexpr double kSameLine = 0.99;  // cosine
  std::vector<Eigen::Index> first;
  std::vector<std::size_t> out;
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    const Reading& r = o.reading(i);
    const auto at = std::find_if(first.begin(), first.end(), [&](Eigen::Index k) {
      const Reading& other = o.reading(k);
      return other.quantity == r.quantity && other.frame == r.frame && std::abs(other.n.dot(r.n)) > kSameLine;
    });
    out.push_back(static_cast<std::size_t>(at - first.begin()));
    if (at == first.end()) first.push_back(i);
  }
  count = first.size();
  return out;
}

std::vector<Term> terms_of(const Observations& o) {
  std::vector<Term> out;
  std::vector<std::size_t> runs, quantities;
  VectorXd distance(o.size());
  Vec3 middle = Vec3::Zero();
  const auto place = [&](Eigen::Index i) {
    Vec3 p = Vec3::Zero();
    Eigen::Index k = 0;
    for (AxisId a = 0; a < o.machine().axes.size() && k < 3; ++a)
      if (o.machine().axes[a].kind == AxisKind::linear) p[k++] = o.state(i).q[a];
    return p;
  };
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    runs.push_back(o.state(i).run);
    quantities.push_back(o.reading(i).quantity == Quantity::rotation ? 1 : 0);
    middle += place(i) / static_cast<double>(o.size());
  }
  for (Eigen::Index i = 0; i < o.size(); ++i) distance[i] = (place(i) - middle).norm();
  add_levels(o, "run", runs, o.data().context.runs.size(), out);
  add_levels(o, "quantity", quantities, 2, out);
  std::size_t count = 0;
  const std::vector<std::size_t> directions = direction_of_readings(o, count);
  add_levels(o, "direction", directions, count, out);
  add_polynomial("distance", distance, out);
  for (AxisId a = 0; a < o.machine().axes.size(); ++a) {
    VectorXd q(o.size());
    for (Eigen::Index i = 0; i < o.size(); ++i) q[i] = o.state(i).q[a];
    add_polynomial(o.machine().axes[a].name, q, out);
  }
  return out;
}

struct Variance {
  VectorXd values;        // of each reading
  double deviance = 0.0;  // -2 ln likelihood, but for a constant
};

// ln variance = a constant + columns x, by iterated weighted least squares; `squares` of the readings that
// count.
Variance fitted(const MatrixXd& columns, const VectorXd& squares, const std::vector<Eigen::Index>& counted) {
  const Eigen::Index n = squares.size();
  MatrixXd all(n, columns.cols() + 1);
  all << VectorXd::Ones(n), columns;
  const MatrixXd t = all(counted, Eigen::all);
  const VectorXd e2 = squares(counted);
  MatrixXd normal = 0.5 * t.transpose() * t;
  normal.diagonal().tail(columns.cols()).array() += kPriorOfTerm;
  VectorXd b = VectorXd::Zero(all.cols());
  b[0] = std::log(std::max(e2.mean(), 1e-6));
  const auto variance_of = [&](const MatrixXd& rows) -> VectorXd {
    return (rows * b).array().max(-12.0).min(12.0).exp().matrix();
  };
  const auto bounded = [&](const VectorXd& v) -> VectorXd { return e2.cwiseMin(kMostSquare * v); };
  for (int round = 0; round < 40; ++round) {
    const VectorXd v = variance_of(t);
    VectorXd gradient = 0.5 * t.transpose() * (bounded(v).cwiseQuotient(v).array() - 1.0).matrix();
    gradient.tail(columns.cols()) -= kPriorOfTerm * b.tail(columns.cols());
    const VectorXd step = solve_positive(normal, gradient);
    b += step;
    if (step.norm() < 1e-6) break;
  }
  const VectorXd v = variance_of(t);
  return {variance_of(all), v.array().log().sum() + bounded(v).cwiseQuotient(v).sum()};
}

double quantile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

// Of each reading's variance, what base, set-ups and `basis` leave it.
VectorXd left_of(const Observations& o, const FitCore& base, const MatrixXd& basis) {
  VectorXd out = VectorXd::Ones(o.size()) - basis.topRows(o.size()).rowwise().squaredNorm() -
                 base.basis.topRows(o.size()).rowwise().squaredNorm();
  if (!base.whitening->free_setup()) return out;
  for (std::size_t run = 0; run < o.runs().size(); ++run) {
    const MatrixXd& setup = base.whitening->setup_basis(run);
    for (std::size_t k = 0; k < o.runs()[run].size(); ++k)
      out[o.runs()[run][k]] -= setup.row(static_cast<Eigen::Index>(k)).squaredNorm();
  }
  return out;
}

}  // namespace

std::optional<UnevenScatter> uneven_scatter(const Observations& o, const FitCore& base,
                                            const MatrixXd& surrogate) {
  if (o.size() < kFewestForVariance) return std::nullopt;
  const MatrixXd basis = joined_basis(MatrixXd(surrogate.rows(), 0), surrogate);
  VectorXd r = base.white;
  take_out(basis, r);
  const VectorXd left = left_of(o, base, basis);
  std::vector<Eigen::Index> counted;
  VectorXd e = VectorXd::Zero(o.size());
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    if (!base.whitening->noise().used[static_cast<std::size_t>(i)] || left[i] < kLeastLeft) continue;
    counted.push_back(i);
    e[i] = r[i] / std::sqrt(left[i]);
  }
  const auto n = static_cast<double>(counted.size());
  if (counted.size() < static_cast<std::size_t>(kFewestForVariance)) return std::nullopt;
  const VectorXd squares = e.cwiseAbs2();

  std::vector<Term> terms = terms_of(o);
  MatrixXd columns(o.size(), 0);
  Variance now = fitted(columns, squares, counted);
  UnevenScatter out;
  while (out.depends_on.size() < kMostCauses && !terms.empty()) {
    double best_gain = 0.0;
    std::size_t best = 0;
    Variance best_fit;
    for (std::size_t k = 0; k < terms.size(); ++k) {
      MatrixXd with(o.size(), columns.cols() + terms[k].columns.cols());
      with << columns, terms[k].columns;
      Variance fit = fitted(with, squares, counted);
      const double gain = now.deviance - fit.deviance - kSureOfVariance -
                          std::log(n) * static_cast<double>(terms[k].columns.cols());
      if (gain > best_gain) best_gain = gain, best = k, best_fit = std::move(fit);
    }
    if (best_gain <= 0.0) break;
    MatrixXd with(o.size(), columns.cols() + terms[best].columns.cols());
    with << columns, terms[best].columns;
    columns = std::move(with);
    now = std::move(best_fit);
    out.depends_on.push_back(terms[best].name);
    terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(best));
  }
  if (out.depends_on.empty()) return std::nullopt;

  std::vector<double> sigma;
  sigma.reserve(counted.size());
  for (const Eigen::Index i : counted) sigma.push_back(std::sqrt(now.values[i]));
  const double least = quantile(sigma, kOfLeast);
  if (quantile(sigma, kOfMost) < kWorthWeights * least) return std::nullopt;
  std::vector<bool> more(static_cast<std::size_t>(o.size()), false);
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    const double factor = std::clamp(std::sqrt(now.values[i]) / least, 1.0, kMostFactor);
    out.factor.push_back(factor);
    out.largest = std::max(out.largest, factor);
  }
  for (const Eigen::Index i : counted)
    more[static_cast<std::size_t>(i)] = out.factor[static_cast<std::size_t>(i)] > kScattersMore;
  if (company(o, more, e.cwiseQuotient(now.values.cwiseSqrt())) > kAlikeNeighbours) return std::nullopt;
  return out;
}

Dataset weighed(Dataset data, const UnevenScatter& scatter) {
  for (std::size_t i = 0; i < data.readings.size(); ++i) data.readings[i].u_random *= scatter.factor[i];
  return data;
}

}  // namespace trunnion::diagnosis
