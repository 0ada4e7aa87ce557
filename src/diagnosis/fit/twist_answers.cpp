#include "diagnosis/fit/twist_answers.hpp"

#include <algorithm>
#include <cmath>

namespace trunnion::diagnosis {
namespace {

constexpr double kNoAnswer = 1e-9;      // RMS answer (mm or rad) to a unit twist below which it is rounding
constexpr double kSameAnswer = 0.9999;  // cosine from which two twists are one to these readings

}  // namespace

std::vector<TwistAnswer> twist_answers(const Observations& observations) {
  std::vector<TwistAnswer> out;
  for (std::size_t link = 0; link < observations.link_count(); ++link)
    for (Eigen::Index k = 0; k < 6; ++k) {
      const VectorXd w = observations.response(link).col(k);
      if (!(w.norm() > kNoAnswer * std::sqrt(static_cast<double>(w.size())))) continue;
      const auto same = std::find_if(out.begin(), out.end(), [&](const TwistAnswer& a) {
        return std::abs(a.values.dot(w)) > kSameAnswer * a.values.norm() * w.norm();
      });
      if (same == out.end())
        out.push_back({w, {{link, k}}});
      else
        same->places.push_back({link, k});
    }
  return out;
}

}  // namespace trunnion::diagnosis
