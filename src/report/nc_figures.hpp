#pragma once
#include <cstddef>
#include <vector>

#include "trunnion/diagnosis/plan.hpp"
#include "trunnion/machine/body_meshes.hpp"
#include "trunnion/machine/machine.hpp"
#include "trunnion/post/verify.hpp"
#include "trunnion/report/page.hpp"

/// Parts of the NC pages.
namespace trunnion::report {

inline constexpr double kUmPerMm = 1e3;

/// The path in the part frame, coloured by tip deviation up to `max_um` (0: its own largest); rapids are
/// gaps, and so are moves far longer than the others.
SpacePlot path_plot(const post::VerifyReport& report, double max_um);

/// Tip deviation of each feed block at its end, um, over the path length.
Series deviation_series(const post::VerifyReport& report, std::string name);

/// A programmed segment (two CL points that are blocks of the program): what it would err if the machine ran
/// it in one move.
struct ProgrammedSegment {
  std::size_t from = 0;  // indices into VerifyReport::blocks
  std::size_t to = 0;
  double straight_um = 0.0;  // largest distance of the tip from the segment, sampled, nominal machine
  double flute_um = 0.0;     // the same of the tool from its tip to its flute length; 0 without one
  std::size_t inserted = 0;
};
std::vector<ProgrammedSegment> programmed_segments(const Machine& machine, const post::VerifyReport& report);

/// True error |e(t)| of the segment run in one move, and what the first harmonic and the parabola make of its
/// midpoint error (paper Eq. 3.3); um over t in [0, 1].
XyPlot model_against_truth(const Machine& machine, const post::VerifyReport& report,
                           const ProgrammedSegment& segment);

/// Index of the block nearest to a place of the worst list.
std::size_t block_of(const post::VerifyReport& report, const post::WorstPlace& place);

/// The machine of this file as solids, its axes at zero; `size_mm` is the radius of what stands on its table.
/// Extents that the machine file does not give follow from that.
Scene machine_solids(const Machine& machine, double size_mm);
/// From where a body stands with the axes at zero to where it stands at the beginning (Scene::ByHand).
Pose standing(const Scene& scene, const Scene::Body& body);

/// A ball that the table carries, its centre with the axes at zero.
Scene::Body ball_on_part(const Machine& machine, const Vec3& centre_M, double radius_mm);

/// The shapes of the machine file in the place of what is drawn for these bodies; the tool stays.
void put_meshes(Scene& scene, const std::vector<BodyMesh>& meshes);

/// Adds a pose of a run; one that is the same as the last is left out, as readings are repeated.
void add_stand(std::vector<Scene::Stand>& stands, const Machine& machine, const std::string& run,
               const JointVector& q);
/// The machine and a list of poses that moves it.
Scene stands_scene(const Machine& machine, std::vector<Scene::Stand> stands);
/// The machine with a slider for each axis.
Scene jog_scene(const Machine& machine, const std::vector<BodyMesh>& meshes);

/// The machine and a list of the poses of planned runs; nothing where none can be taken.
std::optional<Scene> planned_scene(const Machine& machine, const std::vector<diagnosis::PlanRun>& runs);

/// The same with the program: path, columns and the places of the worst blocks. `segments` are those of the
/// report.
struct ProgramSceneInput {
  const Machine& machine;
  const post::VerifyReport& report;
  const std::vector<ProgrammedSegment>& segments;
  const ModelEvaluator* errors = nullptr;  // of the machine, which were compensated or are verified against
  std::string_view nc_text = {}, cl_text = {};
  /// Other programs' deviations as further colours, block by block of `report`.
  struct Beside {
    std::string column, label;
    std::vector<double> um;
  };
  std::vector<Beside> beside = {};
};
Scene program_scene(const ProgramSceneInput& input);

/// Values of the feed blocks of `other`, laid onto those of `carrier`: of every block of `carrier` the
/// largest of those that cut the same part of the way to the same CL point. Both programs are of one CL file.
std::vector<double> laid_onto(const post::VerifyReport& carrier, const post::VerifyReport& other);

}  // namespace trunnion::report
