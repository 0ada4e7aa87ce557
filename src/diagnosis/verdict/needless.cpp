#include "diagnosis/verdict/needless.hpp"

#include <algorithm>
#include <cmath>

#include "diagnosis/fit/statistics.hpp"

namespace trunnion::diagnosis {
namespace {

double chi2_with(const Observations& o, Model model, const std::vector<ModelEffect>& effects,
                 const std::vector<ModelEffect>& formula, const std::vector<bool>& left_out) {
  model.effects.insert(model.effects.end(), effects.begin(), effects.end());
  model.effects.insert(model.effects.end(), formula.begin(), formula.end());
  return fit_core(o, model, {.robust = false}, left_out).chi2();
}

}  // namespace

std::vector<ModelEffect> needed_beside(const Observations& o, const Model& base,
                                       const std::vector<ModelEffect>& named,
                                       const std::vector<ModelEffect>& formula,
                                       const std::vector<bool>& left_out) {
  std::vector<ModelEffect> out = named;
  const double price = std::log(static_cast<double>(std::max<Eigen::Index>(o.size(), 2)));
  double chi2 = chi2_with(o, base, out, formula, left_out);
  while (!out.empty()) {
    std::size_t least = out.size();
    double least_rise = INFINITY, least_chi2 = chi2;
    for (std::size_t k = 0; k < out.size(); ++k) {
      std::vector<ModelEffect> fewer = out;
      fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(k));
      const double without = chi2_with(o, base, fewer, formula, left_out);
      const double rise = without - chi2 - price * static_cast<double>(out[k].parameters.size());
      if (rise >= least_rise) continue;
      least = k;
      least_rise = rise;
      least_chi2 = without;
    }
    if (least_rise > kThousandToOne) break;
    out.erase(out.begin() + static_cast<std::ptrdiff_t>(least));
    chi2 = least_chi2;
  }
  return out;
}

}  // namespace trunnion::diagnosis
