#include "thermal/bench.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

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

// Bias after each anchor; nothing known at the reference, where both are zero.
std::vector<double> biases(Anchor anchor, const BenchRun& run, const std::vector<double>& anchor_level_mm) {
  std::vector<double> out(run.anchors.size(), 0.0);
  for (std::size_t k = 1; k < run.anchors.size(); ++k) {
    out[k] = next_bias(anchor, out[k - 1], static_cast<int>(k), run.anchor_mm[k] - anchor_level_mm[k]);
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

const MatrixXd& ChannelBench::features(Method method, std::size_t run) {
  auto& all = features_[method];
  if (all.empty()) {
    const FeatureSpec spec = features_of(method, *log_);
    for (const BenchRun& r : runs_) {
      MatrixXd X = run_features(spec, *log_, log_->runs[r.log_run]);
      const Eigen::RowVectorXd reference = X.row(r.reference_row);
      X.rowwise() -= reference;
      all.push_back(std::move(X));
    }
  }
  return all[run];
}

TrainingSet ChannelBench::training(Method method, bool increments, const std::vector<std::size_t>& runs) {
  std::size_t count = 0;
  for (const std::size_t r : runs) count += runs_[r].anchors.size() - 1;
  const auto p = static_cast<Index>(features_of(method, *log_).size());
  TrainingSet out;
  out.from = MatrixXd::Zero(static_cast<Index>(count), p);
  out.to.resize(static_cast<Index>(count), p);
  out.change_mm.resize(static_cast<Index>(count));
  Index row = 0;
  for (const std::size_t r : runs) {
    const BenchRun& run = runs_[r];
    const MatrixXd& X = features(method, r);
    for (std::size_t k = 1; k < run.anchors.size(); ++k, ++row) {
      out.to.row(row) = X.row(run.anchors[k]);
      out.change_mm[row] = run.anchor_mm[k];
      if (increments) {
        out.from.row(row) = X.row(run.anchors[k - 1]);
        out.change_mm[row] -= run.anchor_mm[k - 1];
      }
      out.group.push_back(r);
    }
  }
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

double next_bias(Anchor anchor, double bias_mm, int count, double difference_mm) {
  // Half is where the noise of a measurement is as large as what the model's error moves in 1.4 intervals.
  constexpr double kFollow = 0.5;
  const double share = anchor == Anchor::filter ? std::max(kFollow, 1.0 / count) : 1.0 / count;
  return bias_mm + share * (difference_mm - bias_mm);
}

double combine(const Candidate& candidate, double level_mm, double change_mm, double last_mm,
               double bias_mm) {
  if (candidate.method == Method::none) return 0.0;
  if (candidate.method == Method::hold_last) return last_mm;
  switch (candidate.anchor) {
    case Anchor::open:
      return level_mm;
    case Anchor::bias:
    case Anchor::filter:
      return level_mm + bias_mm;
    case Anchor::update:
      return last_mm + change_mm;
  }
  TRUNNION_EXPECTS(false);
  return 0.0;
}

std::vector<double> held_out_errors(ChannelBench& bench, const Candidate& candidate, const Fitted& fitted,
                                    std::size_t run, std::size_t stride) {
  const BenchRun& r = bench.runs()[run];
  const MatrixXd* X = fitted.regressor ? &bench.features(candidate.method, run) : nullptr;
  const auto trusted_level = [&](Index row) {
    const VectorXd x = X->row(row).transpose();
    return fitted.guard.weight(x) * fitted.regressor->level_mm(x);
  };
  std::vector<double> bias(r.anchors.size(), 0.0);
  if (X != nullptr && (candidate.anchor == Anchor::bias || candidate.anchor == Anchor::filter)) {
    std::vector<double> level;
    for (const Index row : r.anchors) level.push_back(trusted_level(row));
    bias = biases(candidate.anchor, r, level);
  }
  TrackRecord record;
  std::size_t told = 0;  // the anchor up to which the record knows
  std::vector<double> out;
  for (std::size_t i = 0; i < r.rows.size(); i += stride) {
    const std::size_t k = r.anchor_of_row[i];
    double level = 0.0;
    double change = 0.0;
    if (X != nullptr && candidate.anchor == Anchor::update) {
      for (; told < k; ++told) {
        const VectorXd from = X->row(r.anchors[told]).transpose();
        const VectorXd to = X->row(r.anchors[told + 1]).transpose();
        record.add(fitted.guard.scaled(to - from), fitted.regressor->change_mm(from, to),
                   r.anchor_mm[told + 1] - r.anchor_mm[told]);
      }
      const VectorXd from = X->row(r.anchors[k]).transpose();
      const VectorXd to = X->row(r.rows[i]).transpose();
      change = record.trust(fitted.guard.scaled(to - from), fitted.guard.weight(to - from),
                            fitted.typical_change_mm) *
               fitted.regressor->change_mm(from, to);
    } else if (X != nullptr) {
      level = trusted_level(r.rows[i]);
    }
    out.push_back(combine(candidate, level, change, r.anchor_mm[k], bias[k]) - r.value_mm[i]);
  }
  return out;
}

}  // namespace trunnion::thermal
