#pragma once
#include <optional>
#include <vector>

#include "path/insertion/even_pieces.hpp"
#include "path/insertion/node_plan.hpp"
#include "path/insertion/pole_passage.hpp"

namespace trunnion::path {

/// The work on one segment at a time, with its scratch memory.
class SegmentRefiner {
 public:
  SegmentRefiner(const Machine& machine, const Vec3& tool_mm, const Rounding& rounding,
                 const NonlinearOptions& options);
  SegmentRefiner(const SegmentRefiner&) = delete;
  SegmentRefiner& operator=(const SegmentRefiner&) = delete;

  SegmentReport refine(const SegmentEnds& ends, const Tolerance& tolerance, std::vector<Point>& out);
  SegmentReport measure(const SegmentEnds& ends, const Tolerance& tolerance);
  /// Refiner::decide.
  SegmentReport decide(const SegmentEnds& ends, const Tolerance& tolerance, double known_mm,
                       std::vector<Point>& out);

  bool predictor_is_below_truth() const { return predictor_is_below_truth_; }
  /// Report of a segment that `decide` has only to look at.
  SegmentReport kept() const {
    SegmentReport report;
    report.certified = options_.certify;
    return report;
  }

  /// How the segment bends, in cells along its ideal path (nodes on the chord and the great circle).
  const Spacing& spacing_of(const SegmentEnds& ends, const Tolerance& tolerance);
  /// NodePlan::tube.
  Tube tube(const Tolerance& tolerance) const { return plan_.tube(tolerance); }
  /// Report of the segment that is started, of which the part from `a` to `b` of a longer piece keeps.
  SegmentReport span_report(const Station& programmed_a, const Station& programmed_b, const Station& a,
                            const Station& b);
  const TableKinematics& kinematics() const { return judge_.kinematics(); }
  const NodeMaker& maker() const { return maker_; }
  const SegmentJudge& judge() const { return judge_; }
  void start(const SegmentEnds& ends, const Tolerance& tolerance);
  /// The same for questions that need no nodes.
  void look_at(const SegmentEnds& ends, const Tolerance& tolerance);

 private:
  using Verdict = SegmentJudge::Verdict;
  using Side = NodePlan::Side;

  bool flute_is_beyond_half_way() const;
  bool needs_points(SegmentReport& report);
  void put_nodes(const SegmentEnds& ends, std::vector<Point>& out) const;
  bool insert(SegmentReport& report);
  NodeAxis choose_axis(bool axis_holds);
  void see_bow(const Vec3& middle_P);
  bool insert_evenly();
  bool insert_nodes(NodeAxis how, Side side, std::size_t least, std::size_t most);
  bool insert_planned(NodeAxis how, Side side, std::size_t pieces);
  bool insert_longest_steps(NodeAxis how, Side side, std::size_t most);
  std::optional<Node> longest_step(const Station& at, double t, double first, NodeAxis how, Side side) const;
  bool insert_on_chord(NodeAxis how);
  bool insert_around_pole(Angle least_turn);
  bool both_sides() const { return options_.method == Method::adaptive && !options_.one_sided; }
  bool insert_two_sided(NodeAxis how);
  bool try_pieces(std::size_t pieces, NodeAxis how, Side side);
  bool all_within() const;
  void judge_pieces(SegmentReport& report) const;
  const Station& station_at(std::size_t i) const;

  Machine machine_;
  Rounding rounding_;
  NonlinearOptions options_;
  SegmentJudge judge_;
  NodeMaker maker_;
  PolePassage pole_;
  EvenPieces even_;
  bool predictor_is_below_truth_;  // it is a value of the curve itself

  SegmentEnds ends_;
  NodePlan plan_;
  struct Bow {
    ToolOff off;          // to where the tool comes half way, from the nearest place of the chord
    bool across = false;  // EvenPieces::bends_across
  };
  Bow bow_;
  std::vector<Place> places_;
  std::vector<Node> nodes_;
};

}  // namespace trunnion::path
