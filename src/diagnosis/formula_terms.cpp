#include "diagnosis/formula_terms.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <functional>

#include "trunnion/base/units.hpp"

#include "diagnosis/covariates.hpp"

namespace trunnion::diagnosis {
namespace {

constexpr int kPlaces = 160;  // of a step along the range
constexpr int kKinks = 24;
constexpr int kWindowPlaces = 16;  // of the ends of a window
constexpr int kHarmonicsOfTurn = 6;
constexpr double kSlowestWave = 1.5, kFastestWave = 16.0, kWaveStep = 0.5;  // cycles along the range
constexpr double kLeastReadings = 6.0;  // that differ from most: what fewer carry is an outlier

std::string digits(double value) {
  std::array<char, 40> buffer;
  const auto r = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value == 0.0 ? 0.0 : value,
                               std::chars_format::general, 4);
  return {buffer.data(), r.ptr};
}
// As it is written, so that the formula's value is the one that was tried.
double written(double value) {
  return std::stod(digits(value));
}

// A variable of formulas: its name there, and as it is read by people.
struct Variable {
  std::string name;
  Covariate covariate;
  bool rotary = false;
  std::string in_formula;  // of a size about 1
  double unit = 1.0;       // of `in_formula`, in the variable's own
};

class Writer {
 public:
  explicit Writer(const Variable& v) : v_(v) {}

  FormulaTerm term(const std::string& text, const std::function<double(double)>& f) const {
    FormulaTerm out{text, Eigen::VectorXf(v_.covariate.values.size()), v_.name, 0.0};
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
    const double p = written(period);
    return term((sine ? "sin(2*_pi*" : "cos(2*_pi*") + v_.name + "/" + digits(p) + ")",
                [p, sine](double x) { return sine ? std::sin(kTwoPi * x / p) : std::cos(kTwoPi * x / p); });
  }
  FormulaTerm step(double at) const {
    const double place = written(at / place_unit());
    return term("(" + place_text() + " > " + digits(place) + ")",
                [this, place](double x) { return x / place_unit() > place ? 1.0 : 0.0; });
  }
  FormulaTerm window(double from, double to) const {
    const double low = written(from / place_unit()), high = written(to / place_unit());
    return term("(" + place_text() + " > " + digits(low) + ")*(" + place_text() + " < " + digits(high) + ")",
                [this, low, high](double x) {
                  return x / place_unit() > low && x / place_unit() < high ? 1.0 : 0.0;
                });
  }
  FormulaTerm kink(double at) const {
    const double place = written(at / place_unit());
    return term("max(" + place_text() + " - " + digits(place) + ", 0)/100",
                [this, place](double x) { return std::max(x / place_unit() - place, 0.0) / 100.0; });
  }

 private:
  // Places are read in degrees.
  double place_unit() const { return v_.rotary ? kRadPerDegree : 1.0; }
  std::string place_text() const {
    const std::string half_turn_deg = digits(kPi * kDegreePerRad);
    return v_.rotary ? v_.name + "*" + half_turn_deg + "/_pi" : v_.name;
  }
  const Variable& v_;
};

std::vector<Variable> variables(const Observations& o) {
  std::vector<Variable> out;
  const auto& axes = o.machine().axes;
  const auto add = [&](Variable v) {
    if (v.covariate.distinct > 1) out.push_back(std::move(v));
  };
  for (AxisId a = 0; a < axes.size(); ++a) {
    const std::string& name = axes[a].name;
    const bool rotary = axes[a].kind == AxisKind::rotary;
    add({name, covariate(o, name, [a](const MachineState& s) { return s.q[a]; }), rotary,
         rotary ? name : "(" + name + "/100)", rotary ? 1.0 : 100.0});
    add({"dir_" + name, covariate(o, "dir_" + name, [a](const MachineState& s) { return s.direction[a]; }),
         false, "dir_" + name, 1.0});
    add({"vel_" + name, covariate(o, "vel_" + name, [a](const MachineState& s) { return s.velocity[a]; }),
         false, "(vel_" + name + (rotary ? "/0.1)" : "/10)"), rotary ? 0.1 : 10.0});
  }
  add({"t", covariate(o, "t", [](const MachineState& s) { return s.time_s; }), false, "(t/3600)", 3600.0});
  const auto& names = o.data().context.names;
  for (std::size_t k = 0; k < names.temperatures.size(); ++k) {
    const std::string name = "T_" + names.temperatures[k];
    add({name, covariate(o, name, [k](const MachineState& s) { return s.temperature(k); }), false, name,
         1.0});
  }
  for (std::size_t k = 0; k < names.states.size(); ++k) {
    const std::string name = "s_" + names.states[k];
    add({name, covariate(o, name, [k](const MachineState& s) { return s.free_state(k); }), false, name, 1.0});
  }
  add({"rpm", covariate(o, "rpm", [](const MachineState& s) { return s.spindle_rpm; }), false, "(rpm/1000)",
       1000.0});
  return out;
}

// Readings that differ from most, in effect: (sum d^2)^2 / sum d^4.
bool carried(const Eigen::VectorXf& step) {
  const double ones = step.cast<double>().sum();
  return std::min(ones, static_cast<double>(step.size()) - ones) >= kLeastReadings;
}

void add_simple(const Variable& v, std::vector<FormulaTerm>& to) {
  const Writer w(v);
  const auto degree = static_cast<int>(v.covariate.distinct) - 1;
  if (v.rotary) {
    for (int n = 1; n <= 2; ++n)
      for (const bool sine : {true, false}) to.push_back(w.harmonic(n, sine));
  }
  const int powers = v.name.starts_with("dir_") ? 1 : 2;
  for (int n = 1; n <= std::min(degree, powers); ++n) to.push_back(w.power(n));
}

void add_others(const Variable& v, std::vector<FormulaTerm>& to) {
  const Writer w(v);
  const auto degree = static_cast<int>(v.covariate.distinct) - 1;
  for (int n = 3; n <= std::min(degree, 4); ++n) to.push_back(w.power(n));
  if (v.covariate.distinct < 8) return;
  const double range = v.covariate.values.maxCoeff() - v.covariate.values.minCoeff();
  if (v.rotary) {
    for (int n = 3; n <= kHarmonicsOfTurn; ++n)
      for (const bool sine : {true, false}) to.push_back(w.harmonic(n, sine));
  } else {
    const double fastest = std::min(kFastestWave, static_cast<double>(v.covariate.distinct) / 3.0);
    for (double cycles = kSlowestWave; cycles <= fastest; cycles += kWaveStep)
      for (const bool sine : {true, false}) to.push_back(w.wave(range / cycles, sine));
  }
  for (const double at : places_between(v.covariate.values, kPlaces)) {
    FormulaTerm step = w.step(at);
    if (!carried(step.values)) continue;
    to.push_back(std::move(step));
  }
  for (const double at : places_between(v.covariate.values, kKinks))
    if (carried(w.step(at).values)) to.push_back(w.kink(at));
  const std::vector<double> ends = places_between(v.covariate.values, kWindowPlaces);
  for (std::size_t i = 0; i < ends.size(); ++i)
    for (std::size_t k = i + 1; k < ends.size(); ++k) {
      FormulaTerm window = w.window(ends[i], ends[k]);
      if (carried(window.values)) to.push_back(std::move(window));
    }
}

}  // namespace

std::optional<FormulaTerm> product(const FormulaTerm& a, const FormulaTerm& b) {
  if (a.text.find(b.text) != std::string::npos || b.text.find(a.text) != std::string::npos)
    return std::nullopt;
  return FormulaTerm{a.text + "*" + b.text, a.values.cwiseProduct(b.values), a.variable, 0.0};
}

double price_among(std::size_t terms) {
  return 2.0 * std::log(static_cast<double>(terms));
}

FormulaTerms formula_terms(const Observations& o) {
  FormulaTerms out;
  out.terms.push_back({"", Eigen::VectorXf::Ones(o.size()), "", 0.0});
  const std::vector<Variable> all = variables(o);
  std::vector<std::size_t> first;  // of each variable, and the end
  for (const Variable& v : all) {
    first.push_back(out.terms.size());
    add_simple(v, out.terms);
  }
  first.push_back(out.terms.size());
  const auto price_from = [&](std::size_t begin, std::size_t count) {
    for (std::size_t k = begin; k < out.terms.size(); ++k) out.terms[k].price = price_among(count);
  };
  const std::size_t simple = out.terms.size();
  price_from(0, simple);
  for (const Variable& v : all) {
    // What happens at a moment of a run is an affair of that run.
    if (v.name != "t") add_others(v, out.terms);
  }
  out.of_one_variable = out.terms.size();
  price_from(simple, out.of_one_variable);
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t a = first[i]; a < first[i + 1]; ++a)
      for (std::size_t b = first[i + 1]; b < simple; ++b) {
        if (auto both = product(out.terms[a], out.terms[b])) out.terms.push_back(std::move(*both));
      }
  price_from(out.of_one_variable, simple + out.terms.size() - out.of_one_variable);
  return out;
}

}  // namespace trunnion::diagnosis
