#pragma once
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "trunnion/path/nonlinear.hpp"

namespace trunnion::path {

/// Segments that are judged a few at a time, and given as many even pieces as their bow asks for: what
/// Refiner::decide makes of each, nodes to the last bit. It settles those of which the closed forms prove
/// that every piece keeps to the tolerance, and says nothing of the others. For machines that TableKinematics
/// evaluates side by side.
class EvenRun {
 public:
  /// `kinematics` and `rounding` must outlive the object.
  EvenRun(const Machine& machine, const TableKinematics& kinematics, const Rounding& rounding,
          const NonlinearOptions& options);
  ~EvenRun();
  EvenRun(EvenRun&&) noexcept;

  /// An end of a segment: on the word grid at `q`, with the sines of its rotary positions.
  struct End {
    const JointVector* q;
    const RotarySines* sines;
    const ToolPose* prescribed;
  };
  struct Segment {
    End from, to;
    SourceRef where;     // of its end
    std::size_t number;  // its name for who hands it in
  };
  /// What came of a segment: `inserted` points from `first` on, of those that `settle` appends; the report's
  /// `midpoint_mm` and `predicted_mm` (0 where that is at most `known_mm` and no more is known); and by how
  /// much the tip, or where it counts the whole tool, leaves the segment at most, on the nominal machine.
  struct Settled {
    std::size_t number;
    std::uint32_t first, inserted;
    double midpoint_mm, predicted_mm, off_mm;
  };

  /// False: with these options it settles none.
  static bool settles(const NonlinearOptions& options) {
    return (options.method == Method::reinsert || options.method == Method::adaptive) &&
           (options.predictor.kind == Predictor::Kind::exact || options.predictor.middle_is_largest());
  }
  void clear() { segments_.clear(); }
  void add(const Segment& segment) { segments_.push_back(segment); }
  /// The segments that were added, in any order. Those whose predicted error is not known to be at most
  /// `known_mm` are left out. An `off_mm` of `enough_mm` is not made sharper.
  std::span<const Settled> settle(const Tolerance& tolerance, double enough_mm, double known_mm,
                                  std::vector<Point>& out);
  /// Of those that were left out because `known_mm` was too small, so far, the one that bows farthest.
  std::optional<std::size_t> widest_unknown() const { return widest_; }

 private:
  static constexpr std::size_t kMost = lanes::kCount<Quads>;  // at a time
  static constexpr std::size_t kMostPieces = 32;
  using Few = std::array<const Segment*, kMost>;
  struct Work;
  struct Count {
    std::array<std::int64_t, kMost> pieces;  // 1: it keeps as it is; 0: the general way has to look at it
    std::array<double, kMost> midpoint_mm;
    std::array<double, kMost> bow_mm, off_mm;
  };
  struct Division {
    std::array<std::int64_t, kMost> keeps;
    std::array<double, kMost> off_mm;
  };
  template <class T>
  void count(Count& out) const;
  template <class T>
  void divide(const Few& few, std::size_t pieces, std::array<Point*, kMost> out, Division& division) const;
  void divide_all(std::size_t pieces, std::vector<Point>& out);
  /// These segments, which are loaded; the first `count` of them count.
  void divide_few(const std::array<std::uint32_t, kMost>& segments, std::size_t count, std::size_t pieces,
                  std::vector<Point>& out);

  lanes::Way way_;
  bool exact_;            // predictor; else what it predicts is the bow in the middle
  bool prediction_asks_;  // for points, whatever is proved
  Tolerance tolerance_;
  double enough_mm_ = 0.0;
  double known_mm_ = 0.0;
  std::unique_ptr<Work> work_;
  std::vector<Segment> segments_;
  std::vector<double> midpoint_mm_, predicted_mm_, off_mm_;            // of the segments
  std::array<std::vector<std::uint32_t>, kMostPieces + 1> of_pieces_;  // places among them
  std::vector<Settled> settled_;
  std::optional<std::size_t> widest_;
};

}  // namespace trunnion::path
