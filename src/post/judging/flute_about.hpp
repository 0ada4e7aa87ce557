#pragma once
#include "post/judging/path_follower.hpp"

// Private to the verifier.
namespace trunnion::post {

/// How far a tool with a flute is off the path where its tip does not tell the place: where the axis turns
/// far on a short way of the tip the tool may be nearer to a place of another segment, and part of a block to
/// one of each. References must outlive the object.
class FluteAbout {
 public:
  FluteAbout(const DeviationMeter& meter, const PathFollower& path, const ProgramState& program)
      : meter_(meter), path_(path), program_(program) {}

  /// The block from `from` to `v`, whose tip is on `segment`, off the nearest places about it. What is proved
  /// to be no more than `known_mm` is left out.
  DeviationMeter::Interval of(const Vertex& from, const Vertex& v, std::size_t segment,
                              double known_mm) const {
    if (keeps(from, v, segment, known_mm, 0)) return {};
    DeviationMeter::Interval out = of(from, v, segment, known_mm, 0);
    // A bound that straddles the tolerance is decided.
    const double tolerance_mm = path_.limits().tolerance_mm;
    if (out.lower <= tolerance_mm && out.upper > tolerance_mm && keeps(from, v, segment, tolerance_mm, 0))
      out.upper = tolerance_mm;
    return out;
  }

 private:
  /// Each part of the block is proved to keep to one of the segments.
  bool keeps(const Vertex& from, const Vertex& v, std::size_t segment, double limit_mm, int halvings) const;
  DeviationMeter::Interval of(const Vertex& from, const Vertex& v, std::size_t segment, double known_mm,
                              int halvings) const;

  const DeviationMeter& meter_;
  const PathFollower& path_;
  const ProgramState& program_;
};

}  // namespace trunnion::post
