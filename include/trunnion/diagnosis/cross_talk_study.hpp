#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "trunnion/diagnosis/table_models.hpp"
#include "trunnion/effects/model.hpp"

namespace trunnion::diagnosis {

/// The campaign of the paper on cross-talk (Coatings 2025, 15, 1261) on a simulated three-axis machine: the
/// components of both stacked axes on grids over X and Y, those of Z over its own travel, `runs` runs
/// averaged, each reading with its noise.
struct CrossTalkPlan {
  /// Per axis. The paper's, and 21: four nodes to the shortest wave of the sample (170 mm) along 850 mm.
  std::vector<std::size_t> nodes{7, 9, 11, 15, 21};
  std::size_t main_nodes = 11;
  std::size_t runs = 5;
  /// Standard deviation of one reading: a repeatability R = 4 s of 5.6 um, and an angle sensor's 2 urad.
  double s_displacement_mm = 1.4e-3;
  double s_rotation_rad = 2e-6;
  std::size_t line_points = 41;  // of a diagonal; none on a node
  std::size_t random_points = 1000;
  std::size_t held_out_points = 60;
  std::uint64_t seed = 1;
};

/// One diagonal under one model, peak to valley, mm.
struct DiagonalResult {
  std::string name;        // "T1", "T2", "body +X+Y+Z", ...
  double before = 0.0;     // measured, mean of the runs
  double predicted = 0.0;  // measured before minus what the model predicts
  double measured = 0.0;   // a fresh run with the corrected commands
};

struct StudiedModel {
  std::string name;
  std::size_t nodes = 0;
  double held_out_rms = 0.0;  // on poses that no table has seen; chooses the best
  double held_out_before = 0.0;
  double random_before = 0.0;  // rms of the true error vector at the random points, mm
  double random_after =
      0.0;  // the same with corrected commands: repeatable part, without the noise of a reading
  double random_after_measured = 0.0;  // with it
  std::vector<DiagonalResult> diagonals;
  double evaluation_s = 0.0;  // time for errors and corrected position at one pose
  double reduction() const { return 1.0 - random_after / random_before; }
};

struct CrossTalkStudy {
  double position_x = 0.0, position_y = 0.0;  // peak to valley of the measured positioning on the grid, mm
  double floor = 0.0;                         // rms of the noise vector of a mean of the runs
  std::vector<StudiedModel> models;           // main_nodes first, all models; then the other grids
  std::size_t best = 0;                       // by held-out data, over all
};

/// Runs it. The machine needs linear axes X, Y, Z with limits; `truth` is evaluated as it stands.
/// Deterministic but for the times.
Result<CrossTalkStudy> study_cross_talk(const Machine& machine, const Model& truth,
                                        const CrossTalkPlan& plan);

}  // namespace trunnion::diagnosis
