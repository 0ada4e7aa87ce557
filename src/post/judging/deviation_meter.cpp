#include "post/judging/deviation_meter.hpp"

#include <array>
#include <boost/math/tools/minima.hpp>
#include <utility>

namespace trunnion::post {
namespace {

// Samples of a motion where no proof is available.
constexpr int kSamples = 16;

// An angle less a slack, which is one of the axis vector, so of the angle's sine.
double narrowed(double angle, double slack) {
  const double most = std::min(angle, 0.5 * kPi);
  return slack == 0.0 ? most : std::asin(std::max(0.0, std::sin(most) - slack));
}

}  // namespace

double angle_to_arc(const Vec3& u, const Vec3& a, const Vec3& b) {
  const double to_ends = std::min(angle_between(u, a).rad(), angle_between(u, b).rad());
  const Vec3 n = a.cross(b);
  if (n.norm() < 1e-12) return to_ends;
  const Vec3 unit = n.normalized();
  const Vec3 foot = u - unit.dot(u) * unit;
  const bool inside = a.cross(foot).dot(unit) >= 0.0 && foot.cross(b).dot(unit) >= 0.0;
  return inside ? std::asin(std::min(1.0, std::abs(unit.dot(u)))) : to_ends;
}

ToolPose DeviationMeter::pose(const JointVector& q, const RotarySines& sines,
                              const ChainErrors& errors) const {
  ToolPose pose;
  if (truth_ != nullptr) {
    pose = with_errors_.pose(q, sines, errors);
    pose.tip_P -= datum_P_;
  } else {
    pose = {kinematics().tip_P(q, sines), kinematics().axis_P(sines)};
  }
  if (offsets_ != nullptr) pose.tip_P += offsets_->deviation_P(part_in_machine(machine_, q).R);
  return pose;
}

ToolPose DeviationMeter::pose(const MachineState& state, const RotarySines& sines,
                              std::span<const double> lagged) const {
  ChainErrors errors;
  if (truth_ != nullptr) truth_->errors(state, lagged, errors);
  return pose(state.q, sines, errors);
}

void DeviationMeter::place(Vertex& vertex, const JointVector& to, const ProgramState& program) const {
  vertex.station = path::station(kinematics(), vertex.q);
  place_at_station(vertex, to, program);
}

void DeviationMeter::place_at_station(Vertex& vertex, const JointVector& to,
                                      const ProgramState& program) const {
  if (certify_) {
    vertex.tip_P = vertex.station.tip_P;
    vertex.axis_P = vertex.station.axis_P;
    return;
  }
  if (fixed_) {
    put_errors(vertex);
  } else if (truth_ != nullptr) {
    truth_->errors(program.towards(to, vertex.q), program.lagged(), vertex.errors);
  }
  const ToolPose at = pose(vertex.q, vertex.station.sines, vertex.errors);
  vertex.tip_P = at.tip_P;
  vertex.axis_P = at.axis_P;
}

// Nothing but the position counts.
void DeviationMeter::put_errors(Vertex& vertex) const {
  if (truth_ == nullptr) return;
  MachineState state;
  state.q = vertex.q;
  truth_->errors(state, {}, vertex.errors);
}

const path::PoseRun* DeviationMeter::place(const path::StationRun& run, path::PoseRun& with_errors) const {
  if (certify_) return &run.poses();
  if (!course_) return nullptr;
  const std::size_t count = run.count();
  with_errors.resize(count + path::StationRun::kMoreRows);
  lanes::at_a_time(way_, [&]<class T>() { place_with_errors<T>(run, with_errors); });
  const path::PoseRun& nominal = run.poses();
  with_errors.sag_mm = nominal.sag_mm;
  with_errors.axis_sag = nominal.axis_sag;
  path::ErrorCourse::Columns q{};
  for (AxisId id = 0; id < kMaxAxes; ++id) q[id] = run.of_axis(id).data();
  const std::size_t motions = count - 1;
  if (!course_->at_most(q, motions, with_errors.rest_mm.data(), with_errors.bow_axis.data())) return nullptr;
  lanes::at_a_time(way_, [&]<class T>() {
    for (std::size_t row = 0; row < motions; row += lanes::kCount<T>) add_bends<T>(nominal, row, with_errors);
  });
  return &with_errors;
}

// What the errors leave of straight courses is there already. The arc between the ends turns with the errors
// there: its sagitta, (1 / cos(theta / 2) - 1) m with m half way between the ends, changes by less than the
// terms here.
template <class T>
void DeviationMeter::add_bends(const path::PoseRun& nominal, std::size_t row, path::PoseRun& out) {
  const T bend_mm = lanes::load<T>(&out.rest_mm[row]);
  lanes::store(&out.bow_mm[row], T(lanes::load<T>(&nominal.bow_mm[row]) + bend_mm));
  lanes::store(&out.rest_mm[row], T(lanes::load<T>(&nominal.rest_mm[row]) + bend_mm));
  T change2{};
  T error2{};
  T chord2{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto nominal_axis = [&](std::size_t at) -> T { return lanes::load<T>(&nominal.axis_P[k][at]); };
    const T from = lanes::load<T>(&out.axis_P[k][row]) - nominal_axis(row);
    const T to = lanes::load<T>(&out.axis_P[k][row + 1]) - nominal_axis(row + 1);
    const T way = nominal_axis(row + 1) - nominal_axis(row);
    change2 += (to - from) * (to - from);
    error2 += from * from + to * to;
    chord2 += way * way;
  }
  const T change = lanes::sqrt(change2);
  const T of_arc = change * (lanes::sqrt(chord2) + change) + chord2 * lanes::sqrt(error2);
  const T axis_bend = lanes::load<T>(&out.bow_axis[row]) + of_arc;
  lanes::store(&out.bow_axis[row], T(lanes::load<T>(&nominal.bow_axis[row]) + axis_bend));
  lanes::store(&out.axis_rest[row], T(lanes::load<T>(&nominal.axis_rest[row]) + axis_bend));
}

template <class T>
void DeviationMeter::place_with_errors(const path::StationRun& run, path::PoseRun& out) const {
  CourseErrors<T> courses(*truth_);
  const bool looks_up = truth_->only_courses();
  ChainErrorsOf<T> asked;
  const lanes::Triple<double> datum{datum_P_.x(), datum_P_.y(), datum_P_.z()};
  for (std::size_t row = 0; row < run.count(); row += lanes::kCount<T>) {
    JointsOf<T> q;
    for (AxisId id = 0; id < kMaxAxes; ++id) q[id] = lanes::load<T>(&run.of_axis(id)[row]);
    if (!looks_up) ask_each(run, row, asked);
    const auto poses = with_errors_.poses(q, run.sines_of<T>(row), looks_up ? courses.at(q) : asked);
    lanes::store_vectors(out.tip_P, row, poses.tip_P - datum);
    lanes::store_vectors(out.axis_P, row, poses.axis_P);
    if (!lanes::any(lanes::Mask<T>(~poses.known))) continue;
    for (std::size_t i = 0; i < lanes::kCount<T>; ++i) {
      if (poses.known[static_cast<int>(i)] == 0) place_one(run, row + i, out);
    }
  }
}

// The errors at as many rows as T holds, one by one.
template <class T>
[[gnu::noinline]] void DeviationMeter::ask_each(const path::StationRun& run, std::size_t row,
                                                ChainErrorsOf<T>& out) const {
  MachineState state;
  for (std::size_t i = 0; i < lanes::kCount<T>; ++i) {
    state.q = run.q(row + i);
    out.put(static_cast<int>(i), truth_->errors(state), truth_->varying());
  }
}

// Where an error turns by more than is calculated side by side.
[[gnu::noinline]] void DeviationMeter::place_one(const path::StationRun& run, std::size_t row,
                                                 path::PoseRun& out) const {
  MachineState state;
  state.q = run.q(row);
  const ToolPose at = pose(state.q, run.sines(row), truth_->errors(state));
  for (std::size_t k = 0; k < 3; ++k) {
    out.tip_P[k][row] = at.tip_P[static_cast<Eigen::Index>(k)];
    out.axis_P[k][row] = at.axis_P[static_cast<Eigen::Index>(k)];
  }
}

JointVector DeviationMeter::between(const Vertex& from, const Vertex& to, double t) const {
  JointVector q = JointVector::interpolate(from.q, to.q, t);
  if (!to.tcp || !from.tcp) return q;
  // The control keeps the tip of the nominal machine on the line.
  const auto tip = [&](const Vertex& v) { return kinematics().pose(v.q).tip_P; };
  kinematics().solve_linear((1.0 - t) * tip(from) + t * tip(to), kinematics().sines(q), q);
  return q;
}

// Where rotary axes turn about a distant tip it swings out and comes back: then an end may be nearer than a
// place between them that is nearest among its neighbours.
Vertex DeviationMeter::nearest_between(const Vertex& from, const Vertex& to, const Target& corner,
                                       const ProgramState& program) const {
  Vertex x = nearest_on_way(from, to, corner, program);
  const auto distance2 = [&](const ToolPose& v) {
    return (v.tip_P - corner.tip_P).squaredNorm() +
           kAxisBesideTip_mm * kAxisBesideTip_mm * (v.axis_P - corner.axis_P).squaredNorm();
  };
  for (const Vertex* end : {&from, &to}) {
    if (!(distance2(*end) < distance2(x))) continue;
    // On the way to the block's end: with lost motion that is another place than where the last one ended.
    Vertex there = to;
    there.q = end->q;
    place(there, to.q, program);
    if (distance2(there) < distance2(x)) x = there;
  }
  return x;
}

Vertex DeviationMeter::nearest_on_way(const Vertex& from, const Vertex& to, const Target& corner,
                                      const ProgramState& program) const {
  const auto put = [&](Vertex& x, double t) {
    x.q = between(from, to, t);
    place(x, to.q, program);
  };
  // Gauss and Newton: the place where what is left stands across the way. The way turns little on a piece
  // that keeps to its path, so that a chord of it serves as the slope, the shorter the better.
  constexpr int kMostSteps = 8;
  constexpr double kEnough = 1e-8;     // of the block: what a minimum can be told by
  constexpr double kEnough_mm = 1e-6;  // of the way: wherever the block is divided, the bounds hold
  Vertex x = to;
  ToolPose before{from.tip_P, from.axis_P};
  double t_before = 0.0;
  double t = 1.0;
  for (int i = 0; i < kMostSteps; ++i) {
    const Vec3 tip = (x.tip_P - before.tip_P) / (t - t_before);
    const Vec3 axis = (kAxisBesideTip_mm / (t - t_before)) * (x.axis_P - before.axis_P);
    const double slope2 = tip.squaredNorm() + axis.squaredNorm();
    if (!(slope2 > 0.0)) break;
    const double step =
        ((corner.tip_P - x.tip_P).dot(tip) + kAxisBesideTip_mm * (corner.axis_P - x.axis_P).dot(axis)) /
        slope2;
    const double next = std::clamp(t + step, 0.0, 1.0);
    const double moves = std::abs(next - t);
    if (moves <= kEnough || moves * moves * slope2 <= kEnough_mm * kEnough_mm) return x;
    before = {x.tip_P, x.axis_P};
    t_before = std::exchange(t, next);
    put(x, next);
  }
  // On a nearly straight piece the distance has one minimum, and its square is nearly a parabola.
  constexpr int kBits = 26;  // half the digits of a double
  std::uintmax_t most = 64;
  const auto distance2 = [&](double place) {
    put(x, place);
    const double turned_mm = kAxisBesideTip_mm * angle_between(x.axis_P, corner.axis_P).rad();
    return (x.tip_P - corner.tip_P).squaredNorm() + turned_mm * turned_mm;
  };
  put(x, boost::math::tools::brent_find_minima(distance2, 0.0, 1.0, kBits, most).first);
  return x;
}

DeviationMeter::Deviation DeviationMeter::of(const Vertex& from, const Vertex& to, const Segment& segment,
                                             const ProgramState& program,
                                             const Deviation& uninteresting) const {
  const auto& [a, b] = segment;
  const path::Reference reference{a.tip_P, b.tip_P, a.axis_P, b.axis_P};
  Deviation out;
  if (from.tcp && to.tcp && certify_) {
    // A straight line: the distance from a segment is convex, so it is largest at an end.
    const double largest = std::max(distance_to_segment(from.tip_P, reference.tip0_P, reference.tip1_P),
                                    distance_to_segment(to.tip_P, reference.tip0_P, reference.tip1_P));
    out.tip_mm = {largest, largest};
    out.axis_rad = axis_interval(from.station, to.station, reference, 0.0, uninteresting.axis_rad.upper);
    return out;
  }
  if (certify_) {
    out.tip_mm = tip_interval(from.station, to.station, reference, 0.0, uninteresting.tip_mm.upper);
    out.axis_rad = axis_interval(from.station, to.station, reference, 0.0, uninteresting.axis_rad.upper);
    return out;
  }
  // Under tool-centre-point control the axes do not run straight, and what the errors then do is sampled.
  if (!asked_ || from.tcp || to.tcp || takes_up(from, to, program))
    return sampled(from, to, segment, program);
  const auto lagged = program.lagged();
  const MachineState s1 = program.towards(to.q, to.q);
  MachineState s0 = s1;
  s0.q = from.q;
  ChainErrors errors;
  const path::Station x0 = fixed_ ? actual(from) : actual(s0, from.station, lagged, errors);
  const path::Station x1 = actual(to);
  between_stops({s0, fixed_ ? from.errors : errors, x0}, {s1, to.errors, x1},
                {lagged, reference, uninteresting}, 0, out);
  if (out.unbounded == nullptr) return out;
  Deviation samples = sampled(from, to, segment, program);
  samples.unbounded = out.unbounded;
  return samples;
}

path::Station DeviationMeter::actual(const MachineState& state, const path::Station& nominal,
                                     std::span<const double> lagged, ChainErrors& errors) const {
  if (truth_ != nullptr) truth_->errors(state, lagged, errors);
  const ToolPose at = pose(state.q, nominal.sines, errors);
  return path::shifted(nominal, at.tip_P - nominal.tip_P, at.axis_P - nominal.axis_P);
}

path::Station DeviationMeter::actual(const Vertex& x) {
  return path::shifted(x.station, x.tip_P - x.station.tip_P, x.axis_P - x.station.axis_P);
}

path::ErrorCourse::Bend DeviationMeter::bend(const Stop& from, const Stop& to) const {
  path::ErrorCourse::Bend bend;
  if (course_)
    bend =
        course_->over({from.state, from.actual.sines, from.errors}, {to.state, to.actual.sines, to.errors});
  if (offsets_ != nullptr) {
    // At most a vector of the machine that turns with the part: |d''| <= turn^2 |d|.
    double turn = 0.0;
    for (std::size_t k = 0; k < 2; ++k)
      turn += std::abs(kinematics().angle(to.state.q, k) - kinematics().angle(from.state.q, k));
    bend.tip_mm += turn * turn / 8.0 * offsets_->deviation_P(Mat3::Identity()).norm();
  }
  return bend;
}

// Halved until what the errors leave of a straight course is a small part of the tolerance.
void DeviationMeter::between_stops(const Stop& from, const Stop& to, const Course& course, int depth,
                                   Deviation& sum) const {
  const auto& [lagged, reference, uninteresting] = course;
  constexpr double kSlackOfTolerance = 0.01;
  constexpr int kMostHalvings = 10;  // at a kink of a table the slack halves with every one
  // A bound that costs a tenth, where it is enough to say that the motion changes no figure.
  if (const auto most = bend_at_most(from.state.q, to.state.q)) {
    const auto is_below = [](double bound, double limit) { return bound < 0.1 * limit; };
    if (is_below(most->tip_mm, uninteresting.tip_mm.upper) &&
        is_below(most->axis_rad, uninteresting.axis_rad.upper) &&
        tip_is_within(from.actual, to.actual, reference, most->tip_mm, uninteresting.tip_mm.upper) &&
        axis_is_within(from.actual, to.actual, reference, most->axis_rad, uninteresting.axis_rad.upper)) {
      sum.tip_mm.upper = std::max(sum.tip_mm.upper, uninteresting.tip_mm.upper);
      sum.axis_rad.upper = std::max(sum.axis_rad.upper, uninteresting.axis_rad.upper);
      return;
    }
  }
  const path::ErrorCourse::Bend slack = bend(from, to);
  if (slack.unbounded != nullptr) {
    sum.unbounded = slack.unbounded;
    return;
  }
  const bool loose = slack.tip_mm > kSlackOfTolerance * tolerance_mm_ ||
                     slack.axis_rad > kSlackOfTolerance * axis_tolerance_.rad();
  if (loose && depth < kMostHalvings) {
    MachineState middle = to.state;
    middle.q = JointVector::interpolate(from.state.q, to.state.q, 0.5);
    ChainErrors errors;
    const path::Station there = actual(middle, path::station(kinematics(), middle.q), lagged, errors);
    const Stop x{middle, errors, there};
    between_stops(from, x, course, depth + 1, sum);
    if (sum.unbounded == nullptr) between_stops(x, to, course, depth + 1, sum);
    return;
  }
  const Interval tip =
      tip_interval(from.actual, to.actual, reference, slack.tip_mm, uninteresting.tip_mm.upper);
  const Interval axis =
      axis_interval(from.actual, to.actual, reference, slack.axis_rad, uninteresting.axis_rad.upper);
  take(sum.tip_mm, tip.lower, tip.upper);
  take(sum.axis_rad, axis.lower, axis.upper);
}

std::optional<path::Certifier::Bows> DeviationMeter::bow_at_most(const Vertex& from, const Vertex& to,
                                                                 const path::Certifier::Bows& nominal) const {
  if (certify_) return nominal;
  const auto errors = bend_at_most(from.q, to.q);
  if (!errors) return std::nullopt;
  return path::Certifier::Bows{nominal.tip_mm + errors->tip_mm, nominal.axis + errors->axis_rad};
}

// On the nominal machine where bounds are proved there, else between the actual places of the ends, with what
// the errors bend the way between them.
template <class Within>
bool DeviationMeter::keeps(const Vertex& from, const Vertex& to, const Within& within) const {
  if (certify_) return within(from.station, to.station, path::ErrorCourse::Bend{});
  const auto errors = bend_at_most(from.q, to.q);
  return errors && within(actual(from), actual(to), *errors);
}

bool DeviationMeter::keeps_tip(const Vertex& from, const Vertex& to, const Target& a, const Target& b,
                               double limit_mm) const {
  const path::Reference reference{a.tip_P, b.tip_P, a.axis_P, b.axis_P};
  return keeps(from, to, [&](const auto& p, const auto& q, const auto& bend) {
    return tip_is_within(p, q, reference, bend.tip_mm, limit_mm);
  });
}

bool DeviationMeter::keeps_axis(const Vertex& from, const Vertex& to, const Target& a, const Target& b,
                                double limit_rad) const {
  const path::Reference reference{a.tip_P, b.tip_P, a.axis_P, b.axis_P};
  return keeps(from, to, [&](const auto& p, const auto& q, const auto& bend) {
    return axis_is_within(p, q, reference, bend.axis_rad, limit_rad);
  });
}

bool DeviationMeter::keeps_flute(const Stretch& part, const path::FluteSegment& segment,
                                 double limit_mm) const {
  const path::FluteCertifier certifier(kinematics());
  return keeps(part.from, part.to, [&](const auto& p, const auto& q, const auto& bend) {
    const double left_mm = limit_mm - bend.tip_mm - segment.flute_mm() * bend.axis_rad;
    return left_mm > 0.0 && certifier.within(p, q, segment, left_mm, {part.t0, part.t1}) == path::Within::yes;
  });
}

std::optional<path::ErrorCourse::Bend> DeviationMeter::bend_at_most(const JointVector& from,
                                                                    const JointVector& to) const {
  return course_ && offsets_ == nullptr ? course_->at_most(from, to) : std::nullopt;
}

bool DeviationMeter::tip_is_within(const path::Station& from, const path::Station& to,
                                   const path::Reference& reference, double slack_mm, double limit_mm) const {
  return limit_mm > slack_mm &&
         certifier_.tip_within(from, to, reference, limit_mm - slack_mm) == path::Within::yes;
}

bool DeviationMeter::axis_is_within(const path::Station& from, const path::Station& to,
                                    const path::Reference& reference, double slack_rad,
                                    double limit_rad) const {
  const double limit = narrowed(limit_rad, slack_rad);
  return limit > 0.0 &&
         certifier_.axis_within(from, to, reference, Angle::radians(limit)) == path::Within::yes;
}

DeviationMeter::Interval DeviationMeter::tip_interval(const path::Station& from, const path::Station& to,
                                                      const path::Reference& reference, double slack_mm,
                                                      double uninteresting_mm) const {
  const auto within = [&](double limit_mm) { return tip_is_within(from, to, reference, slack_mm, limit_mm); };
  if (within(uninteresting_mm)) return {0.0, uninteresting_mm};
  const path::Bound bound = certifier_.tip(from, to, reference);
  const double lower = std::max(0.0, bound.lower - slack_mm);
  const double upper = bound.upper + slack_mm;
  // A proved bound is a little above the truth; where it straddles the tolerance the question is decided, and
  // the figure is worth a sharper bound.
  if (lower > tolerance_mm_ || upper <= tolerance_mm_ || !within(tolerance_mm_)) return {lower, upper};
  constexpr double kSharp = 1.001;
  const path::Bound sharp = certifier_.tip(from, to, reference, kSharp);
  return {std::max(lower, sharp.lower - slack_mm), std::min(tolerance_mm_, sharp.upper + slack_mm)};
}

DeviationMeter::Interval DeviationMeter::axis_interval(const path::Station& from, const path::Station& to,
                                                       const path::Reference& reference, double slack_rad,
                                                       double uninteresting_rad) const {
  // The slack is one of the axis vector, so of the angle's sine.
  const auto wider = [&](double angle) {
    if (slack_rad == 0.0) return angle;
    return angle < 0.5 * kPi ? std::asin(std::min(1.0, std::sin(angle) + slack_rad)) : kPi;
  };
  const auto within = [&](double limit_rad) {
    return axis_is_within(from, to, reference, slack_rad, limit_rad);
  };
  if (within(uninteresting_rad)) return {0.0, uninteresting_rad};
  const path::Bound bound = certifier_.axis(from, to, reference);
  const double lower = narrowed(bound.lower, slack_rad);
  const double upper = wider(bound.upper);
  const double tolerance = axis_tolerance_.rad();
  const bool straddles = lower <= tolerance && upper > tolerance;
  return {lower, straddles && within(tolerance) ? tolerance : upper};
}

// Lost motion that is taken up counts at its end only.
bool DeviationMeter::takes_up(const Vertex& from, const Vertex& to, const ProgramState& program) const {
  return knows_motion_ && is_take_up(machine_, from.q, to.q) &&
         program.towards(to.q, to.q).direction != program.now().direction;
}

DeviationMeter::Deviation DeviationMeter::sampled(const Vertex& from, const Vertex& to,
                                                  const Segment& segment, const ProgramState& program) const {
  const auto& [a, b] = segment;
  double tip = 0.0;
  double axis = 0.0;
  const bool end_only = takes_up(from, to, program);
  for (int i = end_only ? kSamples : 0; i <= kSamples; ++i) {
    const JointVector q = between(from, to, static_cast<double>(i) / kSamples);
    const ToolPose pose = this->pose(program.towards(to.q, q), kinematics().sines(q), program.lagged());
    tip = std::max(tip, distance_to_segment(pose.tip_P, a.tip_P, b.tip_P));
    axis = std::max(axis, angle_to_arc(pose.axis_P, a.axis_P, b.axis_P));
  }
  // One place is all there is to a motion that takes up lost motion.
  return {{tip, tip}, {axis, axis}, end_only, nullptr};
}

}  // namespace trunnion::post
