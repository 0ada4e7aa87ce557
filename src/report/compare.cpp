#include "trunnion/report/compare.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "trunnion/base/number_text.hpp"

#include "report/json_text.hpp"

namespace trunnion::report {

DeviationFigures deviation_figures(const post::VerifyReport& report) {
  std::vector<double> tips;
  for (const auto& block : report.blocks) {
    if (!block.rapid) tips.push_back(static_cast<double>(block.tip_deviation_mm));
  }
  DeviationFigures out;
  if (tips.empty()) return out;
  double squares = 0.0;
  for (const double tip : tips) {
    out.mean += tip;
    squares += tip * tip;
  }
  const auto count = static_cast<double>(tips.size());
  out.mean /= count;
  out.rms = std::sqrt(squares / count);
  std::sort(tips.begin(), tips.end());
  out.p95 = tips[static_cast<std::size_t>(std::ceil(0.95 * count)) - 1];
  out.max = tips.back();
  return out;
}

std::string compare_table(const std::vector<ComparedProgram>& programs) {
  std::size_t width = 7;
  for (const auto& p : programs) width = std::max(width, p.file.size());
  const auto left = [&](std::string text) {
    text.resize(std::max(width, text.size()), ' ');
    return text;
  };
  const auto right = [](const std::string& text) {
    return std::string(text.size() < 12 ? 12 - text.size() : 1, ' ') + text;
  };
  const bool flute = std::any_of(programs.begin(), programs.end(),
                                 [](const ComparedProgram& p) { return p.verification.flute_mm > 0.0; });
  std::string out = left("program") + right("blocks") + right("mean mm") + right("rms mm") + right("p95 mm") +
                    right("max mm") + right("axis deg") + (flute ? right("flute mm") : "") + "\n";
  for (const auto& p : programs) {
    const DeviationFigures f = deviation_figures(p.verification);
    out += left(p.file) + right(std::to_string(p.verification.feed_blocks)) + right(fixed_text(f.mean, 6)) +
           right(fixed_text(f.rms, 6)) + right(fixed_text(f.p95, 6)) + right(fixed_text(f.max, 6)) +
           right(fixed_text(p.verification.max_axis_deviation.deg(), 4)) +
           (flute ? right(fixed_text(p.verification.max_flute_deviation_mm, 6)) : "") + "\n";
  }
  return out;
}

std::string compare_json(const std::vector<ComparedProgram>& programs) {
  nlohmann::ordered_json out;
  out["machine"] = !programs.empty() && programs[0].verification.on_truth ? "with errors" : "nominal";
  auto& list = out["programs"] = nlohmann::ordered_json::array();
  for (const auto& p : programs) {
    const DeviationFigures f = deviation_figures(p.verification);
    const post::VerifyReport& v = p.verification;
    list.push_back({{"file", p.file},
                    {"feed_blocks", v.feed_blocks},
                    {"mean_tip_deviation_mm", f.mean},
                    {"rms_tip_deviation_mm", f.rms},
                    {"p95_tip_deviation_mm", f.p95},
                    {"max_tip_deviation_mm", f.max},
                    {"max_axis_deviation_deg", v.max_axis_deviation.deg()},
                    {"flute_length_mm", v.flute_mm},
                    {"max_flute_deviation_mm", v.max_flute_deviation_mm},
                    {"points_missed", v.points_missed},
                    {"limits_ok", v.limits_ok()},
                    {"within_tolerance", v.within_tolerance()}});
  }
  return json_text(out);
}

}  // namespace trunnion::report
