#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/iso230_7.hpp"

namespace trunnion::iso230 {
namespace {

constexpr double kSameAngle = 1e-6;  // rad: below the resolution of rotary axes
constexpr double kSameDirection = 1e-3;

// Readings of one quantity in one direction, in the order taken.
struct Track {
  std::vector<double> angle, value;
};

// Angles within a turn and, at each, the readings of the turns.
Result<ErrorMotion> by_turns(ErrorMotion motion, const Track& track, const std::string& file) {
  struct Place {
    double angle = 0.0;  // as read in the first turn
    std::vector<double> values;
  };
  std::map<long long, Place> at;
  const long long full = std::llround(kTwoPi / kSameAngle);
  for (std::size_t i = 0; i < track.angle.size(); ++i) {
    double angle = std::fmod(track.angle[i], kTwoPi);
    if (angle < 0.0) angle += kTwoPi;
    const auto [it, fresh] = at.try_emplace(std::llround(angle / kSameAngle) % full);
    if (fresh) it->second.angle = angle;
    it->second.values.push_back(track.value[i]);
  }
  // A turn that also reads its end at 360 degrees has one reading more at 0: the last is dropped.
  std::size_t turns = at.empty() ? 0 : at.rbegin()->second.values.size();
  for (auto& [key, place] : at) {
    auto& values = place.values;
    if (values.size() == turns + 1) values.pop_back();
    if (values.size() != turns)
      return fail(ErrorCode::wrong_input,
                  "axis " + motion.axis + ": " + std::to_string(values.size()) + " readings at " +
                      shortest_text(std::round(place.angle * kDegreePerRad * 1e4) / 1e4) + " deg, " +
                      std::to_string(turns) + " at the last angle: the turns must have the same angles",
                  file);
    motion.angle_rad.push_back(place.angle);
    motion.readings.push_back(values);
  }
  if (motion.angle_rad.size() < 8)
    return fail(
        ErrorCode::wrong_input,
        "axis " + motion.axis + ": " + std::to_string(motion.angle_rad.size()) + " angles; 8 are the least",
        file);
  return motion;
}

struct AxisTracks {
  // quantity (rotation?), coordinate direction 0..2
  std::map<std::pair<bool, int>, Track> machine, part;
};

std::vector<std::pair<std::string, AxisTracks>> tracks_of(const Readings& readings) {
  std::vector<std::pair<std::string, AxisTracks>> out;
  for (std::size_t axis = 3; axis < 6; ++axis) {
    const auto [low, high] = std::minmax_element(
        readings.rows.begin(), readings.rows.end(),
        [&](const Reading& a, const Reading& b) { return a.position[axis] < b.position[axis]; });
    if (readings.rows.empty() || high->position[axis] - low->position[axis] < kTwoPi * 0.7) continue;
    AxisTracks tracks;
    for (const Reading& row : readings.rows) {
      Eigen::Index along = 0;
      if (row.n.cwiseAbs().maxCoeff(&along) < 1.0 - kSameDirection) continue;
      Track& track = (row.part_frame ? tracks.part : tracks.machine)[{row.rotation, static_cast<int>(along)}];
      track.angle.push_back(row.position[axis]);
      track.value.push_back(row.deviation * (row.n[along] > 0 ? 1.0 : -1.0));
    }
    out.emplace_back(std::string(1, Reading::kAxes[axis]), std::move(tracks));
  }
  return out;
}

// The direction that turns with the table: r = dx cos t + dy sin t, from two fixed directions read at the
// same angles.
ErrorMotion rotating(const ErrorMotion& x, const ErrorMotion& y) {
  ErrorMotion out = x;
  out.direction = "rotating";
  for (std::size_t i = 0; i < out.angle_rad.size(); ++i)
    for (std::size_t j = 0; j < out.readings[i].size(); ++j)
      out.readings[i][j] =
          x.readings[i][j] * std::cos(x.angle_rad[i]) + y.readings[i][j] * std::sin(x.angle_rad[i]);
  return out;
}

bool same_angles(const ErrorMotion& x, const ErrorMotion& y) {
  if (x.angle_rad.size() != y.angle_rad.size() || x.readings[0].size() != y.readings[0].size()) return false;
  for (std::size_t i = 0; i < x.angle_rad.size(); ++i)
    if (std::abs(x.angle_rad[i] - y.angle_rad[i]) > 2 * kSameAngle) return false;
  return true;
}

struct Fundamental {
  double cosine = 0.0, sine = 0.0;
};

Fundamental fundamental_of(const std::vector<RadialPoint>& points) {
  const CircleFit fit = fit_circle(points, Centre::least_squares);
  return {fit.x, fit.y};
}

}  // namespace

std::string_view text_of(ErrorMotionKind kind) {
  switch (kind) {
    case ErrorMotionKind::radial:
      return "radial";
    case ErrorMotionKind::axial:
      return "axial";
    case ErrorMotionKind::tilt:
      return "tilt";
  }
  return {};
}

Result<std::vector<ErrorMotion>> error_motions(const Readings& readings) {
  std::vector<ErrorMotion> out;
  for (const auto& [axis, tracks] : tracks_of(readings)) {
    const int along = static_cast<int>(Reading::kAxes.find(axis)) - 3;
    std::map<std::pair<bool, int>, ErrorMotion> fixed;
    for (const bool part : {false, true})
      for (const auto& [key, track] : part ? tracks.part : tracks.machine) {
        const auto [rotation, direction] = key;
        if (rotation && direction == along) continue;  // angular positioning: ISO 230-2
        ErrorMotion motion;
        motion.axis = axis;
        motion.kind = rotation             ? ErrorMotionKind::tilt
                      : direction == along ? ErrorMotionKind::axial
                                           : ErrorMotionKind::radial;
        motion.direction =
            (part ? "rotating " : "") + std::string(1, Reading::kAxes[static_cast<std::size_t>(direction)]);
        auto turned = by_turns(std::move(motion), track, readings.file);
        if (!turned) return tl::unexpected(turned.error());
        if (!part) fixed.emplace(key, *turned);
        out.push_back(std::move(*turned));
      }
    for (const bool rotation : {false, true}) {
      const auto x = fixed.find({rotation, (along + 1) % 3}), y = fixed.find({rotation, (along + 2) % 3});
      if (x != fixed.end() && y != fixed.end() && same_angles(x->second, y->second))
        out.push_back(rotating(x->second, y->second));
    }
  }
  if (out.empty())
    return fail(ErrorCode::wrong_input,
                "no rotary axis turns by most of a turn while it is read along or across it", readings.file);
  return out;
}

Result<ErrorMotionValues> evaluate_error_motion(const ErrorMotion& motion, std::optional<Centre> centre) {
  ErrorMotionValues out;
  const bool radial = motion.kind == ErrorMotionKind::radial;
  out.centre = centre.value_or(radial ? Centre::least_squares : Centre::polar_chart);
  out.turns = motion.readings.front().size();
  std::vector<RadialPoint> mean, all;
  for (std::size_t i = 0; i < motion.angle_rad.size(); ++i) {
    const auto& values = motion.readings[i];
    const double sum = std::accumulate(values.begin(), values.end(), 0.0);
    mean.push_back({motion.angle_rad[i], sum / static_cast<double>(values.size())});
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    out.asynchronous = std::max(out.asynchronous, *high - *low);
    for (const double value : values) all.push_back({motion.angle_rad[i], value});
  }
  const Fundamental once = fundamental_of(mean);
  out.fundamental = std::hypot(once.cosine, once.sine);
  const auto without = [&](std::vector<RadialPoint> points) {
    for (RadialPoint& p : points)
      p.radial_mm -= once.cosine * std::cos(p.angle_rad) + once.sine * std::sin(p.angle_rad);
    return points;
  };
  if (radial) {
    mean = without(mean);
    all = without(all);
  }
  out.synchronous = fit_circle(mean, out.centre).width;
  out.total = fit_circle(all, out.centre).width;
  if (!radial) out.residual_synchronous = fit_circle(without(mean), out.centre).width;
  return out;
}

}  // namespace trunnion::iso230
