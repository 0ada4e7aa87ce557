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
  const double tip = v.largest_tip_deviation_mm();
  if (tip > v.tolerance_mm) {
    const std::string at =
        v.worst.empty() ? "" : fmt::format(", worst at {}:{}", cl_file, v.worst[0].cl_line);
    out.push_back(
        fmt::format("the tip deviates by {:.6f} mm, the tolerance is {} mm{}", tip, v.tolerance_mm, at));
  }
  if (v.flute_mm > 0.0 && v.certified_flute_deviation_mm > v.tolerance_mm) {
    out.push_back(fmt::format(
        "the tool deviates by {:.6f} mm between its tip and {} mm up, the tolerance is {} mm, "
        "worst at {}:{}",
        v.certified_flute_deviation_mm, v.flute_mm, v.tolerance_mm, cl_file, v.worst_flute.cl_line));
  }
  if (v.certified_pole_flute_deviation_mm > v.pole_flute_tolerance_mm) {
    out.push_back(fmt::format(
        "the tool deviates by {:.6f} mm between its tip and {} mm up near the pole, the tolerance there is "
        "{:.6f} mm, worst at {}:{}",
        v.certified_pole_flute_deviation_mm, v.flute_mm, v.pole_flute_tolerance_mm, cl_file,
        v.worst_pole_flute.cl_line));
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
  if (v.max_rapid_deviation_mm > v.rapid_tolerance_mm) {
    out.push_back(
        fmt::format("a rapid leaves its line by {:.6f} mm, the tolerance of rapids is {} mm, at {}:{}",
                    v.max_rapid_deviation_mm, v.rapid_tolerance_mm, cl_file, v.worst_rapid.cl_line));
  }
  for (const auto& u : v.unsafe) out.push_back(fmt::format("NC line {}: {}", u.nc_line, u.what));
  if (v.points_missed > 0)
    out.push_back(fmt::format("{} CL points are not on the program's path", v.points_missed));
  for (const auto& b : v.beyond_limits)
    out.push_back(fmt::format("NC line {} is beyond the limits of axis {}", b.nc_line, b.axis));
  for (const auto& f : v.too_fast) {
    out.push_back(fmt::format("NC line {} moves axis {} at {:.4f} times its largest speed", f.nc_line, f.axis,
                              f.ratio));
  }
  for (const post::Check& check : v.checks) {
    for (const post::CheckPlace& place : check.places)
      out.push_back(fmt::format("NC line {}: {}", place.nc_line, place.what));
    if (check.places.size() < check.count)
      out.push_back(fmt::format("{} in all: {} places",
                                post::name_of(static_cast<post::CheckOf>(&check - v.checks.data())),
                                check.count));
  }
  return out;
}

std::vector<std::string> check_table(const post::VerifyReport& v) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < post::kChecks; ++i) {
    const post::Check& check = v.checks[i];
    out.push_back(fmt::format("{:<8} {}: {}", post::name_of(static_cast<post::CheckOf>(i)),
                              post::name_of(check.state), check.about));
  }
  return out;
}

std::string travel_text(const post::VerifyReport& v) {
  std::string out;
  for (const post::AxisTravel& t : v.travel) {
    const bool rotary = t.axis.kind == AxisKind::rotary;
    const double unit = rotary ? kDegreePerRad : 1.0;
    out += fmt::format("{}{} {:.2f} to {:.2f}", out.empty() ? "axes: " : ", ", t.axis.name, t.smallest * unit,
                       t.largest * unit);
    const double turns = (t.largest - t.smallest) / kTwoPi;
    if (rotary && turns > 1.0) out += fmt::format(" ({:.1f} turns)", turns);
  }
  return out;
}

std::string rapid_text(const post::VerifyReport& v) {
  return fmt::format(
      "rapids: tip within {:.3f} mm of its lines (tolerance {} mm){}", v.max_rapid_deviation_mm,
      v.rapid_tolerance_mm,
      v.worst_rapid.cl_line > 0 ? fmt::format(", most at CL line {}", v.worst_rapid.cl_line) : "");
}

}  // namespace trunnion::app
