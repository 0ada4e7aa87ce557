#include "trunnion/path/correction_run.hpp"

#include "trunnion/effects/course_errors.hpp"

#include "path/bounds/side_by_side.hpp"
#include "path/errors/tool_turn.hpp"

namespace trunnion::path {
namespace {

constexpr std::size_t kRoom = lanes::kCount<Quads>;  // behind the last point

// Of each pair its second value, for both.
Lanes second_ones(const Lanes& v) {
  return Lanes{v[1], v[1]};
}
Quads second_ones(const Quads& v) {
  return Quads{v[1], v[1], v[3], v[3]};
}
// Pair k of them.
Lanes pair_of(const Lanes& v, std::size_t) {
  return v;
}
Lanes pair_of(const Quads& v, std::size_t k) {
  return k == 0 ? Lanes{v[0], v[1]} : Lanes{v[2], v[3]};
}

}  // namespace

// What is prescribed; the axis where the flute counts.
template <class T>
struct CorrectionRun::Wanted {
  lanes::Triple<T> tip_P, axis_P;
};

// What is the same for all, as it is calculated with, and what is known from the pairs before.
template <class T>
struct CorrectionRun::Of {
  ConstantsOf<T> chain;
  WordGridOf<T> grid;
  CourseErrors<T> courses;
  ChainErrorsOf<T> asked;         // errors that are no courses
  lanes::Triple<T> aim_P;         // Corrected::aim_P of the last point of the pair
  T error2_mm2, correction2_mm2;  // the largest ones
  PlaceOf<T> last;                // of the motions that are bounded

  Of(const TableKinematics& kinematics, const Rounding& rounding, const ModelEvaluator& model)
      : chain(kinematics), grid(rounding), courses(model) {
    begin();
  }
  void begin() {
    aim_P = lanes::Triple<T>{};
    error2_mm2 = correction2_mm2 = T{};
    last = PlaceOf<T>{};
  }
};

struct CorrectionRun::Work {
  std::array<Of<Lanes>, 2> two;  // of the halves of the run
  Of<Quads> four;
  double flute_mm = 0.0;
  double word_turn_rad = 0.0;       // by which rounding of the rotary words turns the tool at most
  std::vector<double> axis_off;     // of the points, by which the tool axis is off at most
  std::vector<double> along_inner;  // AxisMotion, of the nominal machine
  std::vector<double> beside_mm;    // NominalPlace::beside_mm

  Work(const TableKinematics& kinematics, const Rounding& rounding, const ModelEvaluator& model)
      : two{Of<Lanes>(kinematics, rounding, model), Of<Lanes>(kinematics, rounding, model)},
        four(kinematics, rounding, model) {}
  template <class T>
  Of<T>& of() {
    return lanes::of_lanes<T>(two[0], four);
  }
};

CorrectionRun::CorrectionRun(const Compensator& compensator, const TableKinematics& kinematics,
                             const Rounding& rounding)
    : compensator_(compensator),
      kinematics_(kinematics),
      rounding_(rounding),
      side_by_side_(!compensator.options().orientation && kinematics.side_by_side()),
      looks_up_(side_by_side_ && compensator.evaluator().only_courses()),
      way_(lanes::way()),
      work_(std::make_unique<Work>(kinematics, rounding, compensator.evaluator())) {
  for (std::size_t k = 0; k < 3; ++k)
    word_radius_mm_ = std::hypot(word_radius_mm_, 0.5 * rounding_.quantum[kinematics_.linear(k)]);
  for (std::size_t k = 0; k < 2; ++k) work_->word_turn_rad += 0.5 * rounding_.quantum[kinematics_.rotary(k)];
}
CorrectionRun::~CorrectionRun() = default;
CorrectionRun::CorrectionRun(CorrectionRun&&) noexcept = default;

void CorrectionRun::begin(std::size_t count, double tolerance_mm, double flute_mm) {
  limit_mm_ = limit_mm(tolerance_mm);
  work_->flute_mm = flute_mm;
  joints_.resize(count + kRoom);
  known_.assign(count + kRoom, 0);
  keeps_.assign(count, 0);
  for (std::vector<double>& column : columns_) column.resize(count + kRoom);
  arm2_inner_mm2_.resize(count + kRoom);
  bow_mm_.resize(count + kRoom);
  work_->axis_off.assign(count + kRoom, 0.0);
  work_->along_inner.assign(count + kRoom, 0.0);
  work_->beside_mm.assign(count + kRoom, 0.0);
  for (Of<Lanes>& half : work_->two) half.begin();
  work_->four.begin();
}

// A point is corrected from where the pair before it was: both halves of the run go on side by side.
void CorrectionRun::correct(std::span<const NominalPlace> places, double tolerance_mm, double flute_mm) {
  const std::size_t count = places.size();
  begin(count, tolerance_mm, flute_mm);
  if (count == 0) return;
  const std::size_t half = (count + 3) / 4 * 2;
  // The last one stands for what is not there.
  const auto place = [&](std::size_t i) { return places[std::min(i, count - 1)]; };
  for (std::size_t i = 0; i < half; i += 2)
    add({i, half + i}, {place(i), place(i + 1), place(half + i), place(half + i + 1)});
  bound(places);
}

// The first points of a pair of each half; there may be none in the second.
void CorrectionRun::add(const Firsts& first, const Few& few) {
  Work& work = *work_;
  const bool both = first[1] < keeps_.size();
  const bool four = way_ != lanes::Way::two;
  if (four && both)
    return lanes::with_four(way_, [&]<class T>() { add_few<T>(first.data(), few.data(), work.four); });
  if (four) {
    // The pair that is left over goes on from the others.
    const auto before = [](const Quads& v) { return pair_of(v, 0); };
    const lanes::Triple<Quads>& aim = work.four.aim_P;
    work.two[0].aim_P = {before(aim.x), before(aim.y), before(aim.z)};
  }
  for (std::size_t k = 0; k < (both ? 2 : 1); ++k)
    lanes::with_two([&]<class T>() { add_few<T>(&first[k], &few[2 * k], work.two[k]); });
}

// As Compensator::corrected, where one evaluation of the errors does for both of a pair.
template <class T>
void CorrectionRun::add_few(const std::size_t* first, const NominalPlace* few, Of<T>& of) {
  constexpr std::size_t kTogether = lanes::kCount<T>;
  TableKinematics::SinesOf<T> sines;
  for (std::size_t k = 0; k < 2; ++k) {
    sines.sin[k] = lanes::collect<T>([&](std::size_t n) { return few[n].sines->sin[k]; });
    sines.cos[k] = lanes::collect<T>([&](std::size_t n) { return few[n].sines->cos[k]; });
  }
  JointsOf<T> q;
  for (AxisId id = 0; id < kMaxAxes; ++id)
    q[id] = lanes::collect<T>([&](std::size_t n) { return (*few[n].q)[id]; });
  const std::array<AxisId, 3> linear{kinematics_.linear(0), kinematics_.linear(1), kinematics_.linear(2)};
  const bool has_flute = work_->flute_mm > 0.0;
  Wanted<T> wanted{lanes::collect_vectors<T>([&](std::size_t n) -> const Vec3& { return *few[n].tip_P; }),
                   {}};
  const lanes::Triple<T>& tip_P = wanted.tip_P;
  lanes::Mask<T> known = ~lanes::Mask<T>{};
  if (has_flute) {
    wanted.axis_P = lanes::collect_vectors<T>([&](std::size_t n) -> const Vec3& { return *few[n].axis_P; });
    known = turn<T>(few, wanted, q, sines, of);
  }
  const lanes::Mask<T> turned = known;
  if (looks_up_) known &= of.courses.inside(q);
  lanes::Triple<T> target_P = tip_P + of.aim_P;
  const auto solve = [&](JointsOf<T>& to) {
    const lanes::Triple<T> at = linear_positions(kinematics_, of.chain, target_P, sines);
    to[linear[0]] = at.x;
    to[linear[1]] = at.y;
    to[linear[2]] = at.z;
    return at;
  };
  solve(q);
  const ChainErrorsOf<T>& errors = looks_up_ ? of.courses.at(q) : ask_each(few, q, of, known);
  const ErrorKinematics& machine = compensator_.with_errors();
  ErrorKinematics::TipsOf<T> tips;
  T axis_off{};
  if (has_flute) {
    const auto poses = machine.poses(q, sines, errors);
    tips = {poses.tip_P, poses.known};
    // The last step of the linear axes changes the errors, the tip's by less than it is converged to: those
    // of the axis by less than that for each mm of an arm that is longer.
    axis_off = lanes::sqrt(lanes::squared(poses.axis_P - wanted.axis_P)) + kCorrected_mm;
  } else {
    tips = machine.tips(q, sines, errors);
  }
  const Vec3& datum = compensator_.datum_shift();
  const lanes::Triple<T> actual_P = tips.tip_P - lanes::Triple<double>{datum.x(), datum.y(), datum.z()};
  const T error2 = lanes::squared(actual_P - target_P);
  target_P = target_P - (actual_P - tip_P);
  JointsOf<T> next;  // the linear ones
  const lanes::Triple<T> found = solve(next);
  known &= tips.known & (compensator_.course().change_at_most<T>(q, next) < kCorrected_mm);
  std::array<std::int64_t, kTogether> pairs;
  std::memcpy(pairs.data(), &known, sizeof(known));
  bool all = true;
  for (std::size_t n = 0; n < kTogether; n += 2) {
    pairs[n] = pairs[n + 1] = pairs[n] & pairs[n + 1];
    all = all && pairs[n] != 0;
  }
  std::memcpy(&known, pairs.data(), sizeof(known));
  // By which the linear axes move: what is asked of the tip, since the chain turns that and keeps its length.
  const lanes::Triple<T> aim_P = target_P - tip_P;
  const T correction2 = lanes::squared(aim_P);
  of.correction2_mm2 = lanes::larger(of.correction2_mm2, lanes::select(known, correction2, T{}));
  of.error2_mm2 = lanes::larger(of.error2_mm2, lanes::select(known, error2, T{}));
  q[linear[0]] = of.grid.rounded(linear[0], found.x);
  q[linear[1]] = of.grid.rounded(linear[1], found.y);
  q[linear[2]] = of.grid.rounded(linear[2], found.z);
  // Where the nominal machine puts the tip, within the rounding of the words. A turn about the inner axis
  // keeps the distance from it: that of the tip in P.
  const T arm =
      lanes::sqrt(lanes::squared(lanes::cross(of.chain.axis[1], target_P - of.chain.g))) + word_radius_mm_;
  store(first, q, T(arm * arm));
  const T along_inner = has_flute ? of.chain.along_inner(sines) : T{};
  for (std::size_t pair = 0; has_flute && pair < kTogether / 2; ++pair) {
    lanes::store(work_->axis_off.data() + first[pair], pair_of(axis_off, pair));
    lanes::store(work_->along_inner.data() + first[pair], pair_of(along_inner, pair));
  }
  const lanes::Triple<T> next_P{second_ones(aim_P.x), second_ones(aim_P.y), second_ones(aim_P.z)};
  if (all) {
    of.aim_P = next_P;
    return;
  }
  of.aim_P = {lanes::select(known, next_P.x, of.aim_P.x), lanes::select(known, next_P.y, of.aim_P.y),
              lanes::select(known, next_P.z, of.aim_P.z)};
  for (std::size_t pair = 0; pair < kTogether / 2; ++pair) {
    if (pairs[2 * pair] != 0) continue;
    const int lane = static_cast<int>(2 * pair);
    correct_pair(pair, first, few, turned[lane] != 0 && turned[lane + 1] != 0, of);
  }
}

// The rotary axes take the tool's direction where it is prescribed, to first order in the errors: u(A, C) is
// moved by da = -(n_A x u) dA and dc = -(n_C x u) dC. The words are rounded, and the linear axes put the tip
// right for them. Not known: a step so large that its square counts.
template <class T>
lanes::Mask<T> CorrectionRun::turn(const NominalPlace* few, const Wanted<T>& wanted, JointsOf<T>& q,
                                   TableKinematics::SinesOf<T>& sines, Of<T>& of) const {
  constexpr double kFirstOrder_rad = 3e-4;  // half its square is a twentieth of the finest angle word
  constexpr double kLeverTurn_rad = 2e-7;   // of the inner axis, a tenth of a usual one
  const lanes::Triple<T>& axis_P = wanted.axis_P;
  // The direction hangs on the position only where a rotation does.
  if (!looks_up_ || of.courses.rotations_vary()) {
    const lanes::Triple<T> at = linear_positions(kinematics_, of.chain, wanted.tip_P + of.aim_P, sines);
    q[kinematics_.linear(0)] = at.x;
    q[kinematics_.linear(1)] = at.y;
    q[kinematics_.linear(2)] = at.z;
  }
  lanes::Mask<T> known = ~lanes::Mask<T>{};
  if (looks_up_) known = of.courses.rotations_inside(q);
  const ChainErrorsOf<T>& errors = looks_up_ ? of.courses.rotations_at(q) : ask_each(few, q, of, known);
  const auto axes = compensator_.with_errors().axes(sines, errors);
  const lanes::Triple<T> off = axis_P - axes.axis_P;
  const lanes::Triple<T> outer_P = kinematics_.turned_back(1, of.chain.axis[0], sines);
  const std::array<T, 2> by = turns_towards(off, axis_P, outer_P, of.chain.axis[1]);
  // The turn of one changes what the other does: against that the inner one has its lever only.
  const T each = by[0] * by[1];
  const T lever2 = lanes::squared(lanes::cross(axis_P, of.chain.axis[1]));
  known &= axes.known & (lanes::abs(by[0]) + lanes::abs(by[1]) <= kFirstOrder_rad) &
           (each * each <= kLeverTurn_rad * kLeverTurn_rad * lever2);
  for (std::size_t k = 0; k < 2; ++k) {
    const AxisId id = kinematics_.rotary(k);
    const T before = q[id];
    q[id] = of.grid.rounded(id, T(before + by[k]));
    turn_on(sines.sin[k], sines.cos[k], T(q[id] - before));
  }
  return known;
}

// As known ones.
template <class T>
void CorrectionRun::store(const std::size_t* first, const JointsOf<T>& q, const T& arm2) {
  const std::array<double*, kMaxAxes> columns{columns_[0].data(), columns_[1].data(), columns_[2].data(),
                                              columns_[3].data(), columns_[4].data()};
  for (std::size_t pair = 0; pair < lanes::kCount<T> / 2; ++pair) {
    const std::size_t i = first[pair];
    lanes::store(arm2_inner_mm2_.data() + i, pair_of(arm2, pair));
    JointVector* const to = joints_.data() + i;
    for (AxisId id = 0; id < kMaxAxes; ++id) {
      const Lanes both = pair_of(q[id], pair);
      lanes::store(columns[id] + i, both);
      to[0][id] = both[0];
      to[1][id] = both[1];
    }
    known_[i] = known_[i + 1] = 1;
  }
}

// The errors at positions that are not looked up side by side; not `known` out of the range of a table.
template <class T>
[[gnu::noinline]] const ChainErrorsOf<T>& CorrectionRun::ask_each(const NominalPlace* few,
                                                                  const JointsOf<T>& q, Of<T>& of,
                                                                  lanes::Mask<T>& known) const {
  const ModelEvaluator& model = compensator_.evaluator();
  const ChainLinks varying = model.varying();
  for (std::size_t n = 0; n < lanes::kCount<T>; ++n) {
    const int lane = static_cast<int>(n);
    MachineState state;
    state.q = *few[n].q;
    if (!side_by_side_ || model.check_range(state).verdict != RangeCheck::Verdict::inside) known[lane] = 0;
    for (AxisId id = 0; id < kMaxAxes; ++id) state.q[id] = q[id][lane];
    of.asked.put(lane, model.errors(state), varying);
  }
  return of.asked;
}

// One by one, from where the last one was.
template <class T>
[[gnu::noinline]] void CorrectionRun::correct_pair(std::size_t pair, const std::size_t* first,
                                                   const NominalPlace* few, bool turned, Of<T>& of) {
  for (std::size_t n = 0; n < 2; ++n) {
    const std::size_t i = first[pair] + n;
    if (i == keeps_.size()) return;
    const NominalPlace& at = few[2 * pair + n];
    const std::array<int, 2> own{static_cast<int>(2 * pair), static_cast<int>(2 * pair + 1)};
    const Vec3 aim_P(of.aim_P.x[own[0]], of.aim_P.y[own[0]], of.aim_P.z[own[0]]);
    known_[i] = 0;
    MachineState state;
    state.q = *at.q;
    // The rotary axes are where they were turned to; whoever makes a block of the others turns them, too.
    for (std::size_t k = 0; turned && k < 2; ++k) {
      const AxisId id = kinematics_.rotary(k);
      state.q[id] = joints_[i][id];
    }
    put(i, state.q);
    if (!turned) continue;
    JointVector nominal = state.q;
    if (work_->flute_mm > 0.0) kinematics_.solve_linear(*at.tip_P, kinematics_.sines(nominal), nominal);
    const auto found = compensator_.corrected(*at.tip_P, *at.axis_P, state, {}, aim_P);
    if (!found || found->held) continue;  // whoever makes a block of it finds out, too, and says so
    double correction2 = 0.0;
    // The rotary axes are on the grid already.
    for (std::size_t k = 0; k < 3; ++k) {
      const AxisId id = kinematics_.linear(k);
      const double by = found->q[id] - nominal[id];
      correction2 += by * by;
      state.q[id] = rounding_.rounded(id, found->q[id]);
    }
    put(i, state.q);
    known_[i] = 1;
    work_->axis_off[i] = (found->axis_P - *at.axis_P).norm() + kCorrected_mm;
    const lanes::Triple<double> tip = kinematics_.constant(2);
    const Vec3 inner = *at.tip_P + found->aim_P - Vec3(tip.x, tip.y, tip.z);
    const double arm = kinematics_.direction(1).cross(inner).norm() + word_radius_mm_;
    arm2_inner_mm2_[i] = arm * arm;
    for (const int lane : own) {
      of.aim_P.x[lane] = found->aim_P.x();
      of.aim_P.y[lane] = found->aim_P.y();
      of.aim_P.z[lane] = found->aim_P.z();
      of.correction2_mm2[lane] = std::max(of.correction2_mm2[lane], correction2);
      of.error2_mm2[lane] = std::max(of.error2_mm2[lane], found->before_mm * found->before_mm);
    }
  }
}

void CorrectionRun::put(std::size_t i, const JointVector& q) {
  joints_[i] = q;
  for (AxisId id = 0; id < kMaxAxes; ++id) columns_[id][i] = q[id];
  arm2_inner_mm2_[i] = 0.0;
}

// The corrected ends stand where they were prescribed but for the rounding of the words; between them the
// nominal machine stays within its bow of its chord, and the errors within a bound of their straight course.
// A flute is off by what the axis is off at the ends, what it leaves its chord by, and the arc of the path
// its own: of ends that stand beside the path by so much as whole tools, tip and flute end alike, the axes
// differ by twice that along the flute at most.
template <class T>
void CorrectionRun::bend() {
  Of<T>& of = work_->of<T>();
  const auto at = [&](AxisId id, std::size_t i) { return lanes::load<T>(&columns_[id][i]); };
  const T constants = magnitude(of.chain.b) + magnitude(of.chain.g);
  const double flute_mm = work_->flute_mm;
  // Of the motions to point `i` and those behind it; the first one comes from nowhere.
  const auto larger_of_ends = [](const std::vector<double>& of_points, std::size_t i) -> T {
    const T to = lanes::load<T>(&of_points[i]);
    return i == 0 ? to : T(lanes::larger(lanes::load<T>(&of_points[i - 1]), to));
  };
  for (std::size_t i = 0; i < keeps_.size(); i += lanes::kCount<T>) {
    PlaceOf<T> to;
    to.angle = {at(kinematics_.rotary(0), i), at(kinematics_.rotary(1), i)};
    to.w = of.chain.w0 + lanes::Triple<T>{at(kinematics_.linear(0), i), at(kinematics_.linear(1), i),
                                          at(kinematics_.linear(2), i)};
    to.arm2_outer = lanes::squared(lanes::cross(of.chain.axis[0], to.w));
    to.arm2_inner = lanes::load<T>(&arm2_inner_mm2_[i]);
    to.size_mm = magnitude(to.w) + constants;
    const MotionsOf<T> motions(of.last, to);
    T bow_mm = motions.bow_mm;
    if (flute_mm > 0.0) {
      const T beside_mm = larger_of_ends(work_->beside_mm, i);
      const T off_axis = larger_of_ends(work_->axis_off, i) + (2.0 / flute_mm) * beside_mm;
      const AxisMotion<T> axis =
          motions.of_axis(of.chain, of.last, to, lanes::load<T>(&work_->along_inner[i]));
      bow_mm += beside_mm + flute_mm * off_for_each_mm_up<T>(axis, off_axis);
    }
    lanes::store(&bow_mm_[i], bow_mm);
    of.last = to;
  }
}

// Of the motions that end at points `begin` to `end`.
template <class T>
void CorrectionRun::measure(std::size_t begin, std::size_t end, Box& out) const {
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    const double* const q = columns_[id].data();
    T low = lanes::splat<T>(q[begin - 1]);
    T high = low;
    T way{};
    for (std::size_t i = begin; i < end; i += lanes::kCount<T>) {
      const T to = lanes::load<T>(&q[i]);
      low = lanes::select(to < low, to, low);
      high = lanes::larger(high, to);
      way = lanes::larger(way, lanes::abs(T(to - lanes::load<T>(&q[i - 1]))));
    }
    out.low[id] = low[0];
    out.high[id] = high[0];
    out.way[id] = way[0];
    for (int k = 1; k < static_cast<int>(lanes::kCount<T>); ++k) {
      out.low[id] = std::min(out.low[id], low[k]);
      out.high[id] = std::max(out.high[id], high[k]);
      out.way[id] = std::max(out.way[id], way[k]);
    }
  }
}

// By which the tip leaves the course of the nominal motion to point `i` between its ends at most: what the
// linear axes were moved by is carried by the tables, v(t) = R(t) (v0 + t (v1 - v0)), whose second derivative
// is at most turn^2 |v| + 2 turn |v1 - v0|. The ends of both motions are where they were prescribed but for
// the rounding of their words.
double CorrectionRun::carried_mm(std::span<const NominalPlace> places, std::size_t i) const {
  const auto moved = [&](std::size_t at, AxisId id) { return joints_[at][id] - (*places[at].q)[id]; };
  double turn = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    const AxisId id = kinematics_.rotary(k);
    turn += std::abs(joints_[i][id] - joints_[i - 1][id]);
  }
  double most = 0.0;
  double change = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const AxisId id = kinematics_.linear(k);
    const double before = moved(i - 1, id);
    const double now = moved(i, id);
    most += std::max(std::abs(before), std::abs(now));
    change += std::abs(now - before);
  }
  return (turn * turn * most + 2.0 * turn * change) / 8.0;
}

// By how much more than the nominal tool that of the motion to point `i` is off because of its direction, up
// to its flute length, on a machine whose errors run straight. At the ends it is off where it is put, and the
// nominal one is but for its words. In between the steps of the rotary axes, d, turn the axis by
// J(q) d: off its straight course by an eighth of turn^2 |d| + 2 turn |change of d|, as above.
double CorrectionRun::turned_mm(std::span<const NominalPlace> places, std::size_t i) const {
  if (work_->flute_mm == 0.0) return 0.0;
  double turn = 0.0;
  double most = 0.0;
  double change = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    const AxisId id = kinematics_.rotary(k);
    const double before = joints_[i - 1][id] - (*places[i - 1].q)[id];
    const double now = joints_[i][id] - (*places[i].q)[id];
    turn += std::abs(joints_[i][id] - joints_[i - 1][id]) + std::abs(now - before);
    most += std::max(std::abs(before), std::abs(now));
    change += std::abs(now - before);
  }
  const double axis_off = std::max(work_->axis_off[i - 1], work_->axis_off[i]);
  return work_->flute_mm *
         (axis_off + work_->word_turn_rad + (turn * turn * most + 2.0 * turn * change) / 8.0);
}

void CorrectionRun::bound(std::span<const NominalPlace> places) {
  const std::size_t count = keeps_.size();
  for (std::vector<double>* column :
       {&columns_[0], &columns_[1], &columns_[2], &columns_[3], &columns_[4], &arm2_inner_mm2_})
    std::fill(column->begin() + static_cast<std::ptrdiff_t>(count), column->end(), (*column)[count - 1]);
  const auto largest = [](double& to, const auto& of) {
    for (int k = 0; k < static_cast<int>(sizeof(of) / sizeof(double)); ++k) to = std::max(to, of[k]);
  };
  largest_error2_mm2_ = largest_correction2_mm2_ = 0.0;
  const auto take = [&](const auto& of) {
    largest(largest_error2_mm2_, of.error2_mm2);
    largest(largest_correction2_mm2_, of.correction2_mm2);
  };
  take(work_->four);
  for (const Of<Lanes>& half : work_->two) take(half);
  for (std::size_t i = 0; i < count; ++i) work_->beside_mm[i] = places[i].beside_mm;
  lanes::at_a_time(way_, [&]<class T>() { bend<T>(); });
  for (std::size_t i = 1; i < count; ++i) {
    if (places[i].off_mm != NominalPlace::kUnknown)
      bow_mm_[i] = places[i].off_mm + carried_mm(places, i) + turned_mm(places, i);
  }
  constexpr std::size_t kTogether = 32;
  for (std::size_t begin = 1; begin < count; begin += kTogether) {
    const std::size_t end = std::min(begin + kTogether, count);
    Box box;
    lanes::at_a_time(way_, [&]<class T>() { measure<T>(begin, end, box); });
    decide(begin, end, box);
  }
}

// The errors are asked once for many motions: for one as long as any of them is along each axis, and as far
// out.
void CorrectionRun::decide(std::size_t begin, std::size_t end, const Box& box) {
  JointVector out = box.high;  // the farthest of each axis
  JointVector from;
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    if (-box.low[id] > box.high[id]) out[id] = box.low[id];
    from[id] = out[id] - std::copysign(box.way[id], out[id]);
  }
  const bool all = std::find(known_.begin() + static_cast<std::ptrdiff_t>(begin - 1),
                             known_.begin() + static_cast<std::ptrdiff_t>(end),
                             0) == known_.begin() + static_cast<std::ptrdiff_t>(end);
  const auto together = all ? compensator_.course().at_most(from, out) : std::optional<ErrorCourse::Bend>();
  const auto bend_mm = [&](const ErrorCourse::Bend& errors) {
    return errors.tip_mm + work_->flute_mm * errors.axis_rad;
  };
  for (std::size_t i = begin; i < end; ++i) {
    if (together && bow_mm_[i] + bend_mm(*together) <= limit_mm_) {
      keeps_[i] = 1;
    } else if (bow_mm_[i] <= limit_mm_ && known_[i - 1] != 0 && known_[i] != 0) {
      const auto errors = compensator_.course().at_most(joints_[i - 1], joints_[i]);
      keeps_[i] = errors && bow_mm_[i] + bend_mm(*errors) <= limit_mm_ ? 1 : 0;
    }
  }
}

}  // namespace trunnion::path
