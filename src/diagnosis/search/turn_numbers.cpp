#include "diagnosis/search/turn_numbers.hpp"

#include <algorithm>
#include <cmath>
#include <oneapi/tbb/parallel_for.h>

#include "trunnion/base/units.hpp"

#include "diagnosis/fit/statistics.hpp"

namespace trunnion::diagnosis {
namespace {

// Waves a quarter of a cycle apart over the travel do nearly the same: of the best of them a twentieth is
// lost halfway between two, and from there a golden section finds it.
constexpr double kStepsPerLine = 4.0, kNearlyAsWell = 0.85;
constexpr std::size_t kMostWaves = 6000;  // of a scan; beyond, its steps are wider
constexpr std::size_t kScanWork =
    4'000'000;  // readings times waves: keeps 5000 readings within a second or two
constexpr int kSections = 24;

bool has_number(const EffectInfo& info) {
  return info.shape_count() == 1 && info.parameters.back().integer;
}
bool has_period(const EffectInfo& info) {
  return info.shape_count() == 1 && info.id.starts_with("periodic:");
}

double travel_of(const Observations& o, AxisId axis) {
  double low = INFINITY, high = -INFINITY;
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    low = std::min(low, o.state(i).q[axis]);
    high = std::max(high, o.state(i).q[axis]);
  }
  return std::max(0.0, high - low);
}

// Numbers closer than this are hardly told apart by any positions within the travel that was measured.
double neighbourhood(const Observations& o, AxisId axis) {
  const double travel = travel_of(o, axis);
  return travel > 0.0 ? std::max(1.0, kTwoPi / travel) : INFINITY;
}

// A member of a set at other shapes, beside the others.
class OtherShapes {
 public:
  OtherShapes(const Atoms& atoms, const EffectSet& set, std::size_t member)
      : atoms_(atoms), own_(set.members[member]) {
    std::vector<const Atom*> rest;
    for (std::size_t k = 0; k < set.members.size(); ++k)
      if (k != member) rest.push_back(&set.members[k]);
    given_ = atoms.remainder(rest);
  }
  double own_drop() const { return atoms_.score(own_, given_).drop; }
  double drop(double shape) const {
    return atoms_.score(atoms_.make_atom(own_.family, own_.variant, {shape}), given_).drop;
  }
  // Best first, those that explain at least so much.
  std::vector<std::pair<double, double>> scan(const std::vector<double>& shapes, double least) const {
    std::vector<std::pair<double, double>> out(shapes.size());  // what it does not explain, shape
    oneapi::tbb::parallel_for(std::size_t{0}, shapes.size(), [&](std::size_t k) {
      out[k] = {-drop(shapes[k]), shapes[k]};
    });
    std::erase_if(out, [&](const auto& other) { return -other.first < least; });
    std::sort(out.begin(), out.end());
    return out;
  }

 private:
  const Atoms& atoms_;
  const Atom& own_;
  Remainder given_;
};

// The best period within a step of waves of one.
std::pair<double, double> refined_period(const OtherShapes& others, double period, double step) {
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  double low = std::max(1.0 / period - step, 0.1 * step), high = 1.0 / period + step;
  double a = high - golden * (high - low), b = low + golden * (high - low);
  double at_a = others.drop(1.0 / a), at_b = others.drop(1.0 / b);
  for (int k = 0; k < kSections; ++k) {
    if (at_a > at_b) {
      high = b, b = a, at_b = at_a;
      a = high - golden * (high - low), at_a = others.drop(1.0 / a);
    } else {
      low = a, a = b, at_a = at_b;
      b = low + golden * (high - low), at_b = others.drop(1.0 / b);
    }
  }
  return at_a > at_b ? std::pair(at_a, 1.0 / a) : std::pair(at_b, 1.0 / b);
}

}  // namespace

std::vector<double> numbers_alike(const Atoms& atoms, const EffectSet& set, std::size_t member,
                                  double variance) {
  const Atom& own = set.members[member];
  const Effect& effect = atoms.effect(own);
  if (!has_number(effect.info())) return {};
  const OtherShapes others(atoms, set, member);
  const Parameter& n = effect.info().parameters.back();
  std::vector<double> all;
  for (double number = n.min; number <= n.max; number += 1.0) all.push_back(number);
  const double near = neighbourhood(atoms.observations(), effect.link().axis);
  std::vector<double> out;
  for (const auto& [left, number] : others.scan(all, others.own_drop() - kThousandToOne * variance)) {
    const auto close = [near, number = number](double other) { return std::abs(other - number) < near; };
    if (!close(own.shape[0]) && std::none_of(out.begin(), out.end(), close)) out.push_back(number);
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<double> periods_alike(const Atoms& atoms, const EffectSet& set, std::size_t member,
                                  double variance) {
  const Atom& own = set.members[member];
  const Effect& effect = atoms.effect(own);
  if (!has_period(effect.info())) return {};
  const double travel = travel_of(atoms.observations(), effect.link().axis);
  if (!(travel > 0.0)) return {};
  const Parameter& p = effect.info().parameters.back();
  const auto is_own = [&](double known) { return std::abs(known - own.shape[0]) < 1e-9 * known; };
  if (std::any_of(p.candidates.begin(), p.candidates.end(), is_own)) return {};
  const auto size = static_cast<std::size_t>(atoms.observations().size());
  // From half a wave over the travel on.
  const double slow = 0.5 / std::max(travel, p.max), fast = 1.0 / p.min;
  const double step =
      std::max(1.0 / (kStepsPerLine * travel),
               (fast - slow) / static_cast<double>(std::min(kMostWaves, kScanWork / size + 1)));
  std::vector<double> all;
  for (double wave = slow; wave <= fast; wave += step) all.push_back(1.0 / wave);
  const OtherShapes others(atoms, set, member);
  const double own_drop = others.own_drop(), least = own_drop - kThousandToOne * variance;
  const auto same = [&](double a, double b) { return std::abs(1.0 / a - 1.0 / b) < 1.0 / travel; };
  std::vector<double> out, looked = {own.shape[0]};
  for (const auto& [left, period] : others.scan(all, std::min(least, kNearlyAsWell * own_drop))) {
    if (std::any_of(looked.begin(), looked.end(),
                    [&, period = period](double other) { return same(other, period); }))
      continue;
    looked.push_back(period);
    if (const auto [drop, best] = refined_period(others, period, step);
        drop >= least && !same(best, own.shape[0]))
      out.push_back(best);
  }
  std::sort(out.rbegin(), out.rend());
  return out;
}

bool may_be_smooth(const Atoms& atoms, const EffectSet& set, std::size_t member, double variance) {
  const std::vector<double> others = periods_alike(atoms, set, member, variance);
  return !others.empty() && others.front() > atoms.effect(set.members[member]).info().parameters.back().max;
}

EffectSet with_number(const Atoms& atoms, EffectSet set, std::size_t member, double number) {
  Atom& atom = set.members[member];
  atom = atoms.make_atom(atom.family, atom.variant, {number});
  return set;
}

}  // namespace trunnion::diagnosis
