#include "diagnosis/verdict/verdict_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "trunnion/base/units.hpp"

#include "diagnosis/verdict/bookkeeping.hpp"

namespace trunnion::diagnosis {
namespace {

std::string conventions_text(const std::vector<Bookkeeping>& all) {
  std::string out;
  for (std::size_t k = 0; k < all.size(); ++k) {
    // Positions of each of these runs lead its ball about: each has to be put right.
    const bool both = k > 0 && all[k].wandered_mm > 0.0 && all[k].convention.run &&
                      all[k - 1].convention.run && *all[k].convention.run != *all[k - 1].convention.run;
    if (k > 0) out += both ? " And: " : " Or, and these readings cannot tell the two apart: ";
    out += all[k].words;
  }
  return out;
}

// 360 deg over the widest step of which all places of a rotary axis are multiples, counted from the first; 0
// where no step of 45 deg and more is.
int places_a_turn(const Observations& o, AxisId axis) {
  constexpr double kSame_rad = 2e-4;  // as people write positions
  constexpr int kFewest = 5, kMost = 8;
  for (int m = kFewest; m <= kMost; ++m) {
    const double step = kTwoPi / m;
    bool all = true;
    for (Eigen::Index i = 0; i < o.size() && all; ++i)
      all = std::abs(std::remainder(o.state(i).q[axis] - o.state(0).q[axis], step)) < kSame_rad;
    if (all) return m;
  }
  return 0;
}

// A wave of n times a turn looks at m places as one of m - n times; begins with a space.
std::string coarse_places_text(const Atoms& atoms, const EffectSet& found) {
  const Observations& o = atoms.observations();
  for (const Atom& atom : found.members) {
    const Effect& effect = atoms.effect(atom);
    const bool twice = std::any_of(effect.info().parameters.begin(), effect.info().parameters.end(),
                                   [](const Parameter& p) { return p.name == "cos2"; });
    if (!twice) continue;
    const AxisId axis = effect.link().axis;
    const int m = places_a_turn(o, axis);
    if (m == 0) continue;
    const std::string& name = o.machine().axes[axis].name;
    return " " + name + " stood at steps of " + short_number(360.0 / m) + " deg only, at which an error of " +
           std::to_string(m - 2) + " or " + std::to_string(m - 1) + " waves a turn looks like " +
           effect.info().id + ": read " + name + " between them, too, before you compensate.";
  }
  return {};
}

std::string percent(double share) {
  return short_number(100.0 * share) + " %";
}

std::string listed(const std::vector<std::string>& items, const std::string& last) {
  std::string out;
  for (std::size_t i = 0; i < items.size(); ++i)
    out += (i == 0 ? "" : i + 1 == items.size() ? last : ", ") + items[i];
  return out;
}

std::vector<std::string> in_all(const std::vector<std::vector<std::string>>& sets) {
  std::vector<std::string> out = sets.empty() ? std::vector<std::string>() : sets.front();
  for (const auto& set : sets)
    std::erase_if(out, [&](const auto& id) { return std::find(set.begin(), set.end(), id) == set.end(); });
  return out;
}

// How often an effect repeats in a turn, where the positions that were read leave it open.
std::string other_numbers(const RankedEffect& ranked) {
  constexpr std::size_t kMost = 6;
  if (!ranked.number_is_open()) return "";
  const RankedParameter& n = ranked.parameters.back();
  std::vector<std::string> others;
  for (const double number : n.also) {
    if (others.size() == kMost) break;
    others.push_back(short_number(number));
  }
  const std::string axis = ranked.id.substr(ranked.id.find(':') + 1);
  const bool period = ranked.id.starts_with("periodic:"), one = n.also.size() == 1;
  return "Which " + (period ? "period" : n.key) + " it has is not known: at the positions of " + axis +
         " that were read " + listed(others, " and ") + (period ? " mm" : "") +
         (n.also.size() > kMost ? " (and more)" : "") +
         (one ? " does the same, and between these positions it does not"
              : " do the same, and between these positions they do not") +
         ". Compensate nothing there before " + axis + " has been read off that grid" +
         (period ? ", 5 cm of it at steps of half a millimetre. " : ". ");
}

std::string described(const Atoms& atoms, const Atom& atom, const RankedEffect* ranked) {
  const EffectInfo& info = atoms.effect(atom).info();
  std::string out = info.id;
  for (const auto& [key, value] : info.variant) out += " (" + key + " " + value + ")";
  out += ": " + info.what + ". What causes it: " + info.cause + ". ";
  if (ranked != nullptr) {
    std::string values;
    std::size_t shown = 0;
    for (const auto& p : ranked->parameters) {
      if (++shown > 6) break;
      values += (values.empty() ? "" : ", ") + p.key + " = " + short_number(p.value) +
                (p.sigma ? " +/- " + short_number(*p.sigma) : "");
    }
    out += "The data show " + values + "; chi-square falls by " + short_number(ranked->chi2_drop) + " with " +
           short_number(ranked->dof) + " parameter(s). " + other_numbers(*ranked);
    if (ranked->heldout_before_um || ranked->heldout_before_urad)
      out +=
          "Runs that were held out: " + sizes_text(ranked->heldout_before_um, ranked->heldout_before_urad) +
          " without it, " + sizes_text(ranked->heldout_after_um, ranked->heldout_after_urad) + " with it. ";
  }
  return out + "What to do: " + info.remedy + ".";
}

std::string effects_text(const Diagnosis& d, const Atoms& atoms, const EffectSet& found) {
  std::string out;
  for (std::size_t i = 0; i < found.members.size(); ++i) {
    const RankedEffect* ranked = i < d.ranking.size() ? &d.ranking[i] : nullptr;
    out += " " + described(atoms, found.members[i], ranked);
  }
  return out;
}

std::string limits(const Diagnosis& d) {
  double best = INFINITY, worst = 0.0;
  std::size_t blind = 0;
  for (const auto& r : d.ranking) {
    if (!r.detectable_um)
      ++blind;
    else
      best = std::min(best, *r.detectable_um), worst = std::max(worst, *r.detectable_um);
  }
  std::string out;
  if (worst > 0.0)
    out += "These data would show most effects from " + short_number(best) + " um RMS on (the worst from " +
           short_number(worst) + " um on)";
  if (blind > 0)
    out += (out.empty() ? "" : "; ") + std::to_string(blind) +
           " effects of the library cannot be seen in these runs at all";
  return out.empty() ? out : out + ".";
}

// What fits and is not named.
std::string harm_text(const Diagnosis& d) {
  return "The model misses something real: the residual of " + sizes_text(d.rms_um, d.rms_urad) +
         ". It can be fitted with " + listed(d.harm->effects, " and ") +
         ", but the other runs then predict run '" + d.harm->run + "' worse than without (chi-square " +
         short_number(d.harm->chi2_before) + " to " + short_number(d.harm->chi2_after) +
         "): the effect is not common to all runs, and nothing is added. Either it is none of the effects "
         "known here, or that run was not measured as its columns say (set-up, sign, tool, time), or there "
         "are too few runs to decide: measure that run once more.";
}

std::string where(const std::vector<Dependence>& tests, std::size_t most = 3) {
  std::vector<std::string> names;
  for (const auto& t : tests) {
    if (names.size() == most || t.p_value > 0.01) break;
    names.push_back(t.covariate);
  }
  return names.empty() ? "no single covariate" : listed(names, " and ");
}

// What the one function depends on, where its tests say it.
std::string function_text(const Diagnosis& d) {
  const bool known = !d.depends_on.empty() && d.depends_on.front().p_value <= 0.01;
  return "function of " + (known ? d.depends_on.front().covariate : std::string("the positions"));
}

}  // namespace

bool Diagnosis::number_is_open() const {
  return !effects.empty() && std::any_of(ranking.begin(), ranking.end(),
                                         [](const RankedEffect& r) { return r.number_is_open(); });
}

std::string sizes_text(std::optional<double> um, std::optional<double> urad) {
  std::string out;
  if (um && std::isfinite(*um)) out = short_number(*um) + " um";
  if (urad && std::isfinite(*urad)) out += (out.empty() ? "" : " and ") + short_number(*urad) + " urad";
  return out.empty() ? "nothing" : out + " RMS";
}

std::string short_number(double value) {
  std::array<char, 40> buffer;
  const auto r = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value == 0.0 ? 0.0 : value,
                               std::chars_format::general, 3);
  return {buffer.data(), r.ptr};
}

std::string imitated_text(const Diagnosis& d) {
  return "The model misses something real that is none of the effects known here: the residual of " +
         sizes_text(d.rms_um, d.rms_urad) + " depends on " + where(d.depends_on) + ". " +
         listed(d.imitators, " and ") + (d.imitators.size() > 1 ? " together can" : " can") +
         " imitate it, but one " + function_text(d) +
         " does so with fewer parameters. Look at the residual against it, and write the effect as a formula "
         "in "
         "the model file.";
}

std::string fewer_text(const Diagnosis& d) {
  const bool one = d.imitators.size() == 1;
  return "Missing in the model: " + listed(d.effects, " and ") +
         ", and an error that is none of the effects known here. " + listed(d.imitators, " and ") +
         (one ? " did" : " together did") + " a part of that, and " + (one ? "is" : "are") +
         " not needed beside the formula that follows it.";
}

std::string one_function_text(const Diagnosis& d) {
  return " Or none of these effects is missing, but one error that the library lacks: a single " +
         function_text(d) +
         " does the same with fewer parameters. Add nothing before a measurement at other positions tells "
         "the "
         "two apart.";
}

std::string paragraph(const Diagnosis& d, const Atoms& atoms, const EffectSet& found) {
  std::string out;
  switch (d.verdict) {
    case Verdict::nothing_to_find:
      out = "Nothing is missing that these data could show: the residual of " +
            sizes_text(d.rms_um, d.rms_urad) + " is the noise of the readings (chi-square " +
            short_number(d.chi2) + " for " + short_number(d.dof) +
            " degrees of freedom), and it depends on nothing that was tried. This is no proof that an effect "
            "is absent. " +
            limits(d);
      break;
    case Verdict::named:
      out = "Missing in the model: " + listed(d.effects, " and ") +
            (d.effects.size() > 1 ? ". With them" : ". With it") + " the rest is noise." +
            effects_text(d, atoms, found);
      break;
    case Verdict::named_but_incomplete:
      if (d.only_number_is_open()) {
        out = "Missing in the model: " + listed(d.effects, " and ") +
              (d.effects.size() > 1 ? ". With them" : ". With it") +
              " the rest is noise, but how often an error repeats is open." + effects_text(d, atoms, found);
        break;
      }
      out = "Missing in the model: " + listed(d.effects, " and ") +
            (d.effects.size() > 1 ? ", but that is not all: they explain "
                                  : ", but that is not all: it explains ") +
            percent(d.explained) +
            " of what is wrong, and no effect of the library explains the rest, which depends on " +
            where(d.leftover) + "." + effects_text(d, atoms, found);
      break;
    case Verdict::ambiguous: {
      std::vector<std::string> sets;
      for (const auto& set : d.sets) sets.push_back(listed(set, " with "));
      const std::vector<std::string> common = in_all(d.sets);
      if (sets.size() == 1) {
        out = "Something is missing, perhaps " + sets.front() + ": with these effects the rest is noise." +
              effects_text(d, atoms, found);
        break;
      }
      out = "Something is missing, and these data cannot tell which: " + listed(sets, " or ") +
            ". All of them fit the readings about equally well" +
            (common.empty()
                 ? "; do not compensate"
                 : ", and each has " + listed(common, " and ") + "; do not compensate for the others") +
            " before the next measurement." + effects_text(d, atoms, found);
      break;
    }
    case Verdict::not_in_library:
      if (d.harm) {
        out = harm_text(d);
        break;
      }
      if (!d.imitators.empty()) {
        out = imitated_text(d);
        break;
      }
      out = "The model misses something real that is none of the effects known here: the residual of " +
            sizes_text(d.rms_um, d.rms_urad) + " depends on " + where(d.depends_on) +
            ", and the best match of the library explains only " + percent(d.explained) +
            " of it. Look at the residual against " + where(d.leftover.empty() ? d.depends_on : d.leftover) +
            ", and write the effect as a formula in the model file.";
      break;
    case Verdict::not_testable:
      out =
          "These runs cannot answer the question: they excite no effect of the machine beyond what the model "
          "and the set-ups take up. " +
          limits(d);
      break;
    case Verdict::data_problem:
      out = "The readings do not fit their own uncertainty: chi-square is " + short_number(d.chi2) + " for " +
            short_number(d.dof) +
            " degrees of freedom, and no smooth structure explains it. The scatter suggests an uncertainty " +
            short_number(d.scatter.factor) +
            " times the stated one. Check u_random, the repeatability of the instrument, and rows that were "
            "entered twice.";
      break;
    case Verdict::bookkeeping:
      return bookkeeping_text(d.bookkeeping);
  }
  if (d.only_rounding)
    out +=
        " What is left is the rounding of the readings to the steps of the display or the file; smaller "
        "errors "
        "do not show.";
  if (d.outliers > 0)
    out += " " + std::to_string(d.outliers) + " reading(s) stand far out and were left out.";
  if (d.scatter.autocorrelation > 0.0)
    out += " Successive readings are correlated (" + short_number(d.scatter.autocorrelation) +
           "): the tests allow for it.";
  if (d.verdict != Verdict::data_problem && !d.only_rounding &&
      (d.scatter.factor > 1.12 || d.scatter.factor < 0.88))
    out += " The scatter is " + short_number(d.scatter.factor) + " times the stated uncertainty; check it.";
  if (!d.effects.empty()) out += coarse_places_text(atoms, found);
  if (d.next) out += " Next measurement: " + d.next->why;
  return out;
}

namespace {

std::string where_it_acts(const std::vector<ActingRange>& all) {
  std::string out;
  for (const ActingRange& r : all) {
    out += (out.empty() ? " It acts only where " : ", and ") + r.of + " is ";
    const auto value = [&](double x) { return short_number(x) + (r.unit.empty() ? "" : " " + r.unit); };
    if (r.from && r.to)
      out += "between " + short_number(*r.from) + " and " + value(*r.to);
    else if (r.from)
      out += "above " + value(*r.from);
    else if (r.to)
      out += "below " + value(*r.to);
  }
  return out.empty() ? out : out + ".";
}

}  // namespace

std::string formula_text(const ProposedFormula& f) {
  std::string out = " A formula that follows it: " + f.words + "; it takes away " + percent(f.explained()) +
                    " of what is wrong";
  const auto held_out = [&](const auto& before, const auto& after, const std::string& unit) {
    if (before && after)
      out += ", held-out runs " + short_number(*before) + " -> " + short_number(*after) + " " + unit;
  };
  held_out(f.heldout_before_um, f.heldout_after_um, "um");
  held_out(f.heldout_before_urad, f.heldout_after_urad, "urad");
  return out + "." + where_it_acts(f.acts_in) +
         " It says how the error goes, not why: `model diagnose --formula FILE` writes it, and `model add "
         "user:leftover --also FILE` adds it.";
}

std::string bookkeeping_text(const std::vector<Bookkeeping>& all) {
  return "A convention is wrong in the files: that explains the readings better than any effect does. " +
         conventions_text(all) +
         " Put that right and diagnose again before anything is compensated: an effect may still be missing.";
}

std::string either_text(const Diagnosis& d) {
  return "Either a convention is wrong in the files, or an effect is missing: these readings do not tell "
         "which. "
         "Check the files first. " +
         conventions_text(d.bookkeeping) +
         " If the files are right, then it is an effect. Compensate nothing before that is known.";
}

std::string odd_runs_text(const std::vector<std::string>& before, const std::vector<std::string>& now,
                          const Dataset& data, const std::vector<std::size_t>& runs) {
  std::vector<std::string> names, not_needed;
  for (const std::size_t run : runs)
    names.push_back("'" + data.context.runs[run].id + "' (" + files_of_run(data, run) + ")");
  for (const std::string& id : before)
    if (std::find(now.begin(), now.end(), id) == now.end()) not_needed.push_back(id);
  return "The readings of run " + listed(names, " or of run ") +
         " do not go with the others: without them only noise is left" +
         (not_needed.empty() ? "" : ", and nothing asks for " + listed(not_needed, " and ")) +
         ". Either that run was measured otherwise than its columns say (sign, unit, scale, direction n, an "
         "instrument that drifts), or it alone shows an error that no effect of the library follows: check "
         "the file, and measure it once more before anything is compensated that only it shows.";
}

std::string alone_text(const std::vector<std::string>& before, const std::vector<std::string>& now,
                       const Dataset& data, std::size_t run, const std::vector<std::string>& deeds) {
  std::vector<std::string> not_needed;
  for (const std::string& id : before)
    if (std::find(now.begin(), now.end(), id) == now.end()) not_needed.push_back(id);
  return "Run '" + data.context.runs[run].id + "' (" + files_of_run(data, run) +
         ") alone shows an error that no effect of the library follows, and no other run " +
         listed(deeds, " or ") + ": without its readings only noise is left" +
         (not_needed.empty() ? "" : ", and nothing asks for " + listed(not_needed, " and ")) +
         ". Measure a second run that does the same: what both show is an error of the machine; what only "
         "this one shows is of how it was measured (sign, unit, scale, direction n, an instrument that "
         "drifts).";
}

std::string not_told_apart_text(const std::vector<std::vector<std::string>>& sets) {
  if (sets.size() < 2) return "No standard run decides whether that is it.";
  const std::vector<std::string> common = in_all(sets);
  bool of_tool = false, of_others = false;
  for (const auto& set : sets)
    for (const std::string& id : set) {
      if (std::find(common.begin(), common.end(), id) != common.end()) continue;
      const bool tool = id == "tool_length" || id == "tool_offset";
      of_tool = of_tool || tool;
      of_others = of_others || !tool;
    }
  std::vector<std::string> names;
  names.reserve(sets.size());
  for (const auto& set : sets) names.push_back(listed(set, " with "));
  std::string out = "No standard run tells " + listed(names, " and ") +
                    " apart: one can do what the other does in each of them.";
  if (of_tool && of_others)
    out +=
        " One is an error of the tool, the other one of the machine: measure the tool and the ball on a "
        "presetter (length and run-out). What is left is the machine's.";
  return out + (common.empty() ? " Look" : " Compensate for " + listed(common, " and ") + ", and look") +
         " at the machine for what causes the others.";
}

std::string what_next(const Diagnosis& d) {
  if (d.verdict == Verdict::ambiguous && !d.bookkeeping.empty())
    return either_text(d) + (d.next ? " " + d.next->why : "");
  if (d.next) return d.next->why;
  if (d.verdict == Verdict::bookkeeping)
    return "No measurement yet: put the files right first. " + bookkeeping_text(d.bookkeeping);
  if (d.harm)
    return "Measure run '" + d.harm->run + "' once more, with a new set-up: it contradicts the other runs.";
  if (!d.rows.odd_runs.empty())
    return "Measure run '" + listed(d.rows.odd_runs, "' or run '") +
           "' once more, with a new set-up: without its readings only noise is left.";
  if (d.verdict == Verdict::data_problem || d.verdict == Verdict::not_in_library)
    return "None of the standard runs helps here: " + d.paragraph;
  if (d.number_is_open())
    return "None of the standard runs helps here: measure the axis at positions between those of these "
           "runs. " +
           d.paragraph;
  if (d.verdict == Verdict::ambiguous) return not_told_apart_text(d.sets);
  return "No further measurement is needed: these data decide it.";
}

std::string_view text_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::nothing_to_find:
      return "nothing_to_find";
    case Verdict::named:
      return "named";
    case Verdict::named_but_incomplete:
      return "named_but_incomplete";
    case Verdict::ambiguous:
      return "ambiguous";
    case Verdict::not_in_library:
      return "not_in_library";
    case Verdict::not_testable:
      return "not_testable";
    case Verdict::data_problem:
      return "data_problem";
    case Verdict::bookkeeping:
      return "bookkeeping";
  }
  return "";
}

std::string uneven_text(const UnevenScatter& scatter) {
  std::string by;
  for (const std::string& name : scatter.depends_on) {
    if (!by.empty()) by += " and ";
    by += name == "run"         ? "from run to run"
          : name == "quantity"  ? "between displacements and rotations"
          : name == "direction" ? "from one direction of reading to another"
          : name == "distance"  ? "with the distance from the middle of the places"
                                : "along " + name;
  }
  return " The readings scatter unevenly, which changes " + by + ": those that scatter most do so " +
         short_number(scatter.largest) +
         " times as much, against their stated uncertainty, as the quietest. They were weighed by it. Read "
         "places of the noisy part again: what comes back is an "
         "error, and no scatter.";
}

}  // namespace trunnion::diagnosis
