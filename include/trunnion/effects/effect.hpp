#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trunnion/machine/kinematics.hpp"

namespace trunnion {

/// Unit in which a parameter is read and printed; inside it is mm, rad, s, K, 1/min (spindle speed) and their
/// quotients.
enum class Unit : std::uint8_t {
  none,
  um,
  mm,
  urad,
  deg,
  um_per_K,
  urad_per_K,
  um_per_m_K,
  um_per_h,
  um_per_krpm,
  urad_per_m,
  s,
  ms
};
double unit_factor(Unit unit);            // internal = printed * factor
std::string_view unit_suffix(Unit unit);  // "um", "urad", ...: the end of the parameter's key; empty for none
/// Largest magnitude that a value of this unit has on any machine, as printed: beyond it the unit is wrong.
double largest_value(Unit unit);
/// The unit that ends a key ("k_um" -> um); none when the key ends in no known unit.
Unit unit_of_key(std::string_view key);

/// Where in the chain a twist acts.
struct Link {
  enum class Kind : std::uint8_t { joint, spindle, part };
  Kind kind = Kind::joint;
  AxisId axis = 0;  // of a joint
  bool operator==(const Link&) const = default;
};

/// A quantity that errors may depend on with memory: a first-order lag follows it.
struct Signal {
  enum class Kind : std::uint8_t { spindle_rpm, temperature, state, position, velocity, direction };
  Kind kind = Kind::spindle_rpm;
  std::size_t index = 0;  // of the temperature or the free state in StateNames, of the axis
  bool operator==(const Signal&) const = default;
};
struct LagRequest {
  Signal signal;
  double tau_s = 0.0;  // time constant; 0 or less: the signal itself
};

/// Names of the sensors whose values a MachineState carries: columns T_<name>_degC and s_<name>.
struct StateNames {
  std::vector<std::string> temperatures;
  std::vector<std::string> states;
};

/// `MachineState::run` of a pose that belongs to no measured run: a program on the machine.
inline constexpr std::size_t kNoRun = std::numeric_limits<std::size_t>::max();

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
  std::size_t run = kNoRun;               // index of the run in EffectContext::runs

  /// A temperature above reference; 0 (at reference) for a sensor that this state does not carry.
  double temperature(std::size_t index) const {
    return index < temperature_K.size() ? temperature_K[index] : 0.0;
  }
  /// A free state; 0 when this state does not carry it.
  double free_state(std::size_t index) const { return index < state.size() ? state[index] : 0.0; }
  double value(const Signal& signal) const;
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
      0.0;  // usual magnitude on real machines (linear) or where a search starts (shape), internal unit
  double min = 0.0;  // of the search, shape parameters only, internal unit
  double max = 0.0;
  bool integer = false;  // shape parameters that are whole numbers (teeth of a worm)
  /// Values that are known to occur (the screw's pitch and its parts): tried before the search, inside or
  /// beside its range.
  std::vector<double> candidates;

  /// Key in files: "X0C_um".
  std::string key() const;
};

/// Which switch of the command line turns an effect off: geometric --no-geometric, thermal --no-thermal, the
/// others none.
enum class EffectClass : std::uint8_t { geometric, thermal, dynamic, setup };
std::string_view text_of(EffectClass kind);

struct EffectInfo {
  std::string id;      // "location:C"
  std::string what;    // what it is physically, one sentence
  std::string cause;   // what causes it
  std::string remedy;  // what to do at the machine
  EffectClass kind = EffectClass::geometric;
  std::vector<Parameter> parameters;  // linear ones first
  /// The discrete choice that this instance stands for, as keys and values of the model file: {"component",
  /// "EZX"},
  /// {"sensor", "frame"}, {"run", "r3"}; empty for most effects.
  std::vector<std::pair<std::string, std::string>> variant;
  /// Ids of effects whose twists are within the span of this one's (and a constant): they are no rivals, the
  /// smaller is named.
  std::vector<std::string> contains;

  std::size_t linear_count() const;
  std::size_t shape_count() const { return parameters.size() - linear_count(); }
};

/// Whether a state lies where an effect knows its error (tables: the measured range).
struct RangeCheck {
  enum class Verdict : std::uint8_t { inside, held, refused };
  Verdict verdict = Verdict::inside;
  std::string message;  // which axis, its value and the range; empty when inside
};

/// What of a state decides a twist; each contains the ones before it.
enum class DependsOn : std::uint8_t {
  nothing,     // the same in every state
  position,    // MachineState::q
  conditions,  // lags, temperatures, free states, spindle speed, time and run too
  motion       // sense of motion and velocity too
};

/// Bound on how far a twist leaves its straight course over a motion (see Effect::bend).
struct TwistBend {
  double trans_mm = 0.0;
  double rot_rad = 0.0;

  bool is_zero() const { return trans_mm == 0.0 && rot_rad == 0.0; }
  TwistBend& operator+=(const TwistBend& o) {
    trans_mm += o.trans_mm;
    rot_rad += o.rot_rad;
    return *this;
  }
};

/// Bounds on a twist over all positions within the travel of the axes, all else of the state equal.
struct TwistRange {
  TwistBend largest;
  std::array<TwistBend, kMaxAxes> per_unit{};  // its change for each mm or rad of an axis

  TwistRange& operator+=(const TwistRange& o) {
    largest += o.largest;
    for (std::size_t i = 0; i < kMaxAxes; ++i) per_unit[i] += o.per_unit[i];
    return *this;
  }
};

/// A twist of one component that is straight between nodes of the position of one axis, and held beyond them.
struct StraightCourse {
  AxisId axis = 0;
  int component = 0;          // 0 to 2: of trans_mm, 3 to 5: of rot_rad
  std::vector<double> nodes;  // ascending, two or more: mm, rad
  std::vector<double> values;

  /// The node at or before `x` (mm, rad); the first or the last but one beyond them.
  std::size_t piece_at(double x) const;
};

/// One physical effect: maps (state, parameters) to a twist of one link.
///
/// Laws that every effect keeps (tests/effects/contract_test.cpp): the twist is `fixed_part` plus the sum of
/// linear parameter times column; columns are finite and, but for direction and step, continuous in the
/// state. Const functions may be called by several threads at once.
class Effect {
 public:
  virtual ~Effect() = default;
  virtual const EffectInfo& info() const = 0;
  /// The link at which its twist acts.
  virtual Link link() const = 0;
  /// Lagged signals that `columns` wants, in order, for these shape parameters (their number does not depend
  /// on `shape`).
  virtual std::vector<LagRequest> lags(std::span<const double> shape) const;
  /// Twist per unit of each linear parameter (internal units), at `link()`, in the axes that ChainErrors
  /// defines.
  /// @param lagged  values of the requested lags at this state
  /// @param shape   values of the shape parameters, in the order of info().parameters
  /// @param out     one twist per linear parameter
  virtual void columns(const MachineState& state, std::span<const double> lagged,
                       std::span<const double> shape, std::span<Twist> out) const = 0;
  /// The part of the twist that no parameter scales (error tables, constants of a formula); zero for the
  /// library.
  virtual Twist fixed_part(const MachineState& state, std::span<const double> lagged,
                           std::span<const double> shape) const;
  /// The twist for `parameters` (all of info().parameters, linear ones first). Does not allocate for up to 16
  /// linear parameters.
  Twist twist(const MachineState& state, std::span<const double> lagged,
              std::span<const double> parameters) const;
  /// Proved bound on |twist(t) - [(1 - t) twist(0) + t twist(1)]| while the position runs on a straight line
  /// from `from.q` to `to.q`, all else of the state equal; nothing when the effect knows none.
  virtual std::optional<TwistBend> bend(const MachineState& from, const MachineState& to,
                                        std::span<const double> parameters) const;
  /// Proved bounds over the travel of `axes` (those of the machine), whatever else the state is; nothing when
  /// the effect knows none.
  virtual std::optional<TwistRange> range(std::span<const double> parameters,
                                          std::span<const Axis> axes) const;
  virtual RangeCheck check_range(const MachineState& state) const;
  /// The whole twist as such a course, where it is one whatever the parameters are; its nodes are the range
  /// that `check_range` knows.
  virtual std::optional<StraightCourse> straight_course() const { return std::nullopt; }
  /// At least what the twist depends on: what does not is evaluated less often.
  virtual DependsOn depends_on() const { return DependsOn::motion; }
  /// Quantities that people know better than the linear parameters they follow from (the fixed point of a
  /// screw).
  struct Derived {
    std::string key;  // with its unit: "x_fixed_mm"
    double value;     // internal unit; NaN when the parameters do not determine it
    Unit unit;
  };
  virtual std::vector<Derived> derived(std::span<const double> parameters) const;
  /// Sets `parameters` such that the derived quantity has this value (the others unchanged); false for an
  /// unknown key.
  virtual bool set_derived(std::string_view key, double value, std::span<double> parameters) const;
  /// What the model file says of this effect beside its id and parameters, by default `info().variant`.
  virtual std::vector<std::pair<std::string, std::string>> file_keys() const { return info().variant; }
};

}  // namespace trunnion
