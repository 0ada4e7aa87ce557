#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "path/insertion/node_maker.hpp"
#include "path/insertion/segment_ends.hpp"
#include "path/insertion/segment_judge.hpp"
#include "path/insertion/spacing.hpp"

namespace trunnion::path {

/// How a segment bends from one part of it to the next, and where its nodes go for that.
class NodePlan {
 public:
  enum class Side : std::uint8_t { on_chord, two_sided };
  /// What rounding of the words makes at most.
  struct WordError {
    double tip_mm = 0.0;    // of the linear words
    double axis_rad = 0.0;  // of the rotary words, about two axes at right angles to the tool
  };

  /// All of the segment at hand; they must outlive this.
  NodePlan(const SegmentJudge& judge, const NodeMaker& maker, const SegmentEnds& ends, const WordError& error)
      : judge_(judge), maker_(maker), ends_(ends), word_error_(error) {}

  /// A segment begins: its ends are not displaced until cells are used.
  void start() { displaced_ = {}; }
  /// Cells of the pieces between neighbouring ideal nodes, evenly spaced.
  void see_ideal(NodeAxis how);
  /// Cells of the pieces as they came out of the last attempt.
  void see_attempt(std::span<const Node> nodes);
  /// Sees the ideal nodes and tells which kind needs fewer points. `axis_holds`: nodes that are linear in the
  /// rotary axes hold the axis tolerance as they are.
  NodeAxis choose_axis(bool axis_holds, bool passes_pole);
  /// Spaces the nodes by the cells.
  void use_cells(NodeAxis how);
  /// The cells that were seen, and others in their place.
  const std::vector<Cell>& cells() const { return cells_; }
  std::vector<Cell> exchange_cells(std::vector<Cell> cells);

  /// Pieces that the segment needs.
  std::size_t pieces(Side side) const {
    return side == Side::on_chord ? spacing_.on_chord_pieces()
                                  : spacing_.two_sided_pieces(displaced_[0], displaced_[1]);
  }
  void place(std::size_t pieces, Side side, std::vector<Place>& out) const;
  /// Of a node at the edge of what the tolerance leaves; `edge`: its share.
  ToolOff displacement(double t, Side side, double edge) const;
  /// A displacement of the node at `t` that leaves its foot well between the ends: beyond one of them the
  /// control would come to the end and go back.
  ToolOff between_ends(const ToolOff& displacement, double t) const;
  /// What the tolerance leaves for the bow when the words are rounded.
  Tube tube(const Tolerance& tolerance) const {
    return Tube::within(tolerance, word_error_.tip_mm, word_error_.axis_rad);
  }
  const Spacing& spacing() const { return spacing_; }
  /// Motion along the segment reaches its ends: the cells ask for more than is needed.
  bool crowded() const { return crowded_; }

 private:
  const TableKinematics& kinematics() const { return judge_.kinematics(); }
  void add_cell(const Station& a, const Station& b, double t0, double t1);
  Vec3 within_reference(const Vec3& bow, double t);
  ToolOff flute_bow(const Station& a, const Station& b, double t0, double t1, const ToolPose& middle);

  const SegmentJudge& judge_;
  const NodeMaker& maker_;
  const SegmentEnds& ends_;
  WordError word_error_;
  std::vector<Cell> cells_;
  double largest_cell_turn_ = 0.0;
  bool crowded_ = false;
  Spacing spacing_;
  std::array<double, 2> displaced_{};  // the ends, against the bow, in tolerances
};

}  // namespace trunnion::path
