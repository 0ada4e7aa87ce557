#include "trunnion/path/grid_run.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "path/side_by_side.hpp"

namespace trunnion::path {
namespace {

using Vectors = lanes::Triple<Lanes>;

Lanes load(const std::vector<double>& column, std::size_t row) {
  Lanes out;
  std::memcpy(&out, column.data() + row, sizeof(out));
  return out;
}
void store(std::vector<double>& column, std::size_t row, const Lanes& value) {
  std::memcpy(column.data() + row, &value, sizeof(value));
}
Vectors side_by_side(const Vec3& a, const Vec3& b) {
  return {Lanes{a.x(), b.x()}, Lanes{a.y(), b.y()}, Lanes{a.z(), b.z()}};
}

// As Rounding::rounded, for values that a word can hold.
Lanes rounded_pair(const Rounding& rounding, AxisId id, const Lanes& value) {
  const double unit = rounding.quantum[id];
  if (!(unit > 0.0)) return value;
  const double offset = rounding.offset[id];
  return unit * lanes::nearest<Lanes>((value + offset) / unit) - offset;
}

// As RotarySines::turn.
void turn_on(Lanes& sin, Lanes& cos, const Lanes& by) {
  const Lanes d = by - by * by * by / 6.0;
  const Lanes e = 0.5 * by * by;
  const Lanes s = sin;
  sin = s - e * s + d * cos;
  cos = cos - e * cos - d * s;
}

}  // namespace

// Two points on the grid, and what is prescribed there.
struct GridRun::Place {
  std::array<Lanes, 2> angle;
  TableKinematics::SinesOf<Lanes> sines;
  Vectors linear;
  Vectors tip_P, axis_P;
};

void GridRun::put(std::size_t row, const Place& place) {
  const Vectors w = kinematics_.constant(0) + place.linear;
  const StationOf<Lanes> station(kinematics_, w, kinematics_.constant(1), kinematics_.constant(2),
                                 place.sines);
  for (std::size_t k = 0; k < 2; ++k) {
    store(angle_[k], row, place.angle[k]);
    store(sin_[k], row, place.sines.sin[k]);
    store(cos_[k], row, place.sines.cos[k]);
  }
  store(w_[0], row, w.x);
  store(w_[1], row, w.y);
  store(w_[2], row, w.z);
  store(arm2_outer_, row, station.arm2_outer);
  store(arm2_inner_, row, station.arm2_inner);
  store(size_mm_, row, station.size_mm);
  store(off2_mm2_, row, lanes::squared(station.tip_P - place.tip_P));
  store(off2_axis_, row, lanes::squared(station.axis_P - place.axis_P));
}

void GridRun::place(const Point* before, std::span<Point> points, std::span<const ChosenPoint> chosen) {
  count_ = points.size();
  for (auto* columns : {&angle_, &sin_, &cos_}) {
    for (Column& column : *columns) column.resize(count_ + 2);
  }
  for (Column& column : w_) column.resize(count_ + 2);
  for (Column* column : {&arm2_outer_, &arm2_inner_, &size_mm_, &off2_mm2_, &off2_axis_})
    column->resize(count_ + 2);
  const std::array<AxisId, 2> rotary = {kinematics_.rotary(0), kinematics_.rotary(1)};
  const std::array<AxisId, 3> linear = {kinematics_.linear(0), kinematics_.linear(1), kinematics_.linear(2)};
  if (before != nullptr) {
    const RotarySines s = kinematics_.sines(before->q);
    Place place;
    for (std::size_t k = 0; k < 2; ++k) {
      place.angle[k] = lanes::splat<Lanes>(before->q[rotary[k]]);
      place.sines.sin[k] = lanes::splat<Lanes>(s.sin[k]);
      place.sines.cos[k] = lanes::splat<Lanes>(s.cos[k]);
    }
    place.linear = {lanes::splat<Lanes>(before->q[linear[0]]), lanes::splat<Lanes>(before->q[linear[1]]),
                    lanes::splat<Lanes>(before->q[linear[2]])};
    place.tip_P = side_by_side(before->tip_P, before->tip_P);
    place.axis_P = side_by_side(before->axis_P, before->axis_P);
    put(0, place);
  }
  for (std::size_t i = 0; i < count_; i += 2) {
    const std::size_t j = std::min(i + 1, count_ - 1);  // an odd last one stands for two
    Point& a = points[i];
    Point& b = points[j];
    const KnownSines& known_a = chosen[i].sines;
    const KnownSines& known_b = chosen[j].sines;
    Place place;
    bool near = true;
    for (std::size_t k = 0; k < 2; ++k) {
      place.angle[k] = rounded_pair(rounding_, rotary[k], Lanes{a.q[rotary[k]], b.q[rotary[k]]});
      const Lanes by = place.angle[k] - Lanes{known_a.angle[k], known_b.angle[k]};
      near = near && std::abs(by[0]) <= RotarySines::kSmallTurn_rad &&
             std::abs(by[1]) <= RotarySines::kSmallTurn_rad;
      place.sines.sin[k] = Lanes{known_a.sines.sin[k], known_b.sines.sin[k]};
      place.sines.cos[k] = Lanes{known_a.sines.cos[k], known_b.sines.cos[k]};
      turn_on(place.sines.sin[k], place.sines.cos[k], by);
    }
    b.q[rotary[0]] = place.angle[0][1];
    b.q[rotary[1]] = place.angle[1][1];
    a.q[rotary[0]] = place.angle[0][0];
    a.q[rotary[1]] = place.angle[1][0];
    if (!near) {
      const RotarySines s = known_a.at(kinematics_, a.q);
      const RotarySines t = known_b.at(kinematics_, b.q);
      for (std::size_t k = 0; k < 2; ++k) {
        place.sines.sin[k] = Lanes{s.sin[k], t.sin[k]};
        place.sines.cos[k] = Lanes{s.cos[k], t.cos[k]};
      }
    }
    place.tip_P = side_by_side(a.tip_P, b.tip_P);
    place.axis_P = side_by_side(a.axis_P, b.axis_P);
    const Vectors exact = kinematics_.linear_positions(place.tip_P, place.sines);
    place.linear = {rounded_pair(rounding_, linear[0], exact.x), rounded_pair(rounding_, linear[1], exact.y),
                    rounded_pair(rounding_, linear[2], exact.z)};
    const std::array<Lanes, 3> words = {place.linear.x, place.linear.y, place.linear.z};
    for (std::size_t n = 0; n < 3; ++n) {
      b.q[linear[n]] = words[n][1];
      a.q[linear[n]] = words[n][0];
    }
    put(i + 1, place);
  }
}

// The first bounds of SegmentRefiner::decide: the curve within its norms of the chord, and the chord, whose
// ends stand as far off as they do, within the rest of the tolerance.
void GridRun::judge(const Tolerance& tolerance) {
  bow_mm_.resize(count_ + 1);
  keeps_.resize(count_ + 1);
  const double axis_limit = tolerance.axis.rad() * 2.0 / kPi;  // below its sine
  for (std::size_t i = 0; i < count_; i += 2) {
    const auto turn = [&](std::size_t k) { return lanes::abs(load(angle_[k], i + 1) - load(angle_[k], i)); };
    const auto larger = [&](const Column& c) { return lanes::larger(load(c, i), load(c, i + 1)); };
    const auto sum = [&](const Column& c) { return lanes::abs(load(c, i)) + lanes::abs(load(c, i + 1)); };
    const auto way = [&](std::size_t n) { return load(w_[n], i + 1) - load(w_[n], i); };
    const Lanes outer = turn(0);
    const Lanes inner = turn(1);
    const Lanes D = lanes::sqrt(lanes::squared(Vectors{way(0), way(1), way(2)}));
    const NormsOf<Lanes> norms(outer, inner, D, D, larger(arm2_outer_), larger(arm2_inner_));
    const Lanes bow = norms.M2() / 8.0 + tip_rounding<Lanes>(sum(size_mm_), sum(angle_[0]) + sum(angle_[1]));
    const Lanes left = tolerance.tip_mm - bow;
    const Lanes left_axis = axis_limit - (outer + inner) * (outer + inner) / 8.0;
    const LaneMask keeps = (left >= 0.0) & (larger(off2_mm2_) <= left * left) & (left_axis >= 0.0) &
                           (larger(off2_axis_) <= left_axis * left_axis);
    store(bow_mm_, i, bow);
    std::memcpy(keeps_.data() + i, &keeps, sizeof(keeps));
  }
}

}  // namespace trunnion::path
