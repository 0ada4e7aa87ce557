#include "trunnion/path/grid_run.hpp"

#include <cmath>
#include <cstring>

#include "path/bounds/side_by_side.hpp"

namespace trunnion::path {

// A few positions, and by how much they miss what is programmed, squared.
template <class T>
struct GridRun::Place : PlaceOf<T> {
  lanes::Triple<T> tip_P;
  T off2_mm2, off2_axis;

  // In place: as a copy of a dozen vectors it would take longer than its bounds.
  void put(const TableKinematics& kinematics, const ConstantsOf<T>& chain, const std::array<T, 2>& turned,
           const TableKinematics::SinesOf<T>& sines, const lanes::Triple<T>& linear,
           const lanes::Triple<T>& wanted_P, const lanes::Triple<T>& axis_P) {
    this->angle = turned;
    this->w = chain.w0 + linear;
    const StationOf<T> station(kinematics, chain, this->w, sines);
    this->arm2_outer = station.arm2_outer;
    this->arm2_inner = station.arm2_inner;
    this->size_mm = station.size_mm;
    tip_P = station.tip_P;
    off2_mm2 = lanes::squared(tip_P - wanted_P);
    off2_axis = lanes::squared(station.axis_P - axis_P);
  }
};

// What is the same for all, as it is calculated with, and those that came last.
struct GridRun::Work {
  template <class T>
  struct Of {
    ConstantsOf<T> chain;
    WordGridOf<T> grid;
    std::array<Place<T>, 2> places;  // the last ones, and room for the next
    std::size_t at = 0;
    Place<T>& now() { return places[at]; }
    Place<T>& next() { return places[1 - at]; }

    Of(const TableKinematics& kinematics, const Rounding& rounding)
        : chain(kinematics), grid(rounding), places() {}
  };
  Of<Lanes> two;
  Of<Quads> four;

  Work(const TableKinematics& kinematics, const Rounding& rounding)
      : two(kinematics, rounding), four(kinematics, rounding) {}
  template <class T>
  Of<T>& of() {
    return lanes::of_lanes<T>(two, four);
  }
};

GridRun::GridRun(const TableKinematics& kinematics, const Rounding& rounding)
    : kinematics_(kinematics),
      rotary_{kinematics.rotary(0), kinematics.rotary(1)},
      linear_{kinematics.linear(0), kinematics.linear(1), kinematics.linear(2)},
      way_(lanes::way()),
      work_(std::make_unique<Work>(kinematics, rounding)) {}
GridRun::~GridRun() = default;
GridRun::GridRun(GridRun&&) noexcept = default;

void GridRun::begin(const Point* before, std::size_t count, const Tolerance& tolerance) {
  tolerance_ = tolerance;
  sines_.resize(count + kMost - 1);
  keeps_.resize(count + kMost - 1);
  bow_mm_.resize(count + kMost - 1);
  across_mm_.resize(count + kMost - 1);
  if (before == nullptr) {
    work_->two.now() = Place<Lanes>{};
    work_->four.now() = Place<Quads>{};
    return;
  }
  // Only the last of the few that came before is asked for.
  lanes::at_a_time(way_, [&]<class T>() { set_out<T>(*before); });
}

template <class T>
void GridRun::set_out(const Point& before) {
  const RotarySines s = kinematics_.sines(before.q);
  const auto q = [&](AxisId id) { return lanes::splat<T>(before.q[id]); };
  const auto vector = [](const Vec3& v) {
    return lanes::Triple<T>{lanes::splat<T>(v.x()), lanes::splat<T>(v.y()), lanes::splat<T>(v.z())};
  };
  auto& work = work_->of<T>();
  const TableKinematics::SinesOf<T> sines = {{lanes::splat<T>(s.sin[0]), lanes::splat<T>(s.sin[1])},
                                             {lanes::splat<T>(s.cos[0]), lanes::splat<T>(s.cos[1])}};
  work.now().put(kinematics_, work.chain, {q(rotary_[0]), q(rotary_[1])}, sines,
                 {q(linear_[0]), q(linear_[1]), q(linear_[2])}, vector(before.tip_P), vector(before.axis_P));
}

void GridRun::add(std::size_t i, const Few& few) {
  lanes::at_a_time(way_, [&]<class T>() { add_few<T>(i, few); });
  if (may_count_) lanes::at_a_time(way_, [&]<class T>() { look_closer<T>(i); });
}

template <class T>
void GridRun::add_few(std::size_t i, const Few& few) {
  constexpr std::size_t kTogether = lanes::kCount<T>;
  auto& of = work_->of<T>();
  std::array<T, 2> angle;
  TableKinematics::SinesOf<T> sines;
  auto near = ~lanes::Mask<T>{};
  for (std::size_t k = 0; k < 2; ++k) {
    angle[k] = of.grid.rounded(
        rotary_[k], lanes::collect<T>([&](std::size_t n) { return few[n].chosen->q[rotary_[k]]; }));
    const T by = angle[k] - lanes::collect<T>([&](std::size_t n) { return few[n].chosen->sines.angle[k]; });
    near &= lanes::abs(by) <= RotarySines::kSmallTurn_rad;
    sines.sin[k] = lanes::collect<T>([&](std::size_t n) { return few[n].chosen->sines.sines.sin[k]; });
    sines.cos[k] = lanes::collect<T>([&](std::size_t n) { return few[n].chosen->sines.sines.cos[k]; });
    turn_on(sines.sin[k], sines.cos[k], by);
  }
  for (std::size_t n = 0; n < kTogether; ++n) {
    JointVector& q = *few[n].out;
    q[rotary_[0]] = angle[0][static_cast<int>(n)];
    q[rotary_[1]] = angle[1][static_cast<int>(n)];
  }
  if (lanes::any(~near)) {
    for (std::size_t n = 0; n < kTogether; ++n) {
      const RotarySines s = few[n].chosen->sines.at(kinematics_, *few[n].out);
      for (std::size_t k = 0; k < 2; ++k) {
        sines.sin[k][static_cast<int>(n)] = s.sin[k];
        sines.cos[k][static_cast<int>(n)] = s.cos[k];
      }
    }
  }
  const auto tip_P =
      lanes::collect_vectors<T>([&](std::size_t n) -> const Vec3& { return few[n].pose->tip_P; });
  const auto axis_P =
      lanes::collect_vectors<T>([&](std::size_t n) -> const Vec3& { return few[n].pose->axis_P; });
  const lanes::Triple<T> exact = linear_positions(kinematics_, of.chain, tip_P, sines);
  const lanes::Triple<T> linear = {of.grid.rounded(linear_[0], exact.x), of.grid.rounded(linear_[1], exact.y),
                                   of.grid.rounded(linear_[2], exact.z)};
  for (std::size_t n = 0; n < kTogether; ++n) {
    const int lane = static_cast<int>(n);
    JointVector& q = *few[n].out;
    q[linear_[0]] = linear.x[lane];
    q[linear_[1]] = linear.y[lane];
    q[linear_[2]] = linear.z[lane];
    sines_[i + n] = {{sines.sin[0][lane], sines.sin[1][lane]}, {sines.cos[0][lane], sines.cos[1][lane]}};
  }
  of.next().put(kinematics_, of.chain, angle, sines, linear, tip_P, axis_P);
  judge(i, of.now(), of.next(), sines);
  of.at = 1 - of.at;
}

// The first bounds of SegmentRefiner::decide: the curve within its norms of the chord, and the chord, whose
// ends stand as far off as they do, within the rest of the tolerance.
template <class T>
void GridRun::judge(std::size_t i, const Place<T>& last, const Place<T>& to,
                    const TableKinematics::SinesOf<T>& sines) {
  const auto larger = [](const T& before, const T& now) -> T {
    return lanes::larger(across(before, now), now);
  };
  const MotionsOf<T> motions(last, to);
  const T& bow = motions.bow_mm;
  const double axis_limit = tolerance_.axis.rad() * 2.0 / kPi;  // below its sine
  const T turn = motions.outer + motions.inner;
  const T off2_axis = larger(last.off2_axis, to.off2_axis);
  T left = tolerance_.tip_mm - bow;
  if (tolerance_.flute.length_mm > 0.0) {
    const ConstantsOf<T>& chain = work_->of<T>().chain;
    const AxisMotion<T> axis = motions.of_axis(chain, last, to, chain.along_inner(sines));
    const T flute_left = tolerance_.flute.off_mm - bow -
                         tolerance_.flute.length_mm * off_for_each_mm_up<T>(axis, lanes::sqrt(off2_axis));
    left = lanes::smaller<T>(left, flute_left);
  }
  const T left_axis = axis_limit - turn * turn / 8.0;
  const lanes::Mask<T> keeps = (left >= 0.0) & (larger(last.off2_mm2, to.off2_mm2) <= left * left) &
                               (left_axis >= 0.0) & (off2_axis <= left_axis * left_axis);
  may_count_ = lanes::any(lanes::Mask<T>(keeps & (bow > known_.predicted_mm)));
  std::memcpy(bow_mm_.data() + i, &bow, sizeof(bow));
  std::memcpy(keeps_.data() + i, &keeps, sizeof(keeps));
}

// What norms cannot know is that ways in different directions cancel: near the pole most of them do, since
// the tip goes straight on while the axes turn; and that a part of the bow leads along the chord. So from the
// second derivative at the end of the motion, from which it differs by M3 times the rest of the way at most:
// y'' = -(c + (1 - t) M3) bows by c/8 + M3/(9 sqrt 3) at most.
template <class T>
void GridRun::look_closer(std::size_t i) {
  auto& of = work_->of<T>();
  const ConstantsOf<T>& chain = of.chain;
  const Place<T>& last = of.next();  // which the next one is to replace
  const Place<T>& to = of.now();
  TableKinematics::SinesOf<T> sines;
  for (std::size_t k = 0; k < 2; ++k) {
    sines.sin[k] = lanes::collect<T>([&](std::size_t n) { return sines_[i + n].sin[k]; });
    sines.cos[k] = lanes::collect<T>([&](std::size_t n) { return sines_[i + n].cos[k]; });
  }
  const MotionsOf<T> motions(last, to);
  const T al = motions.turned(last, to, 0);
  const T ga = motions.turned(last, to, 1);
  const auto K = [&](std::size_t k, const lanes::Triple<T>& v) { return lanes::cross(chain.axis[k], v); };
  // The derivatives of u and f (README, "The curve") where they end.
  const lanes::Triple<T> r = kinematics_.turned_back(0, to.w, sines);
  const lanes::Triple<T> d = kinematics_.turned_back(0, motions.way(last.w, to.w), sines);
  const lanes::Triple<T> along_outer = al * K(0, r);
  const lanes::Triple<T> u1 = d - along_outer;
  const lanes::Triple<T> u2 = al * K(0, along_outer - 2.0 * d);
  const lanes::Triple<T> f2 = u2 + ga * K(1, ga * K(1, r + chain.b) - 2.0 * u1);
  // Along the chord and across it.
  const lanes::Triple<T> chord = kinematics_.turned(1, motions.way(last.tip_P, to.tip_P), sines);
  const T length2 = lanes::squared(chord);
  const lanes::Mask<T> some = length2 > 0.0;
  const T share = lanes::dot(f2, chord) / lanes::select(some, length2, lanes::splat<T>(1.0));
  constexpr double kSqrt3 = 1.7320508075688772;
  const T M3 = motions.norms(last, to).M3();
  const auto bow = [&](const lanes::Triple<T>& f2_there) -> T {
    const T closer =
        lanes::sqrt(T(lanes::squared(f2_there))) / 8.0 + M3 / (9.0 * kSqrt3) + motions.rounding_mm;
    return lanes::select(closer < motions.bow_mm, closer, motions.bow_mm);
  };
  // Within the chord's ends what leads along it is no error.
  const T length = lanes::sqrt(length2);
  const lanes::Mask<T> inside = some & (lanes::abs(share) * length + M3 <= 2.0 * length);
  const T whole = bow(f2);
  const T across = lanes::select(inside, bow(f2 - share * chord), whole);
  std::memcpy(bow_mm_.data() + i, &whole, sizeof(whole));
  std::memcpy(across_mm_.data() + i, &across, sizeof(across));
}

}  // namespace trunnion::path
