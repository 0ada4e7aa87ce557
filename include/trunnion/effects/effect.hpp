#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/machine/kinematics.hpp"

namespace trunnion {

/// Unit in which a parameter is read and printed; inside it is mm, rad, s, K and their quotients.
enum class Unit : std::uint8_t {
  none,
  um,
  mm,
  urad,
  deg,
  um_per_K,
  urad_per_K,
  um_per_m_K,
  um_per_s,
  um_per_krpm,
  s,
  count,
  um_per_unit,
  urad_per_unit
};
double unit_factor(Unit unit);            // internal = printed * factor
std::string_view unit_suffix(Unit unit);  // "um", "urad", ...: the end of the parameter's key

/// Where in the chain a twist acts.
struct Link {
  enum class Kind : std::uint8_t { joint, spindle, part };
  Kind kind = Kind::joint;
  AxisId axis = 0;  // of a joint
  bool operator==(const Link&) const = default;
};

/// A quantity that errors may depend on with memory: a first-order lag follows it.
struct Signal {
  enum class Kind : std::uint8_t { spindle_rpm, temperature, state };
  Kind kind = Kind::spindle_rpm;
  std::size_t index = 0;  // of the temperature or the free state in StateNames
  bool operator==(const Signal&) const = default;
};
struct LagRequest {
  Signal signal;
  double tau_s = 0.0;
};

/// Names of the sensors whose values a MachineState carries: columns T_<name>_degC and s_<name>.
struct StateNames {
  std::vector<std::string> temperatures;
  std::vector<std::string> states;
};

/// What the machine is doing at one reading or one NC block: all that an error may depend on.
struct MachineState {
  JointVector q;  // commanded, mm and rad
  std::array<std::int8_t, kMaxAxes>
      direction{};       // +1, -1: sense of the axis' last motion; 0 unknown or long at rest
  JointVector velocity;  // mm/s, rad/s
  double spindle_rpm = 0.0;
  std::span<const double> temperature_K;  // above the machine's reference temperature, by StateNames
  std::span<const double> state;          // free states, by StateNames
  double time_s = 0.0;                    // within the run
  std::size_t run = 0;                    // index of the run
};

enum class ParameterRole : std::uint8_t {
  linear,  // the twist is proportional to it
  shape    // period, time constant, moment: the twist depends on it in another way
};

struct Parameter {
  std::string name;  // ISO symbol or word, without the unit: "X0C", "b", "tau"
  Unit unit = Unit::none;
  ParameterRole role = ParameterRole::linear;
  double usual =
      0.0;  // usual magnitude on real machines (linear) or the middle of the search (shape), internal unit
  double min = 0.0;  // of the search, shape parameters only
  double max = 0.0;
  bool integer = false;  // shape parameters that are whole numbers (teeth of a worm)

  /// Key in files: "X0C_um".
  std::string key() const;
};

/// Which switch of the command line turns an effect off.
enum class EffectClass : std::uint8_t { geometric, thermal, dynamic, setup };

struct EffectInfo {
  std::string id;      // "location:C"
  std::string what;    // what it is physically, one sentence
  std::string cause;   // what causes it
  std::string remedy;  // what to do at the machine
  EffectClass kind = EffectClass::geometric;
  std::vector<Parameter> parameters;  // linear ones first
  std::size_t linear_count() const;
};

/// One physical effect: maps (state, parameters) to a twist of one link.
///
/// Laws that every effect keeps (tests/effects/contract_test.cpp): zero linear parameters give a zero twist;
/// the twist is the sum of linear parameter times column; columns are finite and, but for direction and step,
/// continuous in the state.
class Effect {
 public:
  virtual ~Effect() = default;
  virtual const EffectInfo& info() const = 0;
  /// The link at which its twist acts.
  virtual Link link() const = 0;
  /// Lagged signals that `columns` wants, in order, for these shape parameters.
  virtual std::vector<LagRequest> lags(std::span<const double> shape) const;
  /// Twist per unit of each linear parameter (internal units), at `link()`, in the axes that ChainErrors
  /// defines.
  /// @param lagged  values of the requested lags at this state
  /// @param shape   values of the shape parameters, in the order of info().parameters
  /// @param out     one twist per linear parameter
  virtual void columns(const MachineState& state, std::span<const double> lagged,
                       std::span<const double> shape, std::span<Twist> out) const = 0;
};

}  // namespace trunnion
