#include "trunnion/thermal/simulate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "trunnion/base/contract.hpp"
#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

namespace trunnion::thermal {
namespace {

constexpr double kHour_s = 3600.0;
constexpr std::size_t kSensors = 8;
constexpr std::array kSensorNames = {"spindle_front", "spindle_rear", "head", "column",
                                     "a_bearing",     "c_bearing",    "bed",  "ambient"};

// Where heat sits. Each node follows its source through one first-order lag; structures of machines need one
// to three of them (research, section 5).
enum Node : std::size_t { bearing_front, bearing_rear, head, column, trunnion_a, table_c, bed, air, kNodes };
constexpr std::array<double, kNodes> kTau_s = {600, 1200, 2700, 7200, 3600, 4500, 18000, 300};
// Temperature rise at full load, K: speed (at 12 000 rpm), feed and rotary motion, ambient follows with gain
// one.
constexpr std::array<double, kNodes> kSpeedGain_K = {14, 9, 6, 3, 0.5, 0.5, 0.3, 0.5};
constexpr std::array<double, kNodes> kFeedGain_K = {0.5, 0.5, 0.8, 0.8, 5, 6, 0.8, 0.3};
// Drift per kelvin of the node beyond the ambient's reference, um/K.
constexpr std::array<Vec3::Scalar, kNodes> kX_um_per_K = {1.2, 0.6, 3.0, 6.0, 2.0, 5.5, 4.0, 0.0};
constexpr std::array<Vec3::Scalar, kNodes> kY_um_per_K = {-0.8, -1.2, -4.5, -12.0, 4.5, 3.0, -5.0, 0.0};
constexpr std::array<Vec3::Scalar, kNodes> kZ_um_per_K = {-1.6, -0.8, 2.0, 4.0, 0.8, 0.4, 2.0, 0.0};

using Random = std::mt19937_64;

// std::normal_distribution differs between libraries; this one does not (Box-Muller on the top 53 bits).
double normal(Random& random) {
  constexpr double kScale = 0x1.0p-53;
  const double u = (static_cast<double>(random() >> 11U) + 0.5) * kScale;
  const double v = static_cast<double>(random() >> 11U) * kScale;
  return std::sqrt(-2.0 * std::log(u)) * std::cos(kTwoPi * v);
}

// Gains of this machine: the table above within 15 %.
struct MachineGains {
  std::array<Vec3, kNodes> drift_mm_per_K;
  std::array<double, kSensors> sensor_offset_K;
  std::array<double, kSensors> sensor_tau_s;
};

MachineGains machine_gains(const ImpellerDays& days) {
  Random random(days.machine_seed);
  MachineGains out;
  for (std::size_t n = 0; n < kNodes; ++n) {
    const Vec3 um(kX_um_per_K[n], kY_um_per_K[n], kZ_um_per_K[n]);
    out.drift_mm_per_K[n] = um * kMmPerUm * days.gain * (1.0 + 0.15 * normal(random));
  }
  for (std::size_t s = 0; s < kSensors; ++s) {
    out.sensor_offset_K[s] = 0.3 * normal(random);
    out.sensor_tau_s[s] = 40.0 + 10.0 * std::abs(normal(random));  // housing and potting of a Pt100
  }
  return out;
}

struct Load {
  double rpm = 0.0;
  double feed_mm_s = 0.0;
  bool measuring = false;
  int blade = 0;
};

class Day {
 public:
  Day(const ImpellerDays& days, const MachineGains& gains, std::size_t index)
      : days_(days), gains_(gains), random_(days.day_seed * 1000003ULL + index) {
    start_degC_ = 20.0 + 1.5 * normal(random_);
    drift_degC_per_h_ = 0.5 + 0.3 * normal(random_);
    rough_rpm_ = 8000.0 * (1.0 + 0.05 * normal(random_));
    finish_rpm_ = 12000.0 * (1.0 + 0.05 * normal(random_));
    feed_mm_s_ = 40.0 * (1.0 + 0.1 * normal(random_));
    coolant_from_s_ = days.hidden_effects && normal(random_) > 0.3 ? 1.5 * kHour_s + 600.0 * normal(random_)
                                                                   : std::numeric_limits<double>::infinity();
    for (double& g : speed_gain_) g = 1.0 + 0.05 * normal(random_);
    temperature_.fill(start_degC_);
    sensor_.fill(start_degC_);
    bias_K_ = days.hidden_effects ? 0.3 * normal(random_) : 0.0;
  }

  void run(std::size_t index, SimulatedDays& out) {
    LogRun run;
    run.id = "impeller" + std::to_string(index + 1);
    run.temperature_degC.resize(kSensors);
    run.channel_mm.resize(3);
    const double cycle_s = days_.blade_s + days_.measurement_s;
    const auto rows = static_cast<std::size_t>(days_.blades * cycle_s / days_.step_s) + 1;
    std::vector<Vec3> drift;
    for (std::size_t row = 0; row < rows; ++row) {
      const double t = static_cast<double>(row) * days_.step_s;
      const Load load = load_at(t);
      if (row > 0) step(t, load);
      drift.push_back(drift_now(load));
      record(t, load, drift.back(), run);
    }
    for (int blade = 1; blade <= days_.blades; ++blade) {
      const double begin = (blade - 1) * cycle_s;
      out.blades.push_back({index, blade, begin, begin + days_.blade_s});
    }
    out.log.runs.push_back(std::move(run));
    // Zero is what was probed at the cold start.
    for (std::size_t i = drift.size(); i-- > 0;) drift[i] -= drift[0];
    out.drift_mm.push_back(std::move(drift));
  }

 private:
  Load load_at(double t) const {
    const double cycle_s = days_.blade_s + days_.measurement_s;
    const double in_cycle = std::fmod(t, cycle_s);
    const int blade = static_cast<int>(t / cycle_s) + 1;
    if (in_cycle >= days_.blade_s || blade > days_.blades)
      return {0.0, 0.0, true, std::min(blade, days_.blades)};
    // Two thirds roughing, then finishing.
    const bool rough = in_cycle < 0.6 * days_.blade_s;
    return {rough ? rough_rpm_ : finish_rpm_, rough ? feed_mm_s_ : 0.7 * feed_mm_s_, false, blade};
  }

  void step(double t, const Load& load) {
    const double ambient =
        start_degC_ + drift_degC_per_h_ * t / kHour_s + 0.4 * std::sin(kTwoPi * t / (0.7 * kHour_s));
    const double speed = std::pow(load.rpm / 12000.0, 1.5);
    const double feed = load.feed_mm_s / 40.0;
    const double coolant_K = t > coolant_from_s_ ? -1.5 : 0.0;
    for (std::size_t n = 0; n < kNodes; ++n) {
      double target = ambient + speed_gain_[n] * kSpeedGain_K[n] * speed + kFeedGain_K[n] * feed;
      if (n == table_c || n == trunnion_a) target += coolant_K;
      temperature_[n] += -std::expm1(-days_.step_s / kTau_s[n]) * (target - temperature_[n]);
    }
    for (std::size_t s = 0; s < kSensors; ++s) {
      double felt = temperature_[s];
      // The open door lets the air of the shop in.
      if (load.measuring) felt -= 0.15 * (temperature_[s] - ambient) + 0.2;
      // One sensor has come loose: half of what it feels is air.
      if (days_.hidden_effects && s == head) felt = 0.5 * (felt + temperature_[air]);
      sensor_[s] += -std::expm1(-days_.step_s / gains_.sensor_tau_s[s]) * (felt - sensor_[s]);
    }
  }

  Vec3 drift_now(const Load& load) const {
    Vec3 out = Vec3::Zero();
    for (std::size_t n = 0; n < kNodes; ++n)
      out += gains_.drift_mm_per_K[n] * (temperature_[n] - start_degC_);
    // What no Pt100 sees: bearings spread with the speed, at once.
    if (days_.hidden_effects) out.z() += 4e-3 * days_.gain * std::pow(load.rpm / 12000.0, 2);
    out += gains_.drift_mm_per_K[column] * bias_K_ * std::min(1.0, (temperature_[column] - start_degC_));
    return out;
  }

  void record(double t, const Load& load, const Vec3& drift, LogRun& run) {
    run.time_s.push_back(t);
    run.spindle_rpm.push_back(load.rpm);
    run.feed_mm_s.push_back(load.feed_mm_s);
    for (std::size_t s = 0; s < kSensors; ++s) {
      const double reading = sensor_[s] + gains_.sensor_offset_K[s] + 0.05 * normal(random_);
      run.temperature_degC[s].push_back(std::round(reading / 0.1) * 0.1);
    }
    // Once in each measuring pause, 20 s after its start: sensor noise 1 um, repeatability of the
    // positioning 1.5 um.
    const double in_cycle = std::fmod(t, days_.blade_s + days_.measurement_s);
    const double at = days_.blade_s + 20.0;
    const bool measured = load.measuring && in_cycle >= at && in_cycle < at + days_.step_s;
    for (std::size_t i = 0; i < 3; ++i) {
      const double noise = kMeasurementFloor_mm * normal(random_);
      run.channel_mm[i].push_back(measured ? drift[static_cast<Eigen::Index>(i)] + noise : kNotRead);
    }
  }

  const ImpellerDays& days_;
  const MachineGains& gains_;
  Random random_;
  double start_degC_ = 20.0, drift_degC_per_h_ = 0.0, rough_rpm_ = 0.0, finish_rpm_ = 0.0, feed_mm_s_ = 0.0;
  double coolant_from_s_ = 0.0, bias_K_ = 0.0;
  std::array<double, kNodes> speed_gain_{};
  std::array<double, kNodes> temperature_{};
  std::array<double, kSensors> sensor_{};
};

}  // namespace

SimulatedDays simulate(const ImpellerDays& days) {
  // Else a pause may fall between two rows, and no measurement into the log.
  TRUNNION_EXPECTS(days.step_s > 0.0 && days.step_s <= 10.0 && days.measurement_s >= 30.0);
  const MachineGains gains = machine_gains(days);
  SimulatedDays out;
  out.log.file = "simulated";
  out.log.sensors.assign(kSensorNames.begin(), kSensorNames.end());
  out.log.channels = {"dx", "dy", "dz"};
  out.log.has_speed = true;
  out.log.has_feed = true;
  for (int i = 0; i < days.impellers; ++i)
    Day(days, gains, static_cast<std::size_t>(i)).run(static_cast<std::size_t>(i), out);
  return out;
}

std::string truth_text(const SimulatedDays& days) {
  std::string out = "run_id,time_s,blade,dx_um,dy_um,dz_um\n";
  for (std::size_t r = 0; r < days.log.runs.size(); ++r) {
    const LogRun& run = days.log.runs[r];
    for (std::size_t row = 0; row < run.rows(); ++row) {
      const double t = run.time_s[row];
      const auto cutting = std::find_if(days.blades.begin(), days.blades.end(), [&](const BladeTruth& b) {
        return b.run == r && t >= b.begin_s && t < b.end_s;
      });
      out += run.id + "," + shortest_text(t) + "," +
             std::to_string(cutting == days.blades.end() ? 0 : cutting->blade);
      for (const double component : days.drift_mm[r][row]) out += "," + fixed_text(component / kMmPerUm, 3);
      out += "\n";
    }
  }
  return out;
}

std::vector<BladeResult> assess(const SimulatedDays& days, const Correction& correction) {
  std::vector<BladeResult> out;
  for (const BladeTruth& blade : days.blades) {
    const LogRun& run = days.log.runs[blade.run];
    BladeResult result(run.id, blade.blade);
    for (std::size_t row = 0; row < run.rows(); ++row) {
      if (run.time_s[row] < blade.begin_s || run.time_s[row] > blade.end_s) continue;
      const Vec3& drift = days.drift_mm[blade.run][row];
      const Vec3 left = drift - correction(blade.run, row);
      result.take(drift, left);
    }
    out.push_back(std::move(result));
  }
  return out;
}

void BladeResult::take(const Vec3& drift_mm, const Vec3& left_mm) {
  before_mm = std::max(before_mm, drift_mm.head<2>().norm());
  after_mm = std::max(after_mm, left_mm.head<2>().norm());
  moments_ += 1.0;
  const auto grow = [&](double& rms, const Vec3& d) {
    rms = std::sqrt(rms * rms + (0.5 * d.head<2>().squaredNorm() - rms * rms) / moments_);
  };
  grow(before_rms_mm, drift_mm);
  grow(after_rms_mm, left_mm);
}

double rms_mm(const std::vector<BladeResult>& blades, double BladeResult::*deviation) {
  double sum = 0.0;
  for (const BladeResult& b : blades) sum += b.*deviation * b.*deviation;
  return blades.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(blades.size()));
}

double share_within(const std::vector<BladeResult>& blades, double BladeResult::*deviation,
                    double tolerance_mm) {
  const auto within = std::count_if(blades.begin(), blades.end(),
                                    [&](const BladeResult& b) { return b.*deviation <= tolerance_mm; });
  return blades.empty() ? 0.0 : static_cast<double>(within) / static_cast<double>(blades.size());
}

}  // namespace trunnion::thermal
