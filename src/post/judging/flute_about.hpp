#pragma once
#include "post/judging/path_follower.hpp"

// Private to the verifier.
namespace trunnion::post {

/// How far a tool with a flute is off the path where its tip does not tell the place: where the axis turns
/// far on a short way of the tip the tool may be nearer to a place of another segment, and part of a block to
/// one of each. References must outlive the object.
class FluteAbout {
 public:
  /// `limit_mm`: what is allowed there. `in_cone`: places in the pole's cone count, too.
  FluteAbout(const DeviationMeter& meter, const PathFollower& path, const ProgramState& program,
             double limit_mm, bool in_cone)
      : meter_(meter), path_(path), program_(program), limit_mm_(limit_mm), in_cone_(in_cone) {}

  /// The block from `from` to `v`, whose tip is on `segment`, off the nearest places about it. What is proved
  /// to be no more than `known_mm` is left out.
  DeviationMeter::Interval of(const Vertex& from, const Vertex& v, std::size_t segment,
                              double known_mm) const {
    if (keeps(from, v, segment, known_mm)) return {};
    DeviationMeter::Interval out = of(from, v, segment, known_mm, 0);
    // A bound that straddles the limit is decided.
    if (out.lower <= limit_mm_ && out.upper > limit_mm_ && keeps(from, v, segment, limit_mm_))
      out.upper = limit_mm_;
    return out;
  }

  /// Cut where the tool passes the points about `segment` each part is proved to be within `limit_mm` of its
  /// own segment. For blocks of which bounds are known.
  bool keeps_between_corners(const Vertex& from, const Vertex& v, std::size_t segment, double limit_mm) const;

 private:
  /// The tool of the block on `segment` may be there.
  bool counts(std::size_t j, std::size_t segment) const;
  /// The block is proved to be within `limit_mm` of the path about `segment`: cut where the tool passes its
  /// points, or, where that does not tell, halved.
  bool keeps(const Vertex& from, const Vertex& v, std::size_t segment, double limit_mm) const {
    return meter_.may_bow(from, v) &&
           (keeps_between_corners(from, v, segment, limit_mm) || keeps(from, v, segment, limit_mm, 0));
  }
  /// The fraction of the block at which the whole tool is nearest to a CL point.
  static double passes_at(const Vertex& from, const Vertex& v, const Target& corner, double flute_mm);
  /// The part of a motion, whose ends are at these fractions of segment `j` (below 0: not known), keeps to it
  /// alone.
  using Part = DeviationMeter::Stretch;
  bool keeps_on(const Part& part, std::size_t j, double limit_mm) const;
  /// Each part of the block is proved to keep to one of the segments.
  bool keeps(const Vertex& from, const Vertex& v, std::size_t segment, double limit_mm, int halvings) const;
  DeviationMeter::Interval of(const Vertex& from, const Vertex& v, std::size_t segment, double known_mm,
                              int halvings) const;

  const DeviationMeter& meter_;
  const PathFollower& path_;
  const ProgramState& program_;
  double limit_mm_;
  bool in_cone_;
};

}  // namespace trunnion::post
