#include "trunnion/thermal/model.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "trunnion/base/contract.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "thermal/regressors.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct NamedMethod {
  Method method;
  const char* name;
};
constexpr std::array kMethods = {
    NamedMethod{Method::none, "none"},         NamedMethod{Method::hold_last, "hold_last"},
    NamedMethod{Method::ols, "ols"},           NamedMethod{Method::svr, "svr"},
    NamedMethod{Method::svr_all, "svr_all"},   NamedMethod{Method::rises, "rises"},
    NamedMethod{Method::ridge, "ridge"},       NamedMethod{Method::lag, "lag"},
    NamedMethod{Method::combined, "combined"}, NamedMethod{Method::gp, "gp"},
    NamedMethod{Method::mean, "mean"}};
// Unit vectors of the rows, without those that are nearly the one of a row before.
MatrixXd unlike(const MatrixXd& rows) {
  constexpr double kSame = 0.95;
  std::vector<VectorXd> kept;
  for (Index i = 0; i < rows.rows(); ++i) {
    const double length = rows.row(i).norm();
    if (!(length > 0.0)) continue;
    const VectorXd unit = rows.row(i).transpose() / length;
    const bool known =
        std::any_of(kept.begin(), kept.end(), [&](const VectorXd& k) { return k.dot(unit) > kSame; });
    if (!known) kept.push_back(unit);
  }
  MatrixXd out(static_cast<Index>(kept.size()), rows.cols());
  for (std::size_t i = 0; i < kept.size(); ++i) out.row(static_cast<Index>(i)) = kept[i].transpose();
  return out;
}

constexpr std::array kAxes = {"dx", "dy", "dz"};
constexpr std::array kAnchorSuffix = {"", "+bias", "+filter", "+update"};

}  // namespace

std::string method_name(Method method) {
  for (const auto& m : kMethods) {
    if (m.method == method) return m.name;
  }
  TRUNNION_EXPECTS(false);
  return {};
}

std::optional<Method> method_of_name(std::string_view name) {
  for (const auto& m : kMethods) {
    if (name == m.name) return m.method;
  }
  return std::nullopt;
}

std::string Candidate::name() const {
  return method_name(method) + kAnchorSuffix[static_cast<std::size_t>(anchor)];
}

std::optional<Candidate> candidate_of_name(std::string_view name) {
  const auto plus = name.find('+');
  const auto method = method_of_name(name.substr(0, plus));
  const std::string_view suffix = plus == std::string_view::npos ? "" : name.substr(plus);
  const auto anchor = std::find(kAnchorSuffix.begin(), kAnchorSuffix.end(), suffix);
  if (!method || anchor == kAnchorSuffix.end()) return std::nullopt;
  return Candidate{*method, static_cast<Anchor>(anchor - kAnchorSuffix.begin())};
}

FeatureSpec features_of(Method method, const Log& log) {
  FeatureSpec spec;
  const bool temperatures = method != Method::lag && method != Method::none && method != Method::hold_last;
  const bool lags =
      method == Method::ridge || method == Method::combined || method == Method::gp || method == Method::mean;
  const bool drives =
      method == Method::lag || method == Method::combined || method == Method::gp || method == Method::mean;
  if (temperatures) {
    spec.sensors = log.sensors;
    // Twice what a door of half a minute and the recovery of a Pt100 in its housing take, so that they are
    // the smaller half.
    spec.median_s = 300.0;
    // A quarter and a whole hour: between them and the temperature itself lie the time constants of spindles,
    // heads and columns.
    spec.temperature_taus_s = lags ? std::vector{0.0, 900.0, 3600.0} : std::vector{0.0};
  }
  if (drives && log.has_speed) {
    spec.speed_taus_s = {120.0, 600.0, 1800.0, 3600.0, 7200.0};  // bearings to castings
    spec.speed_powers = {1.0, 2.0};                              // friction: between speed and its square
  }
  if (drives && log.has_feed) spec.feed_taus_s = {600.0, 3600.0};  // screw and guide ways
  return spec;
}

std::optional<double> Regressor::change_sd_mm(const VectorXd& from, const VectorXd& to) const {
  static_cast<void>(from);
  static_cast<void>(to);
  return std::nullopt;
}

Result<std::shared_ptr<const Regressor>> fit_regressor(Method method, const TrainingSet& training) {
  switch (method) {
    case Method::ols:
      return fit_ols(training);
    case Method::svr:
      return fit_svr(training, true);
    case Method::svr_all:
      return fit_svr(training, false);
    case Method::rises:
    case Method::ridge:
    case Method::lag:
    case Method::combined:
      return fit_ridge(training);
    case Method::gp:
      return fit_gp(training);
    case Method::mean:
      return fit_mean(training);
    case Method::none:
    case Method::hold_last:
      break;
  }
  TRUNNION_EXPECTS(false);
  return fail(ErrorCode::wrong_use, "");
}

Guard::Guard(const TrainingSet& training) {
  const MatrixXd X = training.to - training.from;
  const auto n = static_cast<double>(X.rows());
  parts_.scale = (X.colwise().squaredNorm().transpose() / n).cwiseSqrt();
  for (double& s : parts_.scale) s = s > 0.0 ? 1.0 / s : 1.0;
  const MatrixXd Z = X * parts_.scale.asDiagonal();
  const SymmetricEigen eigen = symmetric_eigen(Z.transpose() * Z / n);
  // Directions with less than a thousandth of the whole are sensor noise; their spread is set to that.
  constexpr double kFloor = 1e-3;
  parts_.floor = std::max(kFloor * eigen.values.sum(), 1e-12);
  Index kept = 0;
  while (kept < Z.cols() && eigen.values[Z.cols() - 1 - kept] > parts_.floor) ++kept;
  parts_.directions = eigen.vectors.rightCols(kept);
  parts_.spread = eigen.values.tail(kept);
  parts_.largest = 1.0;
  double largest = 0.0;
  for (Index i = 0; i < X.rows(); ++i) largest = std::max(largest, distance(X.row(i).transpose()));
  parts_.largest = largest > 0.0 ? largest : 1.0;
  parts_.seen = unlike(Z);
}

Guard::Guard(Parts parts) : parts_(std::move(parts)) {}

VectorXd Guard::scaled(const VectorXd& x) const {
  return parts_.scale.size() == 0 ? x : VectorXd(x.cwiseProduct(parts_.scale));
}

VectorXd Guard::spread_of(const VectorXd& share) const {
  return parts_.scale.size() == 0 ? share : VectorXd(share.cwiseQuotient(parts_.scale));
}

double Guard::weight(const VectorXd& x) const {
  if (parts_.scale.size() == 0) return 1.0;
  const double out = trust(distance(x));
  const VectorXd z = scaled(x);
  if (parts_.seen.rows() == 0 || !(z.norm() > 0.0)) return out;
  const VectorXd like = parts_.seen * z / z.norm();
  const double known = like.maxCoeff();
  const double reversed = -like.minCoeff();
  // Width and place of the way from "known" to "only the reverse is known", as cosines.
  constexpr double kWidth = 0.4;
  constexpr double kPlace = 0.2;
  const double place = kPlace * (2.0 * both_ways() - 1.0);
  const double of_reverse = std::clamp(1.0 - (reversed - known - place) / kWidth, 0.0, 1.0);
  // What is like neither says nothing of a reversal.
  const double tells = std::clamp((reversed - kWidth) / kPlace, 0.0, 1.0);
  return out * (1.0 - tells * (1.0 - of_reverse));
}

double Guard::both_ways() const {
  // Warm-ups alone have 0.5 to 0.6, runs that warm and cool 0.8 and more (reference and simulated data).
  constexpr double kOneWay = 0.6;
  constexpr double kBothWays = 0.75;
  const VectorXd likest_reverse = (-parts_.seen * parts_.seen.transpose()).rowwise().maxCoeff();
  return std::clamp((likest_reverse.mean() - kOneWay) / (kBothWays - kOneWay), 0.0, 1.0);
}

void RunScale::add(double in_sigmas) {
  constexpr double kMemory = 0.9;
  // One wild measurement does not make a wild run.
  constexpr double kMost = 6.0;
  squares_ = kMemory * squares_ + std::pow(std::clamp(in_sigmas, -kMost, kMost), 2);
  count_ = kMemory * count_ + 1.0;
}

double RunScale::factor(double prior) const {
  return prior > 0.0 ? std::sqrt((prior + squares_) / (prior + count_)) : 1.0;
}

double CoverageFactor::at(double liveliness) const {
  const double between = lively_at - quiet_at;
  if (!(between > 0.0)) return quiet;
  return quiet + (lively - quiet) * std::clamp((liveliness - quiet_at) / between, 0.0, 1.0);
}

double SigmaModel::quiet_mm2(const Causes& causes) const {
  return floor_mm * floor_mm + growth_mm_per_sqrt_s * growth_mm_per_sqrt_s * causes.age_s;
}

double SigmaModel::lively_mm2(const Causes& causes) const {
  return std::pow(per_change * causes.change_mm, 2) + per_move_mm * per_move_mm * causes.moved +
         std::pow(per_krpm_mm * causes.unsettled, 2) + std::pow(per_swing_mm * causes.swing_K, 2);
}

double SigmaModel::liveliness(const Causes& causes) const {
  const double lively = lively_mm2(causes);
  const double both = lively + quiet_mm2(causes);
  return both > 0.0 ? lively / both : 0.0;
}

double SigmaModel::before_run_mm(const Causes& causes) const {
  return std::sqrt(quiet_mm2(causes) + lively_mm2(causes) + causes.unknown_mm * causes.unknown_mm);
}

double SigmaModel::sigma_mm(const Causes& causes, const RunScale& run) const {
  return coverage.at(liveliness(causes)) * run.factor(prior_measurements) * before_run_mm(causes);
}

void TrackRecord::add(const VectorXd& change, double predicted_mm, double measured_mm) {
  if (past_.size() == kMostKept) past_.pop_front();
  past_.push_back({change, predicted_mm, measured_mm});
}

double TrackRecord::trust(const VectorXd& change, double prior_weight, double typical_change_mm) const {
  constexpr double kMemory = 0.8;  // of each interval: heating and cooling of a structure change within hours
  const double prior = typical_change_mm * typical_change_mm;
  double gm = prior * prior_weight;
  double gg = prior;
  double memory = 1.0;
  for (auto kept = past_.rbegin(); kept != past_.rend(); ++kept, memory *= kMemory) {
    const double length = change.norm() * kept->change.norm();
    if (!(length > 0.0)) continue;
    const double like = memory * std::max(0.0, change.dot(kept->change) / length);
    gm += like * kept->predicted_mm * kept->measured_mm;
    gg += like * kept->predicted_mm * kept->predicted_mm;
  }
  return gg > 0.0 ? std::clamp(gm / gg, 0.0, 1.0) : prior_weight;
}

double Guard::distance(const VectorXd& x) const {
  if (parts_.scale.size() == 0) return 0.0;
  const VectorXd z = x.cwiseProduct(parts_.scale);
  const VectorXd along = parts_.directions.transpose() * z;
  const double across = std::max(0.0, z.squaredNorm() - along.squaredNorm());
  return std::sqrt(along.cwiseAbs2().cwiseQuotient(parts_.spread).sum() + across / parts_.floor) /
         parts_.largest;
}

config::Table Guard::table() const {
  config::Table out;
  out.emplace_back("scale", numbers(parts_.scale));
  out.emplace_back("spread", numbers(parts_.spread));
  out.emplace_back("floor", number_value(parts_.floor));
  out.emplace_back("largest", number_value(parts_.largest));
  out.emplace_back("seen", matrix_value(parts_.seen));
  out.emplace_back("directions", matrix_value(parts_.directions.transpose()));
  return out;
}

std::optional<Index> offset_component(const ChannelModel& channel) {
  const auto it = std::find(kAxes.begin(), kAxes.end(), channel.axis);
  return it == kAxes.end() ? std::nullopt : std::optional<Index>(it - kAxes.begin());
}

std::string axis_of_name(const std::string& channel) {
  for (const std::string_view axis : kAxes) {
    if (channel == axis || channel == axis.substr(1)) return std::string(axis);
  }
  return {};
}

Result<void> check_axes(const ThermalModel& model, const std::string& file) {
  std::string line;
  for (const ChannelModel& channel : model.channels) {
    if (channel.axis.empty()) line += (line.empty() ? "" : ",") + channel.channel + "=dx|dy|dz|none";
  }
  if (!line.empty()) {
    return fail(ErrorCode::wrong_input,
                "a name that is none of dx, dy, dz does not say which offset its channel gives, and without "
                "one the offset would be zero: thermal fit --axes " +
                    line,
                file);
  }
  for (std::size_t i = 0; i < model.channels.size(); ++i) {
    for (std::size_t k = 0; k < i && offset_component(model.channels[i]); ++k) {
      const ChannelModel& one = model.channels[k];
      const ChannelModel& other = model.channels[i];
      if (one.axis != other.axis) continue;
      return fail(ErrorCode::wrong_input,
                  "channels '" + one.channel + "' and '" + other.channel + "' both give " + one.axis +
                      ": thermal fit --axes " + one.channel + "=" + one.axis + "," + other.channel + "=none",
                  file);
    }
  }
  return {};
}

Result<Eigen::Matrix3Xd> instant_weights(const ThermalModel& model, const std::vector<std::string>& sensors) {
  Eigen::Matrix3Xd out = Eigen::Matrix3Xd::Zero(3, static_cast<Index>(sensors.size()));
  for (const ChannelModel& channel : model.channels) {
    const auto row = offset_component(channel);
    if (!row || !channel.regressor) continue;
    const auto weights = channel.regressor->weights_mm();
    const bool of_the_moment = channel.features.size() == channel.features.sensors.size() &&
                               channel.features.temperature_taus_s == std::vector{0.0};
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(static_cast<Index>(channel.features.size()));
    // What the run's measurements add (a bias, however it follows them) the control takes from the last one.
    const bool begins_at_zero =
        channel.candidate.anchor == Anchor::update || channel.regressor->level_mm(zero) == 0.0;
    if (!weights || !of_the_moment || !begins_at_zero) {
      return fail(ErrorCode::wrong_use,
                  "channel '" + channel.channel + "' uses " + channel.candidate.name() +
                      ", which a control cannot calculate: it knows the temperatures of the moment only "
                      "(thermal fit --method rises)");
    }
    for (std::size_t i = 0; i < channel.features.sensors.size(); ++i) {
      const auto it = std::find(sensors.begin(), sensors.end(), channel.features.sensors[i]);
      TRUNNION_EXPECTS(it != sensors.end());
      out(*row, it - sensors.begin()) += (*weights)[static_cast<Index>(i)];
    }
  }
  return out;
}

std::string data_hash(const Log& log) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;  // FNV-1a offset basis and prime
  const auto add = [&hash](std::uint64_t word) {
    for (int i = 0; i < 8; ++i) {
      hash ^= (word >> (8 * i)) & 0xffU;
      hash *= 0x100000001b3ULL;
    }
  };
  const auto add_text = [&](const std::string& text) {
    for (const char c : text) add(static_cast<unsigned char>(c));
    add(0);
  };
  const auto add_column = [&](const std::vector<double>& column) {
    for (const double v : column) add(std::isnan(v) ? ~0ULL : std::bit_cast<std::uint64_t>(v));
  };
  for (const auto& name : log.sensors) add_text(name);
  for (const auto& name : log.channels) add_text(name);
  for (const LogRun& run : log.runs) {
    add_text(run.id);
    add_column(run.time_s);
    for (const auto& column : run.temperature_degC) add_column(column);
    add_column(run.spindle_rpm);
    add_column(run.feed_mm_s);
    for (const auto& column : run.channel_mm) add_column(column);
  }
  constexpr char kDigits[] = "0123456789abcdef";
  std::string out(16, '0');
  for (int i = 0; i < 16; ++i) out[static_cast<std::size_t>(i)] = kDigits[(hash >> (60 - 4 * i)) & 0xfU];
  return out;
}

}  // namespace trunnion::thermal
