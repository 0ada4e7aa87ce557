#include "trunnion/path/station_run.hpp"

#include <cmath>

#include "path/bounds/side_by_side.hpp"

namespace trunnion::path {
namespace {

constexpr double kShortArc = 0.25;  // of its chord

// Of the vectors of a row and of the next.
template <class T>
lanes::Triple<T> sum(const std::array<PoseRun::Column, 3>& columns, std::size_t row) {
  return lanes::load_vectors<T>(columns, row) + lanes::load_vectors<T>(columns, row + 1);
}

}  // namespace

void PoseRun::resize(std::size_t rows) {
  for (std::size_t i = 0; i < 3; ++i) {
    tip_P[i].resize(rows);
    axis_P[i].resize(rows);
    sag_mm[i].resize(rows);
    axis_sag[i].resize(rows);
  }
  rest_mm.resize(rows);
  axis_rest.resize(rows);
  bow_mm.resize(rows);
  bow_axis.resize(rows);
}

void StationRun::resize(std::size_t count) {
  count_ = count;
  const std::size_t rows = count + kMoreRows;
  for (Column& column : q_) column.resize(rows);
  for (std::size_t k = 0; k < 2; ++k) {
    sin_[k].resize(rows);
    cos_[k].resize(rows);
  }
  for (Column* column : {&arm2_outer_, &arm2_inner_, &axis_arm2_, &size_mm_}) column->resize(rows);
  poses_.resize(rows);
}

Station StationRun::station(std::size_t row) const {
  Station out;
  out.q = q(row);
  out.sines = sines(row);
  const ToolPose pose = poses_.pose(row);
  out.tip_P = pose.tip_P;
  out.axis_P = pose.axis_P;
  out.w = kinematics_.w(out.q);
  out.arm2_outer = arm2_outer_[row];
  out.arm2_inner = arm2_inner_[row];
  out.size_mm = size_mm_[row];
  return out;
}

void StationRun::evaluate() {
  // What the last ones are looked at together with.
  for (Column& column : q_) {
    for (std::size_t row = count_; row < column.size(); ++row) column[row] = column[count_ - 1];
  }
  lanes::at_a_time(way_, [&]<class T>() { evaluate_few<T>(); });
}

template <class T>
void StationRun::evaluate_few() {
  constexpr std::size_t kTogether = lanes::kCount<T>;
  const ConstantsOf<T> chain(kinematics_);
  for (std::size_t row = 0; row < count_; row += kTogether) put_few<T>(row, chain);
  for (std::size_t row = 0; row + 1 < count_; row += kTogether) bow_few<T>(row, chain);
}

template <class T>
void StationRun::put_few(std::size_t row, const ConstantsOf<T>& chain) {
  for (std::size_t k = 0; k < 2; ++k) {
    const auto turned = lanes::sincos(lanes::load<T>(&q_[kinematics_.rotary(k)][row]));
    lanes::store(&sin_[k][row], turned.sin);
    lanes::store(&cos_[k][row], turned.cos);
  }
  const auto position = [&](std::size_t i) { return lanes::load<T>(&q_[kinematics_.linear(i)][row]); };
  const lanes::Triple<T> w = chain.w0 + lanes::Triple<T>{position(0), position(1), position(2)};
  const StationOf<T> station(kinematics_, chain, w, sines_of<T>(row));
  lanes::store(&arm2_outer_[row], station.arm2_outer);
  lanes::store(&arm2_inner_[row], station.arm2_inner);
  lanes::store(&axis_arm2_[row], T(lanes::squared(lanes::cross(chain.axis[1], station.axis_P))));
  lanes::store(&size_mm_[row], station.size_mm);
  lanes::store_vectors(poses_.tip_P, row, station.tip_P);
  lanes::store_vectors(poses_.axis_P, row, station.axis_P);
}

template <class T>
void StationRun::bow_few(std::size_t row, const ConstantsOf<T>& chain) {
  const auto way = [&](AxisId id) -> T {
    const double* const from = &q_[id][row];
    return lanes::load<T>(from + 1) - lanes::load<T>(from);
  };
  const auto larger = [&](const Column& c) -> T {
    return lanes::larger(lanes::load<T>(&c[row]), lanes::load<T>(&c[row + 1]));
  };
  const auto sizes = [&](AxisId id) -> T {
    return lanes::abs(lanes::load<T>(&q_[id][row])) + lanes::abs(lanes::load<T>(&q_[id][row + 1]));
  };
  const AxisId outer = kinematics_.rotary(0);
  const AxisId inner = kinematics_.rotary(1);
  const T al = lanes::abs(way(outer));
  const T ga = lanes::abs(way(inner));
  const T D = lanes::sqrt(T(lanes::squared(
      lanes::Triple<T>{way(kinematics_.linear(0)), way(kinematics_.linear(1)), way(kinematics_.linear(2))})));
  const NormsOf<T> tip(al, ga, D, D, larger(arm2_outer_), larger(arm2_inner_));
  const NormsOf<T> axis(al, ga, T{}, T{}, lanes::splat<T>(spindle_arm2_), larger(axis_arm2_));
  const T angles = sizes(outer) + sizes(inner);
  const T sizes_mm = lanes::load<T>(&size_mm_[row]) + lanes::load<T>(&size_mm_[row + 1]);
  const T rounding_mm = tip_rounding<T>(sizes_mm, angles);
  const StationOf<T> middle = half_way(row, chain);
  const auto small_turns = (al < kBisectorTurn) & (ga < kBisectorTurn);

  const T from_norms = tip.M2() / 8.0;
  const lanes::Triple<T> sag = middle.tip_P - 0.5 * sum<T>(poses_.tip_P, row);
  const T beyond_mm = beyond_parabola(tip.M3());
  const T from_middle = lanes::sqrt(T(lanes::squared(sag))) + beyond_mm;
  const auto nearer = small_turns & (from_middle < from_norms);
  lanes::store(&poses_.bow_mm[row], T(lanes::select(nearer, from_middle, from_norms) + rounding_mm));
  lanes::store(&poses_.rest_mm[row], T(lanes::select(nearer, beyond_mm, from_norms) + rounding_mm));
  lanes::store(&poses_.sag_mm[0][row], lanes::select(nearer, sag.x, T{}));
  lanes::store(&poses_.sag_mm[1][row], lanes::select(nearer, sag.y, T{}));
  lanes::store(&poses_.sag_mm[2][row], lanes::select(nearer, sag.z, T{}));

  // The arc between the ends is as good as a parabola, too. Seen from the centre it runs along the chord, at
  // a fraction of it that is off by less than theta^2 / 60.
  const lanes::Triple<T> sum_of_axes = sum<T>(poses_.axis_P, row);
  const lanes::Triple<T> on_arc = T(1.0 / lanes::sqrt(T(lanes::squared(sum_of_axes)))) * sum_of_axes;
  const lanes::Triple<T> turn = sum_of_axes - 2.0 * lanes::load_vectors<T>(poses_.axis_P, row);
  const T chord = lanes::sqrt(T(lanes::squared(turn)));
  const T theta = 1.05 * chord;
  const T theta3 = theta * theta * theta;
  const T axis_from_norms = axis.M2() / 8.0;
  const lanes::Triple<T> axis_sag = middle.axis_P - on_arc;
  const T beyond_axis = beyond_parabola<T>(axis.M3() + theta3);
  const T from_arc = lanes::sqrt(T(lanes::squared(axis_sag))) + beyond_axis + 0.02 * theta3;
  const auto along_arc = small_turns & (chord < kShortArc) & (from_arc < axis_from_norms);
  lanes::store(&poses_.bow_axis[row],
               T(lanes::select(along_arc, from_arc, axis_from_norms) + axis_rounding<T>(angles)));
  lanes::store_vectors(poses_.axis_sag, row, axis_sag);
  constexpr double kNotKnown = 1e300;
  lanes::store(&poses_.axis_rest[row],
               T(lanes::select(small_turns & (chord < kShortArc), T(beyond_axis + axis_rounding<T>(angles)),
                               lanes::splat<T>(kNotKnown))));
}

// Where the tool is in the middle of the motion: middle_tip, middle_axis.
template <class T>
StationOf<T> StationRun::half_way(std::size_t row, const ConstantsOf<T>& chain) const {
  const auto sines = [&](std::size_t at) {
    return TableKinematics::SinesOf<T>{{lanes::load<T>(&sin_[0][at]), lanes::load<T>(&sin_[1][at])},
                                       {lanes::load<T>(&cos_[0][at]), lanes::load<T>(&cos_[1][at])}};
  };
  const TableKinematics::SinesOf<T> middle = middle_sines_of<T>(sines(row), sines(row + 1));
  const auto position = [&](std::size_t i) -> T {
    const Column& q = q_[kinematics_.linear(i)];
    return 0.5 * (lanes::load<T>(&q[row]) + lanes::load<T>(&q[row + 1]));
  };
  const lanes::Triple<T> w = chain.w0 + lanes::Triple<T>{position(0), position(1), position(2)};
  return StationOf<T>(kinematics_, chain, w, middle);
}

}  // namespace trunnion::path
