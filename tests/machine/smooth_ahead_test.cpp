// Speeds along a path that keep to the jerk of the axes: closed forms, and random paths whose axes are
// sampled in time along a path that this file makes on its own.
#include "machine/smooth_ahead.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "trunnion/base/units.hpp"
#include "trunnion/machine/motion_plan.hpp"

#include "support/cases.hpp"
#include "support/machines.hpp"

namespace trunnion {
namespace {

using test::xy;

using PerAxis = std::array<double, kMaxAxes>;

Machine with_jerk(double linear_mm_s2, double rotary_rad_s2, double ramp_s) {
  Machine machine = test::accelerating(linear_mm_s2, rotary_rad_s2);
  for (Axis& axis : machine.axes) axis.jerk = *axis.acceleration / ramp_s;
  return machine;
}

struct TestBlock {
  JointVector from, to;
  double seconds = 0.0;
  bool stops_before = false;
};

// The path as the README says that it is: between the blocks' directions t the curvature is a broken line.
struct PathPiece {
  PerAxis along{}, curve{}, twist{};  // at its begin; the last is even
  double length = 0.0;
  PerAxis fastest{};   // speed of each axis, in ways over accelerations
  double most2 = 0.0;  // square of the speed that is asked for
  PerAxis direction(double s) const {
    PerAxis out{};
    for (std::size_t k = 0; k < kMaxAxes; ++k) out[k] = along[k] + s * (curve[k] + 0.5 * s * twist[k]);
    return out;
  }
};

std::vector<PathPiece> path_of(const Machine& machine, const std::vector<TestBlock>& blocks,
                               std::optional<double> blend_mm) {
  const std::size_t count = blocks.size();
  std::vector<PerAxis> along(count), mean(count), middle(count), fastest(count);
  std::vector<double> length(count), before(count), behind(count);
  std::vector<bool> joins_before(count), joins_behind(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < machine.axes.size(); ++k) {
      along[i][k] = (blocks[i].to[k] - blocks[i].from[k]) / *machine.axes[k].acceleration;
      fastest[i][k] = std::abs(along[i][k]) / blocks[i].seconds;
      length[i] = std::hypot(length[i], along[i][k]);
    }
    for (double& a : along[i]) a /= length[i];
  }
  for (std::size_t i = 1; i < count; ++i) {
    if (blocks[i].stops_before) continue;
    double turn_mm = 0.0;
    for (std::size_t k = 0; k < 3; ++k)
      turn_mm = std::hypot(turn_mm, (along[i][k] - along[i - 1][k]) * *machine.axes[k].acceleration);
    const double even = blend_mm && turn_mm > 0.0 ? 4.0 * *blend_mm / turn_mm : 1e30;
    const double rising = 1.5 * even;
    before[i - 1] = std::min(length[i - 1] / 2, rising);
    behind[i] = std::min(length[i] / 2, rising);
    joins_before[i - 1] = length[i - 1] / 2 <= even;
    joins_behind[i] = length[i] / 2 <= even;
    for (std::size_t k = 0; k < kMaxAxes; ++k)
      mean[i][k] = (along[i][k] - along[i - 1][k]) / (before[i - 1] + behind[i]);
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (!joins_before[i] || !joins_behind[i]) continue;
    for (std::size_t k = 0; k < kMaxAxes; ++k) {
      const double a = mean[i][k], b = mean[i + 1][k];
      if (a * b <= 0.0) continue;
      middle[i][k] =
          std::min(std::abs(a + b) / 2, 2 * std::min(std::abs(a), std::abs(b))) * (a > 0.0 ? 1 : -1);
    }
  }
  std::vector<PathPiece> out;
  const auto corner = [&](std::size_t i, std::size_t k) {  // before block i
    const double zone = before[i - 1] + behind[i];
    return 2 * mean[i][k] - (before[i - 1] * middle[i - 1][k] + behind[i] * middle[i][k]) / zone;
  };
  for (std::size_t i = 0; i < count; ++i) {
    PathPiece piece;
    piece.most2 = std::pow(length[i] / blocks[i].seconds, 2);
    const auto most = [&](std::size_t a, std::size_t b) {
      for (std::size_t k = 0; k < kMaxAxes; ++k) piece.fastest[k] = std::max(fastest[a][k], fastest[b][k]);
    };
    if (behind[i] > 0.0) {
      most(i - 1, i);
      piece.length = behind[i];
      for (std::size_t k = 0; k < kMaxAxes; ++k) {
        const double at = corner(i, k);
        piece.along[k] = along[i][k] - behind[i] * (at + middle[i][k]) / 2;
        piece.curve[k] = at;
        piece.twist[k] = (middle[i][k] - at) / behind[i];
      }
      out.push_back(piece);
    }
    const double straight = length[i] - behind[i] - before[i];
    if (straight > 1e-9 * length[i]) {
      most(i, i);
      piece = {along[i], {}, {}, straight, piece.fastest, piece.most2};
      out.push_back(piece);
    }
    if (before[i] > 0.0) {
      most(i, i + 1);
      piece.length = before[i];
      for (std::size_t k = 0; k < kMaxAxes; ++k) {
        piece.along[k] = along[i][k];
        piece.curve[k] = middle[i][k];
        piece.twist[k] = (corner(i + 1, k) - middle[i][k]) / before[i];
      }
      out.push_back(piece);
    }
  }
  return out;
}

// Where the machine is along a piece of the plan, and how fast: by the time since the begin of the piece.
struct Motion {
  double s = 0.0, speed = 0.0;
};
Motion motion(const SpeedPiece& piece, double t) {
  if (piece.kind != SpeedPiece::Kind::between) {
    const double whole = piece.seconds();
    const bool begins = piece.kind == SpeedPiece::Kind::from_rest;
    const double u = begins ? t / whole : 1.0 - t / whole;
    const double s = piece.length * u * u * u;
    return {begins ? s : piece.length - s, 3.0 * piece.length / whole * u * u};
  }
  // s'' = slope / 2 + bend / 2 s.
  const double v = std::sqrt(piece.begin2), a = 0.5 * piece.slope, w = 0.5 * piece.bend;
  const double r = std::sqrt(std::abs(w));
  if (r * t < 1e-4) {
    const double j = w * v;
    return {t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2)};
  }
  const double c = w > 0.0 ? std::cosh(r * t) : std::cos(r * t);
  const double sn = (w > 0.0 ? std::sinh(r * t) : std::sin(r * t)) / r;
  return {v * sn + a * (c - 1.0) / w, v * c + a * sn};
}

double piece_seconds(const SpeedPiece& piece) {
  double t = piece.seconds();
  for (int i = 0; i < 4; ++i) {
    const Motion m = motion(piece, t);
    t -= (m.s - piece.length) / std::max(m.speed, 1e-300);
    if (piece.kind != SpeedPiece::Kind::between) return piece.seconds();
  }
  return t;
}

// The most of what is asked of an axis over what it can, sampled.
struct Most {
  double speed = 0.0, acceleration = 0.0, jerk = 0.0, seconds = 0.0;
};

Most sampled(const Machine& machine, const std::vector<PathPiece>& path,
             const std::vector<SpeedPiece>& plan) {
  constexpr double kStep_s = 1e-4;
  Most out;
  std::size_t p = 0;
  double s_before = 0.0;  // begin of the plan's piece along the path's
  double now = 0.0, next_sample = 0.0;
  std::array<PerAxis, 3> last{};
  std::size_t samples = 0;
  for (const SpeedPiece& piece : plan) {
    const double whole = piece_seconds(piece);
    for (; next_sample <= now + whole; next_sample += kStep_s, ++samples) {
      const Motion m = motion(piece, next_sample - now);
      const PerAxis along = path[p].direction(s_before + m.s);
      for (std::size_t k = 0; k < machine.axes.size(); ++k) {
        const double v = along[k] * m.speed;
        if (path[p].fastest[k] > 0.0 || std::abs(v) > 1e-9)
          out.speed = std::max(out.speed, std::abs(v) / (path[p].fastest[k] + 1e-12));
        const double jerk = *machine.axes[k].jerk / *machine.axes[k].acceleration;
        if (samples > 0) out.acceleration = std::max(out.acceleration, std::abs(v - last[0][k]) / kStep_s);
        if (samples > 1)
          out.jerk = std::max(out.jerk, std::abs(v - 2 * last[0][k] + last[1][k]) / kStep_s / kStep_s / jerk);
        last[1][k] = last[0][k];
        last[0][k] = v;
      }
    }
    now += whole;
    s_before += piece.length;
    if (s_before > path[p].length * (1.0 - 1e-9)) {
      EXPECT_NEAR(s_before, path[p].length, 1e-9 * path[p].length);
      s_before = 0.0;
      ++p;
    }
  }
  EXPECT_EQ(p, path.size());
  out.seconds = now;
  return out;
}

std::vector<SpeedPiece> planned(const Machine& machine, const std::vector<TestBlock>& blocks,
                                std::optional<double> blend_mm, std::vector<BlockRun>& runs) {
  SmoothAhead plan(machine, blend_mm, {}, PlanOf::paces_and_seconds);
  for (const TestBlock& block : blocks) {
    if (block.stops_before) plan.stop();
    plan.add(block.from, block.to, block.seconds);
  }
  std::vector<SpeedPiece> out;
  plan.settle(plan.waiting(), runs, &out);
  return out;
}

// The least time that is found by another way: squares of the speed at places along the path, all at once, by
// Newton steps into ever steeper walls at the limits of every axis, with the signs of all terms. It begins at
// a plan, slowed down.
class Optimum {
 public:
  Optimum(const Machine& machine, const std::vector<PathPiece>& path, const std::vector<SpeedPiece>& plan,
          double step_s)
      : machine_(machine) {
    lay(path, plan, step_s);
    for (int i = 0; i < 40 && !(barrier(value_, 1.0) < 1e300); ++i)
      for (double& x : value_) x *= 0.9;
    if (!(barrier(value_, 1.0) < 1e300)) return;
    const double count = static_cast<double>(places_.size()) * 20.0;
    for (double mu = seconds_of(value_) / count; mu > 0.001 * seconds_of(value_) / count; mu *= 0.4)
      for (int i = 0; i < 12; ++i)
        if (!step(mu)) break;
    seconds = seconds_of(value_);
  }
  double seconds = 0.0;  // 0: it found none

 private:
  struct Place {
    double s = 0.0, most2 = 0.0;
    PerAxis along{}, curve{}, twist{}, other_twist{};  // on both sides
    std::array<double, 3> first{}, second{};           // weights of the derivatives
  };

  void lay(const std::vector<PathPiece>& path, const std::vector<SpeedPiece>& plan, double step_s) {
    std::size_t q = 0;
    double s = 0.0;
    const auto put = [&](const PathPiece& piece, double at, double x) {
      Place place;
      place.s = s + at;
      place.along = piece.direction(at);
      place.most2 = piece.most2;
      for (std::size_t k = 0; k < kMaxAxes; ++k) {
        place.curve[k] = piece.curve[k] + at * piece.twist[k];
        place.twist[k] = place.other_twist[k] = piece.twist[k];
        if (std::abs(place.along[k]) > 1e-12)
          place.most2 = std::min(place.most2, std::pow(piece.fastest[k] / place.along[k], 2));
      }
      if (!places_.empty() && at == 0.0) {
        places_.back().other_twist = place.twist;
        places_.back().most2 = std::min(places_.back().most2, place.most2);
        return;
      }
      places_.push_back(place);
      value_.push_back(x);
    };
    for (const PathPiece& piece : path) {
      put(piece, 0.0, 0.0);
      double begin = 0.0;
      while (begin < piece.length * (1.0 - 1e-9)) {
        const SpeedPiece& own = plan[q++];
        const double whole = piece_seconds(own);
        const int count = std::max(1, static_cast<int>(std::ceil(whole / step_s)));
        for (int i = 1; i <= count; ++i) {
          const Motion m = motion(own, whole * i / count);
          put(piece, std::min(piece.length, begin + (i == count ? own.length : m.s)),
              i == count ? own.end2 : m.speed * m.speed);
        }
        begin += own.length;
      }
      s += piece.length;
    }
    for (std::size_t i = 1; i + 1 < places_.size(); ++i) {
      const double a = places_[i].s - places_[i - 1].s, b = places_[i + 1].s - places_[i].s;
      places_[i].first = {-b / (a * (a + b)), (b - a) / (a * b), a / (b * (a + b))};
      places_[i].second = {2 / (a * (a + b)), -2 / (a * b), 2 / (b * (a + b))};
    }
    value_.front() = value_.back() = 0.0;
  }
  double seconds_of(const std::vector<double>& x) const {
    double out = 0.0;
    for (std::size_t i = 0; i + 1 < x.size(); ++i) {
      const double way = places_[i + 1].s - places_[i].s;
      out += x[i] == 0.0 || x[i + 1] == 0.0 ? 3.0 * way / std::sqrt(std::max(x[i], x[i + 1]))
                                            : 2.0 * way / (std::sqrt(x[i]) + std::sqrt(x[i + 1]));
    }
    return out;
  }
  // Calls `with` for each limit: its slack, and the slope of what it limits by the values around.
  template <typename With>
  void limits(const std::vector<double>& x, std::size_t i, const With& with) const {
    const Place& p = places_[i];
    const double speed = std::sqrt(x[i]);
    with(1.0 - x[i] / p.most2, std::array<double, 3>{0.0, 1.0 / p.most2, 0.0});
    // Beside a rest an even jerk j gets to (j^2 / 4) (6 way / j)^(4/3).
    if (i == 1 || i + 2 == x.size()) {
      double jerk = 1e300;
      for (std::size_t k = 0; k < machine_.axes.size(); ++k)
        jerk = std::min(jerk, *machine_.axes[k].jerk / *machine_.axes[k].acceleration /
                                  std::max(1e-300, std::abs(p.along[k])));
      const double way = i == 1 ? p.s : places_.back().s - p.s;
      const double most2 = 0.25 * jerk * jerk * std::pow(6.0 * way / jerk, 4.0 / 3.0);
      with(1.0 - x[i] / most2, std::array<double, 3>{0.0, 1.0 / most2, 0.0});
    }
    for (std::size_t k = 0; k < machine_.axes.size(); ++k) {
      std::array<double, 3> slope{};
      double acceleration = 0.0;
      for (std::size_t n = 0; n < 3; ++n) {
        slope[n] = 0.5 * p.along[k] * p.first[n] + (n == 1 ? p.curve[k] : 0.0);
        acceleration += slope[n] * x[i + n - 1];
      }
      for (const double sign : {1.0, -1.0})
        with(1.0 - sign * acceleration,
             std::array<double, 3>{sign * slope[0], sign * slope[1], sign * slope[2]});
      const double per_jerk = *machine_.axes[k].acceleration / *machine_.axes[k].jerk;
      for (const PerAxis* twist : {&p.twist, &p.other_twist}) {
        double rate = 0.0;
        for (std::size_t n = 0; n < 3; ++n) {
          slope[n] =
              0.5 * p.along[k] * p.second[n] + 1.5 * p.curve[k] * p.first[n] + (n == 1 ? (*twist)[k] : 0.0);
          rate += slope[n] * x[i + n - 1];
        }
        for (double& a : slope) a *= per_jerk * speed;
        slope[1] += 0.5 * per_jerk * rate / speed;
        for (const double sign : {1.0, -1.0})
          with(1.0 - sign * per_jerk * rate * speed,
               std::array<double, 3>{sign * slope[0], sign * slope[1], sign * slope[2]});
        if (p.twist == p.other_twist) break;
      }
    }
  }
  double barrier(const std::vector<double>& x, double mu) const {
    double out = 0.0;
    for (std::size_t i = 1; i + 1 < x.size(); ++i) {
      if (!(x[i] > 0.0)) return 1e301;
      limits(x, i, [&](double slack, const std::array<double, 3>&) {
        out += slack > 0.0 ? -mu * std::log(slack) : 1e301;
      });
    }
    return out + seconds_of(x);
  }
  bool step(double mu) {
    const std::size_t n = value_.size();
    // Five diagonals; row i has columns i to i + 2.
    std::vector<std::array<double, 3>> h(n);
    std::vector<double> g(n);
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const double d = places_[i + 1].s - places_[i].s;
      const double u = std::sqrt(value_[i]), w = std::sqrt(value_[i + 1]), sum = u + w;
      const double factor = u == 0.0 || w == 0.0 ? 1.5 : 1.0;
      if (u > 0.0) {
        g[i] -= factor * d / (sum * sum * u);
        h[i][0] += factor * d * (1 / (sum * sum * sum * u * u) + 0.5 / (sum * sum * u * u * u));
      }
      if (w > 0.0) {
        g[i + 1] -= factor * d / (sum * sum * w);
        h[i + 1][0] += factor * d * (1 / (sum * sum * sum * w * w) + 0.5 / (sum * sum * w * w * w));
      }
      if (u > 0.0 && w > 0.0) h[i][1] += d / (sum * sum * sum * u * w);
    }
    for (std::size_t i = 1; i + 1 < n; ++i)
      limits(value_, i, [&](double slack, const std::array<double, 3>& slope) {
        for (std::size_t a = 0; a < 3; ++a) {
          g[i + a - 1] += mu * slope[a] / slack;
          for (std::size_t b = a; b < 3; ++b)
            h[i + a - 1][b - a] += mu * slope[a] * slope[b] / (slack * slack);
        }
      });
    // The ends stay; L D L' of the rest.
    std::vector<double> by(n);
    for (const std::size_t e : {std::size_t{0}, n - 1}) {
      h[e] = {1.0, 0.0, 0.0};
      g[e] = 0.0;
      if (e > 0) h[e - 1][1] = 0.0;
      if (e > 1) h[e - 2][2] = 0.0;
    }
    std::vector<std::array<double, 3>> l(n);
    for (std::size_t i = 0; i < n; ++i) {
      double diagonal = h[i][0], next = h[i][1];
      if (i >= 1)
        diagonal -= l[i - 1][1] * l[i - 1][1] * l[i - 1][0], next -= l[i - 1][1] * l[i - 1][2] * l[i - 1][0];
      if (i >= 2) diagonal -= l[i - 2][2] * l[i - 2][2] * l[i - 2][0];
      l[i] = {diagonal, next / diagonal, h[i][2] / diagonal};
    }
    for (std::size_t i = 0; i < n; ++i) {
      by[i] = -g[i];
      if (i >= 1) by[i] -= l[i - 1][1] * by[i - 1];
      if (i >= 2) by[i] -= l[i - 2][2] * by[i - 2];
    }
    for (std::size_t i = 0; i < n; ++i) by[i] /= l[i][0];
    for (std::size_t i = n; i-- > 0;) {
      if (i + 1 < n) by[i] -= l[i][1] * by[i + 1];
      if (i + 2 < n) by[i] -= l[i][2] * by[i + 2];
    }
    double slope = 0.0;
    for (std::size_t i = 0; i < n; ++i) slope += g[i] * by[i];
    const double now = barrier(value_, mu);
    for (double share = 1.0; share > 1e-6; share *= 0.5) {
      std::vector<double> next = value_;
      for (std::size_t i = 0; i < n; ++i) next[i] += share * by[i];
      if (barrier(next, mu) <= now + 1e-4 * share * slope) {
        value_ = next;
        return -slope > 1e-9 * now;
      }
    }
    return false;
  }

  const Machine& machine_;
  std::vector<Place> places_;
  std::vector<double> value_;
};

// --- random paths ---

void go(std::vector<TestBlock>& out, const JointVector& by, double mm_s, bool stops) {
  TestBlock block;
  if (!out.empty()) block.from = out.back().to;
  block.to = block.from;
  double way = 0.0;
  for (AxisId id = 0; id < kMaxAxes; ++id) block.to[id] += by[id];
  for (AxisId id = 0; id < 3; ++id) way = std::hypot(way, by[id]);
  block.seconds = way / mm_s;
  block.stops_before = stops || out.empty();
  out.push_back(block);
}

std::vector<TestBlock> dense_path(std::mt19937_64& random, std::size_t count) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::vector<TestBlock> out;
  const double size = 0.2 * std::pow(10.0, 0.5 + 0.5 * u(random));
  const double spread = u(random) > 0.0 ? 0.0 : 0.3;
  PerAxis rate{}, phase{}, much{};
  for (std::size_t k = 0; k < kMaxAxes; ++k) {
    rate[k] = std::min(std::pow(10.0, 0.5 * u(random) - 0.9), 0.15 / size);  // per mm
    phase[k] = 3.0 * u(random);
    much[k] = u(random);
  }
  double s = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double step = size * std::pow(10.0, spread * u(random));
    JointVector by;
    for (std::size_t k = 0; k < 5; ++k)
      by[k] = (k < 3 ? 1.0 : 0.02) * step *
              (much[k] * std::cos(phase[k] + rate[k] * (s + step / 2)) + (k == 0 ? 0.3 : 0.0));
    s += step;
    go(out, by, 50.0, false);
  }
  return out;
}

std::vector<TestBlock> coarse_path(std::mt19937_64& random, std::size_t count, bool stops) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::vector<TestBlock> out;
  JointVector along;
  const double bend = std::pow(10.0, 1.5 * u(random) - 1.0);
  const double spread = u(random) > 0.0 ? 0.1 : 1.0;
  const double size = std::pow(10.0, u(random));
  bool was_apart = false;
  for (std::size_t i = 0; i < count; ++i) {
    const bool corner = i == 0 || u(random) > 0.9;
    const double step = size * std::pow(10.0, spread * u(random));
    JointVector by;
    for (AxisId id = 0; id < 5; ++id) {
      along[id] = corner ? u(random) : along[id] + bend * u(random);
      by[id] = (id < 3 ? 1.0 : 0.01) * step * along[id];
    }
    const bool apart = stops && u(random) > 0.6;
    go(out, by, apart ? 500.0 : 80.0, apart || was_apart || (stops && u(random) > 0.9));
    was_apart = apart;
  }
  return out;
}

const char* const kKinds[] = {"dense", "coarse", "rapids and stops"};

std::vector<TestBlock> path_of_kind(std::mt19937_64& random, int kind) {
  return kind == 0 ? dense_path(random, 300) : coarse_path(random, 40, kind == 2);
}

Machine random_machine(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  Machine machine = with_jerk(1000.0, 10.0, 0.05);
  for (Axis& axis : machine.axes) {
    *axis.acceleration *= std::pow(10.0, 0.5 * u(random));
    axis.jerk = *axis.acceleration / (0.04 * std::pow(10.0, 0.4 * u(random)));
  }
  return machine;
}

double seconds_of(const std::vector<BlockRun>& runs) {
  double out = 0.0;
  for (const BlockRun& run : runs) out += run.seconds;
  return out;
}

// The blocks up to the second stop.
std::vector<TestBlock> first_stretch(const std::vector<TestBlock>& blocks, std::size_t most) {
  std::vector<TestBlock> out;
  for (const TestBlock& block : blocks) {
    if (block.stops_before && out.size() >= 3) break;
    if (block.stops_before) out.clear();
    out.push_back(block);
    if (out.size() == most) break;
  }
  return out;
}

TEST(LongSmoothAhead, RandomPathsKeepEveryLimitAndAreNotMuchSlowerThanTheLeast) {
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const int cases = test::cases(60, "TRUNNION_CASES");
  Most most;
  std::array<std::vector<double>, 3> over;
  for (int i = 0; i < cases; ++i) {
    const int kind = i % 3;
    const Machine machine = random_machine(random);
    const auto blocks = path_of_kind(random, kind);
    const std::optional<double> blend =
        i % 2 == 0 ? std::optional(std::pow(10.0, u(random) - 2.0)) : std::nullopt;
    std::vector<BlockRun> runs;
    const auto plan = planned(machine, blocks, blend, runs);
    const Most here = sampled(machine, path_of(machine, blocks, blend), plan);
    EXPECT_LT(here.speed, 1.001) << kKinds[kind] << " " << i;
    EXPECT_LT(here.acceleration, 1.001) << kKinds[kind] << " " << i;
    EXPECT_LT(here.jerk, 1.001) << kKinds[kind] << " " << i;
    EXPECT_NEAR(seconds_of(runs), here.seconds, 1e-9 * here.seconds) << kKinds[kind] << " " << i;
    most.speed = std::max(most.speed, here.speed);
    most.acceleration = std::max(most.acceleration, here.acceleration);
    most.jerk = std::max(most.jerk, here.jerk);
    const auto part = first_stretch(blocks, kind == 0 ? 100 : 20);
    runs.clear();
    const auto part_plan = planned(machine, part, blend, runs);
    const double part_s = seconds_of(runs);
    const Optimum least(machine, path_of(machine, part, blend), part_plan, std::max(0.002, part_s / 1000));
    if (least.seconds > 0.0) over[static_cast<std::size_t>(kind)].push_back(part_s / least.seconds);
  }
  EXPECT_GT(most.speed, 0.99);  // and they are used
  EXPECT_GT(most.acceleration, 0.99);
  EXPECT_GT(most.jerk, 0.99);
  std::printf("largest of %d paths: speed %.6f, acceleration %.6f, jerk %.6f\n", cases, most.speed,
              most.acceleration, most.jerk);
  for (std::size_t kind = 0; kind < 3; ++kind) {
    double mean = 0.0, worst = 0.0;
    for (const double x : over[kind]) {
      mean += x / static_cast<double>(over[kind].size());
      worst = std::max(worst, x);
    }
    std::printf("%s: %.3f of the least time, at most %.3f (%zu paths)\n", kKinds[kind], mean, worst,
                over[kind].size());
    EXPECT_GT(over[kind].size(), static_cast<std::size_t>(cases) / 4);
    EXPECT_GT(mean, 1.0);
    EXPECT_LT(mean, 1.25);
    EXPECT_LT(worst, 1.6);
  }
}

// `count` are settled as soon as so many wait; every limit is kept.
std::vector<BlockRun> settled_in_parts(const Machine& machine, const std::vector<TestBlock>& blocks,
                                       std::size_t waiting, std::size_t count) {
  SmoothAhead plan(machine, std::nullopt, {}, PlanOf::paces_and_seconds);
  std::vector<BlockRun> runs;
  std::vector<SpeedPiece> pieces;
  for (const TestBlock& block : blocks) {
    if (block.stops_before) plan.stop();
    plan.add(block.from, block.to, block.seconds);
    if (plan.waiting() == waiting) plan.settle(count, runs, &pieces);
  }
  plan.settle(plan.waiting(), runs, &pieces);
  EXPECT_EQ(runs.size(), blocks.size());
  const Most here = sampled(machine, path_of(machine, blocks, std::nullopt), pieces);
  EXPECT_LT(here.speed, 1.001);
  EXPECT_LT(here.acceleration, 1.001);
  EXPECT_LT(here.jerk, 1.001);
  EXPECT_NEAR(seconds_of(runs), here.seconds, 1e-9 * here.seconds);
  return runs;
}

// Blocks are settled one by one with a few behind them.
TEST(LongSmoothAhead, SettledEarlyEveryLimitIsKept) {
  std::mt19937_64 random(32);
  const int cases = test::cases(18);
  for (int i = 0; i < cases; ++i) {
    const Machine machine = random_machine(random);
    const auto blocks = i % 3 == 0 ? dense_path(random, 300) : coarse_path(random, 300, i % 3 == 2);
    const std::size_t behind = 60 + static_cast<std::size_t>(i);
    SCOPED_TRACE(i);
    settled_in_parts(machine, blocks, behind + 1, 1);
  }
}

// A smooth path that the axes can follow for most of its way as fast as it is asked for, with places where
// they cannot: corners, stops, short blocks, other feeds.
std::vector<TestBlock> mostly_steady_path(std::mt19937_64& random, std::size_t count) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::vector<TestBlock> out;
  const double size = 0.2 * std::pow(10.0, 0.7 * u(random));
  const double uneven = u(random) > 0.0 ? 0.0 : 0.3;
  const double rounded = u(random) > 0.0 ? 0.0 : 1e-3 * size;
  const double places = std::pow(10.0, -1.0 + u(random));  // for each hundred blocks
  PerAxis rate{}, phase{}, much{};
  for (std::size_t k = 0; k < kMaxAxes; ++k) {
    rate[k] = 0.02 * std::pow(10.0, 0.6 * u(random));
    phase[k] = 3.0 * u(random);
    much[k] = u(random);
  }
  double s = 0.0;
  double feed = 10.0 * std::pow(10.0, 0.7 * u(random));
  for (std::size_t i = 0; i < count; ++i) {
    double step = size * std::pow(10.0, uneven * u(random));
    bool stops = false;
    if (0.5 + 0.5 * u(random) < 0.01 * places) {
      const int kind = static_cast<int>(2.0 + 2.0 * u(random));
      if (kind == 0) phase[2] += u(random);
      if (kind == 1) feed = std::min(60.0, feed * std::pow(10.0, 0.5 * u(random)));
      if (kind == 2) step *= 0.05;
      if (kind == 3) stops = true;
    }
    JointVector by;
    for (std::size_t k = 0; k < 5; ++k)
      by[k] = (k < 3 ? 1.0 : 0.02) *
              (step * (much[k] * std::cos(phase[k] + rate[k] * (s + step / 2)) + (k == 0 ? 0.3 : 0.0)) +
               rounded * u(random));
    s += step;
    go(out, by, feed * (1.0 + 0.1 * std::cos(0.1 * s)), stops);
  }
  return out;
}

// What needs no plan and what does keep to the limits together, wherever the one goes over into the other.
TEST(LongSmoothAhead, SteadyWaysKeepEveryLimitAndAreAsFastAsAsked) {
  std::mt19937_64 random(test::seed(36));
  std::size_t as_asked = 0, all = 0;
  for (int i = 0; i < test::cases(30, "TRUNNION_CASES"); ++i) {
    const Machine machine = random_machine(random);
    const auto blocks = mostly_steady_path(random, 3000);
    SCOPED_TRACE(i);
    const auto runs = settled_in_parts(machine, blocks, 2048, 1024);
    for (const BlockRun& run : runs) as_asked += run.pace == 1.0 ? 1 : 0;
    all += runs.size();
  }
  EXPECT_GT(as_asked, all / 2);
  std::printf("%zu of %zu blocks as fast as asked\n", as_asked, all);
}

// Every second block is slower: the others are not as slow for that.
TEST(SmoothAhead, FasterBlocksAreNotAsSlowAsThoseBesideThem) {
  const Machine machine = with_jerk(1000.0, 10.0, 0.05);
  std::vector<TestBlock> blocks;
  double words_s = 0.0;
  for (int i = 0; i < 2000; ++i) {
    go(blocks, xy(2.0, 0.0), i % 2 == 0 ? 10.0 : 9.0, false);
    words_s += blocks.back().seconds;
  }
  // 1 mm/s takes 2 sqrt(1 / jerk) at even jerk, 14 of 200 ms: half of the difference there, at both ends.
  EXPECT_LT(seconds_of(settled_in_parts(machine, blocks, 2048, 1024)), 1.006 * words_s);
}

// Those with enough behind them are nearly what they are where all are known.
TEST(SmoothAhead, PiecesAreAsTheWhole) {
  std::mt19937_64 random(33);
  for (int i = 0; i < test::cases(12); ++i) {
    const Machine machine = random_machine(random);
    const auto blocks = dense_path(random, 1200);
    std::vector<BlockRun> whole, parts;
    planned(machine, blocks, std::nullopt, whole);
    SmoothAhead plan(machine, std::nullopt, {}, PlanOf::paces_and_seconds);
    for (const TestBlock& block : blocks) {
      plan.add(block.from, block.to, block.seconds);
      if (plan.waiting() == 400) plan.settle(200, parts, nullptr);
    }
    plan.settle(plan.waiting(), parts, nullptr);
    EXPECT_NEAR(seconds_of(parts), seconds_of(whole), 1e-2 * seconds_of(whole)) << i;
  }
}

// Who is asked for the speeds that are reached reaches them.
TEST(SmoothAhead, WhatIsReachedIsReachedAgain) {
  std::mt19937_64 random(34);
  double once_s = 0.0, again_s = 0.0;
  for (int i = 0; i < test::cases(60); ++i) {
    const Machine machine = random_machine(random);
    auto blocks = path_of_kind(random, i % 3);
    std::vector<BlockRun> runs, again;
    planned(machine, blocks, std::nullopt, runs);
    for (std::size_t k = 0; k < blocks.size(); ++k) blocks[k].seconds /= runs[k].pace;
    planned(machine, blocks, std::nullopt, again);
    once_s += seconds_of(runs);
    again_s += seconds_of(again);
  }
  EXPECT_LT(again_s, 1.03 * once_s);
}

// On a line, from one speed and acceleration to another: at both ends as asked, and nowhere beyond the
// acceleration or the jerk. The blocks are of many lengths.
TEST(SmoothSpeeds, GoFromOneSpeedToAnother) {
  std::mt19937_64 random(test::seed(37));
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const int cases = test::cases(3000, "TRUNNION_CASES");
  int found = 0;
  for (int i = 0; i < cases; ++i) {
    const double ramp_s = 0.05;
    SmoothPath path({ramp_s, ramp_s, ramp_s, ramp_s, ramp_s});
    SmoothLeg leg;
    leg.along[0] = leg.acceleration = 1.0;
    leg.begins = BlockBegin::unknown;
    leg.fastest2 = 0.04;
    const std::size_t blocks = 20 + static_cast<std::size_t>(10.0 * u(random));
    for (std::size_t k = 0; k < blocks; ++k) {
      leg.length = 0.01 * std::pow(10.0, u(random));
      path.add(nullptr, leg, &leg);
    }
    const auto end = [&] {
      // So slow and falling that it would turn round, too.
      return SpeedEnd{SpeedEnd::Kind::going, 0.038 * std::pow(10.0, 1.5 * u(random) - 1.5), 1.8 * u(random)};
    };
    const SpeedEnd from = end(), to = end();
    SmoothSpeeds speeds(0.0);
    std::vector<SpeedPiece> out;
    if (!speeds.plan(path, {from, to}, {}, out)) continue;
    ++found;
    EXPECT_NEAR(out.front().begin2, from.at2, 1e-12);
    EXPECT_NEAR(out.front().slope, from.slope, 1e-9);
    EXPECT_NEAR(out.back().end2, to.at2, 1e-12);
    EXPECT_NEAR(out.back().end_slope(), to.slope, 1e-9);
    for (const SpeedPiece& piece : out) {
      const double jerk = 0.5 * std::abs(piece.bend) * std::sqrt(piece.most2());
      ASSERT_LT(std::max(std::abs(piece.slope), std::abs(piece.end_slope())), 2.0 * (1.0 + 1e-9)) << i;
      ASSERT_LT(jerk, (1.0 + 1e-9) / ramp_s) << i;
      ASSERT_LT(piece.most2(), leg.fastest2 * (1.0 + 1e-9)) << i;
      ASSERT_GT(std::min(piece.begin2, piece.end2), 0.0) << i;
      ASSERT_GT(piece.seconds(), 0.0) << i;
    }
  }
  EXPECT_GT(found, cases / 5);
}

// Seven phases, or four: jerk, acceleration and speed at their largest.
TEST(SmoothAhead, FromRestToRestItIsAnSCurve) {
  const double a = 1000.0, ramp = 0.05, j = a / ramp, v = 200.0;
  const Machine machine = with_jerk(a, 10.0, ramp);
  for (const double way : {0.01, 0.1, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0}) {
    double exact = 4.0 * std::cbrt(way / (2.0 * j));
    if (way > 2.0 * a * ramp * ramp) exact = ramp + std::sqrt(ramp * ramp + 4.0 * way / a);
    if (way > v * (v / a + ramp)) exact = way / v + v / a + ramp;
    for (const int count : {1, 2, 7, 50}) {
      std::vector<TestBlock> blocks;
      for (int i = 0; i < count; ++i) go(blocks, xy(way / count, 0.0), v, false);
      std::vector<BlockRun> runs;
      planned(machine, blocks, {}, runs);
      EXPECT_GT(seconds_of(runs), (1.0 - 1e-9) * exact) << way << " " << count;
      EXPECT_LT(seconds_of(runs), (count == 1 ? 1.03 : 1.06) * exact) << way << " " << count;
    }
  }
}

// A large one as fast as it is asked for; on a small one an axis has v^3 / r^2.
TEST(SmoothAhead, ACircleIsAsFastAsItsJerkAllows) {
  const double a = 3000.0, ramp = 0.06, j = a / ramp;
  const Machine machine = with_jerk(a, 26.0, ramp);
  const auto circle = [&](double radius, int count, double v) {
    std::vector<TestBlock> blocks;
    const double step = kTwoPi / 200.0;
    for (int i = 0; i < count; ++i)
      go(blocks,
         xy(radius * (std::cos(step * (i + 1)) - std::cos(step * i)),
            radius * (std::sin(step * (i + 1)) - std::sin(step * i))),
         v, false);
    std::vector<BlockRun> runs;
    planned(machine, blocks, {}, runs);
    return runs;
  };
  const double way = 400.0 * 2.0 * 20.0 * std::sin(kTwoPi / 400.0);
  EXPECT_NEAR(seconds_of(circle(20.0, 400, 50.0)), way / 50.0 + 2.0 * std::sqrt(50.0 / j), 0.01);
  const auto small = circle(1.0, 800, 100.0);
  const double fastest = std::cbrt(j);
  double mean = 0.0;
  for (std::size_t i = 200; i < 600; ++i) mean += small[i].pace / 400.0;
  // The curvature of an axis that changes its sign is steeper there than the circle's (README, "Jerk").
  EXPECT_GT(100.0 * mean, 0.7 * fastest);
  // Where the path goes along neither axis it may be faster.
  EXPECT_LT(100.0 * mean, 1.1 * fastest);
}

TEST(SmoothAhead, StopsAreStopsAndWhatIsNotKnownSlowsNothingDown) {
  const double a = 1000.0, ramp = 0.05, v = 50.0;
  const Machine machine = with_jerk(a, 10.0, ramp);
  const JointVector p = xy(0.0, 0.0), q = xy(100.0, 0.0);
  MotionPlan plan(machine, {}, {}, PlanOf::paces_and_seconds);
  plan.add({p, q, 2.0});
  plan.stop();
  plan.add({q, p, 2.0});
  plan.add({p, q, 0.2, true});  // apart
  plan.add({q, p, 2.0});
  plan.lose();
  plan.add({p, q, 2.0});
  plan.lose();
  plan.add({q, p, 2.0});
  std::vector<BlockRun> runs;
  plan.settle(plan.waiting(), runs);
  const double stop_s = 0.5 * (v / a + ramp);
  for (const std::size_t i : {0U, 1U}) EXPECT_NEAR(runs[i].seconds, 2.0 + 2.0 * stop_s, 0.01) << i;
  EXPECT_NEAR(runs[3].seconds, 2.0 + stop_s, 0.01);
  EXPECT_NEAR(runs[4].seconds, 2.0, 1e-9);
  EXPECT_NEAR(runs[5].seconds, 2.0 + stop_s, 0.01);
}

// Where an axis has no jerk, or the control does not look ahead, the plan is the one without, to the bit.
TEST(MotionPlan, JerkIsKeptWhereEveryAxisHasItAndTheControlLooksAhead) {
  std::mt19937_64 random(35);
  const auto blocks = coarse_path(random, 60, true);
  const Machine all = with_jerk(1000.0, 10.0, 0.05);
  Machine some = all, none = all;
  some.axes.back().jerk.reset();
  for (Axis& axis : none.axes) axis.jerk.reset();
  const auto runs_of = [&](const Machine& machine, const BlockEnds& ends) {
    MotionPlan plan(machine, ends, {}, PlanOf::paces_and_seconds);
    std::vector<BlockRun> out;
    for (const TestBlock& block : blocks) {
      if (block.stops_before) plan.stop();
      plan.add({block.from, block.to, block.seconds});
    }
    plan.stop();
    plan.settle(plan.waiting(), out);
    return out;
  };
  const auto same = [](const std::vector<BlockRun>& a, const std::vector<BlockRun>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const BlockRun& x, const BlockRun& y) {
      return x.pace == y.pace && x.seconds == y.seconds;
    });
  };
  EXPECT_FALSE(same(runs_of(all, {}), runs_of(none, {})));
  EXPECT_TRUE(same(runs_of(some, {}), runs_of(none, {})));
  EXPECT_TRUE(same(runs_of(all, {true, {}, true}), runs_of(none, {true, {}, true})));
  EXPECT_TRUE(same(runs_of(all, {false, {}, false}), runs_of(none, {false, {}, false})));
}

}  // namespace
}  // namespace trunnion
