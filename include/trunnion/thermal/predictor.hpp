#pragma once
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "trunnion/thermal/condition.hpp"
#include "trunnion/thermal/model.hpp"
#include "trunnion/thermal/offsets.hpp"

namespace trunnion::thermal {

struct Said;

/// What a model says of one channel now: deviation since the run's reference state (its first measurement, or
/// its start).
struct Estimate {
  double value_mm = 0.0;
  double sigma_mm = 0.0;
  double distance =
      0.0;  // of the state from the training, see Guard; above Guard::kMargin the model is trusted less
  double since_measured_s = 0.0;  // since the last measurement or the reference
  bool stale = false;             // a sensor has not been read for long: what was said last is held
  double unknown_mm = 0.0;        // what speed or feed that were not read may have done to the value
  bool outside_training() const { return distance > Guard::kMargin; }
  bool finite() const { return std::isfinite(value_mm) && std::isfinite(sigma_mm); }
};

/// A temperature of a structure that is older than this says nothing of what goes on now.
inline constexpr double kStale_s = 900.0;

/// What a Predictor is given: readings of a log that was judged as a whole (condition.hpp), or such as they
/// come. Those it judges itself, as soon as it can: the first ones when five minutes of them have come (until
/// then the last measurement is held, with its sigma), jumps and standstills as they happen (such a sensor is
/// silent).
enum class Readings { judged, raw };

/// Follows a run reading by reading and measurement by measurement: the live loop and `thermal predict` are
/// this, with the formula of the validation.
class Predictor {
 public:
  explicit Predictor(ThermalModel model, Readings readings = Readings::judged);
  Predictor(Predictor&&) noexcept;
  Predictor& operator=(Predictor&&) noexcept;
  Predictor(const Predictor&) = delete;
  Predictor& operator=(const Predictor&) = delete;
  ~Predictor();

  const ThermalModel& model() const { return model_; }
  /// Sensors that `read` takes, in this order.
  const std::vector<std::string>& sensors() const { return sensors_; }

  /// A reading at `time_s` within the run, not before the last one; NaN: not read. Fails (and changes
  /// nothing) when time goes back.
  Result<void> read(double time_s, std::span<const double> temperature_degC, double spindle_rpm,
                    double feed_mm_s);
  /// A measurement of a channel (index in model().channels), made at the state of the last reading. Requires
  /// a reading. False: it is not followed, since it is more than ten times as far from what was said before
  /// it, and from the run's zero, as the machine ever went in the training (a wrong unit, a digit, a chip
  /// under the probe).
  bool measure(std::size_t channel, double value_mm);
  Estimate estimate(std::size_t channel) const;
  /// A sentence for each channel of which two measurements in a row were beyond 4 sigma of what was said just
  /// before them (from there on its sigma is at least the discrepancy of the last one; its value stays), for
  /// each of which one was not followed, and for each whose first measurement, the zero, is far from zero.
  const std::vector<std::string>& warnings() const { return warnings_; }
  bool started() const { return started_; }
  double time_s() const { return time_s_; }

 private:
  struct Channel;
  struct Raw;
  void make_channels();
  void take(double time_s, std::span<const double> temperature_degC, double spindle_rpm, double feed_mm_s);
  void settle();
  static void measure_again(Channel& channel);
  bool stale(const Channel& channel) const;
  FeatureVector relative(const Channel& channel) const;
  Said say(std::size_t channel) const;
  Said now(std::size_t channel) const;
  void say_now(std::size_t channel);
  double sigma_mm(std::size_t channel, const Said& said, const RunScale& scale) const;
  void tell_late_start(std::size_t channel, double value_mm);
  void compare(std::size_t channel, double value_mm, double error_mm, double sigma_mm);
  bool is_beyond_reason(std::size_t channel, double value_mm);
  ThermalModel model_;
  std::unique_ptr<Raw> raw_;  // null for judged readings
  std::vector<std::string> sensors_;
  std::vector<Channel> channels_;
  std::vector<std::string> warnings_;
  double start_s_ = 0.0;
  double time_s_ = 0.0;
  bool started_ = false;
};

/// Estimates of all channels over one run.
struct RunPrediction {
  std::string run;
  std::vector<double> time_s;
  std::vector<std::vector<Estimate>> channel;  // [channel][row]
  std::vector<std::string> warnings;           // Predictor::warnings
};

enum class UseMeasurements { yes, no };

/// The log without what its sensors read while they were stuck: to a prediction they are silent then. A
/// sensor that never moves is left as it is where it hardly moved in the training either.
Log without_stuck(const ThermalModel& model, const Log& log, const std::vector<SensorFault>& faults);

/// Predicts a run of a log. Measurements in the log re-anchor the model as often as it was validated for, or
/// not at all. Fails when the log lacks a sensor, the speed or the feed that the model uses, naming it, and
/// (check_failed) where the model gives no number, naming run and time.
Result<RunPrediction> predict(const ThermalModel& model, const Log& log, std::size_t run,
                              UseMeasurements use);

/// Offsets of the channels that have an axis; sigma is the largest of theirs.
OffsetTable offsets_of(const ThermalModel& model, const RunPrediction& prediction);
/// CSV text: `run_id` when there are several runs, `time_s`, dx, dy, dz, sigma, and value and sigma of every
/// channel without an axis.
std::string prediction_text(const ThermalModel& model, const std::vector<RunPrediction>& runs,
                            const std::vector<std::string>& comments);

/// CSV text of the paper's mode: `run_id` when there are several, `time_s`, `paper_A_deg`, `paper_C_deg`
/// (location.hpp). Its columns are none that an offset file has: no program is made of them.
std::string paper_angles_text(const ThermalModel& model, const std::vector<RunPrediction>& runs,
                              const std::vector<std::string>& comments);

}  // namespace trunnion::thermal
