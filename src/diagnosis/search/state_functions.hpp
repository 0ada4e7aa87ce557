#pragma once
#include "diagnosis/search/covariates.hpp"

namespace trunnion::diagnosis {

/// Functions of the machine's state that a twist may follow, with the parts of them that are tested together.
struct StateFunctions {
  struct Span {
    Eigen::Index first = 0, count = 0;
  };
  /// Which twists may follow them: any, or those of one link only (sharp functions: there are many).
  static constexpr std::size_t kAnyLink = static_cast<std::size_t>(-1);

  std::string covariate;
  Eigen::MatrixXf values;  // N x F
  std::vector<Span> spans;
  std::size_t link = kAnyLink;
};

/// Smooth functions of every covariate and pair; steps, kinks, bumps and waves along every covariate;
/// functions of the sense of motion, of feed, and of what an axis did before (README of this layer,
/// "Leftover").
std::vector<StateFunctions> state_functions(const Observations& observations);

}  // namespace trunnion::diagnosis
