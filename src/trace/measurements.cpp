#include "trunnion/trace/measurements.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

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

constexpr std::size_t kLinear = 3;  // channels of the tip's place, before those of turns

std::vector<Channel> channels_of(const Machine& machine) {
  std::vector<Channel> out;
  out.reserve(kLinear + machine.rotary_axes().size());
  for (std::size_t i = 0; i < kLinear; ++i) out.push_back({false, Vec3::Unit(static_cast<int>(i))});
  for (const AxisId id : machine.rotary_axes()) out.push_back({true, machine.axes[id].direction});
  return out;
}

// A sample as it is read in a channel.
class Reading {
 public:
  Reading(const Machine& machine, const Channel& channel, const FollowedSample& sample)
      : machine_(machine),
        channel_(channel),
        sample_(sample),
        tool_(0.0, 0.0, -sample.length_mm),
        wanted_(forward(machine, sample.commanded, tool_)),
        R_MP_(part_in_machine(machine, sample.commanded).R) {}

  double value() const { return at(sample_.actual); }
  double uncertainty() const {
    double out = kLeastUncertainty;
    for (const JointVector& by : sample_.unsure) {
      JointVector q = sample_.commanded;
      for (AxisId id = 0; id < machine_.axes.size(); ++id) q[id] += by[id];
      out = std::hypot(out, at(q));
    }
    return out;
  }

 private:
  // Of the machine at `q`, um and urad.
  double at(const JointVector& q) const {
    const Pose actual = forward(machine_, q, tool_);
    return channel_.rotation
               ? channel_.n.dot(R_MP_ * rotation_vector(actual.R * wanted_.R.transpose())) / kRadPerUrad
               : channel_.n.dot(R_MP_ * (actual.p - wanted_.p)) / kMmPerUm;
  }

  const Machine& machine_;
  const Channel& channel_;
  const FollowedSample& sample_;
  Vec3 tool_;
  Pose wanted_;
  Mat3 R_MP_;
};

// The channel that shows most of an axis.
std::size_t channel_of(const Machine& machine, AxisId id) {
  const auto& rotary = machine.rotary_axes();
  const auto at = std::find(rotary.begin(), rotary.end(), id);
  if (at != rotary.end()) return kLinear + static_cast<std::size_t>(at - rotary.begin());
  Eigen::Index most = 0;
  machine.axes[id].direction.cwiseAbs().maxCoeff(&most);
  return static_cast<std::size_t>(most);
}

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

// A line of the file: a sample, and the channel in which it is read; none: it says how the axes came there.
struct Chosen {
  std::size_t sample;
  std::optional<std::size_t> channel;
};

// Rows evenly over the trace, and where an axis has reversed those that show what it does then: the first one
// with the new sense in any case (what remembers the reversal counts from it), and ever fewer behind it.
//
// Readings are to be independent. Means of the same rows scatter together, so no two readings are of the same
// row; and where an axis errs, the tip errs with it along two or three directions, so a moment is read once:
// behind a reversal what shows that axis, elsewhere all channels in turn.
class Choice {
 public:
  Choice(const Machine& machine, const std::vector<FollowedSample>& samples, std::size_t channels)
      : machine_(machine), samples_(samples), channels_(channels), of_axis_(samples.size()) {}

  std::vector<Chosen> of(std::size_t most) {
    std::vector<bool> chosen(samples_.size(), false);
    std::vector<std::size_t> readings;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (samples_[i].is_reading) readings.push_back(i);
      chosen[i] = begins_cut(i) || reverses(i);
    }
    const std::size_t count = add_behind_reversals(most, chosen);
    const std::size_t left = std::max<std::size_t>(most / 2, most - std::min(most, count));
    const std::size_t every = std::max<std::size_t>(1, (readings.size() + left - 1) / left);
    for (std::size_t k = 0; k < readings.size(); k += every) chosen[readings[k]] = true;
    std::vector<Chosen> out;
    std::size_t next_row = 0, turn = 0;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (!chosen[i]) continue;
      out.push_back({i, std::nullopt});
      if (!samples_[i].is_reading || samples_[i].first_row < next_row) continue;
      next_row = samples_[i].last_row + 1;
      out.back().channel = of_axis_[i] ? *of_axis_[i] : turn++ % channels_;
    }
    return out;
  }

 private:
  bool begins_cut(std::size_t i) const { return i == 0 || samples_[i].cut != samples_[i - 1].cut; }
  bool reverses(std::size_t i) const {
    return !begins_cut(i) && !(samples_[i].direction == samples_[i - 1].direction);
  }

  std::size_t add_behind_reversals(std::size_t most, std::vector<bool>& chosen) {
    constexpr double kBehind_s = 0.06, kThinner = 0.2;
    constexpr std::size_t kRowsEach = 8;  // about
    std::vector<std::size_t> reversals;
    for (std::size_t i = 0; i < samples_.size(); ++i)
      if (reverses(i)) reversals.push_back(i);
    const std::size_t each = 1 + 2 * kRowsEach * reversals.size() / std::max<std::size_t>(1, most);
    std::size_t count = 0;
    for (std::size_t k = 0; k < reversals.size(); k += each) {
      const std::size_t first = reversals[k];
      const std::vector<std::size_t> channels = reversed_channels(first);
      double next_s = 0.0;
      std::size_t next_row = 0, turn = 0;
      for (std::size_t i = first + 1; i < samples_.size(); ++i) {
        const double t = samples_[i].time_s - samples_[first].time_s;
        if (t > kBehind_s) break;
        if (t < next_s || samples_[i].first_row < next_row || !samples_[i].is_reading) continue;
        next_s = (1.0 + kThinner) * t;
        next_row = samples_[i].last_row + 1;
        of_axis_[i] = channels[turn++ % channels.size()];
        count += chosen[i] ? 0U : 1U;
        chosen[i] = true;
      }
    }
    return count;
  }

  std::vector<std::size_t> reversed_channels(std::size_t i) const {
    std::vector<std::size_t> out;
    for (AxisId id = 0; id < machine_.axes.size(); ++id)
      if (samples_[i].direction[id] != samples_[i - 1].direction[id]) out.push_back(channel_of(machine_, id));
    return out;
  }

  const Machine& machine_;
  const std::vector<FollowedSample>& samples_;
  std::size_t channels_;
  std::vector<std::optional<std::size_t>> of_axis_;  // the channel of an axis that has reversed before
};

}  // namespace

Result<TraceMeasurements> measurements_of(const Trace& trace, const Machine& machine, const Plan& plan,
                                          const AsMeasurements& how) {
  const auto followed = follow(trace, machine, plan);
  if (!followed) return tl::unexpected(followed.error());
  const std::vector<FollowedSample>& samples = followed->samples;
  const std::vector<Channel> channels = channels_of(machine);
  std::string out = "# trace " + trace.file +
                    " along its program; the delay that all axes share is taken out\n" + header(machine);
  for (const Chosen& chosen : Choice(machine, samples, channels.size()).of(how.most_rows)) {
    const FollowedSample& sample = samples[chosen.sample];
    out += how.run_id + "-" + std::to_string(sample.cut) + "," +
           fixed_text(sample.time_s - samples.front().time_s, kPlaces) + "," + axis_fields(sample, machine) +
           "0,0," + fixed_text(-sample.length_mm, kPlaces) + ",";
    if (!chosen.channel) {
      out += ",,,,,,\n";
      continue;
    }
    const Channel& channel = channels[*chosen.channel];
    const Reading reading(machine, channel, sample);
    out += (channel.rotation ? "rotation," : "displacement,") + fixed_text(channel.n.x(), 9) + "," +
           fixed_text(channel.n.y(), 9) + "," + fixed_text(channel.n.z(), 9) + "," +
           fixed_text(reading.value(), 4) + (channel.rotation ? ",urad," : ",um,") +
           fixed_text(reading.uncertainty(), 4) + "\n";
  }
  return TraceMeasurements{std::move(out), followed->lag_of_all_axes_s, followed->sigma_s};
}

}  // namespace trunnion::trace
