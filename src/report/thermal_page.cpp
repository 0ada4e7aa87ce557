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

}  // namespace

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
      (outside + stale == 0 ? "; every state is inside the training."
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
