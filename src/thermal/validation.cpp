#include "trunnion/thermal/validation.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

#include "thermal/bench.hpp"
#include "thermal/regressors.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::Index;
using Errors = std::vector<std::vector<double>>;  // [run][row]

double root_mean_square(const std::vector<double>& errors) {
  double sum = 0.0;
  for (const double e : errors) sum += e * e;
  return errors.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(errors.size()));
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size()))) - 1;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

Score score_of(const std::string& name, const Errors& errors, const ChannelBench& bench, double window_s) {
  Score out;
  out.name = name;
  std::vector<double> all;
  std::vector<double> window_rmse;
  for (std::size_t r = 0; r < errors.size(); ++r) {
    const BenchRun& run = bench.runs()[r];
    const auto& time_s = bench.log_run(r).time_s;
    std::vector<double> early;
    for (std::size_t i = 0; i < errors[r].size(); ++i) {
      all.push_back(std::abs(errors[r][i]));
      const double since_s =
          time_s[static_cast<std::size_t>(run.rows[i])] - time_s[static_cast<std::size_t>(run.reference_row)];
      if (since_s <= window_s) early.push_back(errors[r][i]);
    }
    out.run_rmse_mm.push_back(root_mean_square(errors[r]));
    window_rmse.push_back(root_mean_square(early));
  }
  const auto runs = static_cast<double>(errors.size());
  out.rmse_mm = root_mean_square(all);
  out.p95_mm = quantile(all, 0.95);
  out.mean_run_rmse_mm = std::accumulate(out.run_rmse_mm.begin(), out.run_rmse_mm.end(), 0.0) / runs;
  out.median_run_rmse_mm = quantile(out.run_rmse_mm, 0.5);
  out.worst_run_rmse_mm = *std::max_element(out.run_rmse_mm.begin(), out.run_rmse_mm.end());
  out.window_rmse_mm = std::accumulate(window_rmse.begin(), window_rmse.end(), 0.0) / runs;
  out.window_worst_rmse_mm = *std::max_element(window_rmse.begin(), window_rmse.end());
  return out;
}

std::vector<std::size_t> all_but(std::size_t count, const std::vector<std::size_t>& without) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < count; ++i) {
    if (std::find(without.begin(), without.end(), i) == without.end()) out.push_back(i);
  }
  return out;
}

// Leave-one-run-out errors of a candidate at all measured rows.
Result<Errors> leave_one_out(ChannelBench& bench, const Candidate& candidate) {
  Errors out;
  for (std::size_t r = 0; r < bench.runs().size(); ++r) {
    const auto fitted = fit_candidate(bench, candidate, all_but(bench.runs().size(), {r}));
    if (!fitted) return tl::unexpected(fitted.error());
    out.push_back(held_out_errors(bench, candidate, *fitted, r, 1));
  }
  return out;
}

// Mean square errors of a candidate on each of the runs but `held`, in at most five folds, none of which saw
// `held`; empty when it cannot be fitted.
std::vector<double> inner_errors(ChannelBench& bench, const Candidate& candidate, std::size_t held) {
  constexpr std::size_t kFolds = 5;
  constexpr std::size_t kStride = 10;  // neighbouring rows say the same
  const auto others = all_but(bench.runs().size(), {held});
  const std::size_t folds = std::min(kFolds, others.size());
  std::vector<double> mean_squares;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<std::size_t> out = {held};
    for (std::size_t i = fold; i < others.size(); i += folds) out.push_back(others[i]);
    const auto fitted = fit_candidate(bench, candidate, all_but(bench.runs().size(), out));
    if (!fitted) return {};
    for (std::size_t i = 1; i < out.size(); ++i) {
      const std::size_t rows = bench.runs()[out[i]].rows.size();
      const auto errors =
          held_out_errors(bench, candidate, *fitted, out[i], rows > 5 * kStride ? kStride : 1);
      mean_squares.push_back(std::pow(root_mean_square(errors), 2));
    }
  }
  return mean_squares;
}

struct Tried {
  Candidate candidate;
  Errors errors;
};

// How much a method can make of the same data.
int freedom(Method method) {
  switch (method) {
    case Method::none:
      return 0;
    case Method::hold_last:
      return 1;
    case Method::rises:
      return 2;
    case Method::lag:
      return 3;
    case Method::ridge:
      return 4;
    case Method::ols:
      return 5;
    case Method::combined:
      return 6;
    case Method::svr:
    case Method::svr_all:
      return 7;
    case Method::gp:
      return 8;
    case Method::mean:
      return 9;
  }
  return 10;
}

// The candidate to take, from `first` on, given its mean square errors on the same runs (every run counts
// alike): the least. Where the channel was measured only when it was made known (`blind`), what a richer
// method does between the measurements no measurement has seen: of those that the runs cannot tell from the
// best one (within one standard error of the difference) the one with the least freedom.
std::size_t choose(const std::vector<Tried>& tried, const std::vector<std::vector<double>>& mean_squares,
                   std::size_t first, bool blind) {
  const auto mean = [](const std::vector<double>& v) {
    return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
  };
  std::size_t best = tried.size();
  for (std::size_t i = first; i < tried.size(); ++i) {
    if (mean_squares[i].empty()) continue;
    if (best == tried.size() || mean(mean_squares[i]) < mean(mean_squares[best])) best = i;
  }
  if (best == tried.size()) return first;
  if (!blind) return best;
  std::size_t out = best;
  for (std::size_t i = first; i < tried.size(); ++i) {
    const std::size_t runs = mean_squares[i].size();
    if (runs < 3) continue;
    std::vector<double> difference(runs);
    for (std::size_t r = 0; r < runs; ++r) difference[r] = mean_squares[i][r] - mean_squares[best][r];
    const double shift = mean(difference);
    double spread = 0.0;
    for (const double d : difference) spread += (d - shift) * (d - shift);
    const auto n = static_cast<double>(runs);
    if (shift > std::sqrt(spread / (n - 1.0) / n)) continue;
    const int more = freedom(tried[i].candidate.method) - freedom(tried[out].candidate.method);
    if (more < 0 || (more == 0 && mean(mean_squares[i]) < mean(mean_squares[out]))) out = i;
  }
  return out;
}

// For each run the candidate that is chosen without it.
std::vector<std::size_t> nested_choice(ChannelBench& bench, const std::vector<Tried>& tried) {
  std::vector<std::size_t> out;
  for (std::size_t held = 0; held < bench.runs().size(); ++held) {
    std::vector<std::vector<double>> mean_squares;
    mean_squares.reserve(tried.size());
    for (const Tried& t : tried) mean_squares.push_back(inner_errors(bench, t.candidate, held));
    out.push_back(choose(tried, mean_squares, 0, bench.blind()));
  }
  return out;
}

// Each run by the candidate of `choice`, fitted without it.
HeldOutRuns held_out_runs(ChannelBench& bench, const std::vector<Candidate>& choice) {
  HeldOutRuns out;
  for (std::size_t r = 0; r < bench.runs().size(); ++r) {
    const auto fitted = fit_candidate(bench, choice[r], all_but(bench.runs().size(), {r}));
    out.push_back(fitted ? held_out(bench, choice[r], *fitted, r) : std::vector<HeldOut>{});
  }
  return out;
}

HeldOutTrack track_of(const ChannelBench& bench, std::size_t r, const std::vector<HeldOut>& held,
                      const std::vector<double>& sigma_mm, const std::vector<double>& hold_last_error_mm) {
  const BenchRun& run = bench.runs()[r];
  HeldOutTrack out;
  out.sigma_mm = sigma_mm;
  for (std::size_t i = 0; i < held.size(); ++i) {
    out.measured_mm.push_back(run.value_mm[i]);
    out.time_s.push_back(bench.log_run(r).time_s[static_cast<std::size_t>(run.rows[i])]);
    out.said_mm.push_back(run.value_mm[i] + held[i].error_mm);
    out.hold_last_mm.push_back(run.value_mm[i] + hold_last_error_mm[i]);
  }
  return out;
}

// The inputs of a model's features, and which features each one has.
std::vector<std::pair<std::string, std::vector<Index>>> inputs_of(const FeatureSpec& spec) {
  std::vector<std::pair<std::string, std::vector<Index>>> out;
  const auto sensors = static_cast<Index>(spec.sensors.size());
  const auto temperatures = sensors * static_cast<Index>(spec.temperature_taus_s.size());
  const auto speeds = static_cast<Index>(spec.speed_taus_s.size() * spec.speed_powers.size());
  for (Index s = 0; s < sensors; ++s) {
    out.emplace_back(spec.sensors[static_cast<std::size_t>(s)], std::vector<Index>());
    for (Index k = s; k < temperatures; k += sensors) out.back().second.push_back(k);
  }
  const auto add = [&](const char* name, Index first, Index end) {
    if (first == end) return;
    out.emplace_back(name, std::vector<Index>(static_cast<std::size_t>(end - first)));
    std::iota(out.back().second.begin(), out.back().second.end(), first);
  };
  add("spindle_rpm", temperatures, temperatures + speeds);
  add("feed_mm_min", temperatures + speeds, static_cast<Index>(spec.size()));
  return out;
}

std::vector<InputEffect> effects_of_inputs(ChannelBench& bench, const ChannelModel& model) {
  std::vector<InputEffect> out;
  if (!model.regressor) return out;
  const TrainingSet changes = bench.training(model.candidate.method, model.candidate.anchor == Anchor::update,
                                             all_but(bench.runs().size(), {}));
  for (const auto& [name, columns] : inputs_of(model.features)) {
    double squares = 0.0;
    for (Index row = 0; row < changes.to.rows(); ++row) {
      const Eigen::VectorXd from = changes.from.row(row).transpose();
      const Eigen::VectorXd to = changes.to.row(row).transpose();
      Eigen::VectorXd without = to;
      for (const Index k : columns) without[k] = from[k];
      squares +=
          std::pow(model.regressor->change_mm(from, to) - model.regressor->change_mm(from, without), 2);
    }
    out.push_back({name, std::sqrt(squares / static_cast<double>(std::max<Index>(1, changes.to.rows())))});
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const InputEffect& a, const InputEffect& b) { return a.rms_mm > b.rms_mm; });
  return out;
}

std::vector<Candidate> candidates(const Log& log, const FitOptions& options) {
  std::vector<Candidate> out = {{Method::none, Anchor::open}, {Method::hold_last, Anchor::open}};
  std::vector<Method> methods = {Method::ols, Method::svr, Method::svr_all, Method::rises, Method::ridge};
  if (log.has_speed || log.has_feed) methods.insert(methods.end(), {Method::lag, Method::combined});
  methods.insert(methods.end(), {Method::gp, Method::mean});
  for (const Method method : methods) {
    if (options.method && *options.method != method) continue;
    if (features_of(method, log).size() == 0) continue;  // no sensor is left
    for (const Anchor anchor : {Anchor::open, Anchor::bias, Anchor::filter, Anchor::update})
      out.push_back({method, anchor});
  }
  return out;
}

struct Validated {
  ChannelReport report;
  std::vector<Tried> tried;
};

// A run that the others do not explain spoils the model, and its own data are the first thing to look at.
void tell_doubtful_runs(const HeldOutRuns& held, const std::vector<std::vector<double>>& sigma_mm,
                        ChannelReport& report) {
  constexpr double kDoubtful = 0.5;
  // Four of six readings of a good run may lie a little beyond 2 sigma: of those that are missed most are far
  // off, or nearly all are missed.
  constexpr double kFar = 3.0;
  constexpr double kNearlyNone = 0.25;
  for (std::size_t r = 0; r < report.coverage.size(); ++r) {
    std::vector<double> in_sigmas;
    for (std::size_t i = 0; i < held[r].size(); ++i) {
      if (!held[r][i].causes.held) in_sigmas.push_back(std::abs(held[r][i].error_mm) / sigma_mm[r][i]);
    }
    if (!(report.coverage[r] < kDoubtful)) continue;
    if (report.coverage[r] >= kNearlyNone && quantile(in_sigmas, 0.5) < kFar) continue;
    report.warnings.push_back("run '" + report.runs[r] + "': " + fixed_text(100.0 * report.coverage[r], 0) +
                              " % of its readings are within the interval that the other runs promise: sign, "
                              "unit or exchanged sensors?");
  }
}

// Takes doing nothing or holding the last measurement where the choice, held out, is worse than it.
bool fall_back(ChannelReport& report) {
  if (!report.nested) return false;
  const Score* none = report.score("none");
  const Score* hold = report.score("hold_last");
  const Score& better = none->rmse_mm < hold->rmse_mm ? *none : *hold;
  if (report.nested->rmse_mm <= better.rmse_mm) return false;
  const auto um = [](double mm) { return fixed_text(mm / kMmPerUm, 2) + " um"; };
  report.warnings.push_back(
      "no method helps: the best one, chosen without the run that it predicts, misses it by " +
      um(report.nested->rmse_mm) + ", " + better.name + " by " + um(better.rmse_mm) + ": " + better.name +
      " is taken");
  report.chosen = better.name;
  report.nested.reset();
  return true;
}

// Of so many channels, for the progress that is shown.
Result<Validated> validate_channel(ChannelBench& bench, const std::string& channel, const Log& log,
                                   const FitOptions& options, std::size_t channels) {
  Validated validated;
  ChannelReport& out = validated.report;
  std::vector<Tried>& tried = validated.tried;
  out.channel = channel;
  const auto all = candidates(log, options);
  for (const Candidate& candidate : all) {
    if (options.progress) options.progress(channels * all.size());
    auto errors = leave_one_out(bench, candidate);
    if (!errors) {
      const std::string note = method_name(candidate.method) + ": " + errors.error().message;
      if (std::find(out.notes.begin(), out.notes.end(), note) == out.notes.end()) out.notes.push_back(note);
      continue;
    }
    out.models.push_back(score_of(candidate.name(), *errors, bench, options.window_s));
    tried.push_back({candidate, std::move(*errors)});
  }
  // A method that was asked for is chosen among its own three ways of use; automatic choice is among all, the
  // baselines too.
  const std::size_t first = options.method ? 2 : 0;
  if (out.models.size() <= first) {
    return fail(ErrorCode::wrong_input,
                "channel '" + channel + "': " + (out.notes.empty() ? "no method fits" : out.notes.front()),
                log.file);
  }
  std::vector<std::vector<double>> mean_squares;
  for (const Tried& t : tried) {
    mean_squares.emplace_back();
    for (const auto& errors : t.errors) mean_squares.back().push_back(std::pow(root_mean_square(errors), 2));
  }
  out.chosen = tried[choose(tried, mean_squares, first, bench.blind())].candidate.name();
  const auto best = std::find_if(tried.begin(), tried.end(),
                                 [&](const Tried& t) { return t.candidate.name() == out.chosen; });
  std::vector<Candidate> by_run(bench.runs().size(), best->candidate);
  if (!options.method && bench.runs().size() >= 4) {
    Errors errors;
    const auto choice = nested_choice(bench, tried);
    for (std::size_t r = 0; r < choice.size(); ++r) {
      by_run[r] = tried[choice[r]].candidate;
      errors.push_back(tried[choice[r]].errors[r]);
    }
    out.nested = score_of("auto (nested)", errors, bench, options.window_s);
  }
  for (const BenchRun& run : bench.runs()) out.runs.push_back(log.runs[run.log_run].id);
  HeldOutRuns held = held_out_runs(bench, by_run);
  auto sigma_mm = held_out_sigmas(held);
  out.coverage = coverage_of(held, sigma_mm);
  tell_doubtful_runs(held, sigma_mm, out);
  if (fall_back(out)) {
    const auto baseline = std::find_if(tried.begin(), tried.end(),
                                       [&](const Tried& t) { return t.candidate.name() == out.chosen; });
    held = held_out_runs(bench, std::vector<Candidate>(bench.runs().size(), baseline->candidate));
    sigma_mm = held_out_sigmas(held);
    out.coverage = coverage_of(held, sigma_mm);
  }
  out.sigma = fit_sigma(held);
  for (std::size_t r = 0; r < held.size(); ++r) {
    const std::vector<double> none(held[r].size(), std::nan(""));
    out.tracks.push_back(
        track_of(bench, r, held[r], sigma_mm.empty() ? none : sigma_mm[r], tried[1].errors[r]));
  }
  out.hold_sigma = fit_sigma(
      held_out_runs(bench, std::vector<Candidate>(bench.runs().size(), {Method::hold_last, Anchor::open})));
  return validated;
}

Result<ChannelModel> final_model(ChannelBench& bench, const ChannelReport& report,
                                 const std::vector<Tried>& tried, const Log& log) {
  const auto best = std::find_if(tried.begin(), tried.end(),
                                 [&](const Tried& t) { return t.candidate.name() == report.chosen; });
  const auto fitted = fit_candidate(bench, best->candidate, all_but(bench.runs().size(), {}));
  if (!fitted) return tl::unexpected(fitted.error());
  ChannelModel out;
  out.channel = report.channel;
  out.axis = axis_of_name(report.channel);
  out.candidate = best->candidate;
  out.features = features_of(best->candidate.method, log);
  out.regressor = fitted->regressor;
  out.guard = fitted->guard;
  out.typical_change_mm = fitted->typical_change_mm;
  out.sigma = report.sigma;
  out.hold_sigma = report.hold_sigma;
  out.heldout_rmse_mm = report.score(report.chosen)->rmse_mm;
  out.hold_last_rmse_mm = report.score("hold_last")->rmse_mm;
  for (const BenchRun& run : bench.runs()) {
    for (const double v : run.value_mm) out.largest_mm = std::max(out.largest_mm, std::abs(v));
  }
  return out;
}

}  // namespace

const Score* ChannelReport::score(std::string_view name) const {
  const auto it = std::find_if(models.begin(), models.end(), [&](const Score& s) { return s.name == name; });
  return it == models.end() ? nullptr : &*it;
}

Result<FitResult> fit_thermal(const Log& log, const FitOptions& options, Diagnostics& diagnostics) {
  FitResult out;
  out.model.name = options.name;
  out.model.data_hash = data_hash(log);
  out.model.files = {log.file};
  out.model.measure_every_s = options.measure_every_s;
  for (const LogRun& run : log.runs) out.model.runs.push_back(run.id);
  const auto targets = options.targets.empty() ? log.channels : options.targets;
  if (targets.empty())
    return fail(ErrorCode::wrong_input, "the log has no measured channel (<channel>_um)", log.file);
  if (log.sensors.empty() && !log.has_speed && !log.has_feed)
    return fail(ErrorCode::wrong_input,
                "the log has no temperature (T_<name>_degC), or none that can be used, and no spindle_rpm or "
                "feed_mm_min",
                log.file);
  for (const std::string& target : targets) {
    const auto channel = log.channel(target);
    if (!channel)
      return fail(ErrorCode::wrong_input,
                  std::string("the log has no channel '")
                      .append(target)
                      .append("' (column ")
                      .append(target)
                      .append("_um)"),
                  log.file);
    ChannelBench bench(log, *channel, options.measure_every_s);
    if (bench.runs().size() < 2) {
      return fail(ErrorCode::wrong_input,
                  "channel '" + target + "' was measured in " + std::to_string(bench.runs().size()) +
                      " run(s): two or more are needed, since a run is what is held out",
                  log.file);
    }
    auto validated = validate_channel(bench, target, log, options, targets.size());
    if (!validated) return tl::unexpected(validated.error());
    ChannelReport& report = validated->report;
    for (const auto& note : report.notes)
      diagnostics.note(log.file, {}, std::string("channel '").append(target).append("': ").append(note));
    for (const auto& warning : report.warnings)
      diagnostics.warning(log.file, {},
                          std::string("channel '").append(target).append("': ").append(warning));
    auto model = final_model(bench, report, validated->tried, log);
    if (!model) return tl::unexpected(model.error());
    report.inputs = effects_of_inputs(bench, *model);
    out.model.channels.push_back(std::move(*model));
    out.channels.push_back(std::move(report));
  }
  return out;
}

}  // namespace trunnion::thermal
