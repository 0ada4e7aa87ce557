#include <algorithm>
#include <cmath>
#include <set>

#include "trunnion/base/units.hpp"

#include "diagnosis/fit_core.hpp"
#include "diagnosis/linalg.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kMostPeriods =
    900;  // of one axis; beyond, the search steps are wider than the line of a period
constexpr std::size_t kFewestPeriods = 150;
constexpr std::size_t kPeriodWork =
    1'500'000;                 // readings times periods: keeps 10 000 readings within seconds
constexpr int kLagPoints = 9;  // 300 s to 15 000 s by factors of 1.63: 2 % of the signal are lost between two
constexpr std::size_t kMostMoments = 40;  // of a step within one run
constexpr std::size_t kAllMoments = 400;  // of all runs together; between two of them the search refines
constexpr std::size_t kFewestAside = 3;   // moments on each side of a step: what fewer show is an outlier

double range_of(const Observations& o, AxisId axis) {
  double low = INFINITY, high = -INFINITY;
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    low = std::min(low, o.state(i).q[axis]);
    high = std::max(high, o.state(i).q[axis]);
  }
  return std::max(0.0, high - low);
}

// Whether a wave of `cycles` (per unit of x, radians included) cannot be told from smooth errors at the
// sampled positions: sampled more coarsely than twice a period it may look like a slow one, and then the slow
// one is meant.
class Aliases {
 public:
  Aliases(const Observations& o, AxisId axis, bool rotary) {
    std::set<std::int64_t> seen;
    std::vector<double> x;
    for (Eigen::Index i = 0; i < o.size(); ++i)
      if (const double v = o.state(i).q[axis]; seen.insert(std::llround(v * 1e7)).second) x.push_back(v);
    std::sort(x.begin(), x.end());
    if (x.size() < 2 || x.size() > kMostPositions) return;  // so many positions are no coarse grid
    spacing_ = (x.back() - x.front()) / static_cast<double>(x.size() - 1);
    x_ = Eigen::Map<const VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
    constexpr Eigen::Index kSmooth = 9;
    MatrixXd smooth(x_.size(), kSmooth);
    const VectorXd t = (2.0 * (x_.array() - x.front()) / (x.back() - x.front()) - 1.0).matrix();
    for (Eigen::Index k = 0; k < kSmooth; ++k) {
      if (!rotary)
        smooth.col(k) = k < 6 ? VectorXd(t.array().pow(static_cast<double>(k))) : VectorXd::Zero(t.size());
      else {
        const Eigen::Index order = (k + 1) / 2;
        const double n = static_cast<double>(order);
        if (k % 2 == 0)
          smooth.col(k) = (n * x_.array()).cos();
        else
          smooth.col(k) = (n * x_.array()).sin();
      }
    }
    smooth_ = pivoted_qr(smooth, 1e-6).Q;
  }
  bool hidden(double wave_number) const {
    if (x_.size() == 0 || wave_number * spacing_ < kPi || smooth_.cols() >= x_.size()) return false;
    for (const VectorXd& wave :
         {VectorXd((wave_number * x_.array()).sin()), VectorXd((wave_number * x_.array()).cos())})
      if (wave.norm() > 1e-6 &&
          (wave - smooth_ * (smooth_.transpose() * wave)).norm() > kDifferent * wave.norm())
        return false;
    return true;
  }

 private:
  static constexpr std::size_t kMostPositions = 1000;
  static constexpr double kDifferent = 0.3;  // part of a wave that smooth functions must leave
  VectorXd x_;
  MatrixXd smooth_;
  double spacing_ = 0.0;
};

// Periods whose lines overlap: steps of half a cycle over the measured travel.
std::vector<double> periods(const Parameter& p, double travel, std::size_t most, const Aliases& aliases) {
  if (!(travel > 0.0)) return p.candidates.empty() ? std::vector<double>{p.usual} : p.candidates;
  std::vector<double> out;
  for (const double period : p.candidates)
    if (!aliases.hidden(kTwoPi / period)) out.push_back(period);
  const double low = 1.0 / p.max, high = 1.0 / p.min;
  const double step = std::max(0.5 / travel, (high - low) / static_cast<double>(most));
  for (double f = low; f <= high; f += step)
    if (!aliases.hidden(kTwoPi * f)) out.push_back(1.0 / f);
  return out;
}

// The times of the readings of the effect's run.
std::vector<double> times_of(const Observations& o, const Effect& effect) {
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
  return times;
}

std::vector<double> moments(const Observations& o, const Effect& effect) {
  const std::vector<double> times = times_of(o, effect);
  std::vector<double> out;
  const std::size_t most =
      std::clamp(kAllMoments / std::max<std::size_t>(1, o.runs().size()), kFewestAside, kMostMoments);
  const std::size_t stride = std::max<std::size_t>(1, times.size() / most);
  for (std::size_t k = kFewestAside; k + kFewestAside <= times.size(); k += stride)
    out.push_back(0.5 * (times[k - 1] + times[k]));
  return out;
}

std::vector<double> values(const Observations& o, const Effect& effect, const Parameter& p) {
  if (p.integer) {
    std::vector<double> out;
    const Aliases aliases(o, effect.link().axis, true);
    for (double n = p.min; n <= p.max; n += 1.0)
      if (!aliases.hidden(n)) out.push_back(n);
    return out;
  }
  if (effect.info().id == "step") return moments(o, effect);
  if (effect.info().id.starts_with("periodic:")) {
    const std::size_t most =
        std::clamp(kPeriodWork / static_cast<std::size_t>(o.size()), kFewestPeriods, kMostPeriods);
    return periods(p, range_of(o, effect.link().axis), most, Aliases(o, effect.link().axis, false));
  }
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

std::vector<double> step_moments(const Observations& o, const Effect& effect, double low, double high) {
  const std::vector<double> times = times_of(o, effect);
  std::vector<double> out;
  for (std::size_t k = kFewestAside; k + kFewestAside <= times.size(); ++k)
    if (const double t = 0.5 * (times[k - 1] + times[k]); t > low && t < high) out.push_back(t);
  return out;
}

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
