#include "diagnosis/verdict/constant_sensors.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "trunnion/base/texts.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kLong_s = 1800.0;  // castings and screws change by tenths of a degree in half an hour
constexpr double kSame_K = 1e-6;

double longest_run_s(const Observations& o) {
  double out = 0.0;
  for (const auto& rows : o.runs()) {
    double from = INFINITY, to = -INFINITY;
    for (const Eigen::Index i : rows) {
      from = std::min(from, o.state(i).time_s);
      to = std::max(to, o.state(i).time_s);
    }
    out = std::max(out, to - from);
  }
  return out;
}

}  // namespace

std::string constant_sensors_text(const Observations& o) {
  if (o.size() == 0 || longest_run_s(o) < kLong_s) return {};
  const auto& sensors = o.data().context.names.temperatures;
  std::vector<std::string> constant;
  for (std::size_t t = 0; t < sensors.size(); ++t) {
    const double first = o.state(0).temperature(t);
    bool same = true;
    for (Eigen::Index i = 1; same && i < o.size(); ++i)
      same = std::abs(o.state(i).temperature(t) - first) < kSame_K;
    if (same) constant.push_back("T_" + sensors[t] + "_degC");
  }
  if (constant.empty()) return {};
  return " " + joined(constant, ", ") + (constant.size() == 1 ? " says" : " say") +
         " the same in every row, though a run lasts " +
         std::to_string(std::llround(longest_run_s(o) / 60.0)) +
         " minutes: were these temperatures recorded? What follows them (screws and castings that grow) "
         "cannot "
         "be found in these files, and other effects may be named for it.";
}

}  // namespace trunnion::diagnosis
