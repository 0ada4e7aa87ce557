#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trunnion/base/diagnostics.hpp"
#include "trunnion/base/result.hpp"
#include "trunnion/config/value.hpp"
#include "trunnion/effects/deviation.hpp"
#include "trunnion/effects/effect.hpp"
#include "trunnion/effects/library.hpp"
#include "trunnion/effects/measured_range.hpp"

namespace trunnion {

/// One parameter's value as the model file gives it or a fit found it; internal units.
struct ParameterValue {
  double value = 0.0;
  std::optional<double> sigma;  // standard uncertainty
  bool given =
      false;  // the file names it; a parameter that is not given is 0 (linear) or its usual value (shape)
  bool fixed = false;  // fits hold it
  bool prior = false;  // value and sigma enter a fit as a measurement
};

struct ModelEffect {
  std::shared_ptr<const Effect> effect;
  std::vector<ParameterValue> parameters;  // as effect->info().parameters
  /// False when the file names an effect that has variants without saying which: the first one stands in, a
  /// fit may take another.
  bool variant_given = true;
  config::Table evidence;  // [effect.evidence]: why it was added; kept, never interpreted
  SourceRef where;

  const std::string& id() const { return effect->info().id; }
  /// Index of the parameter with this name or key ("X0C", "X0C_um", "EX0C_um", ...).
  std::optional<std::size_t> find(std::string_view name) const;
  std::vector<double> values() const;
  /// Values of the shape parameters only.
  std::vector<double> shape() const;
};

/// A new entry with every linear parameter 0 and every shape parameter at its usual value.
ModelEffect model_effect(std::shared_ptr<const Effect> effect);

enum class SetupTranslation : std::uint8_t { free, fixed };

/// What is known of a machine's errors: a set of effects with their parameters.
struct Model {
  std::string file;  // where it was read from
  std::string name;
  std::optional<std::string> parent;
  SetupTranslation setup_translation = SetupTranslation::free;
  /// By which all axes are behind their commands alike; the `servo_lag` of an axis is what it is later than
  /// that. Programs are led by it (`axis_lags`); what the model says of a reading is without it.
  double lag_of_all_axes_s = 0.0;
  std::vector<ModelEffect> effects;
  MeasuredRanges valid;           // where the readings were that its numbers are from; empty: not said
  EffectContext context;          // sensors and runs that the indices in its effects count
  std::vector<std::string> axes;  // names of the machine's, for messages
};

/// Reads a model for this machine. `context` holds the sensors and runs of the data (empty for none); those
/// that only the model names are appended to `Model::context`, so that indices of `context` stay valid. Error
/// tables are read from beside `file`. All findings go to `diagnostics` with file:line:column; unknown keys
/// are errors.
Result<Model> parse_model(std::string_view toml, const std::string& file, const Machine& machine,
                          const EffectContext& context, Diagnostics& diagnostics);
Result<Model> load_model(const std::string& path, const Machine& machine, const EffectContext& context,
                         Diagnostics& diagnostics);

/// Sensors that the model needs and `data` does not have: their temperatures count as at reference, their
/// states as 0.
std::vector<std::string> missing_sensors(const Model& model, const EffectContext& data);

/// TOML text that parse_model reads back to the same model.
std::string model_text(const Model& model);

/// The model with those effects only for which `keep` is true.
Model filtered(const Model& model, const std::function<bool(const EffectInfo&)>& keep);

/// All lags that the model's effects want, effect by effect: the order in which `chain_errors` takes their
/// values.
std::vector<LagRequest> lag_requests(const Model& model);

/// Bounds on how far the twists of a chain leave their straight courses over a motion, link by link.
struct ChainBends {
  std::array<TwistBend, kMaxAxes> joint{};
  TwistBend spindle;
  TwistBend part;
  const Effect* unbounded = nullptr;  // an effect that knows no bound: the figures say nothing then
};

/// Of ChainErrors, or ChainErrorsOf a few places.
template <class Errors>
auto& link_of(Errors& errors, const Link& link) {
  if (link.kind == Link::Kind::joint) return errors.joint[link.axis];
  return link.kind == Link::Kind::spindle ? errors.spindle : errors.part;
}

/// A model with its numbers laid out for evaluation: no allocation per state, safe from several threads.
/// Where an effect gives no number, or one that no machine errs by (1 m, 1 rad), the functions that ask for
/// errors throw a Failure (wrong_input) that names the effect, its line and the positions of the axes.
class ModelEvaluator {
 public:
  /// Keeps the effects of `model` alive; later changes of `model` are not seen.
  /// What errors may be: as large as a machine's, or any number (while a fit looks for them, and tries data
  /// in other units).
  enum class Sizes : std::uint8_t { of_machines, any };
  explicit ModelEvaluator(const Model& model, Sizes sizes = Sizes::of_machines);
  const std::vector<LagRequest>& lags() const { return lags_; }
  /// Errors of the whole chain. `lagged` are the values of lags(); empty for a model without memory or for
  /// lags at rest (all 0).
  ChainErrors errors(const MachineState& state, std::span<const double> lagged = {}) const {
    ChainErrors out;
    errors(state, lagged, out);
    return out;
  }
  void errors(const MachineState& state, std::span<const double> lagged, ChainErrors& out) const;
  /// The same where `out` has the errors of another state: what never changes is left as it is.
  void update(const MachineState& state, std::span<const double> lagged, ChainErrors& out) const;
  /// All effects that vary are straight courses: a few states can be looked up side by side (CourseErrors).
  bool only_courses() const { return without_course_ == 0; }
  struct LinkCourse {
    Link link;
    const StraightCourse* course;
  };
  /// In the order in which their values are added. They live as long as the object.
  std::vector<LinkCourse> courses() const;
  /// Errors of the links that `update` does not touch; those of the others are a part of theirs.
  const ChainErrors& constant() const { return constant_; }
  ChainLinks varying() const;
  /// The most that any of its effects depends on.
  DependsOn depends_on() const { return depends_on_; }
  /// Sums of Effect::bend over the effects of each link.
  ChainBends bends(const MachineState& from, const MachineState& to) const;
  /// Sums of Effect::range over all effects; nothing when one of them knows none.
  std::optional<TwistRange> range(std::span<const Axis> axes) const;
  /// The worst range check of its effects at `state`.
  RangeCheck check_range(const MachineState& state) const;

 private:
  struct Entry {
    std::shared_ptr<const Effect> effect;
    Link link;
    std::size_t lag_begin, lag_count;
    std::vector<double> parameters;
    bool only_fixed_part;  // no parameter scales it: an error table
    std::optional<StraightCourse> course;
    bool first_of_link = false;
    SourceRef where;  // in the model file

    Twist twist(const MachineState& state, std::span<const double> lagged) const;
  };
  DependsOn depends_on_ = DependsOn::nothing;
  Twist checked_twist(const Entry& entry, const MachineState& state, std::span<const double> lagged) const;
  [[noreturn]] void refuse(const Entry& entry, const MachineState& state, const Twist& twist) const;
  Sizes sizes_;
  std::string file_;
  std::vector<std::string> axes_;
  ChainErrors constant_;        // sum of the effects that do not depend on the state
  std::vector<Entry> entries_;  // the others; those with a course behind those without
  std::size_t without_course_ = 0;
  JointVector inside_min_, inside_max_;  // all courses are within their nodes there
  std::vector<LagRequest> lags_;
  std::vector<double> rest_;
};

/// Twists of the whole chain for one state (one-off; use ModelEvaluator in loops).
ChainErrors chain_errors(const Model& model, const MachineState& state, std::span<const double> lagged = {});

/// Deviation (in P) of program zero when probed at Machine::probed_at on the machine with these errors, at
/// rest and at reference temperature: what the work offset has taken up already; zero without a probed datum.
Vec3 datum_shift_P(const Machine& machine, const ModelEvaluator& model);

}  // namespace trunnion
