#include "thermal/bench.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/median.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Nothing when the channel was not measured in this run.
std::optional<BenchRun> prepare(const LogRun& run, std::size_t index, const std::vector<double>& channel,
                                double every_s) {
  std::vector<Index> measured;
  std::vector<double> gap_s;
  for (std::size_t i = 0; i < channel.size(); ++i) {
    if (std::isnan(channel[i])) continue;
    if (!measured.empty())
      gap_s.push_back(run.time_s[i] - run.time_s[static_cast<std::size_t>(measured.back())]);
    measured.push_back(static_cast<Index>(i));
  }
  if (measured.size() < 2) return std::nullopt;
  const auto time = [&](Index row) { return run.time_s[static_cast<std::size_t>(row)]; };
  const auto value = [&](Index row) { return channel[static_cast<std::size_t>(row)]; };
  BenchRun out;
  out.log_run = index;
  const bool measured_at_start = time(measured.front()) - run.time_s.front() <= 0.1 * every_s;
  out.reference_row = measured_at_start ? measured.front() : 0;
  out.reference_mm = measured_at_start ? value(measured.front()) : 0.0;
  out.anchors.push_back(out.reference_row);
  out.anchor_mm.push_back(0.0);
  // Blades do not end to the second: a measurement may come a little early.
  const double slack_s = std::min(0.1 * every_s, 0.5 * median(gap_s));
  for (const Index row : measured) {
    if (row <= out.reference_row && measured_at_start) continue;
    out.rows.push_back(row);
    out.value_mm.push_back(value(row) - out.reference_mm);
    out.anchor_of_row.push_back(out.anchors.size() - 1);
    if (time(row) - time(out.anchors.back()) >= every_s - slack_s) {
      out.anchors.push_back(row);
      out.anchor_mm.push_back(out.value_mm.back());
    }
  }
  return out;
}

}  // namespace

std::vector<std::size_t> known_measurements(const LogRun& run, const std::vector<double>& channel_mm,
                                            double measure_every_s) {
  std::vector<std::size_t> out;
  const auto prepared = prepare(run, 0, channel_mm, measure_every_s);
  if (prepared) {
    for (const Index row : prepared->anchors) out.push_back(static_cast<std::size_t>(row));
  } else {
    for (std::size_t row = 0; row < channel_mm.size(); ++row) out.push_back(row);
  }
  std::erase_if(out, [&](std::size_t row) { return std::isnan(channel_mm[row]); });
  return out;
}

ChannelBench::ChannelBench(const Log& log, std::size_t channel, double measure_every_s) : log_(&log) {
  for (std::size_t i = 0; i < log.runs.size(); ++i) {
    if (auto run = prepare(log.runs[i], i, log.runs[i].channel_mm[channel], measure_every_s))
      runs_.push_back(std::move(*run));
  }
}

bool ChannelBench::blind() const {
  std::size_t measured = 0;
  std::size_t known = 0;
  for (const BenchRun& run : runs_) {
    measured += run.rows.size();
    known += run.anchors.size();
  }
  return measured < 2 * known;
}

const RunFeatures& ChannelBench::features(Method method, std::size_t run) {
  auto& all = features_[method];
  if (all.empty()) {
    const FeatureSpec spec = features_of(method, *log_);
    for (const BenchRun& r : runs_) {
      RunFeatures X = run_features(spec, *log_, log_->runs[r.log_run]);
      const Eigen::RowVectorXd reference = X.values.row(r.reference_row);
      X.values.rowwise() -= reference;
      all.push_back(std::move(X));
    }
  }
  return all[run];
}

TrainingSet ChannelBench::training(Method method, bool increments, const std::vector<std::size_t>& runs) {
  // A change that begins or ends where a tenth of a feature is unknown teaches nothing.
  constexpr double kUnknown = 0.1;
  std::vector<Eigen::RowVectorXd> from, to;
  std::vector<double> change_mm;
  TrainingSet out;
  for (const std::size_t r : runs) {
    const BenchRun& run = runs_[r];
    const RunFeatures& X = features(method, r);
    const auto known = [&](Index row) {
      return X.unknown.cols() == 0 || X.unknown.row(row).maxCoeff() < kUnknown;
    };
    for (std::size_t k = 1; k < run.anchors.size(); ++k) {
      if (!known(run.anchors[k]) || (increments && !known(run.anchors[k - 1]))) continue;
      to.emplace_back(X.values.row(run.anchors[k]));
      from.emplace_back(Eigen::RowVectorXd::Zero(to.back().size()));
      if (increments) from.back() = X.values.row(run.anchors[k - 1]);
      change_mm.push_back(run.anchor_mm[k] - (increments ? run.anchor_mm[k - 1] : 0.0));
      out.group.push_back(r);
    }
  }
  const FeatureSpec spec = features_of(method, *log_);
  out.temperatures = static_cast<Index>(spec.sensors.size() * spec.temperature_taus_s.size());
  const auto p = static_cast<Index>(spec.size());
  const auto count = static_cast<Index>(to.size());
  out.from.resize(count, p);
  out.to.resize(count, p);
  for (std::size_t i = 0; i < to.size(); ++i) {
    out.from.row(static_cast<Index>(i)) = from[i];
    out.to.row(static_cast<Index>(i)) = to[i];
  }
  out.change_mm = Eigen::Map<const VectorXd>(change_mm.data(), count);
  return out;
}

bool ChannelBench::learns_increments(const Candidate& candidate) {
  return candidate.anchor == Anchor::update && candidate.method != Method::ols &&
         candidate.method != Method::svr && candidate.method != Method::svr_all;
}

Result<std::shared_ptr<const Regressor>> ChannelBench::regressor(Method method, bool increments,
                                                                 const std::vector<std::size_t>& runs) {
  const FitKey key(method, increments, runs);
  auto it = fits_.find(key);
  if (it == fits_.end())
    it = fits_.emplace(key, fit_regressor(method, training(method, increments, runs))).first;
  return it->second;
}

Result<Fitted> fit_candidate(ChannelBench& bench, const Candidate& candidate,
                             const std::vector<std::size_t>& runs) {
  if (candidate.method == Method::none || candidate.method == Method::hold_last) return Fitted{};
  const auto regressor = bench.regressor(candidate.method, ChannelBench::learns_increments(candidate), runs);
  if (!regressor) return tl::unexpected(regressor.error());
  const TrainingSet changes = bench.training(candidate.method, candidate.anchor == Anchor::update, runs);
  const double rms_mm = std::sqrt(changes.change_mm.squaredNorm() /
                                  static_cast<double>(std::max<Index>(1, changes.change_mm.size())));
  return Fitted{*regressor, Guard(changes), rms_mm};
}

std::vector<HeldOut> held_out(ChannelBench& bench, const Candidate& candidate, const Fitted& fitted,
                              std::size_t run, std::size_t stride) {
  const BenchRun& r = bench.runs()[run];
  const auto& time_s = bench.log_run(run).time_s;
  const RunFeatures* features = fitted.regressor ? &bench.features(candidate.method, run) : nullptr;
  const auto state = [&](Index row) { return features != nullptr ? features->at(row) : FeatureVector{}; };
  Follower follower(candidate, fitted);
  std::size_t told = 0;  // the anchor up to which the follower knows
  std::vector<HeldOut> out;
  for (std::size_t i = 0; i < r.rows.size(); i += stride) {
    for (; told < r.anchor_of_row[i]; ++told)
      follower.measure(state(r.anchors[told + 1]), r.anchor_mm[told + 1], true);
    const Said said = follower.say(state(r.rows[i]), false);
    HeldOut row{said.value_mm - r.value_mm[i], said.causes, false};
    row.causes.age_s =
        time_s[static_cast<std::size_t>(r.rows[i])] - time_s[static_cast<std::size_t>(r.anchors[told])];
    row.made_known = told + 1 < r.anchors.size() && r.anchors[told + 1] == r.rows[i];
    out.push_back(row);
  }
  return out;
}

std::vector<double> held_out_errors(ChannelBench& bench, const Candidate& candidate, const Fitted& fitted,
                                    std::size_t run, std::size_t stride) {
  std::vector<double> out;
  for (const HeldOut& row : held_out(bench, candidate, fitted, run, stride)) out.push_back(row.error_mm);
  return out;
}

}  // namespace trunnion::thermal
