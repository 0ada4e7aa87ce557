#include "post/judging/quiet_run.hpp"

#include <algorithm>
#include <type_traits>

#include "post/judging/tool_beside.hpp"

namespace trunnion::post {

// About which CL point each of the blocks ends.
template <class T>
struct QuietRun::Corners {
  static constexpr std::size_t kTogether = lanes::kCount<T>;
  std::array<std::size_t, kTogether> row{};
  bool in_a_row = true;
  bool from_next = true;  // in a row from the one on that comes next

  // Guessed from how far the tool goes.
  Corners(const QuietRun& path, const T& way_mm, const Place& at) {
    const std::size_t next = at.segment + 2;
    std::size_t j = next;
    double along_mm = path.points_->along_mm[j - 1] + at.t * path.points_->way_mm[j];
    for (std::size_t k = 0; k < kTogether; ++k) {
      along_mm += way_mm[static_cast<int>(k)];
      while (j + 3 < path.points_->rows() && along_mm > path.points_->passed_mm[j]) ++j;
      row[k] = j;
      in_a_row = in_a_row && j == row[0] + k;
    }
    from_next = in_a_row && row[0] == next;
  }
  // Of the CL point as many before it or behind it.
  T load(const Column& column, int by) const {
    const auto at = [&](std::size_t k) -> const double* { return column.data() + row[k] + by; };
    if (in_a_row) return lanes::load<T>(at(0));
    return lanes::collect<T>([&](std::size_t k) { return *at(k); });
  }
  lanes::Triple<T> load(const std::array<Column, 3>& columns, int by) const {
    return {load(columns[0], by), load(columns[1], by), load(columns[2], by)};
  }
  T index() const {
    return lanes::collect<T>([&](std::size_t k) { return static_cast<double>(row[k]); });
  }
  lanes::Mask<T> plain(const QuietRun& path) const { return load(path.points_->special, -2) == 0.0; }
};

// The ends of the blocks beside these CL points.
template <class T>
struct QuietRun::AtCorner {
  lanes::Triple<T> tip_P, axis_P;
  lanes::Triple<T> to;    // to the end
  T before_mm;            // of the way to the CL point
  T off2_mm2, off2_axis;  // squared
  lanes::Mask<T> is_end;  // as find_near says it of the next CL point

  AtCorner(const QuietRun& path, const Corners<T>& corner, const Chords<T>& block)
      : tip_P(corner.load(path.points_->tip_P, 0)),
        axis_P(corner.load(path.points_->axis_P, 0)),
        to(block.to - tip_P),
        before_mm(corner.load(path.points_->way_mm, 0)),
        off2_mm2(length2(to)),
        off2_axis(length2(block.to_axis - axis_P)) {
    constexpr double kTurned_mm = 0.5 * kPi * kAxisWeight_mm;
    is_end = off2_mm2 + kTurned_mm * kTurned_mm * off2_axis < kSamePoint2;
    if (path.limits_.on_truth) {
      const double tolerance = path.limits_.axis_tolerance_rad;
      is_end |= (before_mm >= kTellsPoints * kSamePoint_mm) &
                (0.25 * kPi * kPi * off2_axis <= tolerance * tolerance);
    }
    is_end &= off2_mm2 < kSamePoint2;
  }
};

// Where the blocks end about these CL points, whichever place they began at.
template <class T>
struct QuietRun::Ends {
  lanes::Triple<T> tip1_P;    // of the CL point before the corner
  lanes::Triple<T> to1;       // to the end from there
  lanes::Triple<T> before;    // the way from there
  T behind_mm;                // of the way behind the corner
  T off2_1, off2_3;           // of the ends from the CL points before it and behind it
  T t0, off0_mm;              // on the way to it, where no fraction is excluded
  lanes::Mask<T> behind;      // the end is beyond the corner
  lanes::Mask<T> still;       // still_on, where the block began on the way to it
  lanes::Mask<T> only_still;  // beyond the corner, were it not for that
  lanes::Mask<T> plain;
  T t, distance2, off2_mm2, off2_axis;  // as in Place

  Ends(const QuietRun& path, const Corners<T>& corner, const Chords<T>& block, const AtCorner<T>& beside)
      : tip1_P(corner.load(path.points_->tip_P, -1)),
        to1(block.to - tip1_P),
        before(beside.tip_P - tip1_P),
        behind_mm(corner.load(path.points_->way_mm, 1)),
        off2_1(length2(to1)) {
    const lanes::Triple<T> tip3_P = corner.load(path.points_->tip_P, 1);
    const lanes::Triple<T> way_behind = tip3_P - beside.tip_P;
    off2_3 = length2(block.to - tip3_P);
    t0 = clamped<T>(inner(to1, before) / length2(before), T{});
    const T t1 = clamped<T>(inner(beside.to, way_behind) / length2(way_behind), T{});
    const T off2_0 = length2(to1 - t0 * before);
    const T off2_1st = length2(beside.to - t1 * way_behind);
    off0_mm = lanes::sqrt(off2_0);
    const lanes::Triple<T> axis1_P = corner.load(path.points_->axis_P, -1);
    const lanes::Triple<T> axis3_P = corner.load(path.points_->axis_P, 1);
    // The tip alone is no nearer than the tool: where it is farther off behind the corner, nothing else is
    // looked at.
    lanes::Mask<T> may_be_behind = off2_1st <= (off0_mm + kNearer_mm) * (off0_mm + kNearer_mm);
    still = (t0 < 1.0) & (off0_mm <= path.limits_.tolerance_mm);
    lanes::Mask<T> doubtful{};
    if (lanes::any(still))
      doubtful = still & ~keeps_axis(path.limits_, block.to_axis, axis1_P, beside.axis_P);
    only_still = still & may_be_behind;
    may_be_behind &= ~still;
    const auto of_either = [&](const lanes::Mask<T>& mask, const auto& beyond, const auto& on_way) {
      if constexpr (std::is_same_v<std::decay_t<decltype(beyond)>, T>) {
        return T(lanes::select(mask, beyond, on_way));
      } else {
        return chosen(mask, beyond, on_way);
      }
    };
    t = of_either(may_be_behind, t1, t0);
    off2_mm2 = of_either(may_be_behind, off2_1st, off2_0);
    const Placed<T> there(path.limits_, block.to_axis, of_either(may_be_behind, beside.axis_P, axis1_P),
                          of_either(may_be_behind, axis3_P, beside.axis_P), t, off2_mm2);
    const T nearer_mm = off0_mm - kNearer_mm;
    behind = may_be_behind & (nearer_mm > 0.0) & (there.distance2 < nearer_mm * nearer_mm);
    distance2 = there.distance2;
    off2_axis = there.off2_axis;
    plain = there.plain;
    const lanes::Mask<T> either = may_be_behind & ~behind;
    if (lanes::any(either)) {
      const Placed<T> here(path.limits_, block.to_axis, axis1_P, beside.axis_P, t0, off2_0);
      behind |= either & (lanes::sqrt(there.distance2) < lanes::sqrt(here.distance2) - kNearer_mm);
      const lanes::Mask<T> on_way = may_be_behind & ~behind;
      t = of_either(on_way, t0, t);
      off2_mm2 = of_either(on_way, off2_0, off2_mm2);
      distance2 = of_either(on_way, here.distance2, distance2);
      off2_axis = of_either(on_way, here.off2_axis, off2_axis);
      plain &= ~either | here.plain;
    }
    plain &= ~doubtful;
    behind &= ~beside.is_end;
    const T one = lanes::splat<T>(1.0);
    t = of_either(beside.is_end, one, t);
    off2_mm2 = of_either(beside.is_end, beside.off2_mm2, off2_mm2);
    off2_axis = of_either(beside.is_end, beside.off2_axis, off2_axis);
    plain |= beside.is_end;
    plain &= corner.plain(path) & (beside.is_end | (beside.off2_mm2 > kSamePoint2)) & (off2_3 > kSamePoint2) &
             ~(behind & (t >= 1.0));
  }
};

// Where the blocks begin, and whether the places that were found are those of find_near from there.
template <class T>
struct QuietRun::Begins {
  T t, off_axis;
  lanes::Mask<T> passes;  // the corner is the one behind the next CL point
  lanes::Mask<T> found;

  Begins(const QuietRun& path, const Corners<T>& corner, const Chords<T>& block, const AtCorner<T>& beside,
         const Ends<T>& end, const Place& at) {
    const FollowLimits& limits = path.limits_;
    const auto hit = end.t >= 1.0;
    const T index = corner.index();
    const T segment = index - lanes::select(end.behind | hit, T{}, lanes::splat<T>(1.0));
    const T next = index - shifted(static_cast<double>(at.segment + 1), segment);  // 1, or 2
    t = shifted(at.t, lanes::select(hit, T{}, end.t));
    const lanes::Mask<T> goes_to = next == 1.0;
    passes = next == 2.0;
    const T reach_mm = reach_of(block.way_mm, limits.tolerance_mm);
    const T rest_mm = (1.0 - t) * beside.before_mm;
    const auto to_corner = (rest_mm <= reach_mm) & (rest_mm + end.behind_mm > reach_mm);
    // The sum of both axes' distances is below this: its square is at most twice that of the squares.
    const double turned = 3.0 * limits.axis_tolerance_rad;
    const T before_axis2 = shifted(at.off_axis * at.off_axis, end.off2_axis);
    const auto turns_little = 2.000001 * (beside.off2_axis + before_axis2) < turned * turned;
    const lanes::Mask<T> beside_next = ~(end.off2_3 < beside.off2_mm2) & to_corner & turns_little;
    found = goes_to & (beside.is_end |
                       ((end.t0 >= t) & (end.still | beside_next | ((rest_mm > reach_mm) & ~end.behind))));
    lanes::Triple<T> next_P = beside.tip_P;
    if (lanes::any(passes)) {
      found |= passes & ~beside.is_end & is_behind_next(path, corner, block, beside, end, reach_mm);
      next_P = chosen(passes, end.tip1_P, next_P);
    }
    found &= end.plain & (length2(block.from - next_P) > kSamePoint2) & ~block.may_leave();
  }

  lanes::Mask<T> is_behind_next(const QuietRun& path, const Corners<T>& corner, const Chords<T>& block,
                                const AtCorner<T>& beside, const Ends<T>& end, const T& reach_mm) const {
    const FollowLimits& limits = path.limits_;
    const lanes::Triple<T> tip0_P = corner.load(path.points_->tip_P, -2);
    const lanes::Triple<T> way = end.tip1_P - tip0_P;
    const lanes::Triple<T> to = block.to - tip0_P;
    const T foot = inner(to, way) / length2(way);
    const T off_mm = length(to - lanes::larger<T>(clamped<T>(foot, T{}), t) * way);
    const auto still = (foot < 1.0) & (off_mm <= limits.tolerance_mm);
    const T rest_mm = (1.0 - t) * corner.load(path.points_->way_mm, -1);
    const T ahead_mm = rest_mm + beside.before_mm;
    const T rest_rad = (1.0 - t) * corner.load(path.points_->turn, -1);
    const T ahead_rad = rest_rad + corner.load(path.points_->turn, 0);
    const T chord2 = length2(block.to_axis - block.from_axis);
    const T reach_rad = reach_of(turn_of_chord(chord2), limits.axis_tolerance_rad);
    const T nearer_mm = off_mm - 2.0 * kNearer_mm;
    const auto to_second = (ahead_mm <= reach_mm) & (ahead_mm + end.behind_mm > reach_mm) &
                           (beside.off2_mm2 < end.off2_1) & (ahead_rad <= reach_rad);
    // Beside the first, where the second is out of reach.
    const auto to_first =
        (rest_mm <= reach_mm) & (ahead_mm > reach_mm) & ~end.behind & (rest_rad <= reach_rad);
    return (to_second | to_first) & ~still & ~end.only_still & (end.off2_1 > kSamePoint2) &
           (chord2 < kSmallChord2) & (nearer_mm > 0.0) & (end.distance2 < nearer_mm * nearer_mm);
  }
};

QuietRun::Found QuietRun::advance(const PathPoints& points, const path::PoseRun& poses, std::size_t row,
                                  std::size_t end, const KnownFigures& known, double most_off_mm, Place& at) {
  points_ = &points;
  Found found;
  found.point_off_mm = most_off_mm;
  lanes::at_a_time(way_, [&]<class T>() {
    std::size_t taken = lanes::kCount<T>;
    while (taken == lanes::kCount<T> && row < end && knows(points, at)) {
      taken = std::min(taken, end - row);  // at most
      advance_few<T>(poses, row, known, at, found, taken);
      row += taken;
      found.count += taken;
    }
  });
  return found;
}

// The ends of the blocks that are quiet, of those that are looked at together.
template <class T>
struct QuietRun::Judged {
  const Corners<T>& corner;
  T off_mm, off_axis;  // as in Place
  T axis;              // by which the tool axis leaves its course at most
  T axis_at_tip;       // that of the path where the tip is
  lanes::Mask<T> quiet;

  // CL points between two others, which blocks pass at these fractions of their chords.
  struct Passed {
    lanes::Triple<T> before_P, tip_P, behind_P;
    T t;
  };

  // As is_quiet; `off2_mm2` and `off2_axis` of the ends.
  Judged(const path::PoseRun& poses, std::size_t row, const KnownFigures& known, const Place& at,
         const Corners<T>& corners, const T& off2_mm2, const T& off2_axis)
      : corner(corners),
        off_mm(lanes::sqrt(off2_mm2)),
        off_axis(lanes::sqrt(off2_axis)),
        axis(lanes::larger<T>(shifted(at.off_axis, off_axis), off_axis)),
        bow_mm_(lanes::load<T>(&poses.bow_mm[row])),
        bow_axis_(lanes::load<T>(&poses.bow_axis[row])),
        known_(known),
        poses_(poses),
        row_(row) {
    most_mm_ = lanes::larger<T>(shifted(at.off_tip_mm, off_mm), off_mm);
    left_mm_ = known.tip_mm - bow_mm_;
    quiet = most_mm_ <= left_mm_;
    ends_keep_mm_ = known.tip_mm - lanes::load<T>(&poses.rest_mm[row]);
    ends_keep_ = most_mm_ <= ends_keep_mm_;
  }
  // Blocks `beside` one segment of the path, from tip0_P to tip1_P: the parabola of the tip lies between its
  // ends, its middle and where the tangents of these meet half way, and what lies between points is no
  // farther from a segment than they are.
  void look_at_curve(const Chords<T>& block, const lanes::Triple<T>& tip0_P, const lanes::Triple<T>& tip1_P,
                     const lanes::Mask<T>& beside) {
    const lanes::Mask<T> asked = beside & ends_keep_ & ~quiet;
    if (!lanes::any(asked)) return;
    const Segment segment(tip0_P, tip1_P);
    const lanes::Triple<T> middle = 0.5 * (block.from + block.to) + sag();
    const lanes::Triple<T> quarter = 0.25 * block.way;
    quiet |=
        asked & keeps(segment, middle - quarter) & keeps(segment, middle) & keeps(segment, middle + quarter);
  }
  // The same beside two segments of the path, for blocks that pass the CL point between these, and no other:
  // the parabola is cut where the chord has its foot.
  template <class PointOf>
  void look_at_pieces(const Chords<T>& block, const lanes::Mask<T>& passed, double most_off_mm,
                      const PointOf& point_of) {
    const lanes::Mask<T> asked = passed & ends_keep_ & ~quiet;
    if (!lanes::any(asked)) return;
    const Passed point = point_of();
    const T& t = point.t;
    const lanes::Triple<T> sag = this->sag();
    const lanes::Triple<T> to_tangents = 0.5 * block.way + 2.0 * sag;  // to where those of the ends meet
    const lanes::Triple<T> before = block.from + t * to_tangents;
    const lanes::Triple<T> cut = block.from + t * block.way + T(4.0 * t * (1.0 - t)) * sag;
    const lanes::Triple<T> behind = before + t * (block.way - to_tangents) + T(1.0 - t) * to_tangents;
    const T point_mm = ends_keep_mm_ + lanes::splat<T>(most_off_mm - known_.tip_mm);
    const Segment to_it(point.before_P, point.tip_P);
    const Segment from_it(point.tip_P, point.behind_P);
    quiet |= asked & (point_mm >= 0.0) & (length2(cut - point.tip_P) <= point_mm * point_mm) &
             keeps(to_it, before) & keeps(to_it, cut) & keeps(from_it, cut) & keeps(from_it, behind);
  }
  // CL points that are passed on the way.
  void pass(const lanes::Mask<T>& passed, const PassedAt<T>& point, double most_off_mm) {
    const T all_mm = lanes::splat<T>(most_off_mm) - bow_mm_;
    const T left_mm = lanes::select(all_mm < left_mm_, all_mm, left_mm_);
    quiet &= ~passed | ((left_mm >= 0.0) & (point.off2_mm2 <= left_mm * left_mm));
    axis = lanes::select(passed, lanes::larger<T>(axis, lanes::sqrt(point.off2_axis)), axis);
    if (known_.flute_mm > 0.0)
      most_mm_ = lanes::select(passed, lanes::larger<T>(most_mm_, lanes::sqrt(point.off2_mm2)), most_mm_);
  }
  // Of the tool axis, and of the tool up to its flute length. `sharper`, where norms are too much: bounds of
  // both from the places of the tip, and from those of the whole tool (`nearest`). An axis is no farther from
  // its arc than from any place of it; where it is not below what the report has of it at the tip's place
  // already, that figure is worked out elsewhere.
  template <class Sharper>
  void end_tool(const Chords<T>& block, const Sharper& sharper) {
    const T chord2 = length2(block.to_axis - block.from_axis);
    const T more = path_bow<T>(chord2, axis);
    axis = axis * arc_beyond_chord(chord2) + bow_axis_;
    axis_at_tip = axis + more;
    const bool has_flute = known_.flute_mm > 0.0;
    lanes::Mask<T> axis_keeps = axis <= known_.axis_limit;
    lanes::Mask<T> keeps = ~lanes::Mask<T>{};
    if (has_flute) keeps = most_mm_ + bow_mm_ + known_.flute_mm * axis_at_tip <= known_.flute_limit_mm;
    if (lanes::any(lanes::Mask<T>(quiet & ~(keeps & axis_keeps)))) {
      const OffBeside<T> by_tip = sharper(false);
      if (has_flute) keeps |= by_tip.mm <= known_.flute_limit_mm;
      const lanes::Mask<T> below =
          ~axis_keeps & (by_tip.axis <= known_.axis) & (by_tip.axis + more <= known_.axis_at_tip);
      axis = lanes::select(below, by_tip.axis, axis);
      axis_at_tip = lanes::select(below, T(by_tip.axis + more), axis_at_tip);
      axis_keeps |= below;
      if (lanes::any(lanes::Mask<T>(quiet & axis_keeps & ~keeps)))
        keeps |= sharper(true).mm <= known_.flute_limit_mm;
    }
    quiet &= axis_keeps & keeps;
  }
  // Goes on over those that are quiet, `taken` at most, then so many. `t`, `behind`: of the ends.
  void take(const T& t, const lanes::Mask<T>& behind, Place& at, Found& found, std::size_t& taken) const {
    const std::size_t most = taken;
    const lanes::Mask<T> hits = t >= 1.0;
    const T off_point_mm = lanes::select(hits, off_mm, T{});
    const bool all = most == lanes::kCount<T> && !lanes::any(lanes::Mask<T>(~quiet));
    std::size_t count = 0;
    for (; count < most && (all || quiet[static_cast<int>(count)] != 0); ++count) {
      const int k = static_cast<int>(count);
      found.axis = std::max(found.axis, axis[k]);
      found.axis_at_tip = std::max(found.axis_at_tip, axis_at_tip[k]);
      found.point_off_mm = std::max(found.point_off_mm, off_point_mm[k]);
    }
    taken = count;
    if (count == 0) return;
    const int k = static_cast<int>(count - 1);
    const std::size_t corner_at = corner.row[count - 1] - 1;
    const bool hit = hits[k] != 0;
    at.segment = hit || behind[k] != 0 ? corner_at : corner_at - 1;
    at.t = hit ? 0.0 : t[k];
    at.off_tip_mm = off_mm[k];
    at.off_axis = off_axis[k];
  }

 private:
  struct Segment {
    lanes::Triple<T> from_P, way;
    T per_length2;
    Segment(const lanes::Triple<T>& from, const lanes::Triple<T>& to)
        : from_P(from), way(to - from), per_length2(1.0 / length2(way)) {}
  };
  lanes::Triple<T> sag() const { return lanes::load_vectors<T>(poses_.sag_mm, row_); }
  // Within what the ends have to be.
  lanes::Mask<T> keeps(const Segment& segment, const lanes::Triple<T>& p_P) const {
    const lanes::Triple<T> to = p_P - segment.from_P;
    const T t = clamped<T>(inner(to, segment.way) * segment.per_length2, T{});
    return length2(to - t * segment.way) <= ends_keep_mm_ * ends_keep_mm_;
  }

  T bow_mm_, bow_axis_, left_mm_, ends_keep_mm_, most_mm_;
  lanes::Mask<T> ends_keep_;
  const KnownFigures& known_;
  const path::PoseRun& poses_;
  std::size_t row_;
};

// The blocks, and the places at which they begin and end.
template <class T>
struct QuietRun::Course {
  const Chords<T>& block;
  const Corners<T>& corner;
  const Begins<T>& begin;
  const Ends<T>& end;
};

// By how much the whole tool is off the path: on the way to the next CL point, from there to the corner, and
// beyond that, as far as the blocks go.
template <class T>
OffBeside<T> QuietRun::tool_off(const ToolBeside<T>& tool, const Course<T>& course, bool nearest) const {
  const auto& [block, corner, begin, end] = course;
  const auto segment = [&corner = course.corner, this](int to) {
    return SegmentsOf<T>(corner.load(points_->tip_P, to - 1), corner.load(points_->axis_P, to - 1),
                         corner.load(points_->tip_P, to), corner.load(points_->axis_P, to));
  };
  const T none{};
  const T one = lanes::splat<T>(1.0);
  const bool any_pass = lanes::any(begin.passes);
  const bool any_behind = lanes::any(end.behind);
  const SegmentsOf<T> to_corner = segment(0);
  // Where the blocks pass these points.
  T next = none;
  T last = one;
  if (any_pass) {
    next = PassedAt<T>(block, to_corner.tip_P, to_corner.axis_P, none).t;
    if (nearest) next = tool.nearest_to(to_corner.tip_P, to_corner.axis_P, next, none);
    next = lanes::select(begin.passes, next, none);
  }
  if (any_behind) {
    const lanes::Triple<T> tip_P = corner.load(points_->tip_P, 0);
    const lanes::Triple<T> axis_P = corner.load(points_->axis_P, 0);
    last = PassedAt<T>(block, tip_P, axis_P, next).t;
    if (nearest) last = tool.nearest_to(tip_P, axis_P, last, next);
    last = lanes::select(end.behind, last, one);
  }
  T from = begin.t;
  T to = end.t;
  if (nearest) {
    from = tool.nearest_on(to_corner, none, from);
    to = tool.nearest_on(to_corner, one, to);
  }
  OffBeside<T> off = tool.off({next, last}, to_corner,
                              {lanes::select(begin.passes, none, from), lanes::select(end.behind, one, to)});
  if (any_pass) {
    const SegmentsOf<T> before = segment(-1);
    const Between<T> place{nearest ? tool.nearest_on(before, none, begin.t) : begin.t, one};
    off = chosen<T>(begin.passes, larger_of(off, tool.off({none, next}, before, place)), off);
  }
  if (any_behind) {
    const SegmentsOf<T> beyond = segment(1);
    const Between<T> place{none, nearest ? tool.nearest_on(beyond, one, end.t) : end.t};
    off = chosen<T>(end.behind, larger_of(off, tool.off({last, one}, beyond, place)), off);
  }
  return off;
}

template <class T>
void QuietRun::advance_few(const path::PoseRun& poses, std::size_t row, const KnownFigures& known, Place& at,
                           Found& found, std::size_t& taken) const {
  const double most_off_mm = found.point_off_mm;
  const Chords<T> block(poses, row);
  const Corners<T> corner(*this, block.way_mm, at);
  const AtCorner<T> beside(*this, corner, block);
  if (corner.from_next && !lanes::any(lanes::Mask<T>(~beside.is_end))) {
    // From CL point to CL point.
    Judged<T> judged(poses, row, known, at, corner, beside.off2_mm2, beside.off2_axis);
    judged.look_at_curve(block, corner.load(points_->tip_P, -1), beside.tip_P, beside.is_end);
    judged.end_tool(block, [&](bool nearest) {
      const ToolBeside<T> tool(poses, row, block, known.flute_mm);
      const SegmentsOf<T> segment(corner.load(points_->tip_P, -1), corner.load(points_->axis_P, -1),
                                  beside.tip_P, beside.axis_P);
      const Between<T> whole{T{}, lanes::splat<T>(1.0)};
      Between<T> place{shifted(at.t, T{}), whole.to};
      if (nearest) {
        place.from = tool.nearest_on(segment, whole.from, place.from);
        place.to = tool.nearest_on(segment, whole.to, place.to);
      }
      return tool.off(whole, segment, place);
    });
    judged.quiet &= corner.plain(*this) & (length2(block.to - corner.load(points_->tip_P, 1)) > kSamePoint2) &
                    (length2(block.from - beside.tip_P) > kSamePoint2) & ~block.may_leave();
    return judged.take(lanes::splat<T>(1.0), lanes::Mask<T>{}, at, found, taken);
  }
  const Ends<T> end(*this, corner, block, beside);
  const Begins<T> begin(*this, corner, block, beside, end, at);
  Judged<T> judged(poses, row, known, at, corner, end.off2_mm2, end.off2_axis);
  judged.look_at_curve(block, end.tip1_P, beside.tip_P, ~(begin.passes | end.behind));
  T least{};
  if (lanes::any(begin.passes)) {
    const PassedAt<T> point(block, end.tip1_P, corner.load(points_->axis_P, -1), least);
    judged.pass(begin.passes, point, most_off_mm);
    least = lanes::select(begin.passes, point.t, least);
  }
  T last = least;
  if (lanes::any(end.behind)) {
    const PassedAt<T> point(block, beside.tip_P, beside.axis_P, least);
    judged.pass(end.behind, point, most_off_mm);
    last = lanes::select(end.behind, point.t, last);
  }
  judged.look_at_pieces(block, begin.passes ^ end.behind, most_off_mm, [&] {
    const lanes::Triple<T> tip0_P = corner.load(points_->tip_P, -2);
    const lanes::Triple<T> tip3_P = corner.load(points_->tip_P, 1);
    return typename Judged<T>::Passed{chosen(begin.passes, tip0_P, end.tip1_P),
                                      chosen(begin.passes, end.tip1_P, beside.tip_P),
                                      chosen(begin.passes, beside.tip_P, tip3_P), last};
  });
  judged.end_tool(block, [&](bool nearest) {
    return tool_off<T>({poses, row, block, known.flute_mm}, {block, corner, begin, end}, nearest);
  });
  judged.quiet &= begin.found;
  judged.take(end.t, end.behind, at, found, taken);
}

}  // namespace trunnion::post
