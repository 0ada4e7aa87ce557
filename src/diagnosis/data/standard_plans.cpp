#include "trunnion/diagnosis/standard_plans.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr double kInside = 1.0 * kRadPerDegree;  // that a pose stays within the travel of a rotary axis
constexpr double kLargestTilt = 90.0 * kRadPerDegree;
constexpr double kStationStep = 5.0 * kRadPerDegree;  // between readings on the fly
constexpr double kStandStep = 15.0 * kRadPerDegree;   // between poses that stand
constexpr double kMinutesStanding = 0.8;              // a pose
// A turn of the tool counts as the way of a point so far up the tool, so that turns on the spot are read,
// too.
constexpr double kToolAxisArm_mm = 50.0;
const std::vector<Vec3> kSpaceAxes = {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};

double way_between(const ToolPose& a, const ToolPose& b) {
  return (b.tip_P - a.tip_P).norm() + kToolAxisArm_mm * angle_between(a.axis_P, b.axis_P).rad();
}

ToolPose between(const ToolPose& a, const ToolPose& b, double t) {
  return {a.tip_P + t * (b.tip_P - a.tip_P), slerp(a.axis_P, b.axis_P, t)};
}

// So many poses at equal ways along the cuts, their ends among them.
std::vector<ToolPose> stations_of(const std::vector<std::vector<ToolPose>>& cuts, std::size_t count) {
  struct Piece {
    const ToolPose& from;
    const ToolPose& to;
    double begin, end;  // of its way
  };
  std::vector<Piece> pieces;
  double way = 0.0;
  for (const std::vector<ToolPose>& cut : cuts)
    for (std::size_t i = 1; i < cut.size(); ++i) {
      const double begin = std::exchange(way, way + way_between(cut[i - 1], cut[i]));
      pieces.push_back({cut[i - 1], cut[i], begin, way});
    }
  std::vector<ToolPose> out;
  auto piece = pieces.begin();
  for (std::size_t k = 0; k < count; ++k) {
    const double at = way * static_cast<double>(k) / static_cast<double>(count - 1);
    while (piece + 1 != pieces.end() && piece->end < at) ++piece;
    const double length = piece->end - piece->begin;
    out.push_back(
        between(piece->from, piece->to, length > 0.0 ? std::min(1.0, (at - piece->begin) / length) : 1.0));
  }
  return out;
}

class StandardPlans {
 public:
  StandardPlans(const Machine& machine, const StandardSetUp& set_up)
      : machine_(machine),
        set_up_(set_up),
        outer_(machine.rotary_axes().front()),
        inner_(machine.rotary_axes().back()) {}

  Result<std::vector<PlanRun>> make(std::string_view kind) {
    if (kind == "path") led(base("path"), stations_of(set_up_.cuts, set_up_.poses));
    for (std::size_t i = 0; kind != "path" && i < set_up_.balls_P.size(); ++i) {
      place_P_ = set_up_.balls_P[i];
      suffix_ = set_up_.balls_P.size() > 1 ? ", ball " + std::to_string(i + 1) : "";
      if (kind == "rtest") standing();
      if (kind == "bk1") following(outer_, "BK1");
      if (kind == "bk2") following(inner_, "BK2");
      if (kind == "frustum") frustum();
    }
    if (fault_) return tl::unexpected(*fault_);
    return std::move(out_);
  }

 private:
  const std::string& name(AxisId id) const { return machine_.axes[id].name; }

  void refuse(const std::string& what) {
    if (!fault_) fault_ = Error{ErrorCode::wrong_input, what, machine_.file, {}};
  }

  PlanRun base(const std::string& id) const {
    PlanRun run;
    run.id = id + suffix_;
    run.n = kSpaceAxes;
    run.tool_mm = machine_.tool_vector();
    run.u_random = set_up_.u_random_mm;
    return run;
  }

  bool reached(double outer, double inner) const {
    JointVector q;
    q[outer_] = outer;
    q[inner_] = inner;
    const double tilt = angle_between(part_in_machine(machine_, q).R.col(2), Vec3::UnitZ()).rad();
    solve_linear(machine_, place_P_, machine_.tool_vector(), q);
    return tilt <= kLargestTilt + 1e-9 && limit_violations(machine_, q).empty();
  }

  // Multiples of the step within the travel, once round at most.
  std::vector<double> stations(AxisId id, double step) const {
    const Axis& axis = machine_.axes[id];
    const bool endless = !axis.has_limits() || axis.max - axis.min >= kTwoPi;
    const double low = endless ? 0.0 : axis.min + kInside;
    const double high = endless ? kTwoPi : axis.max - kInside;
    std::vector<double> out;
    for (double at = std::ceil(low / step - 1e-9) * step; at <= high + 1e-9; at += step) out.push_back(at);
    return out;
  }

  // Those about 0, one behind the other, from which the ball can be reached with all of `others`.
  std::vector<double> reached_stations(AxisId id, double step, const std::vector<double>& others) const {
    std::vector<double> out;
    for (const double at : stations(id, step)) {
      const bool all = std::all_of(others.begin(), others.end(), [&](double other) {
        return id == outer_ ? reached(at, other) : reached(other, at);
      });
      if (all)
        out.push_back(at);
      else if (at < 0.0)
        out.clear();
      else if (at > 0.0)
        break;
    }
    return out;
  }

  void standing() {
    const auto once = [&](const std::string& id, std::vector<double> outer, std::vector<double> inner) {
      if (outer.size() * inner.size() < 3) return refuse("run '" + id + "': the ball cannot be followed");
      PlanRun run = base(id);
      run.minutes = kMinutesStanding * static_cast<double>(outer.size() * inner.size());
      run.path = PlanGrid{{{outer_, std::move(outer)}, {inner_, std::move(inner)}}, {}, place_P_};
      out_.push_back(std::move(run));
    };
    auto round = reached_stations(inner_, 2.0 * kStandStep, {0.0});
    if (!round.empty() && round.back() >= kTwoPi - 1e-9) round.pop_back();
    once("R-test, " + name(inner_) + " once round", {0.0}, round);
    std::vector<double> four;
    for (int i = 0; i < 4; ++i) {
      const double at = i * 0.5 * kPi;
      if (machine_.axes[inner_].within_limits(at)) four.push_back(at);
    }
    once("R-test, " + name(outer_) + " through its travel", reached_stations(outer_, kStandStep, four), four);
  }

  // Axial, radial and tangential, in the part with all rotary axes at 0.
  std::vector<Vec3> directions(AxisId id) {
    const Axis& axis = machine_.axes[id];
    const Vec3 arm = place_P_ + machine_.part_zero_mm - axis.point_mm;
    const Vec3 radial = arm - arm.dot(axis.direction) * axis.direction;
    constexpr double kLeastArm_mm = 1.0;
    if (radial.norm() < kLeastArm_mm) {
      refuse("the ball lies on axis " + axis.name + ": it needs an arm");
      return kSpaceAxes;
    }
    return {axis.direction, radial.normalized(), axis.direction.cross(radial.normalized())};
  }

  void following(AxisId id, const std::string& test) {
    PlanRun run = base("ISO 10791-6 " + test + ", " + name(id));
    auto values = reached_stations(id, kStationStep, {0.0});
    if (values.size() < 3) return refuse("run '" + run.id + "': the ball cannot be followed");
    run.n = directions(id);
    moving(run, static_cast<double>(values.size()) * kStationStep *
                    (place_P_ - machine_.axes[id].point_mm).norm());
    const std::vector<double> still = {0.0};
    run.path = PlanGrid{
        {{outer_, id == outer_ ? values : still}, {inner_, id == inner_ ? values : still}}, {}, place_P_};
    out_.push_back(std::move(run));
  }

  void moving(PlanRun& run, double way_mm) const {
    run.frame = SensitivityFrame::part;
    run.feed_mm_s = set_up_.feed_mm_s;
    run.both_directions = true;
    run.minutes = 2.0 * way_mm / set_up_.feed_mm_s / kSecondsPerMinute;
  }

  void frustum() {
    const auto& cone = set_up_.cone;
    // Inclined about the horizontal axis that the outer axis turns about, at most.
    Vec3 about = machine_.axes[outer_].direction;
    about.z() = 0.0;
    if (about.norm() < 1e-6) about = Vec3::UnitX();
    const Mat3 R = rotation_about(about.normalized(), cone.inclination);
    const double lean = cone.half_apex.rad();
    std::vector<ToolPose> path;
    constexpr int kPoints = 72;
    for (int i = 0; i <= kPoints; ++i) {
      const double phi = kTwoPi * i / kPoints;
      const Vec3 out = R * Vec3(std::cos(phi), std::sin(phi), 0.0);
      path.push_back({place_P_ + cone.radius_mm * out, std::cos(lean) * R.col(2) - std::sin(lean) * out});
    }
    led(base("cone frustum"), path);
  }

  // Tip and axis led through these poses, read on the fly.
  void led(PlanRun run, const std::vector<ToolPose>& through) {
    PlanPoses path;
    JointVector seed;
    double way_mm = 0.0;
    for (std::size_t i = 0; i < through.size(); ++i) {
      const auto solutions = inverse(machine_, through[i], seed);
      if (solutions.empty())
        return refuse("run '" + run.id + "': the tool's direction at pose " + std::to_string(i + 1) + " of " +
                      std::to_string(through.size()) + " is out of reach");
      seed = solutions.front().q;
      path.poses.push_back(seed);
      if (i > 0) way_mm += (through[i].tip_P - through[i - 1].tip_P).norm();
    }
    moving(run, way_mm);
    run.path = std::move(path);
    // The travel.
    if (const auto all = expand({run}, machine_); !all) return refuse(all.error().message);
    out_.push_back(std::move(run));
  }

  const Machine& machine_;
  const StandardSetUp& set_up_;
  AxisId outer_, inner_;
  Vec3 place_P_ = Vec3::Zero();
  std::string suffix_;
  std::vector<PlanRun> out_;
  std::optional<Error> fault_;
};

}  // namespace

std::vector<std::string> standard_plan_kinds() {
  return {"rtest", "bk1", "bk2", "frustum", "path"};
}

Result<std::vector<PlanRun>> standard_plan(const Machine& machine, std::string_view kind,
                                           const StandardSetUp& set_up) {
  const auto kinds = standard_plan_kinds();
  if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end())
    return fail(ErrorCode::wrong_input, "there is no plan '" + std::string(kind) + "'");
  if (machine.rotary_axes().size() != 2)
    return fail(ErrorCode::wrong_input,
                "machine '" + machine.name + "' has no two rotary axes: these plans are for such",
                machine.file);
  const bool is_cut = std::all_of(set_up.cuts.begin(), set_up.cuts.end(),
                                  [](const std::vector<ToolPose>& cut) { return cut.size() > 1; });
  if (kind == "path" && (set_up.cuts.empty() || !is_cut || set_up.poses < 2))
    return fail(ErrorCode::wrong_input, "a cut needs two points, and a plan of it two poses");
  return StandardPlans(machine, set_up).make(kind);
}

}  // namespace trunnion::diagnosis
