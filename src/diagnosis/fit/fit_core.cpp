#include "diagnosis/fit/fit_core.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/variance.hpp"
#include "diagnosis/search/neighbours.hpp"

namespace trunnion::diagnosis {
namespace {

// What a usual magnitude does to all readings together, in standard deviations, below which it is rounding:
// a column of it alone would be scaled up and taken for a measurement.
constexpr double kUnseen = 1e-6;
// Of columns scaled to length 1: a combination that much weaker than its parts is rounding. Positions are
// written to 0.001 mm, 0.0003 mm RMS, and a ball may stand 10 mm beside the axis that turns it.
constexpr double kRankTolerance = 3e-5;

std::vector<FreeParameter> free_parameters(const Model& model) {
  std::vector<FreeParameter> out;
  for (std::size_t e = 0; e < model.effects.size(); ++e)
    for (std::size_t p = 0; p < model.effects[e].parameters.size(); ++p) {
      const ParameterValue& value = model.effects[e].parameters[p];
      if (!value.fixed) out.push_back({e, p, value.prior && value.sigma && *value.sigma > 0.0});
    }
  return out;
}

double& value_of(Model& model, const FreeParameter& p) {
  return model.effects[p.effect].parameters[p.index].value;
}
const Parameter& parameter_of(const Model& model, const FreeParameter& p) {
  return model.effects[p.effect].effect->info().parameters[p.index];
}

class Fitter {
 public:
  Fitter(const Observations& observations, const Model& model) : o_(observations), start_(model) {
    fit_.model = model;
    fit_.free = free_parameters(model);
    held_.assign(fit_.free.size(), false);
    for (std::size_t k = 0; k < held_.size(); ++k) held_[k] = parameter_of(model, fit_.free[k]).integer;
    free_setup_ = model.setup_translation == SetupTranslation::free;
    priors_ =
        std::count_if(fit_.free.begin(), fit_.free.end(), [](const FreeParameter& p) { return p.prior; });
  }

  FitCore run(const FitOptions& options, const std::vector<bool>& outliers) {
    unknown_ = has_unknown_common(o_);
    noise_ = stated_noise(o_, typical_u(o_, Quantity::displacement), typical_u(o_, Quantity::rotation));
    if (!outliers.empty()) noise_.used = outliers, noise_.used.flip();
    start_shapes();
    iterate(options.max_iterations);
    if (unknown_.any()) {
      fit_.common = estimate_common(o_, noise_, free_setup_, white_columns_raw(), fit_.raw);
      iterate(3);
    }
    if (!options.robust) return std::move(fit_);
    auto flags = isolated_outliers(o_, fit_, find_outliers(o_, fit_));
    if (std::none_of(flags.begin(), flags.end(), [](bool b) { return b; })) return std::move(fit_);
    flags.flip();
    noise_.used = flags;
    iterate(options.max_iterations);
    if (unknown_.any())
      fit_.common = estimate_common(o_, noise_, free_setup_, white_columns_raw(), fit_.raw), iterate(3);
    return std::move(fit_);
  }

 private:
  // The grid value that explains most beside everything else that is free, for shape parameters that the file
  // does not give.
  void start_shapes() {
    for (std::size_t e = 0; e < fit_.model.effects.size(); ++e) {
      ModelEffect& effect = fit_.model.effects[e];
      const auto& info = effect.effect->info();
      const std::size_t linear = info.linear_count();
      bool open = info.shape_count() > 0;
      for (std::size_t k = linear; k < effect.parameters.size(); ++k)
        open = open && !effect.parameters[k].given && !effect.parameters[k].fixed;
      if (!open) continue;
      if (fit_.raw.size() == 0) take_residual();
      MatrixXd others = white_columns_raw();
      for (std::size_t k = 0; k < fit_.free.size(); ++k)
        if (fit_.free[k].effect == e) others.col(static_cast<Eigen::Index>(k)).setZero();
      others = fit_.whitening->applied(others);
      for (auto column : others.colwise()) column.stableNormalize();  // zero stays zero
      const MatrixXd known = pivoted_qr(others, kRankTolerance).Q;
      VectorXd rest = fit_.whitening->applied(fit_.raw);
      take_out(known, rest);
      double best = -1.0;
      for (const auto& shape : shape_grid(o_, *effect.effect)) {
        MatrixXd columns = fit_.whitening->applied(o_.linear_columns(*effect.effect, shape));
        take_out(known, columns);
        const PivotedQr qr = pivoted_qr(columns, kRankTolerance * columns.norm());
        const double drop = (qr.Q.transpose() * rest).squaredNorm();
        if (drop <= best) continue;
        best = drop;
        for (std::size_t k = 0; k < shape.size(); ++k) effect.parameters[linear + k].value = shape[k];
      }
    }
  }

  void iterate(int steps) {
    update_noise();
    fit_.converged = false;
    const bool curved = std::any_of(fit_.free.begin(), fit_.free.end(), [&](const FreeParameter& p) {
      return parameter_of(fit_.model, p).role == ParameterRole::shape;
    });
    last_ = {};
    for (int i = 0; i < steps && !fit_.converged; ++i) {
      solve_step(false);
      fit_.converged = curved ? damped_step() : plain_step();
    }
    solve_step(true);
    if (!curved && has_risen()) {
      go(-1.0, last_.step);
      fit_.converged = false;
      solve_step(true);
    }
  }

  void update_noise() {
    known_ = false;
    NoiseModel n = noise_;
    for (Eigen::Index i = 0; i < o_.size(); ++i) {
      const Reading& r = o_.reading(i);
      if (r.u_common || r.zeroed) continue;
      const auto& known =
          r.quantity == Quantity::displacement ? fit_.common.displacement_mm : fit_.common.rotation_rad;
      if (known) n.common[i] = *known;
    }
    noise_ = n;
    fit_.whitening = std::make_shared<Whitening>(o_, n, free_setup_);
  }

  // Derivatives are those at the nominal pose: they change with the shapes only, and those of a shape with
  // all parameters of its effect.
  const MatrixXd& white_columns_raw() {
    std::vector<double> at;
    for (const ModelEffect& effect : fit_.model.effects)
      if (effect.effect->info().shape_count() > 0)
        for (const ParameterValue& p : effect.parameters) at.push_back(p.value);
    if (columns_.rows() == o_.size() && at == columns_at_) return columns_;
    known_ = false;
    columns_at_ = std::move(at);
    columns_.resize(o_.size(), static_cast<Eigen::Index>(fit_.free.size()));
    std::size_t of = fit_.model.effects.size();
    MatrixXd block;
    for (std::size_t k = 0; k < fit_.free.size(); ++k) {
      if (fit_.free[k].effect != of) block = o_.columns(fit_.model.effects[of = fit_.free[k].effect]);
      columns_.col(static_cast<Eigen::Index>(k)) = block.col(static_cast<Eigen::Index>(fit_.free[k].index));
    }
    return columns_;
  }

  void take_residual() {
    if (!fit_.whitening) update_noise();
    fit_.raw = o_.values() - o_.predicted(fit_.model);
  }

  // Residual, Jacobian, decomposition and Newton step at the present values.
  void solve_step(bool last) {
    const Eigen::Index n = o_.size(), p = static_cast<Eigen::Index>(fit_.free.size());
    take_residual();
    VectorXd y(n + priors_);
    y.head(n) = fit_.whitening->applied(fit_.raw);
    Eigen::Index row = n;
    for (const FreeParameter& f : fit_.free) {
      if (!f.prior) continue;
      const ParameterValue& start = start_.effects[f.effect].parameters[f.index];
      y[row++] = (start.value - value_of(fit_.model, f)) / *start.sigma;
    }
    now_.chi2 = y.squaredNorm();
    const MatrixXd& raw_columns = white_columns_raw();
    if (!known_) decompose(raw_columns);
    step_from(y, p, last);
  }

  // Of the Jacobian, its columns scaled to length 1.
  void decompose(const MatrixXd& raw_columns) {
    const Eigen::Index n = o_.size(), p = raw_columns.cols();
    MatrixXd j = MatrixXd::Zero(n + priors_, p);
    j.topRows(n) = raw_columns;
    VectorXd& scale = scale_;
    {
      MatrixXd whitened = raw_columns;
      fit_.whitening->whiten(whitened);
      scale = whitened.colwise().norm().transpose();
      fit_.whitening->apply(j.topRows(n));
    }
    const auto seen = [&](Eigen::Index k) {
      if (held_[static_cast<std::size_t>(k)]) return false;
      const double usual = parameter_of(fit_.model, fit_.free[static_cast<std::size_t>(k)]).usual;
      return usual > 0.0 ? scale[k] * usual > kUnseen : scale[k] > 0.0;
    };
    Eigen::Index row = n;
    for (Eigen::Index k = 0; k < p; ++k) {
      const FreeParameter& f = fit_.free[static_cast<std::size_t>(k)];
      if (!f.prior) continue;
      if (!seen(k)) j.col(k).setZero();
      const ParameterValue& start = start_.effects[f.effect].parameters[f.index];
      j(row++, k) = 1.0 / *start.sigma;
      scale[k] = std::hypot(scale[k], 1.0 / *start.sigma);
    }
    for (Eigen::Index k = 0; k < p; ++k) {
      scale[k] = seen(k) ? 1.0 / scale[k] : 0.0;
      j.col(k) *= scale[k];
    }
    svd_ = thin_svd(j);
    known_ = true;
  }

  void step_from(const VectorXd& y, Eigen::Index p, bool last) {
    const VectorXd& scale = scale_;
    fit_.determined.assign(static_cast<std::size_t>(p), true);
    fit_.null_vectors.resize(p, 0);
    fit_.covariance = MatrixXd::Zero(p, p);
    now_.step = VectorXd::Zero(p);
    if (p == 0) {
      fit_.basis.resize(y.size(), 0);
      fit_.white = y;
      return;
    }
    const Svd& svd = svd_;
    const VectorXd& s = svd.s;
    Eigen::Index rank = 0;
    while (rank < s.size() && s[rank] > kRankTolerance) ++rank;
    fit_.basis = svd.U.leftCols(rank);
    const VectorXd along = fit_.basis.transpose() * y;
    now_.step = scale.asDiagonal() * (svd.V.leftCols(rank) * (along.array() / s.head(rank).array()).matrix());
    fit_.white = y - fit_.basis * along;
    if (!last) return;
    const MatrixXd half =
        scale.asDiagonal() * svd.V.leftCols(rank) * s.head(rank).cwiseInverse().asDiagonal();
    fit_.covariance = half * half.transpose();
    describe_null_space(svd.V.leftCols(rank), scale);
  }

  void describe_null_space(const MatrixXd& seen, const VectorXd& scale) {
    const Eigen::Index p = seen.rows();
    MatrixXd hidden = MatrixXd::Identity(p, p) - seen * seen.transpose();
    for (Eigen::Index k = 0; k < p; ++k)
      fit_.determined[static_cast<std::size_t>(k)] = hidden.row(k).norm() < 1e-4;
    // A shape that stays where it is has no uncertainty to tell, and hides nothing.
    Eigen::Index count = p - seen.cols();
    for (Eigen::Index k = 0; k < p; ++k) {
      if (!held_[static_cast<std::size_t>(k)]) continue;
      hidden.row(k).setZero();
      hidden.col(k).setZero();
      --count;
    }
    if (count == 0) return;
    // One vector for each pivot column: few parameters in each, as a person would name them.
    const PivotedQr qr = pivoted_qr(hidden, 0.0);
    std::vector<VectorXd> found;
    for (Eigen::Index i = 0; i < count; ++i) {
      VectorXd v = hidden.col(qr.order[i]);
      for (Eigen::Index k = 0; k < p; ++k)
        v[k] = std::abs(v[k]) < 1e-6 ? 0.0 : v[k] * (scale[k] > 0.0 ? scale[k] : 1.0);
      found.push_back(v);
    }
    fit_.null_vectors.resize(p, static_cast<Eigen::Index>(found.size()));
    for (std::size_t i = 0; i < found.size(); ++i)
      fit_.null_vectors.col(static_cast<Eigen::Index>(i)) = found[i];
  }

  bool small(const VectorXd& step) const {
    double worst = 0.0;
    for (Eigen::Index k = 0; k < step.size(); ++k) {
      const FreeParameter& f = fit_.free[static_cast<std::size_t>(k)];
      const Parameter& p = parameter_of(fit_.model, f);
      worst = std::max(worst, std::abs(step[k]) / std::max(std::abs(p.usual), 1e-12));
    }
    return worst < 1e-6;  // of a usual magnitude: far below any noise
  }

  void go(double share, const VectorXd& step) {
    for (Eigen::Index k = 0; k < step.size(); ++k)
      value_of(fit_.model, fit_.free[static_cast<std::size_t>(k)]) += share * step[k];
  }

  // Chi-square is larger than before the last step, by more than rounding.
  bool has_risen() const {
    constexpr double kRounding = 1e-9;
    return last_.step.size() > 0 && !(now_.chi2 <= (1.0 + kRounding) * last_.chi2 + kRounding);
  }

  // The derivatives are those at the nominal pose: of errors a hundred times the usual a whole step may lead
  // further away, and is shortened until chi-square falls.
  bool plain_step() {
    if (has_risen()) {
      last_.step *= 0.5;
      go(-1.0, last_.step);
      return false;
    }
    last_ = now_;
    go(1.0, now_.step);
    return small(now_.step);
  }

  // Shape parameters bend the model: bounded, and shortened until chi-square falls.
  bool damped_step() {
    const double before = objective();
    const Model from = fit_.model;
    VectorXd step = now_.step;
    for (int halving = 0; halving < 8; ++halving, step *= 0.5) {
      fit_.model = from;
      for (Eigen::Index k = 0; k < step.size(); ++k) {
        const FreeParameter& f = fit_.free[static_cast<std::size_t>(k)];
        double& value = value_of(fit_.model, f);
        const double old = value, wanted = value + step[k];
        value = wanted;
        const Parameter& p = parameter_of(from, f);
        if (p.role != ParameterRole::shape) continue;
        value = bounded(p, wanted, old);
        // At the end of its range, and pushed on: the others are to be fitted beside it.
        if (value == old && wanted != old && p.max > p.min) {
          held_[static_cast<std::size_t>(k)] = true;
          known_ = false;
          fit_.model = from;
          return false;
        }
      }
      const double after = objective();
      if (after <= before * (1.0 + 1e-12)) return small(step) || before - after < 1e-6;
    }
    fit_.model = from;
    return true;
  }
  static double bounded(const Parameter& p, double value, double old) {
    if (!(p.max > p.min)) return value;
    const double reach = 0.1 * (p.max - p.min);
    return std::clamp(std::clamp(value, old - reach, old + reach), std::min(p.min, old),
                      std::max(p.max, old));
  }
  double objective() {
    const VectorXd white = fit_.whitening->applied(VectorXd(o_.values() - o_.predicted(fit_.model)));
    double sum = white.squaredNorm();
    for (const FreeParameter& f : fit_.free) {
      if (!f.prior) continue;
      const ParameterValue& start = start_.effects[f.effect].parameters[f.index];
      sum += std::pow((start.value - value_of(fit_.model, f)) / *start.sigma, 2);
    }
    return sum;
  }

  const Observations& o_;
  Model start_;
  FitCore fit_;
  NoiseModel noise_;
  UnknownCommon unknown_;
  bool free_setup_ = true;
  Eigen::Index priors_ = 0;
  std::vector<bool> held_;  // shapes that are whole numbers, or at the end of their range
  struct Step {
    VectorXd step;      // that leads to the next values
    double chi2 = 0.0;  // of the readings and the priors, before it
  } now_, last_;
  // The Jacobian and what follows from it, until shapes or noise change.
  MatrixXd columns_;
  std::vector<double> columns_at_;
  VectorXd scale_;
  Svd svd_;
  bool known_ = false;
};

}  // namespace

MatrixXd FitCore::projected(const MatrixXd& raw_columns) const {
  constexpr double kRounding = 1e-9;  // of a column: more is left of one that is only nearly taken up
  MatrixXd out = MatrixXd::Zero(white.size(), raw_columns.cols());
  if (out.size() == 0) return out;
  auto readings = out.topRows(raw_columns.rows());
  readings = raw_columns;
  whitening->whiten(readings);
  const Eigen::RowVectorXd whole = readings.colwise().norm();
  whitening->take_setups(readings);
  if (basis.cols() > 0) {
    take_out(basis, out);
    take_out(basis, out);  // twice is enough (Giraud et al. 2005)
  }
  // Who scales the columns to the same length would scale up rounding. It is large in the first row of a run,
  // as a rule, and a column of that row alone follows its reading, however wild.
  for (Eigen::Index k = 0; k < out.cols(); ++k)
    if (out.col(k).norm() < kRounding * whole[k]) out.col(k).setZero();
  return out;
}

VectorXd plain_residual(const Observations& o, const FitCore& fit) {
  const auto setups = fit.whitening->setup_of(fit.raw);
  const NoiseModel& noise = fit.whitening->noise();
  VectorXd out = fit.raw;
  for (Eigen::Index i = 0; i < o.size(); ++i) out[i] -= o.setup_row(i).dot(setups[o.state(i).run]);
  for (const auto& group : o.groups()) {
    if (group.empty() || o.reading(group.front()).u_common) continue;
    double moment = 0.0, weight = 0.0;
    for (const Eigen::Index i : group) {
      if (!noise.used[static_cast<std::size_t>(i)]) continue;
      moment += out[i] / (noise.u[i] * noise.u[i]);
      weight += 1.0 / (noise.u[i] * noise.u[i]);
    }
    const double c2 = noise.common[group.front()] * noise.common[group.front()];
    const double offset = c2 * moment / (1.0 + c2 * weight);
    for (const Eigen::Index i : group) out[i] -= offset;
  }
  return out;
}

SizeByQuantity size_by_quantity(const Dataset& data, const VectorXd& values, const std::vector<bool>& used) {
  double um = 0.0, um_count = 0.0, urad = 0.0, urad_count = 0.0;
  for (std::size_t i = 0; i < data.readings.size(); ++i) {
    if (!used.empty() && !used[i]) continue;
    const bool length = data.readings[i].quantity == Quantity::displacement;
    const double value = values[static_cast<Eigen::Index>(i)] / (length ? kMmPerUm : kRadPerUrad);
    (length ? um : urad) += value * value;
    (length ? um_count : urad_count) += 1.0;
  }
  const auto rms = [](double sum, double count) {
    return count > 0.0 ? std::sqrt(sum / count) : std::nan("");
  };
  return {rms(um, um_count), rms(urad, urad_count)};
}

FitCore fit_core(const Observations& observations, const Model& model, const FitOptions& options,
                 const std::vector<bool>& outliers) {
  return Fitter(observations, model).run(options, outliers);
}

}  // namespace trunnion::diagnosis
