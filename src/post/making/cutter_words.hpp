#pragma once
#include "post/making/place_words.hpp"

namespace trunnion::post {

/// Cutter compensation that adds wear to a path of the tool's centre.
class CutterWords {
 public:
  CutterWords(ProgramInWork& work, const PlaceWords& words) : work_(work), words_(words) {}

  Result<void> switch_to(const cl::CutterCompensation& c, SourceRef where);
  /// What a control asks of motion number `i` of the chunk while it compensates.
  Result<void> check(std::size_t i);

 private:
  ProgramInWork& work_;
  const PlaceWords& words_;
};

}  // namespace trunnion::post
