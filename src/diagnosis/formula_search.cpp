#include <algorithm>
#include <cmath>
#include <limits>
#include <oneapi/tbb/parallel_for.h>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/formula.hpp"
#include "trunnion/diagnosis/improve.hpp"

#include "diagnosis/condensed.hpp"
#include "diagnosis/fit_core.hpp"
#include "diagnosis/formula_terms.hpp"
#include "diagnosis/verdict_text.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kMostTerms = 4;
constexpr std::size_t kFinalists = 6;   // twists that are looked at with products of three
constexpr double kLeft = 1e-4;          // part of a column's square that base and terms must leave
constexpr double kNoAnswer = 1e-9;      // RMS answer (mm or rad) to a unit twist below which it is rounding
constexpr double kSameAnswer = 0.9999;  // cosine from which two twists are one to these readings
constexpr double kWorthIt = 20.0;       // of the criterion: a hundred to one and more beyond the price

// A component of a joint, and others that these readings do not tell from it.
struct TwistPlace {
  std::size_t link = 0;
  Eigen::Index component = 0;
};
struct Answer {
  VectorXd values;
  std::vector<TwistPlace> places;
};

std::vector<Answer> answers(const Observations& o) {
  std::vector<Answer> out;
  for (std::size_t link = 0; link < o.link_count(); ++link)
    for (Eigen::Index k = 0; k < 6; ++k) {
      const VectorXd w = o.response(link).col(k);
      if (!(w.norm() > kNoAnswer * std::sqrt(static_cast<double>(w.size())))) continue;
      const auto same = std::find_if(out.begin(), out.end(), [&](const Answer& a) {
        return std::abs(a.values.dot(w)) > kSameAnswer * a.values.norm() * w.norm();
      });
      if (same == out.end())
        out.push_back({w, {{link, k}}});
      else
        same->places.push_back({link, k});
    }
  return out;
}

// Terms that earn their price together.
struct Chosen {
  std::size_t answer = 0;
  std::vector<FormulaTerm> terms;
  double criterion = std::numeric_limits<double>::infinity();
};

class FormulaSearch {
 public:
  FormulaSearch(const Observations& o, const FitCore& core)
      : o_(o), core_(core), answers_(answers(o)), terms_(formula_terms(o)) {}

  std::vector<Chosen> best() const {
    std::vector<const FormulaTerm*> all;
    for (const auto* kind : {&terms_.single, &terms_.products})
      for (const FormulaTerm& t : *kind) all.push_back(&t);
    std::vector<Chosen> found(answers_.size());
    oneapi::tbb::parallel_for(std::size_t{0}, answers_.size(),
                              [&](std::size_t i) { found[i] = terms_of(i, all); });
    const auto by_criterion = [](const Chosen& a, const Chosen& b) { return a.criterion < b.criterion; };
    std::stable_sort(found.begin(), found.end(), by_criterion);
    found.resize(std::min(found.size(), kFinalists));
    oneapi::tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t i) { deepen(found[i]); });
    std::stable_sort(found.begin(), found.end(), by_criterion);
    return found;
  }
  double without() const { return criterion(core_.chi2(), 0.0); }
  const std::vector<TwistPlace>& places(const Chosen& chosen) const { return answers_[chosen.answer].places; }

 private:
  // Of so much that is left, at a price. Scatter below the stated uncertainty is no merit.
  double criterion(double rss, double price) const {
    const double dof = std::max(core_.dof(), 1.0);
    return dof * std::log(std::max(rss / dof, 1.0)) + price;
  }
  double price_of(const FormulaTerm& term) const {
    return std::log(static_cast<double>(o_.size())) + term.price;
  }

  // The term that explains most beside those that there are, again and again (orthogonal matching pursuit;
  // Pati, Rezaiifar and Krishnaprasad 1993), as many of them as pay: one may pay with the next one only, as a
  // sine with its cosine.
  Chosen terms_of(std::size_t answer, const std::vector<const FormulaTerm*>& all) const {
    MatrixXd columns(o_.size(), static_cast<Eigen::Index>(all.size()));
    for (std::size_t k = 0; k < all.size(); ++k)
      columns.col(static_cast<Eigen::Index>(k)) = answers_[answer].values.cwiseProduct(all[k]->values);
    const VectorXd before =
        (core_.whitening->inverse_u().asDiagonal() * columns).colwise().squaredNorm().transpose();
    columns = core_.projected(columns);
    VectorXd left = core_.white;
    // Which joint and component is a choice, too.
    double price = 2.0 * std::log(static_cast<double>(answers_.size()));
    Chosen out{answer, {}, without()};
    std::vector<FormulaTerm> terms;
    for (std::size_t n = 0; n < kMostTerms; ++n) {
      const auto most = most_of(columns, before, left);
      if (!most) break;
      terms.push_back(*all[static_cast<std::size_t>(*most)]);
      price += price_of(terms.back());
      const VectorXd along = columns.col(*most).normalized();
      left -= along.dot(left) * along;
      columns -= along * (along.transpose() * columns);
      const double now = criterion(left.squaredNorm(), price);
      if (now < out.criterion) out = {answer, terms, now};
    }
    return out;
  }

  static std::optional<Eigen::Index> most_of(const MatrixXd& columns, const VectorXd& before,
                                             const VectorXd& left) {
    const VectorXd sizes = columns.colwise().squaredNorm().transpose();
    const VectorXd moments = columns.transpose() * left;
    std::optional<Eigen::Index> most;
    double drop = 0.0;
    for (Eigen::Index k = 0; k < columns.cols(); ++k) {
      if (!(sizes[k] > kLeft * before[k]) || !(moments[k] * moments[k] / sizes[k] > drop)) continue;
      drop = moments[k] * moments[k] / sizes[k];
      most = k;
    }
    return most;
  }

  // Terms that were found times a simple one or a step more: an error of a part of the travel, of a regime.
  void deepen(Chosen& chosen) const {
    if (chosen.terms.empty()) return;
    std::vector<FormulaTerm> deeper;
    for (const FormulaTerm& found : chosen.terms)
      for (const FormulaTerm& factor : terms_.single) {
        if (factor.text.empty() || found.text.find(factor.text) != std::string::npos) continue;
        deeper.push_back(product(found, factor));
      }
    set_price(deeper, terms_.single.size() + terms_.products.size());
    std::vector<const FormulaTerm*> all;
    for (const auto* kind : {&terms_.single, &terms_.products})
      for (const FormulaTerm& t : *kind) all.push_back(&t);
    for (const FormulaTerm& t : deeper) all.push_back(&t);
    Chosen again = terms_of(chosen.answer, all);
    if (again.criterion < chosen.criterion) chosen = std::move(again);
  }

  const Observations& o_;
  const FitCore& core_;
  std::vector<Answer> answers_;
  FormulaTerms terms_;
};

std::string link_name(const Machine& machine, std::size_t link) {
  if (link < machine.axes.size()) return machine.axes[link].name;
  return link == machine.axes.size() ? "S" : "P";
}

// Of places that the readings do not tell apart, the joint that the formula names, else the first.
TwistPlace place_of(const Machine& machine, const std::vector<TwistPlace>& places,
                    const std::vector<FormulaTerm>& terms) {
  for (const FormulaTerm& term : terms)
    for (const TwistPlace& place : places)
      if (link_name(machine, place.link) == term.variable) return place;
  return places.front();
}

std::string component_of(const TwistPlace& place) {
  constexpr const char* kLetters = "XYZABC";
  return {'E', kLetters[place.component]};
}
std::string unit_of(const TwistPlace& place) {
  return place.component < 3 ? "um" : "urad";
}

// As a model file, so that it is read like any other.
std::string formula_file(const Machine& machine, const TwistPlace& place,
                         const std::vector<FormulaTerm>& terms) {
  std::string expression, parameters;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const std::string name = "k" + std::to_string(k + 1);
    expression += (k > 0 ? " + " : "") + name + (terms[k].text.empty() ? "" : "*" + terms[k].text);
    parameters += name + "_" + unit_of(place) + " = 0\n";
  }
  return "[model]\nname = \"leftover\"\n[[effect]]\nid = \"user:leftover\"\njoint = \"" +
         link_name(machine, place.link) + "\"\ncomponent = \"" + component_of(place) + "\"\nexpression = \"" +
         expression + "\"\n[effect.parameters]\n" + parameters;
}

std::string words_of(const Machine& machine, const TwistPlace& place, const std::vector<FormulaTerm>& terms,
                     const ModelEffect& effect) {
  const double unit = place.component < 3 ? kMmPerUm : kRadPerUrad;
  std::string out;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const double value = effect.parameters[k].value / unit;
    out += k == 0 ? (value < 0.0 ? "-" : "") : (value < 0.0 ? " - " : " + ");
    out += short_number(std::abs(value)) + " " + unit_of(place);
    if (!terms[k].text.empty()) out += " * " + terms[k].text;
  }
  const std::string name = link_name(machine, place.link);
  const std::string where = name == "S" ? "the spindle" : name == "P" ? "the part" : "joint " + name;
  return out + " in " + component_of(place) + " of " + where;
}

bool is_worse(const std::optional<double>& before, const std::optional<double>& after) {
  return before && after && *after > *before;
}

}  // namespace

double ProposedFormula::explained() const {
  const double wrong = chi2_before - dof_before;
  return wrong > 0.0 ? std::clamp(1.0 - std::max(chi2_after - dof_after, 0.0) / wrong, 0.0, 1.0) : 0.0;
}

std::optional<ProposedFormula> propose_formula(const Machine& machine, const Dataset& data,
                                               const Model& model) {
  const auto whole = std::make_shared<const Observations>(machine, data);
  const auto o =
      whole->size() > kMostSingly ? std::make_shared<const Observations>(whole, bins_of(*whole)) : whole;
  const FitCore core = fit_core(*o, model, {.robust = false});
  const FormulaSearch search(*o, core);
  const std::vector<Chosen> found = search.best();
  if (found.empty() || !(found.front().criterion + kWorthIt < search.without())) return std::nullopt;
  const Chosen& best = found.front();
  const TwistPlace place = place_of(machine, search.places(best), best.terms);
  Diagnostics diagnostics;
  const auto alone = parse_model(formula_file(machine, place, best.terms), "leftover.toml", machine,
                                 model.context, diagnostics);
  if (!alone) return std::nullopt;  // a name that formulas do not take
  const HistoryEntry before = history_entry(machine, data, model);
  const Added added = add_and_fit(machine, data, model, alone->effects);
  const HistoryEntry after = history_entry(machine, data, added.model);
  if (is_worse(before.heldout_um, after.heldout_um) || is_worse(before.heldout_urad, after.heldout_urad))
    return std::nullopt;
  ProposedFormula out;
  out.alone = *alone;
  out.alone.effects = {added.model.effects.back()};
  out.words = words_of(machine, place, best.terms, out.alone.effects.front());
  out.terms = best.terms.size();
  out.chi2_before = before.chi2;
  out.dof_before = before.dof;
  out.chi2_after = after.chi2;
  out.dof_after = after.dof;
  out.heldout_before_um = before.heldout_um;
  out.heldout_after_um = after.heldout_um;
  out.heldout_before_urad = before.heldout_urad;
  out.heldout_after_urad = after.heldout_urad;
  return out;
}

}  // namespace trunnion::diagnosis
