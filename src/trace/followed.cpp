#include "trace/followed.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>

#include "trunnion/base/number_text.hpp"

namespace trunnion::trace {
namespace {

// No axis of a machine tool accelerates by more than 20 g: a row beyond that, beside two that agree, is no
// position.
constexpr double kImpossible_mm_s2 = 200e3;
constexpr double kImpossible_mm = 0.02;
constexpr double kMostLeftOut = 0.01;
// A program may be slowed down by its override, hardly to a hundredth; and none runs ten times as fast.
constexpr double kSlowest = 100.0;
constexpr double kFastest = 0.1;

Result<std::vector<Scaled>> positions_of(const Trace& trace, const Machine& machine, const Plan& plan) {
  std::vector<Scaled> out;
  out.reserve(trace.samples.size());
  if (trace.positions == Positions::words) {
    const double length_mm = plan.blocks.front().length_mm;
    for (const PlannedBlock& block : plan.blocks) {
      if (block.length_mm != length_mm || block.tcp)
        return fail(ErrorCode::wrong_input,
                    "positions of the program's words do not say where the axes are in a program of several "
                    "tools or under tool-centre-point control: record the joint positions",
                    trace.file);
    }
    for (const Sample& sample : trace.samples)
      out.push_back(scaled(machine, joints_of_words(machine, sample.q, {0.0, 0.0, -length_mm})));
    return out;
  }
  for (const Sample& sample : trace.samples) out.push_back(scaled(machine, sample.q));
  return out;
}

// Rows that stand alone beside their neighbours.
std::vector<bool> impossible_rows(const std::vector<Scaled>& x, const std::vector<Sample>& samples) {
  std::vector<bool> out(x.size(), false);
  for (std::size_t i = 2; i + 2 < x.size(); ++i) {
    const double t0 = samples[i - 1].time_s, t1 = samples[i].time_s, t2 = samples[i + 1].time_s;
    const double share = (t1 - t0) / (t2 - t0);
    const double off = (x[i] - x[i - 1] - share * (x[i + 1] - x[i - 1])).norm();
    const double around = std::max((x[i - 1] - x[i - 2]).norm(), (x[i + 2] - x[i + 1]).norm());
    const double dt = 0.5 * (t2 - t0);
    const double across = (x[i + 1] - x[i - 1]).norm();
    out[i] = off > kImpossible_mm && off > 10.0 * std::max(around, 0.5 * across) &&
             2.0 * off / (dt * dt) > kImpossible_mm_s2;
  }
  return out;
}

// Axes without limits, counted in turns as the program counts them: going on where a row jumps by a turn, the
// middle of all rows at the turn that is nearest to the middle of the program.
std::vector<Scaled> with_turns(std::vector<Scaled> x, const JointPath& path, const Machine& machine) {
  constexpr double kTurn = kTwoPi * kLever_mm;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    if (!machine.axes[id].cyclic) continue;
    const auto c = static_cast<Eigen::Index>(id);
    double add = 0.0, last = x.front()[c], low = last, high = last;
    for (Scaled& v : x) {
      const double value = v[c];
      if (std::abs(value - last) > 0.8 * kTurn) add -= std::round((value - last) / kTurn) * kTurn;
      last = value;
      v[c] += add;
      low = std::min(low, v[c]);
      high = std::max(high, v[c]);
    }
    double low_p = path.node(0)[c], high_p = low_p;
    for (std::size_t i = 0; i <= path.segments(); ++i) {
      low_p = std::min(low_p, path.node(i)[c]);
      high_p = std::max(high_p, path.node(i)[c]);
    }
    const double turns = std::round(0.5 * (low_p + high_p - low - high) / kTurn);
    for (Scaled& v : x) v[c] += turns * kTurn;
  }
  return x;
}

// Between two rows along the program, typically.
double period_of(const Followed& followed) {
  std::vector<double> steps;
  for (std::size_t i = followed.at.first + 1; i <= followed.at.last; ++i)
    steps.push_back(followed.time_s[i] - followed.time_s[i - 1]);
  if (steps.empty()) return 0.0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

Result<void> check_pace(const Followed& followed, const JointPath& path, const std::string& file) {
  const auto& at = followed.at;
  const double planned = path.leaves_s(at.forward[at.last]) - path.planned_s(at.forward[at.first]);
  const double actual = followed.time_s[at.last] - followed.time_s[at.first];
  if (planned <= 0.0) return {};
  const double ratio = actual / planned;
  if (ratio < kSlowest && ratio > kFastest) return {};
  return fail(ErrorCode::wrong_input,
              "the trace takes " + shortest_text(std::round(actual * 1e3) / 1e3) +
                  " s for what the program does in " + shortest_text(std::round(planned * 1e3) / 1e3) +
                  " s: is time_s in seconds?",
              file);
}

// Not across a gap, and not beyond the ends.
bool has_samples_beside(const Followed& followed, std::size_t i, std::size_t half) {
  if (i < half || i + half >= followed.x.size()) return false;
  const double span = followed.time_s[i + half] - followed.time_s[i - half];
  return span <= 2.5 * followed.period_s * static_cast<double>(2 * half);
}

}  // namespace

Result<Followed> follow_path(const Trace& trace, const Machine& machine, const Plan& plan,
                             const JointPath& path) {
  const auto x = positions_of(trace, machine, plan);
  if (!x) return tl::unexpected(x.error());
  const auto impossible = impossible_rows(*x, trace.samples);
  Followed out;
  Trace kept;
  kept.file = trace.file;
  for (std::size_t i = 0; i < x->size(); ++i) {
    if (impossible[i]) {
      ++out.left_out;
      continue;
    }
    out.x.push_back((*x)[i]);
    out.time_s.push_back(trace.samples[i].time_s);
    kept.samples.push_back(trace.samples[i]);
  }
  if (static_cast<double>(out.left_out) > 1.0 + kMostLeftOut * static_cast<double>(x->size()))
    return fail(ErrorCode::wrong_input,
                std::to_string(out.left_out) + " of " + std::to_string(x->size()) +
                    " rows are no positions of a machine that moves (more than 20 g beside their neighbours)",
                trace.file);
  auto at = align(path, plan.blocks, out.x, kept);
  if (!at) {
    // As a display counts the axes that turn on and on.
    if (const auto turned = with_turns(out.x, path, machine); turned != out.x) {
      if (auto again = align(path, plan.blocks, turned, kept); again) {
        out.x = turned;
        at = std::move(again);
      }
    }
  }
  if (!at) {
    Error error = at.error();
    if (const std::string why = explain_mismatch(path, out.x, machine); !why.empty())
      error.message += "; " + why;
    return tl::unexpected(error);
  }
  out.at = std::move(*at);
  out.period_s = period_of(out);
  if (auto pace = check_pace(out, path, trace.file); !pace) return tl::unexpected(pace.error());
  return out;
}

bool motion_at(const Followed& followed, std::size_t i, std::size_t half, Scaled& velocity,
               Scaled& acceleration) {
  if (!has_samples_beside(followed, i, half)) return false;
  const double span = followed.time_s[i + half] - followed.time_s[i - half];
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, static_cast<int>(kMaxAxes)> right;
  right.setZero();
  for (std::size_t k = i - half; k <= i + half; ++k) {
    const double t = (followed.time_s[k] - followed.time_s[i]) / span;
    const Eigen::Vector3d row(1.0, t, t * t);
    normal += row * row.transpose();
    right += row * (followed.x[k] - followed.x[i]).transpose();
  }
  const Eigen::Matrix<double, 3, static_cast<int>(kMaxAxes)> fit = normal.ldlt().solve(right);
  velocity = fit.row(1).transpose() / span;
  acceleration = 2.0 * fit.row(2).transpose() / (span * span);
  return true;
}

std::optional<Mean> mean_at(const Followed& followed, std::size_t i, std::size_t half) {
  if (!has_samples_beside(followed, i, half)) return std::nullopt;
  const auto& t = followed.time_s;
  const auto& x = followed.x;
  const double span = t[i + half] - t[i - half];
  Mean out{Scaled::Zero(), (x[i + half] - x[i - half]) / span, Scaled::Zero(),
           0.5 * (t[i - half] + t[i + half])};
  for (std::size_t k = i - half; k < i + half; ++k)
    out.x += 0.5 * (t[k + 1] - t[k]) / span * (x[k] + x[k + 1]);
  if (has_samples_beside(followed, i, half + 1)) {
    const auto speed = [&](std::size_t k) -> Scaled { return (x[k + 1] - x[k - 1]) / (t[k + 1] - t[k - 1]); };
    const double step = span / (2.0 * static_cast<double>(half));
    out.smooth = -step * step / (12.0 * span) * (speed(i + half) - speed(i - half));
  }
  return out;
}

Scaled scatter_of(const Followed& followed, std::size_t apart, double share) {
  const double of_normal = boost::math::quantile(boost::math::normal(), 0.5 * (1.0 + share));
  const double norm = std::sqrt(70.0);
  const auto& x = followed.x;
  Scaled out = Scaled::Zero();
  std::vector<double> sizes;
  for (int c = 0; c < out.size(); ++c) {
    sizes.clear();
    for (std::size_t i = followed.at.first + 2 * apart; i + 2 * apart <= followed.at.last; ++i)
      sizes.push_back(std::abs(x[i - 2 * apart][c] - 4.0 * x[i - apart][c] + 6.0 * x[i][c] -
                               4.0 * x[i + apart][c] + x[i + 2 * apart][c]));
    if (sizes.empty()) break;
    const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(sizes.size()));
    std::nth_element(sizes.begin(), at, sizes.end());
    out[c] = *at / of_normal / norm;
  }
  return out;
}

double scatter_of_mean(const Followed& followed, std::size_t half, double tau_s) {
  const double steps = 2.0 * static_cast<double>(half);
  const double inner = (steps - 1.0) / (steps * steps), ends = 0.5 / steps;
  return std::hypot(std::sqrt(inner + 2.0 * ends * ends), tau_s * scatter_of_velocity(followed, half));
}

double scatter_of_velocity(const Followed& followed, std::size_t half) {
  return std::sqrt(2.0) / (2.0 * static_cast<double>(half) * followed.period_s);
}

}  // namespace trunnion::trace
