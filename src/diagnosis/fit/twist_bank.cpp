#include "diagnosis/fit/twist_bank.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <oneapi/tbb/parallel_for.h>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/float_products.hpp"
#include "diagnosis/fit/statistics.hpp"
#include "diagnosis/fit/twist_answers.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kLeft =
    0.02;  // part of a column's square that base and set must leave: less is rounding in float
constexpr double kMostNumbers = 1e8;  // readings times columns: keeps 10 000 readings within seconds

// Everything that base, set-ups and group offsets take out of a column x = raw / u, as products:
// |projected|^2 = x'x - sum_g c_g (v_g' x)^2 - |Z' x|^2.
struct Taken {
  Eigen::VectorXf shared;
  std::vector<int> group, run;      // of each reading
  std::vector<float> group_weight;  // c_g
  Eigen::MatrixXf setup;            // N x 3, mixed; of the reading's own run
  Eigen::MatrixXf basis;            // N x z, mixed
  std::size_t runs = 0;
};

Eigen::MatrixXf mixed(const Whitening& w, MatrixXd columns) {
  w.mix(columns);
  return columns.cast<float>();
}

Taken taken(const Observations& o, const FitCore& base) {
  const Whitening& w = *base.whitening;
  const Eigen::Index n = o.size();
  Taken out;
  out.shared = w.shared().cast<float>();
  out.group.resize(static_cast<std::size_t>(n));
  out.run.resize(static_cast<std::size_t>(n));
  out.runs = o.runs().size();
  for (std::size_t g = 0; g < o.groups().size(); ++g) {
    double s = 0.0;
    for (const Eigen::Index i : o.groups()[g]) {
      out.group[static_cast<std::size_t>(i)] = static_cast<int>(g);
      s += w.shared()[i] * w.shared()[i];
    }
    out.group_weight.push_back(static_cast<float>(1.0 / (1.0 + s)));
  }
  MatrixXd setup = MatrixXd::Zero(n, 3);
  for (std::size_t r = 0; r < o.runs().size(); ++r) {
    const auto& rows = o.runs()[r];
    for (std::size_t i = 0; i < rows.size(); ++i) {
      out.run[static_cast<std::size_t>(rows[i])] = static_cast<int>(r);
      if (!w.free_setup()) continue;
      const MatrixXd& b = w.setup_basis(r);
      setup.row(rows[i]).head(b.cols()) = b.row(static_cast<Eigen::Index>(i));
    }
  }
  out.setup = mixed(w, setup);
  out.basis = mixed(w, base.basis.topRows(n));
  return out;
}

// Products of x with everything that is taken out, one row each.
struct TakenProducts {
  Eigen::MatrixXf groups, setups, basis;
};

TakenProducts products(const Taken& t, const Eigen::MatrixXf& x) {
  TakenProducts out;
  out.groups = Eigen::MatrixXf::Zero(static_cast<Eigen::Index>(t.group_weight.size()), x.cols());
  out.setups = Eigen::MatrixXf::Zero(3 * static_cast<Eigen::Index>(t.runs), x.cols());
  for (Eigen::Index f = 0; f < x.cols(); ++f)
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      const float value = x(i, f);
      out.groups(t.group[k], f) += t.shared[i] * value;
      for (int c = 0; c < 3; ++c) out.setups(3 * t.run[k] + c, f) += t.setup(i, c) * value;
    }
  for (std::size_t g = 0; g < t.group_weight.size(); ++g)
    out.groups.row(static_cast<Eigen::Index>(g)) *= std::sqrt(t.group_weight[g]);
  out.basis = inner_products(t.basis, x);
  return out;
}

Eigen::MatrixXf square(const Eigen::MatrixXf& z, const StateFunctions::Span& span) {
  const auto part = z.middleCols(span.first, span.count);
  return inner_products(part, part);
}

struct Statistic {
  double drop = 0.0;
  Eigen::Index rank = 0;
};

// b' G^-1 b over the directions of which enough is left.
Statistic statistic(const MatrixXd& gram, const VectorXd& before, const VectorXd& moment) {
  const Eigen::Index k = gram.rows();
  if (k == 1) {
    if (!(gram(0, 0) > kLeft * before[0]) || !(before[0] > 0.0)) return {};
    return {moment[0] * moment[0] / gram(0, 0), 1};
  }
  VectorXd scale = before;
  for (double& s : scale) s = s > 0.0 ? 1.0 / std::sqrt(s) : 0.0;
  const SymmetricEigen eigen = symmetric_eigen(scale.asDiagonal() * gram * scale.asDiagonal());
  const VectorXd along = eigen.vectors.transpose() * (scale.asDiagonal() * moment);
  Statistic out;
  for (Eigen::Index i = 0; i < k; ++i) {
    if (!(eigen.values[i] > kLeft)) continue;
    out.drop += along[i] * along[i] / eigen.values[i];
    ++out.rank;
  }
  return out;
}

}  // namespace

TwistBank::TwistBank(const Observations& o) : o_(o), functions_(state_functions(o)) {
  const std::vector<TwistAnswer> found = twist_answers(o);
  for (const TwistAnswer& answer : found) {
    auto& links = links_of_.emplace_back();
    for (const TwistPlace& place : answer.places) links.push_back(place.link);
  }
  weights_.resize(o.size(), static_cast<Eigen::Index>(found.size()));
  for (std::size_t w = 0; w < found.size(); ++w)
    weights_.col(static_cast<Eigen::Index>(w)) = found[w].values.normalized().cast<float>();
  double numbers = 0.0;
  for (std::size_t f = 0; f < functions_.size(); ++f) {
    const StateFunctions& functions = functions_[f];
    for (std::size_t w = 0; w < found.size(); ++w) {
      const auto& links = links_of_[w];
      if (functions.link != StateFunctions::kAnyLink &&
          std::find(links.begin(), links.end(), functions.link) == links.end())
        continue;
      numbers += static_cast<double>(o.size()) * static_cast<double>(functions.values.cols());
      if (numbers > kMostNumbers) return;
      tasks_.push_back({f, w, {}, {}});
      count_ += functions.spans.size();
    }
  }
}

MatrixXd TwistBank::columns(const Hit& hit) const {
  const StateFunctions& f = functions_[hit.functions];
  const StateFunctions::Span& span = f.spans[hit.span];
  return (weights_.col(static_cast<Eigen::Index>(hit.weight)).asDiagonal() *
          f.values.middleCols(span.first, span.count))
      .cast<double>();
}

Eigen::MatrixXf TwistBank::divided(const Task& task, const FitCore& base) const {
  const Eigen::VectorXf w = weights_.col(static_cast<Eigen::Index>(task.weight))
                                .cwiseProduct(base.whitening->inverse_u().cast<float>());
  return w.asDiagonal() * functions_[task.functions].values;
}

void TwistBank::fit_to(const FitCore& base) {
  const Taken t = taken(o_, base);
  oneapi::tbb::parallel_for(std::size_t{0}, tasks_.size(), [&](std::size_t i) {
    Task& task = tasks_[i];
    const Eigen::MatrixXf x = divided(task, base);
    const TakenProducts p = products(t, x);
    task.gram.clear();
    task.before.clear();
    for (const StateFunctions::Span& span : functions_[task.functions].spans) {
      const Eigen::MatrixXf before = square(x, span);
      task.before.emplace_back(before.diagonal());
      task.gram.emplace_back(before - square(p.groups, span) - square(p.setups, span) -
                             square(p.basis, span));
    }
  });
}

std::optional<TwistBank::Hit> TwistBank::common_cause(const FitCore& all) {
  constexpr double kMost = 0.5;  // of the excess chi-square
  fit_to(all);
  const Atoms nothing(o_, all, {});
  NoiseScale stated;
  stated.dof = all.dof();
  const auto hits = best(nothing, nothing.remainder({}), stated);
  const auto most =
      std::max_element(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return a.drop < b.drop; });
  if (most == hits.end() || !(most->drop > kMost * (all.chi2() - all.dof()))) return std::nullopt;
  return *most;
}

// What a set leaves of the columns of a test, orthonormal.
MatrixXd TwistBank::left_of(const Task& task, std::size_t span, const FitCore& base,
                            const Remainder& set) const {
  MatrixXd u = base.projected(columns({task.functions, task.weight, span, 0.0, 0, 1.0}));
  take_out(set.basis, u);
  const Eigen::VectorXf& before = task.before[span];
  for (Eigen::Index c = 0; c < u.cols(); ++c)
    u.col(c) *= before[c] > 0.0F ? 1.0 / std::sqrt(static_cast<double>(before[c])) : 0.0;
  return pivoted_qr(u, std::sqrt(kLeft)).Q;
}

std::vector<TwistBank::Hit> TwistBank::best(const Atoms& atoms, const Remainder& set,
                                            const NoiseScale& noise) const {
  const FitCore& base = atoms.base();
  MatrixXd both(o_.size(), set.basis.cols() + 1);
  both << set.basis.topRows(o_.size()), set.residual.head(o_.size());
  const Eigen::MatrixXf given = mixed(*base.whitening, std::move(both));
  std::vector<std::vector<Hit>> found(tasks_.size());
  oneapi::tbb::parallel_for(std::size_t{0}, tasks_.size(), [&](std::size_t i) {
    const Task& task = tasks_[i];
    const StateFunctions& f = functions_[task.functions];
    const Eigen::MatrixXf in_given = inner_products(given, divided(task, base));
    const VectorXd moments = in_given.bottomRows(1).transpose().cast<double>();
    const Eigen::MatrixXf in_set = in_given.topRows(set.basis.cols());
    std::map<Eigen::Index, Hit> largest;  // of each rank: a tail probability costs more than all the rest
    std::vector<Hit> plain;
    plain.reserve(f.spans.size());
    for (std::size_t s = 0; s < f.spans.size(); ++s) {
      const auto [first, count] = f.spans[s];
      const Statistic found_here = statistic((task.gram[s] - square(in_set, f.spans[s])).cast<double>(),
                                             task.before[s].cast<double>(), moments.segment(first, count));
      if (found_here.rank == 0) continue;
      plain.push_back(
          {task.functions, task.weight, s, found_here.drop / noise.variance, found_here.rank, 1.0});
    }
    // Correlation makes less of each drop and never more: what is below the largest without it needs no look.
    if (noise.phi > 0.0)
      std::sort(plain.begin(), plain.end(), [](const Hit& a, const Hit& b) { return a.drop > b.drop; });
    for (Hit hit : plain) {
      const auto before = largest.find(hit.rank);
      if (before != largest.end() && before->second.drop >= hit.drop) continue;
      if (noise.phi > 0.0) {
        const MatrixXd u = left_of(task, hit.span, base, set);
        hit.drop = corrected_drop(u, set.residual, noise);
        hit.rank = u.cols();
        if (hit.rank == 0) continue;
      }
      const auto [it, fresh] = largest.try_emplace(hit.rank, hit);
      if (!fresh && hit.drop > it->second.drop) it->second = hit;
    }
    for (auto& [rank, hit] : largest) {
      const auto k = static_cast<double>(rank);
      hit.p = f_tail(hit.drop / k, k, noise.test_dof());
      found[i].push_back(hit);
    }
  });
  std::map<std::size_t, Hit> best_of;
  for (const auto& hits : found)
    for (const Hit& hit : hits) {
      const auto [it, fresh] = best_of.try_emplace(hit.functions, hit);
      if (!fresh && hit.p < it->second.p) it->second = hit;
    }
  std::vector<Hit> out;
  out.reserve(best_of.size());
  for (const auto& [f, hit] : best_of) out.push_back(hit);
  return out;
}

}  // namespace trunnion::diagnosis
