#include "diagnosis/fit/condensed.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "trunnion/base/median.hpp"

#include "diagnosis/fit/observations.hpp"

namespace trunnion::diagnosis {
namespace {

using Indices = std::vector<Eigen::Index>;

constexpr double kFarInBin = 8.0;  // scatter within bins: what the pose changes within one is smaller
constexpr double kMostFar = 0.05;  // more are no single readings
constexpr std::size_t kFewestForMiddle = 3;

/// Pose, time, speeds and direction of sensitivity of every reading, each over its range.
MatrixXd coordinates(const Observations& o) {
  const std::size_t axes = o.machine().axes.size();
  MatrixXd out(o.size(), static_cast<Eigen::Index>(2 * axes + 5));
  for (Eigen::Index i = 0; i < o.size(); ++i) {
    const MachineState& s = o.state(i);
    Eigen::Index k = 0;
    for (std::size_t a = 0; a < axes; ++a) {
      out(i, k++) = s.q[a];
      out(i, k++) = s.velocity[a];
    }
    out(i, k++) = s.time_s;
    out(i, k++) = s.spindle_rpm;
    for (int c = 0; c < 3; ++c) out(i, k++) = o.reading(i).n[c];
  }
  for (auto column : out.colwise())
    if (const double range = column.maxCoeff() - column.minCoeff(); range > 0.0) column /= range;
  return out;
}

/// Readings that may be taken together at all.
std::vector<Indices> buckets(const Observations& o) {
  std::map<std::vector<std::int64_t>, Indices> by_key;
  for (const Indices& group : o.groups())
    for (const Eigen::Index i : group) {
      const MachineState& s = o.state(i);
      const Reading& r = o.reading(i);
      // A direction that turns with the machine gives every reading a group of its own.
      const bool alone = group.size() == 1;
      std::vector<std::int64_t> key = {
          static_cast<std::int64_t>(s.run), alone ? -1 : static_cast<std::int64_t>(r.group),
          static_cast<std::int64_t>(r.quantity), static_cast<std::int64_t>(r.frame), r.u_common ? 1 : 0};
      const std::size_t axes = o.machine().axes.size();
      key.insert(key.end(), s.direction.begin(), s.direction.begin() + static_cast<std::ptrdiff_t>(axes));
      by_key[std::move(key)].push_back(i);
    }
  std::vector<Indices> out;
  out.reserve(by_key.size());
  for (auto& [key, readings] : by_key) out.push_back(std::move(readings));
  return out;
}

/// Cut across the widest coordinate until `count` pieces are left.
void cut(const MatrixXd& at, Indices readings, std::size_t count, std::vector<Indices>& out) {
  if (count < 2 || readings.size() < 2) {
    std::sort(readings.begin(), readings.end());
    out.push_back(std::move(readings));
    return;
  }
  Eigen::Index widest = 0;
  double most = -1.0;
  for (Eigen::Index k = 0; k < at.cols(); ++k) {
    double low = INFINITY, high = -INFINITY;
    for (const Eigen::Index i : readings) {
      low = std::min(low, at(i, k));
      high = std::max(high, at(i, k));
    }
    if (!(high - low > most)) continue;
    most = high - low;
    widest = k;
  }
  const std::size_t first = count / 2;
  const auto middle = readings.begin() + static_cast<std::ptrdiff_t>(readings.size() * first / count);
  std::nth_element(readings.begin(), middle, readings.end(), [&](Eigen::Index a, Eigen::Index b) {
    return std::pair(at(a, widest), a) < std::pair(at(b, widest), b);
  });
  cut(at, Indices(readings.begin(), middle), first, out);
  cut(at, Indices(middle, readings.end()), count - first, out);
}

/// Takes single readings out that are far from the middle of their bin.
void part_with_far(const Observations& o, Bins& bins) {
  std::vector<double> distance(static_cast<std::size_t>(o.size()), 0.0), sizes;
  for (const Indices& bin : bins.members) {
    if (bin.size() < kFewestForMiddle) continue;
    std::vector<double> values;
    for (const Eigen::Index i : bin) values.push_back(o.values()[i]);
    const double middle = median(std::move(values));
    for (const Eigen::Index i : bin) {
      distance[static_cast<std::size_t>(i)] = std::abs(o.values()[i] - middle) / o.reading(i).u_random;
      sizes.push_back(distance[static_cast<std::size_t>(i)]);
    }
  }
  if (sizes.empty()) return;
  const auto count = static_cast<double>(sizes.size());
  const double limit = kFarInBin * std::max(1.0, kMadToSigma * median(std::move(sizes)));
  for (std::size_t i = 0; i < distance.size(); ++i)
    if (distance[i] > limit) bins.far.push_back(static_cast<Eigen::Index>(i));
  if (static_cast<double>(bins.far.size()) > kMostFar * count) bins.far.clear();
  if (bins.far.empty()) return;
  for (Indices& bin : bins.members)
    std::erase_if(bin,
                  [&](Eigen::Index i) { return std::binary_search(bins.far.begin(), bins.far.end(), i); });
  std::erase_if(bins.members, [](const Indices& bin) { return bin.empty(); });
}

}  // namespace

Bins bins_of(const Observations& o) {
  const MatrixXd at = coordinates(o);
  const double share = static_cast<double>(kMostSingly) / static_cast<double>(o.size());
  Bins out;
  for (Indices& bucket : buckets(o)) {
    const auto count = static_cast<std::size_t>(std::lround(share * static_cast<double>(bucket.size())));
    cut(at, std::move(bucket), std::max<std::size_t>(1, count), out.members);
  }
  part_with_far(o, out);
  // In the order of the file, as readings are.
  std::sort(out.members.begin(), out.members.end());
  return out;
}

}  // namespace trunnion::diagnosis
