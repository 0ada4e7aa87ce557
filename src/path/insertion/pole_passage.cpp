#include "path/insertion/pole_passage.hpp"

#include <algorithm>
#include <cmath>

#include "path/insertion/segment_ends.hpp"

namespace trunnion::path {
namespace {

// Tilt of a tool axis that stands at the pole, of the axis tolerance: turning the inner axis moves it by
// twice that at most.
constexpr double kPoleShare = 0.25;

}  // namespace

std::optional<Point> PolePassage::turned(const Point& end, const Station& at, const Point& other,
                                         Angle least_turn) const {
  if (kinematics().rotary_count() < 2) return std::nullopt;
  const Vec3& n = kinematics().direction(1);
  if (at.axis_P.cross(n).norm() > kPoleShare * judge_.tolerance().axis_room().rad()) return std::nullopt;
  Point turned = end;
  turned.inserted = true;
  const Vec3 pole_P = at.axis_P.dot(n) >= 0.0 ? n : Vec3(-n);
  if (!turn_towards(other, pole_P, turned)) return std::nullopt;
  if (largest_turn(kinematics(), at.q, turned.q) < least_turn.rad()) return std::nullopt;
  return turned;
}

// Puts the rotary axes of `turned` to the pole as they come there straight from `end`; how, is seen a little
// beside it.
bool PolePassage::turn_towards(const Point& end, const Vec3& pole_P, Point& turned) const {
  const double whole = angle_between(end.axis_P, pole_P).rad();
  if (!(whole > 0.0)) return false;
  const double beside = std::min(kPoleShare * judge_.tolerance().axis_room().rad() / whole, 0.5);
  const auto q = maker_.followed(end, slerp(end.axis_P, pole_P, 1.0 - beside));
  if (!q) return false;
  turned.axis_P = pole_P;
  turned.q = *q;
  const AxisId outer = kinematics().rotary(0);
  turned.q[outer] = maker_.at_pole(pole_P, *q)[outer];
  round_to_words(kinematics(), rounding_, turned.tip_P, turned.q);
  return true;
}

bool PolePassage::lies_between(const Point& a, const Point& b) const {
  if (kinematics().rotary_count() < 2) return false;
  const Vec3& a_P = a.axis_P;
  const Vec3& b_P = b.axis_P;
  const Vec3& n = kinematics().direction(1);
  const Vec3 normal = a_P.cross(b_P);
  const Vec3 pole_P = n.dot(a_P) + n.dot(b_P) >= 0.0 ? n : Vec3(-n);
  const double near = kPoleShare * judge_.tolerance().axis_room().rad();
  return normal.norm() > 0.0 && std::abs(normal.dot(pole_P)) <= near * normal.norm() &&
         a_P.cross(pole_P).dot(normal) > 0.0 && pole_P.cross(b_P).dot(normal) > 0.0;
}

std::optional<PolePassage::OnTheWay> PolePassage::on_the_way(const Point& a, const Point& b) const {
  if (kinematics().rotary_count() < 2) return std::nullopt;
  const Vec3& a_P = a.axis_P;
  const Vec3& b_P = b.axis_P;
  const Vec3& n = kinematics().direction(1);
  if (!lies_between(a, b)) return std::nullopt;
  const Vec3 pole_P = n.dot(a_P) + n.dot(b_P) >= 0.0 ? n : Vec3(-n);
  OnTheWay out;
  out.share = angle_between(a_P, pole_P).rad() / angle_between(a_P, b_P).rad();
  const Node pole = maker_.node(out.share, {}, NodeAxis::great_circle, true);
  const std::array<const Point*, 2> ends = {&a, &b};
  for (std::size_t side = 0; side < 2; ++side) {
    Point& turned = out.turned[side];
    turned = b;
    turned.inserted = true;
    turned.tip_P = pole.tip_P;
    turned.beside_P = Vec3::Zero();
    if (!turn_towards(*ends[side], pole_P, turned)) return std::nullopt;
  }
  return out;
}

}  // namespace trunnion::path
