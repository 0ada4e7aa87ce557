#pragma once
#include "post/path_follower.hpp"

// Private to the verifier.
namespace trunnion::post {

/// How far a tool with a flute is off the path where its tip does not tell the place: where the axis turns
/// far on a short way of the tip the tool may be nearer to a place of another segment, and part of a block to
/// one of each. References must outlive the object.
class FluteAbout {
 public:
  FluteAbout(const DeviationMeter& meter, const PathFollower& path, const ProgramState& program)
      : meter_(meter), path_(path), program_(program) {}

  /// The block from `from` to `v`, whose tip is on `segment`, off the nearest places about it.
  DeviationMeter::Interval of(const Vertex& from, const Vertex& v, std::size_t segment) const {
    return of(from, v, segment, 0);
  }

 private:
  DeviationMeter::Interval of(const Vertex& from, const Vertex& v, std::size_t segment, int halvings) const;

  const DeviationMeter& meter_;
  const PathFollower& path_;
  const ProgramState& program_;
};

}  // namespace trunnion::post
