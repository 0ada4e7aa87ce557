#include "trunnion/effects/effect.hpp"

#include <algorithm>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/units.hpp"

namespace trunnion {
namespace {

struct UnitEntry {
  Unit unit;
  std::string_view suffix;
  double factor;
  double largest;  // as printed: 100 mm, 0.1 rad, 100 mm a kelvin ... is no error of a machine
};

constexpr double kRpmPerKrpm = 1e3;
constexpr double kMmPerM = 1e3;
constexpr double kSecondsPerHour = kSecondsPerMinute * kSecondsPerMinute;

// Longest first: a key that ends in `_um_per_K` must not be read as kelvin.
constexpr std::array kUnits = {
    UnitEntry{Unit::um_per_m_K, "um_per_m_K", kMmPerUm / kMmPerM, 1e5},
    UnitEntry{Unit::um_per_krpm, "um_per_krpm", kMmPerUm / kRpmPerKrpm, 1e5},
    UnitEntry{Unit::urad_per_m, "urad_per_m", kRadPerUrad / kMmPerM, 1e5},
    UnitEntry{Unit::urad_per_K, "urad_per_K", kRadPerUrad, 1e5},
    UnitEntry{Unit::um_per_K, "um_per_K", kMmPerUm, 1e5},
    UnitEntry{Unit::um_per_h, "um_per_h", kMmPerUm / kSecondsPerHour, 1e6},
    UnitEntry{Unit::urad, "urad", kRadPerUrad, 1e5},
    UnitEntry{Unit::deg, "deg", kRadPerDegree, 1e5},
    UnitEntry{Unit::um, "um", kMmPerUm, 1e5},
    UnitEntry{Unit::mm, "mm", 1.0, 1e6},
    UnitEntry{Unit::ms, "ms", 1e-3, 1e12},
    UnitEntry{Unit::s, "s", 1.0, 1e9},
    UnitEntry{Unit::none, "", 1.0, 1e9},
};

const UnitEntry& entry_of(Unit unit) {
  return *std::find_if(kUnits.begin(), kUnits.end(), [unit](const UnitEntry& e) { return e.unit == unit; });
}

}  // namespace

double unit_factor(Unit unit) {
  return entry_of(unit).factor;
}
std::string_view unit_suffix(Unit unit) {
  return entry_of(unit).suffix;
}
double largest_value(Unit unit) {
  return entry_of(unit).largest;
}

Unit unit_of_key(std::string_view key) {
  for (const UnitEntry& e : kUnits) {
    if (e.suffix.empty() || key.size() < e.suffix.size() + 2 || !key.ends_with(e.suffix)) continue;
    if (key[key.size() - e.suffix.size() - 1] == '_') return e.unit;
  }
  return Unit::none;
}

double MachineState::value(const Signal& signal) const {
  switch (signal.kind) {
    case Signal::Kind::spindle_rpm:
      return spindle_rpm;
    case Signal::Kind::temperature:
      return temperature(signal.index);
    case Signal::Kind::state:
      return free_state(signal.index);
    case Signal::Kind::position:
      return q[signal.index];
    case Signal::Kind::velocity:
      return velocity[signal.index];
    case Signal::Kind::direction:
      return direction[signal.index];
  }
  return 0.0;
}

std::string Parameter::key() const {
  const std::string_view suffix = unit_suffix(unit);
  return suffix.empty() ? name : name + "_" + std::string(suffix);
}

std::string_view text_of(EffectClass kind) {
  constexpr std::array<std::string_view, 4> kTexts = {"geometric", "thermal", "dynamic", "setup"};
  return kTexts[static_cast<std::size_t>(kind)];
}

std::size_t EffectInfo::linear_count() const {
  return static_cast<std::size_t>(std::count_if(parameters.begin(), parameters.end(), [](const Parameter& p) {
    return p.role == ParameterRole::linear;
  }));
}

std::vector<LagRequest> Effect::lags(std::span<const double>) const {
  return {};
}

Twist Effect::fixed_part(const MachineState&, std::span<const double>, std::span<const double>) const {
  return {};
}

Twist Effect::twist(const MachineState& state, std::span<const double> lagged,
                    std::span<const double> parameters) const {
  const EffectInfo& i = info();
  TRUNNION_EXPECTS(parameters.size() == i.parameters.size());
  const std::size_t count = i.linear_count();
  const auto linear = parameters.first(count);
  const auto shape = parameters.subspan(count);
  constexpr std::size_t kOnStack = 16;
  std::array<Twist, kOnStack> few;
  std::vector<Twist> many(count > kOnStack ? count : 0);
  const std::span<Twist> out = count > kOnStack ? std::span<Twist>(many) : std::span<Twist>(few).first(count);
  columns(state, lagged, shape, out);
  Twist sum = fixed_part(state, lagged, shape);
  for (std::size_t k = 0; k < count; ++k) sum += out[k] * linear[k];
  return sum;
}

std::optional<TwistBend> Effect::bend(const MachineState&, const MachineState&,
                                      std::span<const double>) const {
  return std::nullopt;
}

std::optional<TwistRange> Effect::range(std::span<const double>, std::span<const Axis>) const {
  return std::nullopt;
}

RangeCheck Effect::check_range(const MachineState&) const {
  return {};
}
std::vector<Effect::Derived> Effect::derived(std::span<const double>) const {
  return {};
}
bool Effect::set_derived(std::string_view, double, std::span<double>) const {
  return false;
}

}  // namespace trunnion
