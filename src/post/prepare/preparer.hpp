#pragma once
#include "trunnion/path/correction_run.hpp"
#include "trunnion/path/even_run.hpp"
#include "trunnion/path/grid_run.hpp"
#include "trunnion/post/post.hpp"

#include "post/intake/chunk.hpp"

namespace trunnion::post {

/// Second stage, for several chunks at once: puts the chosen points on the word grid and refines the segments
/// between them, as far as no other stage decides them. What it makes is taken over by the pipeline
/// where the path comes there from the same point under the same tolerance, so that a chunk's result does not
/// hang on who prepared it.
class Preparer {
 public:
  /// `compensator`: of a machine whose errors hang on the position alone, must outlive the object; or null.
  Preparer(const Machine& machine, const Vec3& tool_mm, const path::Rounding& rounding,
           const PostOptions& options, const path::Compensator* compensator);

  void prepare(Chunk& chunk);

 private:
  void place(Chunk& chunk);
  void refine(Chunk& chunk);
  void correct(Chunk& chunk);
  double beside_mm(const Chunk& chunk, std::size_t i, const Vec3& tip_P, const Vec3& axis_P) const;
  void keep_what_does_not_count(Chunk& chunk);
  void settle(Chunk& chunk);
  void settle_all(Chunk& chunk);
  void decide(Chunk& chunk, std::size_t i, const path::Tolerance& tolerance);
  // The segment surely keeps, changes no figure, and leaves enough to the errors.
  bool settled_on_grid(std::size_t i) const {
    return grid_.keeps(i) && !grid_.counts(i, known_) && grid_.bow_mm(i) <= left_to_errors_mm_;
  }
  path::Rounding rounding_;
  TableKinematics kinematics_;
  path::Refiner refiner_;
  path::GridRun grid_;  // where the machine allows it
  std::optional<path::EvenRun> even_;
  std::optional<path::CorrectionRun> corrections_;
  std::vector<path::CorrectionRun::NominalPlace> places_;  // of the chunk's blocks
  std::vector<Vec3> inserted_tips_P_;                      // at which the correction aims
  std::vector<RotarySines> inserted_sines_;
  std::vector<std::size_t> undecided_;         // segments that the first bounds do not settle
  double left_to_errors_mm_ = 0.0;             // that segments may bow by
  std::vector<double> off_mm_;                 // of the segments, CorrectionRun::NominalPlace::off_mm
  std::vector<TableKinematics::Sines> sines_;  // of the chunk's points elsewhere
  // Figures of the whole program are largest values: what is below one that is known already changes none.
  path::GridRun::Known known_;
  bool whole_runs_;  // the pipeline hands whole runs to the refiner: nothing to prepare
};

}  // namespace trunnion::post
