#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "trunnion/base/units.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/fit_core.hpp"

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
    for (VectorXd wave :
         {VectorXd((wave_number * x_.array()).sin()), VectorXd((wave_number * x_.array()).cos())}) {
      const double whole = wave.norm();
      take_out(smooth_, wave);
      if (whole > 1e-6 && wave.norm() > kDifferent * whole) return false;
    }
    return true;
  }

 private:
  static constexpr std::size_t kMostPositions = 1000;
  static constexpr double kDifferent = 0.3;  // part of a wave that smooth functions must leave
  VectorXd x_;
  MatrixXd smooth_;
  double spacing_ = 0.0;
};

// What one run sees of a wave along an axis: the number of cycles up to which its positions tell the wave
// from every smoother one. Positions that are multiples of a step show a wave number k as they show |k - m 2
// pi/step|.
class RunSampling {
 public:
  explicit RunSampling(std::vector<std::pair<double, double>> positions_and_weights) {
    std::sort(positions_and_weights.begin(), positions_and_weights.end());
    for (const auto& [x, weight] : positions_and_weights) {
      if (x_.empty() || x - x_.back() > kSamePlace * (1.0 + std::abs(x))) {
        x_.push_back(x);
        w_.push_back(0.0);
      }
      w_.back() += weight;
      weight_ += weight;
    }
  }
  double weight() const { return x_.size() > 2 ? weight_ : 0.0; }

  // In radians for each unit of x, at most `most`. Waves that close over a full turn are told from one
  // another.
  double resolved(double most, bool closed) const {
    const double range = x_.back() - x_.front();
    const double lobe = first_lobe(2.0 * most, range, closed);
    return std::min(most, 0.5 * lobe * (1.0 + kRounding));
  }

 private:
  // The smallest wave number that all positions show as a constant.
  double first_lobe(double most, double range, bool closed) const {
    std::vector<double> gaps;
    for (std::size_t k = 1; k < x_.size(); ++k) gaps.push_back(x_[k] - x_[k - 1]);
    const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
    std::nth_element(gaps.begin(), middle, gaps.end());
    // Every gap is a whole number of steps, the middle one too; a gap that is not quite exact moves the lobe.
    constexpr int kTries = 5;
    for (double m = 1.0; m * kTwoPi / *middle <= most && m <= kMostLobes; m += 1.0)
      for (int shift = -kTries; shift <= kTries; ++shift) {
        double wave = m * kTwoPi / *middle + shift / range;
        if (closed) wave = std::round(wave);
        if (wave > 0.0 && seen_as_constant(wave)) return wave;
      }
    return INFINITY;
  }
  bool seen_as_constant(double wave) const {
    double c = 0.0, s = 0.0;
    for (std::size_t k = 0; k < x_.size(); ++k) {
      c += w_[k] * std::cos(wave * (x_[k] - x_.front()));
      s += w_[k] * std::sin(wave * (x_[k] - x_.front()));
    }
    return std::hypot(c, s) > kConstant * weight_;
  }
  static constexpr double kSamePlace = 1e-6, kRounding = 1e-9, kConstant = 0.95, kMostLobes = 400.0;
  std::vector<double> x_, w_;
  double weight_ = 0.0;
};

// Whether the runs that tell a wave from a smoother one hold enough of what is seen of it.
class Resolution {
 public:
  Resolution(const Observations& o, const Effect& effect, double shape, double most) {
    const bool closed = o.machine().axes[effect.link().axis].kind == AxisKind::rotary;
    const VectorXd seen = o.linear_columns(effect, std::array{shape}).rowwise().norm();
    for (const auto& rows : o.runs()) {
      std::vector<std::pair<double, double>> positions;
      for (const Eigen::Index i : rows)
        if (const double size = seen[i] / o.reading(i).u_random; size > 0.0)
          positions.emplace_back(o.state(i).q[effect.link().axis], size * size);
      if (positions.size() < 3) continue;
      const RunSampling run(std::move(positions));
      if (!(run.weight() > 0.0)) continue;
      runs_.emplace_back(run.resolved(most, closed), run.weight());
      weight_ += run.weight();
    }
  }
  bool enough(double wave_number) const {
    double resolving = 0.0;
    for (const auto& [resolved, weight] : runs_)
      if (wave_number <= resolved) resolving += weight;
    return weight_ == 0.0 || resolving >= kEnough * weight_;
  }

 private:
  static constexpr double kEnough = 0.2;
  std::vector<std::pair<double, double>> runs_;
  double weight_ = 0.0;
};

// Periods whose lines overlap: steps of half a cycle over the measured travel.
// Known ones are tried where a smoother wave looks alike: they are known to be there.
std::vector<double> periods(const Parameter& p, double travel, std::size_t most, const Aliases& aliases,
                            const Resolution& resolution) {
  if (!(travel > 0.0)) return p.candidates.empty() ? std::vector<double>{p.usual} : p.candidates;
  std::vector<double> out;
  for (const double period : p.candidates)
    if (!aliases.hidden(kTwoPi / period)) out.push_back(period);
  const double low = 1.0 / p.max, high = 1.0 / p.min;
  const double step = std::max(0.5 / travel, (high - low) / static_cast<double>(most));
  for (double f = low; f <= high; f += step)
    if (resolution.enough(kTwoPi * f) && !aliases.hidden(kTwoPi * f)) out.push_back(1.0 / f);
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
    // Where the readings were: means of them lie between.
    const Aliases aliases(o.whole(), effect.link().axis, true);
    const Resolution resolution(o.whole(), effect, p.min, p.max);
    for (double n = p.min; n <= p.max; n += 1.0)
      if (resolution.enough(n) && !aliases.hidden(n)) out.push_back(n);
    return out;
  }
  if (effect.info().id == "step") return moments(o, effect);
  if (effect.info().id.starts_with("periodic:")) {
    const std::size_t most =
        std::clamp(kPeriodWork / static_cast<std::size_t>(o.whole().size()), kFewestPeriods, kMostPeriods);
    return periods(p, range_of(o, effect.link().axis), most, Aliases(o.whole(), effect.link().axis, false),
                   Resolution(o.whole(), effect, p.usual, kTwoPi / p.min));
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
