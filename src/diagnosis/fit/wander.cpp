#include "diagnosis/fit/wander.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::diagnosis {

std::vector<std::vector<Eigen::Index>> sequences_of(const Observations& o, bool along_run,
                                                    const std::vector<bool>& used) {
  std::vector<std::vector<Eigen::Index>> out = along_run ? o.runs() : o.groups();
  for (auto& s : out) {
    std::erase_if(s, [&](Eigen::Index i) { return !used[static_cast<std::size_t>(i)]; });
    std::stable_sort(s.begin(), s.end(),
                     [&](Eigen::Index a, Eigen::Index b) { return o.state(a).time_s < o.state(b).time_s; });
  }
  return out;
}

double take_wander(const Wander& wander, const std::vector<std::vector<Eigen::Index>>& sequences,
                   Eigen::Ref<MatrixXd> rows) {
  const double kept = std::exp(-1.0 / wander.length), all = wander.size * wander.size;
  double log_determinant = 0.0;
  Eigen::RowVectorXd mean(rows.cols());
  for (const auto& s : sequences) {
    mean.setZero();
    double variance = all;
    for (std::size_t k = 0; k < s.size(); ++k) {
      if (k > 0) {
        mean *= kept;
        variance = kept * kept * variance + (1.0 - kept * kept) * all;
      }
      const double of_innovation = variance + 1.0, gain = variance / of_innovation;
      const Eigen::RowVectorXd innovation = rows.row(s[k]) - mean;
      rows.row(s[k]) = innovation / std::sqrt(of_innovation);
      mean += gain * innovation;
      variance -= gain * variance;
      log_determinant += std::log(of_innovation);
    }
  }
  return log_determinant;
}

}  // namespace trunnion::diagnosis
