#pragma once
#include "trunnion/diagnosis/diagnose.hpp"

#include "diagnosis/search/search.hpp"

namespace trunnion::diagnosis {

/// What a person should know and do, for the verdict that `d` holds.
std::string paragraph(const Diagnosis& d, const Atoms& atoms, const EffectSet& found);

/// What a text begins with in which something else stands beside effects that are named.
inline const std::string kTwoExplanations = "Two explanations fit these readings. ";

/// "1.2 um and 3.4 urad RMS": what was measured.
std::string sizes_text(std::optional<double> um, std::optional<double> urad);

/// 3 significant digits.
std::string short_number(double value);

/// Of effects that imitate what one function of the state does: not_in_library.
std::string imitated_text(const Diagnosis& d);

/// Of fewer effects than were named, beside a formula that does what the others (`imitators`) did.
std::string fewer_text(const Diagnosis& d);

/// Of effects that one function of the state does as well as: begins with a space.
std::string one_function_text(const Diagnosis& d);

/// The formula that goes with it, and how it is added; begins with a space.
std::string formula_text(const ProposedFormula& formula);

/// What to put right, of the verdict `bookkeeping`.
std::string bookkeeping_text(const std::vector<Bookkeeping>& all);

/// That a convention or the effects that were found are wrong, and how to see which.
std::string either_text(const Diagnosis& d);

/// Which runs do not go with the others, and which effects only they asked for: of those that were named
/// `before`, the ones that are not named `now`.
std::string odd_runs_text(const std::vector<std::string>& before, const std::vector<std::string>& now,
                          const Dataset& data, const std::vector<std::size_t>& runs);

/// The same of a run that does what no other does (`deeds`, "turns A round"): it is not blamed.
std::string alone_text(const std::vector<std::string>& before, const std::vector<std::string>& now,
                       const Dataset& data, std::size_t run, const std::vector<std::string>& deeds);

/// That no run tells these sets apart, and what does.
std::string not_told_apart_text(const std::vector<std::vector<std::string>>& sets);

/// What the scatter hangs on, and that the readings were weighed by it; begins with a space.
std::string uneven_text(const UnevenScatter& scatter);

}  // namespace trunnion::diagnosis
