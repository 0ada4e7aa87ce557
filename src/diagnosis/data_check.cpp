#include "diagnosis/data_check.hpp"

#include <cmath>
#include <map>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kContradiction = 8.0;        // standard deviations of a difference; noise does not reach it
constexpr std::size_t kFewestDuplicates = 3;  // fewer equal readings may be the instrument's resolution
constexpr double kDuplicateShare = 0.2;

std::vector<std::int64_t> row_key(const Observations& o, Eigen::Index i, bool with_run) {
  const MachineState& s = o.state(i);
  const Reading& r = o.reading(i);
  std::vector<std::int64_t> key = {std::llround(s.time_s * 1e3), std::llround(s.spindle_rpm),
                                   static_cast<std::int64_t>(r.quantity), static_cast<std::int64_t>(r.frame)};
  if (with_run) key.push_back(static_cast<std::int64_t>(s.run));
  for (int k = 0; k < 3; ++k) key.push_back(std::llround(r.n[k] * 1e6));
  for (int k = 0; k < 3; ++k) key.push_back(std::llround(o.data().rows[r.row].tool_mm[k] * 1e6));
  for (std::size_t a = 0; a < o.machine().axes.size(); ++a) {
    key.push_back(std::llround(s.q[a] * 1e6));
    key.push_back(s.direction[a]);
    key.push_back(std::llround(s.velocity[a] * 1e6));
  }
  return key;
}

std::string place(const Observations& o, Eigen::Index i) {
  const RowOrigin& row = o.data().rows[o.reading(i).row];
  return o.data().files[row.file] + ":" + std::to_string(row.line);
}

std::string same_moment(const Observations& o) {
  std::map<std::vector<std::int64_t>, Eigen::Index> first;
  std::size_t equal = 0;
  std::string example;
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    const auto [it, fresh] = first.emplace(row_key(o, i, true), i);
    if (fresh) continue;
    const Reading& a = o.reading(it->second);
    const Reading& b = o.reading(i);
    const double difference = std::abs(a.value - b.value);
    const double unit = b.quantity == Quantity::displacement ? kMmPerUm : kRadPerUrad;
    if (difference > kContradiction * std::hypot(a.u_random, b.u_random))
      return place(o, it->second) + " and " + place(o, i) +
             " contradict each other: the same moment and pose, " + fixed_text(a.value / unit, 3) +
             " against " + fixed_text(b.value / unit, 3) +
             (b.quantity == Quantity::displacement ? " um" : " urad") + " with u_random " +
             fixed_text(b.u_random / unit, 3);
    if (difference == 0.0 && ++equal == 1) example = place(o, it->second) + " and " + place(o, i);
  }
  if (equal >= kFewestDuplicates &&
      static_cast<double>(equal) > kDuplicateShare * static_cast<double>(o.size()))
    return std::to_string(equal) + " readings stand twice (" + example +
           "): counted twice, they would look more certain than they are";
  return {};
}

std::string same_runs(const Observations& o) {
  using Signature = std::vector<std::vector<std::int64_t>>;
  std::map<Signature, std::size_t> seen;
  for (std::size_t run = 0; run < o.runs().size(); ++run) {
    if (o.runs()[run].size() < kFewestDuplicates) continue;
    Signature signature;
    for (const Eigen::Index i : o.runs()[run]) {
      signature.push_back(row_key(o, i, false));
      signature.back().push_back(std::llround(o.reading(i).value * 1e12));
    }
    const auto [it, fresh] = seen.emplace(std::move(signature), run);
    if (!fresh)
      return "runs '" + o.data().context.runs[it->second].id + "' and '" + o.data().context.runs[run].id +
             "' hold the same readings: one measurement was given twice";
  }
  return {};
}

}  // namespace

std::string contradiction(const Observations& o) {
  const std::string twice = same_runs(o);
  return twice.empty() ? same_moment(o) : twice;
}

}  // namespace trunnion::diagnosis
