#pragma once
#include <algorithm>
#include <cstdint>

#include "trunnion/post/verify.hpp"

#include "post/judging/path_place.hpp"

// Private to the verifier.
namespace trunnion::post {

/// What the verification writes into its report of the cut, block by block.
struct CutRecord {
  explicit CutRecord(const VerifyOptions& options);

  /// The block at hand, as far as it was judged: upper bounds of its deviations.
  struct Block {
    double tip_mm = 0.0;
    double axis_rad = 0.0;
    double flute_mm = 0.0;
    double flute_seen_mm = 0.0;  // for whoever collects: of every piece, those in the pole's cone too
    bool proved = true;
  };

  /// A CL point is off the tip's path by so much.
  void point_hit(double off_mm) {
    report.max_point_deviation_mm = std::max(report.max_point_deviation_mm, off_mm);
  }
  void take_deviation(const DeviationMeter::Deviation& d, bool in_cone = false);
  /// Of a block that ends in line `nc_line` of the program, on the way to `to`.
  void take_flute(const DeviationMeter::Beside& beside, const Target& to, std::uint32_t nc_line,
                  bool in_cone = false);
  /// What is allowed of a flute in the pole's cone, and what of it is less than what is known there, mm.
  double cone_limit_mm(double flute_mm) const;
  double known_in_cone_mm(double flute_mm) const;
  /// By sines of angles that are above those of the report.
  void take_axis(double axis, double at_tip, const KnownFigures& known);
  /// The end of a block points so far from every place of the path that its tip is near, rad.
  void take_end_axis(double axis_rad, bool in_cone);
  /// A block that is not straight itself leaves its chord by so much more. `has_flute`: of the tools.
  void bows_by(double off_chord_mm, bool has_flute);
  /// The end of a block of the cut; `programmed`: it ends at a CL point.
  void end_cut(const Vertex& v, std::uint32_t cl_line, bool programmed);
  /// The end of any block, for whoever collects them.
  void end_block(const Vertex& v, std::uint32_t cl_line, bool programmed) {
    end_block(v, Block{0.0, 0.0, 0.0, 0.0, of_block.proved}, cl_line, programmed);
  }
  /// The last block ends at a CL point.
  void mark_programmed() {
    if (collect && !report.blocks.empty()) report.blocks.back().programmed = true;
  }

  /// Deviations that change no figure of the report: below the last of the worst places, and below the
  /// largest of the axis.
  DeviationMeter::Deviation uninteresting() const;
  /// The same, with the flute.
  KnownFigures known_figures(double flute_mm) const;

  std::size_t worst_count;
  bool collect;
  VerifyReport report;
  Block of_block;
  double judged_axis_rad = 0.0;  // largest of the blocks that were judged, outside the pole's cone
  double path_mm = 0.0;          // of the tip, of a program whose blocks are collected
  double tool_length_mm = 0.0;   // gauge length of the tool in the spindle

 private:
  void end_block(const Vertex& v, const Block& block, std::uint32_t cl_line, bool programmed);
};

}  // namespace trunnion::post
