#pragma once
#include <array>
#include <vector>

#include "trunnion/machine/kinematics.hpp"
#include "trunnion/path/point.hpp"

namespace trunnion::test {

/// X. Li, "Simulation of motion nonlinear error compensation of CNC machine tools with multi-axis linkage",
/// Table 3.2: 20 tool positions on an impeller blade, tip (mm) and tool axis.
inline constexpr std::array<std::array<double, 6>, 20> kTable32{{
    {51.4984, 4.8320, -37.8134, 0.8259, -0.0720, 0.5592},
    {50.6826, 4.2881, -37.3166, 0.8315, -0.0748, 0.5505},
    {49.8963, 3.7208, -36.7989, 0.8370, -0.0776, 0.5418},
    {49.1479, 3.1214, -36.2629, 0.8423, -0.0804, 0.5330},
    {48.4270, 2.5096, -35.7040, 0.8476, -0.0832, 0.5241},
    {47.7376, 1.9901, -35.1263, 0.8527, -0.0860, 0.5152},
    {47.0816, 1.2247, -34.5395, 0.8578, -0.0889, 0.5062},
    {46.4617, 0.5413, -33.9464, 0.8628, -0.0918, 0.4972},
    {45.8699, -0.1495, -33.3338, 0.8676, -0.0947, 0.4882},
    {45.3113, -0.8505, -32.7022, 0.8724, -0.0976, 0.4790},
    {44.7915, -1.5774, -32.0679, 0.8770, -0.1005, 0.4699},
    {44.3058, -2.3069, -31.4100, 0.8815, -0.1035, 0.4606},
    {43.8511, -3.0438, -30.7382, 0.8860, -0.1064, 0.4514},
    {43.4218, -3.8037, -30.0768, 0.8903, -0.1094, 0.4420},
    {43.0247, -4.5475, -29.3775, 0.8945, -0.1124, 0.4327},
    {42.6480, -5.3006, -28.6769, 0.8986, -0.1154, 0.4232},
    {42.2853, -6.0689, -27.9865, 0.9027, -0.1184, 0.4138},
    {41.9514, -6.8326, -27.2762, 0.9066, -0.1214, 0.4043},
    {41.6252, -7.6173, -26.5869, 0.9103, -0.1244, 0.3947},
    {41.3061, -8.4195, -25.9157, 0.9140, -0.1274, 0.3851},
}};

/// The points with the solution nearest to the one before (the first: nearest to zero), as the paper's
/// machine reaches them.
inline std::vector<path::Point> nearest_path(const Machine& machine, const std::vector<ToolPose>& poses) {
  std::vector<path::Point> points;
  JointVector seed;
  for (const ToolPose& pose : poses) {
    const auto solutions = inverse(machine, pose, seed);
    if (solutions.empty()) throw std::runtime_error("a pose out of reach");
    seed = solutions.front().q;
    points.push_back({seed, pose.tip_P, pose.axis_P, {}, false});
  }
  return points;
}

inline std::vector<path::Point> table_3_2_path(const Machine& machine) {
  std::vector<ToolPose> poses;
  for (const auto& row : kTable32) {
    poses.push_back({Vec3(row[0], row[1], row[2]), Vec3(row[3], row[4], row[5]).normalized()});
  }
  return nearest_path(machine, poses);
}

}  // namespace trunnion::test
