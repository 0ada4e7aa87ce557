#pragma once
// A control with a machine behind it that its machine file does not have: written apart from the program,
// with a chain, a reader of words and a ball of its own.
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace trunnion::test {

using Triple = std::array<double, 3>;

inline Triple plus(const Triple& a, const Triple& b, double s = 1.0) {
  return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}
inline double times(const Triple& a, const Triple& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
// `v` turned about the unit vector `n`, right hand.
inline Triple turned(const Triple& v, const Triple& n, double degrees) {
  const double angle = degrees * 3.141592653589793 / 180.0;
  const double c = std::cos(angle), s = std::sin(angle);
  const Triple x{n[1] * v[2] - n[2] * v[1], n[2] * v[0] - n[0] * v[2], n[0] * v[1] - n[1] * v[0]};
  const double along = times(n, v) * (1.0 - c);
  return {c * v[0] + s * x[0] + along * n[0], c * v[1] + s * x[1] + along * n[1],
          c * v[2] + s * x[2] + along * n[2]};
}

/// X, Y and Z carry the tool, A and on it C the ball.
struct HiddenMachine {
  Triple a_direction{1, 0, 0}, a_point{0, 0, 0};
  Triple c_direction{0, 0, 1}, c_point{0, 0, 0};
  Triple ball{0, 0, 0};    // its centre with A and C at 0
  double reach_mm = 15.7;  // ball and stylus, less pre-travel
  // By how much more apart the centres are where they touch, `lobes` times round the spindle.
  double lobe_mm = 0.0, lobe_phase = 0.0;
  int lobes = 3;
  // A rod from the ball's centre to `stem_end`, with A and C at 0, that nothing may touch; 0: none.
  Triple stem_end{0, 0, 0};
  double stem_mm = 0.0, ball_mm = 12.7, stylus_mm = 3.0;  // radii
  double c_backlash_deg = 0.0;                            // C stays behind by half of it
  double noise_mm = 0.0;                                  // of a touch, standard deviation
  double period_s = 0.0;  // up to this long the control goes on behind a touch
  /// What the linear axes really do: position errors, added to the tip.
  Triple (*error)(const Triple&, const void*) = nullptr;
  const void* error_data = nullptr;

  Triple at(const Triple& point, double a, double c) const {
    const Triple on_c = plus(c_point, turned(plus(point, c_point, -1.0), c_direction, c));
    return plus(a_point, turned(plus(on_c, a_point, -1.0), a_direction, a));
  }
  Triple ball_at(double a, double c) const { return at(ball, a, c); }
  // Between the stylus, a cylinder upwards from `tip`, and the rod: surfaces, mm.
  double from_stem(const Triple& tip, double a, double c) const {
    double least = 1e9;
    const Triple from = ball_at(a, c), way = plus(at(stem_end, a, c), from, -1.0);
    const double length = std::sqrt(times(way, way));
    for (double along = ball_mm; along <= length; along += 0.5) {
      const Triple d = plus(plus(from, way, along / length), tip, -1.0);
      least = std::min(least, std::hypot(std::hypot(d[0], d[1]), std::min(0.0, d[2])));
    }
    return least - stem_mm - stylus_mm;
  }
};

/// What happened while a control ran a program.
struct ProbeRun {
  std::string log;
  double nearest_mm = 1e9;  // between the centres, less the reach, where nothing was to be touched
  double stem_mm = 1e9;     // between stylus and stem
  std::size_t touches = 0;
};

/// Runs a program of G0, G1 and G38.2 in absolute millimetres as LinuxCNC does; throws where a touch does not
/// take place, or where the stylus meets the ball in any other motion.
inline ProbeRun run_probing(const std::string& program, const HiddenMachine& machine, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  ProbeRun out;
  std::map<char, double> at{{'X', 0}, {'Y', 0}, {'Z', 1e4}, {'A', 0}, {'C', 0}};
  std::string motion = "G0";
  double feed = 0.0;
  double c_behind = 0.0;
  bool touched = false;
  std::istringstream lines(program);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '(' || line[0] == 'T' || line.rfind("G53", 0) == 0) {
      if (line.rfind("G53", 0) == 0) at['Z'] = 1e4;
      continue;
    }
    std::map<char, double> to = at;
    bool moves = false;
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      if (word == "G0" || word == "G1" || word == "G38.2") motion = word;
      if (word[0] == 'F') feed = std::stod(word.substr(1));
      if (at.count(word[0]) == 0) continue;
      to[word[0]] = std::stod(word.substr(1));
      moves = true;
    }
    if (!moves) continue;
    if (at['A'] != to['A'] || at['C'] != to['C']) {
      if (at['Z'] < 1e3) throw std::runtime_error("a rotary axis turns beside the ball: " + line);
      if (at['C'] != to['C']) c_behind = (at['C'] < to['C'] ? 0.5 : -0.5) * machine.c_backlash_deg;
      at = to;
      continue;
    }
    Triple from{at['X'], at['Y'], at['Z']}, end{to['X'], to['Y'], to['Z']};
    const Triple ball = machine.ball_at(at['A'], at['C'] - c_behind);
    const Triple way = plus(end, from, -1.0);
    const double length = std::sqrt(times(way, way));
    if (length == 0.0) continue;
    const auto off = [&](const Triple& p) {
      return machine.error ? machine.error(p, machine.error_data) : Triple{};
    };
    const auto apart = [&](double t) {
      const Triple p = plus(from, way, t);
      const Triple d = plus(plus(p, off(p)), ball, -1.0);
      const double distance = std::sqrt(times(d, d));
      const double lobe = machine.lobe_mm *
                          std::cos(machine.lobes * std::atan2(d[1], d[0]) + machine.lobe_phase) *
                          std::hypot(d[0], d[1]) / distance;
      return distance - machine.reach_mm - lobe;
    };
    const auto watch_stem = [&](double end_t) {
      if (machine.stem_mm <= 0.0) return;
      for (double along = 0.0; along <= end_t * length; along += 0.5) {
        const double is = machine.from_stem(plus(from, way, along / length), at['A'], at['C']);
        if (is <= 0.0) throw std::runtime_error("the stylus touches the stem: " + line);
        out.stem_mm = std::min(out.stem_mm, is);
      }
    };
    // The nearest place of the line, and from there back to the touch.
    double nearest = std::min(1.0, std::max(0.0, -times(plus(from, ball, -1.0), way) / (length * length)));
    if (motion != "G38.2") {
      if (from[2] < 1e3) watch_stem(1.0);
      if (std::exchange(touched, false)) {
        // The way back: straight off the ball.
        if (nearest > 0.1 / length) throw std::runtime_error("not off the ball: " + line);
        nearest = 1.0;
        from = end;
      }
      out.nearest_mm = std::min(out.nearest_mm, std::min({apart(nearest), apart(0.0), apart(1.0)}));
      if (apart(nearest) <= 0.0) throw std::runtime_error("the stylus runs into the ball: " + line);
      at = to;
      continue;
    }
    if (apart(nearest) > 0.0) throw std::runtime_error("nothing is touched: " + line);
    double low = 0.0, high = nearest;
    for (int i = 0; i < 80; ++i) (apart(0.5 * (low + high)) > 0.0 ? low : high) = 0.5 * (low + high);
    watch_stem(low);
    const double late = machine.noise_mm * normal(random) + machine.period_s * uniform(random) * feed / 60.0;
    const double t = low + late / length;
    for (std::size_t i = 0; i < 3; ++i) to["XYZ"[i]] = from[i] + t * way[i];
    at = to;
    touched = true;
    std::array<char, 200> text{};
    std::snprintf(text.data(), text.size(), "%f %f %f %f %f %f %f %f %f\n", at['X'], at['Y'], at['Z'],
                  at['A'], 0.0, at['C'], 0.0, 0.0, 0.0);
    out.log += text.data();
    ++out.touches;
  }
  return out;
}

}  // namespace trunnion::test
