#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/iso230_2.hpp"

namespace trunnion::iso230 {
namespace {

double range(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

// Means, estimators and symbols of one direction. `replicates` false: no s, R, A.
Unidirectional one_direction(const std::vector<std::vector<double>>& x, bool replicates) {
  Unidirectional out;
  for (const auto& at_target : x) {
    const double n = static_cast<double>(at_target.size());
    const double mean = std::accumulate(at_target.begin(), at_target.end(), 0.0) / n;
    out.mean.push_back(mean);
    if (!replicates) continue;
    double squares = 0.0;
    for (const double value : at_target) squares += (value - mean) * (value - mean);
    out.s.push_back(std::sqrt(squares / (n - 1.0)));
    out.repeatability.push_back(4.0 * out.s.back());
  }
  out.E = range(out.mean);
  if (!replicates) return out;
  out.R = *std::max_element(out.repeatability.begin(), out.repeatability.end());
  double high = out.mean[0] + 2.0 * out.s[0], low = out.mean[0] - 2.0 * out.s[0];
  for (std::size_t i = 1; i < out.mean.size(); ++i) {
    high = std::max(high, out.mean[i] + 2.0 * out.s[i]);
    low = std::min(low, out.mean[i] - 2.0 * out.s[i]);
  }
  out.A = high - low;
  return out;
}

// Number of runs of a direction; fails when it differs between targets.
Result<std::size_t> runs_of(const LineTest& test, const std::vector<std::vector<double>>& x,
                            const char* direction) {
  if (x.empty()) return std::size_t{0};
  const std::size_t runs = x.front().size();
  for (std::size_t i = 0; i < x.size(); ++i)
    if (x[i].size() != runs || runs == 0)
      return fail(ErrorCode::wrong_input, "line " + test.name + ", " + direction + ": " +
                                              std::to_string(x[i].size()) + " readings at target " +
                                              std::to_string(i + 1) + ", " + std::to_string(runs) +
                                              " at the first");
  return runs;
}

void both_directions(Positioning& out, bool replicates) {
  const Unidirectional &up = *out.up, &down = *out.down;
  out.B = 0.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < out.target.size(); ++i) {
    out.mean.push_back(0.5 * (up.mean[i] + down.mean[i]));
    out.reversal.push_back(up.mean[i] - down.mean[i]);
    out.B = std::max(*out.B, std::abs(out.reversal[i]));
    sum += out.reversal[i];
    if (replicates)
      out.repeatability.push_back(std::max({2.0 * up.s[i] + 2.0 * down.s[i] + std::abs(out.reversal[i]),
                                            up.repeatability[i], down.repeatability[i]}));
  }
  out.B_mean = sum / static_cast<double>(out.target.size());
  out.M = range(out.mean);
  std::vector<double> all = up.mean;
  all.insert(all.end(), down.mean.begin(), down.mean.end());
  out.E = range(all);
  if (!replicates) return;
  out.R = *std::max_element(out.repeatability.begin(), out.repeatability.end());
  std::vector<double> limits;
  for (const Unidirectional* side : {&up, &down})
    for (std::size_t i = 0; i < side->mean.size(); ++i) {
      limits.push_back(side->mean[i] + 2.0 * side->s[i]);
      limits.push_back(side->mean[i] - 2.0 * side->s[i]);
    }
  out.A = range(limits);
}

// Fewest targets that the standard asks of a travel (5.3.2, 5.3.3).
std::size_t least_targets(bool rotary, double travel) {
  if (!rotary) return std::max<std::size_t>(5, static_cast<std::size_t>(std::floor(travel * 5.0 / 1000.0)));
  const double quarter = kPi / 2.0;
  return travel <= quarter ? 3 : travel <= 2.0 * quarter ? 5 : 8;
}

void add_notes(Positioning& out, bool long_axis, bool replicates) {
  const double travel = out.target.back() - out.target.front();
  const std::size_t least = least_targets(out.rotary, travel);
  if (out.target.size() < least)
    out.notes.push_back(std::to_string(out.target.size()) + " targets; the standard asks for at least " +
                        std::to_string(least) + " on this travel");
  const std::size_t runs = std::max(out.runs_up, out.runs_down);
  if (long_axis)
    out.notes.push_back(std::string("travel above ") + (out.rotary ? "360 degrees" : "2000 mm") +
                        ": the standard gives no s, R and A");
  else if (!replicates)
    out.notes.push_back("one run per direction: no s, R and A without replicates");
  else if (runs != 5)
    out.notes.push_back(std::to_string(runs) + " runs per direction; the standard asks for 5");
  if (out.runs_up == 0 || out.runs_down == 0)
    out.notes.emplace_back("one direction only: no B, M and no bi-directional values");
  std::vector<double> steps;
  for (std::size_t i = 1; i < out.target.size(); ++i) steps.push_back(out.target[i] - out.target[i - 1]);
  // The standard wants the intervals to vary, so that a periodic error is not sampled at one phase.
  if (steps.size() > 1 && range(steps) < 1e-6 * travel)
    out.notes.push_back("equal intervals between targets: a periodic error of that pitch does not show");
}

}  // namespace

Result<Positioning> evaluate_positioning(const LineTest& test) {
  Positioning out;
  out.name = test.name;
  out.rotary = test.rotary;
  out.target = test.target;
  if (test.target.size() < 2)
    return fail(ErrorCode::wrong_input, "line " + test.name + " has fewer than two targets");
  const auto up = runs_of(test, test.up, "upwards");
  if (!up) return tl::unexpected(up.error());
  const auto down = runs_of(test, test.down, "downwards");
  if (!down) return tl::unexpected(down.error());
  out.runs_up = *up;
  out.runs_down = *down;
  if (*up == 0 && *down == 0) return fail(ErrorCode::wrong_input, "line " + test.name + " has no readings");
  const double travel = test.target.back() - test.target.front();
  const bool long_axis =
      travel > (test.rotary ? kLongRotaryTravel_turns * kTwoPi : kLongLinearTravel_mm) * (1.0 + 1e-9);
  const auto replicates = [&](std::size_t runs) { return runs > 1 && !long_axis; };
  if (*up > 0) out.up = one_direction(test.up, replicates(*up));
  if (*down > 0) out.down = one_direction(test.down, replicates(*down));
  const bool both_replicate = replicates(*up) && replicates(*down);
  if (out.up && out.down) both_directions(out, both_replicate);
  add_notes(out, long_axis, replicates(std::max(*up, *down)));
  return out;
}

namespace {

// Slope of the least-squares line through the mean deviations (both directions).
double slope(const Positioning& line) {
  const std::vector<double>& y = !line.mean.empty() ? line.mean : line.up ? line.up->mean : line.down->mean;
  const double n = static_cast<double>(y.size());
  const double mx = std::accumulate(line.target.begin(), line.target.end(), 0.0) / n;
  const double my = std::accumulate(y.begin(), y.end(), 0.0) / n;
  double sxy = 0.0, sxx = 0.0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    sxy += (line.target[i] - mx) * (y[i] - my);
    sxx += (line.target[i] - mx) * (line.target[i] - mx);
  }
  return sxy / sxx;
}

void add_squareness(const std::vector<LineTest>& tests, Diagonals& out) {
  for (std::size_t a = 0; a < tests.size(); ++a)
    for (std::size_t b = 0; b < tests.size(); ++b) {
      const Vec3 &n = tests[a].direction_M, &m = tests[b].direction_M;
      // A pair of face diagonals: the same components but for the sign of the second one; `a` rises in both.
      std::vector<int> used;
      for (int k = 0; k < 3; ++k)
        if (std::abs(n[k]) > 1e-4) used.push_back(k);
      if (used.size() != 2 || n[used[0]] * n[used[1]] < 0.0) continue;
      if (std::abs(n[used[0]] - m[used[0]]) > 1e-4 || std::abs(n[used[1]] + m[used[1]]) > 1e-4) continue;
      const double opening = (slope(out.lines[b]) - slope(out.lines[a])) / (2.0 * n[used[0]] * n[used[1]]);
      const auto letter = [&](int k) { return Reading::kAxes[static_cast<std::size_t>(k)]; };
      out.squareness.push_back({std::string{letter(used[0]), letter(used[1])}, opening});
    }
}

}  // namespace

Result<Diagonals> evaluate_diagonals(const std::vector<LineTest>& tests) {
  Diagonals out;
  for (const LineTest& test : tests) {
    auto line = evaluate_positioning(test);
    if (!line) return tl::unexpected(line.error());
    out.peak_to_valley.push_back(line->E ? *line->E : line->up ? line->up->E : line->down->E);
    out.lines.push_back(std::move(*line));
  }
  const auto largest = [&](std::optional<double> Positioning::*symbol) {
    std::optional<double> most;
    for (const Positioning& line : out.lines) {
      if (!(line.*symbol)) return std::optional<double>();
      most = std::max(most.value_or(0.0), *(line.*symbol));
    }
    return most;
  };
  out.E = largest(&Positioning::E);
  out.R = largest(&Positioning::R);
  out.B = largest(&Positioning::B);
  out.A = largest(&Positioning::A);
  out.M = largest(&Positioning::M);
  add_squareness(tests, out);
  return out;
}

}  // namespace trunnion::iso230
