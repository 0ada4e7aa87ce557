#pragma once
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "trunnion/path/flute.hpp"
#include "trunnion/path/nonlinear.hpp"

#include "path/insertion/even_pieces.hpp"
#include "path/insertion/node_maker.hpp"
#include "path/insertion/spacing.hpp"

namespace trunnion::path {

/// One segment as it is refined: its programmed ends, and where they stand when they were moved.
struct SegmentEnds {
  const Point* a = nullptr;  // as programmed
  const Point* b = nullptr;
  const Station* at_a = nullptr;  // where the machine stands
  const Station* at_b = nullptr;
  bool moved = false;
};

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
  /// What the tolerance leaves for the bow when the words are rounded.
  Tube tube(const Tolerance& tolerance) const;
  /// Report of the segment that is started, of which the part from `a` to `b` of a longer piece keeps.
  SegmentReport span_report(const Station& programmed_a, const Station& programmed_b, const Station& a,
                            const Station& b);
  const TableKinematics& kinematics() const { return certifier_.kinematics(); }
  const NodeMaker& maker() const { return maker_; }
  bool piece_within(const Station& a, const Station& b) const {
    return piece_verdict(a, b) != Verdict::beyond;
  }
  /// The same between these fractions of the segment, about.
  bool piece_within(const Station& a, const Station& b, const FluteCertifier::Places& about) const {
    return (flute_ ? flute_verdict(a, b, about) : piece_verdict(a, b)) != Verdict::beyond;
  }
  void start(const SegmentEnds& ends, const Tolerance& tolerance);
  /// The same for questions that need no nodes.
  void look_at(const SegmentEnds& ends, const Tolerance& tolerance);

 private:
  /// `sampled`: within, as far as samples can tell.
  enum class Verdict : std::uint8_t { beyond, sampled, proved };
  /// `off_axis2`: square of what the axes at the ends are at most off some axes of the reference.
  /// And where its tip is in the middle, if that is known, and how far its ends are off the reference at
  /// most.
  Verdict piece_verdict(const Station& a, const Station& b,
                        double off_axis2 = std::numeric_limits<double>::infinity(),
                        const Vec3* known_middle_P = nullptr, std::optional<double> ends_mm = {}) const;
  bool flute_is_beyond_half_way() const;
  Verdict flute_verdict(const Station& a, const Station& b, const FluteCertifier::Places& about) const;
  Verdict tip_verdict(const Station& a, const Station& b, const Vec3* known_middle_P, double ends_mm) const;
  double off_mm(const Vec3& tip_P) const {
    return distance_to_segment(tip_P, reference_.tip0_P, reference_.tip1_P);
  }
  enum class Side : std::uint8_t { on_chord, two_sided };
  static constexpr std::size_t kFewestCells = 4;

  bool needs_points(SegmentReport& report);
  bool axis_surely_within(const Station& a, const Station& b, double off_axis2) const;
  void put_nodes(const SegmentEnds& ends, std::vector<Point>& out) const;
  bool insert(SegmentReport& report);
  void see_bow(const Vec3& middle_P);
  bool axis_holds() const;
  bool insert_evenly();
  bool insert_nodes(NodeAxis how, Side side, std::size_t least, std::size_t most);
  bool insert_planned(NodeAxis how, Side side, std::size_t pieces);
  bool insert_longest_steps(NodeAxis how, Side side, std::size_t most);
  std::optional<Node> longest_step(const Station& at, double t, double first, NodeAxis how, Side side) const;
  bool insert_on_chord(NodeAxis how);
  bool insert_around_pole();
  /// The pole between the ends of a segment, and the positions in which the axes come there and leave.
  struct AtPole {
    double share = 0.0;  // of the chord
    std::array<Point, 2> turned;
  };
  std::optional<AtPole> turned_on_the_way() const;
  bool passes_pole() const;
  std::optional<Point> turned_at_pole(const Point& end, const Station& at, const Point& other) const;
  bool turn_towards(const Point& end, const Vec3& pole_P, Point& turned) const;
  bool both_sides() const { return options_.method == Method::adaptive && !options_.one_sided; }
  bool insert_two_sided(NodeAxis how);
  bool try_pieces(std::size_t pieces, NodeAxis how, Side side);
  bool all_within() const;
  NodeAxis choose_axis(bool axis_holds);
  void cells_along(NodeAxis how, std::size_t count);
  void cells_of_nodes(std::size_t least);
  void add_cell(const Station& a, const Station& b, double t0, double t1);
  void use_cells(NodeAxis how);
  Vec3 within_reference(const Vec3& bow, double t);
  ToolOff flute_bow(const Station& a, const Station& b, double t0, double t1, const ToolPose& middle);
  ToolOff between_ends(const ToolOff& displacement, double t) const;
  bool subtract(const Station& a, const Station& b, double t0, double t1, int halvings);
  bool subtract_evenly(const Station& a, const Station& b, double t0, double t1, const ErrorModel& model);
  /// The largest deviations of some pieces.
  struct Largest {
    double tip_mm = 0.0;
    double axis_rad = 0.0;
    double flute_mm = 0.0;
  };
  void judge(const Station& a, const Station& b, Largest& largest) const;
  FluteCertifier flute_certifier() const {
    using Tip = FluteCertifier::Tip;
    return FluteCertifier(kinematics(), options_.straight_tip ? Tip::straight : Tip::as_axes_go);
  }
  bool flute_surely_within(const Station& a, const Station& b) const;
  void judge_pieces(SegmentReport& report) const;
  double largest_turn() const;
  const Station& station_at(std::size_t i) const;

  Machine machine_;
  Rounding rounding_;
  NonlinearOptions options_;
  Certifier certifier_;
  NodeMaker maker_;
  EvenPieces even_;
  /// What rounding of the words makes at most.
  struct WordError {
    double tip_mm = 0.0;    // of the linear words
    double axis_rad = 0.0;  // of the rotary words, about two axes at right angles to the tool
  };
  WordError word_error_;
  bool predictor_is_below_truth_;  // it is a value of the curve itself

  SegmentEnds ends_;
  Tolerance tolerance_;
  Reference reference_;
  /// Where the flute counts: the segment, and the part of it that nodes are planned for.
  struct Flute {
    FluteSegment whole, part;
  };
  std::optional<Flute> flute_;
  struct Bow {
    ToolOff off;          // to where the tool comes half way, from the nearest place of the chord
    bool across = false;  // EvenPieces::bends_across
  };
  Bow bow_;
  std::array<double, 2> displaced_{};  // the ends, against the bow, in tolerances
  std::vector<Cell> cells_;
  double largest_cell_turn_ = 0.0;
  bool crowded_ = false;  // motion along the segment reaches its ends: the cells ask for more than is needed
  Spacing spacing_;
  std::vector<Place> places_;
  std::vector<Node> nodes_;
};

}  // namespace trunnion::path
