// 3+2: tilted planes of the controls.
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "trunnion/post/plane_frame.hpp"

#include "post/posting.hpp"
#include "support/cases.hpp"

namespace trunnion::post {
namespace {

using nc::PlaneAngles;
using test::posted;

constexpr double kDeg = kRadPerDegree;

// What the manuals say the angles do, written out by hand for one turn each and for two.
TEST(PlaneAngles, ConventionsAreThoseOfTheManuals) {
  const double s = 0.5;
  const double c = std::sqrt(0.75);
  // G68.2 I J K: about Z, then the new X, then the new Z. I90 J30: the plane leans about Y of the part, so
  // that its Z points to +X.
  EXPECT_TRUE(plane_axes(PlaneAngles::euler_zxz, {0, 30 * kDeg, 0}).col(2).isApprox(Vec3(0, -s, c), 1e-12));
  EXPECT_TRUE(
      plane_axes(PlaneAngles::euler_zxz, {90 * kDeg, 30 * kDeg, 0}).col(2).isApprox(Vec3(s, 0, c), 1e-12));
  EXPECT_TRUE(
      plane_axes(PlaneAngles::euler_zxz, {0, 30 * kDeg, 90 * kDeg}).col(0).isApprox(Vec3(0, c, s), 1e-12));
  // CYCLE800 axis by axis: about X, then the new Y. A90 B30: Z of the plane first lies along -Y, then turns
  // about the new Y (the old Z).
  EXPECT_TRUE(
      plane_axes(PlaneAngles::euler_xyz, {90 * kDeg, 30 * kDeg, 0}).col(2).isApprox(Vec3(s, -c, 0), 1e-12));
  EXPECT_TRUE(plane_axes(PlaneAngles::euler_xyz, {0, 30 * kDeg, 0}).col(2).isApprox(Vec3(s, 0, c), 1e-12));
  // PLANE SPATIAL: about the fixed X, then the fixed Y. SPA90 SPB30: Z first lies along -Y and stays there.
  EXPECT_TRUE(
      plane_axes(PlaneAngles::fixed_xyz, {90 * kDeg, 30 * kDeg, 0}).col(2).isApprox(Vec3(0, -1, 0), 1e-12));
  EXPECT_TRUE(
      plane_axes(PlaneAngles::fixed_xyz, {30 * kDeg, 0, 90 * kDeg}).col(2).isApprox(Vec3(s, 0, c), 1e-12));
}

TEST(PlaneAngles, AnglesOfAxesGiveTheAxes) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> u(-kPi, kPi);
  for (const auto convention : {PlaneAngles::euler_zxz, PlaneAngles::euler_xyz, PlaneAngles::fixed_xyz}) {
    for (int i = 0; i < 2000; ++i) {
      // Multiples of 90 degrees among them: where two angles turn about one line.
      const auto angle = [&] {
        return i % 4 == 0 ? std::round(2.0 * u(random) / kPi) * 0.5 * kPi : u(random);
      };
      const Mat3 R = rotation_about(Vec3::UnitZ(), Angle::radians(angle())) *
                     rotation_about(Vec3::UnitY(), Angle::radians(angle())) *
                     rotation_about(Vec3::UnitX(), Angle::radians(angle()));
      EXPECT_LT((plane_axes(convention, plane_angles(convention, R)) - R).norm(), 1e-9);
    }
  }
}

// A pocket on a face that is tilted by `tilt` towards `turn`, a second one on another face, and a five-axis
// cut.
std::string pockets(const std::vector<std::array<double, 2>>& faces) {
  std::string cl = "MULTAX/ON\nLOADTL/4\nSPINDL/RPM,9000,CLW\nFEDRAT/MMPM,700\n";
  const auto point = [&](const Vec3& p, const Vec3& u) {
    cl += "GOTO/" + fixed_text(p.x(), 5) + "," + fixed_text(p.y(), 5) + "," + fixed_text(p.z(), 5) + "," +
          fixed_text(u.x(), 9) + "," + fixed_text(u.y(), 9) + "," + fixed_text(u.z(), 9) + "\n";
  };
  for (const auto& [tilt, turn] : faces) {
    const Mat3 R = rotation_about(Vec3::UnitZ(), Angle::degrees(turn)) *
                   rotation_about(Vec3::UnitY(), Angle::degrees(tilt));
    const Vec3 o(5, -3, 10);
    const Vec3 z = R.col(2);
    cl += "RAPID\n";
    point(o + R * Vec3(0, 0, 40), z);
    cl += "RAPID\n";
    point(o + R * Vec3(0, 0, 2), z);
    for (const Vec3& corner : {Vec3(0, 0, -1), Vec3(20, 0, -1), Vec3(20, 12, -1), Vec3(0, 12, -1)})
      point(o + R * corner, z);
    cl += "RAPID\n";
    point(o + R * Vec3(0, 12, 40), z);
  }
  return cl;
}

TEST(TiltedPlane, ConstantToolAxesAreWrittenInThePlaneAndReadBack) {
  for (const char* control : {"fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640"}) {
    for (const char* name : {"trunnion_offset", "paper", "nutating_45", "xyzac_trt"}) {
      const Machine machine = test::shipped_machine(name);
      PostOptions options;
      options.tilted_plane = true;
      const std::string cl = pockets({{35, 110}, {35, 110}, {20, -70}, {0, 0}, {28, 15}});
      const auto p = posted(cl, machine, options, control);
      ASSERT_TRUE(p.report) << control << " " << name << " " << p.report.error().text();
      const VerifyReport& v = *p.report->verification;
      EXPECT_TRUE(v.passed()) << control << " " << name << " tip " << v.certified_tip_deviation_mm
                              << " missed " << v.points_missed << " axis " << v.max_axis_deviation.deg();
      EXPECT_EQ(p.report->tilted_planes, 4U)
          << control << " " << name;  // the second pocket stays in the first one's
      EXPECT_LT(v.max_point_deviation_mm, 0.0009) << control << " " << name;
      EXPECT_EQ(p.report->points_inserted, 0U);
    }
  }
}

// A control counts the origin of a plane from its work offset, as it does X Y Z before the plane; inside of
// it the words are the same wherever the offset is.
TEST(TiltedPlane, OriginCountsFromTheWorkOffset) {
  Machine machine = test::shipped_machine("trunnion_offset");
  machine.part_zero_mm = Vec3(10, 20, -30);
  PostOptions options;
  options.tilted_plane = true;
  const std::string cl = pockets({{35, 110}, {20, -70}});
  const std::array<std::array<const char*, 3>, 3> controls = {
      {{"fanuc_30i", "G68.2 X0. Y0. Z0. I", "G68.2 X11. Y22. Z-27. I"},
       {"siemens_840d_sl", ",57,0,0,0,", ",57,11,22,-27,"},
       {"heidenhain_tnc640", "CYCL DEF 7.3 Z+0\n", "CYCL DEF 7.3 Z-27\n"}}};
  for (const auto& [control, at_part, beside] : controls) {
    std::vector<std::string> in_plane;
    for (const Vec3& offset : {machine.part_zero_mm, Vec3(-1, -2, -3)}) {
      machine.work_offset_mm = offset;
      const auto p = posted(cl, machine, options, control);
      ASSERT_TRUE(p.report) << control << p.report.error().text();
      EXPECT_TRUE(p.report->verification->passed()) << control;
      const bool is_at_part = offset == machine.part_zero_mm;
      const auto begins = p.nc.find(is_at_part ? at_part : beside);
      ASSERT_NE(begins, std::string::npos) << control << p.nc;
      const auto feed = p.nc.find("F700", begins);
      // Behind the block number.
      const auto words = p.nc.find(' ', p.nc.rfind('\n', feed));
      in_plane.push_back(p.nc.substr(words, feed - words));
      // Another origin is another place.
      std::string moved = p.nc;
      if (!is_at_part) {
        moved.replace(begins, std::string(beside).size(), at_part);
        const auto v = test::verified(moved, cl, machine, options.tolerance_mm, control);
        EXPECT_FALSE(v && v->passed()) << control;
      }
    }
    EXPECT_EQ(in_plane[0], in_plane[1]) << control;
  }
}

// A line of a template whose others do not come is found, though a whole template follows: X of a datum shift
// that the control has not been told of.
TEST(TiltedPlane, ALoneLineOfATemplateIsFound) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  PostOptions options;
  options.tilted_plane = true;
  const std::string cl = pockets({{35, 110}, {20, -70}});
  const auto p = posted(cl, machine, options, "heidenhain_tnc640");
  ASSERT_TRUE(p.report) << p.report.error().text();
  const auto with = [&](const std::string& line) {
    std::string nc = p.nc;
    const auto shift = nc.find("CYCL DEF 7.0");
    nc.insert(nc.rfind('\n', shift) + 1, line);
    const auto v = test::verified(nc, cl, machine, options.tolerance_mm, "heidenhain_tnc640");
    return v && v->passed();
  };
  EXPECT_TRUE(with(""));
  EXPECT_TRUE(with("; a remark\n"));
  EXPECT_FALSE(with("CYCL DEF 7.1 X+5\n"));
}

// The same path without the planes has the same machine positions: two ways through the code and the words.
TEST(TiltedPlane, MachineStandsWhereItStandsWithoutThePlane) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl = pockets({{35, 110}, {20, -70}});
  for (const char* control : {"fanuc_30i", "siemens_840d_sl", "heidenhain_tnc640"}) {
    PostOptions options;
    options.collect = true;
    const auto plain = posted(cl, machine, options, control);
    options.tilted_plane = true;
    const auto tilted = posted(cl, machine, options, control);
    ASSERT_TRUE(plain.report && tilted.report) << control;
    std::size_t compared = 0;
    for (const VerifiedBlock& block : plain.report->verification->blocks) {
      if (!block.programmed) continue;
      ++compared;
      const auto same = [&](const VerifiedBlock& other) {
        bool all = std::abs(std::remainder(block.q[4] - other.q[4], kTwoPi)) < 0.003 * kDeg &&
                   std::abs(block.q[3] - other.q[3]) < 0.002 * kDeg;
        for (AxisId id = 0; id < 3; ++id) all = all && std::abs(block.q[id] - other.q[id]) < 0.004;
        return all;
      };
      const auto& others = tilted.report->verification->blocks;
      EXPECT_TRUE(std::any_of(others.begin(), others.end(), same)) << control << " NC line " << block.nc_line;
    }
    EXPECT_GE(compared, 8U);
  }
}

// A wrong angle of the plane, or a wrong convention of the control's angles, does not pass.
// Where the plane is left the words have the grid of the joints again: F counts from there.
TEST(TiltedPlane, AxesKeepTheirSpeedsBehindIt) {
  std::mt19937_64 random(20261128);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (int i = 0; i < test::cases(60); ++i) {
    const double tilt = 0.15 + 0.1 * u(random);
    const double turn = 3.0 * u(random);
    const auto go = [&](double more, const Vec3& tip) {
      std::string out = "GOTO/";
      for (const double x : {tip.x(), tip.y(), tip.z()}) out += fixed_text(x, 4) + ",";
      return out + fixed_text(std::sin(tilt) * std::cos(turn + more), 9) + "," +
             fixed_text(std::sin(tilt) * std::sin(turn + more), 9) + "," + fixed_text(std::cos(tilt), 9) +
             "\n";
    };
    const Vec3 at(20.0 * u(random), 20.0 * u(random), 20.0);
    std::string cl = "FEDRAT/MMPM,20000\nRAPID\n" + go(0.0, at + Vec3(0, 0, 20)) + go(0.0, at) +
                     go(0.0, at + Vec3(3, 2, 0)) + "RAPID\n" + go(0.0, at + Vec3(0, 0, 20)) + "RAPID\n" +
                     go(0.1, at + Vec3(1, 1, 20));
    for (int k = 2; k < 8; ++k) cl += go(0.1 * k, at + Vec3(k, u(random), 20));
    PostOptions options;
    options.tilted_plane = true;
    const std::string control = i % 3 == 0   ? "heidenhain_tnc640"
                                : i % 3 == 1 ? "siemens_840d_sl"
                                             : "fanuc_30i";
    const auto p = posted(cl + "FINI\n", test::shipped_machine("trunnion_offset"), options, control);
    ASSERT_TRUE(p.report) << p.report.error().text();
    EXPECT_GT(p.report->feed_time_lost_s, 0.0);
    EXPECT_EQ(p.report->verification->too_fast_count, 0U) << p.nc;
    EXPECT_TRUE(p.report->verification->passed()) << cl << p.nc;
  }
}

// The angles of the plane are rounded, and the ways of the axes with them.
TEST(TiltedPlane, AxesKeepTheirSpeedsInIt) {
  std::mt19937_64 random(20261130);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (int i = 0; i < test::cases(60); ++i) {
    Machine machine = test::shipped_machine(i % 2 == 0 ? "trunnion_offset" : "xyzac_trt");
    for (Axis& axis : machine.axes) {
      if (axis.kind == AxisKind::linear) axis.max_feed = 10.0 + 5.0 * u(random);
    }
    const Vec3 axis = Vec3(0.5 * u(random), 0.5 * u(random), 1.0).normalized();
    const Vec3 e1 = axis.cross(Vec3(u(random), 1.0, u(random))).normalized();
    const Vec3 e2 = axis.cross(e1);
    const auto go = [&](const Vec3& tip) {
      std::string out = "GOTO/";
      for (const Vec3& v : {tip, axis}) {
        for (int k = 0; k < 3; ++k) out += fixed_text(v[k], 6) + ",";
      }
      out.back() = '\n';
      return out;
    };
    const Vec3 at(20.0 * u(random), 20.0 * u(random), 20.0);
    std::string cl = "FEDRAT/MMPM,8000\nRAPID\n" + go(at);
    for (int k = 0; k < 20; ++k) cl += go(at + 3.0 * u(random) * e1 + 3.0 * u(random) * e2);
    PostOptions options;
    options.tilted_plane = true;
    const std::string control = i % 3 == 0   ? "heidenhain_tnc640"
                                : i % 3 == 1 ? "siemens_840d_sl"
                                             : "fanuc_30i";
    const auto p = posted(cl + "FINI\n", machine, options, control);
    ASSERT_TRUE(p.report) << p.report.error().text();
    EXPECT_TRUE(p.report->verification->passed()) << cl << p.nc;
    EXPECT_GT(p.report->verification->max_speed_ratio, 0.9999);
    for (Axis& a : machine.axes) {
      if (a.kind == AxisKind::linear) a.max_feed = *a.max_feed * 0.9995;
    }
    const auto on_slower = test::verified(p.nc, cl + "FINI\n", machine, 0.01, control);
    ASSERT_TRUE(on_slower);
    EXPECT_GT(on_slower->too_fast_count, 0U);
    EXPECT_FALSE(on_slower->passed());
  }
}

TEST(TiltedPlane, AWrongAngleFailsTheVerification) {
  const Machine machine = test::shipped_machine("trunnion_offset");
  const std::string cl = pockets({{35, 110}});
  PostOptions options;
  options.tilted_plane = true;
  std::string text = posted(cl, machine, options, "fanuc_30i").nc;
  ASSERT_TRUE(test::verified(text, cl, machine, 0.01, "fanuc_30i")->passed());
  const auto at = text.find(" J", text.find("G68.2"));
  ASSERT_NE(at, std::string::npos);
  const auto end = text.find(' ', at + 2);
  const auto number = parse_number(std::string_view(text).substr(at + 2, end - at - 2));
  text.replace(at + 2, end - at - 2, fixed_text(number.value + 0.2, 3));
  EXPECT_FALSE(test::verified(text, cl, machine, 0.01, "fanuc_30i")->passed());
}

TEST(TiltedPlane, ControlsWithoutOneRefuse) {
  PostOptions options;
  options.tilted_plane = true;
  const auto p = posted(pockets({{35, 110}}), test::shipped_machine("trunnion_offset"), options, "linuxcnc");
  ASSERT_FALSE(p.report);
  EXPECT_EQ(p.report.error().code, ErrorCode::wrong_use);
}

}  // namespace
}  // namespace trunnion::post
