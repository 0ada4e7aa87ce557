#pragma once
#include <functional>

#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/fit/observations.hpp"
#include "diagnosis/search/run_factors.hpp"

namespace trunnion::diagnosis {

/// Names what is missing in `model`, conventions left alone.
using EffectSearch = std::function<Diagnosis(const Machine&, const Dataset&, const Model&)>;

/// Conventions of the files that explain what effects would have to, best first; mostly none.
struct WrongConventions {
  std::vector<Bookkeeping> likely;
  bool sure = true;     // else the effects that were found do about as well
  bool proved = false;  // by the positions alone, whatever the readings are
};

/// README of this layer, "Conventions". `said`: what the effects explain; `of_runs`: what they would explain
/// were the readings of one run others.
WrongConventions wrong_conventions(const Observations& whole, const Model& model, const Diagnosis& said,
                                   const RunFactors& of_runs, const EffectSearch& search);

/// All conventions that these files could have wrong; offsets and shifts with their starting values.
std::vector<Convention> conventions(const Machine& machine, const Dataset& data, const Model& model);

/// Position columns of one run that lead its ball about as they are and hold it still with this put right,
/// while the ball of another run stands still: their sense, two of them exchanged, their unit.
std::vector<Convention> columns_of_single_runs(const Machine& machine, const Dataset& data,
                                               const Model& model);

/// The convention is about this reading.
bool concerns(const Dataset& data, const Reading& r, const Convention& c);

/// Names of the files that hold readings of one run.
std::string files_of_run(const Dataset& data, std::size_t run);

/// What to put right and where, in one sentence.
std::string words_of(const Bookkeeping& b, const Machine& machine, const Dataset& data);

}  // namespace trunnion::diagnosis
