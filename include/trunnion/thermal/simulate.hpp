#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "trunnion/geom/vec.hpp"
#include "trunnion/thermal/log.hpp"

namespace trunnion::thermal {

/// Days on which impellers are milled, as in the paper: a cold start, six blades of half an hour, the tool
/// measured against the table after each one. The heat flows and gains are drawn anew for each day within a
/// few per cent, the machine's own are those of `machine_seed`.
struct ImpellerDays {
  int impellers = 7;
  int blades = 6;
  double blade_s = 1800.0;
  double measurement_s = 30.0;  // door open, lasers on: the temperatures dip
  double step_s = 10.0;         // of the temperature log
  double gain = 0.92;           // of all drifts
  std::uint64_t machine_seed = 1;
  std::uint64_t day_seed = 1;
  bool hidden_effects =
      true;  // axial jump with the speed, coolant that nobody logged, one loose sensor, a bias of the day
};

/// Standard uncertainty of one simulated measurement: sensor noise of 1 um and the repeatability of probing
/// and of the machine, 1.5 um. A correction that starts from measurements cannot be much below.
inline constexpr double kMeasurementFloor_mm = 0.0018;

/// What really happened; a program under test never reads it.
struct BladeTruth {
  std::size_t run = 0;
  int blade = 0;                      // from 1
  double begin_s = 0.0, end_s = 0.0;  // of the cut
};
struct SimulatedDays {
  Log log;  // eight temperatures, speed, feed, dx dy dz after each blade
  std::vector<std::vector<Vec3>>
      drift_mm;  // [run][row] deviation of the tool relative to the part, axes of M
  std::vector<BladeTruth> blades;
};

SimulatedDays simulate(const ImpellerDays& days);

/// CSV text of the truth: run_id, time_s, blade (0 while measuring), dx_um, dy_um, dz_um.
std::string truth_text(const SimulatedDays& days);

/// How a blade came out: the largest distance in X and Y of the drift from the correction over its cut (the
/// paper's profile deviation; it took Z as constant).
struct BladeResult {
  BladeResult(std::string run_id, int blade_number) : run(std::move(run_id)), blade(blade_number) {}
  std::string run;
  int blade = 0;
  double before_mm = 0.0;  // uncorrected
  double after_mm = 0.0;
  double before_rms_mm = 0.0;  // of one component, over the cut
  double after_rms_mm = 0.0;

  /// Takes one moment of the cut: the drift and what of it is left.
  void take(const Vec3& drift_mm, const Vec3& left_mm);

 private:
  double moments_ = 0.0;
};
/// Root mean square of one component over all blades.
double rms_mm(const std::vector<BladeResult>& blades, double BladeResult::*deviation);

/// Deviation that is corrected at a row of a run, mm.
using Correction = std::function<Vec3(std::size_t run, std::size_t row)>;
std::vector<BladeResult> assess(const SimulatedDays& days, const Correction& correction);
/// Share of blades whose deviation is at most `tolerance_mm`.
double share_within(const std::vector<BladeResult>& blades, double BladeResult::*deviation,
                    double tolerance_mm);

}  // namespace trunnion::thermal
