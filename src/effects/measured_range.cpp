#include "trunnion/effects/measured_range.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/effects/measured_tools.hpp"

namespace trunnion {
namespace {

constexpr double kTurnDeg = 360.0;
constexpr double kRounding = 1e-6;  // of positions, mm or deg: people read model files
constexpr double kSlack = 0.01;  // of the measured range: no error of a machine changes much over so little

// Of the longest tool that was measured: what tools do to errors grows with their length.
constexpr double kToolSlack = 0.05;

double rounded(double value) {
  return std::round(value * 1e6) / 1e6;
}

bool is_rotary(const MeasuredRange& range) {
  return range.key.ends_with("_deg");
}

// The least position at which a turn begins, where the positions (deg) are spread all round.
std::optional<double> all_round_from(std::vector<double> deg) {
  constexpr std::size_t kFewest = 3;  // two positions leave two gaps, whatever they are
  if (deg.empty()) return std::nullopt;
  const double first = *std::min_element(deg.begin(), deg.end());
  for (double& d : deg) d = rounded(std::fmod(d - first, kTurnDeg));
  std::sort(deg.begin(), deg.end());
  deg.erase(std::unique(deg.begin(), deg.end()), deg.end());
  if (deg.size() < kFewest) return std::nullopt;
  double widest = 0.0;
  for (std::size_t i = 1; i < deg.size(); ++i) widest = std::max(widest, deg[i] - deg[i - 1]);
  if (kTurnDeg - deg.back() > widest + kRounding) return std::nullopt;
  return first;
}

std::string name_of(const MeasuredRange& range) {
  return range.key == kToolLengthKey ? "tool length" : range.key.substr(0, range.key.rfind('_'));
}

std::string unit_of(const MeasuredRange& range) {
  return range.key.substr(range.key.rfind('_') + 1);
}

bool holds(const MeasuredRange& measured, const MeasuredRange& used) {
  const double way = measured.high - measured.low;
  const double slack =
      kRounding + (measured.key == kToolLengthKey ? kToolSlack * std::abs(measured.high) : kSlack * way);
  double turned = 0.0;
  if (is_rotary(measured)) {
    if (way >= kTurnDeg - kRounding) return true;
    turned = kTurnDeg * std::floor((used.low - measured.low + slack) / kTurnDeg);
  }
  return used.low - turned >= measured.low - slack && used.high - turned <= measured.high + slack;
}

std::string span_text(const MeasuredRange& range) {
  const auto text = [](double value) { return shortest_text(std::round(value * 100.0) / 100.0); };
  return range.low == range.high ? text(range.low) : text(range.low) + " to " + text(range.high);
}

}  // namespace

MeasuredRange range_of_axis(const Axis& axis, double low, double high) {
  const bool rotary = axis.kind == AxisKind::rotary;
  const double unit = rotary ? kDegreePerRad : 1.0;
  return {axis.name + (rotary ? "_deg" : "_mm"), rounded(low * unit), rounded(high * unit)};
}

MeasuredRange range_of_sensor(const Machine& machine, const std::string& sensor, double low_K,
                              double high_K) {
  return {"T_" + sensor + "_degC", rounded(machine.reference_degC + low_K),
          rounded(machine.reference_degC + high_K)};
}

MeasuredRanges ranges_of(const Machine& machine, const StateNames& names, std::size_t count,
                         const std::function<MachineState(std::size_t)>& state) {
  MeasuredRanges out;
  if (count == 0) return out;
  std::vector<std::vector<double>> at(machine.axes.size()), said(names.temperatures.size());
  for (std::size_t i = 0; i < count; ++i) {
    const MachineState s = state(i);
    for (AxisId a = 0; a < at.size(); ++a) at[a].push_back(s.q[a]);
    for (std::size_t k = 0; k < said.size(); ++k) said[k].push_back(s.temperature(k));
  }
  for (AxisId a = 0; a < at.size(); ++a) {
    const auto [low, high] = std::minmax_element(at[a].begin(), at[a].end());
    out.push_back(range_of_axis(machine.axes[a], *low, *high));
    if (!is_rotary(out.back())) continue;
    for (double& q : at[a]) q *= kDegreePerRad;
    if (const auto from = all_round_from(at[a])) {
      out.back().low = rounded(*from);
      out.back().high = std::max(out.back().high, rounded(*from + kTurnDeg));
    }
  }
  for (std::size_t k = 0; k < said.size(); ++k) {
    const auto [low, high] = std::minmax_element(said[k].begin(), said[k].end());
    out.push_back(range_of_sensor(machine, names.temperatures[k], *low, *high));
  }
  return out;
}

MeasuredRanges joined(MeasuredRanges a, const MeasuredRanges& b) {
  for (const MeasuredRange& other : b) {
    const auto same =
        std::find_if(a.begin(), a.end(), [&](const MeasuredRange& r) { return r.key == other.key; });
    if (same == a.end()) {
      a.push_back(other);
      continue;
    }
    same->low = std::min(same->low, other.low);
    same->high = std::max(same->high, other.high);
  }
  return a;
}

std::string beyond_measured(const MeasuredRanges& measured, const MeasuredRanges& used) {
  std::string out;
  for (const MeasuredRange& here : used) {
    const auto there = std::find_if(measured.begin(), measured.end(),
                                    [&](const MeasuredRange& r) { return r.key == here.key; });
    if (there == measured.end() || holds(*there, here)) continue;
    out += (out.empty() ? "" : ", ") + name_of(here) + " " + span_text(here) + " " + unit_of(here) +
           " (measured: " + span_text(*there) + ")";
  }
  return out;
}

}  // namespace trunnion
