#pragma once
#include <string>
#include <vector>

#include "trunnion/post/verify.hpp"

namespace trunnion::report {

/// One program of a comparison; `verification.blocks` must have been collected.
struct ComparedProgram {
  std::string file;
  post::VerifyReport verification;
};

/// Tip deviations over the feed blocks of one program, mm.
struct DeviationFigures {
  double mean = 0.0;
  double rms = 0.0;
  double p95 = 0.0;
  double max = 0.0;
};
DeviationFigures deviation_figures(const post::VerifyReport& report);

/// Table for a terminal, one line a program.
std::string compare_table(const std::vector<ComparedProgram>& programs);
std::string compare_json(const std::vector<ComparedProgram>& programs);

}  // namespace trunnion::report
