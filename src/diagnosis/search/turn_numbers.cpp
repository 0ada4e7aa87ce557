#include "diagnosis/search/turn_numbers.hpp"

#include <algorithm>
#include <cmath>
#include <oneapi/tbb/parallel_for.h>

#include "trunnion/base/units.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kAsWell = 13.8;  // of chi-square, an evidence ratio of 1000 : 1: as of rivals

bool has_number(const EffectInfo& info) {
  return info.shape_count() == 1 && info.parameters.back().integer;
}

// Numbers closer than this are hardly told apart by any positions within the travel that was measured.
double neighbourhood(const Observations& o, AxisId axis) {
  double low = INFINITY, high = -INFINITY;
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    low = std::min(low, o.state(i).q[axis]);
    high = std::max(high, o.state(i).q[axis]);
  }
  return high > low ? std::max(1.0, kTwoPi / (high - low)) : INFINITY;
}

}  // namespace

std::vector<double> numbers_alike(const Atoms& atoms, const EffectSet& set, std::size_t member,
                                  double variance) {
  const Atom& own = set.members[member];
  const Effect& effect = atoms.effect(own);
  if (!has_number(effect.info())) return {};
  std::vector<const Atom*> rest;
  for (std::size_t k = 0; k < set.members.size(); ++k)
    if (k != member) rest.push_back(&set.members[k]);
  const Remainder given = atoms.remainder(rest);
  const Parameter& n = effect.info().parameters.back();
  const double least = atoms.score(own, given).drop - kAsWell * variance;
  std::vector<std::pair<double, double>> all;  // what it does not explain, number
  for (double number = n.min; number <= n.max; number += 1.0) all.emplace_back(0.0, number);
  oneapi::tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t k) {
    all[k].first = -atoms.score(atoms.make_atom(own.family, own.variant, {all[k].second}), given).drop;
  });
  std::erase_if(all, [&](const auto& other) { return -other.first < least; });
  std::sort(all.begin(), all.end());
  const double near = neighbourhood(atoms.observations(), effect.link().axis);
  std::vector<double> out;
  for (const auto& [left, number] : all) {
    const auto close = [near, number = number](double other) { return std::abs(other - number) < near; };
    if (!close(own.shape[0]) && std::none_of(out.begin(), out.end(), close)) out.push_back(number);
  }
  std::sort(out.begin(), out.end());
  return out;
}

EffectSet with_number(const Atoms& atoms, EffectSet set, std::size_t member, double number) {
  Atom& atom = set.members[member];
  atom = atoms.make_atom(atom.family, atom.variant, {number});
  return set;
}

}  // namespace trunnion::diagnosis
