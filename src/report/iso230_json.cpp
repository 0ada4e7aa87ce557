#include "trunnion/report/iso230_json.hpp"

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

std::string iso230_2_json(const std::vector<Positioning>& axes) {
  ordered_json out;
  out["standard"] = kPositioningStandard;
  out["axes"] = ordered_json::array();
  for (const Positioning& axis : axes) out["axes"].push_back(line_json(axis));
  return json_text(out);
}

std::string iso230_6_json(const Diagonals& diagonals) {
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
    out["diagonals"].push_back(std::move(line));
  }
  out["squareness"] = ordered_json::array();
  for (const auto& s : diagonals.squareness)
    out["squareness"].push_back({{"plane", s.plane}, {"opening_urad", s.opening_rad / kRadPerUrad}});
  return json_text(out);
}

std::string iso230_4_json(const std::vector<CircularTest>& tests) {
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
  }
  return json_text(out);
}

}  // namespace trunnion::report
