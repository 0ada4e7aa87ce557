#include "trunnion/effects/model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/failure.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

#include "effects/interpolants.hpp"

namespace trunnion {

std::vector<double> ModelEffect::values() const {
  std::vector<double> out;
  for (const ParameterValue& p : parameters) out.push_back(p.value);
  return out;
}

std::vector<double> ModelEffect::shape() const {
  std::vector<double> out = values();
  out.erase(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(effect->info().linear_count()));
  return out;
}

namespace {

enum class Dimension { other, length, angle, time };

Dimension dimension_of(Unit unit) {
  switch (unit) {
    case Unit::um:
    case Unit::mm:
      return Dimension::length;
    case Unit::urad:
    case Unit::deg:
      return Dimension::angle;
    case Unit::s:
    case Unit::ms:
      return Dimension::time;
    default:
      return Dimension::other;
  }
}

bool convertible(Unit a, Unit b) {
  return a == b || (dimension_of(a) != Dimension::other && dimension_of(a) == dimension_of(b));
}

}  // namespace

std::optional<std::size_t> ModelEffect::find(std::string_view name) const {
  const Unit unit = unit_of_key(name);
  const std::string whole = canonical_symbol(name);
  const std::string stem = unit == Unit::none
                               ? whole
                               : canonical_symbol(name.substr(0, name.size() - unit_suffix(unit).size() - 1));
  const auto& parameters_of = effect->info().parameters;
  for (std::size_t k = 0; k < parameters_of.size(); ++k) {
    const Parameter& p = parameters_of[k];
    if (p.name == whole || (p.name == stem && convertible(unit, p.unit))) return k;
  }
  return std::nullopt;
}

ModelEffect model_effect(std::shared_ptr<const Effect> effect) {
  ModelEffect out;
  for (const Parameter& p : effect->info().parameters) {
    ParameterValue value;
    if (p.role == ParameterRole::shape) value.value = p.usual;
    out.parameters.push_back(value);
  }
  out.effect = std::move(effect);
  return out;
}

Model filtered(const Model& model, const std::function<bool(const EffectInfo&)>& keep) {
  Model out = model;
  std::erase_if(out.effects, [&](const ModelEffect& e) { return !keep(e.effect->info()); });
  return out;
}

std::vector<LagRequest> lag_requests(const Model& model) {
  std::vector<LagRequest> out;
  for (const ModelEffect& e : model.effects) {
    const auto lags = e.effect->lags(e.shape());
    out.insert(out.end(), lags.begin(), lags.end());
  }
  return out;
}

std::vector<std::string> missing_sensors(const Model& model, const EffectContext& data) {
  std::vector<std::string> out;
  const auto lacks = [](const std::vector<std::string>& have, const std::string& name) {
    return std::find(have.begin(), have.end(), name) == have.end();
  };
  for (const std::string& name : model.context.names.temperatures) {
    if (lacks(data.names.temperatures, name)) out.push_back("T_" + name);
  }
  for (const std::string& name : model.context.names.states) {
    if (lacks(data.names.states, name)) out.push_back("s_" + name);
  }
  return out;
}

Twist ModelEvaluator::Entry::twist(const MachineState& state, std::span<const double> lagged) const {
  const auto own = lagged.subspan(lag_begin, lag_count);
  return only_fixed_part ? effect->fixed_part(state, own, {}) : effect->twist(state, own, parameters);
}

namespace {

// Beyond these no machine errs, and none would move.
constexpr double kLargestShift_mm = 1000.0;
constexpr double kLargestTurn_rad = 1.0;

// A twist that is no number is none either.
bool can_be(const Twist& twist, ModelEvaluator::Sizes sizes) {
  if (sizes == ModelEvaluator::Sizes::any) return twist.trans_mm.allFinite() && twist.rot_rad.allFinite();
  return (twist.trans_mm.array().abs() <= kLargestShift_mm).all() &&
         (twist.rot_rad.array().abs() <= kLargestTurn_rad).all();
}

std::string positions_text(const std::vector<std::string>& axes, const JointVector& q) {
  std::string out;
  for (std::size_t i = 0; i < axes.size() && i < kMaxAxes; ++i) {
    const bool rotary = std::string_view("ABC").find(axes[i]) != std::string_view::npos;
    out.append(out.empty() ? " at " : " ").append(axes[i]);
    out.append(shortest_text(std::round(q[i] / (rotary ? kRadPerDegree : 1.0) * 1e4) / 1e4));
  }
  return out;
}

}  // namespace

Twist ModelEvaluator::checked_twist(const Entry& entry, const MachineState& state,
                                    std::span<const double> lagged) const {
  Twist out = entry.twist(state, lagged);
  if (!can_be(out, sizes_)) refuse(entry, state, out);
  return out;
}

void ModelEvaluator::refuse(const Entry& entry, const MachineState& state, const Twist& twist) const {
  const double shift_mm = twist.trans_mm.cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
  const double turn_rad = twist.rot_rad.cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
  std::string what("effect '");
  what.append(entry.effect->info().id).append("' gives ");
  if (!std::isfinite(shift_mm) || !std::isfinite(turn_rad))
    what.append("no number");
  else if (shift_mm > kLargestShift_mm)
    what.append(shortest_text(shift_mm)).append(" mm, more than any machine errs,");
  else
    what.append(shortest_text(turn_rad)).append(" rad, more than any machine errs,");
  throw Failure({ErrorCode::wrong_input, what.append(positions_text(axes_, state.q)), file_, entry.where});
}

ModelEvaluator::ModelEvaluator(const Model& model, Sizes sizes)
    : sizes_(sizes),
      file_(model.file),
      axes_(model.axes),
      lags_(lag_requests(model)),
      rest_(lags_.size(), 0.0) {
  std::size_t begin = 0;
  for (const ModelEffect& e : model.effects) {
    const std::size_t count = e.effect->lags(e.shape()).size();
    const Entry entry{e.effect,
                      e.effect->link(),
                      begin,
                      count,
                      e.values(),
                      e.parameters.empty(),
                      e.effect->straight_course(),
                      false,
                      e.where};
    depends_on_ = std::max(depends_on_, count > 0 ? std::max(e.effect->depends_on(), DependsOn::conditions)
                                                  : e.effect->depends_on());
    if (count == 0 && e.effect->depends_on() == DependsOn::nothing) {
      link_of(constant_, entry.link) += checked_twist(entry, {}, {});
    } else {
      entries_.push_back(entry);
    }
    begin += count;
  }
  const auto behind =
      std::stable_partition(entries_.begin(), entries_.end(), [](const Entry& e) { return !e.course; });
  without_course_ = static_cast<std::size_t>(behind - entries_.begin());
  for (AxisId id = 0; id < kMaxAxes; ++id) {
    inside_min_[id] = -std::numeric_limits<double>::infinity();
    inside_max_[id] = std::numeric_limits<double>::infinity();
  }
  for (std::size_t i = without_course_; i < entries_.size(); ++i) {
    const StraightCourse& course = *entries_[i].course;
    inside_min_[course.axis] = std::max(inside_min_[course.axis], course.nodes.front());
    inside_max_[course.axis] = std::min(inside_max_[course.axis], course.nodes.back());
  }
  for (Entry& e : entries_) {
    const auto first = std::find_if(entries_.begin(), entries_.end(),
                                    [&](const Entry& other) { return other.link == e.link; });
    e.first_of_link = &*first == &e;
  }
}

std::vector<ModelEvaluator::LinkCourse> ModelEvaluator::courses() const {
  std::vector<LinkCourse> out;
  for (std::size_t i = without_course_; i < entries_.size(); ++i)
    out.push_back({entries_[i].link, &*entries_[i].course});
  return out;
}

ChainLinks ModelEvaluator::varying() const {
  ChainLinks out;
  for (const Entry& e : entries_) {
    bool& link = e.link.kind == Link::Kind::joint     ? out.joint[e.link.axis]
                 : e.link.kind == Link::Kind::spindle ? out.spindle
                                                      : out.part;
    link = true;
  }
  return out;
}

void ModelEvaluator::errors(const MachineState& state, std::span<const double> lagged,
                            ChainErrors& out) const {
  out = constant_;
  update(state, lagged, out);
}

void ModelEvaluator::update(const MachineState& state, std::span<const double> lagged,
                            ChainErrors& out) const {
  if (lagged.empty()) lagged = rest_;
  TRUNNION_EXPECTS(lagged.size() == lags_.size());
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Entry& e = entries_[i];
    Twist& sum = link_of(out, e.link);
    if (e.first_of_link) sum = link_of(constant_, e.link);
    if (i < without_course_) {
      sum += checked_twist(e, state, lagged);
      continue;
    }
    const StraightCourse& course = *e.course;
    const double value = effects::straight_value(course.nodes, course.values, state.q[course.axis]);
    (course.component < 3 ? sum.trans_mm[course.component] : sum.rot_rad[course.component - 3]) += value;
  }
}

ChainBends ModelEvaluator::bends(const MachineState& from, const MachineState& to) const {
  ChainBends out;
  for (const Entry& e : entries_) {
    const auto bend = e.effect->bend(from, to, e.parameters);
    if (!bend) {
      out.unbounded = e.effect.get();
      return out;
    }
    TwistBend& at = e.link.kind == Link::Kind::joint     ? out.joint[e.link.axis]
                    : e.link.kind == Link::Kind::spindle ? out.spindle
                                                         : out.part;
    at += *bend;
  }
  return out;
}

std::optional<TwistRange> ModelEvaluator::range(std::span<const Axis> axes) const {
  TwistRange out;
  const auto add = [&](const Twist& constant) {
    out.largest += {constant.trans_mm.norm(), constant.rot_rad.norm()};
  };
  for (const Twist& joint : constant_.joint) add(joint);
  add(constant_.spindle);
  add(constant_.part);
  for (const Entry& e : entries_) {
    const auto range = e.effect->range(e.parameters, axes);
    if (!range) return std::nullopt;
    out += *range;
  }
  return out;
}

RangeCheck ModelEvaluator::check_range(const MachineState& state) const {
  RangeCheck worst;
  std::size_t count = entries_.size();
  bool inside = true;
  for (AxisId id = 0; id < kMaxAxes; ++id)
    inside = inside && state.q[id] >= inside_min_[id] && state.q[id] <= inside_max_[id];
  if (inside) count = without_course_;
  for (std::size_t i = 0; i < count; ++i) {
    const Entry& e = entries_[i];
    RangeCheck check = e.effect->check_range(state);
    if (check.verdict > worst.verdict) worst = std::move(check);
  }
  return worst;
}

ChainErrors chain_errors(const Model& model, const MachineState& state, std::span<const double> lagged) {
  return ModelEvaluator(model).errors(state, lagged);
}

Vec3 datum_shift_P(const Machine& machine, const ModelEvaluator& model) {
  if (!machine.probed_at) return Vec3::Zero();
  MachineState state;
  state.q = *machine.probed_at;
  const Vec3 tool = machine.tool_vector();
  solve_linear(machine, Vec3::Zero(), tool, state.q);
  return DeviationMap(machine, state.q, tool).exact_P(model.errors(state)).displacement_mm;
}

}  // namespace trunnion
