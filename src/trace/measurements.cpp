#include "trunnion/trace/measurements.hpp"

#include <algorithm>
#include <cmath>

#include "trunnion/base/number_text.hpp"
#include "trunnion/base/units.hpp"

namespace trunnion::trace {
namespace {

constexpr int kPlaces = 6;
constexpr double kLeastUncertainty = 0.005;  // um, urad: a trace has no more digits

// What is read: the tip's place along an axis of the machine, or a turn about a rotary axis.
struct Channel {
  bool rotation = false;
  Vec3 n = Vec3::UnitX();
};

std::vector<Channel> channels_of(const Machine& machine) {
  constexpr std::size_t kLinear = 3;
  std::vector<Channel> out;
  out.reserve(kLinear + machine.rotary_axes().size());
  for (int i = 0; i < 3; ++i) out.push_back({false, Vec3::Unit(i)});
  for (const AxisId id : machine.rotary_axes()) out.push_back({true, machine.axes[id].direction});
  return out;
}

// A sample as it is read in every channel.
class Readings {
 public:
  Readings(const Machine& machine, const std::vector<Channel>& channels, const FollowedSample& sample)
      : machine_(machine),
        channels_(channels),
        sample_(sample),
        tool_(0.0, 0.0, -sample.length_mm),
        wanted_(forward(machine, sample.commanded, tool_)),
        R_MP_(part_in_machine(machine, sample.commanded).R) {}

  // Of the machine at `q`, um and urad.
  std::vector<double> at(const JointVector& q) const {
    const Pose actual = forward(machine_, q, tool_);
    const Vec3 d_M = R_MP_ * (actual.p - wanted_.p);
    const Vec3 r_M = R_MP_ * rotation_vector(actual.R * wanted_.R.transpose());
    std::vector<double> out;
    out.reserve(channels_.size());
    for (const Channel& channel : channels_)
      out.push_back(channel.rotation ? channel.n.dot(r_M) / kRadPerUrad : channel.n.dot(d_M) / kMmPerUm);
    return out;
  }

  std::vector<double> uncertainties() const {
    std::vector<double> out(channels_.size(), kLeastUncertainty);
    for (const JointVector& by : sample_.unsure) {
      JointVector q = sample_.commanded;
      for (AxisId id = 0; id < machine_.axes.size(); ++id) q[id] += by[id];
      const std::vector<double> values = at(q);
      for (std::size_t c = 0; c < out.size(); ++c) out[c] = std::hypot(out[c], values[c]);
    }
    return out;
  }

 private:
  const Machine& machine_;
  const std::vector<Channel>& channels_;
  const FollowedSample& sample_;
  Vec3 tool_;
  Pose wanted_;
  Mat3 R_MP_;
};

std::string axis_fields(const FollowedSample& sample, const Machine& machine) {
  std::string out;
  for (AxisId id = 0; id < machine.axes.size(); ++id) {
    const double unit = machine.axes[id].kind == AxisKind::linear ? 1.0 : kDegreePerRad;
    out += fixed_text(sample.commanded[id] * unit, kPlaces) + "," +
           std::to_string(static_cast<int>(sample.direction[id])) + "," +
           fixed_text(sample.velocity[id] * unit * kSecondsPerMinute, 3) + ",";
  }
  return out;
}

std::string header(const Machine& machine) {
  std::string out = "run_id,time_s,";
  for (const Axis& axis : machine.axes) {
    const std::string unit = axis.kind == AxisKind::linear ? "_mm" : "_deg";
    out += axis.name + unit + ",dir_" + axis.name + ",vel_" + axis.name + unit + "_min,";
  }
  return out + "tool_x_mm,tool_y_mm,tool_z_mm,quantity,n_x,n_y,n_z,value,unit,u_random\n";
}

// Rows evenly over the trace, and where an axis has reversed those that show what it does then: the first one
// with the new sense in any case (what remembers the reversal counts from it), and ever fewer behind it.
std::vector<std::size_t> chosen_rows(const std::vector<FollowedSample>& samples, std::size_t most) {
  constexpr double kBehind_s = 0.06, kNearest_s = 0.0005, kThinner = 0.3;
  constexpr std::size_t kRowsEach = 14;  // behind a reversal, about
  std::vector<bool> chosen(samples.size(), false);
  std::vector<std::size_t> reversals, readings;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].is_reading) readings.push_back(i);
    const bool is_first = i == 0 || samples[i].cut != samples[i - 1].cut;
    chosen[i] = is_first || !(samples[i].direction == samples[i - 1].direction);
    if (chosen[i] && !is_first) reversals.push_back(i);
  }
  const std::size_t each = 1 + 2 * kRowsEach * reversals.size() / std::max<std::size_t>(1, most);
  std::size_t count = 0;
  for (std::size_t k = 0; k < reversals.size(); k += each) {
    const std::size_t first = reversals[k];
    double next_s = kNearest_s;
    for (std::size_t i = first + 1; i < samples.size(); ++i) {
      const double t = samples[i].time_s - samples[first].time_s;
      if (t > kBehind_s) break;
      if (t < next_s || !samples[i].is_reading) continue;
      next_s = t + std::max(kNearest_s, kThinner * t);
      count += chosen[i] ? 0U : 1U;
      chosen[i] = true;
    }
  }
  const std::size_t left = std::max<std::size_t>(most / 2, most - std::min(most, count));
  const std::size_t every = std::max<std::size_t>(1, (readings.size() + left - 1) / left);
  for (std::size_t k = 0; k < readings.size(); k += every) chosen[readings[k]] = true;
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (chosen[i]) out.push_back(i);
  return out;
}

}  // namespace

Result<std::string> measurements_of(const Trace& trace, const Machine& machine, const Plan& plan,
                                    const AsMeasurements& how) {
  const auto samples = follow(trace, machine, plan);
  if (!samples) return tl::unexpected(samples.error());
  const std::vector<Channel> channels = channels_of(machine);
  std::string out = "# trace " + trace.file +
                    " along its program; the delay that all axes share is taken out\n" + header(machine);
  for (const std::size_t i : chosen_rows(*samples, how.most_rows)) {
    const FollowedSample& sample = (*samples)[i];
    const std::string head = how.run_id + "-" + std::to_string(sample.cut) + "," +
                             fixed_text(sample.time_s - samples->front().time_s, kPlaces) + "," +
                             axis_fields(sample, machine) + "0,0," + fixed_text(-sample.length_mm, kPlaces) +
                             ",";
    if (!sample.is_reading) {
      out += head + ",,,,,,\n";
      continue;
    }
    const Readings readings(machine, channels, sample);
    const std::vector<double> values = readings.at(sample.actual), unsure = readings.uncertainties();
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const Channel& channel = channels[c];
      out += head + (channel.rotation ? "rotation," : "displacement,") + fixed_text(channel.n.x(), 9) + "," +
             fixed_text(channel.n.y(), 9) + "," + fixed_text(channel.n.z(), 9) + "," +
             fixed_text(values[c], 4) + (channel.rotation ? ",urad," : ",um,") + fixed_text(unsure[c], 4) +
             "\n";
    }
  }
  return out;
}

}  // namespace trunnion::trace
