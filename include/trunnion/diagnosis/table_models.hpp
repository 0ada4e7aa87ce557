#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "trunnion/diagnosis/measurement.hpp"
#include "trunnion/effects/control_tables.hpp"
#include "trunnion/effects/deviation.hpp"

namespace trunnion::diagnosis {

/// Displacement of the tool relative to the part (actual - nominal, M axes, mm) at the nodes of a grid of two
/// linear axes.
struct PlanarMap {
  std::string u, v;                      // axes; u is the first index
  std::vector<double> u_nodes, v_nodes;  // ascending, mm
  JointVector rest;                      // the other axes
  Vec3 tool_mm = Vec3::Zero();
  std::array<std::vector<double>, 3> displacement_M;  // X, Y, Z as Grid::values; empty: not measured

  double at(int component, std::size_t i, std::size_t j) const {
    return displacement_M[static_cast<std::size_t>(component)][i * v_nodes.size() + j];
  }
};

/// One reading that a table is tried on: n . (displacement of the tool relative to the part, M axes).
struct CheckReading {
  JointVector q;
  Vec3 tool_mm = Vec3::Zero();
  Vec3 n_M = Vec3::UnitX();
  double value_mm = 0.0;
};

/// The displacement readings of machine-frame n that lie on a full grid of two linear axes, all others at
/// rest, repeats averaged. Fails when they form none, saying what is missing.
Result<PlanarMap> planar_map(const Dataset& data, const Machine& machine);
/// All displacement readings of machine-frame n, as checks.
std::vector<CheckReading> check_readings(const Dataset& data);

/// A way to represent what was measured: error tables and how to interpolate them.
struct TableCandidate {
  std::string name;  // "single", "rigid", "bilinear", "nurbs", "spline", "spline smoothed 0.1", ...
  std::vector<ErrorTable> tables;
  InterpolationOptions one, two;
};

/// Every model of the map, on the same nodes:
///   single    one line per axis through the middle of the map: the usual table of a control
///   rigid     component tables of both axes (translations, and the rotations that the plane shows) that fit
///   all nodes in the least-
///             squares sense: straightness, and yaw with its lever arm, by the exact first order of the chain
///   bilinear, nurbs, spline (natural cubic, smoothed by 0, 0.01, 0.1, 1)   tables over both axes
Result<std::vector<TableCandidate>> table_candidates(const Machine& machine, const PlanarMap& map);

/// How well a candidate predicts readings that it has not seen; mm.
struct TableScore {
  double rms_before = 0.0, rms_after = 0.0;
  double max_before = 0.0, max_after = 0.0;
  double reduction() const { return rms_before > 0.0 ? 1.0 - rms_after / rms_before : 0.0; }
};
/// `free_offset`: one offset per direction n is common to model and readings (a map's zero is a matter of
/// set-up).
Result<TableScore> held_out(const Machine& machine, const TableCandidate& candidate,
                            const std::vector<CheckReading>& readings, bool free_offset);
/// Residuals reading - prediction, mm.
Result<std::vector<double>> residuals(const Machine& machine, const TableCandidate& candidate,
                                      const std::vector<CheckReading>& readings);

/// All models of a map with their held-out figures, and the one that predicts best.
struct TableChoice {
  struct Row {
    TableCandidate candidate;  // from all nodes
    TableScore score;
  };
  std::vector<Row> rows;
  std::size_t best = 0;
  std::string held_out_by;  // what the figures are from
};
/// With `others` the models of all nodes are tried on those; without, models of every other node on the nodes
/// between.
Result<TableChoice> choose_table(const Machine& machine, const PlanarMap& map,
                                 const std::vector<CheckReading>& others);

/// Peak to valley of one independent line before and after, mm.
struct LineCheck {
  std::string name;
  double before = 0.0, after = 0.0;
};
/// Verdict of the gate: an export that makes an independent line worse is refused (a table taken on centre
/// lines can).
struct Gate {
  std::vector<LineCheck> lines;
  bool passed() const;
  std::string text() const;  // one line a check, um
};
struct NamedLine {
  std::string name;
  std::vector<CheckReading> readings;
};
Result<Gate> gate(const Machine& machine, const TableCandidate& candidate,
                  const std::vector<NamedLine>& lines);
/// Independent lines of a dataset: readings of one run and one n.
std::vector<NamedLine> named_lines(const Dataset& data);

/// A reference line taken out of a component over one axis (ISO 230-1 allows all three; the squareness
/// depends on it).
enum class ReferenceLine { least_squares, end_points, minimum_zone };
std::optional<ReferenceLine> reference_line_of(std::string_view text);
/// Removes the line from every component over one axis and records each in `comments` (slope, offset,
/// method). Fails for two arguments.
Result<ErrorTable> without_line(ErrorTable table, ReferenceLine method);

/// Abbe transfer: translations that were measured at `lever_mm` from the joint's moving origin (M axes),
/// given the rotations of the same table, as the twist at the origin: d = d_measured - r x lever. The chain
/// then carries them to the tool. Recorded in `comments`.
Result<ErrorTable> abbe_transferred(const Machine& machine, ErrorTable table, const Vec3& lever_mm);

}  // namespace trunnion::diagnosis
