#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/report/thermal_report.hpp"

#include "report/columns.hpp"

namespace trunnion::report {
namespace {

using namespace thermal;

std::string um_cell(double mm) {
  return right(fixed_text(mm / kMmPerUm, 2), 10);
}
std::string plain(double value, int decimals, std::size_t width) {
  return right(std::isfinite(value) && std::abs(value) < 1e9 ? fixed_text(value, decimals) : "inf", width);
}

std::string score_line(const Score& s, bool chosen) {
  return std::string(chosen ? "* " : "  ") + left(s.name, 16) + um_cell(s.rmse_mm) + um_cell(s.p95_mm) +
         um_cell(s.worst_run_rmse_mm) + um_cell(s.window_rmse_mm) + um_cell(s.window_worst_rmse_mm) + "\n";
}

// Here each axis moves alone; in a model file it moves with the axis that carries it, which comes first.
std::string carried_axis_text(const DriftSplit& split) {
  for (std::size_t i = 0; i < split.parameters.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const std::string &outer = split.parameters[k].name, &inner = split.parameters[i].name;
      if (outer.size() != 3 || inner.size() != 3 || outer[1] != '0' || inner[1] != '0' ||
          outer[0] != inner[0])
        continue;
      return "Each axis moves alone here. In a model file " + inner.substr(2) + " goes with " +
             outer.substr(2) + ": its " + inner + " is " + inner + " minus " + outer + " of these.\n";
    }
  }
  return "";
}

}  // namespace

std::string thermal_fit_text(const FitResult& result, const thermal::FitOptions& options) {
  const std::string minutes = shortest_text(options.measure_every_s / kSecondsPerMinute);
  const std::string hours = shortest_text(options.window_s / (kSecondsPerMinute * kSecondsPerMinute));
  std::string out = "Error on runs left out of the fit, um; measured each " + minutes + " min.\n";
  for (std::size_t c = 0; c < result.channels.size(); ++c) {
    const ChannelReport& channel = result.channels[c];
    out += "\n" + left(channel.channel, 18) + right("rmse", 10) + right("p95", 10) + right("worst run", 10) +
           right(hours + " h", 10) + right("worst", 10) + "\n";
    for (const Score& s : channel.models) out += score_line(s, s.name == channel.chosen);
    if (channel.nested) out += score_line(*channel.nested, false);
    for (const auto& note : channel.notes) out += "  not possible: " + note + "\n";
    const Score& hold = *channel.score("hold_last");
    const Score& best = channel.nested ? *channel.nested : *channel.score(channel.chosen);
    // The first question of every user: is it better than probing again?
    const double gain = hold.rmse_mm > 0.0 ? 100.0 * (1.0 - best.rmse_mm / hold.rmse_mm) : 0.0;
    out += "  chosen: " + channel.chosen + "; against holding the last measurement: " + fixed_text(gain, 0) +
           " % less error" + (channel.nested ? " (the choice itself held out)" : "") + "\n";
    if (channel.coverage.empty()) continue;
    out += "  within 1.96 sigma (95 % promised), each run held out:";
    for (std::size_t r = 0; r < channel.coverage.size(); ++r)
      out += " " + channel.runs[r] + " " + plain(100.0 * channel.coverage[r], 0, 0) + " %";
    out += "\n";
  }
  return out;
}

std::string thermal_screen_text(const std::vector<ChannelScreen>& channels) {
  std::string out;
  for (const ChannelScreen& channel : channels) {
    out += channel.channel + ": " + std::to_string(channel.measurements) + " measurements in " +
           std::to_string(channel.runs) + " runs, condition number " + plain(channel.condition, 1, 0) + "\n";
    out += left("  sensor", 18) + right("W", 9) + right("p(normal)", 11) + right("p(slope)", 11) +
           right("VIF", 10) + right("p<0.05", 8) + right("of folds", 10) + right("held-out", 10) + "\n";
    for (const SensorScreen& s : channel.sensors) {
      out += left("  " + s.sensor, 18) +
             (s.normality ? plain(s.normality->W, 5, 9) + plain(s.normality->p, 5, 11)
                          : right("-", 9) + right("-", 11)) +
             (s.p ? plain(*s.p, 5, 11) : right("-", 11)) + plain(s.variance_inflation, 1, 10) +
             right(s.chosen_by_p ? "yes" : "", 8) + plain(100.0 * s.share_of_folds, 0, 8) + " %" +
             right(s.chosen_by_runs ? "yes" : "", 10) + "\n";
    }
    out += "  held-out RMSE, um: all sensors" + um_cell(channel.heldout_all_mm) + ", p < 0.05" +
           um_cell(channel.heldout_p_mm) + ", held-out runs" + um_cell(channel.heldout_runs_mm) +
           "; overlap of the p-sets " + plain(channel.p_jaccard, 2, 0) + "\n";
    for (const auto& warning : channel.warnings) out += "  warning: " + warning + "\n";
    out += "\n";
  }
  return out;
}

std::string thermal_split_text(const DriftSplit& split) {
  std::string out = left("shift", 10) + right("um", 10) + right("sigma", 10) + "\n";
  for (const DriftParameter& p : split.parameters) {
    out += left(p.name, 10);
    out += p.identifiable ? um_cell(p.value_mm) + um_cell(p.sigma_mm) : right("not told", 20);
    out += "\n";
  }
  out += "rank " + std::to_string(split.rank) + " of " + std::to_string(split.parameters.size()) +
         ", condition " + plain(split.condition, 1, 0) + ", residual " +
         fixed_text(split.rms_mm / kMmPerUm, 2) + " um RMS\n";
  for (const auto& direction : split.null_directions) out += direction + "\n";
  return out + carried_axis_text(split);
}

std::string thermal_assess_text(const std::vector<BladeResult>& blades, double tolerance_mm) {
  constexpr double kPercent = 100.0;
  const auto um = [](double mm, int digits) { return fixed_text(mm / kMmPerUm, digits); };
  std::string out = "run         blade  uncorrected  corrected   [um]\n";
  for (const BladeResult& b : blades) {
    out += left(b.run, 12) + "    " + std::to_string(b.blade) + right(um(b.before_mm, 1), 13) +
           right(um(b.after_mm, 1), 11) + "\n";
  }
  const auto share = [&](double BladeResult::*deviation) {
    return fixed_text(kPercent * share_within(blades, deviation, tolerance_mm), 2) + " %";
  };
  return out + std::to_string(blades.size()) + " blades, within " + shortest_text(tolerance_mm) +
         " mm: " + share(&BladeResult::before_mm) + " uncorrected, " + share(&BladeResult::after_mm) +
         " corrected; RMS of X and Y each " + um(rms_mm(blades, &BladeResult::before_rms_mm), 2) +
         " um uncorrected, " + um(rms_mm(blades, &BladeResult::after_rms_mm), 2) +
         " um corrected (one measurement: " + um(kMeasurementFloor_mm, 2) + " um)\n";
}

}  // namespace trunnion::report
