#pragma once
#include <cstddef>
#include <vector>

#include "trunnion/geom/vec.hpp"

namespace trunnion::path {

/// How much a part [t0, t1] of a segment bends: what decides where points go.
struct Cell {
  double t0 = 0.0;
  double t1 = 1.0;
  Vec3 bow_P = Vec3::Zero();  // from the middle of the part's chord to the curve, across the chord, mm
  double axis = 0.0;          // the same of the tool axis, rad
};

/// A place for a node: fraction of the chord and displacement beside it.
struct Place {
  double t = 0.0;
  Vec3 displacement_P = Vec3::Zero();
};

/// Spaces nodes evenly in I(t) = integral of sqrt(|p''_perp| / tolerance) dt: a piece of I-length l bows by
/// l^2/8 tolerances (README of this layer, "Placement").
class Spacing {
 public:
  /// @param axis_counts  false for nodes that are linear in the rotary axes: more of them do not turn the
  /// tool axis back
  void set(const std::vector<Cell>& cells, double tip_tolerance_mm, double axis_tolerance_rad,
           bool axis_counts);

  /// Pieces that nodes on the chord need (the integral alone; at least 1).
  std::size_t on_chord_pieces() const;
  /// Pieces that nodes on both sides need; the ends displaced against the bow by `end0`, `end1` tolerances.
  std::size_t two_sided_pieces(double end0, double end1) const;
  /// False where the tool axis asks for more points than the tip: displaced nodes then gain nothing.
  bool tip_leads() const { return tip_leads_; }

  void place_on_chord(std::size_t pieces, std::vector<Place>& out) const;
  void place_two_sided(std::size_t pieces, double end0, double end1, std::vector<Place>& out) const;
  /// Unit vector against the bow at t; zero where there is none.
  Vec3 against(double t) const;
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
  double tip_tolerance_mm_ = 0.0;
  bool tip_leads_ = true;
};

}  // namespace trunnion::path
