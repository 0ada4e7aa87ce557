#pragma once
#include <string>
#include <vector>

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
  std::string nc_text = {};      // the program; empty: it is not at hand
  std::string cl_text = {};      // its CL file; empty: it is not at hand
  const Model* model = nullptr;  // the errors that were compensated or are verified against; nothing: none
};

/// The path coloured by its deviation, the machine at every place, the worst places, deviation along the path
/// before and after points were inserted, axis positions, and the harmonic model against the true error on
/// the worst segment.
Page nc_page(const NcPageInput& input);

/// Several programs of one CL file beside each other, all drawn in one colour scale.
Page compare_page(const std::vector<ComparedProgram>& programs, const Machine& machine,
                  const std::string& cl_file, const std::string& result_json, const std::string& made_by);

}  // namespace trunnion::report
