#include "probe/clearances.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "trunnion/base/number_text.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/machine/swept.hpp"

namespace trunnion::probe {
namespace {

constexpr double kStep_mm = 2.0;       // along motions; half of it is added to what they keep
constexpr double kAlongStem_mm = 1.0;  // between the points that stand for a stem
constexpr double kTurnStep = 2.0 * kRadPerDegree;

// The probe with its stylus as it stands in the part.
struct Standing {
  Vec3 tip_P, up_P;
};

Standing standing(const Machine& machine, const Ball& ball, const JointVector& q) {
  return {forward(machine, q, {0.0, 0.0, -ball.stylus_length_mm}).p,
          part_in_machine(machine, q).R.transpose() * Vec3::UnitZ()};
}

double from_stylus(const Ball& ball, const Standing& at, const Vec3& point_P) {
  return distance_to_segment(point_P, at.tip_P, at.tip_P + ball.stylus_length_mm * at.up_P) -
         ball.stylus_radius_mm;
}

double from_body(const Ball& ball, const Standing& at, const Vec3& point_P) {
  const Vec3 d = point_P - at.tip_P;
  const double up = d.dot(at.up_P);
  const double across = (d - up * at.up_P).norm();
  const double end = std::max(ball.stylus_length_mm, ball.body->above_mm);
  return std::hypot(std::max({0.0, ball.body->above_mm - up, up - end}),
                    std::max(0.0, across - ball.body->radius_mm));
}

// The stem's axis from the ball's surface to its end.
std::vector<Vec3> stem_points(const Ball& ball) {
  std::vector<Vec3> out;
  if (!ball.stem) return out;
  const Vec3 way = ball.stem->end_P - ball.place_P;
  const double length = way.norm();
  if (length <= ball.radius_mm) return out;
  const auto steps = static_cast<int>(std::ceil((length - ball.radius_mm) / kAlongStem_mm));
  for (int i = 0; i <= steps; ++i)
    out.emplace_back(ball.place_P + (ball.radius_mm + (length - ball.radius_mm) * i / steps) / length * way);
  return out;
}

std::string too_near(const std::string& what, double is_mm, double least_mm) {
  return what + " comes within " + fixed_text(is_mm, 3) + " mm, less than " + fixed_text(least_mm, 3) + " mm";
}

class Obstacles {
 public:
  Obstacles(const Machine& machine, const Ball& ball)
      : machine_(machine), ball_(ball), stem_(stem_points(ball)) {}

  bool none() const { return stem_.empty() && !ball_.body && !machine_.safe.table; }

  // What of stem and ball is nearer than `least_mm` to the probe.
  std::optional<std::string> beside(const Standing& at, double least_mm) const {
    for (const Vec3& point : stem_) {
      if (const double is = from_stylus(ball_, at, point) - ball_.stem->radius_mm; is < least_mm)
        return too_near("the stylus to the ball's stem", is, least_mm);
      if (!ball_.body) continue;
      if (const double is = from_body(ball_, at, point) - ball_.stem->radius_mm; is < least_mm)
        return too_near("the probe's body to the ball's stem", is, least_mm);
    }
    if (ball_.body) {
      if (const double is = from_body(ball_, at, ball_.place_P) - ball_.radius_mm; is < least_mm)
        return too_near("the probe's body to the ball", is, least_mm);
    }
    return std::nullopt;
  }

  // The stylus, and the body's rim, above the table by `least_mm`.
  std::optional<std::string> table(const Standing& at, double least_mm) const {
    if (!machine_.safe.table) return std::nullopt;
    constexpr double kUpStylus_mm = 5.0;
    const Vec3& n = machine_.axes[machine_.rotary_axes().back()].direction;
    const Vec3 down_P = n.z() < 0.0 ? n : Vec3(-n);
    const auto inside = [&](const Vec3& point_P) {
      return inside_table_mm(machine_, point_P + least_mm * down_P).has_value();
    };
    const double radius = ball_.stylus_radius_mm;
    for (double up = 0.0; up <= ball_.stylus_length_mm; up += kUpStylus_mm) {
      if (inside(at.tip_P + up * at.up_P + radius * down_P))
        return "the stylus is nearer than " + fixed_text(least_mm, 3) + " mm to the table";
    }
    if (!ball_.body) return std::nullopt;
    const Vec3 u = at.up_P.unitOrthogonal();
    const Vec3 v = at.up_P.cross(u);
    constexpr int kRound = 24;
    for (double up = ball_.body->above_mm; up <= ball_.stylus_length_mm; up += kUpStylus_mm) {
      for (int i = 0; i < kRound; ++i) {
        const double angle = kTwoPi * i / kRound;
        const Vec3 rim = ball_.body->radius_mm * (std::cos(angle) * u + std::sin(angle) * v);
        if (inside(at.tip_P + up * at.up_P + rim))
          return "the probe's body is nearer than " + fixed_text(least_mm, 3) + " mm to the table";
      }
    }
    return std::nullopt;
  }

  // While the axes turn at the safe height: from the ball, too.
  std::optional<std::string> turning(const JointVector& q) const {
    const Standing at = standing(machine_, ball_, q);
    const double least = ball_.within_mm + ball_.clearance_mm;
    if (const double is = from_stylus(ball_, at, ball_.place_P) - ball_.radius_mm; is < least)
      return too_near("the stylus to the ball", is, least);
    return beside(at, least);
  }

 private:
  const Machine& machine_;
  const Ball& ball_;
  std::vector<Vec3> stem_;
};

double length_of(const Machine& machine, const JointVector& from, const JointVector& to) {
  double square = 0.0;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    if (machine.axes[id].kind == AxisKind::linear) square += (to[id] - from[id]) * (to[id] - from[id]);
  }
  return std::sqrt(square);
}

// Where the ball may be beside its place: nowhere, and in 14 directions as far as it may be.
std::vector<Vec3> places_beside(double within_mm) {
  std::vector<Vec3> out;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const int count = std::abs(x) + std::abs(y) + std::abs(z);
        if (count == 2) continue;
        const Vec3 way(x, y, z);
        out.emplace_back(count == 0 ? way : Vec3(within_mm * way.normalized()));
      }
    }
  }
  return out;
}

double highest_mm(const Machine& machine, const Ball& ball, SweptTurns turns) {
  double top = swept_top_mm(machine, ball.place_P, turns) + ball.radius_mm;
  if (ball.stem) top = std::max(top, swept_top_mm(machine, ball.stem->end_P, turns) + ball.stem->radius_mm);
  return top;
}

double kept_mm(const Ball& ball) {
  return ball.stylus_radius_mm + ball.within_mm + ball.clearance_mm;
}

}  // namespace

std::optional<std::string> obstructed_move(const Machine& machine, const Ball& ball, const JointVector& from,
                                           const JointVector& to) {
  const Obstacles obstacles(machine, ball);
  if (obstacles.none()) return std::nullopt;
  const auto steps = std::max(1, static_cast<int>(std::ceil(length_of(machine, from, to) / kStep_mm)));
  const double least = ball.within_mm + ball.clearance_mm;
  for (int i = 0; i <= steps; ++i) {
    const Standing at =
        standing(machine, ball, JointVector::interpolate(from, to, static_cast<double>(i) / steps));
    if (auto fault = obstacles.beside(at, least)) return fault;
    if (auto fault = obstacles.table(at, least)) return fault;
  }
  return std::nullopt;
}

std::optional<std::string> obstructed_touch(const Machine& machine, const Ball& ball, const JointVector& from,
                                            const JointVector& to) {
  const Obstacles obstacles(machine, ball);
  if (obstacles.none()) return std::nullopt;
  const auto steps = std::max(1, static_cast<int>(std::ceil(length_of(machine, from, to))));
  for (const Vec3& beside : places_beside(ball.within_mm)) {
    for (int i = 0; i <= steps; ++i) {
      Standing at =
          standing(machine, ball, JointVector::interpolate(from, to, static_cast<double>(i) / steps));
      if (auto fault = obstacles.table(at, 0.0)) return fault;
      at.tip_P -= beside;
      if (auto fault = obstacles.beside(at, 0.0)) return *fault + " before it meets the ball";
      if ((at.tip_P - ball.place_P).norm() <= ball.reach_mm()) break;
    }
  }
  return std::nullopt;
}

std::optional<std::string> swept_ball_fault(const Machine& machine, const Ball& ball) {
  const auto tip = safe_tip_mm(machine, ball.stylus_length_mm);
  if (!tip) return std::nullopt;
  const double least = highest_mm(machine, ball, SweptTurns::within_limits) + kept_mm(ball);
  if (*tip >= least) return std::nullopt;
  return "at the safe height, machine Z " + fixed_text(*machine.safe.z_mm(), 3) +
         " mm, the centre of the stylus ball is " + fixed_text(least - *tip, 3) +
         " mm below what it needs over the ball" + (ball.stem ? " and its stem" : "") +
         " in every position of the rotary axes";
}

std::optional<std::string> turn_fault(const Machine& machine, const Ball& ball, const JointVector& from,
                                      const JointVector& to) {
  const Obstacles obstacles(machine, ball);
  JointVector q = from;
  const AxisId z = *machine.axis("Z");
  if (machine.safe.z_mm()) q[z] = *machine.safe.z_mm();
  const auto rotary = machine.rotary_axes();
  const auto at = [](double a, double b, int i, int n) { return a + (b - a) * i / n; };
  const auto steps = [&](AxisId id) {
    return std::max(1, static_cast<int>(std::ceil(std::abs(to[id] - from[id]) / kTurnStep)));
  };
  const int first = rotary.empty() ? 1 : steps(rotary.front());
  const int second = rotary.size() < 2 ? 0 : steps(rotary.back());
  for (int i = 0; i <= first; ++i) {
    for (int k = 0; k <= second; ++k) {
      if (!rotary.empty()) q[rotary.front()] = at(from[rotary.front()], to[rotary.front()], i, first);
      if (rotary.size() > 1) q[rotary.back()] = at(from[rotary.back()], to[rotary.back()], k, second);
      if (auto fault = obstacles.turning(q)) return fault;
    }
  }
  const auto along = std::max(1, static_cast<int>(std::ceil(length_of(machine, from, to) / kStep_mm)));
  for (const char* name : {"X", "Y"}) q[*machine.axis(name)] = from[*machine.axis(name)];
  for (int i = 0; i <= along; ++i) {
    for (const char* name : {"X", "Y"}) {
      const AxisId id = *machine.axis(name);
      q[id] = at(from[id], to[id], i, along);
    }
    if (auto fault = obstacles.turning(q)) return fault;
  }
  return std::nullopt;
}

double never_met_above_mm(const Machine& machine, const Ball& ball) {
  return highest_mm(machine, ball, SweptTurns::either_sense) + kept_mm(ball);
}

}  // namespace trunnion::probe
