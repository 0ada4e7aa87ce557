#include "trunnion/path/correction_run.hpp"

#include <algorithm>
#include <cmath>

#include "path/side_by_side.hpp"

namespace trunnion::path {

CorrectionRun::CorrectionRun(const Compensator& compensator, const TableKinematics& kinematics,
                             const Rounding& rounding)
    : compensator_(compensator), kinematics_(kinematics), rounding_(rounding) {
  for (std::size_t k = 0; k < 3; ++k)
    word_radius_mm_ = std::hypot(word_radius_mm_, 0.5 * rounding_.quantum[kinematics_.linear(k)]);
  constants_mm_ = magnitude(kinematics_.constant(1)) + magnitude(kinematics_.constant(2));
}

void CorrectionRun::begin(std::size_t count, double tolerance_mm) {
  limit_mm_ = kBentWithErrors * tolerance_mm - kBothEnds * word_radius_mm_;
  joints_.resize(count);
  known_.assign(count, 0);
  keeps_.assign(count, 0);
  bow_mm_.resize(count);
  aim_P_ = Vec3::Zero();
  last_ = PlaceOf<Lanes>{};
  largest_error_mm_ = largest_correction2_mm2_ = 0.0;
}

// `second`: the one behind `first`, or the same where none is left.
void CorrectionRun::add(std::size_t first, std::size_t second, const Compensator::NominalPlace& a,
                        const Compensator::NominalPlace& b) {
  std::array<Corrected, 2> found;
  if (compensator_.corrected_pair({a, b}, aim_P_, found)) {
    take(first, a, found[0]);
    take(second, b, found[1]);
  } else {
    for (std::size_t i = first; i <= second; ++i) {
      const Compensator::NominalPlace& at = i == first ? a : b;
      MachineState state;
      state.q = at.q;
      const auto one = compensator_.corrected(at.prescribed.tip_P, at.prescribed.axis_P, state, {}, aim_P_);
      joints_[i] = at.q;
      if (!one) continue;  // whoever makes a block of it finds out, too, and says so
      found[i - first] = *one;
      if (!one->held) take(i, at, *one);
    }
  }
  bend(first, second, {a.prescribed.tip_P + found[0].aim_P, b.prescribed.tip_P + found[1].aim_P});
}

void CorrectionRun::take(std::size_t i, const Compensator::NominalPlace& at, const Corrected& found) {
  double correction2 = 0.0;
  // The rotary axes are on the grid already.
  joints_[i] = at.q;
  for (std::size_t k = 0; k < 3; ++k) {
    const AxisId id = kinematics_.linear(k);
    const double by = found.q[id] - at.q[id];
    correction2 += by * by;
    joints_[i][id] = rounding_.rounded(id, found.q[id]);
  }
  largest_correction2_mm2_ = std::max(largest_correction2_mm2_, correction2);
  largest_error_mm_ = std::max(largest_error_mm_, found.before_mm);
  aim_P_ = found.aim_P;
  known_[i] = 1;
}

// The corrected ends stand where they were prescribed but for the rounding of the words; between them the
// nominal machine stays within its bow of its chord, and the errors within a bound of their straight course.
// `tips_P`: where the nominal machine puts the tip there, within that rounding. A turn about the inner axis
// keeps the distance from it: that of the tip in P.
void CorrectionRun::bend(std::size_t first, std::size_t second, const std::array<Vec3, 2>& tips_P) {
  const JointVector& a = joints_[first];
  const JointVector& b = joints_[second];
  const auto both = [&](AxisId id) { return Lanes{a[id], b[id]}; };
  const auto direction = [&](std::size_t k) {
    const Vec3& n = kinematics_.direction(k);
    return lanes::Triple<double>{n.x(), n.y(), n.z()};
  };
  const lanes::Triple<Lanes> tip = lanes::side_by_side(tips_P[0], tips_P[1]);
  PlaceOf<Lanes> to;
  to.angle = {both(kinematics_.rotary(0)), both(kinematics_.rotary(1))};
  to.w =
      kinematics_.constant(0) + lanes::Triple<Lanes>{both(kinematics_.linear(0)), both(kinematics_.linear(1)),
                                                     both(kinematics_.linear(2))};
  to.arm2_outer = lanes::squared(lanes::cross(direction(0), to.w));
  const Lanes arm_inner =
      lanes::sqrt(lanes::squared(lanes::cross(direction(1), tip - kinematics_.constant(2)))) +
      word_radius_mm_;
  to.arm2_inner = arm_inner * arm_inner;
  to.size_mm = magnitude(to.w) + constants_mm_;
  const MotionsOf<Lanes> motion(last_, to);
  last_ = to;
  for (std::size_t i = first; i <= second; ++i) bow_mm_[i] = motion.bow_mm[static_cast<int>(i - first)];
}

// The errors are asked once for many motions: for one as long as any of them is along each axis, and as far
// out.
void CorrectionRun::decide() {
  constexpr std::size_t kTogether = 32;
  const std::size_t count = joints_.size();
  for (std::size_t begin = 1; begin < count; begin += kTogether) {
    const std::size_t end = std::min(begin + kTogether, count);
    JointVector out = joints_[begin - 1];  // the farthest of each axis
    JointVector way;
    bool all = known_[begin - 1] != 0;
    for (std::size_t i = begin; i < end; ++i) {
      all = all && known_[i] != 0;
      for (AxisId id = 0; id < kMaxAxes; ++id) {
        const double q = joints_[i][id];
        if (std::abs(q) > std::abs(out[id])) out[id] = q;
        way[id] = std::max(way[id], std::abs(q - joints_[i - 1][id]));
      }
    }
    JointVector from = out;
    for (AxisId id = 0; id < kMaxAxes; ++id) from[id] -= std::copysign(way[id], out[id]);
    const auto together = all ? compensator_.course().at_most(from, out) : std::optional<ErrorCourse::Bend>();
    for (std::size_t i = begin; i < end; ++i) {
      if (together && bow_mm_[i] + together->tip_mm <= limit_mm_) {
        keeps_[i] = 1;
      } else if (known_[i - 1] != 0 && known_[i] != 0) {
        const auto errors = compensator_.course().at_most(joints_[i - 1], joints_[i]);
        keeps_[i] = errors && bow_mm_[i] + errors->tip_mm <= limit_mm_ ? 1 : 0;
      }
    }
  }
}

}  // namespace trunnion::path
