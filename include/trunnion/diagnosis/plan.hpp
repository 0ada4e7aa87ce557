#pragma once
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "trunnion/config/value.hpp"
#include "trunnion/diagnosis/measurement.hpp"
#include "trunnion/effects/model.hpp"

namespace trunnion::diagnosis {

/// Positions in the order of the machine's axes.
struct PlanPoses {
  std::vector<JointVector> poses;
};
/// One axis from one end to the other, the others at `base`.
struct PlanSweep {
  AxisId axis = 0;
  double from = 0.0, to = 0.0;  // mm, rad
  std::size_t points = 2;
  JointVector base;
};
/// A straight line of all axes at once (body diagonals).
struct PlanLine {
  JointVector from, to;
  std::size_t points = 2;
};
/// A full circle of two linear axes (ball-bar): centre at `base`, from the first axis towards the second.
struct PlanCircle {
  AxisId first = 0, second = 1;
  double radius_mm = 100.0;
  std::size_t points = 72;
  JointVector base;
};
/// All combinations of the axes' values, the last axis fastest; with `ball_P` the linear axes follow that
/// point of the part (R-test, touch probe on a ball).
struct PlanGrid {
  std::vector<std::pair<AxisId, std::vector<double>>> values;
  JointVector base;
  std::optional<Vec3> ball_P;
};

/// A value over time: holds until the next (speed) or goes in a straight line to it (temperatures, states).
using PlanProfile = std::vector<std::pair<double, double>>;  // s, value

/// One run of a measuring campaign.
struct PlanRun {
  std::string id;
  double minutes = 0.0;  // what it takes
  Quantity quantity = Quantity::displacement;
  std::vector<Vec3> n;  // unit; one reading each at every pose
  bool radial = false;  // n points from the circle's centre (ball-bar); `n` is empty
  SensitivityFrame frame = SensitivityFrame::machine;
  Vec3 tool_mm = Vec3::Zero();  // from S to the measured point
  PlanProfile spindle_rpm;      // steps
  std::map<std::string, PlanProfile> temperatures_K, states;
  double feed_mm_s = 0.0;      // > 0: read while moving
  double u_random = 0.0;       // mm, rad
  double u_common = 0.0;       // mm, rad
  bool u_common_known = true;  // false: the file leaves it empty, the readings have it all the same
  std::size_t repeat = 1;
  bool both_directions = false;
  std::variant<PlanPoses, PlanSweep, PlanLine, PlanCircle, PlanGrid> path;
};

/// What a virtual machine adds to the readings beside `u_random` and `u_common`; all of it zero by default
/// but the set-up.
struct SimulationNoise {
  double setup_mm = 0.02;      // standard deviation of each run's set-up translation, in P
  double resolution_mm = 0.0;  // readings are whole multiples of it
  double resolution_rad = 0.0;
  double noise_factor = 1.0;  // true over stated random uncertainty
  double outlier_fraction = 0.0;
  double outlier_scale = 15.0;  // of an outlier, in u_random
  double autocorrelation =
      0.0;  // of successive readings of a group within a run (AR(1)), marginal variance kept
  double drift_mm_per_s = 0.0;  // of every displacement group, random sign
};

struct Plan {
  std::vector<PlanRun> runs;
  SimulationNoise noise;
};

Result<Plan> parse_plan(std::string_view toml, const std::string& file, const Machine& machine,
                        Diagnostics& diagnostics);
Result<Plan> load_plan(const std::string& path, const Machine& machine, Diagnostics& diagnostics);

/// One run as it stands in a plan file ([[run]]).
config::Table plan_run_table(const PlanRun& run, const Machine& machine);

/// States and readings (all of value 0) of the plan. Fails where a pose is beyond limits. The runs and
/// sensors follow those of `known`, so that effects made for `known` keep their indices.
Result<Dataset> expand(const std::vector<PlanRun>& runs, const Machine& machine,
                       const EffectContext& known = {});

/// Virtual measurements: the readings that the machine with the errors of `truth` would give (exact forward
/// model), with noise. `data` is expand(plan.runs); the same seed gives the same bytes.
void simulate(Dataset& data, const Plan& plan, const Machine& machine, const Model& truth,
              std::uint64_t seed);

}  // namespace trunnion::diagnosis
