#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <oneapi/tbb/parallel_for.h>
#include <tuple>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/diagnosis/formula.hpp"
#include "trunnion/diagnosis/improve.hpp"
#include "trunnion/geom/linear_algebra.hpp"

#include "diagnosis/fit/condensed.hpp"
#include "diagnosis/fit/fit_core.hpp"
#include "diagnosis/fit/twist_answers.hpp"
#include "diagnosis/search/formula_terms.hpp"
#include "diagnosis/verdict/verdict_text.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr std::size_t kMostTerms = 4;
constexpr std::size_t kFirstTerms = 2;  // by which the twists are compared
constexpr std::size_t kFinalParts = 2;
constexpr std::size_t kFinalists = 6;   // twists that are looked at whole, with products of three
constexpr std::size_t kLooked = 100;    // terms of which all is taken out that base and terms before take
constexpr double kLeftOfColumn = 1e-4;  // part of a column's square that base and terms must leave
constexpr double kSameDrop = 1e-5;      // of a sum of squares in single precision: rounding
constexpr int kGateRounds = 2;
constexpr int kMostPlaces = 2000;
constexpr std::size_t kMostEnds = 60;  // places that are tried for one end of a part
constexpr double kEndReach = 0.15;     // of the range: how far an end is moved at once
constexpr double kSamePart = 6.0;      // of the criterion: what two parts of their own may be worth
constexpr double kTakenUp = 1e-4;      // of a constant's square, that set-ups leave
constexpr double kWorthIt = 20.0;      // of the criterion: a hundred to one and more beyond the price

// Terms that are 1 in a part of the range of one variable: a part is a stretch of the readings in the order
// of the variable, so that sums over it are differences of running sums.
struct PartsOfVariable {
  struct Part {
    std::size_t term = 0;
    Eigen::Index from = 0, to = 0;  // of `order`
  };
  std::vector<Eigen::Index> order;
  std::vector<Part> parts;
};

std::vector<PartsOfVariable> parts_of(const FormulaTerms& terms) {
  std::vector<PartsOfVariable> out(terms.variables.size());
  for (std::size_t k = 0; k < terms.terms.size(); ++k) {
    const FormulaTerm& term = terms.terms[k];
    if (term.gates.size() != 1 || term.ungated.size() > 0) continue;
    const TermGate& gate = term.gates.front();
    const Variable& v = terms.variables[gate.variable];
    PartsOfVariable& here = out[gate.variable];
    const VectorXd& values = v.covariate.values;
    if (here.order.empty()) {
      here.order.resize(static_cast<std::size_t>(values.size()));
      std::iota(here.order.begin(), here.order.end(), Eigen::Index{0});
      std::stable_sort(here.order.begin(), here.order.end(),
                       [&](Eigen::Index a, Eigen::Index b) { return values[a] < values[b]; });
    }
    const auto first = [&](const auto& is_before) {
      return std::partition_point(here.order.begin(), here.order.end(), is_before) - here.order.begin();
    };
    const double unit = v.place_unit();
    PartsOfVariable::Part part{k, 0, static_cast<Eigen::Index>(here.order.size())};
    if (gate.above) part.from = first([&](Eigen::Index i) { return values[i] / unit <= *gate.above; });
    if (gate.below) part.to = first([&](Eigen::Index i) { return values[i] / unit < *gate.below; });
    if (part.from < part.to) here.parts.push_back(part);
  }
  return out;
}

// Orthonormal directions that the set-ups and the base take, so that products of their columns with raw ones
// (of readings) are those with whitened ones.
MatrixXd taken_by(const Observations& o, const FitCore& core) {
  const Whitening& whitening = *core.whitening;
  MatrixXd out = MatrixXd::Zero(o.size(), whitening.setup_rank() + core.basis.cols());
  Eigen::Index column = 0;
  for (std::size_t run = 0; whitening.free_setup() && run < o.runs().size(); ++run) {
    const MatrixXd& basis = whitening.setup_basis(run);
    out(o.runs()[run], Eigen::seqN(column, basis.cols())) = basis;
    column += basis.cols();
  }
  out.rightCols(core.basis.cols()) = core.basis.topRows(o.size());
  whitening.mix(out);
  return whitening.inverse_u().asDiagonal() * out;
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
      : o_(o),
        core_(core),
        answers_(twist_answers(o)),
        terms_(formula_terms(o)),
        parts_(parts_of(terms_)),
        taken_(taken_by(o, core)) {}

  /// `parts`: only what acts in a part.
  std::vector<Chosen> best(bool parts = false) const {
    std::vector<Chosen> found(answers_.size());
    oneapi::tbb::parallel_for(std::size_t{0}, answers_.size(),
                              [&](std::size_t i) { found[i] = terms_of(i, {}, kFirstTerms); });
    const auto by_criterion = [](const Chosen& a, const Chosen& b) { return a.criterion < b.criterion; };
    std::stable_sort(found.begin(), found.end(), by_criterion);
    if (parts)
      found.erase(std::remove_if(found.begin(), found.end(),
                                 [](const Chosen& c) { return gates_of(c.terms).empty(); }),
                  found.end());
    found.resize(std::min(found.size(), parts ? kFinalParts : kFinalists));
    oneapi::tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t i) {
      complete(found[i]);
      if (parts) keep_one_part(found[i]);
    });
    std::stable_sort(found.begin(), found.end(), by_criterion);
    return found;
  }
  // The smallest part of each variable that holds what all terms act in, in the units that people read.
  std::vector<ActingRange> acts_in(const Chosen& chosen) const {
    std::vector<TermGate> gates =
        chosen.terms.empty() ? std::vector<TermGate>{} : intersected(chosen.terms.front().gates);
    bool constant = true;  // where it acts
    for (const FormulaTerm& term : chosen.terms) {
      const std::vector<TermGate> own = intersected(term.gates);
      std::erase_if(gates, [&](TermGate& gate) {
        const auto same = std::find_if(own.begin(), own.end(),
                                       [&](const TermGate& g) { return g.variable == gate.variable; });
        if (same == own.end()) return true;
        gate.above =
            gate.above && same->above ? std::optional(std::min(*gate.above, *same->above)) : std::nullopt;
        gate.below =
            gate.below && same->below ? std::optional(std::max(*gate.below, *same->below)) : std::nullopt;
        return !gate.above && !gate.below;
      });
      constant = constant && term.ungated_text.empty();
    }
    Eigen::VectorXf inside = Eigen::VectorXf::Ones(o_.size());
    for (const TermGate& gate : gates)
      inside = inside.cwiseProduct(terms_.variables[gate.variable].values_of(gate)).eval();
    std::vector<ActingRange> out;
    for (const TermGate& gate : gates) {
      const Variable& v = terms_.variables[gate.variable];
      ActingRange& range = out.emplace_back();
      range.of = v.read_as;
      range.unit = v.read_in;
      const auto read = [&](double place) { return place * v.read_factor + v.read_zero; };
      if (gate.above) range.from = read(*gate.above);
      if (gate.below) range.to = read(*gate.below);
    }
    // A constant in one part and its opposite in the other are the same where set-ups take up a constant: the
    // smaller part is meant.
    if (out.size() == 1 && constant && out[0].from.has_value() != out[0].to.has_value() &&
        inside.mean() > 0.5F && takes_up_constant(chosen.answer))
      std::swap(out[0].from, out[0].to);
    return out;
  }
  double price(const Chosen& chosen) const { return price_of(chosen.terms); }
  double without() const { return criterion(core_.chi2(), 0.0); }
  const std::vector<TwistPlace>& places(const Chosen& chosen) const { return answers_[chosen.answer].places; }

 private:
  // Of so much that is left, at a price. Scatter below the stated uncertainty is no merit.
  double criterion(double rss, double price) const {
    const double dof = std::max(core_.dof(), 1.0);
    return dof * std::log(std::max(rss / dof, 1.0)) + price;
  }

  double criterion_of(std::size_t answer, const std::vector<FormulaTerm>& terms) const {
    return criterion(rss(answer, terms), price_of(terms));
  }
  double price_of(const std::vector<FormulaTerm>& terms) const {
    double price = price_of_twist();
    for (const FormulaTerm& term : terms) price += price_of_term(term);
    return price;
  }
  // Which joint and component is a choice, too.
  double price_of_twist() const { return 2.0 * std::log(static_cast<double>(answers_.size())); }
  double price_of_term(const FormulaTerm& term) const {
    return std::log(static_cast<double>(o_.size())) + term.price;
  }

  // A term, or its product with one that was found before.
  struct Candidate {
    const FormulaTerm* term = nullptr;
    const FormulaTerm* times = nullptr;
    double score = 0.0;
  };

  // The term that explains most beside those that there are, again and again (orthogonal matching pursuit;
  // Pati, Rezaiifar and Krishnaprasad 1993), as many of them as pay: one may pay with the next one only, as a
  // sine with its cosine. `times`: terms whose products with functions of one variable are tried, too.
  Chosen terms_of(std::size_t answer, const std::vector<FormulaTerm>& times, std::size_t most) const {
    VectorXd left = core_.white;
    MatrixXd taken(left.size(), 0);
    double price = price_of_twist();
    Chosen out{answer, {}, without()};
    std::vector<FormulaTerm> terms;
    for (std::size_t n = 0; n < most; ++n) {
      auto [term, along] = next_term(answers_[answer].values, times, taken, left);
      if (along.size() == 0) break;
      price += price_of_term(term);
      terms.push_back(std::move(term));
      left -= along.dot(left) * along;
      taken.conservativeResize(Eigen::NoChange, taken.cols() + 1);
      taken.rightCols(1) = along;
      const double now = criterion(left.squaredNorm(), price);
      if (now < out.criterion) out = {answer, terms, now};
    }
    return out;
  }

  // With its direction, a unit vector; none where none is left.
  std::pair<FormulaTerm, VectorXd> next_term(const VectorXd& answer, const std::vector<FormulaTerm>& times,
                                             const MatrixXd& taken, const VectorXd& left) const {
    const std::vector<Candidate> looked = promising(answer, times, left);
    std::vector<FormulaTerm> terms;
    std::vector<const FormulaTerm*> listed;  // of which the simpler ones stand in front
    for (const Candidate& c : looked) {
      if (c.times == nullptr) {
        terms.push_back(*c.term);
      } else if (auto both = product(*c.times, *c.term)) {
        both->price = c.times->price + c.term->price;  // either was chosen
        terms.push_back(std::move(*both));
      } else {
        continue;
      }
      listed.push_back(c.term);
    }
    MatrixXd columns(o_.size(), static_cast<Eigen::Index>(terms.size()));
    for (std::size_t k = 0; k < terms.size(); ++k)
      columns.col(static_cast<Eigen::Index>(k)) = answer.cwiseProduct(terms[k].values.cast<double>());
    const VectorXd before =
        (core_.whitening->inverse_u().asDiagonal() * columns).colwise().squaredNorm().transpose();
    columns = core_.projected(columns);
    take_out(taken, columns);
    const VectorXd sizes = columns.colwise().squaredNorm().transpose();
    const VectorXd moments = columns.transpose() * left;
    Eigen::Index best = -1;
    double most = 0.0;
    for (Eigen::Index k = 0; k < columns.cols(); ++k) {
      if (!(sizes[k] > kLeftOfColumn * before[k])) continue;
      const double drop = moments[k] * moments[k] / sizes[k];
      // Of terms that are the same at these readings (a part in which an axis has one sense, with and without
      // that sense; the third and the sixth harmonic at multiples of 40 deg) the one that is simpler.
      const auto here = static_cast<std::size_t>(k),
                 there = static_cast<std::size_t>(std::max<Eigen::Index>(best, 0));
      const bool simpler =
          best >= 0 && drop > (1.0 - kSameDrop) * most &&
          std::tie(terms[here].price, listed[here]) < std::tie(terms[there].price, listed[there]);
      if (!(drop > most || simpler)) continue;
      most = std::max(most, drop);
      best = k;
    }
    if (best < 0) return {};
    return {terms[static_cast<std::size_t>(best)], columns.col(best).normalized()};
  }

  // Those that would explain most if base and set-ups took nothing of them: cheap, and near enough for so
  // many. Not for parts of a range: a constant in whole runs, of which set-ups leave next to nothing.
  std::vector<Candidate> promising(const VectorXd& answer, const std::vector<FormulaTerm>& times,
                                   const VectorXd& left) const {
    // A product of `left` with raw columns wants it whitened once more.
    MatrixXd mixed = left.head(o_.size());
    core_.whitening->mix(mixed);
    const VectorXd& inverse_u = core_.whitening->inverse_u();
    const Eigen::VectorXf moment = mixed.col(0).cwiseProduct(inverse_u).cwiseProduct(answer).cast<float>();
    const Eigen::VectorXf weight = answer.cwiseProduct(inverse_u).cwiseAbs2().cast<float>();
    std::vector<Candidate> out;
    out.reserve(terms_.terms.size() + times.size() * terms_.of_one_variable);
    const auto add = [&](const FormulaTerm* factor, std::size_t count) {
      Eigen::VectorXf m = moment, w = weight;
      if (factor != nullptr) {
        m = m.cwiseProduct(factor->values);
        w = w.cwiseProduct(factor->values.cwiseAbs2());
      }
      for (std::size_t k = 0; k < count; ++k) {
        const Eigen::VectorXf& values = terms_.terms[k].values;
        const double size = w.dot(values.cwiseAbs2());
        const double in = m.dot(values);
        out.push_back({&terms_.terms[k], factor, size > 0.0 ? in * in / size : 0.0});
      }
    };
    add(nullptr, terms_.terms.size());
    judge_parts(answer, moment.cast<double>(), weight.cast<double>(), out);
    for (const FormulaTerm& found : times) add(&found, terms_.of_one_variable);
    const std::size_t most = std::min(out.size(), kLooked);
    std::partial_sort(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(most), out.end(),
                      [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    out.resize(most);
    return out;
  }

  // What parts of a range explain beside base and set-ups. `all`: candidates that begin with one of each
  // term.
  void judge_parts(const VectorXd& answer, const VectorXd& moment, const VectorXd& weight,
                   std::vector<Candidate>& all) const {
    MatrixXd columns(o_.size(), taken_.cols() + 2);
    columns << moment, weight, answer.asDiagonal() * taken_;
    columns.transposeInPlace();
    MatrixXd sums(columns.rows(), columns.cols() + 1);
    sums.col(0).setZero();
    for (const PartsOfVariable& variable : parts_) {
      for (std::size_t k = 0; k < variable.order.size(); ++k) {
        const auto i = static_cast<Eigen::Index>(k);
        sums.col(i + 1) = sums.col(i) + columns.col(variable.order[k]);
      }
      for (const PartsOfVariable::Part& part : variable.parts) {
        const VectorXd sum = sums.col(part.to) - sums.col(part.from);
        const double free = sum[1] - sum.tail(taken_.cols()).squaredNorm();
        all[part.term].score = free > kLeftOfColumn * sum[1] ? sum[0] * sum[0] / free : 0.0;
      }
    }
  }

  // All terms that pay, and terms that were found times one more: an error of a part of the travel, of a
  // regime.
  void complete(Chosen& chosen) const {
    if (chosen.terms.empty()) return;
    chosen = terms_of(chosen.answer, {}, kMostTerms);
    Chosen deeper = terms_of(chosen.answer, chosen.terms, kMostTerms);
    refine_gates(chosen);
    refine_gates(deeper);
    if (deeper.criterion < chosen.criterion) chosen = std::move(deeper);
  }

  bool takes_up_constant(std::size_t answer) const {
    const MatrixXd column = answers_[answer].values;
    const MatrixXd before = core_.whitening->inverse_u().asDiagonal() * column;
    return core_.projected(column).squaredNorm() < kTakenUp * before.squaredNorm();
  }

  double rss(std::size_t answer, const std::vector<FormulaTerm>& terms) const {
    MatrixXd columns(o_.size(), static_cast<Eigen::Index>(terms.size()));
    for (std::size_t k = 0; k < terms.size(); ++k)
      columns.col(static_cast<Eigen::Index>(k)) =
          answers_[answer].values.cwiseProduct(terms[k].values.cast<double>());
    const MatrixXd q = pivoted_qr(core_.projected(columns), kLeftOfColumn).Q;
    return core_.chi2() - (q.transpose() * core_.white).squaredNorm();
  }
  std::vector<FormulaTerm> exchanged(std::vector<FormulaTerm> terms, const TermGate& gate,
                                     const TermGate& by) const {
    for (FormulaTerm& term : terms) {
      std::vector<TermGate> gates = term.gates;
      std::replace(gates.begin(), gates.end(), gate, by);
      if (gates != term.gates) term = with_gates(term, gates, terms_.variables);
    }
    return terms;
  }
  static std::vector<TermGate> gates_of(const std::vector<FormulaTerm>& terms) {
    std::vector<TermGate> out;
    for (const FormulaTerm& term : terms)
      for (const TermGate& gate : term.gates)
        if (std::find(out.begin(), out.end(), gate) == out.end()) out.push_back(gate);
    return out;
  }

  // A part of a part of one variable is a part of it.
  static std::vector<TermGate> intersected(const std::vector<TermGate>& gates) {
    std::vector<TermGate> out;
    for (const TermGate& gate : gates) {
      const auto same = std::find_if(out.begin(), out.end(),
                                     [&](const TermGate& g) { return g.variable == gate.variable; });
      if (same == out.end()) {
        out.push_back(gate);
        continue;
      }
      if (gate.above) same->above = std::max(same->above.value_or(*gate.above), *gate.above);
      if (gate.below) same->below = std::min(same->below.value_or(*gate.below), *gate.below);
    }
    return out;
  }

  // Terms that act in nearly the same part act in one, two that are one become it; the ends of the parts are
  // moved to where the readings want them.
  void refine_gates(Chosen& chosen) const {
    if (gates_of(chosen.terms).empty()) return;
    for (FormulaTerm& term : chosen.terms) {
      const std::vector<TermGate> gates = intersected(term.gates);
      if (gates.size() < term.gates.size()) term = with_gates(term, gates, terms_.variables);
    }
    for (int round = 0; round < kGateRounds; ++round) {
      double now = rss(chosen.answer, chosen.terms);
      for (const TermGate& gate : gates_of(chosen.terms)) {
        for (const TermGate& other : gates_of(chosen.terms)) {
          if (other.variable != gate.variable || other == gate) continue;
          auto terms = exchanged(chosen.terms, gate, other);
          const double then = rss(chosen.answer, terms);
          if (criterion(then, 0.0) > criterion(now, 0.0) + kSamePart) continue;
          now = then;
          chosen.terms = std::move(terms);
          break;
        }
      }
      for (const TermGate& gate : gates_of(chosen.terms)) {
        TermGate place = gate;
        for (const bool lower : {true, false}) move_end(chosen, place, lower, now);
      }
      while (join_two(chosen)) {
      }
    }
    chosen.criterion = criterion_of(chosen.answer, chosen.terms);
  }

  // Two terms that do no more than one would, at the price of two: a term twice, or a step up here and down
  // there, which is a window. Whether there were any.
  bool join_two(Chosen& chosen) const {
    const double now = criterion_of(chosen.answer, chosen.terms);
    for (std::size_t i = 0; i < chosen.terms.size(); ++i)
      for (std::size_t k = i + 1; k < chosen.terms.size(); ++k) {
        const auto one = joint_term(chosen.terms[i], chosen.terms[k]);
        if (!one) continue;
        std::vector<FormulaTerm> terms = chosen.terms;
        terms[i] = *one;
        terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(k));
        if (criterion_of(chosen.answer, terms) > now) continue;
        chosen.terms = std::move(terms);
        return true;
      }
    return false;
  }
  std::optional<FormulaTerm> joint_term(const FormulaTerm& a, const FormulaTerm& b) const {
    if (a.text == b.text) return a;
    if (a.gates.size() != 1 || b.gates.size() != 1 || a.ungated_text != b.ungated_text) return std::nullopt;
    const TermGate &from = a.gates[0], &to = b.gates[0];
    if (from.variable != to.variable || !from.above || !to.above || from.below || to.below)
      return std::nullopt;
    const TermGate window{from.variable, std::min(*from.above, *to.above), std::max(*from.above, *to.above)};
    return with_gates(a, {window}, terms_.variables);
  }

  // Of the terms those that act in one and the same part, which do best: an error that acts there only.
  void keep_one_part(Chosen& chosen) const {
    Chosen best{chosen.answer, {}, without()};
    for (const TermGate& gate : gates_of(chosen.terms)) {
      std::vector<FormulaTerm> there;
      for (const FormulaTerm& term : chosen.terms)
        if (std::find(term.gates.begin(), term.gates.end(), gate) != term.gates.end()) there.push_back(term);
      const double now = criterion_of(chosen.answer, there);
      if (now < best.criterion) best = {chosen.answer, std::move(there), now};
    }
    chosen = std::move(best);
  }
  void move_end(Chosen& chosen, TermGate& gate, bool lower, double& now) const {
    const auto& end = lower ? gate.above : gate.below;
    if (!end) return;
    const Variable& v = terms_.variables[gate.variable];
    const double reach =
        kEndReach * (v.covariate.values.maxCoeff() - v.covariate.values.minCoeff()) / v.place_unit();
    std::vector<double> places;
    for (const double at : places_between(v.covariate.values, kMostPlaces))
      if (std::abs(at / v.place_unit() - *end) < reach) places.push_back(as_written(at / v.place_unit()));
    const std::size_t stride = 1 + places.size() / kMostEnds;
    for (std::size_t k = 0; k < places.size(); k += stride) {
      TermGate moved = gate;
      (lower ? moved.above : moved.below) = places[k];
      if (moved.above && moved.below && *moved.above >= *moved.below) continue;
      auto terms = exchanged(chosen.terms, gate, moved);
      const double then = rss(chosen.answer, terms);
      if (!(then < now)) continue;
      now = then;
      chosen.terms = std::move(terms);
      gate = moved;
    }
  }

  const Observations& o_;
  const FitCore& core_;
  std::vector<TwistAnswer> answers_;
  FormulaTerms terms_;
  std::vector<PartsOfVariable> parts_;
  MatrixXd taken_;
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

namespace {

// What a model leaves, by the criterion of formulas, each with its own outliers: one costs as much as the
// furthest reading that is none.
double cost_beside(const FitCore& fit, double dof) {
  const auto& used = fit.whitening->noise().used;
  const auto outliers = static_cast<double>(std::count(used.begin(), used.end(), false));
  return dof * std::log(std::max(fit.chi2() / dof, 1.0)) + kOutlier * kOutlier * outliers;
}

std::shared_ptr<const Observations> few_readings(const Machine& machine, const Dataset& data) {
  const auto whole = std::make_shared<const Observations>(machine, data);
  return whole->size() > kMostSingly ? std::make_shared<const Observations>(whole, bins_of(*whole)) : whole;
}

// A model of nothing but the formula; nothing where it has a name that formulas do not take.
std::optional<Model> alone(const Machine& machine, const Model& model, const FormulaSearch& search,
                           const Chosen& best) {
  const TwistPlace place = place_of(machine, search.places(best), best.terms);
  Diagnostics diagnostics;
  auto out = parse_model(formula_file(machine, place, best.terms), "leftover.toml", machine, model.context,
                         diagnostics);
  if (!out) return std::nullopt;
  return std::move(*out);
}

std::optional<ProposedFormula> proposed(const Machine& machine, const Dataset& data, const Model& model,
                                        const FormulaSearch& search, const Chosen& best) {
  const auto formula = alone(machine, model, search, best);
  if (!formula) return std::nullopt;
  const HistoryEntry before = history_entry(machine, data, model);
  const Added added = add_and_fit(machine, data, model, formula->effects);
  const HistoryEntry after = history_entry(machine, data, added.model);
  if (is_worse(before.heldout_um, after.heldout_um) || is_worse(before.heldout_urad, after.heldout_urad))
    return std::nullopt;
  ProposedFormula out;
  out.alone = *formula;
  out.alone.effects = {added.model.effects.back()};
  out.words = words_of(machine, place_of(machine, search.places(best), best.terms), best.terms,
                       out.alone.effects.front());
  out.terms = best.terms.size();
  out.acts_in = search.acts_in(best);
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

}  // namespace

std::optional<ProposedFormula> propose_formula(const Machine& machine, const Dataset& data,
                                               const Model& model, const std::vector<bool>& left_out) {
  const auto o = few_readings(machine, data);
  const FitCore core = fit_core(*o, model, {.robust = false}, left_out);
  const FormulaSearch search(*o, core);
  const std::vector<Chosen> found = search.best();
  if (found.empty() || !(found.front().criterion + kWorthIt < search.without())) return std::nullopt;
  return proposed(machine, data, model, search, found.front());
}

std::optional<ProposedFormula> propose_part(const Machine& machine, const Dataset& data, const Model& model,
                                            const std::vector<bool>& left_out, const NamedEffects& named) {
  const auto o = few_readings(machine, data);
  const FitCore core = fit_core(*o, model, {.robust = false}, left_out);
  const double dof = std::max(core.dof(), 1.0);
  Model with = model;
  double parameters = 0.0;
  for (const ModelEffect& effect : named.effects) {
    with.effects.push_back(effect);
    parameters += static_cast<double>(effect.parameters.size());
  }
  const double of_named = cost_beside(fit_core(*o, with, {.robust = false}, left_out), dof) +
                          parameters * std::log(static_cast<double>(o->size())) +
                          2.0 * std::log(named.families) * static_cast<double>(named.effects.size());
  // What stands out beside the named effects may be what shows the part: it is sought without those readings
  // and with them.
  std::vector<FitCore> cores = {core};
  if (std::count(left_out.begin(), left_out.end(), true) > 0)
    cores.push_back(fit_core(*o, model, {.robust = false}));
  std::vector<FormulaSearch> searches;
  searches.reserve(cores.size());
  std::optional<Chosen> best;
  double least = of_named;
  for (const FitCore& c : cores) {
    const FormulaSearch& search = searches.emplace_back(*o, c);
    for (const Chosen& part : search.best(true)) {
      const auto formula = part.terms.empty() ? std::nullopt : alone(machine, model, search, part);
      if (!formula) continue;
      Model instead = model;
      instead.effects.push_back(formula->effects.front());
      const double cost = cost_beside(fit_core(*o, instead, {}), dof) + search.price(part);
      if (!(cost < least)) continue;
      least = cost;
      best = part;
    }
  }
  if (!best) return std::nullopt;
  auto out = proposed(machine, data, model, searches.front(), *best);
  if (!out || out->acts_in.empty()) return std::nullopt;
  out->ahead = of_named - least;
  return out;
}

}  // namespace trunnion::diagnosis
