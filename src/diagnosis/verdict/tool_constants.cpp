#include "diagnosis/verdict/tool_constants.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/fit_core.hpp"
#include "diagnosis/fit/statistics.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kDoubtfulDrift = 0.7;  // as of an effect beside an error that acts in a part only
constexpr double kOfTool = 0.9;

bool is_thermal(const ModelEffect& effect) {
  return effect.effect->info().kind == EffectClass::thermal;
}

// Which tool or ball took each reading: the places of the measured point, numbered.
std::vector<std::size_t> tool_of_readings(const Observations& o, std::size_t& count) {
  std::vector<Vec3> tools;
  std::vector<std::size_t> out;
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    const Vec3& tool = o.data().rows[o.reading(i).row].tool_mm;
    const auto at = std::find(tools.begin(), tools.end(), tool);
    out.push_back(static_cast<std::size_t>(at - tools.begin()));
    if (at == tools.end()) tools.push_back(tool);
  }
  count = tools.size();
  return out;
}

// Of each tool but the first: its measured point displaced in the spindle. What all tools share is no
// difference between them.
MatrixXd displaced_tools(const Observations& o, const std::vector<std::size_t>& tools, std::size_t count) {
  const MatrixXd& spindle = o.response(o.link_count() - 2);
  MatrixXd out = MatrixXd::Zero(o.size(), 3 * static_cast<Eigen::Index>(count - 1));
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    const std::size_t tool = tools[static_cast<std::size_t>(i)];
    if (tool > 0) out.block(i, 3 * static_cast<Eigen::Index>(tool - 1), 1, 3) = spindle.block(i, 0, 1, 3);
  }
  return out;
}

}  // namespace

void doubt_between_tools(const Observations& whole, const Model& model, const std::vector<bool>& left_out,
                         Diagnosis& d) {
  constexpr std::size_t kMostTools = 8;  // more are no longer a few constants
  if (d.verdict != Verdict::named && d.verdict != Verdict::ambiguous &&
      d.verdict != Verdict::named_but_incomplete)
    return;
  if (!std::any_of(d.additions.begin(), d.additions.end(), is_thermal)) return;
  std::size_t count = 0;
  const std::vector<std::size_t> tools = tool_of_readings(whole, count);
  if (count < 2 || count > kMostTools) return;
  Model with_all = model, rest = model;
  double thermal_parameters = 0.0;
  for (const ModelEffect& effect : d.additions) {
    with_all.effects.push_back(effect);
    if (is_thermal(effect))
      thermal_parameters += static_cast<double>(effect.parameters.size());
    else
      rest.effects.push_back(effect);
  }
  const bool alike = left_out.size() == static_cast<std::size_t>(whole.size());
  const std::vector<bool> flags = alike ? left_out : std::vector<bool>{};
  const FitCore thermal = fit_core(whole, with_all, {.robust = false}, flags);
  const FitCore plain = fit_core(whole, rest, {.robust = false}, flags);
  const MatrixXd q = pivoted_qr(plain.projected(displaced_tools(whole, tools, count)), 1e-6).Q;
  if (q.cols() == 0) return;
  const double gained = (q.transpose() * plain.white).squaredNorm();
  // Bayesian information criterion of either, against the noise beside the better one.
  const double by_tool = plain.chi2() - gained;
  const double noise = std::max(1.0, std::min(by_tool, thermal.chi2()) / std::max(thermal.dof(), 1.0));
  const double ln_n = std::log(static_cast<double>(whole.size()));
  const double ahead =
      (thermal.chi2() - by_tool) / noise + (thermal_parameters - static_cast<double>(q.cols())) * ln_n;
  if (ahead < -kThousandToOne) return;
  const std::string same =
      "the measured point of one tool or ball (its length, or its place beside the spindle's axis) that is "
      "wrong by a constant";
  if (ahead > kThousandToOne) {
    d.verdict = Verdict::not_in_library;
    d.imitators = d.effects;
    d.confidence = kOfTool;
    d.effects.clear();
    d.sets.clear();
    d.additions.clear();
    d.next.reset();
    const double p = chi2_tail(gained / noise, static_cast<double>(q.cols()));
    d.depends_on.insert(d.depends_on.begin(), {"tool", p});
    d.leftover = d.depends_on;
    d.paragraph =
        "The residual differs between the tools: " + same +
        " explains it better than a temperature does. Check the length and the run-out of each tool "
        "and ball, or measure one ball place with both.";
    return;
  }
  // Other sets that the data cannot tell apart: what is left of the first when the tool does its work.
  std::vector<std::string> others;
  for (const ModelEffect& effect : d.additions)
    if (!is_thermal(effect)) others.push_back(effect.id());
  if (!others.empty()) d.sets.push_back(std::move(others));
  d.verdict = Verdict::ambiguous;
  d.confidence = std::min(d.confidence, kDoubtfulDrift);
  d.paragraph += " Or no thermal effect is missing, but " + same +
                 ": these readings hardly tell the two apart. Measure one ball place with both tools at one "
                 "temperature.";
}

}  // namespace trunnion::diagnosis
