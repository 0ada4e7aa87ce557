// Bounds of a whole tool beside its path, of a few blocks at once, against samples of the machine's own
// motion.
#include "post/judging/tool_beside.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/geom/pose.hpp"
#include "trunnion/machine/kinematics.hpp"
#include "trunnion/path/station_run.hpp"

#include "support/cases.hpp"
#include "support/machines.hpp"

namespace trunnion::post {
namespace {

lanes::Triple<Lanes> in_columns(const Vec3& v) {
  return {lanes::splat<Lanes>(v.x()), lanes::splat<Lanes>(v.y()), lanes::splat<Lanes>(v.z())};
}

// Blocks of up to two degrees, beside segments that are a little elsewhere and turned; parts of both.
TEST(ToolBeside, NoSampleLiesAboveItsBounds) {
  const int cases = test::cases(20000, "TRUNNION_SEGMENTS");
  for (const std::string& name : test::shipped_machines()) {
    const Machine machine = test::shipped_machine(name);
    const TableKinematics kinematics(machine, machine.tool_vector());
    if (!kinematics.side_by_side()) continue;
    std::mt19937_64 random(20261124);
    std::uniform_real_distribution<double> u(-1.0, 1.0);
    path::StationRun run(kinematics);
    double bound_axis = 0.0, sampled_axis = 0.0, bound_mm = 0.0, sampled_mm = 0.0;
    for (int i = 0; i < cases; ++i) {
      JointVector from, to;
      const double step = std::exp(3.0 * u(random) - 3.0);
      for (AxisId id = 0; id < machine.axes.size(); ++id) {
        const bool turns = machine.axes[id].kind == AxisKind::rotary;
        from[id] = turns ? 0.7 + 0.5 * u(random) : 80.0 * u(random);
        to[id] = from[id] + step * u(random) * (turns ? 0.035 : 1.0);
      }
      run.resize(3);
      for (AxisId id = 0; id < kMaxAxes; ++id) {
        run.of_axis(id)[0] = from[id];
        run.of_axis(id)[1] = run.of_axis(id)[2] = to[id];
      }
      run.evaluate();
      const double flute_mm = 1.0 + 99.0 * std::abs(u(random));
      const auto somewhere = [&](double size) { return Vec3(size * Vec3(u(random), u(random), u(random))); };
      const auto beside = [&](const JointVector& q) {
        ToolPose p = kinematics.pose(q);
        p.tip_P += somewhere(0.005);
        p.axis_P = (p.axis_P + somewhere(2e-4)).normalized();
        return p;
      };
      const ToolPose a = beside(from), b = beside(to);
      double x0 = 0.0, x1 = 1.0, t0 = 0.0, t1 = 1.0;
      if (i % 2 == 1) {
        x0 = 0.4 * std::abs(u(random)), x1 = 1.0 - 0.4 * std::abs(u(random));
        t0 = std::clamp(x0 + 0.01 * u(random), 0.0, 1.0), t1 = std::clamp(x1 + 0.01 * u(random), 0.0, 1.0);
      }
      const Chords<Lanes> block(run.poses(), 0);
      const ToolBeside<Lanes> tool(run.poses(), 0, block, flute_mm);
      const SegmentsOf<Lanes> segment(in_columns(a.tip_P), in_columns(a.axis_P), in_columns(b.tip_P),
                                      in_columns(b.axis_P));
      const OffBeside<Lanes> bound = tool.off({lanes::splat<Lanes>(x0), lanes::splat<Lanes>(x1)}, segment,
                                              {lanes::splat<Lanes>(t0), lanes::splat<Lanes>(t1)});
      double most_axis = 0.0, most_mm = 0.0;
      for (int k = 0; k <= 16; ++k) {
        const double x = x0 + (x1 - x0) * k / 16.0;
        const double t = t0 + (t1 - t0) * k / 16.0;
        const ToolPose there = kinematics.pose(JointVector::interpolate(from, to, x));
        const Vec3 tip = there.tip_P - (a.tip_P + t * (b.tip_P - a.tip_P));
        const Vec3 axis = there.axis_P - slerp(a.axis_P, b.axis_P, t);
        most_axis = std::max(most_axis, axis.norm());
        most_mm = std::max({most_mm, tip.norm(), (tip + flute_mm * axis).norm()});
      }
      ASSERT_LE(most_axis, bound.axis[0] + 1e-12) << name << ' ' << i;
      ASSERT_LE(most_mm, bound.mm[0] + 1e-9) << name << ' ' << i;
      bound_axis += bound.axis[0], sampled_axis += most_axis;
      bound_mm += bound.mm[0], sampled_mm += most_mm;
    }
    // And they are bounds that tell something.
    EXPECT_LT(bound_axis, 1.5 * sampled_axis) << name;
    EXPECT_LT(bound_mm, 1.5 * sampled_mm) << name;
  }
}

}  // namespace
}  // namespace trunnion::post
