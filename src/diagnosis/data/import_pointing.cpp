// TPOINT's list of stars, its fourth format: P. T. Wallace, "TPOINT: a telescope pointing analysis system"
// (public manual); what observatories' public programs write for it.
#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/printable.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/import.hpp"
#include "trunnion/effects/deviation.hpp"

#include "diagnosis/data/foreign_lines.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kAngles = 4;
constexpr double kFar_rad = 0.1;  // no mount points as badly: other columns, or another sense of the azimuth

struct Star {
  double azimuth_rad = 0.0, altitude_rad = 0.0;
};

struct Mount {
  const Machine& machine;
  AxisId azimuth, altitude;

  JointVector at(const Star& s) const {
    JointVector q;
    q[azimuth] = s.azimuth_rad;
    q[altitude] = 0.5 * kPi - s.altitude_rad;
    return q;
  }
  Mat3 tube_M(const JointVector& q) const { return DeviationMap(machine, q, machine.tool_vector()).R_MP(); }
};

// Caption, options behind colons, and the line of the place, before the stars. Returns the first star's line.
Result<std::size_t> behind_head(const std::vector<ForeignLine>& lines, const std::string& file) {
  bool caption = false, altaz = false;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const std::string_view text = lines[k].text;
    if (text.empty() || text.starts_with('!')) continue;
    if (!caption) {
      caption = true;
    } else if (text.starts_with(':')) {
      altaz = altaz || trimmed(text.substr(1)).starts_with("ALTAZ");
    } else {
      if (!altaz)
        return fail(ErrorCode::wrong_input,
                    "the list has no option ': ALTAZ': hour angles and declinations need the sidereal time "
                    "and are not read",
                    file, {lines[k].number, 1});
      return k + 1;
    }
  }
  return fail(ErrorCode::wrong_input, "no line with the latitude behind caption and options", file, {1, 1});
}

std::optional<AxisId> rotary_of_part(const Machine& machine, const std::string& name) {
  const auto axis = machine.axis(name);
  if (!axis || machine.axes[*axis].kind != AxisKind::rotary) return std::nullopt;
  return axis;
}

}  // namespace

Result<std::string> import_pointing(std::string_view text, const std::string& file, const Machine& machine,
                                    const PointingImport& options, Diagnostics& diagnostics) {
  const auto azimuth = rotary_of_part(machine, options.azimuth),
             altitude = rotary_of_part(machine, options.altitude);
  if (!azimuth || !altitude || machine.rotary_axes() != std::vector<AxisId>{*azimuth, *altitude})
    return fail(ErrorCode::wrong_input, "machine '" + machine.name + "' does not carry its part by azimuth " +
                                            options.azimuth + " and, on it, altitude " + options.altitude);
  const Mount mount{machine, *azimuth, *altitude};
  const auto lines = lines_of(text);
  const auto first = behind_head(lines, file);
  if (!first) return tl::unexpected(first.error());
  const std::size_t before = diagnostics.error_count();
  DealtReadings out(machine, options.parts);
  for (std::size_t k = *first; k < lines.size(); ++k) {
    const ForeignLine& line = lines[k];
    if (line.text.empty() || line.text.starts_with('!')) continue;
    if (line.text == "END") break;
    const auto degrees = numbers_of(line, file, diagnostics);
    if (degrees.size() < kAngles) {
      diagnostics.error(
          file, {line.number, 1},
          std::to_string(degrees.size()) +
              " numbers where azimuth and altitude, observed and of the mount, are expected (degrees)");
      continue;
    }
    const Star star{degrees[0] * kRadPerDegree, degrees[1] * kRadPerDegree};
    const Star read{degrees[2] * kRadPerDegree, degrees[3] * kRadPerDegree};
    const JointVector q = mount.at(read);
    const Vec3 nominal_M = mount.tube_M(q).col(2), actual_M = mount.tube_M(mount.at(star)).col(2);
    const Vec3 turn = nominal_M.cross(actual_M);
    const double angle = std::atan2(turn.norm(), nominal_M.dot(actual_M));
    if (angle > kFar_rad) {
      diagnostics.error(
          file, {line.number, 1},
          "the mount points " + fixed_text(angle * kDegreePerRad, 3) +
              " deg beside the star: the columns are azimuth and altitude observed, then of the mount");
      continue;
    }
    // The part turned by it; the tool, relative to the part, turned the other way.
    const Vec3 rotation_M = turn.norm() > 0.0 ? Vec3(-angle * turn.normalized()) : Vec3::Zero();
    JointVector up = q;
    up[*altitude] += 0.5 * kPi;
    const Vec3 along_altitude_M =
        (mount.tube_M(up).col(2) - nominal_M * nominal_M.dot(mount.tube_M(up).col(2))).normalized();
    const double u_random = options.u_random_urad * kRadPerUrad;
    out.at(q);
    for (const Vec3& n : {Vec3(nominal_M.cross(along_altitude_M)), along_altitude_M})
      out.add(Quantity::rotation, n, n.dot(rotation_M), u_random);
  }
  if (diagnostics.error_count() > before) return tl::unexpected(diagnostics.first_error());
  if (out.points() == 0) return fail(ErrorCode::wrong_input, "no line with a star", file, {1, 1});
  return out.text({"pointing of a mount, " + file + ", u_random " + shortest_text(options.u_random_urad) +
                   " urad assumed"});
}

}  // namespace trunnion::diagnosis
