#include "trunnion/path/grid_run.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "path/side_by_side.hpp"

namespace trunnion::path {
namespace {

using Vectors = lanes::Triple<Lanes>;

// As RotarySines::turn.
void turn_on(Lanes& sin, Lanes& cos, const Lanes& by) {
  const Lanes d = by - by * by * by / 6.0;
  const Lanes e = 0.5 * by * by;
  const Lanes s = sin;
  sin = s - e * s + d * cos;
  cos = cos - e * cos - d * s;
}

}  // namespace

// As they are calculated with, for two points each.
struct GridRun::Constants {
  ConstantsOf<Lanes> chain;
  std::array<Lanes, kMaxAxes> unit, offset;  // of the grid
  std::array<bool, kMaxAxes> rounds{};

  Constants(const TableKinematics& kinematics, const Rounding& rounding) : chain(kinematics) {
    for (AxisId id = 0; id < kMaxAxes; ++id) {
      unit[id] = lanes::splat<Lanes>(rounding.quantum[id]);
      offset[id] = lanes::splat<Lanes>(rounding.offset[id]);
      rounds[id] = rounding.quantum[id] > 0.0;
    }
  }
};

GridRun::GridRun(const TableKinematics& kinematics, const Rounding& rounding)
    : kinematics_(kinematics),
      constants_(std::make_unique<const Constants>(kinematics, rounding)),
      rotary_{kinematics.rotary(0), kinematics.rotary(1)},
      linear_{kinematics.linear(0), kinematics.linear(1), kinematics.linear(2)} {}
GridRun::~GridRun() = default;
GridRun::GridRun(GridRun&&) noexcept = default;

// As Rounding::rounded, for values that a word can hold.
Lanes GridRun::rounded(AxisId id, const Lanes& value) const {
  const Constants& c = *constants_;
  if (!c.rounds[id]) return value;
  return c.unit[id] * lanes::nearest<Lanes>((value + c.offset[id]) / c.unit[id]) - c.offset[id];
}

GridRun::Pair GridRun::evaluated(const std::array<Lanes, 2>& angle,
                                 const TableKinematics::SinesOf<Lanes>& sines, const Vectors& linear,
                                 const Vectors& tip_P, const Vectors& axis_P) const {
  const ConstantsOf<Lanes>& chain = constants_->chain;
  const Vectors w = chain.w0 + linear;
  const StationOf<Lanes> station(kinematics_, chain, w, sines);
  return {{angle, w, station.arm2_outer, station.arm2_inner, station.size_mm},
          lanes::squared(station.tip_P - tip_P),
          lanes::squared(station.axis_P - axis_P)};
}

void GridRun::begin(const Point* before, std::size_t count, const Tolerance& tolerance) {
  tolerance_ = tolerance;
  sines_.resize(count + 1);
  bow_mm_.resize(count + 1);
  keeps_.resize(count + 1);
  last_ = Pair{};
  if (before == nullptr) return;
  const RotarySines s = kinematics_.sines(before->q);
  const auto twice = [](double x) { return lanes::splat<Lanes>(x); };
  const auto q = [&](AxisId id) { return twice(before->q[id]); };
  last_ = evaluated({q(rotary_[0]), q(rotary_[1])},
                    {{twice(s.sin[0]), twice(s.sin[1])}, {twice(s.cos[0]), twice(s.cos[1])}},
                    {q(linear_[0]), q(linear_[1]), q(linear_[2])},
                    lanes::side_by_side(before->tip_P, before->tip_P),
                    lanes::side_by_side(before->axis_P, before->axis_P));
}

[[gnu::flatten]] void GridRun::add(std::size_t i, const std::array<const ToolPose*, 2>& pose,
                                   const std::array<const ChosenPoint*, 2>& chosen,
                                   const std::array<JointVector*, 2>& out) {
  const KnownSines& known_a = chosen[0]->sines;
  const KnownSines& known_b = chosen[1]->sines;
  std::array<Lanes, 2> angle;
  TableKinematics::SinesOf<Lanes> sines;
  LaneMask near = ~LaneMask{};
  for (std::size_t k = 0; k < 2; ++k) {
    angle[k] = rounded(rotary_[k], Lanes{chosen[0]->q[rotary_[k]], chosen[1]->q[rotary_[k]]});
    const Lanes by = angle[k] - Lanes{known_a.angle[k], known_b.angle[k]};
    near &= lanes::abs(by) <= RotarySines::kSmallTurn_rad;
    sines.sin[k] = Lanes{known_a.sines.sin[k], known_b.sines.sin[k]};
    sines.cos[k] = Lanes{known_a.sines.cos[k], known_b.sines.cos[k]};
    turn_on(sines.sin[k], sines.cos[k], by);
  }
  for (int lane = 0; lane < 2; ++lane) {
    JointVector& q = *out[static_cast<std::size_t>(lane)];
    q[rotary_[0]] = angle[0][lane];
    q[rotary_[1]] = angle[1][lane];
  }
  if (lanes::any(~near)) {
    const RotarySines s = known_a.at(kinematics_, *out[0]);
    const RotarySines t = known_b.at(kinematics_, *out[1]);
    for (std::size_t k = 0; k < 2; ++k) {
      sines.sin[k] = Lanes{s.sin[k], t.sin[k]};
      sines.cos[k] = Lanes{s.cos[k], t.cos[k]};
    }
  }
  const Vectors tip_P = lanes::side_by_side(pose[0]->tip_P, pose[1]->tip_P);
  const Vectors axis_P = lanes::side_by_side(pose[0]->axis_P, pose[1]->axis_P);
  const Vectors exact = linear_positions(kinematics_, constants_->chain, tip_P, sines);
  const Vectors linear = {rounded(linear_[0], exact.x), rounded(linear_[1], exact.y),
                          rounded(linear_[2], exact.z)};
  for (int lane = 0; lane < 2; ++lane) {
    const auto n = static_cast<std::size_t>(lane);
    JointVector& q = *out[n];
    q[linear_[0]] = linear.x[lane];
    q[linear_[1]] = linear.y[lane];
    q[linear_[2]] = linear.z[lane];
    sines_[i + n] = {{sines.sin[0][lane], sines.sin[1][lane]}, {sines.cos[0][lane], sines.cos[1][lane]}};
  }
  const Pair to = evaluated(angle, sines, linear, tip_P, axis_P);
  judge(i, to);
  last_ = to;
}

// The first bounds of SegmentRefiner::decide: the curve within its norms of the chord, and the chord, whose
// ends stand as far off as they do, within the rest of the tolerance.
void GridRun::judge(std::size_t i, const Pair& to) {
  const auto larger = [](const Lanes& last, const Lanes& now) {
    return lanes::larger(across(last, now), now);
  };
  const PairMotion motion(last_, to);
  const Lanes& bow = motion.bow_mm;
  const double axis_limit = tolerance_.axis.rad() * 2.0 / kPi;  // below its sine
  const Lanes left = tolerance_.tip_mm - bow;
  const Lanes turn = motion.outer + motion.inner;
  const Lanes left_axis = axis_limit - turn * turn / 8.0;
  const LaneMask keeps = (left >= 0.0) & (larger(last_.off2_mm2, to.off2_mm2) <= left * left) &
                         (left_axis >= 0.0) &
                         (larger(last_.off2_axis, to.off2_axis) <= left_axis * left_axis);
  std::memcpy(bow_mm_.data() + i, &bow, sizeof(bow));
  std::memcpy(keeps_.data() + i, &keeps, sizeof(keeps));
}

}  // namespace trunnion::path
