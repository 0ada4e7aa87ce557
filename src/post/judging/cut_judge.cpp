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
  if (quiet.axis_at_tip > known.axis_at_tip)
    take_beside({block.from, block.to, segment, path_.at().t, block.place.t});
  return true;
}

// The same cuts as QuietTest makes, with the tool's curve on each side of them. Beyond the tolerance, where a
// flute counts at neighbouring segments too, its own cuts tell.
bool CutJudge::keeps_tool(const QuietBlock& quiet, const CutBlock& block, const KnownFigures& known) const {
  constexpr std::size_t kMostCuts = 2;
  const PathPoints& points = path_.points();
  const std::size_t first = path_.at().segment;
  const std::size_t last = block.place.segment;
  if (last - first > kMostCuts) return false;
  const double tolerance_mm = record_.report.tolerance_mm;
  const bool looks_about = !quiet.flute_keeps && known.flute_limit_mm > tolerance_mm;
  const auto keeps = [&](const Piece& piece) {
    const Target& a = points[piece.segment];
    const Target& b = points[piece.segment + 1];
    return (quiet.tip_keeps || meter_.keeps_tip(piece.from, piece.to, a, b, known.tip_mm)) &&
           (quiet.flute_keeps || looks_about ||
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
  return keeps({*from, block.to, last, t0, block.place.t}) &&
         (!looks_about || FluteAbout(meter_, path_, program_, tolerance_mm, false)
                              .keeps_between_corners(block.from, block.to, last, known.flute_limit_mm));
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
    record_.take_deviation(meter_.of(*from, to, {a, b}, program_, known), PathFollower::near_pole(a, b));
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
  judge_end(block);
  return passed_point;
}

// How far the path's axis turns where its tip is within the tolerance of a place of the segment, at most,
// rad: on the segment, and on those before or behind it.
double CutJudge::turn_about(std::size_t segment) const {
  const PathPoints& points = path_.points();
  const double near_mm = path_.limits().tolerance_mm + kSamePoint_mm;
  const auto turn_on = [&](std::size_t point, double& left_mm) {
    const double way_mm = points[point].way_mm;
    const double share = way_mm > left_mm ? left_mm / way_mm : 1.0;
    left_mm -= way_mm;
    return share * points[point].turn;
  };
  const auto ahead = [&](std::size_t point) {
    double left_mm = near_mm;
    double turn = 0.0;
    for (; point < points.size() && left_mm > 0.0; ++point) turn += turn_on(point, left_mm);
    return turn;
  };
  const auto back = [&](std::size_t point) {
    double left_mm = near_mm;
    double turn = 0.0;
    for (; point > 0 && left_mm > 0.0; --point) turn += turn_on(point, left_mm);
    return turn;
  };
  // From within the segment, and from its ends.
  return std::max({ahead(segment + 1), ahead(segment + 2), back(segment + 1), back(segment)});
}

// A tool that lags or leads on the great circle of its path keeps that circle; where its tip is, it points
// elsewhere. At the end of a block, which words of the program command, there has to be one place of the
// path that both tip and axis are near. A figure within the tolerance is not taken: blocks that are proved
// at once do not have it either.
void CutJudge::judge_end(const CutBlock& block) const {
  const PathPoints& points = path_.points();
  const std::size_t j = block.place.segment;
  const Target& a = points[j];
  const Target& b = points[j + 1];
  const bool near_pole = PathFollower::near_pole(a, b);
  // Moved points of the straight course lead the path by a little between CL points; at one, none does.
  constexpr double kBetweenPoints = 2.0;
  const double to_point_mm = std::min((block.to.tip_P - a.tip_P).norm(), (block.to.tip_P - b.tip_P).norm());
  const double tolerance =
      path_.limits().axis_tolerance_rad + (near_pole ? path_.limits().pole_tolerance_rad : 0.0);
  const double allowed = tolerance * (to_point_mm < kSamePoint_mm ? 1.0 : kBetweenPoints);
  const Vec3 way = b.tip_P - a.tip_P;
  const double way2 = way.squaredNorm();
  const double t = way2 > 0.0 ? std::clamp(way.dot(block.to.tip_P - a.tip_P) / way2, 0.0, 1.0) : 0.0;
  const double off = turn_between(block.to.axis_P,
                                  path::FluteSegment({a.tip_P, b.tip_P, a.axis_P, b.axis_P}, 0.0).axis_P(t));
  if (off <= allowed) return;
  const double turn = turn_about(j);
  if (off - turn > allowed) record_.take_end_axis(off - turn, near_pole);
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
  auto beside = meter_.beside({piece.from, piece.to, piece.t0, piece.t1}, a, b, program_, known);
  report.max_axis_deviation_at_tip =
      std::max(report.max_axis_deviation_at_tip, Angle::radians(beside.axis_rad.upper));
  if (beside.flute_mm.upper > report.tolerance_mm)
    beside.flute_mm = FluteAbout(meter_, path_, program_, report.tolerance_mm, false)
                          .of(piece.from, piece.to, piece.segment, known.flute_mm.upper);
  record_.take_flute(beside, b, piece.to.nc_line);
  record_flute(piece, {beside, known.flute_mm.upper, report.tolerance_mm, false});
}

// A figure that is no larger than what is known is not worked out above.
void CutJudge::record_flute(const Piece& piece, const FluteFound& found) const {
  const Target& a = path_.points()[piece.segment];
  const Target& b = path_.points()[piece.segment + 1];
  if (!record_.collect || b.flute_mm == 0.0) return;
  double flute_mm = found.beside.flute_mm.upper;
  if (!(flute_mm > found.known_mm)) {
    DeviationMeter::Beside known;
    known.axis_rad.upper = kPi;  // not asked for
    flute_mm =
        meter_.beside({piece.from, piece.to, piece.t0, piece.t1}, a, b, program_, known).flute_mm.upper;
    if (flute_mm > found.limit_mm)
      flute_mm = FluteAbout(meter_, path_, program_, found.limit_mm, found.in_cone)
                     .of(piece.from, piece.to, piece.segment, 0.0)
                     .upper;
    flute_mm = std::min(flute_mm, found.known_mm);
  }
  record_.of_block.flute_seen_mm = std::max(record_.of_block.flute_seen_mm, flute_mm);
}

// Where the tool may be tilted on purpose its flute has that much more.
void CutJudge::take_flute_in_cone(const Piece& piece) const {
  const Target& a = path_.points()[piece.segment];
  const Target& b = path_.points()[piece.segment + 1];
  if (b.flute_mm == 0.0) return;
  DeviationMeter::Beside known;
  known.axis_rad.upper = kPi;  // not asked for
  known.flute_mm.upper = record_.known_in_cone_mm(b.flute_mm);
  auto beside = meter_.beside({piece.from, piece.to, piece.t0, piece.t1}, a, b, program_, known);
  const double limit_mm = record_.cone_limit_mm(b.flute_mm);
  if (beside.flute_mm.upper > limit_mm)
    beside.flute_mm = FluteAbout(meter_, path_, program_, limit_mm, true)
                          .of(piece.from, piece.to, piece.segment, known.flute_mm.upper);
  record_.take_flute(beside, b, piece.to.nc_line, true);
  record_flute(piece, {beside, known.flute_mm.upper, limit_mm, true});
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
