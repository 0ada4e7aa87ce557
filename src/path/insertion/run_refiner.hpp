#pragma once
#include <span>
#include <vector>

#include "path/insertion/segment_refiner.hpp"

namespace trunnion::path {

/// What needs more than one segment at a time: programmed points that move, and points that are dropped.
class RunRefiner {
 public:
  RunRefiner(const Machine& machine, const Vec3& tool_mm, const Rounding& rounding,
             const NonlinearOptions& options)
      : machine_(machine),
        rounding_(rounding),
        options_(options),
        segment_(machine_, tool_mm, rounding, options) {}
  RunRefiner(const RunRefiner&) = delete;
  RunRefiner& operator=(const RunRefiner&) = delete;

  void refine(std::span<const Point> run, const Tolerance& tolerance, std::vector<Point>& out,
              std::vector<SegmentReport>& reports);
  SegmentRefiner& segment() { return segment_; }

 private:
  void move_points(std::span<const Point> run, const Tolerance& tolerance);
  void plan_moves(std::span<const Point> run, const Tolerance& tolerance);
  void keep_neighbours(std::span<const Point> run, const Tolerance& tolerance);
  void place(std::span<const Point> run, std::size_t i);
  SegmentEnds ends(std::span<const Point> run, std::size_t i) const;
  std::size_t reach(std::span<const Point> run, std::size_t first, const Tolerance& tolerance);
  bool one_piece(std::span<const Point> run, std::size_t first, std::size_t last, const Tolerance& tolerance);

  Machine machine_;
  Rounding rounding_;
  NonlinearOptions options_;
  SegmentRefiner segment_;

  std::vector<Station> stations_;      // where each programmed point of the run stands
  std::vector<SegmentReport> before_;  // each segment as programmed
  std::vector<ToolOff> moves_;         // displacement of the tool at each programmed point
  struct Need {
    double length = 0.0;  // I of the segment
    double share = 0.0;   // displacement of its ends that saves points, in tolerances
    ToolOff against0, against1;
  };
  std::vector<Need> needs_;
  std::vector<SegmentReport> dropped_;  // of the segments that one piece spans
};

}  // namespace trunnion::path
