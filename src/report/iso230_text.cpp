#include <cmath>
#include <optional>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/report/iso230_json.hpp"

#include "report/columns.hpp"

namespace trunnion::report {
namespace {

using namespace iso230;

std::string cell(const std::optional<double>& value, double factor) {
  return right(value ? fixed_text(*value * factor, 2) : "-", 10);
}

std::string line_text(const Positioning& line) {
  const double f = line.rotary ? 1.0 / kRadPerUrad : 1.0 / kMmPerUm;
  const auto of = [](const std::optional<Unidirectional>& s, std::optional<double> Unidirectional::*symbol) {
    return s ? *s.*symbol : std::optional<double>();
  };
  const auto E = [](const std::optional<Unidirectional>& s) {
    return s ? std::optional<double>(s->E) : std::nullopt;
  };
  std::string out = line.name + "  (" + std::string(line.rotary ? "urad" : "um") + "; " +
                    std::to_string(line.target.size()) + " targets, " + std::to_string(line.runs_up) +
                    " runs up, " + std::to_string(line.runs_down) + " down)\n";
  out += "            both        up      down\n";
  out += "    B " + cell(line.B, f) + "      mean B " + cell(line.B_mean, f) + "\n";
  out += "    M " + cell(line.M, f) + "\n";
  out += "    E " + cell(line.E, f) + cell(E(line.up), f) + cell(E(line.down), f) + "\n";
  out += "    R " + cell(line.R, f) + cell(of(line.up, &Unidirectional::R), f) +
         cell(of(line.down, &Unidirectional::R), f) + "\n";
  out += "    A " + cell(line.A, f) + cell(of(line.up, &Unidirectional::A), f) +
         cell(of(line.down, &Unidirectional::A), f) + "\n";
  for (const std::string& note : line.notes) out += "    note: " + note + "\n";
  return out;
}

}  // namespace

std::string limits_text(const std::vector<HeldValue>& held) {
  std::string out;
  for (const HeldValue& h : held) {
    const double f = h.value.angle ? 1.0 / kRadPerUrad : 1.0 / kMmPerUm;
    out += "  " + h.value.of + " " + h.value.symbol + cell(h.value.value, f) + "  limit " +
           fixed_text(h.limit * f, 2) +
           (h.uncertainty > 0.0 ? ", uncertainty " + fixed_text(h.uncertainty * f, 2) : "") +
           (h.value.angle ? " urad: " : " um: ") + std::string(text_of(h.conformity)) + "\n";
  }
  return out.empty() ? "" : "\nlimits\n" + out;
}

std::string iso230_2_text(const std::vector<Positioning>& axes) {
  std::string out = std::string(kPositioningStandard) + "\n";
  for (const Positioning& axis : axes) out += line_text(axis);
  return out;
}

std::string iso230_6_text(const Diagonals& diagonals) {
  std::string out =
      std::string(kDiagonalStandard) + ", each diagonal by " + std::string(kPositioningStandard) + "\n";
  for (const Positioning& line : diagonals.lines) out += line_text(line);
  const double f = 1.0 / kMmPerUm;
  out += "largest over the diagonals (um):  E" + cell(diagonals.E, f) + "  R" + cell(diagonals.R, f) + "  B" +
         cell(diagonals.B, f) + "  A" + cell(diagonals.A, f) + "\n";
  for (const auto& s : diagonals.squareness)
    out += "squareness " + s.plane +
           " from the difference of the diagonals: the angle between the positive axes is 90 deg " +
           (s.opening_rad < 0 ? "- " : "+ ") + fixed_text(std::abs(s.opening_rad) / kRadPerUrad, 2) +
           " urad\n";
  return out;
}

std::string iso230_4_text(const std::vector<CircularTest>& tests) {
  const double f = 1.0 / kMmPerUm;
  std::string out = std::string(kCircularStandard) + "  (um)\n";
  for (const CircularTest& test : tests) {
    out += "plane " + test.plane + ", radius " + fixed_text(test.radius_mm, 3) + " mm\n";
    const std::pair<const char*, const std::optional<CircularTest::OneWay>*> ways[] = {
        {"clockwise        ", &test.clockwise}, {"counter-clockwise", &test.counter_clockwise}};
    for (const auto& [name, way] : ways)
      if (*way)
        out += std::string("    ") + name + "  G" + cell((*way)->G, f) + "  F max" + cell((*way)->F_max, f) +
               "  F min" + cell((*way)->F_min, f) +
               ((*way)->full_circle ? "" : "  (an arc: F about the circle as set up)") + "\n";
    out += "    both               G(b)" + cell(test.G_b, f) + "  D" + cell(test.D, f) + "\n";
    out += "    scale mismatch" + cell(test.scale_mismatch, f) +
           " um on the radius, opening of the axes' angle" + cell(test.opening_rad, 1.0 / kRadPerUrad) +
           " urad\n";
  }
  return out;
}

std::string iso230_7_text(const std::vector<EvaluatedMotion>& motions) {
  std::string out = std::string(kRotationStandard) + "\n";
  for (const auto& [motion, values] : motions) {
    const bool tilt = motion.kind == ErrorMotionKind::tilt;
    const double f = tilt ? 1.0 / kRadPerUrad : 1.0 / kMmPerUm;
    out += motion.axis + " " + std::string(text_of(motion.kind)) + " " + motion.direction + " (" +
           (tilt ? "urad" : "um") + ", " + std::string(text_of(values.centre)) + ", " +
           std::to_string(values.turns) + " turns):  total" + cell(values.total, f) + "  synchronous" +
           cell(values.synchronous, f) + "  asynchronous" +
           cell(values.turns > 1 ? std::optional<double>(values.asynchronous) : std::nullopt, f) +
           "  residual synchronous" + cell(values.residual_synchronous, f) + "  once per turn" +
           cell(values.fundamental, f) + "\n";
  }
  return out;
}

}  // namespace trunnion::report
