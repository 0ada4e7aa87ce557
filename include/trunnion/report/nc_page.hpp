#pragma once
#include <string>
#include <vector>

#include "trunnion/machine/body_meshes.hpp"
#include "trunnion/machine/machine.hpp"
#include "trunnion/post/verify.hpp"
#include "trunnion/report/compare.hpp"
#include "trunnion/report/page.hpp"

namespace trunnion::report {

/// A verified NC program to be shown; `verification.blocks` must have been collected
/// (VerifyOptions::collect).
struct NcPageInput {
  std::string nc_file;
  std::string cl_file;
  const Machine* machine = nullptr;
  const post::VerifyReport* verification = nullptr;
  std::vector<Fact> more_facts;  // what a post did beside: inserted points, branch changes, ...
  std::string result_json;
  std::string made_by;
  std::string nc_text = {};  // the program; empty: it is not at hand
  std::string cl_text = {};  // its CL file; empty: it is not at hand
  /// The machine's, which were compensated or are verified against; nothing: none.
  const ModelEvaluator* errors = nullptr;
  std::vector<BodyMesh> bodies = {};  // shapes of the machine file
};

/// The path coloured by its deviation, the machine at every place, the worst places, deviation along the path
/// before and after points were inserted, axis positions, and the harmonic model against the true error on
/// the worst segment.
Page nc_page(const NcPageInput& input);

/// Several programs of one CL file; the blocks of all must have been collected.
struct ComparePageInput {
  const std::vector<ComparedProgram>& programs;
  const Machine& machine;
  std::string cl_file;
  std::string result_json;
  std::string made_by;
  std::string nc_text = {};  // of the first program; empty: it is not at hand
  std::string cl_text = {};
  std::vector<BodyMesh> bodies = {};  // shapes of the machine file
};

/// One scene of the part with the first program's blocks, coloured by each program's deviation, two of them
/// beside each other; and the deviations along the path.
Page compare_page(const ComparePageInput& input);

}  // namespace trunnion::report
