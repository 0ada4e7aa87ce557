#include "post/judging/cut_judge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "post/judging/flute_about.hpp"

namespace trunnion::post {

bool CutJudge::changes_no_figure(const CutBlock& block, const path::Certifier::Bows& nominal,
                                 const KnownFigures& known) const {
  const auto bow = meter_.bow_at_most(block.from, block.to, nominal);
  if (!bow) return false;
  return proves_quiet(quiet_test(known).of(block.from, block.to, block.place, *bow), block, known);
}

bool CutJudge::proves_quiet(const QuietBlock& quiet, const CutBlock& block, const KnownFigures& known) const {
  if (!quiet.may_be || (!(quiet.tip_keeps && quiet.flute_keeps) && !keeps_tool(quiet, block, known)))
    return false;
  if (quiet.axis_keeps) {
    record_.take_axis(quiet.axis, quiet.axis_at_tip, known);
    return true;
  }
  // Then it is below what was judged already.
  const std::size_t segment = block.place.segment;
  if (!meter_.keeps_axis(block.from, block.to, path_.points()[segment], path_.points()[segment + 1],
                         record_.uninteresting().axis_rad.upper))
    return false;
  take_beside({block.from, block.to, segment, path_.at().t, block.place.t});
  return true;
}

// The same cuts as QuietTest makes, with the tool's curve on each side of them.
bool CutJudge::keeps_tool(const QuietBlock& quiet, const CutBlock& block, const KnownFigures& known) const {
  constexpr std::size_t kMostCuts = 2;
  const PathPoints& points = path_.points();
  const std::size_t first = path_.at().segment;
  const std::size_t last = block.place.segment;
  if (last - first > kMostCuts) return false;
  const auto keeps = [&](const Piece& piece) {
    const Target& a = points[piece.segment];
    const Target& b = points[piece.segment + 1];
    return (quiet.tip_keeps || meter_.keeps_tip(piece.from, piece.to, a, b, known.tip_mm)) &&
           (quiet.flute_keeps ||
            meter_.keeps_flute({piece.from, piece.to, piece.t0, piece.t1}, a, b, known.flute_limit_mm));
  };
  std::array<Vertex, kMostCuts> cuts;
  const Vertex* from = &block.from;
  double t0 = path_.at().t;
  ChordFoot foot(block.from, block.to);
  for (std::size_t j = first; j < last; ++j) {
    const Target& corner = points[j + 1];
    foot.go_to(corner);
    Vertex& cut = cuts[j - first];
    cut.q = JointVector::interpolate(block.from.q, block.to.q, foot.t);
    meter_.place(cut, block.to.q, program_);
    if ((cut.tip_P - corner.tip_P).norm() > record_.report.max_point_deviation_mm ||
        !keeps({*from, cut, j, t0, 1.0}))
      return false;
    from = &cut;
    t0 = 0.0;
  }
  return keeps({*from, block.to, last, t0, block.place.t});
}

bool CutJudge::judge(const CutBlock& block) const {
  const PathPoints& points = path_.points();
  const Place& at = path_.at();
  const Vertex* from = &block.from;
  std::optional<Vertex> passed;
  // What a block is off its chord comes on top: then the figure itself is needed.
  const DeviationMeter::Deviation known =
      block.to.off_chord_mm > 0.0F ? DeviationMeter::Deviation{} : record_.uninteresting();
  const auto take = [&](const Vertex& to, std::size_t j, double t1) {
    const Target& a = points[j];
    const Target& b = points[j + 1];
    record_.take_deviation(meter_.of(*from, to, a, b, program_, known), PathFollower::near_pole(a, b));
    take_beside({*from, to, j, j == at.segment ? at.t : 0.0, t1});
  };
  bool passed_point = false;
  for (std::size_t j = at.segment; j < block.place.segment; ++j) {  // CL points that the block passes
    const Target& corner = points[j + 1];
    const Vertex to = meter_.nearest_between(*from, block.to, corner, program_);
    record_.point_hit((to.tip_P - corner.tip_P).norm());
    take(to, j, 1.0);
    passed_point |= record_.collect && mark_nearer(block, corner);
    passed = to;
    from = &*passed;
  }
  take(block.to, block.place.segment, block.place.t);
  return passed_point;
}

void CutJudge::take_beside(const Piece& piece) const {
  const Target& a = path_.points()[piece.segment];
  const Target& b = path_.points()[piece.segment + 1];
  VerifyReport& report = record_.report;
  if (PathFollower::near_pole(a, b)) return take_flute_in_cone(piece);
  DeviationMeter::Beside known;
  known.axis_rad.upper = report.max_axis_deviation_at_tip.rad();
  // What a block is off its chord comes on top: then the figure itself is needed.
  if (b.flute_mm == 0.0) known.flute_mm.upper = std::numeric_limits<double>::infinity();
  if (b.flute_mm > 0.0 && !(piece.to.off_chord_mm > 0.0F))
    known.flute_mm.upper = report.certified_flute_deviation_mm;
  auto beside = meter_.beside(piece.from, piece.to, a, b, piece.t0, piece.t1, program_, known);
  report.max_axis_deviation_at_tip =
      std::max(report.max_axis_deviation_at_tip, Angle::radians(beside.axis_rad.upper));
  if (beside.flute_mm.upper > report.tolerance_mm)
    beside.flute_mm = FluteAbout(meter_, path_, program_, report.tolerance_mm, false)
                          .of(piece.from, piece.to, piece.segment, known.flute_mm.upper);
  record_.take_flute(beside, b, piece.to.nc_line);
}

// Where the tool may be tilted on purpose its flute has that much more.
void CutJudge::take_flute_in_cone(const Piece& piece) const {
  const Target& a = path_.points()[piece.segment];
  const Target& b = path_.points()[piece.segment + 1];
  if (b.flute_mm == 0.0) return;
  DeviationMeter::Beside known;
  known.axis_rad.upper = kPi;  // not asked for
  known.flute_mm.upper = record_.known_in_cone_mm(b.flute_mm);
  auto beside = meter_.beside(piece.from, piece.to, a, b, piece.t0, piece.t1, program_, known);
  const double limit_mm = record_.cone_limit_mm(b.flute_mm);
  if (beside.flute_mm.upper > limit_mm)
    beside.flute_mm = FluteAbout(meter_, path_, program_, limit_mm, true)
                          .of(piece.from, piece.to, piece.segment, known.flute_mm.upper);
  record_.take_flute(beside, b, piece.to.nc_line, true);
}

bool CutJudge::mark_nearer(const CutBlock& block, const Target& target) const {
  const double near_mm = near_point_mm(path_, record_.of_block);
  const double before = path_.distance_to(block.from, target);
  const double after = path_.distance_to(block.to, target);
  if (std::min(before, after) > near_mm) return false;
  if (before < after) record_.mark_programmed();
  return after <= before;
}

double near_point_mm(const PathFollower& path, const CutRecord::Block& block) {
  constexpr double kAlong = 3.0;  // along the path a deviation may be larger than across it
  if (path.limits().on_truth) return path.hit_tolerance_mm();
  return kSamePoint_mm + kAlong * std::hypot(block.tip_mm, kAxisWeight_mm * block.axis_rad);
}

}  // namespace trunnion::post
