#pragma once
#include "post/judging/cut_record.hpp"
#include "post/judging/path_follower.hpp"
#include "post/judging/quiet_block.hpp"
#include "post/program_state.hpp"

// Private to the verifier.
namespace trunnion::post {

/// A block of the cut, and the place of the CL path at which it ends. It begins where the path is followed
/// to.
struct CutBlock {
  const Vertex& from;
  const Vertex& to;
  const Place& place;
};

/// How far the tool is off the CL path on a block, for the record. References must outlive the object.
class CutJudge {
 public:
  CutJudge(const DeviationMeter& meter, const PathFollower& path, const ProgramState& program,
           CutRecord& record)
      : meter_(meter), path_(path), program_(program), record_(record) {}

  QuietTest quiet_test(const KnownFigures& known) const {
    return {path_, known, record_.report.max_point_deviation_mm};
  }
  /// The block, whose tip and axis leave straight lines by `nominal` at most on the nominal machine, changes
  /// no figure of the record.
  bool changes_no_figure(const CutBlock& block, const path::Certifier::Bows& nominal,
                         const KnownFigures& known) const;
  /// The same where `quiet` left something open.
  bool proves_quiet(const QuietBlock& quiet, const CutBlock& block, const KnownFigures& known) const;
  /// Takes the deviations of the block, and of the CL points that it passes. True when the block ends at one
  /// of them and a little beyond it.
  bool judge(const CutBlock& block) const;

 private:
  /// A piece of a block that does not pass a CL point, on the part of a segment from t0 to t1.
  struct Piece {
    const Vertex& from;
    const Vertex& to;
    std::size_t segment;
    double t0, t1;
  };
  /// What was found of the flute on a piece: `known_mm` was no figure of interest then, `limit_mm` is
  /// allowed.
  struct FluteFound {
    const DeviationMeter::Beside& beside;
    double known_mm;
    double limit_mm;
    bool in_cone;
  };
  bool keeps_tool(const QuietBlock& quiet, const CutBlock& block, const KnownFigures& known) const;
  /// The tool's axis at the end of the block, by the places of the path that the tip is near.
  void judge_end(const CutBlock& block) const;
  double turn_about(std::size_t segment) const;
  /// What the tool is off beside the tip's place.
  void take_beside(const Piece& piece) const;
  void take_flute_in_cone(const Piece& piece) const;
  /// For whoever collects blocks: the flute's own figure of the piece, no larger than the report's.
  void record_flute(const Piece& piece, const FluteFound& found) const;
  /// A CL point that lies between the ends of a block belongs to the nearer end when that is as near as
  /// compensation, tolerance or the machine's errors explain. True when it is the last one.
  bool mark_nearer(const CutBlock& block, const Target& target) const;

  const DeviationMeter& meter_;
  const PathFollower& path_;
  const ProgramState& program_;
  CutRecord& record_;
};

/// How near the end of a block must be to a CL point to be that point, once the block has been judged.
double near_point_mm(const PathFollower& path, const CutRecord::Block& block);

}  // namespace trunnion::post
