#include "path/insertion/run_refiner.hpp"

#include <algorithm>
#include <cmath>

#include "path/bounds/expansion.hpp"

namespace trunnion::path {
namespace {

// Programmed points that one piece may span when points are dropped: what is checked grows with its square.
constexpr std::size_t kLongestSpan = 64;
// Of the tip's tolerance: whoever judges the piece may cut it a little elsewhere than at the feet found here.
constexpr double kSpanShare = 0.99;
// Rounds in which a segment that does not converge between moved points gets its points back.
constexpr int kRounds = 8;

Vec3 aimed_axis(const Point& p, const ToolOff& move) {
  return move.axis_P.isZero(0.0) ? p.axis_P : Vec3((p.axis_P + move.axis_P).normalized());
}

}  // namespace

SegmentEnds RunRefiner::ends(std::span<const Point> run, std::size_t i) const {
  const bool moved = !moves_.empty() && !(moves_[i].is_zero() && moves_[i + 1].is_zero());
  return {&run[i], &run[i + 1], &stations_[i], &stations_[i + 1], moved};
}

void RunRefiner::refine(std::span<const Point> run, const Tolerance& tolerance, std::vector<Point>& out,
                        std::vector<SegmentReport>& reports) {
  if (run.empty()) return;
  stations_.clear();
  moves_.clear();
  for (const Point& p : run) stations_.push_back(station(segment_.kinematics(), p.q));
  const bool moves = options_.move_programmed_points && options_.method == Method::adaptive;
  if (moves) move_points(run, tolerance);

  out.push_back(run.front());
  std::size_t i = 0;
  while (i + 1 < run.size()) {
    const std::size_t last = options_.thin ? reach(run, i, tolerance) : i + 1;
    if (last > i + 1) {
      reports.insert(reports.end(), dropped_.begin(), dropped_.end());
    } else {
      SegmentReport report = segment_.refine(ends(run, i), tolerance, out);
      if (moves) {
        report.predicted_mm = before_[i].predicted_mm;
        report.midpoint_mm = before_[i].midpoint_mm;
        report.programmed_mm = before_[i].programmed_mm;
        report.harmonic_fails = before_[i].harmonic_fails;
      }
      reports.push_back(report);
    }
    i = last;
    out.push_back(run[i]);
    out.back().q = stations_[i].q;
    if (!moves) continue;
    out.back().beside_P = moves_[i].tip_P;
    out.back().axis_P = aimed_axis(run[i], moves_[i]);
  }
}

// Displaces programmed points against the bow of the segments that meet there, by at most the tolerance,
// where that saves points.
void RunRefiner::move_points(std::span<const Point> run, const Tolerance& tolerance) {
  plan_moves(run, tolerance);
  for (std::size_t i = 1; i + 1 < run.size(); ++i) place(run, i);
  keep_neighbours(run, tolerance);
}

void RunRefiner::place(std::span<const Point> run, std::size_t i) {
  if (moves_[i].is_zero()) {
    stations_[i] = station(segment_.kinematics(), run[i].q);
    return;
  }
  JointVector q = run[i].q;
  if (!moves_[i].axis_P.isZero(0.0)) segment_.maker().turn_to(aimed_axis(run[i], moves_[i]), q);
  round_to_words(segment_.kinematics(), rounding_, run[i].tip_P + moves_[i].tip_P, q);
  stations_[i] = station(segment_.kinematics(), q);
}

void RunRefiner::plan_moves(std::span<const Point> run, const Tolerance& tolerance) {
  moves_.assign(run.size(), {});
  before_.clear();
  needs_.clear();
  for (std::size_t i = 0; i + 1 < run.size(); ++i) {
    const SegmentEnds programmed = ends(run, i);
    before_.push_back(segment_.measure(programmed, tolerance));
    Need need;
    if (before_.back().programmed_mm > 0.25 * tolerance.tip_mm) {
      const Spacing& spacing = segment_.spacing_of(programmed, tolerance);
      need.length = spacing.total();
      need.against0 = spacing.against(0.0);
      need.against1 = spacing.against(1.0);
      const bool short_of_points = !before_.back().converged && spacing.tip_leads();
      if (short_of_points) need.share = Spacing::free_end_share(need.length);
    }
    needs_.push_back(need);
  }
  // The word error of the moved point stays inside the tolerance.
  const Tube tube = segment_.tube(tolerance);
  for (std::size_t k = 1; k + 1 < run.size(); ++k) {
    const Need& left = needs_[k - 1];
    const Need& right = needs_[k];
    ToolOff direction = left.share * left.against1 + right.share * right.against0;
    const double size = std::max(left.share, right.share);
    // Bows to opposite sides: the one that gains more.
    if (left.share > 0.0 && right.share > 0.0 && tube.along(left.against1, right.against0) < 0.0) {
      direction = left.share > right.share ? left.against1 : right.against0;
    }
    const double length = tube.size_mm(direction);
    if (size > 0.0 && length > 0.0) moves_[k] = (size * tube.tip_mm) * (direction / length);
  }
  // A neighbour that needs no point must not come to need one.
  for (std::size_t i = 0; i + 1 < run.size(); ++i) {
    const Need& need = needs_[i];
    if (!before_[i].converged) continue;
    const double x0 = tube.along(moves_[i], need.against0) / tube.tip_mm;
    const double x1 = tube.along(moves_[i + 1], need.against1) / tube.tip_mm;
    if (Spacing::one_piece_covers(need.length, x0, x1)) continue;
    (x0 < x1 ? moves_[i] : moves_[i + 1]) = {};
  }
}

void RunRefiner::keep_neighbours(std::span<const Point> run, const Tolerance& tolerance) {
  std::vector<Point> scratch;
  for (int round = 0; round < kRounds; ++round) {
    bool all = true;
    for (std::size_t i = 0; i + 1 < run.size(); ++i) {
      const SegmentEnds at = ends(run, i);
      if (!at.moved) continue;
      scratch.clear();
      if (segment_.refine(at, tolerance, scratch).converged) continue;
      all = false;
      moves_[i] = {};
      moves_[i + 1] = {};
      place(run, i);
      place(run, i + 1);
    }
    if (all) return;
  }
  moves_.assign(run.size(), {});
  for (std::size_t i = 0; i < run.size(); ++i) place(run, i);
}

// The farthest programmed point to which one piece from `first` keeps within the tolerance of all segments
// that it spans.
std::size_t RunRefiner::reach(std::span<const Point> run, std::size_t first, const Tolerance& tolerance) {
  std::size_t last = first + 1;
  const std::size_t limit = std::min(run.size() - 1, first + kLongestSpan);
  std::vector<SegmentReport> reports;
  while (last < limit && one_piece(run, first, last + 1, tolerance)) {
    reports.swap(dropped_);
    ++last;
  }
  reports.swap(dropped_);
  return last;
}

// The piece from `first` to `last`, cut where it passes the programmed points between: each part is certified
// against its own segment, so that the tip passes every programmed point within the tolerance too.
bool RunRefiner::one_piece(std::span<const Point> run, std::size_t first, std::size_t last,
                           const Tolerance& tolerance) {
  const TableKinematics& kinematics = segment_.kinematics();
  const JointVector& q0 = stations_[first].q;
  const JointVector& q1 = stations_[last].q;
  // An axis that rolls over takes the shorter way.
  for (std::size_t k = 0; k < kinematics.rotary_count(); ++k) {
    if (!(std::abs(q1[kinematics.rotary(k)] - q0[kinematics.rotary(k)]) < kPi)) return false;
  }
  const Tolerance within{kSpanShare * tolerance.tip_mm,
                         tolerance.axis,
                         {tolerance.flute.length_mm, kSpanShare * tolerance.flute.off_mm}};
  double whole = 0.0;
  for (std::size_t k = first; k < last; ++k) whole += (run[k + 1].tip_P - run[k].tip_P).norm();
  dropped_.clear();
  Station from = stations_[first];
  double passed = 0.0;
  double s_before = 0.0;
  for (std::size_t k = first; k < last; ++k) {
    passed += (run[k + 1].tip_P - run[k].tip_P).norm();
    Station to = stations_[last];
    if (k + 1 < last) {
      // Where the piece passes the point: a guess by length, then Newton on the foot.
      double s = whole > 0.0 ? passed / whole
                             : static_cast<double>(k + 1 - first) / static_cast<double>(last - first);
      for (int i = 0; i < 2; ++i) {
        to = station(kinematics, JointVector::interpolate(q0, q1, s));
        const Vec3 slope = tip_slope(kinematics, to, q0, q1);
        const ToolOff left{run[k + 1].tip_P - to.tip_P, run[k + 1].axis_P - to.axis_P};
        double slope2 = slope.squaredNorm();
        double ahead = left.tip_P.dot(slope);
        if (within.flute.length_mm > 0.0) {
          const Vec3 end_slope = slope + within.flute.length_mm * axis_slope(kinematics, to, q0, q1);
          slope2 += end_slope.squaredNorm();
          ahead += left.at(within.flute.length_mm).dot(end_slope);
        }
        if (slope2 > 0.0) s = std::clamp(s + ahead / slope2, s_before, 1.0);
      }
      to = station(kinematics, JointVector::interpolate(q0, q1, s));
      s_before = s;
      const ToolOff off{to.tip_P - run[k + 1].tip_P, to.axis_P - run[k + 1].axis_P};
      if (off.largest_mm(within.flute.length_mm) > within.tip_mm) return false;
    }
    segment_.start({&run[k], &run[k + 1], &from, &to, true}, within);
    if (!segment_.judge().within(from, to)) return false;
    dropped_.push_back(segment_.span_report(stations_[k], stations_[k + 1], from, to));
    from = to;
  }
  return true;
}

}  // namespace trunnion::path
