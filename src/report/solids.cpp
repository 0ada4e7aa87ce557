// Solids of a machine: as plain as they can be and still show which body is carried by which axis.
#include <algorithm>
#include <cmath>

#include "trunnion/machine/kinematics.hpp"
#include "trunnion/post/proving.hpp"

#include "report/nc_figures.hpp"

namespace trunnion::report {
namespace {

using Corner = std::array<float, 3>;

Corner corner(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// Collects the triangles of a body.
class Solid {
 public:
  explicit Solid(Scene::Body body) : body_{std::move(body)} {}

  void triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
    for (const Vec3* v : {&a, &b, &c}) body_.corners.push_back(corner(*v));
  }
  void quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    triangle(a, b, c);
    triangle(a, c, d);
  }
  /// A box about `middle`; `half` are half its edges along the columns of `axes`, a right-handed system.
  void box(const Vec3& middle, const Mat3& axes, const Vec3& half) {
    const auto at = [&](int x, int y, int z) -> Vec3 {
      return middle + axes * Vec3(x * half.x(), y * half.y(), z * half.z());
    };
    quad(at(1, -1, -1), at(1, 1, -1), at(1, 1, 1), at(1, -1, 1));
    quad(at(-1, 1, -1), at(-1, -1, -1), at(-1, -1, 1), at(-1, 1, 1));
    quad(at(1, 1, -1), at(-1, 1, -1), at(-1, 1, 1), at(1, 1, 1));
    quad(at(-1, -1, -1), at(1, -1, -1), at(1, -1, 1), at(-1, -1, 1));
    quad(at(-1, -1, 1), at(1, -1, 1), at(1, 1, 1), at(-1, 1, 1));
    quad(at(-1, 1, -1), at(1, 1, -1), at(1, -1, -1), at(-1, -1, -1));
  }
  /// A cone's trunk from `from` (radius r0) along `way` to its end (radius r1), with both faces.
  void trunk(const Vec3& from, const Vec3& way, double r0, double r1) {
    constexpr int kSides = 40;
    const Vec3 along = way.normalized();
    const Vec3 across = along.unitOrthogonal();
    const Vec3 third = along.cross(across);
    const Vec3 to = from + way;
    const auto at = [&](const Vec3& middle, double radius, int i) -> Vec3 {
      const double angle = kTwoPi * i / kSides;
      return middle + radius * (std::cos(angle) * across + std::sin(angle) * third);
    };
    for (int i = 0; i < kSides; ++i) {
      quad(at(from, r0, i), at(from, r0, i + 1), at(to, r1, i + 1), at(to, r1, i));
      triangle(from, at(from, r0, i + 1), at(from, r0, i));
      triangle(to, at(to, r1, i), at(to, r1, i + 1));
    }
  }
  Scene::Body done() { return std::move(body_); }

 private:
  Scene::Body body_;
};

// Columns: along `first`, then two across it.
Mat3 system(const Vec3& first) {
  Mat3 out;
  out.col(0) = first;
  out.col(1) = first.unitOrthogonal();
  out.col(2) = first.cross(out.col(1));
  return out;
}

struct Sizes {
  double radius;              // of the table
  double top;                 // of the table along `up` from the axis' point
  Vec3 point = Vec3::Zero();  // on the table's axis
  Vec3 up = Vec3::UnitZ();    // of the table, towards the part
};

// The table's face looks to the spindle where the rotary axes are at zero: whatever way round its axis is
// counted.
Sizes sizes_of(const Machine& machine, double size_mm) {
  Sizes out{size_mm, -0.2 * size_mm, part_in_machine(machine, JointVector{}).p, Vec3::UnitZ()};
  const auto rotary = machine.rotary_axes();
  if (!rotary.empty()) {
    const Axis& inner = machine.axes[rotary.back()];
    out.up = inner.direction.z() < 0.0 ? Vec3(-inner.direction) : inner.direction;
    const Vec3 part = out.point;
    out.point = inner.point_mm;
    out.top = (part - out.point).dot(out.up) - 0.15 * size_mm;
  }
  if (machine.safe.table) {
    out.radius = machine.safe.table->radius_mm;
    out.top = machine.safe.table->top_mm;
  }
  return out;
}

void add_part_side(Scene& scene, const Machine& machine, const Sizes& s) {
  const auto& chain = machine.part_chain;
  const double thick = 0.16 * s.radius;
  Solid table({"table", "table", true, chain.size(), {}});
  const Vec3 face = s.point + s.top * s.up;
  table.trunk(face - thick * s.up, thick * s.up, s.radius, s.radius);
  // A jaw that turns with it: a full turn can be told from none.
  table.box(face + 0.05 * s.radius * s.up + 0.88 * s.radius * system(s.up).col(1), system(s.up),
            Vec3(0.05, 0.1, 0.1) * s.radius);
  scene.bodies.push_back(table.done());
  const double below = s.top - thick;
  const auto rotary = machine.rotary_axes();
  double foot = below - 0.1 * s.radius;
  if (rotary.size() == 2) {
    const Axis& outer = machine.axes[rotary.front()];
    const auto carried =
        static_cast<std::size_t>(std::find(chain.begin(), chain.end(), rotary.front()) - chain.begin()) + 1;
    Solid cradle({"cradle (" + outer.name + ")", "cradle", true, carried, {}});
    const Mat3 axes = [&] {
      Mat3 m;
      m.col(0) = outer.direction;
      m.col(2) = (s.up - s.up.dot(outer.direction) * outer.direction).normalized();
      m.col(1) = m.col(2).cross(m.col(0));
      return m;
    }();
    const Vec3 beam = s.point + (below - 0.14 * s.radius) * s.up;
    cradle.box(beam, axes, Vec3(1.32, 0.5, 0.12) * s.radius);
    const Vec3 at_axis = outer.point_mm + (s.point - outer.point_mm).dot(outer.direction) * outer.direction;
    const double rise = std::max((at_axis - beam).dot(axes.col(2)), 0.0);
    for (const double side : {-1.0, 1.0}) {
      const Vec3 cheek = beam + side * 1.42 * s.radius * axes.col(0) + 0.5 * rise * axes.col(2);
      cradle.box(cheek, axes, Vec3(0.1 * s.radius, 0.4 * s.radius, 0.5 * rise + 0.25 * s.radius));
      cradle.trunk(at_axis + side * 1.5 * s.radius * outer.direction,
                   side * 0.25 * s.radius * outer.direction, 0.2 * s.radius, 0.2 * s.radius);
    }
    scene.bodies.push_back(cradle.done());
    foot = below - 0.9 * s.radius;
  }
  // One slab for each linear axis that carries the part, the bed under the last.
  std::size_t linear = 0;
  for (std::size_t k = chain.size(); k-- > 0;) {
    const Axis& axis = machine.axes[chain[k]];
    if (axis.kind != AxisKind::linear) continue;
    Solid slide({"slide (" + axis.name + ")", "slide", true, k + 1, {}});
    slide.box(s.point + (foot - 0.1 * s.radius - 0.22 * s.radius * static_cast<double>(linear)) * s.up,
              system(axis.direction), Vec3(1.5, 1.1, 0.1) * s.radius);
    ++linear;
    scene.bodies.push_back(slide.done());
  }
  Solid bed({"bed", "bed", true, 0, {}});
  const double deep = foot - 0.22 * s.radius * static_cast<double>(linear) - 0.15 * s.radius;
  bed.box(s.point + deep * s.up, Mat3::Identity(), Vec3(2.1, 1.5, 0.14) * s.radius);
  if (rotary.size() == 2) {  // what the cradle hangs in
    const Axis& outer = machine.axes[rotary.front()];
    const Vec3 at_axis = outer.point_mm + (s.point - outer.point_mm).dot(outer.direction) * outer.direction;
    const double high = std::max(at_axis.z() - (s.point + deep * s.up).z(), 0.2 * s.radius);
    for (const double side : {-1.0, 1.0}) {
      Vec3 post = at_axis + side * 1.85 * s.radius * outer.direction;
      post.z() -= 0.5 * high;
      if (linear == 0)
        bed.box(post, Mat3::Identity(), Vec3(0.12 * s.radius, 0.3 * s.radius, 0.5 * high + 0.2 * s.radius));
    }
  }
  scene.bodies.push_back(bed.done());
}

void add_tool_side(Scene& scene, const Machine& machine, const Sizes& s) {
  const std::size_t all = machine.tool_chain.size();
  const Vec3 spindle_M =
      part_in_machine(machine, JointVector{}) * forward(machine, JointVector{}, Vec3::Zero()).p;
  const double length = std::max(machine.tool_length_mm, 1.0);
  const double wide = std::max(0.18 * s.radius, 12.0);
  const double holder = 0.45 * length;
  Solid spindle({"spindle", "spindle", false, all, {}});
  spindle.trunk(spindle_M, 2.2 * wide * Vec3::UnitZ(), 1.15 * wide, 1.15 * wide);
  spindle.box(spindle_M + 3.2 * wide * Vec3::UnitZ(), Mat3::Identity(), Vec3(1.6, 1.6, 1.0) * wide);
  scene.bodies.push_back(spindle.done());
  Solid clamp({"holder", "holder", false, all, {}});
  clamp.trunk(spindle_M - holder * Vec3::UnitZ(), holder * Vec3::UnitZ(), 0.4 * wide, 0.8 * wide);
  scene.bodies.push_back(clamp.done());
  const double thin = std::clamp(0.03 * length, 1.5, 8.0);
  const double flute = std::min(0.35 * length, length - holder);
  Solid shank({"tool", "tool", false, all, {}});
  shank.trunk(spindle_M - (length - flute) * Vec3::UnitZ(), (length - flute - holder) * Vec3::UnitZ(), thin,
              thin);
  scene.bodies.push_back(shank.done());
  Solid cutter({"flute", "flute", false, all, {}});
  cutter.trunk(spindle_M - length * Vec3::UnitZ(), flute * Vec3::UnitZ(), 0.35 * thin, thin);
  scene.bodies.push_back(cutter.done());
}

}  // namespace

Scene::Body ball_on_part(const Machine& machine, const Vec3& centre_M, double radius_mm) {
  constexpr int kRings = 12;
  Solid ball({"ball", "ball", true, machine.part_chain.size(), {}});
  for (int ring = 0; ring < kRings; ++ring) {
    const double low = kPi * ring / kRings;
    const double high = kPi * (ring + 1) / kRings;
    const Vec3 from = centre_M - radius_mm * std::cos(low) * Vec3::UnitZ();
    ball.trunk(from, radius_mm * (std::cos(low) - std::cos(high)) * Vec3::UnitZ(), radius_mm * std::sin(low),
               radius_mm * std::sin(high));
  }
  return ball.done();
}

Scene machine_solids(const Machine& machine, double size_mm) {
  Scene out;
  out.chains.tool = machine.tool_chain;
  out.chains.part = machine.part_chain;
  out.zero.tool_length_mm = machine.tool_length_mm;
  const Pose X_MP = part_in_machine(machine, JointVector{});
  out.zero.part_M = corner(X_MP.p);
  out.zero.spindle_M = corner(X_MP * forward(machine, JointVector{}, Vec3::Zero()).p);
  const auto words = post::describe_axes(machine);
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const Axis& axis = machine.axes[id];
    const bool rotary = axis.kind == AxisKind::rotary;
    Scene::SceneAxis one;
    one.name = axis.name;
    one.rotary = rotary;
    one.direction = corner(axis.direction);
    one.point = corner(axis.point_mm);
    if (axis.has_limits()) {
      one.min = axis.min * (rotary ? kDegreePerRad : 1.0);
      one.max = axis.max * (rotary ? kDegreePerRad : 1.0);
    }
    one.carries_part = axis.carries_part;
    const auto said =
        std::find_if(words.begin(), words.end(), [&](const auto& w) { return w.name == axis.name; });
    if (said != words.end()) one.motion = said->motion;
    out.axes.push_back(std::move(one));
  }
  const Sizes sizes = sizes_of(machine, size_mm);
  out.size_mm = sizes.radius;
  add_part_side(out, machine, sizes);
  add_tool_side(out, machine, sizes);
  return out;
}

void put_meshes(Scene& scene, const std::vector<BodyMesh>& meshes) {
  constexpr std::size_t kMostTriangles = 60'000;  // of a body on a page
  const auto is_tool = [](const Scene::Body& b) {
    return b.role == "tool" || b.role == "flute" || b.role == "holder";
  };
  const auto same_place = [](const Scene::Body& b, const BodyMesh& m) {
    return b.axes == m.axes && (b.on_part_side == m.on_part_side || m.axes == 0);
  };
  std::erase_if(scene.bodies, [&](const Scene::Body& b) {
    return !is_tool(b) &&
           std::any_of(meshes.begin(), meshes.end(), [&](const BodyMesh& m) { return same_place(b, m); });
  });
  for (const BodyMesh& mesh : meshes) {
    const auto& chain = mesh.on_part_side ? scene.chains.part : scene.chains.tool;
    const bool last = mesh.axes == chain.size();
    const char* role = mesh.axes == 0      ? "bed"
                       : mesh.on_part_side ? (last ? "table" : "cradle")
                                           : (last ? "spindle" : "slide");
    scene.bodies.push_back(
        {mesh.name, role, mesh.on_part_side, mesh.axes, coarsened(mesh.corners, kMostTriangles)});
  }
}

Pose standing(const Scene& scene, const Scene::Body& body) {
  const Scene::ByHand& by_hand = scene.by_hand;
  const bool at_stand = by_hand.start.empty() && !by_hand.stands.empty();
  const std::vector<double>& q = at_stand ? by_hand.stands.front().q : by_hand.start;
  const std::vector<std::size_t>& chain = body.on_part_side ? scene.chains.part : scene.chains.tool;
  Pose out;
  for (std::size_t i = 0; i < std::min(body.axes, chain.size()) && !q.empty(); ++i) {
    const Scene::SceneAxis& axis = scene.axes[chain[i]];
    const Vec3 direction(axis.direction[0], axis.direction[1], axis.direction[2]);
    const Vec3 point(axis.point[0], axis.point[1], axis.point[2]);
    const double at = q[chain[i]];
    out = out * (axis.rotary ? Pose::rotation(direction, point, Angle::degrees(at))
                             : Pose{Mat3::Identity(), at * direction});
  }
  return out;
}

}  // namespace trunnion::report
