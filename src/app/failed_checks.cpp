#include "app/failed_checks.hpp"

#include <algorithm>
#include <spdlog/fmt/fmt.h>

namespace trunnion::app {
namespace {

// Four decimals, or as many as a small angle needs.
std::string degrees(Angle angle) {
  constexpr double kSmall_deg = 1e-3;
  const double deg = angle.deg();
  return deg < kSmall_deg ? fmt::format("{:.3g} deg", deg) : fmt::format("{:.4f} deg", deg);
}

}  // namespace

std::vector<std::string> failed_checks(const post::VerifyReport& v, const std::string& cl_file) {
  std::vector<std::string> out;
  const double tip = std::max(v.certified_tip_deviation_mm, v.max_point_deviation_mm);
  if (tip > v.tolerance_mm) {
    const std::string at =
        v.worst.empty() ? "" : fmt::format(", worst at {}:{}", cl_file, v.worst[0].cl_line);
    out.push_back(
        fmt::format("the tip deviates by {:.6f} mm, the tolerance is {} mm{}", tip, v.tolerance_mm, at));
  }
  if (v.max_axis_deviation > v.axis_tolerance) {
    out.push_back(fmt::format("the tool axis deviates by {}, the tolerance is {}",
                              degrees(v.max_axis_deviation), degrees(v.axis_tolerance)));
  }
  if (v.max_pole_axis_deviation > v.axis_tolerance + v.pole_tolerance) {
    out.push_back(fmt::format("the tool axis deviates by {} near the pole, the tolerance is {}",
                              degrees(v.max_pole_axis_deviation),
                              degrees(v.axis_tolerance + v.pole_tolerance)));
  }
  if (v.rapid_tolerance_mm && v.max_rapid_deviation_mm > *v.rapid_tolerance_mm) {
    out.push_back(fmt::format("rapids deviate by {:.6f} mm, their tolerance is {} mm",
                              v.max_rapid_deviation_mm, *v.rapid_tolerance_mm));
  }
  if (v.points_missed > 0)
    out.push_back(fmt::format("{} CL points are not on the program's path", v.points_missed));
  for (const auto& b : v.beyond_limits)
    out.push_back(fmt::format("NC line {} is beyond the limits of axis {}", b.nc_line, b.axis));
  for (const auto& f : v.too_fast) {
    out.push_back(fmt::format("NC line {} moves axis {} at {:.4f} times its largest speed", f.nc_line, f.axis,
                              f.ratio));
  }
  return out;
}

}  // namespace trunnion::app
