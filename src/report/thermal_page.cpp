#include <algorithm>
#include <cmath>

#include "trunnion/base/units.hpp"
#include "trunnion/report/thermal_report.hpp"

#include "report/svg.hpp"

namespace trunnion::report {
namespace {

using thermal::Estimate;

double micrometres(double mm) {
  return mm / kMmPerUm;
}

struct MeasuredErrors {
  double squares = 0.0;
  double count = 0.0;
  double rms() const { return count > 0.0 ? std::sqrt(squares / count) : 0.0; }
};

// Values over the run's hours; the measurements count from the same zero as the prediction.
XyPlot prediction_plot(const thermal::RunPrediction& run, const std::vector<Estimate>& estimates,
                       const std::vector<double>& measured_mm, MeasuredErrors& errors) {
  XyPlot plot{{"time", "h"}, {"deviation", "µm"}, {}, {}, {}, false};
  Series band{"two sigma", Mark::band, {}, {}, {}, {}, 0};
  Series value{"predicted", Mark::line, {}, {}, {}, {}, 0};
  Series points{"measured", Mark::points, {}, {}, {}, {}, 1};
  const double hour_s = 60.0 * kSecondsPerMinute;
  double zero_mm = std::nan("");
  for (std::size_t i = 0; i < run.time_s.size(); ++i) {
    const Estimate& e = estimates[i];
    const double hours = (run.time_s[i] - run.time_s.front()) / hour_s;
    value.x.push_back(hours);
    value.y.push_back(micrometres(e.value_mm));
    band.x.push_back(hours);
    band.y.push_back(micrometres(e.value_mm - 2.0 * e.sigma_mm));
    band.y2.push_back(micrometres(e.value_mm + 2.0 * e.sigma_mm));
    if (i >= measured_mm.size() || !std::isfinite(measured_mm[i])) continue;
    // A model knows its first measurement: what was predicted there is its zero.
    if (std::isnan(zero_mm)) zero_mm = measured_mm[i] - e.value_mm;
    points.x.push_back(hours);
    points.y.push_back(micrometres(measured_mm[i] - zero_mm));
  }
  plot.series = {std::move(band), std::move(value)};
  if (points.x.empty()) return plot;
  // Between two measurements: what was said just before the second.
  for (std::size_t i = 1; i < run.time_s.size(); ++i) {
    if (i >= measured_mm.size() || !std::isfinite(measured_mm[i])) continue;
    errors.squares += std::pow(micrometres(estimates[i - 1].value_mm - (measured_mm[i] - zero_mm)), 2);
    errors.count += 1.0;
  }
  plot.series.push_back(std::move(points));
  return plot;
}

// What holding the last measurement would say: a step at each one that the model was given.
Series held_last(const thermal::RunPrediction& run, const std::vector<Estimate>& estimates,
                 const std::vector<double>& measured_mm) {
  Series out{"hold last", Mark::line, {}, {}, {}, {}, 7};
  const double hour_s = 60.0 * kSecondsPerMinute;
  double zero_mm = std::nan("");
  double held_mm = 0.0;
  double given_s = -1.0;
  for (std::size_t i = 0; i < run.time_s.size() && i < measured_mm.size(); ++i) {
    if (std::isfinite(measured_mm[i])) {
      if (std::isnan(zero_mm)) zero_mm = measured_mm[i] - estimates[i].value_mm;
      // The model was given this measurement: its own clock begins anew.
      if (given_s < 0.0 || estimates[i].since_measured_s <= 0.0) {
        held_mm = measured_mm[i] - zero_mm;
        given_s = run.time_s[i];
      }
    }
    out.x.push_back((run.time_s[i] - run.time_s.front()) / hour_s);
    out.y.push_back(micrometres(held_mm));
  }
  return out;
}

// The best way to use each method (open, with a bias, ...): four ways of nine methods are no picture.
std::vector<const thermal::Score*> best_of_each(const thermal::ChannelReport& channel) {
  std::vector<const thermal::Score*> out;
  const auto method = [](const std::string& name) { return name.substr(0, name.find('+')); };
  for (const thermal::Score& score : channel.models) {
    const auto same = std::find_if(out.begin(), out.end(),
                                   [&](const auto* s) { return method(s->name) == method(score.name); });
    if (same == out.end())
      out.push_back(&score);
    else if (score.name == channel.chosen ||
             ((*same)->name != channel.chosen && score.rmse_mm < (*same)->rmse_mm))
      *same = &score;
  }
  return out;
}

Series bars(std::string name) {
  Series out;
  out.name = std::move(name);
  out.mark = Mark::bars;
  return out;
}

Figure by_method(const thermal::ChannelReport& channel) {
  XyPlot plot{{"", ""}, {"error on held-out runs, rms", "µm"}, {}, {}, {}, false};
  Series rms = bars("all runs");
  Series worst = bars("worst run");
  for (const thermal::Score* score : best_of_each(channel)) {
    rms.x.push_back(static_cast<double>(plot.categories.size()));
    worst.x.push_back(rms.x.back());
    rms.y.push_back(micrometres(score->rmse_mm));
    worst.y.push_back(micrometres(score->worst_run_rmse_mm));
    plot.categories.push_back(score->name + (score->name == channel.chosen ? " (chosen)" : ""));
  }
  plot.series = {std::move(rms), std::move(worst)};
  return {"methods-" + channel.channel, "Error by method",
          "Error on runs left out of the fit; each method in its best variant.", std::move(plot)};
}

Figure by_run(const thermal::ChannelReport& channel) {
  XyPlot plot{{"", ""}, {"error on held-out runs, rms", "µm"}, {}, {}, channel.runs, false};
  std::vector<std::string> names = {channel.chosen};
  for (const char* baseline : {"hold_last", "none"}) {
    if (channel.chosen != baseline) names.emplace_back(baseline);
  }
  for (const std::string& name : names) {
    const thermal::Score* score = channel.score(name);
    if (score == nullptr) continue;
    Series s = bars(name);
    for (std::size_t r = 0; r < score->run_rmse_mm.size(); ++r) {
      s.x.push_back(static_cast<double>(r));
      s.y.push_back(micrometres(score->run_rmse_mm[r]));
    }
    plot.series.push_back(std::move(s));
  }
  return {"runs-" + channel.channel, "Error by run",
          "The chosen method, compared with holding the last measurement and with no correction.",
          std::move(plot)};
}

Figure by_input(const thermal::ChannelReport& channel) {
  XyPlot plot{{"", ""}, {"effect between two measurements, rms", "µm"}, {}, {}, {}, false};
  Series effect = bars("effect");
  for (const thermal::InputEffect& input : channel.inputs) {
    effect.x.push_back(static_cast<double>(plot.categories.size()));
    effect.y.push_back(micrometres(input.rms_mm));
    plot.categories.push_back(input.name);
  }
  plot.series.push_back(std::move(effect));
  return {"inputs-" + channel.channel, "What each sensor contributes to the chosen model",
          "Contribution of each sensor to the prediction since the last measurement. Sensors with similar "
          "temperatures share it, and may have opposite signs.",
          std::move(plot)};
}

// A run that the model never saw: what was measured, what was said just before, what holding the last
// measurement says; and the errors of both.
std::pair<Figure, Figure> held_out_figures(const thermal::ChannelReport& channel, std::size_t run) {
  const thermal::HeldOutTrack& track = channel.tracks[run];
  XyPlot values{{"time", "h"}, {"deviation", "µm"}, {}, {}, {}, false};
  XyPlot errors{{"time", "h"}, {"error", "µm"}, {}, {{"", 0.0}}, {}, false};
  Series measured{"measured", Mark::points, {}, {}, {}, {}, 1};
  Series said{channel.chosen, Mark::line, {}, {}, {}, {}, 0};
  Series band{"two sigma", Mark::band, {}, {}, {}, {}, 0};
  Series hold{"hold last", Mark::line, {}, {}, {}, {}, 7};
  Series error = said;
  Series error_band = band;
  Series hold_error = hold;
  if (channel.nested) said.name = error.name = "predicted";
  for (std::size_t i = 0; i < track.time_s.size(); ++i) {
    const double hours = (track.time_s[i] - track.time_s.front()) / (60.0 * kSecondsPerMinute);
    const auto add = [hours](Series& series, double mm) {
      series.x.push_back(hours);
      series.y.push_back(micrometres(mm));
    };
    add(measured, track.measured_mm[i]);
    add(said, track.said_mm[i]);
    add(hold, track.hold_last_mm[i]);
    add(error, track.said_mm[i] - track.measured_mm[i]);
    add(hold_error, track.hold_last_mm[i] - track.measured_mm[i]);
    if (!std::isfinite(track.sigma_mm[i])) continue;
    const double two_mm = 2.0 * track.sigma_mm[i];
    add(band, track.said_mm[i] - two_mm);
    band.y2.push_back(micrometres(track.said_mm[i] + two_mm));
    add(error_band, -two_mm);
    error_band.y2.push_back(micrometres(two_mm));
  }
  values.series = {std::move(band), std::move(hold), std::move(said), std::move(measured)};
  errors.series = {std::move(error_band), std::move(hold_error), std::move(error)};
  const std::string& name = channel.runs[run];
  return {{"follow-" + channel.channel, "Predicted and measured, run " + name,
           "The run with the largest error, by a model that never saw it; sigma without it, too.",
           std::move(values)},
          {"error-" + channel.channel, "Error over time, run " + name,
           "Predicted less measured, beside the error of holding the last measurement; band: two sigma.",
           std::move(errors)}};
}

Table methods_table(const thermal::ChannelReport& channel) {
  Table out;
  out.id = "table-" + channel.channel;
  out.title = "All methods, " + channel.channel + " on runs that were held out";
  out.columns = {"method", "rms / µm", "95 % below / µm", "worst run / µm", "first hours / µm"};
  out.numeric = {false, true, true, true, true};
  const auto row = [&](const thermal::Score& s) {
    const auto um = [](double mm) { return short_number(micrometres(mm), 4); };
    out.rows.push_back({s.name, um(s.rmse_mm), um(s.p95_mm), um(s.worst_run_rmse_mm), um(s.window_rmse_mm)});
  };
  for (const auto& s : channel.models) row(s);
  if (channel.nested) row(*channel.nested);
  for (const auto& note : channel.notes) out.caption += (out.caption.empty() ? "" : " ") + note + ".";
  return out;
}

std::string said_of(const thermal::ChannelReport& channel) {
  const thermal::Score* chosen = channel.score(channel.chosen);
  const thermal::Score* hold = channel.score("hold_last");
  const thermal::Score* none = channel.score("none");
  const auto um = [](const thermal::Score* s) {
    return s == nullptr ? "–" : short_number(micrometres(s->rmse_mm), 3) + " µm";
  };
  std::string out = channel.channel + ": " + channel.chosen + " errs by " + um(chosen) +
                    " rms on runs that it never saw; holding the last measurement by " + um(hold) +
                    ", no correction by " + um(none);
  if (channel.nested) out += "; with the choice itself held out " + um(&*channel.nested);
  return out + ".";
}

}  // namespace

Page thermal_fit_page(const thermal::FitResult& result, const thermal::Log& log,
                      const std::string& result_json, const std::string& made_by) {
  Page page;
  page.title = "Thermal model of " + log.file;
  page.result_json = result_json;
  page.made_by = made_by;
  page.tone = Tone::good;
  for (std::size_t c = 0; c < result.channels.size(); ++c) {
    const thermal::ChannelReport& channel = result.channels[c];
    const thermal::ChannelModel& model = result.model.channels[c];
    page.verdict += (page.verdict.empty() ? "" : " ") + said_of(channel);
    if (model.heldout_rmse_mm > model.hold_last_rmse_mm) page.tone = Tone::neutral;
    Section section{channel.channel, {by_method(channel), by_run(channel)}};
    const thermal::Score& held_out = channel.nested ? *channel.nested : *channel.score(channel.chosen);
    const auto& rmse = held_out.run_rmse_mm;
    auto [follow, error] = held_out_figures(
        channel, static_cast<std::size_t>(std::max_element(rmse.begin(), rmse.end()) - rmse.begin()));
    section.items.emplace_back(std::move(follow));
    section.items.emplace_back(std::move(error));
    if (channel.inputs.empty())
      section.items.emplace_back(Paragraph{"The chosen method reads no sensor."});
    else
      section.items.emplace_back(by_input(channel));
    section.items.emplace_back(methods_table(channel));
    page.sections.push_back(std::move(section));
  }
  return page;
}

Page thermal_prediction_page(const thermal::ThermalModel& model, const thermal::Log& log,
                             const std::vector<thermal::RunPrediction>& runs, const std::string& result_json,
                             const std::string& made_by) {
  Page page;
  page.title = "Predicted thermal deviation: " + log.file;
  page.result_json = result_json;
  page.made_by = made_by;
  std::size_t outside = 0;
  std::size_t stale = 0;
  double largest_mm = 0.0;
  std::vector<MeasuredErrors> errors(model.channels.size());
  std::size_t number = 0;
  for (const thermal::RunPrediction& run : runs) {
    Section section{"Run " + run.run, {}};
    const auto same = [&](const thermal::LogRun& r) { return r.id == run.run; };
    const auto log_run = std::find_if(log.runs.begin(), log.runs.end(), same);
    for (std::size_t c = 0; c < model.channels.size(); ++c) {
      const thermal::ChannelModel& channel = model.channels[c];
      for (const Estimate& e : run.channel[c]) {
        if (e.outside_training()) ++outside;
        if (e.stale) ++stale;
        largest_mm = std::max(largest_mm, std::abs(e.value_mm));
      }
      const auto index = log.channel(channel.channel);
      const bool measured = index && log_run != log.runs.end();
      XyPlot plot = prediction_plot(
          run, run.channel[c], measured ? log_run->channel_mm[*index] : std::vector<double>(), errors[c]);
      if (measured) plot.series.push_back(held_last(run, run.channel[c], log_run->channel_mm[*index]));
      section.items.emplace_back(Figure{"run-" + std::to_string(++number),
                                        channel.channel + " by " + channel.candidate.name(),
                                        "Deviation of the tool from the part since the run's zero; the band "
                                        "is twice the standard uncertainty.",
                                        std::move(plot)});
    }
    page.sections.push_back(std::move(section));
  }
  page.verdict =
      std::to_string(runs.size()) + (runs.size() == 1 ? " run" : " runs") + ": deviations up to " +
      short_number(micrometres(largest_mm), 4) + " µm" +
      (outside + stale == 0 ? "; all conditions were seen in the training runs."
                            : "; " + std::to_string(outside) + " values are outside the training, " +
                                  std::to_string(stale) + " with a silent sensor: trusted less.");
  page.tone = outside + stale == 0 ? Tone::good : Tone::neutral;
  for (std::size_t c = 0; c < errors.size(); ++c) {
    if (errors[c].count == 0.0) continue;
    page.facts.push_back({"rms_before_measurement_um:" + model.channels[c].channel,
                          model.channels[c].channel + ": rms just before a measurement",
                          short_number(errors[c].rms(), 3) + " µm", errors[c].rms()});
  }
  return page;
}

}  // namespace trunnion::report
