#include "trunnion/path/station_run.hpp"

#include <cmath>

#include "path/side_by_side.hpp"

namespace trunnion::path {
namespace {

using Pair = lanes::Triple<Lanes>;

}  // namespace

void StationRun::resize(std::size_t count) {
  count_ = count;
  const std::size_t rows = count + 2;
  for (Column& column : q_) column.resize(rows);
  for (std::size_t k = 0; k < 2; ++k) {
    sin_[k].resize(rows);
    cos_[k].resize(rows);
  }
  for (Column* column : {&arm2_outer_, &arm2_inner_, &axis_arm2_, &size_mm_}) column->resize(rows);
  poses_.resize(rows);
  bows_.resize(rows);
}

JointVector StationRun::q(std::size_t row) const {
  JointVector out;
  for (AxisId id = 0; id < kMaxAxes; ++id) out[id] = q_[id][row];
  return out;
}

Station StationRun::station(std::size_t row) const {
  Station out;
  out.q = q(row);
  out.sines = sines(row);
  out.tip_P = poses_[row].tip_P;
  out.axis_P = poses_[row].axis_P;
  out.w = kinematics_.w(out.q);
  out.arm2_outer = arm2_outer_[row];
  out.arm2_inner = arm2_inner_[row];
  out.size_mm = size_mm_[row];
  return out;
}

TableKinematics::SinesOf<Lanes> StationRun::sines_of_pair(std::size_t row) const {
  return {{lanes::load(&sin_[0][row]), lanes::load(&sin_[1][row])},
          {lanes::load(&cos_[0][row]), lanes::load(&cos_[1][row])}};
}

void StationRun::evaluate() {
  // What an odd last one is paired with.
  for (Column& column : q_) column[count_] = column[count_ - 1];
  const ConstantsOf<Lanes> chain(kinematics_);
  for (std::size_t row = 0; row < count_; row += 2) put_pair(row, chain);
  for (std::size_t row = 0; row + 1 < count_; row += 2) bow_pair(row);
}

void StationRun::put_pair(std::size_t row, const ConstantsOf<Lanes>& chain) {
  for (std::size_t k = 0; k < 2; ++k) {
    const auto turned = lanes::sincos(lanes::load(&q_[kinematics_.rotary(k)][row]));
    lanes::store(&sin_[k][row], turned.sin);
    lanes::store(&cos_[k][row], turned.cos);
  }
  const auto position = [&](std::size_t i) { return lanes::load(&q_[kinematics_.linear(i)][row]); };
  const Pair w = chain.w0 + Pair{position(0), position(1), position(2)};
  const StationOf<Lanes> station(kinematics_, chain, w, sines_of_pair(row));
  lanes::store(&arm2_outer_[row], station.arm2_outer);
  lanes::store(&arm2_inner_[row], station.arm2_inner);
  lanes::store(&axis_arm2_[row], lanes::squared(lanes::cross(chain.axis[1], station.axis_P)));
  lanes::store(&size_mm_[row], station.size_mm);
  for (int i = 0; i < 2; ++i) {
    poses_[row + static_cast<std::size_t>(i)] = {
        {station.tip_P.x[i], station.tip_P.y[i], station.tip_P.z[i]},
        {station.axis_P.x[i], station.axis_P.y[i], station.axis_P.z[i]}};
  }
}

void StationRun::bow_pair(std::size_t row) {
  const auto way = [&](AxisId id) {
    const double* const from = &q_[id][row];
    return lanes::load(from + 1) - lanes::load(from);
  };
  const auto larger = [&](const Column& c) {
    return lanes::larger(lanes::load(&c[row]), lanes::load(&c[row + 1]));
  };
  const auto sizes = [&](AxisId id) {
    return lanes::abs(lanes::load(&q_[id][row])) + lanes::abs(lanes::load(&q_[id][row + 1]));
  };
  const AxisId outer = kinematics_.rotary(0);
  const AxisId inner = kinematics_.rotary(1);
  const Lanes al = lanes::abs(way(outer));
  const Lanes ga = lanes::abs(way(inner));
  const Lanes D = lanes::sqrt(lanes::squared(
      Pair{way(kinematics_.linear(0)), way(kinematics_.linear(1)), way(kinematics_.linear(2))}));
  const NormsOf<Lanes> tip(al, ga, D, D, larger(arm2_outer_), larger(arm2_inner_));
  const NormsOf<Lanes> axis(al, ga, Lanes{}, Lanes{}, lanes::splat<Lanes>(spindle_arm2_), larger(axis_arm2_));
  const Lanes angles = sizes(outer) + sizes(inner);
  const Lanes tip_mm =
      tip.M2() / 8.0 +
      tip_rounding<Lanes>(lanes::load(&size_mm_[row]) + lanes::load(&size_mm_[row + 1]), angles);
  const Lanes axis_rad = axis.M2() / 8.0 + axis_rounding<Lanes>(angles);
  bows_[row] = {tip_mm[0], axis_rad[0]};
  bows_[row + 1] = {tip_mm[1], axis_rad[1]};
}

}  // namespace trunnion::path
