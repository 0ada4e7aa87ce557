#pragma once
#include "trunnion/diagnosis/diagnose.hpp"

namespace trunnion::diagnosis {

/// The model with more effects, all fitted to `data`; parent, sigma and evidence filled in. `file` is the
/// parent's.
struct Added {
  Model model;
  Fit fit;
};
Added add_and_fit(const Machine& machine, const Dataset& data, const Model& parent,
                  std::vector<ModelEffect> effects, const Diagnosis* diagnosis = nullptr);

/// Error of a model: on the data as given, and leave-one-run-out with all its parameters refitted. One figure
/// a quantity, NaN (nothing) where it was not measured; chi-square over its degrees of freedom is the one
/// number for both.
struct HistoryEntry {
  std::string name, parent;
  std::vector<std::string> effects;
  double rms_um = 0.0, rms_urad = 0.0;
  std::optional<double> heldout_um, heldout_urad;
  double noise_floor_um = 0.0, noise_floor_urad = 0.0;
  double chi2 = 0.0, dof = 0.0;
};

/// One step of the loop: the model as it stood before, and what was said of it.
struct ImproveStep {
  Model model;  // fitted
  HistoryEntry error;
  Diagnosis diagnosis;
};

struct ImproveOptions {
  DiagnoseOptions diagnosis;
  std::size_t most_steps = 12;
  std::vector<EffectFamily> extra;  // formulas beside the library
};

/// Evaluate, diagnose, add, refit, until nothing is left that can be named with certainty (at most
/// `most_steps` additions). Of an ambiguous diagnosis that is an effect which all explanations have, if it
/// alone takes more than half of what held-out runs are off by (of one quantity; of the other nothing is
/// worse).
std::vector<ImproveStep> improve(const Machine& machine, const Dataset& data, const Model& model,
                                 const ImproveOptions& options = {});

HistoryEntry history_entry(const Machine& machine, const Dataset& data, const Model& model);

}  // namespace trunnion::diagnosis
