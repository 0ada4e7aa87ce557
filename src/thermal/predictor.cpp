#include "trunnion/thermal/predictor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/printable.hpp"
#include "trunnion/base/units.hpp"
#include "trunnion/config/csv.hpp"
#include "trunnion/thermal/location.hpp"

#include "thermal/bench.hpp"
#include "thermal/follower.hpp"
#include "thermal/start.hpp"
#include "thermal/watch.hpp"

namespace trunnion::thermal {
namespace {

using Eigen::VectorXd;

// A first measurement so early (in units of the interval) is the reference itself; the same rule as in the
// validation.
constexpr double kReferenceShare = 0.1;

// Between the least and the most that was read; means of equal readings are equal but for their rounding.
double moved_K(const std::vector<double>& column) {
  constexpr double kRounding_K = 1e-6;
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  for (const double value : column) {
    if (value < least) least = value;
    if (value > most) most = value;
  }
  return most - least > kRounding_K ? most - least : 0.0;
}

}  // namespace

struct Predictor::Channel {
  // Whether measurements agree with what was said just before each.
  struct Agreement {
    RunScale agreed = {};         // of the run, as the last one left it that agreed
    int off = 0;                  // in a row that did not
    bool contradicted = false;    // by two in a row
    double discrepancy_mm = 0.0;  // of the last one, once it is
    bool beyond_reason = false;   // one was, and was told
  };
  std::vector<std::size_t> sensor;  // of its features, index in sensors_
  FeatureState state;
  Follower follower;
  std::optional<VectorXd> reference = {};  // features at the reference state
  double reference_mm = 0.0;
  double anchor_s = 0.0;
  bool measured = false;  // after the reference
  bool has_zero = false;  // something was measured
  RunScale scale = {};
  Agreement agreement = {};
  Said said = {};                          // now
  std::optional<double> followed_mm = {};  // what was said last while the model could be asked
  bool told_held = false;
};

// Readings as they come.
struct Predictor::Raw {
  struct Told {
    double time_s = 0.0;
    std::vector<double> temperature_degC;
    double spindle_rpm = 0.0, feed_mm_s = 0.0;
    std::vector<std::pair<std::size_t, double>> measured_mm;  // after it
  };
  SensorWatch watch;
  bool settled = false;
  std::vector<Told> start = {};  // until it is settled
};

Predictor::Predictor(ThermalModel model, Readings readings) : model_(std::move(model)) {
  make_channels();
  if (readings == Readings::raw)
    raw_ = std::make_unique<Raw>(Raw{SensorWatch(usual_moves_K(model_, sensors_))});
}

void Predictor::make_channels() {
  channels_.clear();
  for (const ChannelModel& channel : model_.channels) {
    Channel out{{},
                FeatureState(channel.features),
                Follower(channel.candidate, {channel.regressor, channel.guard, channel.typical_change_mm})};
    for (const auto& name : channel.features.sensors) {
      auto it = std::find(sensors_.begin(), sensors_.end(), name);
      if (it == sensors_.end()) it = sensors_.insert(sensors_.end(), name);
      out.sensor.push_back(static_cast<std::size_t>(it - sensors_.begin()));
    }
    channels_.push_back(std::move(out));
  }
}
Predictor::Predictor(Predictor&&) noexcept = default;
Predictor& Predictor::operator=(Predictor&&) noexcept = default;
Predictor::~Predictor() = default;

Result<void> Predictor::read(double time_s, std::span<const double> temperature_degC, double spindle_rpm,
                             double feed_mm_s) {
  TRUNNION_EXPECTS(temperature_degC.size() == sensors_.size());
  if (!std::isfinite(time_s)) return fail(ErrorCode::wrong_input, "the time of a reading must be finite");
  if (started_ && time_s < time_s_) {
    return fail(ErrorCode::wrong_input, "time " + shortest_text(time_s) +
                                            " s is before the last reading at " + shortest_text(time_s_) +
                                            " s");
  }
  if (!raw_ || raw_->settled) {
    take(time_s, temperature_degC, spindle_rpm, feed_mm_s);
    return {};
  }
  if (raw_->start.empty()) start_s_ = time_s;
  raw_->start.push_back(
      {time_s, {temperature_degC.begin(), temperature_degC.end()}, spindle_rpm, feed_mm_s, {}});
  time_s_ = time_s;
  started_ = true;
  settle();
  return {};
}

void Predictor::take(double time_s, std::span<const double> temperature_degC, double spindle_rpm,
                     double feed_mm_s) {
  if (!started_) start_s_ = time_s;
  time_s_ = time_s;
  std::vector<double> degC(temperature_degC.begin(), temperature_degC.end());
  if (raw_) degC = raw_->watch.believed(time_s, degC);
  for (Channel& channel : channels_) {
    std::vector<double> own;
    for (const std::size_t s : channel.sensor) own.push_back(degC[s]);
    channel.state.step(
        {.time_s = time_s, .temperature_degC = own, .spindle_rpm = spindle_rpm, .feed_mm_s = feed_mm_s});
    if (channel.reference) {
      measure_again(channel);
      continue;
    }
    // The reference state is the first one that is known whole.
    bool whole = true;
    for (std::size_t s = 0; s < own.size(); ++s) whole = whole && std::isfinite(channel.state.age_s(s));
    if (!whole) continue;
    channel.reference = channel.state.values();
    channel.anchor_s = time_s;
  }
  started_ = true;
  std::string held;
  for (std::size_t index = 0; index < channels_.size(); ++index) {
    Channel& channel = channels_[index];
    say_now(index);
    if (!channel.said.causes.held || channel.told_held || !channel.followed_mm) continue;
    channel.told_held = true;
    held += (held.empty() ? "" : ", ") + model_.channels[index].channel + " at " +
            fixed_text(channel.said.value_mm / kMmPerUm, 1) + " um";
  }
  if (!held.empty())
    warnings_.push_back(
        "at " + shortest_text(time_s) +
        " s a sensor, or the speed, has been silent for too long: until it is back, or something is "
        "measured, what was said last is held: " +
        held);
}

// Where the model cannot be asked what it said last stands: the machine is nearer to that than to an older
// measurement, or to nothing, and a tool does not jump.
void Predictor::say_now(std::size_t index) {
  Channel& channel = channels_[index];
  channel.said = say(index);
  if (!channel.said.causes.held)
    channel.followed_mm = channel.said.value_mm;
  else if (channel.followed_mm)
    channel.said.value_mm = *channel.followed_mm;
}

// Measured while a sensor was silent: what it did until then is in the measurement, and not in what comes.
void Predictor::measure_again(Channel& channel) {
  const auto marked = channel.state.changed_mark();
  if (!marked) return;
  if (!channel.measured) {
    channel.reference = *marked;  // it was the zero
    return;
  }
  channel.follower.measure_again(*marked - *channel.reference);
}

// Once the start can be judged, the run is followed from its beginning without what was wrong there.
void Predictor::settle() {
  auto& start = raw_->start;
  // Of a client that sends more within the start the rest is believed.
  constexpr std::size_t kMostKept = 2000;
  bool over = time_s_ - start_s_ > kStartAtMost_s || start.size() >= kMostKept;
  std::vector<std::vector<TimedReading>> readings(sensors_.size());
  for (const Raw::Told& told : start) {
    for (std::size_t s = 0; s < sensors_.size(); ++s) {
      if (!std::isnan(told.temperature_degC[s]))
        readings[s].push_back({told.time_s, told.temperature_degC[s]});
    }
  }
  over = over || std::all_of(readings.begin(), readings.end(), [](const auto& r) { return start_of(r) > 0; });
  if (!over) return;
  for (std::size_t s = 0; s < sensors_.size(); ++s) {
    if (const std::size_t count = start_of(readings[s]); count > 0) readings[s].resize(count);
    std::size_t wrong = wrong_at_start(readings[s]);
    for (auto told = start.begin(); told != start.end() && wrong > 0; ++told) {
      if (std::isnan(told->temperature_degC[s])) continue;
      told->temperature_degC[s] = kNotRead;
      --wrong;
    }
  }
  raw_->settled = true;
  started_ = false;
  const std::vector<Raw::Told> all = std::move(start);
  start.clear();
  make_channels();
  warnings_.clear();
  for (const Raw::Told& told : all) {
    take(told.time_s, told.temperature_degC, told.spindle_rpm, told.feed_mm_s);
    for (const auto& [channel, value_mm] : told.measured_mm) static_cast<void>(measure(channel, value_mm));
  }
}

FeatureVector Predictor::relative(const Channel& channel) const {
  const VectorXd& now = channel.state.values();
  if (!channel.reference) return {VectorXd::Zero(now.size()), VectorXd::Zero(now.size())};
  return {now - *channel.reference, channel.state.unknown(), channel.state.unsettled(),
          channel.state.swing_K()};
}

bool Predictor::measure(std::size_t index, double value_mm) {
  TRUNNION_EXPECTS(started_ && index < channels_.size());
  Channel& channel = channels_[index];
  if (raw_ && !raw_->settled) raw_->start.back().measured_mm.emplace_back(index, value_mm);
  const bool early = time_s_ - start_s_ <= kReferenceShare * model_.measure_every_s;
  if (!channel.measured && early) {
    tell_late_start(index, value_mm);
    channel.reference_mm = value_mm;
    if (channel.reference) channel.reference = channel.state.values();
  }
  const bool drifted = channel.measured || !early;  // else it is the zero
  if (drifted && is_beyond_reason(index, value_mm)) return false;
  if (drifted) {
    const Said said = now(index);
    const double error_mm = value_mm - channel.reference_mm - said.value_mm;
    const double promised_mm = sigma_mm(index, said, channel.agreement.agreed);
    if (!said.causes.held)
      channel.scale.add(error_mm / model_.channels[index].sigma.before_run_mm(said.causes));
    compare(index, value_mm, error_mm, promised_mm);
  }
  channel.follower.measure(relative(channel), value_mm - channel.reference_mm, drifted);
  channel.state.mark();
  channel.anchor_s = time_s_;
  channel.measured = drifted;
  channel.has_zero = true;
  channel.followed_mm.reset();
  say_now(index);
  return true;
}

bool Predictor::stale(const Channel& channel) const {
  if (raw_ && !raw_->settled) return false;
  for (std::size_t s = 0; s < channel.sensor.size(); ++s) {
    if (channel.state.age_s(s) > kStale_s || (raw_ && raw_->watch.stuck(channel.sensor[s]))) return true;
  }
  return false;
}

// A log that begins on a warm machine has its zero there.
void Predictor::tell_late_start(std::size_t index, double value_mm) {
  constexpr double kMuch = 0.25;  // of the largest deviation of the training
  constexpr double kFar = 4.0;    // sigmas of a measurement
  const ChannelModel& model = model_.channels[index];
  const bool told = channels_[index].reference_mm != 0.0;
  const double much_mm = std::max(kMuch * model.largest_mm, kFar * model.sigma.floor_mm);
  if (told || !(model.largest_mm > 0.0) || std::abs(value_mm) <= much_mm) return;
  warnings_.push_back(
      model.channel + " begins at " + fixed_text(value_mm / kMmPerUm, 1) +
      " um: the offsets count from there, and what the machine drifted before is not in them");
}

// Of a run without a zero nobody knows where the first one counts from: it may be the wrong one, and what is
// near the run's zero is followed whatever was said.
bool Predictor::is_beyond_reason(std::size_t index, double value_mm) {
  constexpr double kBeyond = 10.0;  // um for mm are 1000, mm for inches 25; a collision is 2 or 3
  Channel& channel = channels_[index];
  const double largest_mm = model_.channels[index].largest_mm;
  if (!channel.has_zero || !(largest_mm > 0.0)) return false;
  const double said_mm = now(index).value_mm + channel.reference_mm;
  const double most_mm = kBeyond * largest_mm;
  if (std::abs(value_mm - said_mm) <= most_mm || std::abs(value_mm - channel.reference_mm) <= most_mm)
    return false;
  if (!std::exchange(channel.agreement.beyond_reason, true)) {
    const auto um = [](double mm) { return fixed_text(mm / kMmPerUm, 1); };
    warnings_.push_back("at " + shortest_text(time_s_) + " s " + model_.channels[index].channel +
                        " was measured as " + um(value_mm) + " um where " + um(said_mm) +
                        " um was predicted and the training never went beyond " + um(largest_mm) +
                        " um: such measurements are not followed. Is the unit right?");
  }
  return true;
}

// Sigma holds the measurement's own uncertainty: it was found by what measurements missed.
void Predictor::compare(std::size_t index, double value_mm, double error_mm, double sigma_mm) {
  constexpr double kFar = 4.0;
  constexpr int kInARow = 2;  // one may be a chip under the probe
  Channel& channel = channels_[index];
  Channel::Agreement& agreement = channel.agreement;
  agreement.off = std::abs(error_mm) > kFar * sigma_mm ? agreement.off + 1 : 0;
  if (agreement.off == 0) agreement.agreed = channel.scale;
  if (agreement.off >= kInARow && !agreement.contradicted) {
    agreement.contradicted = true;
    const auto um = [](double mm) { return fixed_text(mm / kMmPerUm, 1); };
    warnings_.push_back("at " + shortest_text(time_s_) + " s " + model_.channels[index].channel +
                        " was measured as " + um(value_mm) + " um where " + um(value_mm - error_mm) +
                        " +/- " + um(sigma_mm) +
                        " um was predicted: sign or unit of the measurement, or a wrong sensor?");
  }
  if (agreement.contradicted) agreement.discrepancy_mm = std::abs(error_mm);
}

// Without its sensors, and before their rises count from something, no model can be asked.
Said Predictor::say(std::size_t index) const {
  const Channel& channel = channels_[index];
  const bool hold = stale(channel) || (raw_ && !raw_->settled);
  return channel.follower.say(relative(channel), hold);
}

// The age of the last measurement included.
Said Predictor::now(std::size_t index) const {
  const Channel& channel = channels_[index];
  Said out = raw_ && !raw_->settled ? say(index) : channel.said;
  out.causes.age_s = time_s_ - std::max(channel.anchor_s, start_s_);
  return out;
}

double Predictor::sigma_mm(std::size_t index, const Said& said, const RunScale& scale) const {
  const ChannelModel& model = model_.channels[index];
  double out = model.sigma.sigma_mm(said.causes, scale);
  if (said.distance > Guard::kMargin) out *= said.distance / Guard::kMargin;
  // The uncertainty of the model grows with what it sees, without an end; the machine's deviation does not.
  const double hold_mm = model.hold_sigma.sigma_mm({.age_s = said.causes.age_s}, {});
  if (model.largest_mm > 0.0)
    out = std::min(out, std::max(hold_mm, model.largest_mm + std::abs(said.value_mm)));
  if (said.causes.held) out = std::max(out, model.hold_sigma.sigma_mm(said.causes, {}));
  return out;
}

Estimate Predictor::estimate(std::size_t index) const {
  const Channel& channel = channels_[index];
  const Said said = now(index);
  Estimate out;
  out.since_measured_s = said.causes.age_s;
  out.stale = stale(channel);
  out.value_mm = said.value_mm;
  out.distance = said.distance;
  out.unknown_mm = said.causes.unknown_mm;
  out.sigma_mm = std::max(sigma_mm(index, said, channel.scale), channel.agreement.discrepancy_mm);
  return out;
}

Log without_stuck(const ThermalModel& model, const Log& log, const std::vector<SensorFault>& faults) {
  Log out = log;
  const std::vector<double> usual_K = usual_moves_K(model, log.sensors);
  for (const SensorFault& fault : faults) {
    const auto sensor = log.sensor(fault.sensor);
    if (fault.kind != FaultKind::stuck || !sensor) continue;
    for (LogRun& run : out.runs) {
      auto& column = run.temperature_degC[*sensor];
      if (run.id != fault.run) continue;
      const bool moves = moved_K(column) > 0.0;
      if (!moves && usual_K[*sensor] < SensorLimits{}.stuck_least_K) continue;
      for (std::size_t row = 0; row < run.rows(); ++row) {
        if (run.time_s[row] >= fault.from_s && run.time_s[row] <= fault.to_s) column[row] = kNotRead;
      }
    }
  }
  return out;
}

Result<RunPrediction> predict(const ThermalModel& model, const Log& log, std::size_t run_index,
                              UseMeasurements use) {
  Predictor predictor(model);
  const LogRun& run = log.runs[run_index];
  std::vector<const std::vector<double>*> columns;
  for (const auto& name : predictor.sensors()) {
    const auto sensor = log.sensor(name);
    if (!sensor)
      return fail(
          ErrorCode::wrong_input,
          "the model uses the sensor '" + name + "' (column T_" + name + "_degC), which the log lacks",
          log.file);
    columns.push_back(&run.temperature_degC[*sensor]);
  }
  std::vector<std::vector<std::size_t>> known;  // rows whose measurement the model is told, the next one last
  for (const ChannelModel& channel : model.channels) {
    if (!channel.features.speed_taus_s.empty() && !log.has_speed)
      return fail(ErrorCode::wrong_input,
                  "the model uses the spindle speed (column spindle_rpm), which the log lacks", log.file);
    if (!channel.features.feed_taus_s.empty() && !log.has_feed)
      return fail(ErrorCode::wrong_input, "the model uses the feed (column feed_mm_min), which the log lacks",
                  log.file);
    known.emplace_back();
    const auto index = log.channel(channel.channel);
    if (!index || use == UseMeasurements::no) continue;
    known.back() = known_measurements(run, run.channel_mm[*index], model.measure_every_s);
    std::reverse(known.back().begin(), known.back().end());
  }
  RunPrediction out;
  out.run = run.id;
  out.channel.resize(model.channels.size());
  std::vector<double> temperature(columns.size());
  for (std::size_t row = 0; row < run.rows(); ++row) {
    for (std::size_t i = 0; i < columns.size(); ++i) temperature[i] = (*columns[i])[row];
    const auto read = predictor.read(run.time_s[row], temperature,
                                     run.spindle_rpm.empty() ? kNotRead : run.spindle_rpm[row],
                                     run.feed_mm_s.empty() ? kNotRead : run.feed_mm_s[row]);
    if (!read) return tl::unexpected(read.error());
    out.time_s.push_back(run.time_s[row]);
    for (std::size_t c = 0; c < known.size(); ++c) {
      if (!known[c].empty() && known[c].back() == row) {
        predictor.measure(c, run.channel_mm[*log.channel(model.channels[c].channel)][row]);
        known[c].pop_back();
      }
      const Estimate estimate = predictor.estimate(c);
      if (!estimate.finite())
        return fail(ErrorCode::check_failed,
                    "run '" + run.id + "' at " + shortest_text(run.time_s[row]) +
                        " s: the model of channel '" + model.channels[c].channel + "' gives no number",
                    log.file);
      out.channel[c].push_back(estimate);
    }
  }
  out.warnings = predictor.warnings();
  return out;
}

OffsetTable offsets_of(const ThermalModel& model, const RunPrediction& prediction) {
  OffsetTable out;
  for (std::size_t row = 0; row < prediction.time_s.size(); ++row) {
    Offset offset;
    offset.time_s = prediction.time_s[row];
    for (std::size_t c = 0; c < model.channels.size(); ++c) {
      const auto component = offset_component(model.channels[c]);
      if (!component) continue;
      const Estimate& e = prediction.channel[c][row];
      offset.deviation_mm[*component] = e.value_mm;
      offset.sigma_mm = std::max(offset.sigma_mm, e.sigma_mm);
    }
    out.rows.push_back(std::move(offset));
  }
  return out;
}

std::string prediction_text(const ThermalModel& model, const std::vector<RunPrediction>& runs,
                            const std::vector<std::string>& comments) {
  std::string out;
  for (const auto& comment : comments) out.append("#").append(printable(comment, "\t")).append("\n");
  if (runs.size() > 1) out += "run_id,";
  out += "time_s,dx_um,dy_um,dz_um,sigma_um";
  for (const ChannelModel& channel : model.channels) {
    if (!offset_component(channel)) out += "," + channel.channel + "_um," + channel.channel + "_sigma_um";
  }
  out += "\n";
  const auto um = [](double mm) { return "," + fixed_text(mm / kMmPerUm, 3); };
  for (const RunPrediction& run : runs) {
    const OffsetTable table = offsets_of(model, run);
    for (std::size_t row = 0; row < run.time_s.size(); ++row) {
      if (runs.size() > 1) out += config::csv_field(run.run) + ",";
      const Offset& offset = table.rows[row];
      out += shortest_text(offset.time_s);
      for (const double component : offset.deviation_mm) out += um(component);
      out += um(offset.sigma_mm);
      for (std::size_t c = 0; c < model.channels.size(); ++c) {
        if (offset_component(model.channels[c])) continue;
        out += um(run.channel[c][row].value_mm) + um(run.channel[c][row].sigma_mm);
      }
      out += "\n";
    }
  }
  return out;
}

std::string paper_angles_text(const ThermalModel& model, const std::vector<RunPrediction>& runs,
                              const std::vector<std::string>& comments) {
  std::string out;
  for (const auto& comment : comments) out.append("#").append(printable(comment, "\t")).append("\n");
  const bool several = runs.size() > 1;
  out += several ? "run_id,time_s,paper_A_deg,paper_C_deg\n" : "time_s,paper_A_deg,paper_C_deg\n";
  for (const RunPrediction& run : runs) {
    for (Offset& offset : offsets_of(model, run).rows) {
      offset.deviation_mm.z() = kPaperZ_mm;
      const PaperAngles angles = paper_offset_to_angles(offset.deviation_mm);
      if (several) out.append(config::csv_field(run.run)).append(",");
      out.append(shortest_text(offset.time_s)).append(",");
      out.append(fixed_text(angles.A.deg(), 4))
          .append(",")
          .append(fixed_text(angles.C.deg(), 4))
          .append("\n");
    }
  }
  return out;
}

}  // namespace trunnion::thermal
