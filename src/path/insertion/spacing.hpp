#pragma once
#include <cstddef>
#include <vector>

#include "trunnion/path/nonlinear.hpp"
#include "trunnion/path/tool_off.hpp"

namespace trunnion::path {

/// How much a part [t0, t1] of a segment bends: what decides where points go.
struct Cell {
  double t0 = 0.0;
  double t1 = 1.0;
  ToolOff bow;        // from the middle of the part's chord to the curve, across the chord
  double axis = 0.0;  // of the tool axis across its arc, rad, where no flute counts
};

/// A place for a node: fraction of the chord and displacement beside it.
struct Place {
  double t = 0.0;
  ToolOff displacement;
};

/// What the tolerances leave for a bow, and how large one is in them: as many mm of the tip as ask for as
/// many points.
struct Tube {
  double tip_mm = 0.0;
  double flute_mm = 0.0;     // Tolerance::Flute; 0: a bow is as large as that of the tip
  double end_share = 1.0;    // tip_mm over what is left at the end of the flute
  double mm_per_axis = 0.0;  // tip_mm over the tolerance of the axis

  /// What rounding of the words leaves of them: the linear ones move the tip by `word_mm` at most, the rotary
  /// ones turn the axis by `word_rad`.
  static Tube within(const Tolerance& tolerance, double word_mm, double word_rad);
  double size_mm(const ToolOff& bow) const {
    const double tip = bow.tip_P.norm();
    if (flute_mm == 0.0) return tip;
    return std::max({tip, end_share * bow.at(flute_mm).norm(), mm_per_axis * bow.axis_P.norm()});
  }
  /// How far a displacement goes along one of size 1 mm: of tip and flute end together.
  double along(const ToolOff& off, const ToolOff& unit) const {
    const double tip = off.tip_P.dot(unit.tip_P);
    if (flute_mm == 0.0) return tip;
    const double size2 = unit.tip_P.squaredNorm() + unit.at(flute_mm).squaredNorm();
    return size2 > 0.0 ? (tip + off.at(flute_mm).dot(unit.at(flute_mm))) / size2 : 0.0;
  }
};

/// Spaces nodes evenly in I(t) = integral of sqrt(|p''_perp| / tolerance) dt: a piece of I-length l bows by
/// l^2/8 tolerances (README of this layer, "Placement").
class Spacing {
 public:
  /// @param axis_counts  false for nodes that are linear in the rotary axes: more of them do not turn the
  /// tool axis back
  void set(const std::vector<Cell>& cells, const Tube& tube, double axis_tolerance_rad, bool axis_counts);

  /// Pieces that nodes on the chord need (the integral alone; at least 1).
  std::size_t on_chord_pieces() const;
  /// Pieces that nodes on both sides need; the ends displaced against the bow by `end0`, `end1` tolerances.
  std::size_t two_sided_pieces(double end0, double end1) const;
  /// False where the tool axis asks for more points than the tip: displaced nodes then gain nothing.
  bool tip_leads() const { return tip_leads_; }

  void place_on_chord(std::size_t pieces, std::vector<Place>& out) const;
  void place_two_sided(std::size_t pieces, double end0, double end1, std::vector<Place>& out) const;
  /// Against the bow at t, of size 1 mm (Tube::size_mm); zero where there is none.
  ToolOff against(double t) const;
  /// Displacement of free ends, in tolerances, with which a segment of I-length `length` needs the fewest
  /// pieces.
  static double free_end_share(double length);
  /// True when one piece with ends displaced by x0, x1 tolerances against the bow is enough.
  static bool one_piece_covers(double length, double x0, double x1);
  double total() const { return cumulative_.empty() ? 0.0 : cumulative_.back(); }

 private:
  double t_at(double length) const;

  const std::vector<Cell>* cells_ = nullptr;
  std::vector<double> cumulative_;  // I at the end of each cell
  Tube tube_;
  bool tip_leads_ = true;
};

}  // namespace trunnion::path
