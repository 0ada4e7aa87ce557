#include <algorithm>
#include <cmath>

#include "trunnion/base/contract.hpp"

#include "diagnosis/fit_core.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kMostPeriods =
    400;                       // of one axis; beyond, the search steps are wider than the line of a period
constexpr int kLagPoints = 9;  // 300 s to 15 000 s by factors of 1.63: 2 % of the signal are lost between two
constexpr std::size_t kMostMoments = 40;  // of a step within one run

double range_of(const Observations& o, AxisId axis) {
  double low = INFINITY, high = -INFINITY;
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    low = std::min(low, o.state(i).q[axis]);
    high = std::max(high, o.state(i).q[axis]);
  }
  return std::max(0.0, high - low);
}

// Periods whose lines overlap: steps of half a cycle over the measured travel.
std::vector<double> periods(const Parameter& p, double travel) {
  std::vector<double> out = p.candidates;
  if (!(travel > 0.0)) return out.empty() ? std::vector<double>{p.usual} : out;
  const double low = 1.0 / p.max, high = 1.0 / p.min;
  const double step = std::max(0.5 / travel, (high - low) / static_cast<double>(kMostPeriods));
  for (double f = low; f <= high; f += step) out.push_back(1.0 / f);
  return out;
}

std::vector<double> moments(const Observations& o, const Effect& effect) {
  // The twist at a row tells whether that row's run is the effect's: the grid is the middle between its
  // successive times.
  std::vector<double> times;
  const auto& info = effect.info();
  for (std::size_t r = 0; r < o.runs().size(); ++r) {
    const auto is_run = [&](const auto& entry) {
      return entry.first == "run" && entry.second == o.data().context.runs[r].id;
    };
    if (!std::any_of(info.variant.begin(), info.variant.end(), is_run)) continue;
    for (const Eigen::Index i : o.runs()[r]) times.push_back(o.state(i).time_s);
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  std::vector<double> out;
  const std::size_t stride = std::max<std::size_t>(1, times.size() / kMostMoments);
  for (std::size_t k = 1; k < times.size(); k += stride) out.push_back(0.5 * (times[k - 1] + times[k]));
  return out;
}

std::vector<double> values(const Observations& o, const Effect& effect, const Parameter& p) {
  if (p.integer) {
    std::vector<double> out;
    for (double n = p.min; n <= p.max; n += 1.0) out.push_back(n);
    return out;
  }
  if (effect.info().id == "step") return moments(o, effect);
  if (effect.info().id.starts_with("periodic:")) return periods(p, range_of(o, effect.link().axis));
  if (!(p.max > p.min)) return {p.usual};
  std::vector<double> out = p.candidates;
  const bool logarithmic = p.min > 0.0 && p.max > 4.0 * p.min;
  for (int k = 0; k < kLagPoints; ++k) {
    const double t = static_cast<double>(k) / (kLagPoints - 1);
    out.push_back(logarithmic ? p.min * std::pow(p.max / p.min, t) : p.min + t * (p.max - p.min));
  }
  return out;
}

}  // namespace

std::vector<std::vector<double>> shape_grid(const Observations& o, const Effect& effect) {
  const auto& info = effect.info();
  std::vector<std::vector<double>> out = {{}};
  for (std::size_t k = info.linear_count(); k < info.parameters.size(); ++k) {
    std::vector<std::vector<double>> next;
    for (const auto& head : out)
      for (const double value : values(o, effect, info.parameters[k])) {
        next.push_back(head);
        next.back().push_back(value);
      }
    out = std::move(next);
  }
  return out;
}

}  // namespace trunnion::diagnosis
