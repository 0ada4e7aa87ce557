#include "trunnion/report/iso230_json.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "trunnion/base/units.hpp"

#include "report/json_text.hpp"

namespace trunnion::report {
namespace {

using nlohmann::ordered_json;
using namespace iso230;

double factor_of(bool rotary) {
  return rotary ? 1.0 / kRadPerUrad : 1.0 / kMmPerUm;
}

ordered_json number(const std::optional<double>& value, double factor) {
  return value ? ordered_json(*value * factor) : ordered_json(nullptr);
}

ordered_json numbers(const std::vector<double>& values, double factor) {
  ordered_json out = ordered_json::array();
  for (const double value : values) out.push_back(value * factor);
  return out;
}

// The readings of a line: [target][run], both directions.
void add_readings(ordered_json& out, const LineTest& test, bool rotary) {
  const double f = factor_of(rotary);
  for (const auto& [name, readings] :
       {std::pair{"readings_up", &test.up}, std::pair{"readings_down", &test.down}}) {
    if (readings->empty()) continue;
    auto& rows = out["targets"][name] = ordered_json::array();
    for (const auto& runs : *readings) rows.push_back(numbers(runs, f));
  }
}

// In the words of a ball bar's report.
std::string cause_text(CircleCause::Kind kind, const std::string& plane) {
  const std::string first = plane.substr(0, 1), second = plane.substr(1);
  switch (kind) {
    case CircleCause::Kind::scale_mismatch:
      return "scale mismatch";
    case CircleCause::Kind::squareness:
      return "squareness";
    case CircleCause::Kind::lost_motion_first:
      return "lost motion of " + first;
    case CircleCause::Kind::lost_motion_second:
      return "lost motion of " + second;
    case CircleCause::Kind::servo_mismatch:
      return "servo mismatch";
    case CircleCause::Kind::radius:
      return "radius differs with direction";
  }
  return {};
}

ordered_json causes_json(const CircularTest& test, const std::vector<const CircularPath*>& paths) {
  ordered_json out = ordered_json::array();
  double left = 1.0;
  for (const CircleCause& cause : circle_causes(paths)) {
    const bool angle = cause.kind == CircleCause::Kind::squareness;
    // Scales and squareness have their figures already.
    const double size = cause.kind == CircleCause::Kind::scale_mismatch ? test.scale_mismatch
                        : angle                                         ? test.opening_rad
                                                                        : cause.size_mm;
    out.push_back({{"cause", cause_text(cause.kind, test.plane)},
                   {"per_cent", 100.0 * cause.share},
                   {"size", size * factor_of(angle)},
                   {"unit", angle ? "urad" : "um"}});
    left -= cause.share;
  }
  if (!out.empty())
    out.push_back({{"cause", "other"}, {"per_cent", 100.0 * left}, {"size", nullptr}, {"unit", nullptr}});
  return out;
}

ordered_json path_json(const CircularPath& path) {
  ordered_json out = {{"sense", path.counter_clockwise ? "counter-clockwise" : "clockwise"},
                      {"angle_deg", ordered_json::array()},
                      {"read", ordered_json::array()},
                      {"radial", ordered_json::array()}};
  // Where the ball was set up is none of the machine's errors.
  const CircleFit fit = fit_circle(path.points, Centre::least_squares);
  for (const RadialPoint& p : path.points) {
    out["angle_deg"].push_back(p.angle_rad * kDegreePerRad);
    out["read"].push_back(p.radial_mm / kMmPerUm);
    out["radial"].push_back((p.radial_mm - fit.x * std::cos(p.angle_rad) - fit.y * std::sin(p.angle_rad)) /
                            kMmPerUm);
  }
  return out;
}

ordered_json line_json(const Positioning& line) {
  const double f = factor_of(line.rotary);
  const auto side = [&](const std::optional<Unidirectional>& s, auto symbol) {
    return s ? number(symbol(*s), f) : ordered_json(nullptr);
  };
  ordered_json out;
  out["axis"] = line.name;
  out["unit"] = line.rotary ? "urad" : "um";
  out["runs_up"] = line.runs_up;
  out["runs_down"] = line.runs_down;
  const auto E = [](const Unidirectional& s) { return std::optional<double>(s.E); };
  const auto R = [](const Unidirectional& s) { return s.R; };
  const auto A = [](const Unidirectional& s) { return s.A; };
  out["B"] = number(line.B, f);
  out["B_mean"] = number(line.B_mean, f);
  out["R_up"] = side(line.up, R);
  out["R_down"] = side(line.down, R);
  out["R"] = number(line.R, f);
  out["E_up"] = side(line.up, E);
  out["E_down"] = side(line.down, E);
  out["E"] = number(line.E, f);
  out["M"] = number(line.M, f);
  out["A_up"] = side(line.up, A);
  out["A_down"] = side(line.down, A);
  out["A"] = number(line.A, f);
  ordered_json at;
  at[line.rotary ? "target_deg" : "target_mm"] = numbers(line.target, line.rotary ? kDegreePerRad : 1.0);
  const std::pair<const char*, const std::optional<Unidirectional>*> sides[] = {{"up", &line.up},
                                                                                {"down", &line.down}};
  for (const auto& [name, s] : sides) {
    if (!*s) continue;
    at[std::string("x_mean_") + name] = numbers((*s)->mean, f);
    at[std::string("s_") + name] = numbers((*s)->s, f);
    at[std::string("R_") + name] = numbers((*s)->repeatability, f);
  }
  at["x_mean"] = numbers(line.mean, f);
  at["B"] = numbers(line.reversal, f);
  at["R"] = numbers(line.repeatability, f);
  out["targets"] = std::move(at);
  out["notes"] = line.notes;
  return out;
}

}  // namespace

std::string iso230_2_json(const std::vector<Positioning>& axes, const std::vector<LineTest>& lines) {
  ordered_json out;
  out["standard"] = kPositioningStandard;
  out["axes"] = ordered_json::array();
  for (std::size_t i = 0; i < axes.size(); ++i) {
    out["axes"].push_back(line_json(axes[i]));
    if (i < lines.size()) add_readings(out["axes"].back(), lines[i], axes[i].rotary);
  }
  return json_text(out);
}

std::string iso230_6_json(const Diagonals& diagonals, const std::vector<LineTest>& lines) {
  const double f = factor_of(false);
  ordered_json out;
  out["standard"] = kDiagonalStandard;
  out["evaluated_by"] = kPositioningStandard;
  out["unit"] = "um";
  out["largest"] = {{"E", number(diagonals.E, f)},
                    {"R", number(diagonals.R, f)},
                    {"B", number(diagonals.B, f)},
                    {"M", number(diagonals.M, f)},
                    {"A", number(diagonals.A, f)}};
  out["diagonals"] = ordered_json::array();
  for (std::size_t i = 0; i < diagonals.lines.size(); ++i) {
    ordered_json line = line_json(diagonals.lines[i]);
    line["peak_to_valley"] = diagonals.peak_to_valley[i] * f;
    if (i < lines.size()) add_readings(line, lines[i], diagonals.lines[i].rotary);
    out["diagonals"].push_back(std::move(line));
  }
  out["squareness"] = ordered_json::array();
  for (const auto& s : diagonals.squareness)
    out["squareness"].push_back({{"plane", s.plane}, {"opening_urad", s.opening_rad / kRadPerUrad}});
  return json_text(out);
}

std::string iso230_4_json(const std::vector<CircularTest>& tests, const std::vector<CircularPath>& paths) {
  const double f = factor_of(false);
  ordered_json out;
  out["standard"] = kCircularStandard;
  out["unit"] = "um";
  out["circles"] = ordered_json::array();
  for (const CircularTest& test : tests) {
    ordered_json one;
    one["plane"] = test.plane;
    one["radius_mm"] = test.radius_mm;
    const std::pair<const char*, const std::optional<CircularTest::OneWay>*> ways[] = {
        {"clockwise", &test.clockwise}, {"counter_clockwise", &test.counter_clockwise}};
    for (const auto& [name, way] : ways)
      if (*way)
        one[name] = {{"G", (*way)->G * f},
                     {"G_LSC", (*way)->G_lsc * f},
                     {"F_max", (*way)->F_max * f},
                     {"F_min", (*way)->F_min * f},
                     {"full_circle", (*way)->full_circle}};
    one["G_b"] = number(test.G_b, f);
    one["D"] = number(test.D, f);
    one["scale_mismatch_um"] = test.scale_mismatch * f;
    one["opening_urad"] = test.opening_rad / kRadPerUrad;
    std::vector<const CircularPath*> own;
    one["paths"] = ordered_json::array();
    for (const CircularPath& path : paths) {
      if (path.plane != test.plane || path.radius_mm != test.radius_mm) continue;
      own.push_back(&path);
      one["paths"].push_back(path_json(path));
    }
    one["causes"] = causes_json(test, own);
    out["circles"].push_back(std::move(one));
  }
  return json_text(out);
}

std::string iso230_7_json(const std::vector<EvaluatedMotion>& motions) {
  ordered_json out;
  out["standard"] = kRotationStandard;
  out["error_motions"] = ordered_json::array();
  for (const auto& [motion, values] : motions) {
    const bool tilt = motion.kind == ErrorMotionKind::tilt;
    const double f = factor_of(tilt);
    out["error_motions"].push_back(
        {{"axis", motion.axis},
         {"kind", text_of(motion.kind)},
         {"direction", motion.direction},
         {"unit", tilt ? "urad" : "um"},
         {"centre", text_of(values.centre)},
         {"turns", values.turns},
         {"angles", motion.angle_rad.size()},
         {"total", values.total * f},
         {"synchronous", values.synchronous * f},
         {"asynchronous", values.turns > 1 ? ordered_json(values.asynchronous * f) : ordered_json(nullptr)},
         {"residual_synchronous", number(values.residual_synchronous, f)},
         {"fundamental", values.fundamental * f}});
    auto& paths = out["error_motions"].back()["paths"] = ordered_json::array();
    for (std::size_t turn = 0; turn < values.turns; ++turn) {
      ordered_json one = {{"turn", "turn " + std::to_string(turn + 1)},
                          {"angle_deg", ordered_json::array()},
                          {"radial", ordered_json::array()}};
      for (std::size_t k = 0; k < motion.angle_rad.size(); ++k) {
        if (turn >= motion.readings[k].size()) continue;
        one["angle_deg"].push_back(motion.angle_rad[k] * kDegreePerRad);
        one["radial"].push_back(motion.readings[k][turn] * f);
      }
      paths.push_back(std::move(one));
    }
  }
  return json_text(out);
}

std::string with_limits(const std::string& json, const std::vector<HeldValue>& held) {
  if (held.empty()) return json;
  auto out = ordered_json::parse(json);
  out["passed"] = all_within(held);
  auto& rows = out["limits"] = ordered_json::array();
  for (const HeldValue& h : held) {
    const double f = factor_of(h.value.angle);
    rows.push_back({{"of", h.value.of},
                    {"symbol", h.value.symbol},
                    {"unit", h.value.angle ? "urad" : "um"},
                    {"value", number(h.value.value, f)},
                    {"limit", h.limit * f},
                    {"uncertainty", h.uncertainty > 0.0 ? ordered_json(h.uncertainty * f) : nullptr},
                    {"result", text_of(h.conformity)}});
  }
  return json_text(out);
}

}  // namespace trunnion::report
