#include "effects/formula.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "trunnion/base/texts.hpp"

#include "effects/formula_parser.hpp"
#include "effects/library_support.hpp"

namespace trunnion::effects {
namespace {

constexpr std::size_t kMaxParameters = 24;  // of one formula: evaluation keeps them on the stack

// Where a variable of a formula comes from.
struct Source {
  enum class Kind {
    position,
    direction,
    velocity,
    rpm,
    temperature,
    state,
    time,
    lag,
    parameter
  } kind = Kind::time;
  std::size_t index = 0;
};

double fetch(const Source& source, const MachineState& state, std::span<const double> lagged,
             std::span<const double> parameters) {
  switch (source.kind) {
    case Source::Kind::position:
      return state.q[source.index];
    case Source::Kind::direction:
      return state.direction[source.index];
    case Source::Kind::velocity:
      return state.velocity[source.index];
    case Source::Kind::rpm:
      return state.spindle_rpm;
    case Source::Kind::temperature:
      return state.temperature(source.index);
    case Source::Kind::state:
      return state.free_state(source.index);
    case Source::Kind::time:
      return state.time_s;
    case Source::Kind::lag:
      return lagged[source.index];
    case Source::Kind::parameter:
      return parameters[source.index];
  }
  return 0.0;
}

// A variable of the machine's state by its name; nothing when it is none.
std::optional<Source> state_source(const std::string& name, const Machine& machine, EffectContext& context) {
  using Kind = Source::Kind;
  if (name == "rpm") return Source{Kind::rpm, 0};
  if (name == "t") return Source{Kind::time, 0};
  if (const auto id = machine.axis(name)) return Source{Kind::position, *id};
  if (name.starts_with("T_") && name.size() > 2)
    return Source{Kind::temperature, index_of(context.names.temperatures, name.substr(2))};
  if (name.starts_with("s_") && name.size() > 2)
    return Source{Kind::state, index_of(context.names.states, name.substr(2))};
  if (name.starts_with("dir_") || name.starts_with("vel_")) {
    if (const auto id = machine.axis(name.substr(4)))
      return Source{name[0] == 'd' ? Kind::direction : Kind::velocity, *id};
  }
  return std::nullopt;
}

std::optional<Signal> signal_of(const Source& source) {
  switch (source.kind) {
    case Source::Kind::rpm:
      return Signal{Signal::Kind::spindle_rpm, 0};
    case Source::Kind::temperature:
      return Signal{Signal::Kind::temperature, source.index};
    case Source::Kind::state:
      return Signal{Signal::Kind::state, source.index};
    case Source::Kind::position:
      return Signal{Signal::Kind::position, source.index};
    case Source::Kind::velocity:
      return Signal{Signal::Kind::velocity, source.index};
    default:
      return std::nullopt;
  }
}

struct Lag {
  Signal signal;
  std::shared_ptr<const Expression> tau;  // of all parameters, in file order
};

// The formula as a function of state, lags and parameters (in the order of FormulaSpec::parameters).
struct Function {
  std::shared_ptr<const Expression> expression;
  std::vector<Source> sources;
  std::vector<Lag> lags;
  std::vector<bool> in_tau;  // parameters that a time constant depends on

  double operator()(const MachineState& state, std::span<const double> lagged,
                    std::span<const double> parameters) const {
    constexpr std::size_t kOnStack = 32;
    std::array<double, kOnStack> few{};
    std::vector<double> many(sources.size() > kOnStack ? sources.size() : 0);
    const auto values =
        sources.size() > kOnStack ? std::span<double>(many) : std::span<double>(few).first(sources.size());
    for (std::size_t i = 0; i < sources.size(); ++i) values[i] = fetch(sources[i], state, lagged, parameters);
    return (*expression)(values);
  }
};

std::string stem(const std::string& key) {
  const Unit unit = unit_of_key(key);
  return unit == Unit::none ? key : key.substr(0, key.size() - unit_suffix(unit).size() - 1);
}

Result<Function> compile(const FormulaSpec& spec, const Machine& machine, EffectContext& context) {
  if (const auto checked = check_signs(spec.expression); !checked) return tl::unexpected(checked.error());
  for (const std::string& name : names_in(spec.expression)) {
    if (name.starts_with(kLagPrefix) && name.ends_with("_"))
      return fail(ErrorCode::wrong_input, "formula \"" + spec.expression + "\" uses '" + name +
                                              "'; a lag is written lag(variable, time)");
  }
  const auto split = take_out_lags(spec.expression);
  if (!split) return tl::unexpected(split.error());
  if (spec.parameters.size() > kMaxParameters) {
    return fail(ErrorCode::wrong_input,
                "a formula has at most " + std::to_string(kMaxParameters) + " parameters");
  }
  std::vector<std::string> parameters;
  for (const auto& p : spec.parameters) parameters.push_back(stem(p.key));
  Function f;
  f.in_tau.assign(parameters.size(), false);
  for (const LagCall& call : split->lags) {
    const auto source = state_source(call.variable, machine, context);
    const auto signal = source ? signal_of(*source) : std::nullopt;
    if (!signal)
      return fail(ErrorCode::wrong_input,
                  "formula \"" + spec.expression + "\": lag cannot follow '" + call.variable + "'");
    auto tau = Expression::compile(call.tau, parameters);
    if (!tau) return tl::unexpected(tau.error());
    for (std::size_t i = 0; i < parameters.size(); ++i) f.in_tau[i] = f.in_tau[i] || (*tau)->uses(i);
    f.lags.push_back({*signal, *tau});
  }
  const std::vector<std::string> names = names_in(split->text);
  for (const std::string& name : names) {
    const auto parameter = std::find(parameters.begin(), parameters.end(), name);
    if (parameter != parameters.end()) {
      f.sources.push_back(
          {Source::Kind::parameter, static_cast<std::size_t>(parameter - parameters.begin())});
    } else if (name.starts_with(kLagPrefix) && name.ends_with("_")) {
      f.sources.push_back(
          {Source::Kind::lag, static_cast<std::size_t>(std::stoul(name.substr(kLagPrefix.size())))});
    } else if (const auto source = state_source(name, machine, context)) {
      f.sources.push_back(*source);
    } else {
      return fail(ErrorCode::wrong_input,
                  "formula \"" + spec.expression + "\" uses '" + name +
                      "', which is neither a parameter of [effect.parameters] nor an axis, dir_, vel_, "
                      "rpm, T_, s_, t or lag()");
    }
  }
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (f.in_tau[i] || std::binary_search(names.begin(), names.end(), parameters[i])) continue;
    return fail(ErrorCode::wrong_input,
                "parameter '" + spec.parameters[i].key + "' stands nowhere in \"" + spec.expression + "\"");
  }
  auto expression = Expression::compile(split->text, names);
  if (!expression) return tl::unexpected(expression.error());
  f.expression = *expression;
  return f;
}

// Random states of plausible size, at which a formula is tried.
class Trials {
 public:
  Trials(const FormulaSpec& spec, const Function& f, const EffectContext& context)
      : spec_(spec),
        lagged_(f.lags.size()),
        temperatures_(context.names.temperatures.size()),
        states_(context.names.states.size()) {}

  void next() {
    for (std::size_t i = 0; i < kMaxAxes; ++i) {
      state_.q[i] = uniform(-3.0, 3.0) * 30.0;
      state_.velocity[i] = uniform(-50.0, 50.0);
      state_.direction[i] = uniform(0.0, 1.0) < 0.5 ? -1 : 1;
    }
    state_.spindle_rpm = uniform(500.0, 9000.0);
    state_.time_s = uniform(10.0, 5000.0);
    for (double& v : temperatures_) v = uniform(0.5, 9.0);
    for (double& v : states_) v = uniform(0.2, 1.0);
    for (double& v : lagged_) v = uniform(0.2, 9.0);
    state_.temperature_K = temperatures_;
    state_.state = states_;
    parameters_.clear();
    for (const auto& p : spec_.parameters) {
      const double scale = p.value != 0.0 ? std::abs(p.value) : unit_factor(unit_of_key(p.key)) * 10.0;
      parameters_.push_back(scale * uniform(0.5, 2.0));
    }
  }
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  const MachineState& state() const { return state_; }
  std::span<const double> lagged() const { return lagged_; }
  std::vector<double>& parameters() { return parameters_; }

 private:
  const FormulaSpec& spec_;
  std::mt19937_64 random_{20250101};  // the same roles every time
  MachineState state_;
  std::vector<double> lagged_, temperatures_, states_, parameters_;
};

// True when f is affine in parameter a (b == a) or has no product of a and b: the second difference vanishes
// at every trial.
bool second_difference_vanishes(const Function& f, Trials trials, std::size_t a, std::size_t b) {
  constexpr int kTrials = 24;
  constexpr double kRounding = 1e-9;  // of the largest value: a thousand roundings of a formula
  int valid = 0;
  for (int k = 0; k < kTrials; ++k) {
    trials.next();
    std::vector<double>& p = trials.parameters();
    const std::vector<double> base = p;
    const auto at = [&](double step_a, double step_b) {
      p = base;
      p[a] += step_a * base[a];
      p[b] += step_b * base[b];
      return f(trials.state(), trials.lagged(), p);
    };
    const double values[] = {at(0.0, 0.0), at(0.7, 0.0), at(0.0, 1.1), at(0.7, 1.1)};
    double size = 0.0;
    bool finite = true;
    for (const double v : values) {
      size = std::max(size, std::abs(v));
      finite = finite && std::isfinite(v);
    }
    if (!finite) continue;
    ++valid;
    if (std::abs(values[3] - values[2] - values[1] + values[0]) > kRounding * size) return false;
  }
  return valid >= kTrials / 4;
}

// Which parameters f is jointly affine in; amplitudes (um, urad) are asked first, so that of `k * scale` k is
// the linear one.
std::vector<bool> linear_parameters(const FormulaSpec& spec, const Function& f,
                                    const EffectContext& context) {
  const std::size_t n = spec.parameters.size();
  std::vector<std::size_t> order;
  for (const bool amplitudes : {true, false}) {
    for (std::size_t i = 0; i < n; ++i) {
      const Unit unit = unit_of_key(spec.parameters[i].key);
      const bool amplitude =
          unit != Unit::none && unit != Unit::s && unit != Unit::ms && unit != Unit::deg && unit != Unit::mm;
      if (amplitude == amplitudes) order.push_back(i);
    }
  }
  const Trials trials(spec, f, context);
  std::vector<bool> out(n, false);
  for (const std::size_t i : order) {
    if (f.in_tau[i] || !second_difference_vanishes(f, trials, i, i)) continue;
    bool joint = true;
    for (std::size_t k = 0; k < n; ++k)
      joint = joint && (!out[k] || second_difference_vanishes(f, trials, i, k));
    out[i] = joint;
  }
  return out;
}

Parameter shape_parameter(const FormulaSpec::Key& key) {
  const Unit unit = unit_of_key(key.key);
  Parameter p = unit == Unit::s ? lag_time() : shape("", unit, 1.0, 0.1, 10.0);
  if (unit == Unit::mm) p = shape("", unit, 10.0, 1.0, 50.0);
  if (key.value != 0.0) {
    p.usual = key.value;
    constexpr double kSearch = 10.0;  // a factor either way of what the author wrote, when no range is given
    const auto [min, max] = std::minmax({key.value / kSearch, key.value * kSearch});
    if (unit != Unit::s) p.min = min;
    if (unit != Unit::s) p.max = max;
  }
  if (key.range) {
    p.min = (*key.range)[0];
    p.max = (*key.range)[1];
    p.usual = std::clamp(p.usual, p.min, p.max);
  }
  p.name = stem(key.key);
  p.unit = unit;
  return p;
}

Parameter linear_parameter(const FormulaSpec::Key& key) {
  const Unit unit = unit_of_key(key.key);
  const double usual = unit == Unit::urad ? 20.0 : unit == Unit::um ? 5.0 : 1.0;
  return linear(stem(key.key), unit, usual);
}

class FormulaEffect final : public Effect {
 public:
  // Where it acts: the joint's link, and the letter of the error there.
  struct At {
    Link link;
    char letter;
  };
  FormulaEffect(EffectInfo info, At at, Function f, std::vector<std::size_t> order, FormulaSpec spec)
      : info_(std::move(info)),
        link_(at.link),
        unit_(unit_twist(at.letter)),
        f_(std::move(f)),
        order_(std::move(order)),
        spec_(std::move(spec)) {}

  const EffectInfo& info() const override { return info_; }
  Link link() const override { return link_; }

  std::vector<LagRequest> lags(std::span<const double> shape) const override {
    const auto p = file_order(shape);
    std::vector<LagRequest> out;
    for (const Lag& lag : f_.lags) out.push_back({lag.signal, (*lag.tau)(std::span(p).first(order_.size()))});
    return out;
  }

  void columns(const MachineState& state, std::span<const double> lagged, std::span<const double> shape,
               std::span<Twist> out) const override {
    auto p = file_order(shape);
    const double at_zero = f_(state, lagged, p);
    for (std::size_t k = 0; k < out.size(); ++k) {
      const double step =
          info_.parameters[k].usual;  // affine: any step gives the slope; this one keeps its digits
      p[order_[k]] = step;
      out[k] = unit_ * ((f_(state, lagged, p) - at_zero) / step);
      p[order_[k]] = 0.0;
    }
  }

  Twist fixed_part(const MachineState& state, std::span<const double> lagged,
                   std::span<const double> shape) const override {
    return unit_ * f_(state, lagged, file_order(shape));
  }

  std::vector<std::pair<std::string, std::string>> file_keys() const override {
    std::vector<std::pair<std::string, std::string>> out = {
        {"joint", spec_.joint}, {"component", spec_.component}, {"expression", spec_.expression}};
    if (!spec_.what.empty()) out.emplace_back("what", spec_.what);
    return out;
  }

 private:
  // Parameters as the formula counts them: linear ones 0, shape ones as given.
  std::array<double, kMaxParameters> file_order(std::span<const double> shape) const {
    std::array<double, kMaxParameters> p{};
    const std::size_t first = order_.size() - shape.size();
    for (std::size_t k = 0; k < shape.size(); ++k) p[order_[first + k]] = shape[k];
    return p;
  }

  EffectInfo info_;
  Link link_;
  Twist unit_;
  Function f_;
  std::vector<std::size_t> order_;  // index in the file of each of info_.parameters
  FormulaSpec spec_;
};

Result<Link> link_of(const FormulaSpec& spec, const Machine& machine) {
  if (spec.joint == "S") return kSpindleLink;
  if (spec.joint == "P") return kPartLink;
  if (const auto id = machine.axis(spec.joint)) return joint_link(*id);
  return fail(ErrorCode::wrong_input,
              "'joint' is '" + spec.joint + "': neither an axis of the machine nor S (spindle) nor P (part)");
}

// Heat and time make an effect thermal, velocities dynamic: the switches of the command line go by it.
EffectClass kind_of(const Function& f) {
  EffectClass kind = EffectClass::geometric;
  for (const Source& s : f.sources) {
    if (s.kind == Source::Kind::velocity && kind == EffectClass::geometric) kind = EffectClass::dynamic;
    if (s.kind == Source::Kind::lag || s.kind == Source::Kind::temperature || s.kind == Source::Kind::rpm ||
        s.kind == Source::Kind::time) {
      kind = EffectClass::thermal;
    }
  }
  return kind;
}

}  // namespace

Result<std::shared_ptr<const Effect>> make_formula_effect(const FormulaSpec& spec, const Machine& machine,
                                                          EffectContext& context) {
  const auto link = link_of(spec, machine);
  if (!link) return tl::unexpected(link.error());
  const std::string& c = spec.component;
  const bool shaped = (c.size() == 2 || c.size() == 3) && c[0] == 'E' &&
                      std::string_view("XYZABC").find(c[1]) != std::string_view::npos;
  if (!shaped || (c.size() == 3 && c.substr(2) != spec.joint)) {
    return fail(ErrorCode::wrong_input, "'component' is '" + c + "'; for joint " + spec.joint +
                                            " it is one of EX" + spec.joint + " EY" + spec.joint + " EZ" +
                                            spec.joint + " EA" + spec.joint + " EB" + spec.joint + " EC" +
                                            spec.joint);
  }
  auto f = compile(spec, machine, context);
  if (!f) return tl::unexpected(f.error());
  const std::vector<bool> is_linear = linear_parameters(spec, *f, context);
  EffectInfo info;
  info.id = spec.id;
  info.what = spec.what.empty() ? "Formula of the user: " + c + " = " + spec.expression : spec.what;
  info.cause = "as its author says";
  info.remedy = "as its author says";
  info.kind = kind_of(*f);
  std::vector<std::size_t> order;
  for (const bool linear_ones : {true, false}) {
    for (std::size_t i = 0; i < spec.parameters.size(); ++i) {
      if (is_linear[i] != linear_ones) continue;
      order.push_back(i);
      info.parameters.push_back(linear_ones ? linear_parameter(spec.parameters[i])
                                            : shape_parameter(spec.parameters[i]));
    }
  }
  return std::make_shared<FormulaEffect>(std::move(info), FormulaEffect::At{*link, c[1]}, std::move(*f),
                                         std::move(order), spec);
}

}  // namespace trunnion::effects
