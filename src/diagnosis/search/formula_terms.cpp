#include "diagnosis/search/formula_terms.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>

#include "trunnion/base/units.hpp"

#include "diagnosis/search/covariates.hpp"
#include "diagnosis/search/structure.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr int kStepPlaces = 160;  // of a step along the range
constexpr int kKinks = 24;
constexpr int kWindowPlaces = 16;  // of the ends of a window
constexpr int kHarmonicsOfTurn = 6;
constexpr std::size_t kFewestForGates = 3, kFewestForWaves = 8;  // values of a variable
constexpr double kLeastReadings = 6.0;  // that differ from most: what fewer carry is an outlier

std::string digits(double value) {
  std::array<char, 40> buffer;
  const auto r = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value == 0.0 ? 0.0 : value,
                               std::chars_format::general, 4);
  return {buffer.data(), r.ptr};
}
class TermWriter {
 public:
  TermWriter(const Variable& v, std::size_t number) : v_(v), number_(number) {}

  FormulaTerm term(const std::string& text, const std::function<double(double)>& f) const {
    FormulaTerm out;
    out.text = text;
    out.values.resize(v_.covariate.values.size());
    out.variable = v_.name;
    for (Eigen::Index i = 0; i < out.values.size(); ++i)
      out.values[i] = static_cast<float>(f(v_.covariate.values[i]));
    return out;
  }
  FormulaTerm power(int n) const {
    const std::string to = n == 1 ? "" : "^" + std::to_string(n);
    return term(v_.in_formula + to, [this, n](double x) { return std::pow(x / v_.unit, n); });
  }
  FormulaTerm harmonic(int n, bool sine) const {
    const std::string of = n == 1 ? v_.name : std::to_string(n) + "*" + v_.name;
    return term((sine ? "sin(" : "cos(") + of + ")",
                [n, sine](double x) { return sine ? std::sin(n * x) : std::cos(n * x); });
  }
  FormulaTerm wave(double period, bool sine) const {
    const double p = as_written(period);
    return term((sine ? "sin(2*_pi*" : "cos(2*_pi*") + v_.name + "/" + digits(p) + ")",
                [p, sine](double x) { return sine ? std::sin(kTwoPi * x / p) : std::cos(kTwoPi * x / p); });
  }
  FormulaTerm step(double at) const {
    return gate({number_, as_written(at / v_.place_unit()), std::nullopt});
  }
  FormulaTerm window(double from, double to) const {
    return gate({number_, as_written(from / v_.place_unit()), as_written(to / v_.place_unit())});
  }
  FormulaTerm kink(double at) const {
    const double place = as_written(at / v_.place_unit());
    return term("max(" + v_.place_text() + " - " + digits(place) + ", 0)/100",
                [this, place](double x) { return std::max(x / v_.place_unit() - place, 0.0) / 100.0; });
  }

 private:
  FormulaTerm gate(const TermGate& g) const {
    FormulaTerm out;
    out.text = v_.text_of(g);
    out.values = v_.values_of(g);
    out.variable = v_.name;
    out.gates = {g};
    return out;
  }
  const Variable& v_;
  std::size_t number_;
};

Variable in_formulas(const Covariate& c, const std::string& in_formula, double unit) {
  Variable out;
  out.name = out.read_as = c.name;
  out.covariate = c;
  out.in_formula = in_formula;
  out.unit = unit;
  return out;
}

Variable position_of(const Observations& o, AxisId a) {
  const Axis& axis = o.machine().axes[a];
  const bool rotary = axis.kind == AxisKind::rotary;
  Variable out = in_formulas(covariate(o, axis.name, [a](const MachineState& s) { return s.q[a]; }),
                             rotary ? axis.name : "(" + axis.name + "/100)", rotary ? 1.0 : 100.0);
  out.rotary = rotary;
  out.read_in = rotary ? "deg" : "mm";
  return out;
}

Variable velocity_of(const Observations& o, AxisId a, bool size) {
  const Axis& axis = o.machine().axes[a];
  const bool rotary = axis.kind == AxisKind::rotary;
  const std::string name = "vel_" + axis.name;
  const double unit = rotary ? 0.1 : 10.0;
  Variable out = in_formulas(
      covariate(o, size ? "abs(" + name + ")" : name,
                [a, size](const MachineState& s) { return size ? std::abs(s.velocity[a]) : s.velocity[a]; }),
      "(" + name + (rotary ? "/0.1)" : "/10)"), unit);
  out.only_gates = size;
  out.no_gates = !size;  // a range of speeds is one of either sense
  out.read_as = size ? "speed of " + axis.name : name;
  out.read_in = rotary ? "deg/min" : "mm/min";
  out.read_factor = kSecondsPerMinute * (rotary ? kDegreePerRad : 1.0);
  return out;
}

std::vector<Variable> variables(const Observations& o) {
  std::vector<Variable> out;
  const auto& axes = o.machine().axes;
  const auto add = [&](Variable v) {
    if (v.covariate.distinct > 1) out.push_back(std::move(v));
  };
  for (AxisId a = 0; a < axes.size(); ++a) {
    const std::string sense = "dir_" + axes[a].name;
    add(position_of(o, a));
    Variable last =
        in_formulas(covariate(o, sense, [a](const MachineState& s) { return s.direction[a]; }), sense, 1.0);
    last.no_gates = true;
    add(std::move(last));
    add(velocity_of(o, a, false));
    add(velocity_of(o, a, true));
  }
  add(in_formulas(covariate(o, "t", [](const MachineState& s) { return s.time_s; }), "(t/3600)", 3600.0));
  const auto& names = o.data().context.names;
  for (std::size_t k = 0; k < names.temperatures.size(); ++k) {
    const std::string name = "T_" + names.temperatures[k];
    Variable v =
        in_formulas(covariate(o, name, [k](const MachineState& s) { return s.temperature(k); }), name, 1.0);
    v.labels_runs = true;
    v.read_in = "degC";
    v.read_zero = o.machine().reference_degC;
    add(std::move(v));
  }
  for (std::size_t k = 0; k < names.states.size(); ++k) {
    const std::string name = "s_" + names.states[k];
    add(in_formulas(covariate(o, name, [k](const MachineState& s) { return s.free_state(k); }), name, 1.0));
  }
  Variable speed = in_formulas(covariate(o, "rpm", [](const MachineState& s) { return s.spindle_rpm; }),
                               "(rpm/1000)", 1000.0);
  speed.read_as = "spindle speed";
  speed.read_in = "1/min";
  add(std::move(speed));
  return out;
}

// Readings that differ from most, in effect: (sum d^2)^2 / sum d^4.
bool carried(const Eigen::VectorXf& step) {
  const double ones = step.cast<double>().sum();
  return std::min(ones, static_cast<double>(step.size()) - ones) >= kLeastReadings;
}

// Some run has readings on both sides.
bool divides_a_run(const Observations& o, const Eigen::VectorXf& step) {
  constexpr double kFewest = 3.0;  // readings of either side
  return std::any_of(o.runs().begin(), o.runs().end(), [&](const std::vector<Eigen::Index>& run) {
    double ones = 0.0;
    for (const Eigen::Index i : run) ones += step[i];
    return ones >= kFewest && static_cast<double>(run.size()) - ones >= kFewest;
  });
}

// Whether a part of the range, 1 inside, may be one in which an error acts.
bool may_act_in(const Observations& o, const Variable& v, const Eigen::VectorXf& part) {
  return carried(part) && (!v.labels_runs || divides_a_run(o, part));
}

void add_simple(const Variable& v, std::size_t number, std::vector<FormulaTerm>& to) {
  if (v.only_gates) return;
  const TermWriter w(v, number);
  const auto degree = static_cast<int>(v.covariate.distinct) - 1;
  if (v.rotary) {
    for (int n = 1; n <= 2; ++n)
      for (const bool sine : {true, false}) to.push_back(w.harmonic(n, sine));
  }
  const int powers = v.name.starts_with("dir_") ? 1 : 2;
  for (int n = 1; n <= std::min(degree, powers); ++n) to.push_back(w.power(n));
}

void add_gates(const Observations& o, const Variable& v, std::size_t number, std::vector<FormulaTerm>& to) {
  if (v.no_gates) return;
  const TermWriter w(v, number);
  for (const double at : places_between(v.covariate.values, kStepPlaces)) {
    FormulaTerm step = w.step(at);
    if (may_act_in(o, v, step.values)) to.push_back(std::move(step));
  }
  const std::vector<double> ends = places_between(v.covariate.values, kWindowPlaces);
  for (std::size_t i = 0; i < ends.size(); ++i)
    for (std::size_t k = i + 1; k < ends.size(); ++k) {
      FormulaTerm window = w.window(ends[i], ends[k]);
      if (may_act_in(o, v, window.values)) to.push_back(std::move(window));
    }
}

void add_others(const Observations& o, const Variable& v, std::size_t number, std::vector<FormulaTerm>& to) {
  if (v.covariate.distinct < kFewestForGates) return;
  if (v.only_gates) return add_gates(o, v, number, to);
  const TermWriter w(v, number);
  const auto degree = static_cast<int>(v.covariate.distinct) - 1;
  for (int n = 3; n <= std::min(degree, 4); ++n) to.push_back(w.power(n));
  if (v.covariate.distinct >= kFewestForWaves) {
    const double range = v.covariate.values.maxCoeff() - v.covariate.values.minCoeff();
    if (v.rotary) {
      for (int n = 3; n <= kHarmonicsOfTurn; ++n)
        for (const bool sine : {true, false}) to.push_back(w.harmonic(n, sine));
    } else {
      const double fastest = std::min(kFastestWave, static_cast<double>(v.covariate.distinct) / 3.0);
      for (double cycles = kSlowestWave; cycles <= fastest; cycles += kWaveStep)
        for (const bool sine : {true, false}) to.push_back(w.wave(range / cycles, sine));
    }
    for (const double at : places_between(v.covariate.values, kKinks))
      if (may_act_in(o, v, w.step(at).values)) to.push_back(w.kink(at));
  }
  add_gates(o, v, number, to);
}

std::string product_text(const std::string& a, const std::string& b) {
  return a.empty() ? b : b.empty() ? a : a + "*" + b;
}

// FormulaTerm::price among so many terms.
double price_among(std::size_t terms) {
  return 2.0 * std::log(static_cast<double>(terms));
}

}  // namespace

double Variable::place_unit() const {
  return rotary ? kRadPerDegree : 1.0;
}

std::string Variable::place_text() const {
  return rotary ? name + "*" + digits(kPi * kDegreePerRad) + "/_pi" : name;
}

std::string Variable::text_of(const TermGate& gate) const {
  std::string out;
  if (gate.above) out = "(" + place_text() + " > " + digits(*gate.above) + ")";
  if (gate.below) out = product_text(out, "(" + place_text() + " < " + digits(*gate.below) + ")");
  return out;
}

Eigen::VectorXf Variable::values_of(const TermGate& gate) const {
  Eigen::VectorXf out(covariate.values.size());
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    const double x = covariate.values[i] / place_unit();
    out[i] = (!gate.above || x > *gate.above) && (!gate.below || x < *gate.below) ? 1.0F : 0.0F;
  }
  return out;
}

FormulaTerm with_gates(const FormulaTerm& term, const std::vector<TermGate>& gates,
                       const std::vector<Variable>& variables) {
  FormulaTerm out = term;
  out.gates = gates;
  out.text = term.ungated_text;
  out.values = term.ungated.size() > 0 ? term.ungated : Eigen::VectorXf::Ones(term.values.size());
  for (const TermGate& g : gates) {
    out.text = product_text(out.text, variables[g.variable].text_of(g));
    out.values = out.values.cwiseProduct(variables[g.variable].values_of(g)).eval();
  }
  return out;
}

std::optional<FormulaTerm> product(const FormulaTerm& a, const FormulaTerm& b) {
  if (a.text.find(b.text) != std::string::npos || b.text.find(a.text) != std::string::npos)
    return std::nullopt;
  FormulaTerm out;
  out.text = a.text + "*" + b.text;
  out.values = a.values.cwiseProduct(b.values);
  out.variable = a.variable;
  out.gates = a.gates;
  out.gates.insert(out.gates.end(), b.gates.begin(), b.gates.end());
  if (out.gates.empty()) return out;
  const auto text = [](const FormulaTerm& t) { return t.gates.empty() ? t.text : t.ungated_text; };
  out.ungated_text = product_text(text(a), text(b));
  out.ungated = Eigen::VectorXf::Ones(out.values.size());
  for (const FormulaTerm* t : {&a, &b}) {
    if (t->gates.empty())
      out.ungated = out.ungated.cwiseProduct(t->values).eval();
    else if (t->ungated.size() > 0)
      out.ungated = out.ungated.cwiseProduct(t->ungated).eval();
  }
  return out;
}

// So that the formula's value is the one that was tried.
double as_written(double place) {
  return std::stod(digits(place));
}

FormulaTerms formula_terms(const Observations& o) {
  FormulaTerms out;
  out.terms.emplace_back().values = Eigen::VectorXf::Ones(o.size());
  out.variables = variables(o);
  const std::vector<Variable>& all = out.variables;
  std::vector<std::size_t> first;  // of each variable, and the end
  for (std::size_t k = 0; k < all.size(); ++k) {
    first.push_back(out.terms.size());
    add_simple(all[k], k, out.terms);
  }
  first.push_back(out.terms.size());
  const auto price_from = [&](std::size_t begin, std::size_t count) {
    for (std::size_t k = begin; k < out.terms.size(); ++k) out.terms[k].price = price_among(count);
  };
  const std::size_t simple = out.terms.size();
  price_from(0, simple);
  for (std::size_t k = 0; k < all.size(); ++k) {
    // What happens at a moment of a run is an affair of that run.
    if (all[k].name != "t") add_others(o, all[k], k, out.terms);
  }
  out.of_one_variable = out.terms.size();
  price_from(simple, out.of_one_variable);
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t a = first[i]; a < first[i + 1]; ++a)
      for (std::size_t b = first[i + 1]; b < simple; ++b) {
        if (auto both = product(out.terms[a], out.terms[b])) out.terms.push_back(std::move(*both));
      }
  // Lost motion of a part of the travel, or of a range of speed.
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].name.starts_with("dir_")) continue;
    const std::string axis = all[i].name.substr(4);
    for (std::size_t k = simple; k < out.of_one_variable; ++k) {
      const FormulaTerm& part = out.terms[k];
      if (part.gates.empty() || (part.variable != axis && part.variable != "abs(vel_" + axis + ")")) continue;
      if (auto both = product(out.terms[first[i]], part)) out.terms.push_back(std::move(*both));
    }
  }
  price_from(out.of_one_variable, simple + out.terms.size() - out.of_one_variable);
  return out;
}

}  // namespace trunnion::diagnosis
