#include "diagnosis/observations.hpp"

#include <cmath>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/failure.hpp"

namespace trunnion::diagnosis {
namespace {

double component(const Reading& reading, const Vec3& n_M, const Deviation& d) {
  return n_M.dot(reading.quantity == Quantity::displacement ? d.displacement_mm : d.rotation_rad);
}

}  // namespace

Observations::Observations(const Machine& machine, const Dataset& data) : machine_(&machine), data_(&data) {
  const Eigen::Index count = size();
  values_.resize(count);
  runs_.resize(data.context.runs.size());
  groups_.resize(data.group_count);
  response_.assign(machine.axes.size() + 2, MatrixXd::Zero(count, 6));
  for (Eigen::Index i = 0; i < count; ++i) {
    const Reading& r = reading(i);
    values_[i] = r.value;
    states_.push_back(data.track.state(r.row));
    maps_.emplace_back(machine, states_.back().q, data.rows[r.row].tool_mm);
    const DeviationMap& map = maps_.back();
    n_M_.push_back(r.frame == SensitivityFrame::part ? Vec3(map.R_MP() * r.n) : r.n);
    runs_[states_.back().run].push_back(i);
    groups_[r.group].push_back(i);
    for (std::size_t link = 0; link < response_.size(); ++link) {
      const Link at = link < machine.axes.size()    ? Link{Link::Kind::joint, link}
                      : link == machine.axes.size() ? Link{Link::Kind::spindle, 0}
                                                    : Link{Link::Kind::part, 0};
      for (int k = 0; k < 3; ++k) {
        Twist d, turn;
        d.trans_mm[k] = 1.0;
        turn.rot_rad[k] = 1.0;
        response_[link](i, k) = component(r, n_M_.back(), map.linear_M(at, d));
        response_[link](i, k + 3) = component(r, n_M_.back(), map.linear_M(at, turn));
      }
    }
  }
}

std::size_t Observations::link_index(const Link& link) const {
  if (link.kind == Link::Kind::joint) return link.axis;
  return machine_->axes.size() + (link.kind == Link::Kind::part ? 1 : 0);
}

std::vector<std::vector<double>> Observations::lagged(const Effect& effect,
                                                      std::span<const double> shape) const {
  std::vector<std::vector<double>> out;
  for (const LagRequest& request : effect.lags(shape)) out.push_back(data_->track.lag(request));
  return out;
}

MatrixXd Observations::linear_columns(const Effect& effect, std::span<const double> shape) const {
  const std::size_t count = effect.info().linear_count();
  const auto lags = lagged(effect, shape);
  const MatrixXd& response = response_[link_index(effect.link())];
  std::vector<double> at(lags.size());
  std::vector<Twist> twists(count);
  MatrixXd out(size(), static_cast<Eigen::Index>(count));
  for (Eigen::Index i = 0; i < size(); ++i) {
    for (std::size_t k = 0; k < lags.size(); ++k) at[k] = lags[k][reading(i).row];
    effect.columns(state(i), at, shape, twists);
    for (std::size_t k = 0; k < count; ++k)
      out(i, static_cast<Eigen::Index>(k)) = response.row(i).head<3>().dot(twists[k].trans_mm) +
                                             response.row(i).tail<3>().dot(twists[k].rot_rad);
    if (!out.row(i).allFinite()) refuse(effect, i);
  }
  return out;
}

void Observations::refuse(const Effect& effect, Eigen::Index i) const {
  const RowOrigin& row = data_->rows[reading(i).row];
  throw Failure({ErrorCode::wrong_input, "effect '" + effect.info().id + "' gives no number for this reading",
                 data_->files[row.file], SourceRef{row.line, 0}});
}

VectorXd Observations::twist_response(const Effect& effect, std::span<const double> parameters) const {
  const auto lags = lagged(effect, parameters.subspan(effect.info().linear_count()));
  const MatrixXd& response = response_[link_index(effect.link())];
  std::vector<double> at(lags.size());
  VectorXd out(size());
  for (Eigen::Index i = 0; i < size(); ++i) {
    for (std::size_t k = 0; k < lags.size(); ++k) at[k] = lags[k][reading(i).row];
    const Twist twist = effect.twist(state(i), at, parameters);
    out[i] = response.row(i).head<3>().dot(twist.trans_mm) + response.row(i).tail<3>().dot(twist.rot_rad);
    if (!std::isfinite(out[i])) refuse(effect, i);
  }
  return out;
}

MatrixXd Observations::columns(const ModelEffect& effect) const {
  const auto& info = effect.effect->info();
  const std::size_t linear = info.linear_count();
  const std::vector<double> values = effect.values();
  MatrixXd out(size(), static_cast<Eigen::Index>(values.size()));
  out.leftCols(static_cast<Eigen::Index>(linear)) = linear_columns(*effect.effect, effect.shape());
  for (std::size_t k = linear; k < values.size(); ++k) {
    // A thousandth of the value: truncation and rounding errors of the difference are both far below 1e-3 of
    // it.
    const double h =
        1e-3 * std::max(std::abs(values[k]), 1e-3 * (info.parameters[k].max - info.parameters[k].min));
    std::vector<double> high = values, low = values;
    high[k] += h;
    low[k] -= h;
    out.col(static_cast<Eigen::Index>(k)) =
        h > 0.0 ? VectorXd((twist_response(*effect.effect, high) - twist_response(*effect.effect, low)) /
                           (2.0 * h))
                : VectorXd::Zero(size());
  }
  return out;
}

Vec3 Observations::setup_row(Eigen::Index i) const {
  if (reading(i).quantity == Quantity::rotation) return Vec3::Zero();
  return -(maps_[static_cast<std::size_t>(i)].R_MP().transpose() * n_M(i));
}

VectorXd Observations::predicted(const Model& model) const {
  const ModelEvaluator evaluator(model, ModelEvaluator::Sizes::any);
  std::vector<std::vector<double>> lags;
  for (const LagRequest& request : evaluator.lags()) lags.push_back(data_->track.lag(request));
  std::vector<double> at(lags.size());
  VectorXd out(size());
  for (Eigen::Index i = 0; i < size(); ++i) {
    for (std::size_t k = 0; k < lags.size(); ++k) at[k] = lags[k][reading(i).row];
    const Deviation d = maps_[static_cast<std::size_t>(i)].exact_M(evaluator.errors(state(i), at));
    out[i] = component(reading(i), n_M(i), d);
  }
  return out;
}

}  // namespace trunnion::diagnosis
